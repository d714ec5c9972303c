//! A hand that knows no reason: random gestures through real input, and the window must stand.
//! Everything that a gesture does is a function of the seed and of its number; what fails says
//! both, and `INTRADOS_GESTURES="SEED FROM TO"` does these alone, verbosely.

use std::{cell::RefCell, path::Path, rc::Rc};

use bevy_app::App;
use egui::{
    Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, TouchPhase, Vec2,
    pos2, vec2,
};
use egui_kittest::{Harness, kittest::Queryable};
use intrados_light::{LightPlugin, Render};
use intrados_panels::{Action, Actions, Banners, PanelsPlugin, Window};
use intrados_predict::{PredictPlugin, PredictSettings};
use intrados_scene::{Member, Scene, plugin::install};
use intrados_stage::{Job, Jobs, Pace, random::Key as Random};
use intrados_transport::{BATCH, Schedule};

/// Gestures in the plain test; ten times as many behind `--ignored`.
const GESTURES: u64 = 1_000;
const SEED: u64 = 16;

/// Bundled scenes with pictures so small that a frame is cheap, and one so large that a preview
/// goes before it.
const SCENES: [(&str, [u32; 2]); 5] = [
    ("cornell", [96, 96]),
    ("column", [360, 225]),
    ("slit", [64, 64]),
    ("beam", [320, 200]),
    ("room", [400, 250]),
];

/// A window whose scenes are cheap to look at: slices by the local threshold, no lives, lessons of
/// one round.
fn build() -> App {
    let mut app = App::new();
    app.add_plugins((
        intrados_stage::StagePlugin,
        intrados_scene::ScenePlugin,
        LightPlugin::default(),
        intrados_mechanics::MechanicsPlugin,
        intrados_xray::XrayPlugin,
        PredictPlugin {
            settings: PredictSettings { forecast: None, ..PredictSettings::default() },
        },
        PanelsPlugin {
            slice: Some(std::time::Duration::from_millis(1)),
            ..PanelsPlugin::default()
        },
    ));
    app.world_mut().resource_mut::<intrados_light::plugin::Learning>().schedule =
        Schedule { first: BATCH, rounds: 1 };
    app
}

struct Hand {
    window: Rc<RefCell<Window>>,
    harness: Harness<'static>,
    scenes: Vec<Scene>,
    size: Vec2,
}

/// The random numbers of one gesture, one after another.
struct Dice(Random, u32);

impl Dice {
    fn unit(&mut self) -> f32 {
        self.1 += 1;
        self.0.unit(self.1)
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    fn place(&mut self, size: Vec2) -> Pos2 {
        // A little beyond the window, too.
        pos2(size.x * (1.02 * self.unit() - 0.01), size.y * (1.02 * self.unit() - 0.01))
    }
}

impl Hand {
    fn new() -> Self {
        let window = Rc::new(RefCell::new(Window::new(build)));
        let theirs = Rc::clone(&window);
        let size = vec2(1280.0, 800.0);
        let harness = Harness::builder()
            .with_size(size)
            .with_max_steps(8)
            .build_ui(move |ui| theirs.borrow_mut().show(ui));
        let open = |&(name, [width, height]): &(&str, [u32; 2])| {
            let mut scene = Scene::open(Path::new(name), &Job::default()).expect("a bundled scene");
            scene
                .cameras
                .iter_mut()
                .for_each(|camera| (camera.width, camera.height) = (width, height));
            scene
        };
        let mut hand = Self { window, harness, scenes: SCENES.iter().map(open).collect(), size };
        hand.scene(1);
        hand
    }

    fn frames(&mut self, n: usize) {
        for _ in 0..n {
            self.window.borrow_mut().update();
            self.harness.step();
        }
    }

    fn scene(&mut self, index: usize) {
        install(self.window.borrow_mut().world(), self.scenes[index].clone());
        self.window.borrow_mut().world().resource_mut::<Actions>().ask(Action::StartScreen(false));
        self.frames(2);
    }

    fn press(&mut self, at: Pos2, button: PointerButton, pressed: bool, modifiers: Modifiers) {
        self.harness.event(Event::PointerButton { pos: at, button, pressed, modifiers });
    }

    fn click(&mut self, at: Pos2, button: PointerButton) {
        self.harness.event(Event::PointerMoved(at));
        self.press(at, button, true, Modifiers::NONE);
        self.press(at, button, false, Modifiers::NONE);
        self.frames(1);
    }

    /// The middle of a widget that says so, if there is one.
    fn find(&self, label: &str) -> Option<Pos2> {
        self.harness.query_all_by_label(label).next().map(|node| node.rect().center())
    }

    fn gesture(&mut self, dice: &mut Dice) -> String {
        let at = dice.place(self.size);
        match dice.below(100) {
            0..22 => {
                let picture = self.find("Picture").or_else(|| self.find("Damage of members"));
                let begin = picture.unwrap_or(at);
                let button = dice.one(&[
                    PointerButton::Primary,
                    PointerButton::Primary,
                    PointerButton::Secondary,
                    PointerButton::Middle,
                ]);
                let modifiers = dice.one(&[Modifiers::NONE, Modifiers::NONE, Modifiers::SHIFT]);
                self.harness.event(Event::PointerMoved(begin));
                self.press(begin, button, true, modifiers);
                let steps = 1 + dice.below(4);
                let mut to = begin;
                for _ in 0..steps {
                    to += vec2(300.0 * (dice.unit() - 0.5), 300.0 * (dice.unit() - 0.5));
                    self.harness.event(Event::PointerMoved(to));
                    self.frames(1);
                }
                self.press(to, button, false, modifiers);
                self.frames(1);
                format!("drag {button:?} from {begin} to {to}")
            }
            22..36 => {
                let at = if dice.unit() < 0.7 { self.find("Picture").unwrap_or(at) } else { at };
                let delta = vec2(0.0, dice.one(&[-3.0, -1.0, 1.0, 3.0, 40.0, -40.0]));
                self.harness.event(Event::PointerMoved(at));
                let modifiers = dice.one(&[Modifiers::NONE, Modifiers::NONE, Modifiers::COMMAND]);
                let (unit, phase, source) =
                    (MouseWheelUnit::Line, TouchPhase::Move, MouseWheelSource::Unknown);
                self.harness.event(Event::MouseWheel { unit, delta, phase, source, modifiers });
                self.frames(1);
                format!("wheel {delta} at {at}")
            }
            36..40 => {
                self.size =
                    vec2(300.0 + 1700.0 * dice.unit(), 200.0 + 1000.0 * dice.unit()).round();
                self.harness.set_size(self.size);
                self.frames(1);
                format!("window of {}", self.size)
            }
            40..50 => {
                let tab = dice.one(&[
                    "Render",
                    "CT",
                    "Photos",
                    "Stress",
                    "Report",
                    "Convergence",
                    "Steering",
                    "Jobs",
                    "Log",
                    "File",
                    "View",
                    "Edit",
                    "Save…",
                    "Commands",
                    "Expert",
                    "Structure",
                    "Member",
                    "Attach evidence…",
                    "Keys",
                ]);
                if let Some(at) = self.find(tab) {
                    self.click(at, PointerButton::Primary);
                }
                format!("tab {tab}")
            }
            50..66 => {
                let button = dice.one(&[
                    PointerButton::Primary,
                    PointerButton::Primary,
                    PointerButton::Primary,
                    PointerButton::Secondary,
                ]);
                self.click(at, button);
                format!("click {button:?} at {at}")
            }
            66..82 => {
                const KEYS: [Key; 16] = [
                    Key::F,
                    Key::Home,
                    Key::Escape,
                    Key::Space,
                    Key::R,
                    Key::Num1,
                    Key::Num2,
                    Key::Num3,
                    Key::E,
                    Key::F1,
                    Key::Questionmark,
                    Key::Tab,
                    Key::Enter,
                    Key::ArrowDown,
                    Key::Backspace,
                    Key::O,
                ];
                let key = dice.one(&KEYS);
                let modifiers =
                    if dice.unit() < 0.1 { Modifiers::COMMAND } else { Modifiers::NONE };
                self.harness.event(Event::PointerMoved(at));
                for pressed in [true, false] {
                    self.harness.event(Event::Key {
                        key,
                        physical_key: None,
                        pressed,
                        repeat: false,
                        modifiers,
                    });
                }
                self.frames(1);
                format!("key {key:?}")
            }
            82..88 => {
                let members = {
                    let mut window = self.window.borrow_mut();
                    let world = window.world();
                    world.query::<&Member>().iter(world).count()
                };
                let member = dice.below(members + 1).checked_sub(1);
                self.window
                    .borrow_mut()
                    .world()
                    .resource_mut::<Actions>()
                    .ask(Action::Select(member));
                self.frames(1);
                format!("member {member:?}")
            }
            88..91 => {
                let camera = dice.below(3);
                self.window
                    .borrow_mut()
                    .world()
                    .resource_mut::<Actions>()
                    .ask(Action::Camera(camera));
                self.frames(1);
                format!("camera {camera}")
            }
            91..93 => {
                let scene = dice.below(SCENES.len());
                self.scene(scene);
                format!("scene {}", SCENES[scene].0)
            }
            93..95 => {
                let text = dice.one(&["x", "ü/…", "-3", "1e999", ""]);
                self.harness.event(Event::Text(text.into()));
                self.frames(1);
                format!("text {text}")
            }
            95..97 => {
                self.window.borrow_mut().world().resource::<Jobs>().cancel_all();
                self.frames(1);
                "cancel".into()
            }
            _ => {
                let button = dice.one(&[
                    "⏸ Pause",
                    "▶ Continue",
                    "⟲ Restart",
                    "▶ Predict on",
                    "Light",
                    "Error",
                    "Radiance field",
                    "Dual",
                ]);
                if let Some(at) = self.find(button) {
                    self.click(at, PointerButton::Primary);
                }
                format!("button {button}")
            }
        }
    }
}

fn play(seed: u64, gestures: std::ops::Range<u64>, verbose: bool) {
    // What a gesture saves goes nowhere.
    let folder = tempfile::tempdir().expect("a folder");
    std::env::set_current_dir(folder.path()).expect("a folder to work in");
    let mut hand = Hand::new();
    let mut pictures = 0_u64;
    for number in gestures {
        let what = hand.gesture(&mut Dice(Random::new(seed, number), 0));
        if verbose {
            eprintln!("{number}: {what}");
        }
        let mut window = hand.window.borrow_mut();
        let world = window.world();
        let broken: Vec<String> = world
            .resource::<Banners>()
            .lines()
            .into_iter()
            .filter(|line| line.contains("internal error"))
            .collect();
        assert!(broken.is_empty(), "seed {seed}, gesture {number} ({what}): {broken:?}");
        pictures += u64::from(
            world.get_resource::<Render>().is_some() && *world.resource::<Pace>() != Pace::Rest,
        );
    }
    // The window was not dead all the while.
    assert!(pictures > 0, "nothing was ever drawn");
}

#[test]
fn no_gesture_breaks_the_window() {
    match std::env::var("INTRADOS_GESTURES") {
        Err(_) => play(SEED, 0..GESTURES, false),
        Ok(asked) => {
            let numbers: Vec<u64> =
                asked.split_whitespace().map(|n| n.parse().expect("SEED FROM TO")).collect();
            play(numbers[0], numbers[1]..numbers[2], true);
        }
    }
}

#[test]
#[ignore = "some minutes; the plain test does a tenth of it"]
fn no_gesture_of_ten_thousand_breaks_the_window() {
    play(SEED, 0..10 * GESTURES, false);
}
