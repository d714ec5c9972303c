//! The window: bevy's world inside eframe's loop.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow};
use bevy_app::App;
use eframe::egui;
use intrados_panels::{Action, Actions, Window};

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
    let viewport = egui::ViewportBuilder::default()
        .with_title("Intrados")
        .with_app_id("intrados")
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([800.0, 500.0])
        .with_icon(icon())
        .with_drag_and_drop(true);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    // The theme follows the system: egui's default.
    eframe::run_native(
        "Intrados",
        options,
        Box::new(|context| {
            // egui's dark theme writes in a grey that is hard to read.
            context.egui_ctx.style_mut_of(egui::Theme::Dark, |style| {
                style.visuals.widgets.noninteractive.fg_stroke.color =
                    egui::Color32::from_gray(195);
            });
            Ok(Box::new(Desktop { window, frames: Frames::default() }))
        }),
    )
    .map_err(|e| anyhow!("no window: {e}"))
}

/// A bevy app that eframe drives.
struct Desktop {
    window: Window,
    frames: Frames,
}

impl eframe::App for Desktop {
    fn logic(&mut self, ctx: &egui::Context, _: &mut eframe::Frame) {
        self.frames.begin();
        self.window.update();
        self.frames.logic();
        if self.window.app().should_exit().is_some() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        } else if intrados_panels::is_busy(self.window.world()) {
            ctx.request_repaint();
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let begin = Instant::now();
        self.window.show(ui);
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
