//! The Structure panel: all members in space, coloured by damage. A click goes to a member's sheet.

mod compass;
mod flight;
mod measure;
mod model;
mod prints;
mod section;
mod settled;
mod slice;
mod spot;
mod time;

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{Rect, Ui, vec2};
use flight::Flight;
use glam::Vec3;
use intrados_scene::{Camera, Scene, plugin::CurrentScene};
use intrados_stage::Jobs;
use measure::Tape;
use model::Scale;
use section::Section;
use settled::{Light, Settling};
pub(crate) use spot::Spot;

use crate::{
    Action, Actions, Latest, Selection,
    attach::Form,
    ct::Ct,
    history::{Earlier, History},
    lang::fixed,
    moment::{Courses, Moment, Seen, Timeline},
    orbit,
    play::Play,
    saving::Saving,
    workspace::Desk,
};

/// What one row of tools covers at the head of the picture, with a little air, points.
const TOOLS: f32 = 48.0;

/// Where the structure is looked at from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum View {
    /// From the same side, so that the selected member, or all of them, fill the picture.
    Framed,
    /// As at first.
    Home,
    /// From a side: from there to the middle.
    Along(Vec3),
}

/// A side that a structure is looked at from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aspect {
    /// Along z.
    Front,
    /// Along x.
    Side,
    /// From above.
    Top,
}

impl Aspect {
    /// All of them, each with its key.
    const ALL: [(Self, &'static str); 3] =
        [(Self::Front, "1"), (Self::Side, "3"), (Self::Top, "7")];

    fn name(self) -> String {
        match self {
            Self::Front => tr!("Front|view"),
            Self::Side => tr!("Side|view"),
            Self::Top => tr!("Top|view"),
        }
    }

    /// From there to the middle.
    fn axis(self) -> Vec3 {
        match self {
            Self::Front => Vec3::new(0.0, 0.06, 1.0),
            Self::Side => Vec3::new(1.0, 0.06, 0.0),
            Self::Top => Vec3::new(0.0, 1.0, 0.02),
        }
    }
}

/// What the panel remembers.
#[derive(Resource)]
pub(crate) struct Structure {
    model: model::Model,
    /// The same as an earlier prediction has it, on its left.
    earlier: model::Model,
    /// Whether members are named in the picture.
    names: bool,
    /// Where it is cut open.
    section: Option<Section>,
    tape: Tape,
    /// Where the slice of the CT tab lies.
    outline: slice::SliceOutline,
    /// Where on its member the evidence is that a form asks for.
    place: Option<Vec3>,
    /// An earlier prediction is seen from where the newest is.
    is_linked: bool,
    /// Where it was looked at from before the picture was parted in two.
    parted: Option<Camera>,
    wished: Option<View>,
    /// A camera through which somebody wants to look, and the hash of the scene that it is of; it
    /// waits until the panel is in sight.
    followed: Option<(String, Camera)>,
    /// Whether it is shown as it looks, not by its damage.
    is_lit: bool,
    settling: Settling,
    /// A flight is to begin once there is a picture to begin it from.
    takes_off: bool,
    flight: Option<Flight>,
}

impl Default for Structure {
    fn default() -> Self {
        Self {
            model: model::Model::below(TOOLS),
            earlier: model::Model::earlier(),
            names: true,
            section: None,
            tape: Tape::default(),
            outline: slice::SliceOutline::default(),
            place: None,
            is_linked: true,
            parted: None,
            wished: None,
            followed: None,
            is_lit: false,
            settling: Settling::default(),
            takes_off: false,
            flight: None,
        }
    }
}

impl Structure {
    pub(crate) fn look(&mut self, view: View) {
        self.wished = Some(view);
    }

    pub(crate) fn look_from(&mut self, aspect: Aspect) {
        self.look(View::Along(aspect.axis()));
    }

    /// Hides the scale of colours, which may lie over a member, or shows it again.
    pub(crate) fn swap_legend(&mut self) {
        self.model.swap_legend();
    }

    /// Where it is looked at from, once that is known.
    pub(crate) fn camera(&self) -> Option<&Camera> {
        self.followed.as_ref().map(|(_, camera)| camera).or(self.model.camera())
    }

    /// Whether somebody wants to look from elsewhere.
    pub(crate) fn is_called(&self) -> bool {
        self.wished.is_some() || self.followed.is_some()
    }

    /// Looks at the scene from there, whatever else was wished before; whoever goes
    /// elsewhere flies no more.
    pub(crate) fn follow(&mut self, scene: &Scene, camera: &Camera) {
        self.wished = None;
        self.flight = None;
        self.followed = Some((scene.hash.clone(), camera.clone()));
    }

    /// Goes where somebody wants to look from.
    fn go(&mut self, scene: &Arc<Scene>, member: Option<usize>, is_compared: bool) {
        if let Some((_, camera)) = self.followed.take().filter(|(of, _)| *of == scene.hash) {
            // With the surfaces of another scene they would let the camera go.
            self.model.adopt(scene);
            if is_compared {
                self.earlier.adopt(scene);
            }
            self.model.follow(&camera);
            self.earlier.follow(&camera);
        }
        if let Some(view) = self.wished.take() {
            self.end_flight();
            let member = member.filter(|_| view == View::Framed);
            self.model.go(view, scene, member);
            self.model.camera().iter().for_each(|camera| self.earlier.follow(camera));
        }
    }

    /// Two pictures have half of the panel each. Once one has all of it again, as wide, all of what
    /// was seen is still seen, if anybody has moved there; else it is as it was before.
    fn part(&mut self, is_compared: bool, width: f32) {
        let Some(camera) = self.model.camera().cloned() else { return };
        if is_compared {
            self.parted.get_or_insert(camera);
            return;
        }
        let Some(before) = self.parted.take() else { return };
        let place = |c: &Camera| (c.position, c.target, c.fov_deg);
        if place(&before) != place(&camera) {
            // The angle is across the width: of a wider picture of the same angle less of the height
            // is seen.
            let wider = width / camera.width.max(1) as f32;
            self.aim(&orbit::dolly(&camera, wider.max(1.0)));
        }
    }

    fn aim(&mut self, camera: &Camera) {
        self.model.follow(camera);
        self.earlier.follow(camera);
    }

    pub(crate) fn is_flying(&self) -> bool {
        self.flight.is_some()
    }

    /// Begins a flight along the selected member; one that goes on halts, and one that has halted
    /// goes on.
    pub(crate) fn fly_or_halt(&mut self) {
        match &mut self.flight {
            Some(flight) => flight.halt(),
            None => self.takes_off = true,
        }
    }

    /// Ends a flight where it began; whether there was one.
    pub(crate) fn end_flight(&mut self) -> bool {
        let flight = self.flight.take();
        flight.iter().for_each(|flight| self.aim(flight.home()));
        flight.is_some()
    }

    /// Begins the flight that was asked for, and takes the camera along on the one that there is.
    fn fly(&mut self, ui: &Ui, scene: &Scene, selection: Selection) {
        if self.model.shows(scene) && std::mem::take(&mut self.takes_off) {
            self.flight = self.take_off(scene, selection.0);
        }
        let Some(flight) = &mut self.flight else { return self.model.fly(false) };
        flight.go_on(ui.input(|i| i.time));
        if flight.is_over(scene) {
            self.end_flight();
            return self.model.fly(false);
        }
        // Only while it moves are frames asked for.
        let (plays, camera) = (flight.plays, flight.camera());
        if plays {
            ui.ctx().request_repaint();
        }
        camera.iter().for_each(|camera| self.aim(camera));
        self.model.fly(plays);
    }

    fn take_off(&self, scene: &Scene, member: Option<usize>) -> Option<Flight> {
        let (member, home) = (member?, self.model.camera()?);
        let triangles: Vec<[Vec3; 3]> = self.model.triangles(member).collect();
        Flight::along(scene, member, &triangles, home)
    }

    /// Where the evidence is that a form asks for.
    fn put(&mut self, scene: &Scene, under: Option<Spot>, form: &mut Form) {
        let spot = under.filter(|_| form.is_open);
        if let Some((spot, member)) = spot.and_then(|s| Some((s, scene.members.get(s.member)?))) {
            form.put_at(spot.along(member.frame), spot.face(member));
            self.place = Some(spot.at);
        }
    }

    /// The place on a member that is at a point of the window, while the picture is in sight.
    pub(crate) fn spot(&self, at: egui::Pos2) -> Option<Spot> {
        self.model.spot(at)
    }
}

/// The picture of a structure of which nothing is known yet.
pub(crate) struct Preview(model::Model);

impl Default for Preview {
    fn default() -> Self {
        Self(model::Model::bare())
    }
}

impl Preview {
    pub(crate) fn show(&mut self, ui: &mut Ui, rect: Rect, scene: &Arc<Scene>, jobs: &mut Jobs) {
        let shown = self.0.show(ui, rect, scene, &[], Scale::DAMAGE, Selection(None), None, jobs);
        shown.iter().for_each(|shown| model::ruler(ui, rect, &shown.camera));
    }
}

pub(crate) fn structure(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    mut history: ResMut<History>,
    selection: Res<Selection>,
    mut structure: ResMut<Structure>,
    courses: Res<Courses>,
    mut moment: ResMut<Moment>,
    play: Res<Play>,
    mut light: Light<'_>,
    mut form: ResMut<Form>,
    saving: Res<Saving>,
    ct: Res<Ct>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
    desk: Res<Desk>,
) {
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    let jobs = jobs.bypass_change_detection();
    structure.bypass_change_detection().is_linked = desk.links();
    let whole = ui.available_rect_before_wrap();
    let history = history.bypass_change_detection();
    let structure = structure.bypass_change_detection();
    structure.part(history.beside().is_some(), whole.width());
    structure.go(scene, selection.0, history.beside().is_some());
    structure.fly(ui, scene, *selection);
    let section = structure.section;
    // What is cut open, or compared, is not as it looks.
    let is_lit = structure.is_lit && section.is_none() && history.beside().is_none();
    let when = *moment;
    let seen = when.seen(scene, &latest, &courses);
    let coloured = if is_lit { &[] } else { &seen[..] };
    let scale = match (is_lit, when.added && !when.is_now()) {
        (true, _) => Scale::NONE,
        (false, true) => Scale::ADDED,
        (false, false) => Scale::DAMAGE,
    };
    let rect = match history.beside() {
        None => whole,
        Some(earlier) => {
            let (left, right) = whole.split_left_right_at_fraction(0.5);
            beside(
                ui,
                left.with_max_x(left.right() - 2.0),
                structure,
                earlier,
                scene,
                *selection,
                jobs,
                &mut actions,
            );
            right
        }
    };
    structure.model.slide(selection.0.filter(|_| form.is_open));
    structure.place = structure.place.filter(|_| form.is_open);
    let pointed = structure.model.show(ui, rect, scene, coloured, scale, *selection, section, jobs);
    let Some(pointed) = pointed else {
        if scene.members.is_empty() {
            to_light(ui, whole, &mut actions);
        }
        return;
    };
    if pointed.response.dragged() {
        structure.flight.iter_mut().for_each(Flight::rest);
    }
    if is_lit {
        structure.settling.show(ui, rect, &pointed.camera, &mut light);
    }
    model::ruler(ui, rect, &pointed.camera);
    if structure.names {
        let value = |i: usize| match when.is_now() {
            true => latest.member(i).map(|p| p.damage.value),
            false => seen.get(i).and_then(Seen::most),
        };
        structure.model.names(ui, rect, scene, &value, *selection, &pointed.camera);
    }
    if structure.is_linked {
        structure.earlier.follow(&pointed.camera);
    }
    compass::draw(ui, rect, &pointed.camera);
    let sliced = selection.0.and_then(|member| Some((member, ct.plane(scene, member)?)));
    if let Some((member, plane)) = sliced {
        let Structure { model, outline, .. } = &mut *structure;
        let model = &*model;
        outline.follow((scene.hash.as_str(), member, plane), || model.triangles(member));
        outline.draw(ui, rect, &pointed.camera);
    }
    structure.tape.draw(ui, rect, &pointed.camera);
    structure.place.iter().for_each(|at| measure::end(ui, rect, &pointed.camera, *at));
    let shown = Shown { latest: &latest, seen: &seen, when };
    point(structure, scene, &shown, pointed, form.bypass_change_detection(), &mut actions);
    if saving.takes_panel() {
        // Of the tools only what the slider says is part of what is seen.
        if !when.is_now() {
            time::write(ui, whole, when.years, &courses.timeline);
        }
        return;
    }
    let bar = Rect::from_min_size(whole.min + vec2(8.0, 8.0), vec2(whole.width() - 16.0, 24.0));
    let drawn = ui.scope_builder(egui::UiBuilder::new().max_rect(bar), |ui| {
        ui.vertical(|ui| {
            let timeline = &courses.timeline;
            let time = (&mut moment, timeline, play.is_on);
            tools(ui, structure, history, *selection, time, &mut actions);
            if is_lit {
                let frame = egui::Frame::popup(ui.style()).inner_margin(4);
                frame.show(ui, |ui| light.tools(ui));
            }
            flown(ui, structure, scene, *selection, &mut actions);
        });
    });
    structure.model.cover((drawn.response.rect.bottom() + 8.0 - whole.top()).max(TOOLS));
}

/// The way out of a picture with nothing in it.
fn to_light(ui: &mut Ui, rect: Rect, actions: &mut Actions) {
    let size = vec2(200.0_f32.min(rect.width()), 24.0);
    let at = Rect::from_center_size(rect.center() + vec2(0.0, 30.0), size);
    if ui.put(at, egui::Button::new(tr!("Look at its light"))).clicked() {
        actions.ask(Action::Light);
    }
}

/// The structure as an earlier prediction has it, from the same side unless both were parted.
fn beside(
    ui: &mut Ui,
    rect: Rect,
    structure: &mut Structure,
    earlier: &Earlier,
    scene: &Arc<Scene>,
    selection: Selection,
    jobs: &mut Jobs,
    actions: &mut Actions,
) {
    let (seen, section) = (earlier.seen(scene), structure.section);
    let shown =
        structure.earlier.show(ui, rect, scene, &seen, Scale::DAMAGE, selection, section, jobs);
    let Some(pointed) = shown else { return };
    model::ruler(ui, rect, &pointed.camera);
    if structure.is_linked {
        structure.model.follow(&pointed.camera);
    }
    if structure.names {
        let value = |i: usize| earlier.member(&scene.members[i].id)?.damage().map(|d| d.value);
        structure.earlier.names(ui, rect, scene, &value, selection, &pointed.camera);
    }
    let font = egui::TextStyle::Body.resolve(ui.style());
    // Above the ruler.
    let at = rect.left_bottom() + vec2(10.0, -44.0);
    let ink = ui.visuals().strong_text_color();
    ui.painter().with_clip_rect(rect).text(
        at,
        egui::Align2::LEFT_BOTTOM,
        &earlier.title,
        font,
        ink,
    );
    if pointed.response.clicked() {
        actions.ask(Action::Select(pointed.under.map(|spot| spot.member)));
    }
}

/// What is shown, and when that is.
struct Shown<'a> {
    latest: &'a Latest,
    seen: &'a [Seen],
    when: Moment,
}

impl Shown<'_> {
    /// What is to be said of a place beside how it is now.
    fn later(&self, spot: &Spot) -> String {
        let value = self.seen.get(spot.member).and_then(|s| s.zones[spot.zone]);
        let Some(value) = value.filter(|_| !self.when.is_now()) else { return String::new() };
        let (years, value) = (self.when.years, fixed(value, 2));
        match self.when.added {
            _ if years < 0.0 => tr!("{} years ago: d = {}, by its life", fixed(-years, 1), value),
            false => tr!("In {} years: d = {} at least", fixed(years, 1), value),
            true => tr!("{} years add {}, by the forecast", fixed(years, 1), value),
        }
    }
}

/// What a click does: it selects a member, or says where on it evidence is, or holds the tape.
fn point(
    structure: &mut Structure,
    scene: &Scene,
    shown: &Shown<'_>,
    pointed: model::Pointed,
    form: &mut Form,
    actions: &mut Actions,
) {
    let model::Pointed { response, under, slides, .. } = pointed;
    if slides {
        structure.put(scene, under, form);
    }
    if response.clicked() {
        if structure.tape.is_on {
            under.iter().for_each(|spot| structure.tape.put(spot.at));
        } else {
            actions.ask(Action::Select(under.map(|spot| spot.member)));
            structure.put(scene, under, form);
        }
    }
    if response.double_clicked() && !structure.tape.is_on {
        actions.ask(Action::Frame);
    }
    if let Some(spot) = under {
        let later = shown.later(&spot);
        response.on_hover_ui_at_pointer(|ui| {
            model::said(ui, scene, shown.latest, &spot, &later);
        });
    }
}

/// Where to look from, what is shown, and the tools that are out.
fn tools(
    ui: &mut Ui,
    structure: &mut Structure,
    history: &mut History,
    selection: Selection,
    (moment, timeline, is_playing): (&mut ResMut<Moment>, &Timeline, bool),
    actions: &mut Actions,
) {
    let frame = egui::Frame::popup(ui.style()).inner_margin(4);
    frame.show(ui, |ui| {
        // In a narrow panel the tools at the end would be out of reach.
        ui.horizontal_wrapped(|ui| {
            views(ui, structure, selection, actions);
            ui.toggle_value(&mut structure.names, tr!("Names"))
                .on_hover_text(tr!("Name and damage of every member, the worst first"));
            let mut is_cut = structure.section.is_some();
            let hint = tr!("Cuts it open, through the middle of the selected member");
            if ui.toggle_value(&mut is_cut, tr!("Section")).on_hover_text(hint).changed() {
                structure.section = is_cut.then(|| structure.model.section(selection.0));
            }
            let hint = tr!("The distance between two places that are clicked");
            let tape = ui.toggle_value(&mut structure.tape.is_on, tr!("Measure"));
            if tape.on_hover_text(hint).changed() {
                structure.tape.clear();
            }
            compared(ui, history, actions);
            let hint = tr!("Light, as an eye would see it, path-traced once nobody moves it");
            let lit = ui.toggle_value(&mut structure.is_lit, tr!("As it looks"));
            if lit.on_hover_text(hint).changed() {
                structure.settling = Settling::default();
            }
        });
    });
    if timeline.range().is_some() {
        let mut when = **moment;
        frame.show(ui, |ui| {
            ui.horizontal_wrapped(|ui| time::bar(ui, &mut when, timeline, is_playing, actions))
        });
        moment.set_if_neq(when);
    }
    let bounds = structure.model.bounds();
    if let Some(section) = &mut structure.section {
        frame.show(ui, |ui| ui.horizontal_wrapped(|ui| section.tools(ui, bounds)));
    }
    if structure.tape.is_on {
        frame.show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label(structure.tape.said());
                if ui.button(tr!("Clear the tape")).clicked() {
                    structure.tape.clear();
                }
            })
        });
    }
}

/// The flight that there is; of a tunnel that is selected, how to begin one.
fn flown(
    ui: &mut Ui,
    structure: &mut Structure,
    scene: &Scene,
    selection: Selection,
    actions: &mut Actions,
) {
    let frame = egui::Frame::popup(ui.style()).inner_margin(4);
    let member = selection.0.and_then(|index| scene.members.get(index));
    if let Some(flight) = &mut structure.flight {
        let ends = frame.show(ui, |ui| ui.horizontal_wrapped(|ui| flight.tools(ui)).inner).inner;
        if ends {
            structure.end_flight();
        }
    } else if member.is_some_and(|m| flight::is_tunnel(m.kind)) {
        let hint = tr!("Along its axis in some twenty seconds, and back to where one was");
        let button = frame.show(ui, |ui| ui.button(tr!("Fly through"))).inner;
        if button.on_hover_text(hint).clicked() {
            actions.ask(Action::Fly);
        }
    }
}

/// Which earlier prediction is looked at beside the newest.
fn compared(ui: &mut Ui, history: &mut History, actions: &mut Actions) {
    let mut chosen = history.chosen();
    let button = ui.menu_button(tr!("Compare"), |ui| {
        ui.selectable_value(&mut chosen, None, tr!("Nothing"));
        for (index, title) in history.titles().enumerate() {
            ui.selectable_value(&mut chosen, Some(index), title);
        }
        ui.separator();
        if ui.button(tr!("Open an earlier prediction…")).clicked() {
            actions.ask(Action::ChoosePrediction);
        }
    });
    let hint = tr!("An earlier prediction beside this one: of before a change, \
         or the predict.json of another day");
    button.response.on_hover_text(hint);
    history.choose(chosen);
}

fn views(ui: &mut Ui, structure: &mut Structure, selection: Selection, actions: &mut Actions) {
    let all = ui.button(tr!("All")).on_hover_text(tr!("The whole structure (Home)"));
    if all.clicked() {
        actions.ask(Action::Home);
    }
    let hint = tr!("The selected member fills the picture (F)");
    let member = ui.add_enabled(selection.0.is_some(), egui::Button::new(tr!("Selected")));
    if member.on_hover_text(hint).clicked() {
        actions.ask(Action::Frame);
    }
    let mut is_parallel = structure.model.is_parallel();
    let hint = tr!("From very far, so that parallels stay parallel, as in a drawing");
    if ui.toggle_value(&mut is_parallel, tr!("Parallel")).on_hover_text(hint).changed() {
        structure.model.narrow(is_parallel);
    }
    for (aspect, key) in Aspect::ALL {
        if ui.button(aspect.name()).on_hover_text(key).clicked() {
            actions.ask(Action::LookFrom(aspect));
        }
    }
}
