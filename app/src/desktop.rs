//! The window: bevy's world inside eframe's loop.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant, SystemTime},
};

use anyhow::{Context, anyhow};
use bevy_app::App;
use eframe::egui;
use intrados_panels::{Action, Actions, Banners, Latest, Window};
use intrados_scene::plugin::CurrentScene;
use intrados_stage::Pace;

/// Opens the window for an [`App`] that has the panels and whatever else, with a scene or with the
/// start screen. The app is built again if a panic has spoilt it (see [`Window`]).
///
/// # Errors
/// If there is no display, or no OpenGL on it.
pub fn run_app(build: impl Fn() -> App + 'static, scene: Option<PathBuf>) -> anyhow::Result<()> {
    let mut window = Window::new(build);
    let mut actions =
        window.world().get_resource_mut::<Actions>().context("the app has no PanelsPlugin")?;
    if let Some(scene) = scene {
        actions.ask(Action::Open(scene));
    }
    open(Desktop { window, frames: Frames::default(), shot: None }, [1280.0, 800.0], 1.0)
}

/// A picture of the window that is to be taken.
pub(crate) struct Shot {
    /// What is asked for at once.
    pub(crate) first: Vec<Action>,
    /// What is asked for once a scene is there.
    pub(crate) then: Vec<Action>,
    /// Id or name of the member that is selected.
    pub(crate) member: Option<String>,
    /// Of the window, points.
    pub(crate) size: [f32; 2],
    /// Pixels a point.
    pub(crate) scale: f32,
    /// Longest to wait for the prediction.
    pub(crate) wait: Duration,
    pub(crate) out: PathBuf,
}

/// Opens the window, waits until there is something to be seen, writes its picture and closes it.
///
/// # Errors
/// If there is no display, or the scene cannot be opened, or the picture not be written.
pub(crate) fn take_shot(build: impl Fn() -> App + 'static, shot: Shot) -> anyhow::Result<()> {
    let mut window = Window::new(build);
    let mut actions =
        window.world().get_resource_mut::<Actions>().context("the app has no PanelsPlugin")?;
    shot.first.iter().for_each(|action| actions.ask(action.clone()));
    let (size, scale) = (shot.size, shot.scale);
    let (mine, theirs) = std::sync::mpsc::channel();
    let (since, at) = (Instant::now(), Phase::Loading);
    let shooting = Shooting { shot, since, at, told: mine, rest: 0, before: None };
    let desktop = Desktop { window, frames: Frames::default(), shot: Some(shooting) };
    open(desktop, size, scale)?;
    theirs.try_recv().map_err(|_| anyhow!("the window was closed"))?.map_err(|why| anyhow!(why))
}

fn open(desktop: Desktop, size: [f32; 2], scale: f32) -> anyhow::Result<()> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Intrados")
        .with_app_id("intrados")
        .with_inner_size(size.map(|n| n * scale))
        .with_min_inner_size([640.0, 420.0])
        .with_icon(icon())
        .with_drag_and_drop(true);
    let system_font_fallback = finds_fonts();
    if !system_font_fallback {
        tracing::warn!("fontconfig is not installed: letters that the program lacks are left out");
    }
    let options = eframe::NativeOptions { viewport, system_font_fallback, ..Default::default() };
    // The theme follows the system: egui's default.
    eframe::run_native(
        "Intrados",
        options,
        Box::new(move |context| {
            if scale != 1.0 {
                context.egui_ctx.set_zoom_factor(scale);
            }
            // egui's dark theme writes in a grey that is hard to read.
            context.egui_ctx.style_mut_of(egui::Theme::Dark, |style| {
                style.visuals.widgets.noninteractive.fg_stroke.color =
                    egui::Color32::from_gray(195);
            });
            Ok(Box::new(desktop))
        }),
    )
    .map_err(|e| anyhow!("no window: {e}"))
}

/// Whether the system's fonts can be found: on Linux by a library that may be missing, and whoever
/// asked it then would panic.
#[cfg(any(target_os = "linux", target_os = "freebsd"))]
fn finds_fonts() -> bool {
    fontconfig_sys::statics::LIB_RESULT.is_ok()
}

#[cfg(not(any(target_os = "linux", target_os = "freebsd")))]
fn finds_fonts() -> bool {
    true
}

/// How far a picture is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Loading,
    Predicting,
    Settling,
    Writing,
    Over,
}

/// Frames that the window gets to settle.
const SETTLING: u32 = 12;

struct Shooting {
    shot: Shot,
    since: Instant,
    at: Phase,
    told: std::sync::mpsc::Sender<Result<(), String>>,
    /// Frames until the next phase.
    rest: u32,
    /// When the file was written that the picture replaces.
    before: Option<SystemTime>,
}

fn modified(file: &Path) -> Option<SystemTime> {
    file.metadata().and_then(|m| m.modified()).ok()
}

impl Shooting {
    /// Goes on; true once it is over.
    fn step(&mut self, window: &mut Window) -> bool {
        let world = window.world();
        match self.at {
            Phase::Loading => self.load(window),
            Phase::Predicting => {
                let is_done = world.resource::<Latest>().result.is_some();
                if is_done || self.since.elapsed() > self.shot.wait {
                    (self.at, self.rest) = (Phase::Settling, SETTLING);
                }
            }
            Phase::Settling if self.rest > 0 => self.rest -= 1,
            Phase::Settling => {
                let action = Action::TakePicture(self.shot.out.clone(), None);
                world.resource_mut::<Actions>().ask(action);
                (self.at, self.since) = (Phase::Writing, Instant::now());
                self.before = modified(&self.shot.out);
            }
            Phase::Writing => {
                let lines = world.resource::<Banners>().lines();
                let is_late = self.since.elapsed() > Duration::from_secs(60);
                if self.is_written() {
                    self.end(Ok(()));
                } else if let Some(line) = lines.last() {
                    self.end(Err(line.clone()));
                } else if is_late {
                    self.end(Err("the window gave no picture within a minute".into()));
                }
            }
            Phase::Over => return true,
        }
        false
    }

    fn load(&mut self, window: &mut Window) {
        let world = window.world();
        if let Some(line) = world.resource::<Banners>().lines().last() {
            return self.end(Err(line.clone()));
        }
        let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else { return };
        let mut actions = world.resource_mut::<Actions>();
        self.shot.then.iter().for_each(|action| actions.ask(action.clone()));
        if let Some(word) = &self.shot.member {
            let id = scene.id_of(word);
            match (id, id.ok().and_then(|id| scene.members.iter().position(|m| m.id == id))) {
                (_, Some(index)) => actions.ask(Action::Select(Some(index))),
                (Err(several @ 2..), _) => {
                    return self
                        .end(Err(format!("{several} members are called {word}: give an id")));
                }
                _ => return self.end(Err(format!("{word}: is no member of {}", scene.name))),
            }
        }
        let is_predicted = !scene.members.is_empty();
        self.at = if is_predicted { Phase::Predicting } else { Phase::Settling };
        self.rest = SETTLING;
    }

    /// Whether the file is another one than before.
    fn is_written(&self) -> bool {
        let now = modified(&self.shot.out);
        now.is_some() && now != self.before
    }

    fn end(&mut self, how: Result<(), String>) {
        self.at = Phase::Over;
        // Whoever asked has gone: then nobody wants to know.
        let _ = self.told.send(how);
    }
}

/// Between two frames while only work off the frame goes on.
const RESTING: Duration = Duration::from_millis(30);

/// A bevy app that eframe drives.
struct Desktop {
    window: Window,
    frames: Frames,
    shot: Option<Shooting>,
}

impl eframe::App for Desktop {
    fn logic(&mut self, ctx: &egui::Context, _: &mut eframe::Frame) {
        self.frames.begin();
        self.window.update();
        self.frames.logic();
        let is_over = match &mut self.shot {
            Some(shot) => {
                ctx.request_repaint_after(RESTING);
                shot.step(&mut self.window)
            }
            None => false,
        };
        if is_over || self.window.app().should_exit().is_some() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        } else if intrados_panels::is_busy(self.window.world()) {
            // Where no picture is refined, nothing moves but bars of progress: the cores are the
            // work's, above all where a processor paints the window.
            let rests = *self.window.world().resource::<Pace>() == Pace::Rest;
            ctx.request_repaint_after(if rests { RESTING } else { Duration::ZERO });
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let begin = Instant::now();
        self.window.show(ui);
        // The window's name, for those who hear it.
        let root = egui::accesskit_root_id();
        ui.ctx().accesskit_node_builder(root, |root| root.set_label("Intrados"));
        // What was asked for is done at the beginning of the next frame, so there must be one.
        if !self.window.world().resource::<Actions>().is_empty() {
            ui.ctx().request_repaint();
        }
        self.frames.ui(begin.elapsed());
    }
}

/// How long frames last: the longest of every second goes to the log (`RUST_LOG=intrados=debug`).
#[derive(Default)]
struct Frames {
    frame: Option<Instant>,
    second: Option<Instant>,
    count: u32,
    busy: Duration,
    logic: Duration,
    ui: Duration,
    whole: Duration,
    between: Duration,
    /// CPU-seconds at the beginning of the frame, and the most that one has used: what a frame
    /// costs however busy the machine is.
    cpu: f64,
    most_cpu: f64,
    /// The same of the world alone, without drawing.
    logic_cpu: f64,
}

impl Frames {
    fn begin(&mut self) {
        let now = Instant::now();
        if let Some(last) = self.frame.replace(now) {
            self.between = self.between.max(now - last);
        }
        self.count += 1;
        let cpu = intrados_stage::cpu_seconds();
        if self.cpu > 0.0 {
            self.most_cpu = self.most_cpu.max(cpu - self.cpu);
        }
        self.cpu = cpu;
        let second = *self.second.get_or_insert(now);
        if now - second >= Duration::from_secs(1) {
            let ms = |d: Duration| d.as_secs_f64() * 1e3;
            tracing::debug!(
                frames = self.count,
                logic_ms = ms(self.logic),
                ui_ms = ms(self.ui),
                logic_and_ui_ms = ms(self.whole),
                with_painting_ms = ms(self.between),
                cpu_ms = 1e3 * self.most_cpu,
                logic_cpu_ms = 1e3 * self.logic_cpu,
                "longest of the second"
            );
            *self = Self { frame: self.frame, second: Some(now), cpu, ..Self::default() };
        }
    }

    fn logic(&mut self) {
        self.logic_cpu = self.logic_cpu.max(intrados_stage::cpu_seconds() - self.cpu);
        self.busy = self.frame.map_or(Duration::ZERO, |f| f.elapsed());
        self.logic = self.logic.max(self.busy);
    }

    fn ui(&mut self, took: Duration) {
        self.ui = self.ui.max(took);
        self.whole = self.whole.max(self.busy + took);
    }
}

/// An arch with its intrados, the inner face, in light.
fn icon() -> egui::IconData {
    const N: u32 = 64;
    let pixel = |i: u32| -> [u8; 4] {
        let (x, y) = ((i % N) as f32 + 0.5 - N as f32 / 2.0, (i / N) as f32 + 0.5 - 40.0);
        // A barrel vault on two walls: distance from the axis above the springing, from the middle
        // below it.
        let r = if y < 0.0 { x.hypot(y) } else { x.abs() };
        match r {
            _ if y > 18.0 => [0; 4],
            r if (18.0..20.5).contains(&r) => [255, 176, 0, 255],
            r if (20.5..30.0).contains(&r) => [122, 130, 140, 255],
            _ => [0; 4],
        }
    };
    egui::IconData { rgba: (0..N * N).flat_map(pixel).collect(), width: N, height: N }
}
