//! The Photos tab: corners picked in a photograph and on the member say where it was taken from;
//! then what it shows of the member, without the light, is read.

mod model;
mod prints;
mod sheet;
mod work;

use std::{path::PathBuf, sync::Arc};

use bevy_ecs::prelude::*;
use egui::{ComboBox, Rect, ScrollArea, TextureHandle, TextureOptions, Ui, pos2, vec2};
use glam::DVec3;
use intrados_photo::{ByEdges, Located, Pick, corner::Outline};
use intrados_scene::{Member, Scene, plugin::CurrentScene, structure::Photographed};
use intrados_stage::{Jobs, Task};
use model::Turn;
use work::{Face, Opened, Picked, Placed};

use crate::{
    Action, Actions, Selection, Viewpoint,
    lang::{fixed, term},
    members,
    workspace::Desk,
    zoom::Zoom,
};

/// Width of what stands beside the photograph, points.
const ASIDE: f32 = 310.0;
/// Fewest picks of which a place can be made.
const FEWEST: usize = 4;
/// From so far a find is looked at in the model, m.
const NEAR: f64 = 1.2;

/// Lines that what is told of its place has; more of them are scrolled to.
const TOLD: f32 = 5.0;
/// So many changes of picks can be taken back.
const MOST: usize = 64;

/// What is open: the scene's hash, the member's id, the photograph.
type Key = (String, String, PathBuf);

/// What the tab remembers.
#[derive(Resource, Default)]
pub(crate) struct Photos {
    /// What is typed.
    path: String,
    /// The photograph that is looked at; none: the member's first.
    chosen: Option<PathBuf>,
    of: Option<Key>,
    opening: Option<Task<Result<Opened, String>>>,
    shot: Option<Result<Shot, String>>,
    zoom: Zoom,
    turn: Turn,
    /// The corner that the next click in the photograph is of.
    armed: Option<usize>,
    /// The face that is looked at instead of the photograph.
    face: Option<usize>,
    /// The member that a photograph is being attached to, and those that it has already: the new
    /// one is looked at once the scene is there again.
    added: Option<(String, Vec<PathBuf>)>,
    /// Picks of a session that broke off, and the photograph that they are in.
    left: Option<(PathBuf, Vec<Pick>)>,
    /// The find that was clicked: of which face, which one.
    marked: Option<[usize; 2]>,
}

/// A photograph that is open.
struct Shot {
    opened: Opened,
    texture: TextureHandle,
    picks: Vec<Picked>,
    /// The picks before each of the last changes.
    before: Vec<Vec<Picked>>,
    /// Picks have changed since the place was last asked for.
    is_moved: bool,
    is_saved: bool,
    placing: Option<Task<Result<Placed, String>>>,
    located: Option<Result<Located, String>>,
    reading: Option<Task<Result<Vec<Face>, String>>>,
    faces: Vec<(Face, TextureHandle)>,
    /// What reading has come to, where it came to nothing.
    failure: Option<String>,
}

impl Photos {
    pub(crate) fn is_busy(&self) -> bool {
        let shot = self.shot.iter().flatten();
        self.opening.is_some()
            || shot.into_iter().any(|s| s.placing.is_some() || s.reading.is_some() || s.is_moved)
    }

    /// Looks at a photograph that somebody has brought.
    pub(crate) fn show(&mut self, path: PathBuf) {
        self.path = path.display().to_string();
        self.chosen = Some(path);
    }

    /// The photograph that is looked at and its picks, as long as they are nowhere else.
    pub(crate) fn unsaved(&self) -> Option<(PathBuf, Vec<Pick>)> {
        let shot = self.shot.as_ref()?.as_ref().ok()?;
        let picks = shot.picks.iter().map(|p| p.pick).collect();
        (!shot.is_saved && !shot.picks.is_empty()).then(|| (shot.opened.photo.file.clone(), picks))
    }

    /// Goes on with what another session has left.
    pub(crate) fn go_on(&mut self, file: PathBuf, picks: Vec<Pick>) {
        self.show(file.clone());
        self.left = Some((file, picks));
    }
}

impl Shot {
    fn located(&self) -> Option<&Located> {
        self.located.as_ref()?.as_ref().ok()
    }

    /// A corner of the member is there.
    fn pick(&mut self, corner: usize, pixel: [f64; 2]) {
        self.remember();
        let place = self.opened.outline.corners[corner];
        let picked = Picked { pick: Pick { pixel, place }, corner: Some(corner) };
        match self.picks.iter_mut().find(|p| p.corner == Some(corner)) {
            Some(known) => *known = picked,
            None => self.picks.push(picked),
        }
        self.moved();
    }

    /// What is picked now can be come back to.
    fn remember(&mut self) {
        self.before.push(self.picks.clone());
        let surplus = self.before.len().saturating_sub(MOST);
        self.before.drain(..surplus);
    }

    fn take_back(&mut self) {
        if let Some(before) = self.before.pop() {
            self.picks = before;
            self.moved();
        }
    }

    fn moved(&mut self) {
        (self.is_moved, self.is_saved) = (true, false);
        // What was read was read from another place.
        self.faces.clear();
        self.reading = None;
    }

    /// Asks for the place that the picks tell.
    fn place(&mut self, jobs: &mut Jobs) {
        if !std::mem::take(&mut self.is_moved) {
            return;
        }
        if self.picks.len() < FEWEST {
            (self.placing, self.located) = (None, None);
            return;
        }
        let Opened { photo, photograph, site, outline, .. } = &self.opened;
        let (photo, photograph, site) = (photo.clone(), Arc::clone(photograph), Arc::clone(site));
        let edges: Vec<[DVec3; 2]> = outline.edges.clone();
        let picks: Vec<Pick> = self.picks.iter().map(|p| p.pick).collect();
        self.placing = Some(Task::spawn_unlisted(jobs, tr!("placing a photograph"), move |_| {
            work::place(&photo, &photograph, &site, &edges, &picks)
        }));
    }

    fn read(&mut self, scene: &Arc<Scene>, jobs: &mut Jobs) {
        let Some(located) = self.located().cloned() else { return };
        let Opened { photo, photograph, site, .. } = &self.opened;
        let (photo, photograph, site) = (photo.clone(), Arc::clone(photograph), Arc::clone(site));
        let scene = Arc::clone(scene);
        (self.faces, self.failure) = (Vec::new(), None);
        self.reading = Some(Task::spawn(jobs, tr!("reading a photograph"), move |job| {
            work::read(&scene, &photo, &site, (&photograph, &located), job)
        }));
    }

    /// Takes what has come.
    fn collect(&mut self, ui: &Ui) {
        if let Some(done) = Task::take(&mut self.placing) {
            self.located = Some(match done {
                Ok(Ok(Placed { located, picture })) => {
                    self.texture.set(picture.clone(), TextureOptions::LINEAR);
                    self.opened.picture = picture;
                    Ok(located)
                }
                Ok(Err(why)) => Err(why),
                Err(_) => Err(tr!("placing it broke off")),
            });
        }
        match Task::take(&mut self.reading) {
            Some(Ok(Ok(faces))) => {
                let load = |face: Face| {
                    let options = TextureOptions::LINEAR;
                    let texture = ui.ctx().load_texture("face", face.picture.clone(), options);
                    (face, texture)
                };
                self.faces = faces.into_iter().map(load).collect();
            }
            Some(Ok(Err(why))) => self.failure = Some(why),
            Some(Err(_)) => self.failure = Some(tr!("reading it broke off")),
            None => {}
        }
    }
}

pub(crate) fn photos(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    mut photos: ResMut<Photos>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
    mut viewpoint: ResMut<Viewpoint>,
    desk: Res<Desk>,
) {
    let photos = photos.bypass_change_detection();
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    go_to_added(photos, scene);
    let Some(member) = selection.0.and_then(|i| scene.members.get(i)) else {
        let none = tr!("This scene has no structural members.");
        let why = tr!("Select the member that a photograph is of:");
        return members::choose(ui, scene, |_| true, &why, &none, &mut actions);
    };
    choose(ui, photos, scene, member, &mut actions);
    ask(photos, scene, member, desk.links(), &mut jobs);
    let area = ui.available_rect_before_wrap();
    collect(ui, photos);
    match &mut photos.shot {
        None if photos.opening.is_some() => {
            ui.vertical_centered(Ui::spinner);
            return;
        }
        None => {
            ui.label(tr!(
                "Photographs of this member that evidence names stand here. Open another one, or \
                 drop it on the window."
            ));
            return;
        }
        Some(Err(why)) => {
            ui.label(format!("⚠ {}", term(why)));
            return;
        }
        Some(Ok(shot)) => shot.place(&mut jobs),
    }
    let left = Rect::from_min_max(
        area.min,
        pos2((area.right() - ASIDE - 8.0).max(area.left() + 120.0), area.bottom()),
    );
    let right = Rect::from_min_max(pos2(left.right() + 8.0, area.top()), area.max);
    sheet::show(ui, photos, left);
    ui.scope_builder(egui::UiBuilder::new().max_rect(right), |ui| {
        aside(ui, photos, scene, &mut jobs, &mut actions, &mut viewpoint);
    });
    ui.advance_cursor_after_rect(area);
}

/// Which photograph.
fn choose(ui: &mut Ui, photos: &mut Photos, scene: &Scene, member: &Member, actions: &mut Actions) {
    let told: Vec<&Photographed> = of_member(scene, member).collect();
    if photos.chosen.is_none() {
        photos.chosen = told.first().map(|p| p.file.clone());
    }
    ui.horizontal_wrapped(|ui| {
        ui.strong(&member.name);
        ui.separator();
        for photo in &told {
            let is_it = photos.chosen.as_ref() == Some(&photo.file);
            let button = ui.selectable_label(is_it, &photo.name);
            if button.on_hover_text(photo.file.display().to_string()).clicked() {
                photos.chosen = Some(photo.file.clone());
            }
        }
        let field = egui::TextEdit::singleline(&mut photos.path)
            .desired_width(180.0)
            .hint_text(tr!("path of a photograph"));
        let field = ui.add(field).on_hover_text(tr!("path of a photograph"));
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let can = !photos.path.trim().is_empty();
        let go = ui.add_enabled(can, egui::Button::new(tr!("Open photograph")));
        if can && (entered || go.clicked()) {
            photos.chosen = Some(PathBuf::from(photos.path.trim()));
        }
        if ui.button(tr!("Browse…")).on_hover_text(tr!("JPEG, PNG or TIFF")).clicked() {
            actions.ask(Action::ChoosePhotograph);
        }
        faces(ui, photos);
    });
}

/// The photograph, or one of its faces.
fn faces(ui: &mut Ui, photos: &mut Photos) {
    let Photos { shot: Some(Ok(shot)), face, .. } = photos else { return };
    *face = face.filter(|k| *k < shot.faces.len());
    if shot.faces.is_empty() {
        return;
    }
    let name = |k: Option<usize>| {
        let face = k.and_then(|k| shot.faces.get(k));
        face.map_or_else(|| tr!("Photograph"), |(f, _)| term(&f.name))
    };
    ui.separator();
    let before = *face;
    let combo = ComboBox::from_id_salt("photo face").selected_text(name(*face)).width(110.0);
    let shown = combo.show_ui(ui, |ui| {
        ui.selectable_value(face, None, name(None));
        for k in 0..shot.faces.len() {
            ui.selectable_value(face, Some(k), name(Some(k)));
        }
    });
    let hint = tr!("The photograph, or one of the faces that it shows, laid flat");
    shown.response.on_hover_text(hint);
    if *face != before {
        photos.zoom = Zoom::default();
    }
}

fn of_member<'a>(scene: &'a Scene, member: &'a Member) -> impl Iterator<Item = &'a Photographed> {
    scene.structure.photographs.iter().filter(|p| p.member == member.id)
}

/// Opens what was chosen, if it is another one.
fn ask(photos: &mut Photos, scene: &Arc<Scene>, member: &Member, is_linked: bool, jobs: &mut Jobs) {
    let Some(file) = photos.chosen.clone() else {
        (photos.of, photos.shot, photos.opening) = (None, None, None);
        return;
    };
    let key = (scene.hash.clone(), member.id.clone(), file);
    if photos.of.as_ref() == Some(&key) {
        return;
    }
    let is_other = photos.of.as_ref().is_some_and(|(_, id, _)| *id != member.id);
    photos.of = Some(key.clone());
    // The next photograph of the same member is seen where the one before was, unless that was a
    // face.
    if !is_linked || is_other || photos.face.is_some() {
        photos.zoom = Zoom::default();
    }
    (photos.shot, photos.armed, photos.face, photos.marked) = (None, None, None, None);
    let told = of_member(scene, member).find(|p| p.file == key.2).cloned();
    // Of another member its own photographs are looked at first.
    if told.is_none() && is_other {
        photos.chosen = of_member(scene, member).next().map(|p| p.file.clone());
        photos.of = None;
        return;
    }
    let photo = told.unwrap_or_else(|| work::own(key.2, &member.id));
    let scene = Arc::clone(scene);
    let label = tr!("opening a photograph");
    photos.opening = Some(Task::spawn(jobs, label, move |job| work::open(&scene, photo, job)));
}

/// Takes what has come.
fn collect(ui: &Ui, photos: &mut Photos) {
    if let Some(done) = Task::take(&mut photos.opening) {
        photos.shot = Some(match done {
            Ok(Ok(mut opened)) => {
                let options = TextureOptions::LINEAR;
                let texture = ui.ctx().load_texture("photo", opened.picture.clone(), options);
                let saved = std::mem::take(&mut opened.picks);
                let file = &opened.photo.file;
                let left = photos.left.take_if(|(of, _)| of == file).map(|l| opened.picked(l.1));
                let (is_saved, picks) =
                    (left.is_none() && !saved.is_empty(), left.unwrap_or(saved));
                Ok(Shot {
                    opened,
                    texture,
                    is_moved: !picks.is_empty(),
                    is_saved,
                    picks,
                    before: Vec::new(),
                    placing: None,
                    located: None,
                    reading: None,
                    faces: Vec::new(),
                    failure: None,
                })
            }
            Ok(Err(why)) => Err(why),
            Err(_) => Err(tr!("opening it broke off")),
        });
    }
    if let Some(Ok(shot)) = &mut photos.shot {
        shot.collect(ui);
    }
}

/// Goes to what was added, after the scene was loaded anew for it.
fn go_to_added(photos: &mut Photos, scene: &Scene) {
    let Some((member, before)) = &photos.added else { return };
    let mut all = scene.structure.photographs.iter();
    if let Some(photo) = all.find(|p| p.member == *member && !before.contains(&p.file)) {
        photos.chosen = Some(photo.file.clone());
        photos.added = None;
    }
}

/// The drawing, the picks, what to do with them, and what was found.
fn aside(
    ui: &mut Ui,
    photos: &mut Photos,
    scene: &Arc<Scene>,
    jobs: &mut Jobs,
    actions: &mut Actions,
    viewpoint: &mut Viewpoint,
) {
    let height = (0.4 * ui.available_height()).clamp(90.0, 260.0);
    let Photos { shot: Some(Ok(shot)), armed, turn, marked, face, added, .. } = photos else {
        return;
    };
    let is_picked = |k: usize| shot.picks.iter().any(|p| p.corner == Some(k));
    if let Some(corner) = model::show(ui, &shot.opened.outline, turn, *armed, is_picked, height) {
        *armed = Some(corner);
        *face = None;
    }
    // Of one height whatever is told: what stands below is clicked while a place is computed, and
    // must not move away under the click.
    let told = vec2(ui.available_width(), TOLD * ui.text_style_height(&egui::TextStyle::Body));
    ui.allocate_ui(told, |ui| {
        ScrollArea::vertical().id_salt("photo stand").auto_shrink(false).show(ui, |ui| {
            stand(ui, shot, actions, viewpoint);
        });
    });
    ui.horizontal_wrapped(|ui| {
        let is_placed = shot.located().is_some();
        if let Some(task) = &shot.reading {
            if ui.small_button(tr!("⏹ Stop reading")).clicked() {
                task.job().cancel();
            }
            let bar = egui::ProgressBar::new(task.job().done()).desired_width(110.0);
            ui.add(bar).on_hover_text(term(&task.job().label()));
        } else if ui
            .add_enabled(is_placed, egui::Button::new(tr!("Read it")))
            .on_hover_text(tr!(
                "Takes the light off and looks for cracks, missing cover and stains"
            ))
            .clicked()
        {
            shot.read(scene, jobs);
        }
        keep(ui, shot, added, scene, actions);
    });
    if let Some(why) = &shot.failure {
        ui.label(tr!("⚠ Not read: {}", term(&why.to_string())));
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        finds(ui, shot, marked, actions, viewpoint);
        corners(ui, shot, armed);
    });
}

/// Where it was taken from.
fn stand(ui: &mut Ui, shot: &Shot, actions: &mut Actions, viewpoint: &mut Viewpoint) {
    for doubt in &shot.opened.photograph.doubts {
        ui.label(format!("⚠ {}", term(doubt)));
    }
    match &shot.located {
        None if shot.placing.is_some() => drop(ui.weak(tr!("placing…"))),
        None => {
            let picked = shot.picks.len();
            ui.weak(tr!("{} picked; 4 are needed where the focal length is known, else 6", picked));
        }
        Some(Err(why)) => drop(ui.label(format!("⚠ {}", term(&why.to_string())))),
        Some(Ok(located)) => {
            ui.horizontal_wrapped(|ui| {
                ui.label(tr!(
                    "Taken from {}; picks fit to {} px",
                    point(located.pose.position, 2),
                    fixed(located.rms_px, 1)
                ));
                let button = ui.small_button(tr!("Look from there"));
                if button.on_hover_text(tr!("The picture as the camera stood")).clicked() {
                    viewpoint.go(located.pose.camera(&shot.opened.photo.name));
                    actions.ask(Action::Tab("Render"));
                }
            });
            if let Some(edges) = &located.edges {
                ui.label(by_edges(edges));
            }
            if let Some(k) = located.left_out {
                ui.label(tr!("⚠ pick {} contradicts the others and is left out", k + 1));
            }
            if located.other.is_some() {
                ui.label(tr!("⚠ another place fits nearly as well: pick a point out of the plane"));
            }
        }
    }
}

/// A place, in m.
fn point(at: DVec3, decimals: usize) -> String {
    let [x, y, z] = at.to_array().map(|x| fixed(x, decimals));
    tr!("({}, {}, {}) m", x, y, z)
}

/// What the model's edges made of the place.
fn by_edges(edges: &ByEdges) -> String {
    let ByEdges { seen, answered, off_px, moved_px, kept } = *edges;
    match kept {
        None => tr!(
            "{} of {} edges of the model that are in sight place it better: it moved by {} px, and \
             they are off by {} px",
            answered,
            seen,
            fixed(moved_px, 1),
            fixed(off_px, 1)
        ),
        Some(why) => tr!(
            "placed by the picks alone, since {} ({} of {} in sight)",
            term(why),
            answered,
            seen
        ),
    }
}

/// Saves the picks; makes evidence of a photograph that is none yet.
fn keep(
    ui: &mut Ui,
    shot: &mut Shot,
    added: &mut Option<(String, Vec<PathBuf>)>,
    scene: &Scene,
    actions: &mut Actions,
) {
    let photo = &shot.opened.photo;
    let is_told = scene.structure.photographs.contains(photo);
    let can = shot.located().is_some() && !scene.path.as_os_str().is_empty();
    let save = |shot: &mut Shot| match work::save(&shot.opened.photo, &shot.picks) {
        Ok(()) => {
            shot.is_saved = true;
            true
        }
        Err(why) => {
            shot.failure = Some(why);
            false
        }
    };
    if is_told {
        let button = ui.add_enabled(can && !shot.is_saved, egui::Button::new(tr!("Save picks")));
        if button.on_hover_text(photo.picks.display().to_string()).clicked() && save(shot) {
            actions.ask(Action::Reload);
        }
    } else {
        let can = can && scene.path.exists();
        let button = ui.add_enabled(can, egui::Button::new(tr!("Add to the evidence")));
        let button = button
            .on_hover_text(tr!("Copies it and its picks beside the scene: `intrados attach`"))
            .on_disabled_hover_text(tr!(
                "Six corners first; a bundled scene has no folder to put it in: `intrados new`"
            ));
        if button.clicked() && save(shot) {
            let photo = &shot.opened.photo;
            let all = scene.structure.photographs.iter().filter(|p| p.member == photo.member);
            *added = Some((photo.member.clone(), all.map(|p| p.file.clone()).collect()));
            actions.ask(Action::Attach(Box::new(work::attachment(photo))));
        }
    }
    let button = ui.add_enabled(!shot.before.is_empty(), egui::Button::new(tr!("Undo pick")));
    if button.on_hover_text(tr!("The picks as they were before the last one")).clicked() {
        shot.take_back();
    }
}

/// What was found, face by face.
fn finds(
    ui: &mut Ui,
    shot: &Shot,
    marked: &mut Option<[usize; 2]>,
    actions: &mut Actions,
    viewpoint: &mut Viewpoint,
) {
    for (k, (face, _)) in shot.faces.iter().enumerate() {
        let known = fixed(100.0 * face.known, 0);
        ui.strong(term(&face.name)).on_hover_text(tr!("{} % of its map is known", known));
        for shape in &face.unread {
            let [low, high] = shape.patch.reach_m.map(|x| fixed(x, 2));
            let width = fixed(shape.width_mm, 1);
            ui.label(tr!(
                "⚠ not read: something dark, {} mm wide, {} to {} m along. Look whether it is a crack.",
                width,
                low,
                high
            ));
        }
        if face.finds.is_empty() && face.unread.is_empty() {
            let limit = face.narrowest_mm;
            ui.weak(match limit {
                Some(mm) => {
                    tr!("nothing; of cracks narrower than {} mm nothing is said", fixed(mm, 2))
                }
                None => tr!("too little is seen to tell"),
            });
        }
        for (i, find) in face.finds.iter().enumerate() {
            let is_marked = *marked == Some([k, i]);
            let row = ui.selectable_label(is_marked, find.what()).on_hover_text(find.course());
            if row.clicked() {
                *marked = (!is_marked).then_some([k, i]);
            }
            let Some([place, normal]) = find.at.filter(|_| is_marked) else { continue };
            ui.horizontal(|ui| {
                ui.weak(find.course());
                if ui.small_button(tr!("Look at it")).clicked()
                    && let Some(mut camera) = viewpoint.camera().cloned()
                {
                    camera.position = (place + NEAR * normal).as_vec3();
                    camera.target = place.as_vec3();
                    viewpoint.go(camera);
                    actions.ask(Action::Tab("Render"));
                }
            });
        }
    }
    if !shot.faces.is_empty() {
        ui.separator();
    }
}

/// What a corner is called: its number, the faces that meet there, and its end of the member. A
/// square column looks alike from all sides, so that numbers alone are picked a quarter turn off.
fn corner_name(outline: &Outline, corner: usize) -> String {
    let words = outline.names.get(corner).into_iter().flatten();
    let words: Vec<String> = words.map(|word| term(word)).collect();
    format!("{} · {}", corner + 1, words.join(" · "))
}

/// A row for each corner, with its pick if it has one.
fn corners(ui: &mut Ui, shot: &mut Shot, armed: &mut Option<usize>) {
    let residual = |k: usize| {
        let [x, y] = *shot.located()?.residuals.get(k)?;
        Some(x.hypot(y))
    };
    let mut gone = None;
    egui::Grid::new("photo corners").num_columns(3).striped(true).show(ui, |ui| {
        for (k, place) in shot.opened.outline.corners.iter().enumerate() {
            let is_armed = *armed == Some(k);
            let row = ui.selectable_label(is_armed, corner_name(&shot.opened.outline, k));
            if row.on_hover_text(point(*place, 3)).clicked() {
                *armed = (!is_armed).then_some(k);
            }
            let pick = shot.picks.iter().position(|p| p.corner == Some(k));
            pick_cells(ui, shot, pick, residual, &mut gone);
            ui.end_row();
        }
        for k in (0..shot.picks.len()).filter(|k| shot.picks[*k].corner.is_none()) {
            ui.label(point(shot.picks[k].pick.place, 2));
            pick_cells(ui, shot, Some(k), residual, &mut gone);
            ui.end_row();
        }
    });
    if let Some(k) = gone {
        shot.remember();
        shot.picks.remove(k);
        shot.moved();
    }
}

/// Where a pick is, by how much it misses, and a button that takes it away.
fn pick_cells(
    ui: &mut Ui,
    shot: &Shot,
    pick: Option<usize>,
    residual: impl Fn(usize) -> Option<f64>,
    gone: &mut Option<usize>,
) {
    let Some(k) = pick else {
        ui.weak("—");
        return;
    };
    let [u, v] = shot.picks[k].pick.pixel.map(|x| fixed(x, 0));
    ui.label(match residual(k) {
        Some(px) => tr!("{}, {}, {} px off", u, v, fixed(px, 1)),
        None => format!("{u}, {v}"),
    });
    if ui.small_button("✖").on_hover_text(tr!("Take this pick away")).clicked() {
        *gone = Some(k);
    }
}
