//! The CT tab: slices of the selected member as they are or as the scanner makes them, with what
//! was found in them.

mod draw;
mod picture;
mod plots;
mod probe;
mod scan;
mod source;

use std::sync::{Arc, Mutex, PoisonError};

use bevy_ecs::prelude::*;
use draw::Overlay;
use egui::{ComboBox, Rect, Slider, TextureHandle, TextureOptions, Ui, pos2};
use intrados_ct::{detect::Method, source::SliceShelf};
use intrados_predict::Predicting;
use intrados_scene::{Member, Scene, plugin::CurrentScene};
use intrados_stage::{Estimate, Jobs, Task};
use intrados_xray::plugin::{Scan, Scans};
use plots::Order;
use probe::{Drawn, Found, Probe};
pub(crate) use source::Plane;
use source::{Read, Source};

use crate::{
    Action, Actions, Selection,
    lang::{drag, term},
    leaf::{self, Leaf},
    members,
    workspace::Desk,
    zoom::Zoom,
};

/// Width of what stands beside the slice, points.
const ASIDE: f32 = 290.0;

/// Whose slices are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Origin {
    /// Those that the scene tells of.
    #[default]
    Told,
    /// Those of the simulated scan.
    Scanned,
}

/// What slices are read of, and how: scene, member, origin, address of the scan's volume, method.
type Stack = (String, usize, Origin, usize, Method);

/// What the tab remembers.
#[derive(Resource, Default)]
pub(crate) struct Ct {
    /// None: the scene's if it has any.
    origin: Option<Origin>,
    index: usize,
    /// None: the network.
    method: Option<Method>,
    overlay: Overlay,
    /// Grey that is black and grey that is white; none: what suits the slice.
    window: Option<[f32; 2]>,
    view: Zoom,
    probe: Probe,
    sinogram: bool,
    shelf: SliceShelf,
    wish: scan::Wish,
    of: Option<(Stack, usize)>,
    task: Option<Task<Result<Read, String>>>,
    shown: Option<Result<Shown, String>>,
    picked: Option<u32>,
    /// Whether the table has to go where the pick is.
    follow: bool,
    order: Order,
    profile: Profile,
    forming: scan::Picture,
}

/// A slice and its textures, with what they were made for.
struct Shown {
    read: Read,
    grey: ([f32; 2], TextureHandle),
    labels: (Overlay, TextureHandle),
    probed: Option<(Drawn, Found)>,
}

/// The porosities of a stack as far as they are known.
#[derive(Default)]
struct Profile {
    of: Option<Stack>,
    along: Vec<Option<Estimate>>,
    task: Option<Task<Result<(), String>>>,
    told: Arc<Mutex<Vec<(usize, Result<Estimate, String>)>>>,
    failures: Vec<String>,
}

impl Ct {
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some() || self.profile.task.is_some()
    }

    /// Shows a slice of those that the scene tells of.
    pub(crate) fn show(&mut self, index: usize) {
        (self.origin, self.index, self.sinogram) = (Some(Origin::Told), index, false);
    }

    /// Shows the next slice of those that are shown, or the one before.
    pub(crate) fn step(&mut self, forward: bool) {
        // The tab keeps it among those that there are.
        self.index = if forward { self.index + 1 } else { self.index.saturating_sub(1) };
    }

    /// Puts the tool away with what it has drawn; false if there was none.
    pub(crate) fn end_tool(&mut self) -> bool {
        std::mem::take(&mut self.probe).is_on()
    }

    /// Where the slice lies that was shown last, if it is one of this member.
    pub(crate) fn plane(&self, scene: &Scene, member: usize) -> Option<Plane> {
        let ((hash, of, ..), _) = self.of.as_ref()?;
        let shown = self.shown.as_ref()?.as_ref().ok()?;
        shown.read.plane.filter(|_| *hash == scene.hash && *of == member)
    }

    /// The slice that was shown last with what was found in it, and its legend, where it is of this
    /// scene.
    pub(crate) fn leaf(&self, ui: &Ui, scene: &Scene) -> Option<Leaf> {
        let ((hash, member, origin, ..), index) = self.of.as_ref()?;
        let member = scene.members.get(*member).filter(|_| *hash == scene.hash)?;
        // While another slice is read, it is the one before that is seen.
        let shown = self.shown.as_ref().filter(|_| self.task.is_none())?.as_ref().ok()?;
        let read = &shown.read;
        let window = self.window.unwrap_or_else(|| read.suitable());
        let mut image = draw::grey(read, window);
        let labels = draw::labels(read, self.overlay);
        image.pixels.iter_mut().zip(labels.pixels).for_each(|(pixel, on)| *pixel = pixel.blend(on));
        let what = leaf::said(scene, &format!("{}, {}", member.name, read.caption()));
        let unit = unit(*origin);
        Some(Leaf {
            name: format!("ct-{}-slice {}", member.id, index + 1),
            legend: Some(picture::printed(read, window, unit, &what).drawn(ui, image.width())),
            what,
            draw: Box::new(move || image),
        })
    }

    fn method(&self) -> Method {
        self.method.unwrap_or(Method::Network)
    }
}

/// In what the grey of slices is.
fn unit(origin: Origin) -> &'static str {
    if origin == Origin::Scanned { "1/m" } else { "grey" }
}

pub(crate) fn ct(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    scans: Option<Res<Scans>>,
    predicting: Option<Res<Predicting>>,
    mut asks: scan::Asks,
    mut ct: ResMut<Ct>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
    desk: Res<Desk>,
) {
    let ct = ct.bypass_change_detection();
    if let Some(predicting) = predicting {
        ct.shelf = predicting.shelf.clone();
    }
    // Rows of tools that are too wide may not push what lies below them out of sight.
    let edge = ui.max_rect().right();
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    let Some((member, of)) = selection.0.and_then(|i| Some((i, scene.members.get(i)?))) else {
        return choose(ui, scene, &tr!("Select a member to see its slices:"), &mut actions);
    };
    let scannable = scans.is_some().then(|| scannable(scene, &of.id)).flatten();
    let told = source::told(scene, member);
    if told.is_empty() && scannable.is_none() {
        let why = tr!("{} has no CT slices and no scanner sees it.", of.name);
        return choose(ui, scene, &why, &mut actions);
    }
    let origin = match ct.origin {
        Some(Origin::Scanned) if scannable.is_some() => Origin::Scanned,
        _ if told.is_empty() => Origin::Scanned,
        _ => Origin::Told,
    };
    let scan =
        scannable.and_then(|id| scans.as_ref()?.get(id)).filter(|_| origin == Origin::Scanned);
    let done = scan.and_then(Scan::done);
    let sources =
        if origin == Origin::Told { told } else { done.map(source::scanned).unwrap_or_default() };
    ui.horizontal_wrapped(|ui| {
        ui.strong(&of.name);
        ui.separator();
        origins(ui, ct, origin, !of.slices.is_empty(), scannable.is_some());
    });
    if let Some(id) = scannable.filter(|_| origin == Origin::Scanned) {
        scan::controls(ui, &mut ct.wish, scene, id, scan, &mut asks);
    }
    if sources.is_empty() {
        return scan::waiting(ui, &mut ct.forming, scan, &of.name);
    }
    ct.index = ct.index.min(sources.len() - 1);
    let volume = done.map_or(0, |d| Arc::as_ptr(&d.restored) as usize);
    let stack = (scene.hash.clone(), member, origin, volume, ct.method());
    ask(ct, scene, &sources, stack, desk.links(), &mut jobs);
    collect(ui, ct);
    tools(ui, ct, &sources, scan.is_some());
    let mut area = ui.available_rect_before_wrap();
    area.max.x = area.max.x.min(edge);
    if ct.sinogram
        && let Some(scan) = scan
    {
        return scan::sinogram(ui, &mut ct.forming, scan, area);
    }
    let unit = unit(origin);
    let left = Rect::from_min_max(
        area.min,
        pos2((area.right() - ASIDE - 8.0).max(area.left() + 120.0), area.bottom()),
    );
    let right = Rect::from_min_max(pos2(left.right() + 8.0, area.top()), area.max);
    picture::show(ui, ct, left, unit);
    ui.scope_builder(egui::UiBuilder::new().max_rect(right), |ui| {
        if let Some(action) = probed(ui, ct, unit) {
            actions.ask(action);
        }
        aside(ui, ct, scene, &sources, &mut jobs);
    });
    ui.advance_cursor_after_rect(area);
}

/// The assembly that the scanner can see for the scene's member `id`.
fn scannable<'a>(scene: &'a Scene, id: &str) -> Option<&'a str> {
    let assembly = scene
        .structure
        .assembly_of(id)
        .filter(|a| a.body.is_some() && !scene.structure.scanners.is_empty());
    assembly.map(|a| a.id.as_str())
}

/// Which members have slices or can be scanned.
fn choose(ui: &mut Ui, scene: &Scene, why: &str, actions: &mut Actions) {
    let has = |m: &Member| !m.slices.is_empty() || scannable(scene, &m.id).is_some();
    let none = tr!("No member of this scene has CT slices, and there is no scanner.");
    members::choose(ui, scene, has, why, &none, actions);
}

fn origins(ui: &mut Ui, ct: &mut Ct, origin: Origin, told: bool, scannable: bool) {
    for (which, name, can, what) in [
        (
            Origin::Told,
            tr!("Its slices"),
            told,
            tr!("Slices that the scene names, or draws until there are any"),
        ),
        (
            Origin::Scanned,
            tr!("Simulated scan"),
            scannable,
            tr!("What the scene's scanner would see of this member: photons, scatter, noise, \
                 reconstruction"),
        ),
    ] {
        let button = ui
            .add_enabled(can, egui::Button::selectable(origin == which, name))
            .on_hover_text(what);
        if button.clicked() {
            (ct.origin, ct.index, ct.window) = (Some(which), 0, None);
        }
    }
}

/// Reads the wanted slice if it is another one.
fn ask(
    ct: &mut Ct,
    scene: &Arc<Scene>,
    sources: &[(String, Source)],
    stack: Stack,
    is_linked: bool,
    jobs: &mut Jobs,
) {
    let wanted = (stack.clone(), ct.index);
    if ct.of.as_ref() != Some(&wanted) {
        // Of the same stack the slice before stays until the new one is there.
        let same = ct.of.as_ref().is_some_and(|(of, _)| *of == stack);
        if !same {
            ct.shown = None;
        }
        // As scanned and as told, by one method and by another, the same place of a member is seen.
        let of_one = |of: &Stack| (&of.0, of.1) == (&stack.0, stack.1);
        if !(same || is_linked && ct.of.as_ref().is_some_and(|(of, _)| of_one(of))) {
            ct.view = Zoom::default();
        }
        ct.picked = None;
        ct.of = Some(wanted);
        let (scene, source, method, shelf) =
            (Arc::clone(scene), sources[ct.index].1.clone(), stack.4, ct.shelf.clone());
        ct.task = Some(Task::spawn(jobs, "reading a CT slice", move |job| {
            source::read(&scene, &source, method, &shelf, job)
        }));
    }
    if ct.profile.of.as_ref() != Some(&stack) {
        ct.profile =
            Profile { of: Some(stack), along: vec![None; sources.len()], ..Profile::default() };
    }
}

/// Takes what has been read.
fn collect(ui: &Ui, ct: &mut Ct) {
    if let Some(done) = Task::take(&mut ct.task) {
        ct.shown = Some(match done {
            Ok(Ok(read)) => {
                if let Some(place) = ct.profile.along.get_mut(ct.index) {
                    *place = Some(read.found.porosity);
                }
                let window = ct.window.unwrap_or_else(|| read.suitable());
                let load = |image, name: &str, options| ui.ctx().load_texture(name, image, options);
                let grey =
                    (window, load(draw::grey(&read, window), "slice", TextureOptions::NEAREST));
                let labels = (
                    ct.overlay,
                    load(draw::labels(&read, ct.overlay), "labels", TextureOptions::NEAREST),
                );
                Ok(Shown { read, grey, labels, probed: None })
            }
            Ok(Err(reason)) => Err(reason),
            Err(_) => Err(tr!("the reader broke off")),
        });
    }
    let profile = &mut ct.profile;
    for (k, porosity) in profile.told.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        match (porosity, profile.along.get_mut(k)) {
            (Ok(porosity), Some(place)) => *place = Some(porosity),
            (Ok(_), None) => {}
            (Err(why), _) => profile.failures.push(why),
        }
    }
    // Its rows have come one by one.
    Task::take(&mut profile.task);
}

/// Which slice, how it is read and shown.
fn tools(ui: &mut Ui, ct: &mut Ct, sources: &[(String, Source)], has_sinogram: bool) {
    let count = sources.len();
    ui.horizontal_wrapped(|ui| {
        if has_sinogram {
            ui.selectable_value(&mut ct.sinogram, false, tr!("Slices"));
            ui.selectable_value(&mut ct.sinogram, true, tr!("Sinogram"));
            ui.separator();
        }
        ui.label(&sources[ct.index].0);
        let label = ui.label(tr!("Slice"));
        let mut number = ct.index + 1;
        ui.add(Slider::new(&mut number, 1..=count)).labelled_by(label.id);
        ct.index = number.clamp(1, count) - 1;
        ui.separator();
        let mut method = ct.method();
        let label = ui.label(tr!("Found by"));
        let name = |m: Method| match m {
            Method::Network => tr!("network"),
            _ => tr!("local threshold"),
        };
        let combo = ComboBox::from_id_salt("ct method").selected_text(name(method)).width(110.0);
        let response = combo.show_ui(ui, |ui| {
            for m in [Method::Network, Method::Classical] {
                ui.selectable_value(&mut method, m, name(m));
            }
        });
        response.response.labelled_by(label.id);
        ct.method = Some(method);
        let combo = ComboBox::from_id_salt("ct overlay").selected_text(ct.overlay.name());
        let shown = combo.width(100.0).show_ui(ui, |ui| {
            for overlay in Overlay::ALL {
                ui.selectable_value(&mut ct.overlay, overlay, overlay.name());
            }
        });
        shown.response.on_hover_text(tr!("What is drawn over the slice"));
        ui.separator();
        ct.probe.tools(ui);
        ui.separator();
        windowing(ui, ct);
    });
}

/// Window and level: how much grey is shown, and the grey in its middle.
fn windowing(ui: &mut Ui, ct: &mut Ct) {
    let Some(Ok(shown)) = &ct.shown else { return };
    let [low, high] = ct.window.unwrap_or_else(|| shown.read.suitable());
    let (mut width, mut level) = (high - low, 0.5 * (low + high));
    let speed = f64::from(shown.read.suitable()[1]) * 0.005;
    let mut changed = false;
    for (name, value, least, what) in [
        (
            tr!("Window|of grey"),
            &mut width,
            0.01 * shown.read.suitable()[1],
            tr!("Grey from black to white; drag the slice with the right button, left and right"),
        ),
        (
            tr!("Level|of grey"),
            &mut level,
            f32::MIN,
            tr!("Grey in the middle; drag the slice with the right button, up and down"),
        ),
    ] {
        // Name and value go to the next line together.
        if ui.available_size_before_wrap().x < 130.0 {
            ui.end_row();
        }
        ui.horizontal(|ui| {
            let label = ui.label(name);
            let value = drag(value).speed(speed).range(least..=f32::MAX).max_decimals(3);
            changed |= ui.add(value).labelled_by(label.id).on_hover_text(what).changed();
        });
    }
    if changed {
        ct.window = Some([level - 0.5 * width, level + 0.5 * width]);
    }
    if ct.window.is_some()
        && ui
            .small_button(tr!("auto"))
            .on_hover_text(tr!("Black is air, concrete a light grey, metal white"))
            .clicked()
    {
        ct.window = None;
    }
}

/// What the slice has where something is drawn over it.
fn probed(ui: &mut Ui, ct: &Ct, unit: &str) -> Option<Action> {
    let (Some(Ok(shown)), Some(drawn)) = (&ct.shown, ct.probe.drawn()) else { return None };
    // What was measured elsewhere is no longer told.
    let found = shown.probed.as_ref().filter(|(of, _)| *of == drawn).map(|(_, found)| found);
    let height = (0.2 * ui.available_height()).clamp(60.0, 130.0);
    probe::results(ui, drawn, found, unit, height)
}

/// Histogram, porosity along the axis, table.
fn aside(
    ui: &mut Ui,
    ct: &mut Ct,
    scene: &Arc<Scene>,
    sources: &[(String, Source)],
    jobs: &mut Jobs,
) {
    let method = ct.method();
    let Ct {
        shown: Some(Ok(shown)),
        window,
        profile,
        index: now,
        order,
        view,
        picked,
        follow,
        shelf,
        ..
    } = ct
    else {
        return;
    };
    let window = window.unwrap_or_else(|| shown.read.suitable());
    let each = (0.5 * (ui.available_height() - 260.0)).clamp(50.0, 130.0);
    plots::histogram(ui, &shown.read, window, each);
    if let Some(index) = plots::profile(ui, &profile.along, shown.read.truth, *now, each) {
        *now = index;
    }
    ui.horizontal(|ui| {
        let unread = profile.along.iter().filter(|r| r.is_none()).count();
        if let Some(task) = &profile.task {
            if ui.small_button(tr!("⏹ Stop reading")).clicked() {
                task.job().cancel();
            }
            let bar = egui::ProgressBar::new(task.job().done()).desired_width(120.0);
            ui.add(bar).on_hover_text(term(&task.job().label()));
        } else if unread > 0 && ui.button(tr!("Read the other {} slices", unread)).clicked() {
            let (told, scene, method, shelf) =
                (Arc::clone(&profile.told), Arc::clone(scene), method, shelf.clone());
            let list: Vec<(usize, Source)> = (0..sources.len())
                .filter(|&k| profile.along[k].is_none())
                .map(|k| (k, sources[k].1.clone()))
                .collect();
            profile.task = Some(Task::spawn(jobs, "reading CT slices", move |job| {
                let (numbers, sources): (Vec<usize>, Vec<Source>) = list.into_iter().unzip();
                let tell = |k: usize, r| {
                    told.lock().unwrap_or_else(PoisonError::into_inner).push((numbers[k], r))
                };
                source::profile(&scene, &sources, method, &shelf, tell, job)
            }));
        }
        if let Some(first) = profile.failures.first() {
            ui.label(tr!("⚠ {} not read", profile.failures.len())).on_hover_text(term(first));
        }
    });
    let follow = std::mem::take(follow);
    if let Some(label) = plots::table(ui, &shown.read.found.pores, order, *picked, follow) {
        *picked = Some(label);
        let size = [shown.read.slice.grey.width, shown.read.slice.grey.height].map(|n| n as f32);
        if let Some(pore) = shown.read.found.pores.iter().find(|p| p.label == label) {
            view.reveal(
                [pore.x_mm, pore.y_mm].map(|mm| mm as f32 / shown.read.slice.pixel_mm),
                size,
            );
        }
    }
}
