//! The members in space, coloured by what is known of their zones so far, in daylight.

use std::sync::Arc;

use egui::{Align2, Color32, Rect, Sense, TextureHandle, TextureOptions, Ui, pos2, vec2};
use glam::Vec3;
use intrados_report::surface::{Facet, facets};
use intrados_scene::{Camera, Scene};
use intrados_stage::{Jobs, Task, alone};
use rayon::prelude::*;

use super::{
    section::{self, Section},
    spot::Spot,
};
use crate::{
    Latest, Selection, colours,
    lang::{fixed, local, term},
    leaf::{Drawing, on_ground},
    legend::Legend,
    lengths,
    moment::{Seen, place as place_of},
    number::plus_minus,
    orbit,
    surface::{Drawn, Surface, bounds, draw, hand, place},
};

/// Added to values of members that are not the selected one: they are shown darker.
const ASIDE: f32 = -10.0;
/// Added to values that are only forecast: they are shown paler.
const FORECAST: f32 = 3.0;
/// Share of their brightness.
const DARKER: f32 = 0.72;
/// Faces that meet at a larger angle than this one's cosine have an edge between them.
const EDGE: f32 = 0.86;
/// Share of its brightness that a pixel on an edge keeps.
const INK: f32 = 0.62;
/// Pixels from one line of hatching to the next.
const HATCH: usize = 9;
/// Most names of members in the picture.
const MOST_NAMES: usize = 40;

/// Of the eye, and of one that is very far, degrees.
const FOV: f32 = 32.0;
const PARALLEL: f32 = 1.0;
/// Pixels that are drawn within a frame.
const COARSE: f64 = 4e5;

/// Pixels of a picture that becomes a file.
const PRINTED: u32 = 1600 * 1000;
/// Sides of a picture, pixels, least and most.
const SIDES: (usize, usize) = (8, 4096);

/// Share of the picture's height that is kept free for tools at most.
const MOST_COVERED: f32 = 0.4;

/// Width of the legend, points.
const LEGEND: f32 = 92.0;

/// What colours mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// A [`term`].
    pub(super) name: &'static str,
    /// The value of the last colour.
    pub(super) top: f64,
}

impl Scale {
    /// Of damage as it is.
    pub(super) const DAMAGE: Self = Self { name: "damage d", top: 1.0 };
    /// Of what is not shown by its damage.
    pub(super) const NONE: Self = Self { name: "", top: 1.0 };
    /// Of what years add, which is less.
    pub(super) const ADDED: Self = Self { name: "d is added", top: 0.4 };

    /// What stands beside the colour at a share of it.
    fn written(self, share: f32) -> String {
        let is_whole = self.top >= 1.0;
        match share {
            0.0 if is_whole => tr!("0 sound"),
            1.0 if is_whole => tr!("1 lost"),
            1.0 => tr!("{} or more", local(self.top.to_string())),
            _ => fixed(f64::from(share) * self.top, 2),
        }
    }

    /// The legend of a picture that becomes a file, with lines on what it shows.
    pub(super) fn printed(self, lines: Vec<String>) -> Legend {
        const STEPS: u8 = 96;
        let colour = |k: u8| colours::damage((f32::from(k) + 0.5) / f32::from(STEPS), false);
        let marks = [0.0, 1.0, 0.5, 0.25, 0.75].map(|share| (share, self.written(share)));
        let samples = vec![
            (colours::damage(f32::NAN, false), tr!("unknown")),
            (colours::damage(0.25, true), tr!("forecast|legend")),
        ];
        Legend::plain((0..STEPS).map(colour).collect(), marks.into(), samples, lines)
    }
}

/// What is shown of a structure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Of {
    /// What is known of it.
    #[default]
    Now,
    /// What was known of it at first.
    Earlier,
    /// Nothing is known of it: there is no scale of damage.
    Bare,
}

/// What is remembered between frames.
#[derive(Default)]
pub(super) struct Model {
    of_what: Of,
    /// Hash of the scene that the facets are of.
    of: String,
    facets: Arc<Vec<Facet>>,
    positions: Vec<Vec3>,
    camera: Option<Camera>,
    shown: Option<Shown>,
    /// The member along which a place is dragged: there, the camera stays.
    slides: Option<usize>,
    /// The camera flies by itself: what is drawn is gone in the next frame.
    flies: bool,
    /// Nobody wants to see the scale of colours.
    hides_legend: bool,
    /// What tools cover at the head of the picture, points: what is framed lies below.
    head: f32,
    /// The fine picture that is being drawn, and what of.
    coming: Option<(Key, Task<Painted>)>,
}

/// A picture, and the facets that are in it.
struct Painted {
    facets: Arc<Vec<Facet>>,
    drawn: Drawn,
}

struct Shown {
    key: Key,
    /// Drawn with four samples a pixel, not with one of several pixels.
    is_fine: bool,
    /// What is drawn: the structure, or what a section has left of it.
    facets: Arc<Vec<Facet>>,
    rect: Rect,
    drawn: Drawn,
    texture: TextureHandle,
}

#[derive(Clone, PartialEq)]
struct Key {
    seen: Vec<Seen>,
    scale: Scale,
    selection: Selection,
    camera: Camera,
    size: [usize; 2],
    section: Option<Section>,
}

impl Key {
    /// What the colour of a facet is by.
    fn value(&self, facet: &Facet) -> f32 {
        let seen = &self.seen[facet.member];
        let share = |d: f64| (d / self.scale.top).min(1.0) as f32;
        let damage = seen.zones[facet.zone].map_or(f32::NAN, share);
        let damage = if seen.foretold[facet.zone] { damage + FORECAST } else { damage };
        let is_aside = self.selection.0.is_some_and(|s| s != facet.member);
        if is_aside { damage + ASIDE } else { damage }
    }

    /// Whether both show the same faces at the same places, whatever their colours.
    fn is_where(&self, other: &Self) -> bool {
        (&self.camera, self.size, self.section) == (&other.camera, other.size, other.section)
    }
}

/// What the pointer does in the picture.
pub(super) struct Pointed {
    pub(super) response: egui::Response,
    /// What is under it.
    pub(super) under: Option<Spot>,
    /// Where it is looked from.
    pub(super) camera: Camera,
    /// Whether it drags a place along the member.
    pub(super) slides: bool,
}

impl Model {
    /// Of a structure of which nothing is known yet.
    pub(super) fn bare() -> Self {
        Self { of_what: Of::Bare, ..Self::default() }
    }

    /// Of what is known now, below tools of so many points.
    pub(super) fn below(head: f32) -> Self {
        Self { head, ..Self::default() }
    }

    /// Of what was known at first.
    pub(super) fn earlier() -> Self {
        Self { of_what: Of::Earlier, ..Self::default() }
    }

    /// Draws it into `rect`; none: there is nothing to be seen.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        rect: Rect,
        scene: &Arc<Scene>,
        seen: &[Seen],
        scale: Scale,
        selection: Selection,
        section: Option<Section>,
        jobs: &mut Jobs,
    ) -> Option<Pointed> {
        self.adopt(scene);
        ui.painter().rect_filled(rect, 0.0, ground(ui));
        if self.facets.is_empty() {
            let font = egui::TextStyle::Body.resolve(ui.style());
            let text = tr!("No member of this scene has a surface.");
            let ink = ui.visuals().weak_text_color();
            ui.painter().text(rect.center(), Align2::CENTER_CENTER, text, font, ink);
            return None;
        }
        let (width, height) = (rect.width().max(8.0) as u32, rect.height().max(8.0) as u32);
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| {
            let name = match self.of_what {
                Of::Now => tr!("Damage of members"),
                Of::Earlier => tr!("Damage of members in an earlier prediction"),
                Of::Bare => tr!("Preview"),
            };
            egui::WidgetInfo::labeled(egui::Role::Image, true, name)
        });
        let camera = match &self.camera {
            Some(camera) => Camera { width, height, ..camera.clone() },
            None => first(&self.positions, scene, [width, height], self.head),
        };
        let before = camera.clone();
        let begun = ui.input(|i| i.pointer.press_origin()).and_then(|at| self.spot(at));
        let slides = response.dragged() && self.slides.is_some();
        let slides = slides && begun.map(|spot| spot.member) == self.slides;
        let camera = if slides { camera } else { hand(ui, &response, rect, camera) };
        let is_moving = response.dragged() || camera != before || self.flies;
        self.camera = Some(camera.clone());
        let members = self.facets.iter().map(|f| f.member + 1).max().unwrap_or(0);
        let of = |member: usize| seen.get(member).copied().unwrap_or_default();
        let density = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()].map(|points| (points * density).round() as usize);
        let key = Key {
            seen: (0..members).map(of).collect(),
            scale,
            selection,
            camera: camera.clone(),
            size: size.map(|n| n.clamp(SIDES.0, SIDES.1)),
            section,
        };
        self.redraw(ui, rect, key, is_moving, jobs);
        let shown = self.shown.as_ref()?;
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(shown.texture.id(), rect, whole, Color32::WHITE);
        if self.of_what == Of::Now && scale != Scale::NONE && !self.hides_legend {
            legend(ui, rect, scale);
        }
        let under = response.hover_pos().and_then(|at| shown.spot(at));
        Some(Pointed { response, under, camera, slides })
    }

    pub(super) fn swap_legend(&mut self) {
        self.hides_legend = !self.hides_legend;
    }

    /// The place on a member that is at a point of the window.
    pub(super) fn spot(&self, at: egui::Pos2) -> Option<Spot> {
        self.shown.as_ref()?.spot(at)
    }

    /// Where it is looked at from, once it was shown.
    pub(super) fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// Looks from where another picture of the same structure is looked at from.
    pub(super) fn follow(&mut self, camera: &Camera) {
        self.camera = Some(camera.clone());
    }

    /// From now on a place is dragged along this member, or along none.
    pub(super) fn slide(&mut self, along: Option<usize>) {
        self.slides = along;
    }

    /// From now on tools cover so many points at the head of the picture.
    pub(super) fn cover(&mut self, head: f32) {
        self.head = head;
    }

    /// Whether the camera flies by itself.
    pub(super) fn fly(&mut self, flies: bool) {
        self.flies = flies;
    }

    /// Whether it has shown this scene.
    pub(super) fn shows(&self, scene: &Scene) -> bool {
        self.camera.is_some() && self.of == scene.hash
    }

    /// The surface of a member.
    pub(super) fn triangles(&self, member: usize) -> impl Iterator<Item = [Vec3; 3]> {
        self.facets.iter().filter(move |f| f.member == member).map(|f| f.corners)
    }

    /// Whether it is looked at from very far.
    pub(super) fn is_parallel(&self) -> bool {
        self.camera.as_ref().is_some_and(|camera| camera.fov_deg < 0.5 * FOV)
    }

    /// From very far, or not.
    pub(super) fn narrow(&mut self, is_parallel: bool) {
        let fov = if is_parallel { PARALLEL } else { FOV };
        self.camera = self.camera.as_ref().map(|camera| orbit::narrowed(camera, fov));
    }

    /// Corners of the box around the structure.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        bounds(&self.positions)
    }

    /// Takes the surfaces of another scene; the camera stays where it was in one that is like it.
    pub(super) fn adopt(&mut self, scene: &Arc<Scene>) {
        if self.of == scene.hash {
            return;
        }
        let facets = facets(scene);
        let positions: Vec<Vec3> = facets.iter().flat_map(|f| f.corners).collect();
        let is_alike = !positions.is_empty() && bounds(&positions) == bounds(&self.positions);
        let camera = self.camera.take().filter(|_| is_alike);
        let facets = Arc::new(facets);
        let (of, of_what) = (scene.hash.clone(), self.of_what);
        let (slides, head) = (self.slides, self.head);
        *self = Self { of_what, of, facets, positions, camera, slides, head, ..Self::default() };
    }

    /// Looks from another place, so that what is wanted fills the picture.
    pub(super) fn go(&mut self, view: super::View, scene: &Scene, member: Option<usize>) {
        let Some(camera) = &self.camera else { return };
        let own = self.facets.iter().filter(|f| member.is_none_or(|m| f.member == m));
        let points: Vec<Vec3> = own.flat_map(|f| f.corners).collect();
        if points.is_empty() {
            return;
        }
        let from = match view {
            super::View::Framed => camera.position - camera.target,
            super::View::Home => {
                let home = first(&self.positions, scene, [camera.width, camera.height], self.head);
                home.position - home.target
            }
            super::View::Along(axis) => axis,
        };
        let placed = Camera { position: from, target: Vec3::ZERO, ..camera.clone() };
        self.camera = Some(framed(&placed, bounds(&points), self.head));
    }

    /// Where a picture for a file looks from that shows what is looked at; none: there is nothing to
    /// be seen.
    pub(super) fn sight(&self, scene: &Scene) -> Option<Camera> {
        if self.facets.is_empty() {
            return None;
        }
        let first = || first(&self.positions, scene, [1600, 1000], 0.0);
        Some(sized(&self.camera.clone().unwrap_or_else(first)))
    }

    /// All of it from another side, in a picture of the same shape.
    pub(super) fn aside(&self, camera: &Camera, axis: Vec3) -> Camera {
        let placed = Camera { position: axis, target: Vec3::ZERO, ..camera.clone() };
        framed(&placed, bounds(&self.positions), 0.0)
    }

    /// What draws it from a camera in that one's pixels, before a ground.
    pub(super) fn print(
        &self,
        mut seen: Vec<Seen>,
        scale: Scale,
        section: Option<Section>,
        camera: Camera,
        ground: Color32,
    ) -> Drawing {
        let members = self.facets.iter().map(|f| f.member + 1).max().unwrap_or(0);
        seen.resize(members, Seen::default());
        let size = [camera.width, camera.height].map(|n| (n as usize).clamp(SIDES.0, SIDES.1));
        let key = Key { seen, scale, selection: Selection(None), camera, size, section };
        let paint = self.painter(&key);
        Box::new(move || on_ground(paint(size, 2).drawn.image, ground))
    }

    /// What members are called and how they fare, the worst first where names would overlap.
    pub(super) fn names(
        &self,
        ui: &Ui,
        rect: Rect,
        scene: &Scene,
        value: &dyn Fn(usize) -> Option<f64>,
        selection: Selection,
        camera: &Camera,
    ) {
        let font = egui::TextStyle::Small.resolve(ui.style());
        let painter = ui.painter().with_clip_rect(rect);
        let worth = |i: usize| {
            let damage = value(i).unwrap_or(-1.0);
            if selection.0 == Some(i) { 2.0 } else { damage }
        };
        let mut order: Vec<usize> = (0..scene.members.len()).collect();
        order.sort_by(|a, b| worth(*b).total_cmp(&worth(*a)));
        let mut taken: Vec<Rect> = Vec::new();
        for index in order {
            if taken.len() >= MOST_NAMES {
                break;
            }
            let Some(middle) = self.middle(index) else { continue };
            let at = place(camera, rect, middle);
            let text = match value(index) {
                Some(d) => format!("{}  {}", scene.members[index].name, fixed(d, 2)),
                None => format!("{}  ?", scene.members[index].name),
            };
            let ink = Color32::from_gray(245);
            let galley = painter.layout_no_wrap(text, font.clone(), ink);
            let area = Rect::from_center_size(at, galley.size() + vec2(8.0, 3.0));
            let is_seen = (middle - camera.position).dot(camera.target - camera.position) > 0.0;
            if !is_seen || !rect.contains_rect(area) || taken.iter().any(|t| t.intersects(area)) {
                continue;
            }
            let back = Color32::from_black_alpha(170);
            painter.rect_filled(area, 3.0, back);
            if selection.0 == Some(index) {
                let stroke = (1.5, colours::SELECTED);
                painter.rect_stroke(area, 3.0, stroke, egui::StrokeKind::Outside);
            }
            painter.galley(area.min + vec2(4.0, 1.5), galley, ink);
            taken.push(area);
        }
    }

    /// The middle of what is drawn of a member; none: a section has taken it away.
    fn middle(&self, member: usize) -> Option<Vec3> {
        let [low, high] = Self::bounds_of(member, &self.shown.as_ref()?.facets)?;
        Some(0.5 * (low + high))
    }

    fn bounds_of(member: usize, facets: &[Facet]) -> Option<[Vec3; 2]> {
        let own = facets.iter().filter(|f| f.member == member);
        let points: Vec<Vec3> = own.flat_map(|f| f.corners).collect();
        (!points.is_empty()).then(|| bounds(&points))
    }

    /// A section through the middle of a member, or of the structure.
    pub(super) fn section(&self, member: Option<usize>) -> Section {
        let whole = self.bounds();
        let own = member.and_then(|m| Self::bounds_of(m, &self.facets));
        let [low, high] = own.unwrap_or(whole);
        Section::through(0.5 * (low + high), whole)
    }

    /// Draws it anew where that is needed: at once and coarsely what moves, off the frame and finely
    /// what rests.
    fn redraw(&mut self, ui: &Ui, rect: Rect, key: Key, is_moving: bool, jobs: &mut Jobs) {
        if let Some((of, task)) = self.coming.take() {
            let mut task = Some(task);
            match (Task::take(&mut task), task) {
                (Some(Ok(painted)), _) if of == key => self.put(ui, rect, of, painted, true),
                (None, Some(task)) if of == key => self.coming = Some((of, task)),
                // What broke off once would do so again: the coarse one stays.
                (Some(Err(_)), _) => self.shown.iter_mut().for_each(|s| s.is_fine = s.key == of),
                _ => {}
            }
        }
        let before = self.shown.as_ref();
        if before.is_none_or(|shown| !shown.key.is_where(&key)) {
            let painted = self.painter(&key)(coarse(key.size), 1);
            self.put(ui, rect, key.clone(), painted, false);
        }
        let is_there = self.shown.as_ref().is_some_and(|s| s.is_fine && s.key == key);
        if !is_there && !is_moving && self.coming.is_none() {
            let (size, paint) = (key.size, self.painter(&key));
            let task = Task::spawn_unlisted(jobs, "drawing", move |_| alone(|| paint(size, 2)));
            self.coming = Some((key, task));
        }
        if self.coming.is_some() {
            ui.ctx().request_repaint();
        }
    }

    fn put(&mut self, ui: &Ui, rect: Rect, key: Key, painted: Painted, is_fine: bool) {
        let Painted { facets, drawn } = painted;
        let texture = match self.shown.take() {
            Some(mut before) => {
                before.texture.set(drawn.image.clone(), TextureOptions::LINEAR);
                before.texture
            }
            None => ui.ctx().load_texture("damage", drawn.image.clone(), TextureOptions::LINEAR),
        };
        self.shown = Some(Shown { key, is_fine, facets, rect, drawn, texture });
    }

    /// What draws it in so many pixels, with so many samples in each along both axes.
    fn painter(&self, key: &Key) -> impl FnOnce([usize; 2], usize) -> Painted + Send + 'static {
        let (whole, key) = (Arc::clone(&self.facets), key.clone());
        let bounds = bounds(&self.positions);
        move |size, over| {
            let facets = match key.section {
                Some(section) => Arc::new(section.cut(&whole, bounds)),
                None => whole,
            };
            let facets = section::before(facets, &key.camera);
            let values: Vec<f32> = facets.iter().flat_map(|f| [key.value(f); 3]).collect();
            let positions: Vec<Vec3> = facets.iter().flat_map(|f| f.corners).collect();
            let faces: Vec<[u32; 4]> = (0..facets.len() as u32)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2, 3 * i + 2])
                .collect();
            let surface = Surface {
                positions: &positions,
                values: &values,
                faces: &faces,
                mesh: false,
                sun: Some(sun(&key.camera)),
            };
            let mut drawn = draw(&key.camera, size, over, &surface, colour);
            if key.section.is_some() {
                hatch(&mut drawn, &facets, &key.camera);
            }
            ink(&mut drawn, &facets, key.selection);
            Painted { facets, drawn }
        }
    }
}

/// The same view in the pixels of a file.
pub(super) fn sized(camera: &Camera) -> Camera {
    orbit::scaled(camera, PRINTED)
}

/// A size with few enough pixels to be drawn within a frame.
fn coarse([width, height]: [usize; 2]) -> [usize; 2] {
    let times = ((width * height) as f64 / COARSE).sqrt().max(1.0);
    [width, height].map(|n| ((n as f64 / times) as usize).max(8))
}

impl Shown {
    fn spot(&self, at: egui::Pos2) -> Option<Spot> {
        let share = (at - self.rect.min) / self.rect.size();
        let facet = self.facets.get(self.drawn.face(share.x, share.y)? as usize)?;
        Spot::seen(&self.key.camera, share, facet)
    }
}

/// Hatches what a section has opened: where the nearest face turns its back, one looks into its
/// member, and the cut lies before it.
fn hatch(drawn: &mut Drawn, facets: &[Facet], camera: &Camera) {
    let turns_away = |f: &Facet| {
        let [a, b, c] = f.corners;
        (b - a).cross(c - a).dot(camera.position - a) < 0.0
    };
    let inside: Vec<bool> = facets.iter().map(turns_away).collect();
    let w = drawn.size[0];
    let open: Vec<usize> = (0..drawn.faces().len())
        .into_par_iter()
        .filter(|at| inside.get(drawn.faces()[*at] as usize) == Some(&true))
        .collect();
    for at in open {
        let is_line = (at % w + at / w) % HATCH < 2;
        drawn.image.pixels[at] = Color32::from_gray(if is_line { 70 } else { 150 });
    }
}

/// What is behind the structure: what is sound is pale, what is damaged dark, and both are to be
/// seen on it.
pub(super) fn ground(ui: &Ui) -> Color32 {
    if ui.visuals().dark_mode {
        Color32::from_rgb(34, 38, 44)
    } else {
        Color32::from_rgb(176, 184, 193)
    }
}

/// Towards the sun, which goes along with the eye: over its left shoulder.
fn sun(camera: &Camera) -> Vec3 {
    let [right, up, forward] = camera.frame();
    (0.75 * up - 0.65 * right - 0.6 * forward).normalize_or(Vec3::Y)
}

/// Edges between faces in a darker tone, and the rim of the selected member.
fn ink(drawn: &mut Drawn, facets: &[Facet], selection: Selection) {
    let [w, h] = drawn.size;
    let face = |i: u32| facets.get(i as usize);
    let normals: Vec<Vec3> = facets
        .iter()
        .map(|f| (f.corners[1] - f.corners[0]).cross(f.corners[2] - f.corners[0]))
        .map(Vec3::normalize_or_zero)
        .collect();
    let faces = drawn.faces();
    let differs = |a: u32, b: u32| match (face(a), face(b)) {
        (Some(fa), Some(fb)) => {
            fa.member != fb.member || normals[a as usize].dot(normals[b as usize]).abs() < EDGE
        }
        (None, None) => false,
        _ => true,
    };
    let is_selected = |i: u32| selection.0.is_some() && face(i).map(|f| f.member) == selection.0;
    let marks: Vec<(usize, bool)> = (0..w * h)
        .into_par_iter()
        .filter_map(|at| {
            let (x, y) = (at % w, at / w);
            let own = faces[at];
            let mut is_edge = false;
            let mut is_rim = false;
            for (there, next) in [(x + 1 < w, at + 1), (y + 1 < h, at + w)] {
                if there && faces[next] != own {
                    is_edge |= differs(own, faces[next]);
                    is_rim |= is_selected(own) != is_selected(faces[next]);
                }
            }
            is_edge.then_some((at, is_rim))
        })
        .collect();
    for (at, is_rim) in marks {
        let pixel = &mut drawn.image.pixels[at];
        if is_rim {
            // Two pixels wide, so that it is seen where pixels are small.
            *pixel = colours::SELECTED;
            for next in [at + 1, at + w] {
                if let Some(pixel) = drawn.image.pixels.get_mut(next) {
                    *pixel = colours::SELECTED;
                }
            }
        } else {
            let [r, g, b, a] = pixel.to_array();
            let dark = |c: u8| (f32::from(c) * INK) as u8;
            *pixel = Color32::from_rgba_premultiplied(dark(r), dark(g), dark(b), a);
        }
    }
}

/// Frames a box below tools that cover so many points at the head of the picture.
fn framed(camera: &Camera, low_high: [Vec3; 2], head: f32) -> Camera {
    let share = head / camera.height.max(1) as f32;
    orbit::framed(camera, low_high, share.clamp(0.0, MOST_COVERED))
}

/// From the scene's own camera's side, so that all members are seen.
fn first(positions: &[Vec3], scene: &Scene, [width, height]: [u32; 2], head: f32) -> Camera {
    let (low_high, theirs) = (bounds(positions), scene.cameras.first());
    let position = theirs.map_or(Vec3::new(0.9, 0.45, 1.1), |c| c.position - c.target);
    let camera = Camera {
        name: "structure".into(),
        position,
        target: Vec3::ZERO,
        up: Vec3::Y,
        fov_deg: FOV,
        width,
        height,
        exposure: 0.0,
        lens: None,
    };
    framed(&camera, low_high, head)
}

fn colour(value: f32) -> [u8; 3] {
    let (value, dim) = if value < 0.5 * ASIDE { (value - ASIDE, DARKER) } else { (value, 1.0) };
    let (value, is_forecast) =
        if value > 0.5 * FORECAST { (value - FORECAST, true) } else { (value, false) };
    colours::damage(value, is_forecast).map(|c| (f32::from(c) * dim) as u8)
}

pub(super) fn said(ui: &mut Ui, scene: &Scene, latest: &Latest, spot: &Spot, later: &str) {
    let Some(member) = scene.members.get(spot.member) else { return };
    ui.strong(&member.name);
    let zone = latest.member(spot.member).and_then(|p| p.zones.0[spot.zone]);
    match zone {
        Some(r) => {
            let basis = latest.member(spot.member).map_or("", |p| p.basis[spot.zone].name());
            let damage = plus_minus(r.value, r.std_error, "");
            let (zone, basis) = (place_of(spot.zone), term(basis));
            ui.label(tr!("{} of the axis: d = {}, {}", zone, damage.trim(), basis))
        }
        None => ui.weak(tr!("Nothing is known of it yet; that is not the same as sound.")),
    };
    if !later.is_empty() {
        ui.label(later);
    }
}

/// A length in the picture, at the distance of its middle: nearer things are larger.
pub(super) fn ruler(ui: &Ui, rect: Rect, camera: &Camera) {
    let distance = (camera.target - camera.position).length();
    let width = 2.0 * camera.half_extent()[0] * distance;
    let metre = rect.width() / width.max(1e-6);
    // The largest round length that takes less than a fifth of the picture.
    let Some(length) = lengths::round_within(0.2 * rect.width() / metre) else { return };
    let text = tr!("{} at the middle", lengths::rounded(length));
    let ink = ui.visuals().text_color();
    let left = rect.left_bottom() + vec2(14.0, -14.0);
    let right = left + vec2(length * metre, 0.0);
    let painter = ui.painter().with_clip_rect(rect);
    painter.line_segment([left, right], (2.0, ink));
    for end in [left, right] {
        painter.line_segment([end - vec2(0.0, 5.0), end + vec2(0.0, 5.0)], (2.0, ink));
    }
    let font = egui::TextStyle::Small.resolve(ui.style());
    painter.text(left - vec2(0.0, 8.0), Align2::LEFT_BOTTOM, text, font, ink);
}

/// Colours with their damages, and what has none.
pub(super) fn legend(ui: &Ui, rect: Rect, scale: Scale) {
    const STEPS: usize = 48;
    let height = (rect.height() * 0.28).clamp(50.0, 220.0);
    let back = Rect::from_min_size(
        pos2(rect.right() - LEGEND - 6.0, rect.bottom() - height - 84.0),
        vec2(LEGEND, height + 78.0),
    );
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(back, 4.0, ui.visuals().panel_fill.gamma_multiply(0.88));
    let bar = Rect::from_min_size(back.min + vec2(14.0, 30.0), vec2(14.0, height));
    let y = |share: f32| bar.bottom() - bar.height() * share;
    for k in 0..STEPS {
        let [from, to] = [k, k + 1].map(|k| k as f32 / STEPS as f32);
        painter.rect_filled(
            Rect::from_min_max(pos2(bar.left(), y(to)), pos2(bar.right(), y(from) + 0.5)),
            0.0,
            colours::damage_ink(0.5 * (from + to), false),
        );
    }
    let (font, ink) = (egui::TextStyle::Small.resolve(ui.style()), ui.visuals().text_color());
    let write = |at: egui::Pos2, align: Align2, text: &str| {
        painter.text(at, align, text, font.clone(), ink);
    };
    for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let at = pos2(bar.right() + 5.0, y(tick));
        write(at, Align2::LEFT_CENTER, &scale.written(tick));
    }
    write(back.min + vec2(8.0, 6.0), Align2::LEFT_TOP, &term(scale.name));
    let mut patch = Rect::from_min_size(bar.left_bottom() + vec2(0.0, 10.0), vec2(14.0, 10.0));
    for (colour, word) in [
        (colours::damage_ink(f32::NAN, false), tr!("unknown")),
        (colours::damage_ink(0.25, true), tr!("forecast|legend")),
    ] {
        painter.rect_filled(patch, 0.0, colour);
        write(patch.right_center() + vec2(5.0, 0.0), Align2::LEFT_CENTER, &word);
        patch = patch.translate(vec2(0.0, 15.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_not_selected_is_darker_and_who_is_unknown_is_grey() {
        let (bright, dim) = (colour(0.7), colour(0.7 + ASIDE));
        assert!(bright.iter().zip(dim).all(|(b, d)| d <= *b) && bright != dim);
        let greyness = |rgb: [u8; 3]| rgb.iter().max().unwrap() - rgb.iter().min().unwrap();
        for damage in [0.0, 0.5, 1.0] {
            let (measured, forecast) = (colour(damage), colour(damage + FORECAST));
            assert!(
                greyness(forecast) < greyness(measured) && greyness(forecast) > 0,
                "{measured:?} {forecast:?}"
            );
        }
        let [r, g, b] = colour(f32::NAN);
        assert!(r == g && g == b);
    }
}
