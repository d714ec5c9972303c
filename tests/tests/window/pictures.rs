//! Pictures of every tab and dialog in both themes, against stored ones. `INTRADOS_WRITE_PICTURES=1`
//! stores them anew, to be looked at.

use std::{fs, path::Path};

use egui::ThemePreference;
use egui_kittest::kittest::Queryable;
use image::RgbImage;
use intrados_panels::{Action, Latest, Refine, Taken, Workspace};

use super::{Window, forms::with_seen, rest};

/// Of a pixel's channel that counts as another one, of 255.
const ANOTHER: u8 = 24;
/// Share of the pixels that may be others: a blinking cursor, a bar of progress.
const FEW: f64 = 2e-3;
/// Frames until nothing moves any more.
const SETTLED: usize = 40;

/// Compares a picture with the stored one of its name.
fn compare(name: &str, picture: &RgbImage, wrong: &mut Vec<String>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/window/pictures");
    let stored = folder.join(format!("{name}.png"));
    if std::env::var_os("INTRADOS_WRITE_PICTURES").is_some() {
        fs::create_dir_all(&folder).expect("a folder for pictures");
        picture.save(&stored).expect("stored");
        return;
    }
    let others = image::open(&stored).ok().map(|stored| {
        let stored = stored.into_rgb8();
        let is_other = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| {
            a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > ANOTHER)
        };
        if stored.dimensions() != picture.dimensions() {
            return 1.0;
        }
        let others = stored.pixels().zip(picture.pixels()).filter(|pair| is_other(*pair)).count();
        others as f64 / (picture.width() * picture.height()) as f64
    });
    if others.is_none_or(|others| others > FEW) {
        let now = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
        picture.save(&now).expect("saved");
        let share = others.map_or("there is no stored one".into(), |o| {
            format!("{:.2} % of its pixels are others", 100.0 * o)
        });
        wrong.push(format!("{name}: {share}; it is {}", now.display()));
    }
}

/// A window at rest, opened on a column of which a crack has been seen.
pub(super) fn at_rest() -> (Window, tempfile::TempDir) {
    let (mut window, folder) = with_seen();
    window.with(|w| w.resource_mut::<Refine>().paused = true);
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    while window.harness.query_by_label_contains("is done").is_some() {
        window.frame();
        rest();
    }
    (window, folder)
}

/// What is seen once nothing moves any more, half as large, which shows as well what has changed.
fn settled(window: &mut Window) -> RgbImage {
    // Pictures of members are drawn off the frame.
    for _ in 0..SETTLED {
        window.frame();
        rest();
    }
    image::imageops::thumbnail(&window.picture(), 640, 400)
}

#[test]
fn every_tab_and_dialog_looks_as_it_did() {
    let mut wrong = Vec::new();
    let mut start = Window::new(|_| {});
    let (mut window, _folder) = at_rest();
    for (theme, called) in [(ThemePreference::Light, "light"), (ThemePreference::Dark, "dark")] {
        let mut shot = |window: &mut Window, name: &str| {
            let mut picture = settled(window);
            if name == "expert" {
                // Below are plots over the CPU time that was taken.
                picture = image::imageops::crop_imm(&picture, 0, 0, 640, 278).to_image();
            }
            compare(&format!("{name}-{called}"), &picture, &mut wrong);
        };
        start.ask(Action::Theme(theme));
        shot(&mut start, "start");
        window.ask(Action::Theme(theme));
        window.ask(Action::Arrange(Workspace::Inspector));
        window.ask(Action::Tab("Structure"));
        shot(&mut window, "structure");
        for (name, action) in [
            ("keys", Action::Keys),
            ("palette", Action::Palette),
            ("new", Action::New),
            ("save", Action::Save(Taken::Report)),
            ("attach", Action::Fill(Vec::new(), None)),
        ] {
            window.ask(action.clone());
            shot(&mut window, name);
            // The palette is put away as it came.
            let away = if name == "palette" { action } else { Action::Dismiss };
            window.ask(away);
            window.frames(2);
        }
        for tab in ["Photos", "CT", "Stress"] {
            window.ask(Action::Tab(tab));
            shot(&mut window, &tab.to_lowercase());
        }
        window.ask(Action::Arrange(Workspace::Expert));
        window.ask(Action::Tab("Structure"));
        shot(&mut window, "expert");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
