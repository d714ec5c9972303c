//! From elements to a model of members with their steel: kinds, names, hosts, frames.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap, HashSet},
    sync::Arc,
};

use glam::{DVec3, Mat4, Vec3};
use intrados_stage::{Cancelled, Job};

use super::{
    KindByName,
    ask::Idle,
    bars,
    close::{close, is_closed},
    count, course, cover, grade,
    kind::{By, Verdict, Why, kind, lies_on_ground, likely},
    model::material,
    ring::{Piece, joined},
    shape::{Tube, across, boxed, mean_depth, tube},
    source::{Course, Element, Source, Surface},
    stray::without_strays,
};
use crate::{
    Frame, Member, MemberKind, Mesh, Object, Part, SteelLine,
    gltf::Model,
    parametric,
    structure::{self, ASSUMED_CONCRETE, Grade},
};

/// A structure, built.
#[derive(Debug, Default)]
pub(super) struct Built {
    pub(super) model: Model,
    /// One for each member of the model that bears.
    pub(super) found: Vec<Found>,
    /// The surface of each of these.
    pub(super) surfaces: Vec<Surface>,
    /// What was taken off all coordinates, m.
    pub(super) offset: DVec3,
    pub(super) notes: Vec<String>,
    /// Bars and tendons by how they came to their members.
    pub(super) steel: Steel,
    /// Elements that are scenery, by class.
    pub(super) scenery: BTreeMap<String, usize>,
    /// Those of them that may bear or weigh.
    pub(super) idle: Vec<Idle>,
    /// Sentences about what was read with a doubt, with the names of what they are about.
    pub(super) doubts: BTreeMap<String, Vec<String>>,
    /// Materials by name and what was made of them: how many members or bars are of each.
    pub(super) materials: BTreeMap<(String, String), usize>,
    /// Names of the steel that lies in no member.
    pub(super) loose: Vec<String>,
}

/// How many lines of steel.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Steel {
    pub(super) laid: usize,
    pub(super) loose: usize,
    /// Of unknown grade.
    pub(super) assumed: usize,
}

/// What was found out of one member.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) id: String,
    pub(super) name: String,
    pub(super) kind: MemberKind,
    pub(super) by: By,
    pub(super) class: String,
    pub(super) concrete: Option<grade::Concrete>,
    pub(super) exposure: Option<String>,
    pub(super) cover_mm: Option<f32>,
    /// A material of it that is no concrete, or lightweight.
    pub(super) other: Option<structure::Matter>,
    /// Whether `other` is a concrete that bars reinforce.
    pub(super) is_lightweight: bool,
    /// Whether the file names a material of it that is not known.
    pub(super) is_unknown: bool,
    pub(super) frame: Frame,
    pub(super) across: [f64; 2],
    pub(super) is_round: bool,
    /// Whether its class or name says that it lies on the ground over its length.
    pub(super) lies_on_ground: bool,
    pub(super) volume: f64,
    pub(super) tube: Option<Tube>,
    /// Of a lining that closes a ring: the names of its segments.
    pub(super) segments: Vec<String>,
    /// Lines of steel in it.
    pub(super) steel: usize,
    /// Those of them that are no links.
    pub(super) bars: usize,
}

/// Coordinates beyond this are taken back to the origin, m: a georeferenced model in single
/// precision would lose its millimetres.
const FAR: f64 = 1000.0;

/// Builds a structure of what a source has.
pub(super) fn build(
    source: &Source,
    model: Model,
    kinds: &[KindByName],
    job: &Job,
) -> Result<Built, Cancelled> {
    let mut notes = Vec::new();
    let elements = without_strays(source.elements.clone(), &mut notes);
    let mut builder = Builder {
        built: Built { model, offset: offset(&elements), notes, ..Built::default() },
        ids: HashSet::new(),
        names: HashSet::new(),
        numbers: HashMap::new(),
        colours: HashMap::new(),
        surfaces: Vec::new(),
        renamed: Vec::new(),
        dropped: BTreeSet::new(),
        runs: HashSet::new(),
        again: Vec::new(),
    };
    builder.clear();
    let mut pieces = Vec::with_capacity(elements.len());
    let (mut open, count) = (0, elements.len());
    for (i, mut element) in elements.into_iter().enumerate() {
        job.step(i, count)?;
        element.surface.points.iter_mut().for_each(|p| *p -= builder.built.offset);
        let of_courses = element.courses.iter_mut().flat_map(|c| &mut c.line);
        of_courses.for_each(|p| *p -= builder.built.offset);
        let is_closed = builder.close(&mut element);
        let (solid, tube) = (boxed(&element.surface), tube(&element.surface));
        let verdict = match kinds.iter().find(|k| k.is_of(&element)).map(|k| k.kind) {
            Some(Some(kind)) => Verdict::Member(kind, By::User),
            Some(None) => Verdict::Scenery(Why::Name),
            None => kind(&element, solid.as_ref(), tube.as_ref()),
        };
        let counts = matches!(verdict, Verdict::Member(..)) || element.class.starts_with("Ifc");
        open += usize::from(!is_closed && counts && !element.surface.is_empty());
        pieces.push(Piece { element, verdict, tube, segments: Vec::new() });
    }
    let pieces = count::once(pieces, &mut builder.built.notes);
    let mut steel = Vec::new();
    for piece in joined(pieces) {
        match piece.verdict {
            Verdict::Steel(_) => steel.push(piece.element),
            Verdict::Member(kind, by) if !piece.element.surface.is_empty() => {
                builder.member(piece, kind, by, source.metres_per_unit);
            }
            Verdict::Member(..) => builder.scenery(&piece.element, Why::Class),
            Verdict::Scenery(why) => builder.scenery(&piece.element, why),
        }
    }
    for (i, element) in steel.iter().enumerate() {
        job.step(i, steel.len())?;
        builder.steel(element);
    }
    if open > 0 {
        builder.built.notes.push(format!(
            "{open} surfaces are open and could not be closed: they have no volume, and members among them are not computed"
        ));
    }
    builder.tell();
    builder.drop();
    builder.built.surfaces = builder.surfaces.into_iter().map(|(surface, _)| surface).collect();
    builder.built.offset += source.moved;
    Ok(builder.built)
}

/// Whole metres from the origin to the middle of the model, where that is far.
fn offset(elements: &[Element]) -> DVec3 {
    let of_courses = elements.iter().flat_map(|e| &e.courses).flat_map(|c| &c.line);
    let points = elements.iter().flat_map(|e| &e.surface.points).chain(of_courses);
    let [low, high] =
        points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
    let middle = 0.5 * (low + high);
    if middle.is_finite() && middle.length() > FAR { middle.round() } else { DVec3::ZERO }
}

struct Builder {
    built: Built,
    ids: HashSet<String>,
    names: HashSet<String>,
    numbers: HashMap<String, u64>,
    colours: HashMap<String, usize>,
    /// Surfaces of members with their boxes, in their order.
    surfaces: Vec<(Surface, [DVec3; 2])>,
    /// GlobalIds that another element has, too.
    renamed: Vec<String>,
    /// Objects of the model that another shows now.
    dropped: BTreeSet<usize>,
    /// Where bars run, mm, from both ends.
    runs: HashSet<Vec<[i64; 3]>>,
    /// Names of bars that run where another does.
    again: Vec<String>,
}

impl Builder {
    /// What was changed or is missing, for people.
    fn tell(&mut self) {
        if let [first, ..] = &self.renamed[..] {
            self.built.notes.push(format!(
                "{} members have a GlobalId that another has before them (such as {first}): they are called by it with a number, \"{first} #2\"; IFC wants each only once",
                self.renamed.len()
            ));
        }
        if !self.again.is_empty() {
            self.built.notes.push(format!(
                "bars run where others do, and count once: {}",
                several(&self.again)
            ));
        }
        let rings = || self.built.found.iter().filter(|f| !f.segments.is_empty());
        if let Some(first) = rings().next() {
            self.built.notes.push(format!(
                "segments close rings ({}, such as \"{}\" of {}): each is computed as one lining with monolithic joints, since pressure all around keeps joints shut; where bending opens them, it bends like (4/n)² of that section for n segments (Muir Wood 1975, n > 4)",
                rings().count(),
                first.name,
                first.segments.len()
            ));
        }
        for (doubt, names) in &self.built.doubts {
            self.built.notes.push(format!("{}: {doubt}", several(names)));
        }
        for found in self.built.found.iter().filter(|f| f.steel > 0 && f.bars == 0) {
            let links = found.steel;
            self.built.notes.push(format!(
                "no bars along \"{}\": the model has {links} links of it alone; give bars in reinforcement in details of scene.ron",
                found.name
            ));
        }
    }

    /// Members are entered anew; objects of a model that was read stay where they are.
    fn clear(&mut self) {
        let model = &mut self.built.model;
        model.members.clear();
        let back = Mat4::from_translation(-self.built.offset.as_vec3());
        for object in &mut model.objects {
            (object.member, object.part) = (None, Part::Scenery);
            object.transform = back * object.transform;
        }
    }

    /// Closes an element's surface; whether it is closed now. One that came with a model and was
    /// open is shown by its first object from now on.
    fn close(&mut self, element: &mut Element) -> bool {
        let Some((&first, others)) = element.objects.split_first() else {
            return close(&mut element.surface);
        };
        if element.surface.is_empty() || is_closed(&element.surface) {
            return true;
        }
        let mut closed = element.surface.clone();
        if !close(&mut closed) {
            return false;
        }
        self.dropped.extend(others);
        let origin = closed.bounds()[0].round();
        let positions = closed.points.iter().map(|p| (*p - origin).as_vec3()).collect();
        let mesh = Mesh { positions, triangles: closed.triangles.clone(), ..Mesh::default() };
        let model = &mut self.built.model;
        model.meshes.push(Arc::new(mesh));
        if let Some(object) = model.objects.get_mut(first) {
            object.mesh = model.meshes.len() - 1;
            object.transform = Mat4::from_translation(origin.as_vec3());
        }
        (element.surface, element.objects) = (closed, vec![first]);
        true
    }

    /// Takes out the objects that others show.
    fn drop(&mut self) {
        if self.dropped.is_empty() {
            return;
        }
        let Model { objects, steel, .. } = &mut self.built.model;
        let kept = (0..objects.len()).filter(|i| !self.dropped.contains(i));
        let places: BTreeMap<usize, usize> =
            kept.enumerate().map(|(to, from)| (from, to)).collect();
        let mut index = 0..;
        objects.retain(|_| index.next().is_some_and(|i| places.contains_key(&i)));
        steel.retain_mut(|(object, _)| match places.get(object) {
            Some(place) => {
                *object = *place;
                true
            }
            None => false,
        });
    }

    /// A text that is not taken yet: `pier`, `pier #2`.
    fn distinct(&mut self, text: &str, is_id: bool) -> String {
        let taken = if is_id { &mut self.ids } else { &mut self.names };
        if taken.insert(text.to_owned()) {
            return text.to_owned();
        }
        let number = self.numbers.entry(format!("{is_id}{text}")).or_insert(1);
        loop {
            *number += 1;
            let candidate = format!("{text} #{number}");
            if taken.insert(candidate.clone()) {
                return candidate;
            }
        }
    }

    fn member(
        &mut self,
        Piece { element, tube, segments, .. }: Piece,
        kind: MemberKind,
        by: By,
        unit: f64,
    ) {
        let element = &element;
        let Some(solid) = boxed(&element.surface) else { return };
        let stated = element
            .said
            .as_ref()
            .and_then(|s| s.frame)
            .filter(|_| self.built.offset == DVec3::ZERO);
        let is_lining = matches!(kind, MemberKind::Lining | MemberKind::Pipe);
        let frame = match (&tube, stated) {
            (_, Some(frame)) => frame,
            (Some(tube), None) if is_lining => round_frame(tube),
            _ => solid.frame(kind),
        };
        let own = if element.id.is_empty() { "member" } else { &element.id };
        let id = self.distinct(own, true);
        if id != own && element.class.starts_with("Ifc") {
            self.renamed.push(own.to_owned());
        }
        let name = self.distinct(&full_name(element), false);
        let bounds = element.surface.bounds();
        let volume = element.surface.volume();
        let mut across = across(&element.surface, frame);
        if kind == MemberKind::Slab {
            let depth = mean_depth(&element.surface, frame.zero.as_dvec3());
            across[0] = depth.map_or(across[0], |depth| depth.min(across[0]));
        }
        let axis = frame.axis.as_dvec3().normalize_or_zero();
        let start = frame.start.as_dvec3();
        let reach = element.surface.points.iter().map(|p| (*p - start).reject_from(axis).length());
        let is_round = reach.fold(0.0, f64::max) < 0.515 * across[0].min(across[1])
            && (across[0] / across[1] - 1.0).abs() < 0.03;
        let mut made = grade::composition(element);
        if let Some(class) = element.said.as_ref().and_then(|s| s.concrete.clone()) {
            made.concrete = Some(grade::Concrete::Class(class));
        }
        let (cover_mm, cover_doubt) = cover::cover_mm(element, unit);
        let (exposure, exposure_doubt) = cover::exposure(element);
        let doubts = made.doubts.drain(..).chain(cover_doubt).chain(exposure_doubt);
        for doubt in doubts {
            self.built.doubts.entry(doubt).or_default().push(name.clone());
        }
        for material in &made.unknown {
            let doubt = format!(
                "material \"{material}\" is none that is known: it may be no concrete, and no bars are assumed; give concrete and reinforcement, or matter, in details of scene.ron"
            );
            self.built.doubts.entry(doubt).or_default().push(name.clone());
        }
        self.note_materials(std::mem::take(&mut made.materials));
        let index = self.built.model.members.len();
        self.built.model.members.push(Member {
            id: id.clone(),
            name: name.clone(),
            kind,
            concrete: ASSUMED_CONCRETE.into(),
            concrete_assumed: true,
            exposure: None,
            frame,
            bounds: bounds.map(|b| b.as_vec3()),
            volume,
            slices: Vec::new(),
            truth: Vec::new(),
        });
        self.show(element, Some(index), Part::Concrete, frame);
        self.built.found.push(Found {
            id,
            name,
            kind,
            by,
            class: element.class.clone(),
            concrete: made.concrete,
            exposure,
            cover_mm,
            other: made.other,
            is_lightweight: made.is_lightweight,
            is_unknown: !made.unknown.is_empty(),
            frame,
            across,
            is_round,
            lies_on_ground: kind == MemberKind::Slab && lies_on_ground(element),
            volume,
            tube: tube.filter(|_| kind == MemberKind::Lining),
            segments,
            steel: 0,
            bars: 0,
        });
        self.surfaces.push((element.surface.clone(), bounds));
    }

    /// Counts a member or bar of these materials.
    fn note_materials(&mut self, materials: Vec<(String, String)>) {
        for material in materials {
            *self.built.materials.entry(material).or_default() += 1;
        }
    }

    /// Materials of bars are the grades that were found in them.
    fn note_steel(&mut self, element: &Element) {
        let grade = grade::steel(element);
        let taken_for = match grade {
            Some(grade) => format!("steel of bars, {} MPa", grade.yield_mpa),
            None => format!("steel of bars, {} assumed", super::assume::STEEL),
        };
        let names = element.materials.iter().map(|m| m.name.trim().to_owned());
        let named = names.filter(|n| !n.is_empty()).map(|name| (name, taken_for.clone()));
        self.note_materials(named.collect());
    }

    fn scenery(&mut self, element: &Element, why: Why) {
        if element.surface.is_empty() {
            return;
        }
        if !matches!(why, Why::Class | Why::Name) {
            self.built.idle.push(Idle {
                why,
                class: element.class.clone(),
                name: crate::file::shorten(&element.name),
                volume: element.surface.volume(),
                bounds: element.surface.bounds(),
                likely: likely(boxed(&element.surface).as_ref()),
            });
        }
        let class = if element.class.is_empty() { "nodes" } else { &element.class };
        *self.built.scenery.entry(class.to_owned()).or_default() += 1;
        let frame = Frame::default();
        self.show(element, None, Part::Scenery, frame);
    }

    /// Puts an element's surface into the model: its objects, where it came with one, else a mesh
    /// about its own frame.
    fn show(&mut self, element: &Element, member: Option<usize>, part: Part, frame: Frame) {
        let model = &mut self.built.model;
        for &object in &element.objects {
            if let Some(object) = model.objects.get_mut(object) {
                (object.member, object.part) = (member, part);
            }
        }
        if !element.objects.is_empty() {
            return;
        }
        // Near their own start, single precision is exact to micrometres.
        let origin = match member {
            Some(_) => frame.start.as_dvec3(),
            None => element.surface.bounds()[0].round(),
        };
        let positions =
            element.surface.points.iter().map(|p| (*p - origin).as_vec3()).collect::<Vec<Vec3>>();
        let mesh =
            Mesh { positions, triangles: element.surface.triangles.clone(), ..Mesh::default() };
        let material = self.material(material(element.colour));
        self.object(
            &element.name,
            mesh,
            Mat4::from_translation(origin.as_vec3()),
            material,
            member,
            part,
        );
    }

    fn material(&mut self, material: crate::Material) -> usize {
        let materials = &mut self.built.model.materials;
        *self.colours.entry(material.name.clone()).or_insert_with(|| {
            materials.push(material);
            materials.len() - 1
        })
    }

    fn object(
        &mut self,
        name: &str,
        mesh: Mesh,
        transform: Mat4,
        material: usize,
        member: Option<usize>,
        part: Part,
    ) -> usize {
        let model = &mut self.built.model;
        model.meshes.push(Arc::new(mesh));
        let name = if name.is_empty() { "element" } else { name };
        model.objects.push(Object {
            name: name.into(),
            mesh: model.meshes.len() - 1,
            transform,
            material,
            member,
            part,
        });
        model.objects.len() - 1
    }

    /// A bar or tendon goes to the member that most of it lies in.
    fn steel(&mut self, element: &Element) {
        let is_tendon = element.class == "IfcTendon"
            || element.said.as_ref().is_some_and(|s| s.kind == MemberKind::Tendon);
        self.note_steel(element);
        let own;
        let courses = if element.courses.is_empty() {
            own = course::all_of_surface(&element.surface);
            own.as_slice()
        } else {
            &element.courses
        };
        let hosts = self.hosts(element, courses);
        if courses.is_empty() {
            self.loose(element, &[], is_tendon);
            return;
        }
        let in_none: Vec<Course> = (courses.iter().zip(&hosts))
            .filter(|(_, host)| host.is_none())
            .map(|(course, _)| course.clone())
            .collect();
        if !in_none.is_empty() {
            self.loose(element, &in_none, is_tendon);
        }
        for (k, (course, host)) in courses.iter().zip(hosts).enumerate() {
            if host.is_none() || self.is_again(element, course) {
                continue;
            }
            let part = match is_tendon {
                true => Part::Tendon,
                false if bars::is_link(element, course) => Part::Stirrup,
                false => Part::Bar,
            };
            let object = self.draw(element, course, k, host, part);
            let line = self.line(element, course, part);
            self.built.model.steel.push((object, line));
            self.built.steel.laid += 1;
            if let Some(found) = host.and_then(|h| self.built.found.get_mut(h)) {
                found.steel += 1;
                found.bars += usize::from(part != Part::Stirrup);
            }
        }
    }

    /// Whether a bar runs where one does already: two never share an axis.
    fn is_again(&mut self, element: &Element, course: &Course) -> bool {
        let run = |p: &DVec3| (1e3 * *p).round().to_array().map(|x| x as i64);
        let mut there: Vec<[i64; 3]> = course.line.iter().map(run).collect();
        let back: Vec<[i64; 3]> = there.iter().rev().copied().collect();
        there = there.min(back);
        let is_new = there.len() < 2 || self.runs.insert(there);
        if !is_new {
            self.again.push(element.name.clone());
        }
        !is_new
    }

    /// For each bar of an element the member that most of it lies in, else the one that the element
    /// is said to be part of.
    fn hosts(&self, element: &Element, courses: &[Course]) -> Vec<Option<usize>> {
        let above = element.above.iter().map(|a| &a.id);
        let ids = element.said.iter().map(|s| &s.member).chain(above);
        let said = ids.filter_map(|id| self.built.found.iter().position(|f| f.id == *id)).next();
        courses.iter().map(|course| self.host(course).or(said)).collect()
    }

    fn host(&self, course: &Course) -> Option<usize> {
        let points: Vec<DVec3> = course.samples(9);
        let within = |(surface, [low, high]): &(Surface, [DVec3; 2])| {
            let near = |p: &&DVec3| p.cmpge(*low).all() && p.cmple(*high).all();
            points.iter().filter(near).filter(|p| surface.holds(**p)).count()
        };
        self.surfaces
            .iter()
            .enumerate()
            .map(|(i, s)| (within(s), i))
            .filter(|(count, _)| 2 * count > points.len())
            .max_by_key(|(count, i)| (*count, std::cmp::Reverse(*i)))
            .map(|(_, i)| i)
    }

    /// A bar in no member is a member of its own, as it was before.
    fn loose(&mut self, element: &Element, courses: &[Course], is_tendon: bool) {
        self.built.steel.loose += courses.len().max(1);
        let kind = if is_tendon { MemberKind::Tendon } else { MemberKind::Bar };
        let part = if is_tendon { Part::Tendon } else { Part::Bar };
        let id = self.distinct(&element.id, true);
        let name = self.distinct(&full_name(element), false);
        self.built.loose.push(name.clone());
        let index = self.built.model.members.len();
        self.built.model.members.push(Member {
            id,
            name,
            kind,
            concrete: ASSUMED_CONCRETE.into(),
            concrete_assumed: true,
            exposure: None,
            frame: Frame::default(),
            bounds: [Vec3::ZERO; 2],
            volume: 0.0,
            slices: Vec::new(),
            truth: Vec::new(),
        });
        if courses.is_empty() {
            self.show(element, Some(index), part, Frame::default());
        }
        for (k, course) in courses.iter().enumerate() {
            self.draw(element, course, k, Some(index), part);
        }
    }

    /// The object of a course: the one that it came with, or a tube.
    fn draw(
        &mut self,
        element: &Element,
        course: &Course,
        k: usize,
        member: Option<usize>,
        part: Part,
    ) -> usize {
        // A surface of several bars is shown as it is with the first of them.
        if let Some(&object) = element.objects.get(k) {
            self.show(element, member, part, Frame::default());
            return object;
        }
        let origin = course.line.first().copied().unwrap_or_default().round();
        let mut line: Vec<Vec3> = course.line.iter().map(|p| (*p - origin).as_vec3()).collect();
        let closed = line.len() > 3 && line.first() == line.last();
        if closed {
            line.pop();
        }
        let mesh = parametric::solid::tube(&line, course.diameter as f32, closed);
        let steel = self.material(parametric::steel());
        let transform = Mat4::from_translation(origin.as_vec3());
        self.object(&element.name, mesh, transform, steel, member, part)
    }

    fn line(&mut self, element: &Element, course: &Course, part: Part) -> SteelLine {
        let word = match part {
            Part::Tendon => "tendon",
            Part::Stirrup => "stirrup",
            _ => "bar",
        };
        let name = match element.name.trim() {
            "" => format!("{word} {}", self.built.steel.laid + 1),
            name => name.to_owned(),
        };
        let known = grade::steel(element);
        let grade = known.or_else(|| Grade::named(super::assume::STEEL));
        if part != Part::Tendon && known.is_none() {
            self.built.steel.assumed += 1;
        }
        let is_tendon = part == Part::Tendon;
        let (mut diameter, mut doubts) = (course.diameter, Vec::new());
        let prestress = is_tendon.then(|| {
            let (prestress, doubted) = bars::prestress(element, course);
            doubts = doubted;
            prestress
        });
        if !is_tendon {
            let (own, doubt) = bars::diameter(element, course);
            diameter = own;
            doubts.extend(doubt);
        }
        for doubt in doubts {
            self.built.doubts.entry(doubt).or_default().push(name.clone());
        }
        let line = course.line.iter().map(|p| p.as_vec3()).collect();
        SteelLine {
            grade: grade.filter(|_| !is_tendon),
            prestress,
            ..SteelLine::new(name, part, diameter as f32, line)
        }
    }
}

/// `"pier 1"`, `"pier 1" and 3 more`.
fn several(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => format!("\"{one}\""),
        [first, rest @ ..] => format!("\"{first}\" and {} more", rest.len()),
    }
}

/// Its own name after that of the assembly that it is part of.
fn full_name(element: &Element) -> String {
    let own = match element.name.trim() {
        "" => match element.words.iter().find(|w| !w.trim().is_empty()) {
            Some(word) => word.clone(),
            None if element.class.is_empty() => element.id.clone(),
            None => element.class.trim_start_matches("Ifc").to_lowercase(),
        },
        name => name.to_owned(),
    };
    let whole = element.above.first().filter(|above| {
        ["IfcElementAssembly", "IfcBridge", "IfcTunnel", "IfcFacility"]
            .iter()
            .any(|class| above.class.starts_with(class))
            && !above.name.trim().is_empty()
            && above.name != own
    });
    whole.map_or(own.clone(), |above| format!("{} / {own}", above.name.trim()))
}

/// A tunnel's frame: along its axis, angles from the level on its right to the crown.
fn round_frame(tube: &Tube) -> Frame {
    let back = tube.axis.dot(DVec3::new(0.999, 0.0, 1.0)) < 0.0;
    let (start, axis) =
        if back { (tube.start + tube.axis, -tube.axis) } else { (tube.start, tube.axis) };
    let along = axis.normalize_or_zero();
    // The crown is at 90 degrees: axis × zero is up.
    let zero = DVec3::Y.cross(along).try_normalize().unwrap_or(DVec3::X);
    Frame { start: start.as_vec3(), axis: axis.as_vec3(), zero: zero.as_vec3() }
}
