//! The Stress tab: the life of a member, its deformed shape in false colour, the forces in its
//! tendons.

mod plots;
mod quantity;
mod save;

use std::{path::PathBuf, sync::Arc};

use bevy_ecs::prelude::*;
use egui::{
    Color32, ComboBox, ProgressBar, Rect, Sense, Slider, TextureHandle, TextureOptions, Ui, pos2,
    vec2,
};
use glam::Vec3;
use intrados_light::{plugin::Widening, tone::FalseColour};
use intrados_mechanics::{
    analysis::Outcome,
    member::Meshing,
    plugin::{Analyses, Analysis, Analyze, ShownAt, Stop},
    skin::{Skin, Snapshot},
};
use intrados_scene::{Camera, Scene, SurfaceDamage, plugin::CurrentScene};
use intrados_stage::{
    Jobs, Task, Work,
    time::{DAY, YEAR},
};
use quantity::Quantity;

use crate::{
    Actions, Colours, Log, Look, Selection, colours,
    lang::{drag, fixed, lines, local, slide, term},
    leaf::{Leaf, on_ground},
    legend::Legend,
    members,
    number::significant,
    scale::{self, Ranges},
    surface::{self, Drawn, Surface, bounds, hand, place},
};

/// Share of the member's size that its largest displacement is shown as.
const SHOWN: f32 = 0.05;
/// Width of the plots beside the picture, points.
const ASIDE: f32 = 260.0;
/// How long a frame looks for the ranges of other moments.
const PATIENCE: std::time::Duration = std::time::Duration::from_millis(8);
/// Cracks are shown so many times as wide as they are in the Render tab, until somebody chooses: at
/// their own width a pixel swallows them.
pub(crate) const WIDENING: f32 = 5.0;

/// What the tab remembers.
#[derive(Resource)]
pub(crate) struct Stress {
    quantity: Quantity,
    /// Factor on displacements; none: one that suits the member.
    scale: Option<f32>,
    /// Which equilibrium; none: the newest.
    moment: Option<usize>,
    /// The moment of the structure that was last followed.
    followed: ShownAt,
    /// Largest edge of an element, m; 0: one that suits the section.
    element: f64,
    /// Only the selected member of a model of several.
    alone: bool,
    mesh: bool,
    /// One range of colours for all moments.
    whole_life: bool,
    life: Life,
    camera: Option<Camera>,
    /// What the camera and the pick belong to: scene and model.
    of: (String, String),
    picked: Option<Picked>,
    shown: Option<Shown>,
    path: String,
    task: Option<Task<Result<String, String>>>,
}

impl Default for Stress {
    fn default() -> Self {
        Self {
            quantity: Quantity::default(),
            scale: None,
            moment: None,
            followed: ShownAt::default(),
            element: 0.0,
            alone: false,
            mesh: true,
            whole_life: false,
            life: Life::default(),
            camera: None,
            of: Default::default(),
            picked: None,
            shown: None,
            path: String::new(),
            task: None,
        }
    }
}

/// Ranges of all moments of a life, as far as they are known, and what they are of.
#[derive(Default)]
struct Life {
    of: Option<(usize, Quantity, Option<u32>)>,
    ranges: Vec<[f32; 2]>,
}

/// A vertex that was clicked.
#[derive(Clone, Copy)]
struct Picked {
    vertex: u32,
}

/// The picture that is there, and what it is of.
struct Shown {
    key: Key,
    drawn: Drawn,
    texture: TextureHandle,
    faces: Vec<[u32; 4]>,
    positions: Vec<Vec3>,
    values: Vec<f32>,
    scale: FalseColour,
}

impl Shown {
    /// The least and the largest value of what is seen.
    fn extremes(&self) -> Option<[f32; 2]> {
        let values = self.faces.iter().flatten().filter_map(|v| self.values.get(*v as usize));
        let [least, most] =
            values.fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
        (least <= most).then_some([least, most])
    }
}

#[derive(Clone, PartialEq)]
struct Key {
    skin: usize,
    moment: usize,
    /// Of how many moments the range is.
    count: usize,
    quantity: Quantity,
    scale: f32,
    colours: Colours,
    locked: Option<[f32; 2]>,
    part: Option<u32>,
    mesh: bool,
    over: usize,
    camera: Camera,
}

impl Stress {
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// The picture that was shown last, with its legend, where it is of this scene.
    pub(crate) fn leaf(
        &self,
        ui: &Ui,
        scene: &Scene,
        analyses: &Analyses,
        colours: Colours,
        ranges: &Ranges,
    ) -> Option<Leaf> {
        let (hash, model) = &self.of;
        let analysis = analyses.get(model).filter(|_| *hash == scene.hash)?;
        let skin = analysis.seen.skin()?;
        let shown = self.shown.as_ref().filter(|s| s.key.skin == Arc::as_ptr(&skin) as usize)?;
        let Key { moment: index, quantity, part, scale: auto, .. } = shown.key;
        let (shot, count) = (analysis.seen.shot(index)?, analysis.seen.count());
        let (skin, shot) = (&skin, &shot);
        let view = View { skin, shot, analysis, part, index, count, auto, colours, ranges };
        let (image, ground) = (shown.drawn.image.clone(), ui.visuals().extreme_bg_color);
        Some(Leaf {
            name: format!("{}-{model}", quantity.file(skin)),
            what: view.caption(quantity, shown),
            legend: Some(view.legend(quantity, shown).drawn(ui, image.width())),
            draw: Box::new(move || on_ground(image, ground)),
        })
    }
}

/// Says how a write ended.
pub(crate) fn take(mut stress: ResMut<Stress>, mut log: ResMut<Log>) {
    let Some(done) = Task::take(&mut stress.task) else { return };
    match done {
        Ok(Ok(what)) => log.say(tr!("wrote {}", what)),
        Ok(Err(error)) => log.say(tr!("not written: {}", term(&error))),
        Err(_) => log.say(tr!("not written: the writer broke off")),
    }
}

pub(crate) fn stress(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    analyses: Option<Res<Analyses>>,
    at: Res<ShownAt>,
    look: Res<Look>,
    mut ranges: ResMut<Ranges>,
    damage: Query<&SurfaceDamage>,
    mut widening: ResMut<Widening>,
    mut stress: ResMut<Stress>,
    mut begin: MessageWriter<Analyze>,
    mut stop: MessageWriter<Stop>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let stress = stress.bypass_change_detection();
    let (Some(scene), Some(analyses)) = (scene, analyses) else { return };
    let scene = &scene.0;
    let Some(member) = selection.0.and_then(|i| scene.members.get(i)) else {
        return choose(ui, scene, &tr!("Select a member to see its stress:"), &mut actions);
    };
    let Some(model) = scene.structure.assembly_of(&member.id).map(|a| a.id.as_str()) else {
        let why = tr!("{} has no closed surface of concrete: it is not computed.", member.name);
        return choose(ui, scene, &why, &mut actions);
    };
    let of = (scene.hash.clone(), model.to_owned());
    if stress.of != of {
        (stress.of, stress.camera, stress.picked, stress.moment, stress.shown) =
            (of, None, None, None, None);
        stress.path = format!("{}.png", model.replace('/', "-"));
    }
    let analysis = analyses.get(model);
    ui.horizontal_wrapped(|ui| {
        ui.strong(&member.name);
        run(ui, stress, model, analysis, &mut begin, &mut stop);
    });
    let Some(analysis) = analysis else {
        return invite(ui, &member.name);
    };
    let (skin, count) = (analysis.seen.skin(), analysis.seen.count());
    let (Some(skin), true) = (skin, count > 0) else {
        return waiting(ui, analysis);
    };
    if *at != stress.followed {
        // The last equilibrium until then, as of the whole structure.
        let shots = analysis.seen.shots();
        let passed = |until: f64| shots.partition_point(|shot| shot.time <= until);
        stress.moment = at.0.map(|until| passed(until).saturating_sub(1));
        stress.followed = *at;
    }
    // More moments come while it runs.
    let index = stress.moment.unwrap_or(usize::MAX).min(count - 1);
    let Some(shot) = analysis.seen.shot(index) else { return };
    let part = skin.parts.iter().position(|p| *p == member.id).map(|p| p as u32);
    let auto = scale_of(&skin, analysis);
    controls(ui, stress, &skin, auto, &mut ranges);
    time(ui, stress, &shot, index, count, analysis.work.is_running());
    state(ui, analysis, &member.id);
    cracks(ui, &damage, &mut widening);
    let area = ui.available_rect_before_wrap();
    let [picture, aside] = [
        Rect::from_min_max(area.min, pos2(area.right() - ASIDE - 8.0, area.bottom())),
        Rect::from_min_max(pos2(area.right() - ASIDE, area.top()), area.max),
    ];
    let (skin, shot, colours, ranges) = (&skin, &shot, look.colours, &*ranges);
    let view = View { skin, shot, analysis, part, index, count, auto, colours, ranges };
    view.show(ui, stress, picture, &mut jobs);
    ui.scope_builder(egui::UiBuilder::new().max_rect(aside), |ui| {
        plots::show(ui, skin, shot, analysis, aside.height());
    });
    ui.advance_cursor_after_rect(area);
}

/// Which members can be computed.
fn choose(ui: &mut Ui, scene: &Scene, why: &str, actions: &mut Actions) {
    let none =
        tr!("No member of this scene can be computed: none has a closed surface of concrete.");
    members::choose(
        ui,
        scene,
        |m| scene.structure.assembly_of(&m.id).is_some(),
        why,
        &none,
        actions,
    );
}

/// Begin, stop, and how far it is.
fn run(
    ui: &mut Ui,
    stress: &mut Stress,
    model: &str,
    analysis: Option<&Analysis>,
    begin: &mut MessageWriter<Analyze>,
    stop: &mut MessageWriter<Stop>,
) {
    ui.separator();
    if analysis.is_some_and(|a| a.work.is_running()) {
        let hint = tr!("What has been found until then stays");
        if ui.button(tr!("⏹ Stop")).on_hover_text(hint).clicked() {
            stop.write(Stop(model.to_owned()));
        }
        // The job counts the iterations of solvers too.
        let seen = analysis.map(|a| &a.seen);
        let last = seen.and_then(|s| s.shot(s.count().checked_sub(1)?));
        let done = seen
            .and_then(|s| s.skin())
            .zip(last)
            .map_or(0.0, |(skin, shot)| skin.progress(shot.time));
        ui.add(
            ProgressBar::new(done)
                .desired_width(160.0)
                .text(tr!("{} % of its life", fixed(100.0 * done, 0))),
        );
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(50));
        return;
    }
    let name = if analysis.is_some() { tr!("⟲ Analyze again") } else { tr!("▶ Analyze") };
    let hint = tr!("Loads, pours, creep and damage over the member's whole history, \
         as `intrados analyze` computes them");
    if ui.button(name).on_hover_text(hint).clicked() {
        let element = (stress.element > 0.0).then_some(stress.element);
        let meshing = Meshing { element };
        begin.write(Analyze { model: model.to_owned(), meshing, to_failure: false });
        (stress.moment, stress.shown, stress.picked) = (None, None, None);
    }
    let label = ui.label(tr!("Elements of"));
    let edge =
        drag(&mut stress.element).range(0.0..=2.0).speed(0.005).custom_formatter(|v, _| match v {
            v if v < 0.005 => tr!("a suitable size"),
            v => format!("{} m", fixed(v, 3)),
        });
    ui.add(edge)
        .labelled_by(label.id)
        .on_hover_text(tr!("Largest edge of an element; drag to 0 for one that suits the section"));
    if stress.element < 0.005 {
        stress.element = 0.0;
    }
}

/// Nothing has been computed.
fn invite(ui: &mut Ui, name: &str) {
    ui.add_space(24.0);
    ui.vertical_centered(|ui| {
        ui.heading(tr!("Not analysed yet"));
        ui.label(tr!(
            "Analyze follows {} through its loads, pours and years: stress, creep, cracks.",
            name
        ));
        ui.weak(tr!(
            "The newest equilibrium is shown while it runs; a fine mesh may take minutes."
        ));
    });
}

/// There is nothing to see, or not yet.
fn waiting(ui: &mut Ui, analysis: &Analysis) {
    ui.add_space(24.0);
    ui.vertical_centered(|ui| match &analysis.work {
        Work::Running(_) => {
            ui.spinner();
            ui.label(tr!("Looking for the first equilibrium…"));
        }
        _ => state(ui, analysis, ""),
    });
}

/// How the analysis ended, where that matters.
fn state(ui: &mut Ui, analysis: &Analysis, part: &str) {
    match &analysis.work {
        Work::Running(_) => {}
        Work::Cancelled => stopped(ui),
        Work::Failed(why) => {
            ui.colored_label(ui.visuals().error_fg_color, tr!("⚠ Not computed: {}", term(why)));
        }
        Work::Done(life) => ended(ui, &life.outcome, part),
    }
}

fn stopped(ui: &mut Ui) {
    ui.label(tr!("⏹ Stopped: what had been found until then is shown."));
}

fn ended(ui: &mut Ui, outcome: &Outcome, part: &str) {
    if outcome.stopped {
        stopped(ui);
    } else if !outcome.complaint.is_empty() {
        let text = tr!("⚠ Ended early: {}", term(&outcome.complaint));
        ui.add(
            egui::Label::new(egui::RichText::new(&text).color(ui.visuals().warn_fg_color))
                .truncate(),
        )
        .on_hover_text(text);
    }
    ui.horizontal_wrapped(|ui| {
        if let Some(text) = save::summary(outcome, part) {
            ui.weak(text);
        }
        if !outcome.notes.is_empty() {
            ui.label(tr!("ℹ {} notes", outcome.notes.len())).on_hover_text(lines(&outcome.notes));
        }
    });
}

fn controls(ui: &mut Ui, stress: &mut Stress, skin: &Skin, auto: f32, ranges: &mut Ranges) {
    ui.horizontal_wrapped(|ui| {
        let combo = ComboBox::from_id_salt("stress quantity")
            .width(190.0)
            .selected_text(stress.quantity.name(skin));
        let shown = combo.show_ui(ui, |ui| {
            for quantity in Quantity::all() {
                ui.selectable_value(&mut stress.quantity, quantity, quantity.name(skin));
            }
        });
        shown.response.on_hover_text(tr!("What is shown on the member"));
        let label = ui.label(tr!("Deformation ×"));
        let mut scale = stress.scale.unwrap_or(auto);
        let slider = slide(&mut scale, 0.0..=(20.0 * auto).max(100.0))
            .logarithmic(true)
            .smallest_positive(0.1)
            .max_decimals(1);
        let response = ui.add(slider).labelled_by(label.id);
        if response.on_hover_text(tr!("1 is true to scale")).changed() {
            stress.scale = Some(scale);
        }
        if stress.scale.is_some() && ui.small_button(tr!("auto")).clicked() {
            stress.scale = None;
        }
        ui.checkbox(&mut stress.mesh, tr!("Mesh"));
        if skin.parts.len() > 1 {
            ui.checkbox(&mut stress.alone, tr!("This member alone"));
        }
        ui.checkbox(&mut stress.whole_life, tr!("Same colours at all times"))
            .on_hover_text(tr!("One range over the whole life instead of one for each moment"));
        // Damage goes from 0 to 1 everywhere.
        let quantity = stress.quantity;
        let shown = stress.shown.as_ref().filter(|s| s.key.quantity == quantity);
        if let Some(shown) = shown.filter(|_| quantity != Quantity::Damage) {
            let unit = term(quantity.unit().0);
            scale::lock(ui, ranges, &quantity.key(), shown.scale.range, &unit, false);
        }
    });
}

/// The slider through the life.
fn time(
    ui: &mut Ui,
    stress: &mut Stress,
    shot: &Snapshot,
    index: usize,
    count: usize,
    running: bool,
) {
    ui.horizontal(|ui| {
        let mut go = |to: Option<usize>| stress.moment = to;
        let before = ui.small_button("◀").on_hover_text(tr!("Equilibrium before"));
        if before.clicked() && index > 0 {
            go(Some(index - 1));
        }
        if ui.small_button("▶").on_hover_text(tr!("Next equilibrium")).clicked() {
            go((index + 1 < count).then_some(index + 1));
        }
        let label = ui.label(tr!("Step"));
        let mut number = index + 1;
        ui.spacing_mut().slider_width = 220.0;
        if ui.add(Slider::new(&mut number, 1..=count)).labelled_by(label.id).changed() {
            // At the end it stays with the newest.
            go((number < count).then(|| number - 1));
        }
        ui.label(if running { tr!("of {} so far", count) } else { tr!("of {}", count) });
        ui.separator();
        ui.strong(moment(shot.time));
        ui.label(tr!("load factor {}", fixed(shot.load_factor, 2)));
        if shot.residual > 1e-3 {
            let residual = significant(shot.residual, 2);
            ui.label(tr!("⚠ loose"))
                .on_hover_text(tr!("{} of all that acts is out of balance", residual));
        }
    });
}

/// Cracks that the Render tab shows.
fn cracks(ui: &mut Ui, damage: &Query<&SurfaceDamage>, widening: &mut ResMut<Widening>) {
    let (mut count, mut spalls, mut widest) = (0, 0, 0.0_f32);
    for damage in damage {
        (count, spalls, widest) = (
            count + damage.cracks.len(),
            spalls + damage.spalls.len(),
            widest.max(damage.widest()),
        );
    }
    if count + spalls == 0 {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        let widest = fixed(1e3 * widest, 2);
        ui.label(match spalls {
            0 => tr!("The Render tab shows {} cracks up to {} mm; drawn", count, widest),
            _ => tr!(
                "The Render tab shows {} cracks up to {} mm and {} places without cover; drawn",
                count,
                widest,
                spalls
            ),
        });
        let mut times = widening.0;
        let factor = drag(&mut times).range(1.0..=50.0).speed(0.1).max_decimals(1).suffix(" ×");
        // The picture begins anew: not while it is dragged.
        let response = ui.add(factor).on_hover_text(tr!("1 is true to scale"));
        let id = response.id.with("wanted");
        if response.dragged() || response.has_focus() {
            ui.data_mut(|d| d.insert_temp(id, times));
            widening.bypass_change_detection().0 = times;
        } else if ui.data_mut(|d| d.remove_temp::<f32>(id)).is_some()
            || times.to_bits() != widening.0.to_bits()
        {
            widening.0 = times;
        }
        ui.label(tr!("as wide."));
    });
}

/// A moment for people.
pub(crate) fn moment(time: f64) -> String {
    match time / DAY {
        d if d.abs() < 0.1 => format!("{} min", fixed(time / 60.0, 0)),
        d if d < 1000.0 => tr!("day {}", significant(d, 3)),
        d => tr!("year {}", fixed(d * DAY / YEAR, 1)),
    }
}

/// A round factor that shows the largest displacement of the whole life as a twentieth of the size.
fn scale_of(skin: &Skin, analysis: &Analysis) -> f32 {
    let [low, high] = bounds(&skin.rest);
    let largest = analysis.seen.shots().iter().map(|s| s.largest[0]).fold(0.0, f32::max);
    let wanted = SHOWN * (high - low).max_element() / largest.max(1e-9);
    let decade = 10_f32.powf(wanted.max(1.0).log10().floor());
    let digit = [5.0, 2.0, 1.0].into_iter().find(|d| d * decade <= wanted).unwrap_or(1.0);
    (digit * decade).clamp(1.0, 1e5)
}

/// What is shown of one moment.
struct View<'a> {
    skin: &'a Arc<Skin>,
    shot: &'a Arc<Snapshot>,
    analysis: &'a Analysis,
    part: Option<u32>,
    index: usize,
    count: usize,
    auto: f32,
    colours: Colours,
    ranges: &'a Ranges,
}

impl View<'_> {
    fn show(&self, ui: &mut Ui, stress: &mut Stress, rect: Rect, jobs: &mut Jobs) {
        let below = 22.0;
        let rect = Rect::from_min_max(
            rect.min,
            pos2(rect.right(), (rect.bottom() - below).max(rect.top() + 40.0)),
        );
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| {
            egui::WidgetInfo::labeled(
                egui::Role::Image,
                true,
                tr!("Stress: {}", stress.quantity.name(self.skin)),
            )
        });
        let camera = self.camera(stress, rect);
        let camera = hand(ui, &response, rect, camera);
        stress.camera = Some(camera.clone());
        self.redraw(ui, stress, &camera, rect, response.dragged());
        ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        let Some(shown) = &stress.shown else { return };
        ui.painter().image(
            shown.texture.id(),
            rect,
            Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)),
            Color32::WHITE,
        );
        legend(ui, rect, stress.quantity, &stress.quantity.name(self.skin), shown);
        triad(ui, rect, &camera);
        let under = response.hover_pos().and_then(|at| self.vertex(shown, &camera, rect, at));
        if response.clicked() {
            stress.picked = under.map(|vertex| Picked { vertex });
        }
        if let Some(vertex) = under {
            response.on_hover_ui_at_pointer(|ui| self.numbers(ui, vertex, false));
        }
        if let Some(picked) = stress.picked.filter(|p| (p.vertex as usize) < shown.positions.len())
        {
            let at = place(&camera, rect, shown.positions[picked.vertex as usize]);
            for (width, colour) in [(4.0, Color32::BLACK), (2.0, colours::SELECTED)] {
                ui.painter().with_clip_rect(rect).circle_stroke(at, 6.0, (width, colour));
            }
            let corner = Rect::from_min_size(rect.min + vec2(8.0, 8.0), vec2(230.0, 10.0));
            ui.scope_builder(egui::UiBuilder::new().max_rect(corner), |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| self.numbers(ui, picked.vertex, true));
            });
        }
        let strip = Rect::from_min_max(
            pos2(rect.left(), rect.bottom() + 2.0),
            pos2(rect.right(), rect.bottom() + below),
        );
        ui.scope_builder(egui::UiBuilder::new().max_rect(strip), |ui| {
            ui.horizontal(|ui| self.saving(ui, stress, jobs))
        });
    }

    /// The camera as it is, in the shape of the picture; at first one that sees all of the member.
    fn camera(&self, stress: &Stress, rect: Rect) -> Camera {
        let (width, height) = (rect.width().max(8.0) as u32, rect.height().max(8.0) as u32);
        if let Some(camera) = &stress.camera {
            return Camera { width, height, ..camera.clone() };
        }
        let camera = Camera {
            name: "stress".into(),
            position: Vec3::new(0.9, 0.45, 1.1),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 32.0,
            width,
            height,
            exposure: 0.0,
            lens: None,
        };
        camera.framing(bounds(&self.skin.rest))
    }

    fn redraw(&self, ui: &Ui, stress: &mut Stress, camera: &Camera, rect: Rect, held: bool) {
        let scale = stress.scale.unwrap_or(self.auto);
        let part = self.part.filter(|_| stress.alone);
        if stress.whole_life && self.follow(&mut stress.life, stress.quantity, part) {
            ui.ctx().request_repaint();
        }
        let mut key = Key {
            skin: Arc::as_ptr(self.skin) as usize,
            moment: self.index,
            count: if stress.whole_life { stress.life.ranges.len() } else { 0 },
            quantity: stress.quantity,
            scale,
            colours: self.colours,
            locked: self.ranges.of(&stress.quantity.key()),
            part,
            mesh: stress.mesh,
            over: 2,
            camera: camera.clone(),
        };
        // Coarse as long as somebody moves it or it has just changed, fine in the frame after.
        if stress.shown.as_ref().is_none_or(|s| Key { over: key.over, ..s.key.clone() } != key)
            || held
        {
            key.over = 1;
            ui.ctx().request_repaint();
        }
        if stress.shown.as_ref().is_some_and(|s| {
            s.key == key || (s.key.over == 2 && key == Key { over: 1, ..s.key.clone() })
        }) {
            return;
        }
        let quantity = stress.quantity;
        // Seen from elsewhere, values stay what they are.
        let same = stress
            .shown
            .take_if(|s| {
                Key {
                    camera: key.camera.clone(),
                    over: key.over,
                    scale,
                    mesh: key.mesh,
                    ..s.key.clone()
                } == key
            })
            .map(|s| (s.faces, s.values, s.scale, s.texture));
        let positions: Vec<Vec3> = self
            .skin
            .rest
            .iter()
            .zip(&self.shot.displacement)
            .map(|(p, u)| *p + scale * *u)
            .collect();
        let (faces, values, colours, texture) = match same {
            Some((faces, values, colours, texture)) => (faces, values, colours, Some(texture)),
            None => {
                let outside = self
                    .skin
                    .facets
                    .iter()
                    .filter(|f| self.skin.is_outside(f, self.shot.time, part));
                let (faces, values): (Vec<[u32; 4]>, _) =
                    (outside.map(|f| f.corners).collect(), quantity.values(self.skin, self.shot));
                let range = self.range(stress, &values, &faces);
                let key = quantity.key();
                let colours = self.colours.locked_or_over(range, false, &key, self.ranges);
                (faces, values, colours, stress.shown.take().map(|s| s.texture))
            }
        };
        let density = ui.ctx().pixels_per_point();
        let size =
            [rect.width() * density, rect.height() * density].map(|n| (n as usize).clamp(8, 4096));
        let surface = Surface {
            positions: &positions,
            values: &values,
            faces: &faces,
            mesh: stress.mesh,
            sun: None,
        };
        let drawn =
            surface::draw(camera, size, key.over, &surface, |v| quantity.colour(&colours, v));
        let texture = match texture {
            Some(mut texture) => {
                texture.set(drawn.image.clone(), TextureOptions::LINEAR);
                texture
            }
            None => ui.ctx().load_texture("stress", drawn.image.clone(), TextureOptions::LINEAR),
        };
        let scale = colours;
        stress.shown = Some(Shown { key, drawn, texture, faces, positions, values, scale });
    }

    fn range(&self, stress: &Stress, values: &[f32], faces: &[[u32; 4]]) -> [f32; 2] {
        if !stress.whole_life || stress.life.ranges.is_empty() {
            return stress.quantity.range(faces.iter().flatten().map(|v| values[*v as usize]));
        }
        let [low, high] = stress
            .life
            .ranges
            .iter()
            .fold([0.0_f32, 0.0_f32], |[low, high], r| [low.min(r[0]), high.max(r[1])]);
        if low < 0.0 && high > 0.0 { [-high.max(-low), high.max(-low)] } else { [low, high] }
    }

    /// Finds the ranges of moments that are not known yet, as many as a frame bears; whether some
    /// are left.
    fn follow(&self, life: &mut Life, quantity: Quantity, part: Option<u32>) -> bool {
        let of = Some((Arc::as_ptr(self.skin) as usize, quantity, part));
        if life.of != of {
            *life = Life { of, ranges: Vec::new() };
        }
        let begin = std::time::Instant::now();
        while life.ranges.len() < self.count && begin.elapsed() < PATIENCE {
            let Some(shot) = self.analysis.seen.shot(life.ranges.len()) else { break };
            let values = quantity.values(self.skin, &shot);
            let faces =
                self.skin.facets.iter().filter(|f| self.skin.is_outside(f, shot.time, part));
            life.ranges
                .push(quantity.range(faces.flat_map(|f| f.corners).map(|v| values[v as usize])));
        }
        life.ranges.len() < self.count
    }

    /// The corner next to the pointer of the face under it.
    fn vertex(&self, shown: &Shown, camera: &Camera, rect: Rect, at: egui::Pos2) -> Option<u32> {
        let share = (at - rect.min) / rect.size();
        let face = shown.faces.get(shown.drawn.face(share.x, share.y)? as usize)?;
        let distance = |v: &u32| place(camera, rect, shown.positions[*v as usize]).distance_sq(at);
        face.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    fn numbers(&self, ui: &mut Ui, vertex: u32, all: bool) {
        let v = vertex as usize;
        let (Some(p), Some(u)) = (self.skin.rest.get(v), self.shot.displacement.get(v)) else {
            return;
        };
        egui::Grid::new(("numbers", all)).num_columns(2).spacing([12.0, 1.0]).show(ui, |ui| {
            let mut row = |name: String, value: String| {
                ui.weak(name);
                ui.label(value);
                ui.end_row();
            };
            let [x, y, z] = p.to_array().map(|x| fixed(x, 3));
            row(tr!("at|point"), tr!("{}, {}, {} m", x, y, z));
            let [x, y, z] = u.to_array().map(|x| fixed(1e3 * x, 3));
            row(tr!("moved"), tr!("{}, {}, {} mm", x, y, z));
            for quantity in Quantity::all().filter(|q| all || !matches!(q, Quantity::Component(_)))
            {
                let value = quantity.one(self.skin, self.shot, v);
                let unit = if quantity == Quantity::Damage { "" } else { quantity.unit().0 };
                let value = significant(f64::from(value), 3);
                row(quantity.name(self.skin), format!("{value} {unit}"));
            }
        });
    }

    /// What the picture shows, in a line.
    fn caption(&self, quantity: Quantity, shown: &Shown) -> String {
        let [low, high] = shown.scale.range.map(|v| significant(f64::from(v), 3));
        tr!(
            "{}, {} to {} {}, {}, displacements × {}; Intrados {}",
            quantity.name(self.skin),
            low,
            high,
            term(quantity.unit().0),
            moment(self.shot.time),
            local(shown.key.scale.to_string()),
            env!("CARGO_PKG_VERSION")
        )
    }

    /// What its colours mean, for a file.
    fn legend(&self, quantity: Quantity, shown: &Shown) -> Legend {
        let scale = &shown.scale;
        let mut lines = vec![self.caption(quantity, shown)];
        if let Some(values) = shown.extremes() {
            let [least, most] = values.map(|value| significant(f64::from(value), 3));
            lines.push(tr!("linear scale; max {}, min {}", most, least));
        }
        let colour = |value| quantity.colour(scale, value);
        Legend::new(scale, colour, |value| written(value, scale.range), lines)
    }

    fn saving(&self, ui: &mut Ui, stress: &mut Stress, jobs: &mut Jobs) {
        let label = ui.label(tr!("Save as"));
        ui.add(egui::TextEdit::singleline(&mut stress.path).desired_width(200.0))
            .labelled_by(label.id);
        let path = PathBuf::from(stress.path.trim());
        let kind = save::Kind::of(&path);
        let hint = tr!("The name ends in .png: this picture; \
             in .csv: every point of the surface at this moment");
        let can = kind.is_some() && stress.task.is_none();
        let button = egui::Button::new(tr!("Save picture or table"));
        if ui.add_enabled(can, button).on_hover_text(hint).clicked()
            && let (Some(kind), Some(shown)) = (kind, &stress.shown)
        {
            // Said here: the thread that writes speaks English.
            let what = match kind {
                save::Kind::Picture => self.caption(stress.quantity, shown),
                save::Kind::Table => tr!(
                    "{} points of the surface at {}",
                    save::points(self.skin, self.shot),
                    moment(self.shot.time)
                ),
            };
            let (image, background) = (shown.drawn.image.clone(), ui.visuals().extreme_bg_color);
            let legend = self.legend(stress.quantity, shown).drawn(ui, image.width());
            let (skin, shot) = (Arc::clone(self.skin), Arc::clone(self.shot));
            stress.task =
                Some(Task::spawn(jobs, tr!("writing {}", path.display()), move |_| match kind {
                    save::Kind::Picture => save::picture(image, background, &legend, &path, &what),
                    save::Kind::Table => save::table(&skin, &shot, &path, &what),
                }));
        }
        if kind.is_none() {
            ui.weak(tr!("The name must end in .png or .csv."));
        }
    }
}

/// A value beside the colours of a range: what is nothing but for rounding is 0.
fn written(value: f32, [low, high]: [f32; 2]) -> String {
    if value.abs() < 1e-4 * (high - low) { "0".into() } else { significant(f64::from(value), 3) }
}

/// Colours with their values, and the true extremes.
fn legend(ui: &Ui, rect: Rect, quantity: Quantity, name: &str, shown: &Shown) {
    let painter = ui.painter().with_clip_rect(rect);
    let height = (rect.height() * 0.6).clamp(60.0, 260.0);
    let bar = Rect::from_min_size(pos2(rect.right() - 84.0, rect.top() + 42.0), vec2(14.0, height));
    // The picture may reach under it.
    let behind = Rect::from_min_max(
        pos2(bar.left() - 6.0, rect.top()),
        pos2(rect.right(), bar.bottom() + 40.0),
    );
    painter.rect_filled(behind, 0.0, ui.visuals().extreme_bg_color.gamma_multiply(0.75));
    let steps = scale::steps(&shown.scale);
    for k in 0..steps {
        let value = scale::at(&shown.scale, (f32::from(k) + 0.5) / f32::from(steps));
        let y = |k: u8| bar.bottom() - bar.height() * f32::from(k) / f32::from(steps);
        painter.rect_filled(
            Rect::from_min_max(pos2(bar.left(), y(k + 1)), pos2(bar.right(), y(k) + 0.5)),
            0.0,
            colours::ink(quantity.colour(&shown.scale, value)),
        );
    }
    scale::ends(&painter, &shown.scale, bar, true);
    let (font, colour) = (egui::TextStyle::Small.resolve(ui.style()), ui.visuals().text_color());
    // Where bands meet, if there are some.
    let parts = if shown.scale.bands < 2 { 4 } else { 5 };
    for k in 0..=parts {
        let share = k as f32 / parts as f32;
        let value = scale::at(&shown.scale, share);
        let y = bar.bottom() - bar.height() * share;
        painter.hline(bar.right()..=bar.right() + 3.0, y, (1.0, colour));
        painter.text(
            pos2(bar.right() + 6.0, y),
            egui::Align2::LEFT_CENTER,
            written(value, shown.scale.range),
            font.clone(),
            colour,
        );
    }
    let right = |y: f32, text: String| {
        painter.text(
            pos2(rect.right() - 8.0, y),
            egui::Align2::RIGHT_TOP,
            text,
            font.clone(),
            colour,
        )
    };
    right(rect.top() + 6.0, name.into());
    right(rect.top() + 20.0, term(quantity.unit().0));
    if let Some([least, most]) = shown.extremes() {
        right(bar.bottom() + 10.0, tr!("max {}", significant(f64::from(most), 3)));
        right(bar.bottom() + 24.0, tr!("min {}", significant(f64::from(least), 3)));
    }
}

/// Which way x, y and z go.
fn triad(ui: &Ui, rect: Rect, camera: &Camera) {
    let [right, up, _] = camera.frame();
    let middle = pos2(rect.left() + 34.0, rect.bottom() - 34.0);
    let font = egui::TextStyle::Small.resolve(ui.style());
    for (axis, name) in [(Vec3::X, "x"), (Vec3::Y, "y"), (Vec3::Z, "z")] {
        let d = vec2(axis.dot(right), -axis.dot(up));
        ui.painter()
            .line_segment([middle, middle + 20.0 * d], (1.5, ui.visuals().weak_text_color()));
        ui.painter().text(
            middle + 28.0 * d,
            egui::Align2::CENTER_CENTER,
            name,
            font.clone(),
            ui.visuals().text_color(),
        );
    }
}
