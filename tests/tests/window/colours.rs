//! Colours of numbers: one map for the whole window, bands, ranges that are locked, and legends under
//! pictures that are saved.

use std::{collections::BTreeSet, path::Path};

use egui_kittest::kittest::Queryable;
use intrados_light::{
    Render,
    tone::{ABOVE, BELOW, ColourMap},
};
use intrados_mechanics::plugin::Analyses;
use intrados_panels::{Action, Colours, Log, Look, PanelsPlugin, Quantity, Viewpoint, Workspace};
use intrados_stage::Work;

use super::{Window, export, stress_of, type_into};

/// All colours that are seen somewhere.
fn seen(window: &Window) -> BTreeSet<[u8; 3]> {
    window.picture().pixels().map(|p| p.0).collect()
}

/// Whether a legend of `count` colours of this map is among them.
fn has(seen: &BTreeSet<[u8; 3]>, map: ColourMap, count: u8) -> bool {
    (0..count).all(|k| {
        let t = match count {
            64 => (f32::from(k) + 0.5) / 64.0,
            _ => f32::from(k) / f32::from(count - 1),
        };
        // The logarithm of a power may miss the next byte.
        let [r, g, b] = map.at(t);
        let near = |x: u8| x.saturating_sub(1)..=x.saturating_add(1);
        near(r).any(|r| near(g).any(|g| near(b).any(|b| seen.contains(&[r, g, b]))))
    })
}

/// A window that keeps its layout here, and its picture of errors.
fn with_errors(layout: &Path) -> Window {
    let mut app = intrados::simulation();
    app.add_plugins(PanelsPlugin { layout: Some(layout.into()), ..PanelsPlugin::default() });
    let mut window = Window::of(app);
    window.ask(Action::Arrange(Workspace::Expert));
    window.ask(Action::Open("cornell".into()));
    window.ask(Action::ShowQuantity(Quantity::Error));
    window.until("a picture", |w| {
        !w.resource::<Viewpoint>().is_preview()
            && w.get_resource::<Render>().is_some_and(|r| r.samples_per_pixel() > 0.0)
    });
    window.frames(2);
    window
}

/// A map that is chosen in the palette is that of the picture's legend, and of the next session.
#[test]
fn colours_are_chosen_once_and_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let layout = folder.path().join("layout.json");
    let mut window = with_errors(&layout);
    let before = seen(&window);
    assert!(has(&before, ColourMap::Viridis, 64) && !has(&before, ColourMap::Cividis, 64));
    window.ask(Action::Palette);
    window.frames(2);
    window.harness.event(egui::Event::Text("cividis".into()));
    window.frames(2);
    window.harness.key_press(egui::Key::Enter);
    window.frames(3);
    assert_eq!(window.with(|w| w.resource::<Look>().colours.map), ColourMap::Cividis);
    let after = seen(&window);
    assert!(has(&after, ColourMap::Cividis, 64) && !has(&after, ColourMap::Viridis, 64));
    window.ask(Action::Colours(Colours { map: ColourMap::Cividis, bands: 5 }));
    // The picture is developed anew as a whole where its look changes.
    window.frames(3);
    let banded = seen(&window);
    assert!(has(&banded, ColourMap::Cividis, 5) && !has(&banded, ColourMap::Cividis, 64));
    drop(window);
    let window = with_errors(&layout);
    let kept = window.with(|w| w.resource::<Look>().colours);
    assert_eq!(kept, Colours { map: ColourMap::Cividis, bands: 5 });
    assert!(has(&seen(&window), ColourMap::Cividis, 5));
}

/// Of a range that is locked the legend says which colours lie beyond; its ends are shown as numbers.
#[test]
fn a_locked_range_has_colours_for_what_lies_beyond() {
    let mut window = Window::with_scene("column");
    stress_of(&mut window, 0, 0.2);
    window.until("an outcome", |w| {
        w.resource::<Analyses>().get("C1").is_some_and(|a| matches!(a.work, Work::Done(_)))
    });
    window.frames(4);
    let clipped = |window: &Window| [BELOW, ABOVE].map(|c| seen(window).contains(&c));
    assert_eq!(clipped(&window), [false; 2]);
    window.click("Lock the range");
    window.frames(2);
    assert_eq!(clipped(&window), [true; 2]);
    for end in ["from", "to"] {
        assert!(window.harness.query_by_label(end).is_some(), "{end}");
    }
    window.click("Lock the range");
    window.frames(2);
    assert_eq!(clipped(&window), [false; 2]);
}

/// All colours beneath the first rows of a picture that was saved.
fn beneath(file: &Path, rows: u32) -> BTreeSet<[u8; 3]> {
    let picture = image::open(file).expect("a picture").into_rgb8();
    assert!(picture.height() > rows, "nothing is under the picture");
    picture.enumerate_pixels().filter(|(_, y, _)| *y >= rows).map(|(_, _, p)| p.0).collect()
}

/// A picture in false colour that is saved has its legend under it; one of light needs none.
#[test]
fn a_saved_picture_of_errors_says_what_its_colours_mean() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = with_errors(&folder.path().join("layout.json"));
    let [errors, light] = ["errors.png", "light.png"].map(|name| folder.path().join(name));
    export(&mut window, &errors);
    let rows = window.with(|w| w.resource::<Render>().camera().height);
    let legend = beneath(&errors, rows);
    assert!(has(&legend, ColourMap::Viridis, 64), "{} colours", legend.len());
    assert!(legend.contains(&ColourMap::Viridis.unknown()));
    window.ask(Action::ShowQuantity(Quantity::Radiance));
    window.frames(3);
    export(&mut window, &light);
    assert_eq!(image::image_dimensions(&light).expect("a picture").1, rows);
}

/// The legend under a picture of stress has a scale of colours, and names those of what lies beyond
/// a range that is locked.
#[test]
fn a_saved_picture_of_stress_says_what_its_colours_mean() {
    let mut window = Window::with_scene("column");
    stress_of(&mut window, 0, 0.2);
    window.until("an outcome", |w| {
        w.resource::<Analyses>().get("C1").is_some_and(|a| matches!(a.work, Work::Done(_)))
    });
    window.frames(4);
    let folder = tempfile::tempdir().expect("a folder");
    let saved = |window: &mut Window, name: &str| {
        let file = folder.path().join(name);
        let rect = window.harness.get_by_label_contains("Stress: Largest principal").rect();
        type_into(window, "Save as", &file.display().to_string());
        window.click("Save picture or table");
        window.until("the picture", |w| {
            let lines = w.resource::<Log>().lines();
            lines.iter().any(|line| line.starts_with("wrote") && line.contains(name))
        });
        beneath(&file, rect.height().ceil() as u32)
    };
    let beyond = |seen: &BTreeSet<[u8; 3]>| [BELOW, ABOVE].map(|c| seen.contains(&c));
    let is_grey = |c: &&[u8; 3]| c.iter().max().zip(c.iter().min()).is_none_or(|(a, b)| a - b < 30);
    let free = saved(&mut window, "free.png");
    assert!(free.iter().filter(|c| !is_grey(c)).count() > 15, "{free:?}");
    assert_eq!(beyond(&free), [false; 2]);
    window.click("Lock the range");
    window.frames(4);
    assert_eq!(beyond(&saved(&mut window, "locked.png")), [true; 2]);
}
