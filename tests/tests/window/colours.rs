//! Colours of numbers: one map for the whole window, bands, and ranges that are locked.

use std::{collections::BTreeSet, path::Path};

use egui_kittest::kittest::Queryable;
use intrados_light::{
    Render,
    tone::{ABOVE, BELOW, ColourMap},
};
use intrados_mechanics::plugin::Analyses;
use intrados_panels::{Action, Colours, Look, PanelsPlugin, Quantity, Viewpoint, Workspace};
use intrados_stage::Work;

use super::{Window, stress_of};

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
