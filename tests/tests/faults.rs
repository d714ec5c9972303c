//! What breaks in the window must not take the window along: it becomes a banner, the log stays,
//! and the scene can be opened again.

use std::{
    cell::RefCell,
    rc::Rc,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use bevy_app::{App, Update};
use bevy_ecs::prelude::*;
use egui_kittest::{Harness, kittest::Queryable};
use intrados_light::{Render, plugin::MeasureSettings};
use intrados_panels::{Action, Actions, AddPanel, Banners, Log, PanelsPlugin, Place, Window};
use intrados_scene::plugin::CurrentScene;
use intrados_stage::{Jobs, Stage, Task};

/// Shared by all worlds that are built after each other.
#[derive(Resource, Clone, Default)]
struct Armed {
    system: Arc<AtomicBool>,
    panel: Arc<AtomicBool>,
    task: Arc<AtomicBool>,
}

fn system(armed: Res<Armed>) {
    assert!(!armed.system.load(Ordering::Relaxed), "the system broke on purpose");
}

fn panel(InMut(ui): InMut<egui::Ui>, armed: Res<Armed>) {
    ui.horizontal(|ui| {
        assert!(!armed.panel.swap(false, Ordering::Relaxed), "the panel broke on purpose");
        ui.label("all is well");
    });
}

#[derive(Resource, Default)]
struct Work(Option<Task<u8>>);

fn work(armed: Res<Armed>, mut work: ResMut<Work>, mut jobs: ResMut<Jobs>) {
    if armed.task.swap(false, Ordering::Relaxed) {
        work.0 = Some(Task::spawn(&mut jobs, "counting backwards", |_| {
            panic!("the work broke on purpose")
        }));
    }
}

struct Rig {
    armed: Armed,
    window: Rc<RefCell<Window>>,
    harness: Harness<'static>,
}

impl Rig {
    /// With a scene whose picture has begun.
    fn new() -> Self {
        let armed = Armed::default();
        let theirs = armed.clone();
        let build = move || {
            let mut app: App = intrados::simulation();
            app.add_plugins(PanelsPlugin::default())
                .insert_resource(theirs.clone())
                .init_resource::<Work>()
                .add_systems(Update, (system, work).in_set(Stage::Damage))
                .add_panel(Place::Right, "Fragile", panel);
            app.world_mut().resource_mut::<MeasureSettings>().enabled = false;
            app
        };
        let window = Rc::new(RefCell::new(Window::new(build)));
        let theirs = Rc::clone(&window);
        let harness = Harness::builder()
            .with_size([1280.0, 800.0])
            .build_ui(move |ui| theirs.borrow_mut().show(ui));
        let mut rig = Self { armed, window, harness };
        rig.with(|w| w.resource_mut::<Actions>().ask(Action::Open("cornell".into())));
        rig.until("a picture", |rig| rig.walks() > 0);
        rig
    }

    fn with<T>(&self, f: impl FnOnce(&mut World) -> T) -> T {
        f(self.window.borrow_mut().world())
    }

    fn frame(&mut self) {
        self.window.borrow_mut().update();
        self.harness.step();
    }

    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            self.frame();
            if done(self) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        panic!("{what} did not happen");
    }

    fn walks(&self) -> u64 {
        self.with(|w| {
            w.get_resource::<Render>()
                .map_or(0, |r| r.exposures().iter().flatten().map(|e| e.walks).sum())
        })
    }

    fn says(&self, text: &str) -> bool {
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    fn logged(&self, text: &str) -> usize {
        self.with(|w| w.resource::<Log>().lines().iter().filter(|line| line.contains(text)).count())
    }

    fn reload(&mut self) {
        self.harness.query_all_by_label("Reload scene").next().expect("it can be reloaded").click();
        self.frame();
        self.until("the scene once more", |rig| {
            rig.walks() > 0
                && rig.with(|w| {
                    w.get_resource::<CurrentScene>().is_some_and(|s| s.0.name == "cornell")
                })
        });
        self.frame();
    }
}

#[test]
fn a_system_that_panics_closes_the_scene_and_not_the_window() {
    let mut rig = Rig::new();
    rig.armed.system.store(true, Ordering::Relaxed);
    // It breaks in every frame: that is said once, and the window stands.
    for _ in 0..5 {
        rig.frame();
    }
    assert!(
        rig.says("the system broke on purpose") && rig.says("Open…"),
        "no banner over the start screen"
    );
    assert!(rig.with(|w| w.get_resource::<CurrentScene>().is_none()));
    assert_eq!((rig.logged("opened cornell"), rig.logged("the system broke on purpose")), (1, 1));
    assert_eq!(rig.logged("faults.rs"), 1, "the log says where");
    rig.armed.system.store(false, Ordering::Relaxed);
    rig.reload();
    assert!(!rig.says("the system broke on purpose") && rig.says("all is well"));
    assert_eq!((rig.logged("opened cornell"), rig.logged("the system broke on purpose")), (2, 1));
}

#[test]
fn a_panel_that_panics_takes_only_itself_along() {
    let mut rig = Rig::new();
    assert!(rig.says("all is well"));
    rig.armed.panel.store(true, Ordering::Relaxed);
    rig.frame();
    rig.frame();
    let before = rig.walks();
    rig.frame();
    assert!(rig.walks() > before, "the picture goes on");
    assert!(
        rig.says("The panel “Fragile” broke off")
            && rig.says("the panel broke on purpose")
            && rig.says("brings it back")
    );
    assert!(!rig.says("all is well") && rig.says("Members"));
    rig.reload();
    assert!(rig.says("all is well") && rig.logged("the panel broke on purpose") == 1);
}

#[test]
fn work_off_the_frame_that_panics_says_so() {
    let mut rig = Rig::new();
    rig.armed.task.store(true, Ordering::Relaxed);
    rig.until("a banner", |rig| rig.says("the work broke on purpose"));
    assert!(
        rig.says("“counting backwards” broke off") && rig.logged("the work broke on purpose") == 1
    );
    assert!(rig.with(|w| w.get_resource::<CurrentScene>().is_some()), "the scene stays open");
    rig.harness.get_by_label("Dismiss").click();
    rig.frame();
    rig.frame();
    assert!(!rig.says("the work broke on purpose"));
    let said = rig.with(|w| w.resource::<Banners>().lines());
    assert!(said.is_empty(), "{said:?}");
}
