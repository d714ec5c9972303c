//! Everything that can be wrong with a scene that is well-formed RON.

use std::collections::{HashMap, HashSet};

use glam::Vec3;

use super::{buried::buried, *};
use crate::{Damage, Drilled, Lens, problem::Problem};

/// Lengths beyond this are refused, m: single precision has no millimetres left.
const FAR: f32 = 1e5;
/// How many problems are listed before the list is cut.
const MAX_PROBLEMS: usize = 200;
/// Share of a section that bars may fill.
const MOST_STEEL: f32 = 0.08;
/// How many bars, stirrups, tendons or segments one member may have.
const MAX_PARTS: f32 = 20_000.0;

/// How many bars, stirrups, tendons and segments a scene may have in all.
const MAX_ALL_PARTS: f32 = 500_000.0;
/// How many laps a bar may have: rods of 12 m along the longest member that a scene may have.
const MAX_LAPS: usize = 200;
/// How many shapes a scene may have.
const MAX_SHAPES: usize = 200_000;
/// How many entries a section may have: meters and gauges are looked for on their members one by
/// one.
const MAX_ENTRIES: usize = 10_000;

/// Lists all that is wrong: every number finite and in its range, names there and unique,
/// references known. Empty: the scene can be loaded, if the files that it names can.
#[must_use]
pub fn check(scene: &SceneFile) -> Vec<Problem> {
    let mut c = Checker {
        materials: scene.materials.iter().map(|m| m.name.as_str()).collect(),
        concretes: scene.concretes.iter().map(|k| k.name.as_str()).collect(),
        ..Checker::default()
    };
    c.sizes(scene);
    if !c.problems.is_empty() {
        return c.problems;
    }
    c.names(scene);
    c.each("materials", &scene.materials, Checker::material);
    c.each("shapes", &scene.shapes, Checker::shape);
    c.each("models", &scene.models, |c, model| {
        c.text("file", &model.file);
        c.at("transform", |c| c.transform(&model.transform));
    });
    c.each("concretes", &scene.concretes, Checker::concrete);
    c.each("members", &scene.members, Checker::member);
    c.each("details", &scene.details, |c, detail| {
        c.concrete_name(detail.concrete.as_deref());
        if let Some(matter) = &detail.matter {
            c.at("matter", |c| c.matter(matter));
        }
        if let Some(body) = &detail.body {
            c.at("body", |c| c.body(body));
        }
        // How large and how long it is, only its model knows.
        c.reinforcement(detail.reinforcement.as_ref(), [f32::MAX; 2], None, false);
        c.condition(detail.exposure.as_ref(), &detail.slices, &detail.truth);
    });
    c.at("project", |c| c.project(&scene.project));
    c.at("georeference", |c| c.georeference(&scene.georeference));
    c.each("lamps", &scene.lamps, Checker::lamp);
    c.each("cameras", &scene.cameras, Checker::camera);
    c.each("meters", &scene.meters, Checker::meter);
    c.each("scanners", &scene.scanners, Checker::scanner);
    c.each("supports", &scene.supports, Checker::support);
    c.joints(&scene.joints);
    c.each("loads", &scene.loads, Checker::load);
    c.each("tests", &scene.tests, Checker::test);
    c.each("gauges", &scene.gauges, Checker::gauge);
    c.each("readings", &scene.readings, Checker::reading);
    if let Some(depth) = scene.transport.max_depth {
        c.at("transport", |c| {
            c.count("max_depth", depth, 1, 1_000_000);
        });
    }
    c.at("climate", |c| {
        c.within("humidity_percent", scene.climate.humidity_percent, 0.0, 100.0);
        c.within("temperature_c", scene.climate.temperature_c, -60.0, 80.0);
    });
    if let Some(grading) = &scene.grading {
        c.at("grading", |c| c.text("profile", &grading.profile));
    }
    for (i, file) in scene.evidence.iter().enumerate() {
        c.text(&format!("evidence[{i}]"), file);
    }
    if scene.models.is_empty() {
        let ids: Vec<String> =
            scene.members.iter().flat_map(Member::ids).take(MAX_PARTS as usize * 4).collect();
        c.problems.extend(unknown_members(scene, ids.iter().map(String::as_str)));
    }
    c.problems.extend(unknown_scanners(scene));
    c.problems.extend(unlike_halves(scene));
    c.problems.truncate(MAX_PROBLEMS);
    c.problems
}

/// Slices that no scanner of the scene can make.
fn unknown_scanners(scene: &SceneFile) -> Vec<Problem> {
    let known = scene.scanners.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ");
    let list = if known.is_empty() {
        "there is none".into()
    } else {
        format!("there are {}", shorten(&known))
    };
    let mut wrong = Vec::new();
    for (i, member) in scene.members.iter().enumerate() {
        for (k, slices) in member.slices.iter().enumerate() {
            if let Slices::Scanned { scanner, .. } = slices
                && !scene.scanners.iter().any(|s| s.name == *scanner)
            {
                let message = format!("no scanner has the name \"{}\": {list}", shorten(scanner));
                wrong.push(Problem::error(
                    format!("members[{i}].slices[{k}].scanner"),
                    "UNKNOWN_SCANNER",
                    message,
                ));
            }
        }
    }
    for (i, detail) in scene.details.iter().enumerate() {
        for k in
            (0..detail.slices.len()).filter(|&k| matches!(detail.slices[k], Slices::Scanned { .. }))
        {
            let message = "members of models are not scanned, since nothing is known of their inside: name the files of real slices";
            wrong.push(Problem::error(format!("details[{i}].slices[{k}]"), "NO_SCAN", message));
        }
    }
    wrong.truncate(MAX_PROBLEMS);
    wrong
}

/// Planes of symmetry of members that cannot be halved by them.
fn unlike_halves(scene: &SceneFile) -> Vec<Problem> {
    let told = scene.details.iter().filter_map(|d| Some((&d.member, d.body.as_ref()?)));
    let bodies: HashMap<&String, &Body> =
        scene.members.iter().map(|m| (&m.id, &m.body)).chain(told).collect();
    let mirrored =
        scene.supports.iter().enumerate().filter(|(_, support)| support.hold == Hold::Symmetry);
    let wrong = mirrored.filter_map(|(i, support)| {
        let why = match bodies.get(&support.member) {
            None => {
                "only a member of which a body is told (in members, or in details) has a plane of symmetry: hold this one by Directions"
            }
            Some(Body::Tunnel { pipe: Some(_), .. }) => {
                "a steel pipe is not halved: hold the tunnel here by Directions, and its pipe by place: Pipe(0) or Pipe(1)"
            }
            Some(_) => return None,
        };
        Some(Problem::error(format!("supports[{i}].hold"), "NO_SYMMETRY", why))
    });
    wrong.take(MAX_PROBLEMS).collect()
}

/// References to members that are not among `ids`.
pub(crate) fn unknown_members<'a>(
    scene: &SceneFile,
    ids: impl Iterator<Item = &'a str>,
) -> Vec<Problem> {
    let mut known: Vec<&str> = ids.collect();
    known.sort_unstable();
    let few = known.iter().take(20).copied().collect::<Vec<_>>().join(", ");
    let list = if known.is_empty() {
        "there is none".into()
    } else {
        format!("there are {}", shorten(&few))
    };
    let ids: HashSet<&str> = known.into_iter().collect();
    let mut wrong = Vec::new();
    let refer = |place: String, id: &str, wrong: &mut Vec<Problem>| {
        if wrong.len() < MAX_PROBLEMS && !ids.contains(id) {
            wrong.push(Problem::error(
                place,
                "UNKNOWN_MEMBER",
                format!("no member has the id \"{}\": {list}", shorten(id)),
            ));
        }
    };
    for (i, d) in scene.details.iter().enumerate() {
        refer(format!("details[{i}].member"), &d.member, &mut wrong);
    }
    for (i, m) in scene.meters.iter().enumerate() {
        if let Meter::Surface { on, .. } = m {
            refer(format!("meters[{i}].on"), on, &mut wrong);
        }
    }
    for (i, s) in scene.scanners.iter().enumerate() {
        s.members
            .iter()
            .enumerate()
            .for_each(|(j, id)| refer(format!("scanners[{i}].members[{j}]"), id, &mut wrong));
    }
    for (i, j) in scene.joints.iter().enumerate() {
        refer(format!("joints[{i}].of.0"), &j.of.0, &mut wrong);
        refer(format!("joints[{i}].of.1"), &j.of.1, &mut wrong);
    }
    for (i, t) in scene.tests.iter().enumerate() {
        refer(format!("tests[{i}].member"), &t.member, &mut wrong);
    }
    // A tunnel bears as a whole, whether it has a lining of its name or segments alone.
    let tunnels = || scene.members.iter().filter(|m| matches!(m.body, Body::Tunnel { .. }));
    for (i, g) in scene.gauges.iter().enumerate() {
        if !tunnels().any(|t| t.id == g.member) {
            refer(format!("gauges[{i}].member"), &g.member, &mut wrong);
        }
    }
    let supports = scene.supports.iter().enumerate();
    let supports = supports.map(|(i, s)| (format!("supports[{i}].member"), &s.member));
    let loads = scene.loads.iter().enumerate().flat_map(|(i, l)| {
        let of = move |(j, id)| (format!("loads[{i}].members[{j}]"), id);
        l.members.iter().enumerate().map(of)
    });
    for (place, id) in supports.chain(loads) {
        if tunnels().any(|t| t.id == *id) {
            continue;
        }
        match tunnel_of(scene, id).filter(|_| ids.contains(id.as_str())) {
            Some(tunnel) if wrong.len() < MAX_PROBLEMS => wrong.push(Problem::error(
                place,
                "SEGMENT",
                format!(
                    "a tunnel is held and loaded as a whole: write \"{}\"",
                    shorten(&tunnel.id)
                ),
            )),
            Some(_) => {}
            None => refer(place, id, &mut wrong),
        }
    }
    wrong
}

/// The tunnel that a segment of this id is of, if it is one.
pub(super) fn tunnel_of<'a>(scene: &'a SceneFile, id: &str) -> Option<&'a Member> {
    let is_of = |m: &&Member| {
        matches!(m.body, Body::Tunnel { .. })
            && id.strip_prefix(&m.id).is_some_and(|rest| rest.starts_with("/R"))
    };
    scene.members.iter().find(is_of)
}

impl Member {
    /// The ids of the members that this one becomes: its own, or those of a tunnel's lining and
    /// segments.
    pub(crate) fn ids(&self) -> impl Iterator<Item = String> {
        let (own, rings, count) = match &self.body {
            Body::Tunnel { length_m, segments, inner_lining, .. } => match segments {
                Some(s) => (inner_lining.is_some(), s.rings(*length_m), s.count),
                None => (inner_lining.is_some(), 0, 0),
            },
            _ => (true, 0, 0),
        };
        let id = self.id.clone();
        own.then(|| self.id.clone()).into_iter().chain(
            (1..=rings)
                .flat_map(move |r| (1..=count).map(move |s| (r, s)))
                .map(move |(r, s)| format!("{id}/R{r}/S{s}")),
        )
    }
}

impl Body {
    /// About how many objects it becomes; infinite or not a number where its measures are no
    /// measures.
    fn parts(&self) -> f32 {
        let stirrups = |s: &Option<Stirrups>, length: f32| {
            s.as_ref().map_or(0.0, |s| 1000.0 * length / s.spacing_mm.max(10.0))
        };
        let of_bar = |r: &Option<Reinforcement>, length: f32| {
            let count = |b: &Bars| b.size().0 as f32 * (b.laps().len() + 1) as f32;
            r.as_ref().map_or(0.0, |r| {
                r.bars.iter().map(count).sum::<f32>() + stirrups(&r.stirrups, length)
            })
        };
        match self {
            Self::Column { height_m, reinforcement, .. } => of_bar(reinforcement, *height_m),
            Self::Beam { length_m, reinforcement, tendons, .. }
            | Self::BoxGirder { length_m, reinforcement, tendons, .. } => {
                of_bar(reinforcement, *length_m) + tendons.len() as f32
            }
            Self::Tunnel { length_m, segments, inner_lining, .. } => {
                let bars =
                    |b: &Option<LiningBars>| b.as_ref().map_or(0.0, |b| 2.0 * b.count as f32);
                let segments = segments.as_ref().map_or(0.0, |s| {
                    let steel = s.reinforcement.as_ref().map_or(0.0, |r| {
                        bars(&r.bars) + 2.0 * stirrups(&r.hoops, s.ring_m.min(*length_m))
                    });
                    length_m / s.ring_m.max(0.05) * s.count as f32 * (1.0 + steel)
                });
                let lining = inner_lining.as_ref().map_or(0.0, |l| {
                    let tendons =
                        l.tendons.as_ref().map_or(0.0, |t| length_m / t.spacing_m.max(0.02));
                    bars(&l.bars) + tendons + 2.0 * stirrups(&l.hoops, *length_m)
                });
                segments + lining
            }
        }
    }
}

/// Whether a text names a class of Eurocode 2, and its characteristic cylinder strength, MPa:
/// `C30/37` is 30.
#[must_use]
pub(crate) fn concrete_class(text: &str) -> Option<f32> {
    let (cylinder, cube) = text.strip_prefix('C')?.split_once('/')?;
    let (cylinder, cube) = (cylinder.parse::<u16>().ok()?, cube.parse::<u16>().ok()?);
    ((8..=120).contains(&cylinder) && (cylinder..=150).contains(&cube))
        .then_some(f32::from(cylinder))
}

/// The list so far, and where we are.
#[derive(Default)]
pub(super) struct Checker<'a> {
    pub(super) problems: Vec<Problem>,
    path: Vec<String>,
    materials: HashSet<&'a str>,
    concretes: HashSet<&'a str>,
}

impl Checker<'_> {
    pub(super) fn error(&mut self, field: &str, code: &'static str, message: impl Into<String>) {
        if self.problems.len() < MAX_PROBLEMS {
            let mut place = self.path.join(".");
            if !field.is_empty() {
                place = if place.is_empty() { field.into() } else { format!("{place}.{field}") };
            }
            self.problems.push(Problem::error(place, code, message));
        }
    }

    pub(super) fn at(&mut self, part: &str, look: impl FnOnce(&mut Self)) {
        self.path.push(part.into());
        look(self);
        self.path.pop();
    }

    pub(super) fn each<T>(&mut self, part: &str, list: &[T], mut look: impl FnMut(&mut Self, &T)) {
        for (i, item) in list.iter().enumerate() {
            self.at(&format!("{part}[{i}]"), |c| look(c, item));
            if self.problems.len() >= MAX_PROBLEMS {
                return;
            }
        }
    }

    pub(super) fn within(&mut self, field: &str, x: f32, low: f32, high: f32) -> bool {
        let ok = x >= low && x <= high;
        if !ok {
            self.error(field, "RANGE", format!("{x} is outside {low} to {high}"));
        }
        ok
    }

    pub(super) fn above(&mut self, field: &str, x: f32, low: f32, high: f32) -> bool {
        let ok = x > low && x <= high;
        if !ok {
            self.error(field, "RANGE", format!("{x} must be above {low} and at most {high}"));
        }
        ok
    }

    fn count(&mut self, field: &str, n: u32, low: u32, high: u32) -> bool {
        let ok = (low..=high).contains(&n);
        if !ok {
            self.error(field, "RANGE", format!("{n} is outside {low} to {high}"));
        }
        ok
    }

    fn vector(&mut self, field: &str, v: Vec3, limit: f32) -> bool {
        let ok = v.abs().cmple(Vec3::splat(limit)).all();
        if !ok {
            self.error(
                field,
                "RANGE",
                format!(
                    "({}, {}, {}) has a part that is not a number within ±{limit}",
                    v.x, v.y, v.z
                ),
            );
        }
        ok
    }

    fn nonzero(&mut self, field: &str, v: Vec3, limit: f32) {
        if self.vector(field, v, limit) && v.length() < 1e-9 {
            self.error(field, "DEGENERATE", "has no length: give it a direction");
        }
    }

    fn colour(&mut self, field: &str, v: Vec3, limit: f32) {
        if !(v.cmpge(Vec3::ZERO).all() && v.cmple(Vec3::splat(limit)).all()) {
            self.error(
                field,
                "RANGE",
                format!("({}, {}, {}) has a channel outside 0 to {limit}", v.x, v.y, v.z),
            );
        }
    }

    pub(super) fn text(&mut self, field: &str, text: &str) {
        if text.trim().is_empty() {
            self.error(field, "EMPTY", "is empty: give it a name");
        } else if text.len() > 1000 || text.chars().any(char::is_control) {
            self.error(
                field,
                "BAD_TEXT",
                "is longer than 1000 characters or has control characters",
            );
        }
    }

    /// A cover is a page.
    fn project(&mut self, project: &crate::structure::Project) {
        let crate::structure::Project { structure, place, owner, inspector, inspected, purpose } =
            project;
        if let Some(day) = inspected.filter(|day| day.is_to_come()) {
            self.error("inspected", "FUTURE", day.to_come());
        }
        let fields = [
            ("structure", structure),
            ("place", place),
            ("owner", owner),
            ("inspector", inspector),
            ("purpose", purpose),
        ];
        fields.iter().filter(|(_, text)| !text.is_empty()).for_each(|(f, text)| self.text(f, text));
    }

    /// Nothing is so much that it would exhaust memory or patience.
    fn sizes(&mut self, scene: &SceneFile) {
        let sections = [
            ("materials", scene.materials.len()),
            ("models", scene.models.len()),
            ("concretes", scene.concretes.len()),
            ("members", scene.members.len()),
            ("details", scene.details.len()),
            ("lamps", scene.lamps.len()),
            ("cameras", scene.cameras.len()),
            ("meters", scene.meters.len()),
            ("scanners", scene.scanners.len()),
            ("supports", scene.supports.len()),
            ("joints", scene.joints.len()),
            ("loads", scene.loads.len()),
            ("tests", scene.tests.len()),
            ("gauges", scene.gauges.len()),
            ("evidence", scene.evidence.len()),
        ];
        if scene.shapes.len() > MAX_SHAPES {
            let message = format!(
                "{} shapes are more than {MAX_SHAPES}: make a mesh of them",
                scene.shapes.len()
            );
            self.error("shapes", "TOO_MANY", message);
        }
        for (section, n) in sections {
            self.most(section, n);
        }
        let parts: f32 = scene.members.iter().map(|m| m.body.parts()).sum();
        if parts > MAX_ALL_PARTS {
            let message = format!(
                "they have {parts} bars, stirrups, tendons and segments, more than {MAX_ALL_PARTS}: split the scene"
            );
            self.error("members", "TOO_MANY", message);
        }
    }

    /// A section is no longer than is looked through.
    pub(super) fn most(&mut self, section: &str, n: usize) {
        if n > MAX_ENTRIES {
            let message = format!("{n} entries are more than {MAX_ENTRIES}: split the file");
            self.error(section, "TOO_MANY", message);
        }
    }

    /// Names are there, and unique where something refers to them.
    fn names(&mut self, scene: &SceneFile) {
        self.unique("materials", "name", scene.materials.iter().map(|m| m.name.clone()));
        self.unique("concretes", "name", scene.concretes.iter().map(|m| m.name.clone()));
        self.unique("members", "id", scene.members.iter().map(|m| m.id.clone()));
        self.unique("details", "member", scene.details.iter().map(|m| m.member.clone()));
        self.unique("cameras", "name", scene.cameras.iter().map(|m| m.name.clone()));
        self.unique("meters", "name", scene.meters.iter().map(|m| m.name().into()));
        self.unique("loads", "name", scene.loads.iter().map(|m| m.name.clone()));
        self.unique("tests", "name", scene.tests.iter().map(|m| m.name.clone()));
        self.unique("scanners", "name", scene.scanners.iter().map(|m| m.name.clone()));
        self.unique("gauges", "name", scene.gauges.iter().map(|m| m.name.clone()));
        let environments =
            scene.lamps.iter().filter(|l| matches!(l, Lamp::Environment { .. })).count();
        if environments > 1 {
            self.error("lamps", "DUPLICATE", format!("{environments} environments: keep one"));
        }
        let sensors: HashSet<&str> = scene
            .meters
            .iter()
            .map(Meter::name)
            .chain(scene.gauges.iter().map(|g| g.name.as_str()))
            .collect();
        let meters: HashSet<&str> = scene.meters.iter().map(Meter::name).collect();
        for (i, gauge) in scene.gauges.iter().enumerate() {
            if meters.contains(gauge.name.as_str()) {
                self.error(
                    &format!("gauges[{i}].name"),
                    "DUPLICATE",
                    format!("\"{}\" is a meter already: choose another", shorten(&gauge.name)),
                );
            }
        }
        for (i, reading) in scene.readings.iter().enumerate() {
            if !sensors.contains(reading.of.as_str()) {
                let message =
                    format!("no gauge or meter has the name \"{}\"", shorten(&reading.of));
                self.error(&format!("readings[{i}].of"), "UNKNOWN_GAUGE", message);
            }
            if let Some(test) =
                reading.test.as_ref().filter(|name| scene.tests.iter().all(|t| t.name != **name))
            {
                let message =
                    format!("no load test has the name \"{}\": add it to `tests`", shorten(test));
                self.error(&format!("readings[{i}].test"), "UNKNOWN_TEST", message);
            }
        }
    }

    /// Two members each, and no pair twice.
    fn joints(&mut self, joints: &[MemberJoint]) {
        let mut seen = HashSet::new();
        for (i, joint) in joints.iter().enumerate() {
            let (a, b) = (joint.of.0.as_str(), joint.of.1.as_str());
            if a == b {
                let message = "joins a member with itself: name two members";
                self.error(&format!("joints[{i}].of"), "ONE_MEMBER", message);
            } else if !seen.insert((a.min(b), a.max(b))) {
                let message = "joins a pair that another joint joins already: keep one of them";
                self.error(&format!("joints[{i}].of"), "DUPLICATE", message);
            }
        }
    }

    pub(super) fn unique(
        &mut self,
        section: &str,
        field: &str,
        names: impl Iterator<Item = String>,
    ) {
        let mut seen = HashSet::new();
        for (i, name) in names.enumerate() {
            let place = format!("{section}[{i}].{field}");
            self.text(&place, &name);
            if seen.contains(&name) {
                self.error(
                    &place,
                    "DUPLICATE",
                    format!("\"{}\" is there twice: choose another", shorten(&name)),
                );
            }
            seen.insert(name);
        }
    }

    fn material(&mut self, m: &Material) {
        self.colour("colour", m.colour, 1.0);
        self.colour("emission", m.emission, 1e9);
        if let Some(texture) = &m.texture {
            self.text("texture", texture);
        }
        if let Some(finish) = &m.finish {
            self.within("finish.worn", finish.worn, 0.0, 1.0);
            self.each("finish.stains", &finish.stains, |c, stain| {
                let Stain { kind: _, at, width_m, length_m } = stain;
                c.within("at", at.0, -1e5, 1e5);
                c.within("at", at.1, -1e5, 1e5);
                c.within("width_m", *width_m, 1e-3, 10.0);
                c.within("length_m", *length_m, 1e-3, 100.0);
            });
        }
        match m.surface {
            Surface::Lambert | Surface::Black => {}
            Surface::Metallic { metallic, roughness } => {
                self.within("surface.metallic", metallic, 0.0, 1.0);
                self.within("surface.roughness", roughness, 0.0, 1.0);
            }
            Surface::Dielectric { ior, roughness } => {
                self.within("surface.ior", ior, 1.0, 5.0);
                self.within("surface.roughness", roughness, 0.0, 1.0);
            }
        }
    }

    fn material_name(&mut self, name: Option<&str>) {
        if let Some(name) = name
            && !self.materials.contains(name)
        {
            let message =
                format!("no material has the name \"{}\": add it to materials", shorten(name));
            self.error("material", "UNKNOWN_MATERIAL", message);
        }
    }

    fn concrete_name(&mut self, name: Option<&str>) {
        if let Some(name) = name
            && concrete_class(name).is_none()
            && !self.concretes.contains(name)
        {
            let message = format!(
                "\"{}\" is no class such as C30/37 and no name from concretes",
                shorten(name)
            );
            self.error("concrete", "UNKNOWN_CONCRETE", message);
        }
    }

    fn transform(&mut self, t: &Transform) {
        self.vector("translate", t.translate, FAR);
        self.vector("rotate_deg", t.rotate_deg, 3600.0);
        if self.vector("scale", t.scale, 1e6) && t.scale.abs().min_element() < 1e-6 {
            self.error("scale", "DEGENERATE", "has a factor of 0: the shape would be flat");
        }
    }

    fn shape(&mut self, shape: &Shape) {
        let (material, emission) = match shape {
            Shape::Quad { corner, u, v, material, emission, .. } => {
                self.vector("corner", *corner, FAR);
                let edges = self.vector("u", *u, FAR) & self.vector("v", *v, FAR);
                if edges && u.as_dvec3().cross(v.as_dvec3()).length() < 1e-12 {
                    self.error(
                        "v",
                        "DEGENERATE",
                        "u and v span no area: make them differ in direction",
                    );
                }
                (material, emission)
            }
            Shape::Box { centre, size, turn_deg, material, emission, .. } => {
                self.vector("centre", *centre, FAR);
                if !(size.min_element() > 1e-6 && size.cmple(Vec3::splat(FAR)).all()) {
                    self.error(
                        "size",
                        "RANGE",
                        format!("({}, {}, {}) must be above 0", size.x, size.y, size.z),
                    );
                }
                self.within("turn_deg", *turn_deg, -3600.0, 3600.0);
                (material, emission)
            }
            Shape::Mesh { file, transform, material, emission, .. } => {
                self.text("file", file);
                self.at("transform", |c| c.transform(transform));
                (material, emission)
            }
        };
        self.material_name(material.as_deref());
        if let Some(emission) = emission {
            self.colour("emission", *emission, 1e9);
        }
    }

    fn concrete(&mut self, k: &Concrete) {
        self.within("fck_mpa", k.fck_mpa, 1.0, 250.0);
        if let Some(mean) = k.fcm_mpa {
            self.within("fcm_mpa", mean, k.fck_mpa, 250.0);
        }
        let optional = [
            ("fctm_mpa", k.fctm_mpa, 0.01, 50.0),
            ("ecm_gpa", k.ecm_gpa, 0.1, 200.0),
            ("ecm_error_gpa", k.ecm_error_gpa, 0.01, 100.0),
            ("poisson", k.poisson, 0.0, 0.49),
            ("density_kg_m3", k.density_kg_m3, 100.0, 10_000.0),
            ("fracture_n_m", k.fracture_n_m, 1.0, 1e5),
        ];
        for (field, value, low, high) in optional {
            if let Some(value) = value {
                self.within(field, value, low, high);
            }
        }
        if k.ecm_error_gpa.is_some() && k.ecm_gpa.is_none() {
            self.error(
                "ecm_error_gpa",
                "NO_VALUE",
                "is the error of a modulus that is not given: add `ecm_gpa`",
            );
        }
        if let Some(h) = k.hydration {
            self.within("hydration.cement_kg_m3", h.cement_kg_m3, 0.0, 1000.0);
            self.within("hydration.heat_kj_kg", h.heat_kj_kg, 0.0, 600.0);
            self.within("hydration.time_days", h.time_days, 0.01, 100.0);
        }
    }

    fn member(&mut self, m: &Member) {
        self.vector("at", m.at, FAR);
        self.within("turn_deg", m.turn_deg, -3600.0, 3600.0);
        self.material_name(m.material.as_deref());
        self.concrete_name(m.concrete.as_deref());
        self.each("pours", &m.pours, |c, p| {
            c.share("from", p.from, "to", p.to);
            if let Some((a, b)) = p.angles_deg {
                c.within("angles_deg.0", a, -360.0, 360.0);
                c.within("angles_deg.1", b, a, a + 360.0);
            }
            c.within("at_days", p.at_days, -1e6, 1e6);
            c.within("temperature_c", p.temperature_c, -20.0, 90.0);
        });
        self.condition(m.exposure.as_ref(), &m.slices, &m.truth);
        self.at("body", |c| c.body(&m.body));
        let unlined = matches!(m.body, Body::Tunnel { inner_lining: None, .. });
        let described = !m.slices.is_empty() || !m.truth.is_empty();
        if unlined && described {
            self.error("", "NO_LINING", "without an inner lining, slices and truth belong to a segment: move them to details");
        }
    }

    fn body(&mut self, body: &Body) {
        if let Some(share) = body.steel_share().filter(|&share| share > MOST_STEEL) {
            let message = format!(
                "bars fill {:.0} % of the section: no code allows more than {:.0} %, not even where they overlap (EN 1992-1-1, 9.5.2; ACI 318-19, 10.6.1.1)",
                100.0 * share,
                100.0 * MOST_STEEL
            );
            self.error("reinforcement.bars", "TOO_MUCH_STEEL", message);
        }
        match body {
            Body::Column { section, height_m, reinforcement } => {
                self.above("height_m", *height_m, 0.0, 1000.0);
                let measures = self.section(section);
                self.reinforcement(
                    reinforcement.as_ref(),
                    measures,
                    Some(*height_m),
                    matches!(section, Section::Round { .. }),
                );
            }
            Body::Beam { section, length_m, reinforcement, tendons } => {
                self.above("length_m", *length_m, 0.0, 2000.0);
                let measures = self.section(section);
                self.reinforcement(
                    reinforcement.as_ref(),
                    measures,
                    Some(*length_m),
                    matches!(section, Section::Round { .. }),
                );
                self.tendons(tendons, measures.map(|m| m / 2.0));
            }
            Body::BoxGirder { section: s, length_m, reinforcement, tendons } => {
                self.above("length_m", *length_m, 0.0, 2000.0);
                self.at("section", |c| c.box_section(s));
                self.reinforcement(
                    reinforcement.as_ref(),
                    [s.top_m.min(s.bottom_m).min(s.web_m); 2],
                    Some(*length_m),
                    false,
                );
                self.tendons(tendons, [s.depth_m / 2.0, s.top_width_m / 2.0]);
            }
            Body::Tunnel {
                radius_m,
                length_m,
                segments,
                cushion_mm,
                inner_lining,
                pipe,
                ground,
            } => {
                self.within("radius_m", *radius_m, 0.2, 100.0);
                self.above("length_m", *length_m, 0.0, 10_000.0);
                self.within("cushion_mm", *cushion_mm, 0.0, 1000.0);
                if segments.is_none() && inner_lining.is_none() {
                    self.error(
                        "",
                        "EMPTY",
                        "the tunnel has neither segments nor an inner lining: add one",
                    );
                }
                if let Some(s) = segments {
                    self.at("segments", |c| c.segments(s, *radius_m, *length_m));
                }
                if let Some(l) = inner_lining {
                    self.at("inner_lining", |c| c.inner_lining(l, *radius_m, *length_m));
                }
                if let Some(p) = pipe {
                    self.at("pipe", |c| c.pipe(p, *radius_m));
                }
                if let Some(g) = ground {
                    self.at("ground", |c| c.ground(g));
                }
            }
        }
    }

    fn pipe(&mut self, pipe: &Pipe, radius_m: f32) {
        self.above("thickness_mm", pipe.thickness_mm, 0.0, 200.0);
        self.within("cushion_mm", pipe.cushion_mm, 0.0, 1000.0);
        self.within("cushion_mpa", pipe.cushion_mpa, 1e-3, 1e5);
        if let Some(day) = pipe.at_days {
            self.within("at_days", day, -1e6, 1e6);
        }
        if pipe.thickness_mm + pipe.cushion_mm > 100.0 * radius_m {
            self.error(
                "",
                "RANGE",
                "wall and cushion are thicker than a tenth of the radius: they are given in mm",
            );
        }
    }

    /// Checks the section and returns its measures, from side 0 to 180 and from 90 to 270, m.
    fn section(&mut self, section: &Section) -> [f32; 2] {
        match *section {
            Section::Rectangle { width_m, depth_m } => {
                self.within("section.width_m", width_m, 0.02, 100.0);
                self.within("section.depth_m", depth_m, 0.02, 100.0);
                [depth_m, width_m]
            }
            Section::Round { diameter_m } => {
                self.within("section.diameter_m", diameter_m, 0.02, 100.0);
                [diameter_m; 2]
            }
        }
    }

    fn box_section(&mut self, s: &BoxSection) {
        self.within("top_width_m", s.top_width_m, 0.2, 100.0);
        self.within("bottom_width_m", s.bottom_width_m, 0.2, s.top_width_m.max(0.2));
        self.within("depth_m", s.depth_m, 0.2, 50.0);
        self.within("top_m", s.top_m, 0.02, 10.0);
        self.within("bottom_m", s.bottom_m, 0.02, 10.0);
        self.within("web_m", s.web_m, 0.02, 10.0);
        if s.top_m + s.bottom_m >= s.depth_m {
            self.error(
                "depth_m",
                "RANGE",
                "top and bottom slab leave no room for a cell: make it deeper",
            );
        }
        if 2.0 * s.web_m >= s.bottom_width_m {
            self.error("web_m", "RANGE", "the webs leave no room for a cell: make them thinner");
        }
    }

    /// `measures`: of its section, from side 0 to 180 and from 90 to 270, m; `length_m`: of its axis,
    /// where it is known.
    fn reinforcement(
        &mut self,
        r: Option<&Reinforcement>,
        measures: [f32; 2],
        length_m: Option<f32>,
        round: bool,
    ) {
        let Some(r) = r else { return };
        self.at("reinforcement", |c| {
            let before = c.problems.len();
            c.cover(r.cover_mm);
            c.grade(&r.steel, r.f_y_mpa);
            let mut thickest = 0.0_f32;
            c.each("bars", &r.bars, |c, bars| {
                let (diameter, [from, to]) = (bars.size().1, bars.span());
                if !(0.0 <= from && from < to && to <= 1.0) {
                    c.error("from", "RANGE", "bars run from a place to a later one, both from 0 to 1");
                }
                c.laps(bars, length_m);
                match *bars {
                    Bars::Around { count, .. } => {
                        c.count("count", count, 3, 1000);
                        if !round && count < 4 {
                            c.error("count", "RANGE", "a section with corners needs at least 4 bars around");
                        }
                    }
                    Bars::Row { side_deg, count, inset_mm, f_y_mpa, .. } => {
                        c.count("count", count, 1, 1000);
                        let deep = measures[usize::from(side_deg % 180.0 == 90.0)];
                        c.within("inset_mm", inset_mm, 0.0, 500.0 * deep);
                        c.grade(&r.steel, f_y_mpa);
                        if ![0.0, 90.0, 180.0, 270.0].contains(&side_deg) || round {
                            c.error("side_deg", "RANGE", "a row lies at side 0, 90, 180 or 270 of a section with corners");
                        }
                    }
                }
                c.within("diameter_mm", diameter, 1.0, 100.0);
                thickest = thickest.max(diameter);
            });
            if c.problems.len() == before {
                for [at, why] in length_m.map_or(Vec::new(), |length| buried(r, length)) {
                    c.error(&at, "BURIED", why);
                }
            }
            let mut stirrup = 0.0;
            if let Some(s) = &r.stirrups {
                c.at("stirrups", |c| c.stirrups(s, length_m.unwrap_or(1.0)));
                stirrup = s.diameter_mm;
            }
            if 2.0 * (r.cover_mm + stirrup + thickest) > 1000.0 * measures[0].min(measures[1]) {
                c.error("cover_mm", "RANGE", "cover, stirrups and bars do not fit into the section: make one of them smaller");
            }
        });
    }

    /// Laps in their order along the axis, each within its bars and clear of the next.
    fn laps(&mut self, bars: &Bars, length_m: Option<f32>) {
        let ([from, to], laps) = (bars.span(), bars.laps());
        if laps.len() > MAX_LAPS {
            self.error("laps", "TOO_MANY", format!("at most {MAX_LAPS}: {} are given", laps.len()));
            return;
        }
        let mut free = from;
        self.each("laps", laps, |c, lap| {
            let known = c.within("at", lap.at, 0.0, 1.0)
                & c.within("length_mm", lap.length_mm, 10.0, 10_000.0);
            // Of what came with a model, only that knows how long it is.
            let [start, end] = length_m.map_or([lap.at; 2], |length| lap.span(length));
            if known && !(start > free && end < to) {
                let message = format!(
                    "the lap reaches from {start:.3} to {end:.3} of the axis, and must begin beyond {free:.3} and end before {to:.3}: move or shorten it, laps in their order along the axis"
                );
                c.error("at", "RANGE", message);
            }
            free = end;
        });
    }

    /// A grade that is known, and a yield stress that steel can have.
    fn grade(&mut self, steel: &str, yield_mpa: Option<f32>) {
        if Grade::named(steel).is_none() {
            let message = format!(
                "\"{}\" is no grade of reinforcement known here: give {}, or leave it out and give f_y_mpa",
                shorten(steel),
                Grade::names()
            );
            self.error("steel", "UNKNOWN_GRADE", message);
        }
        if let Some(f_y) = yield_mpa {
            self.within("f_y_mpa", f_y, 150.0, 1000.0);
        }
    }

    fn stirrups(&mut self, s: &Stirrups, length_m: f32) {
        self.within("diameter_mm", s.diameter_mm, 1.0, 50.0);
        if self.within("spacing_mm", s.spacing_mm, 10.0, 1e5)
            && 1000.0 * length_m / s.spacing_mm > MAX_PARTS
        {
            self.error(
                "spacing_mm",
                "TOO_MANY",
                format!("that makes more than {MAX_PARTS} of them: space them wider"),
            );
        }
    }

    fn tendons(&mut self, tendons: &[Tendon], half: [f32; 2]) {
        self.unique("tendons", "name", tendons.iter().map(|t| t.name.clone()));
        self.each("tendons", tendons, |c, t| {
            c.within("duct_mm", t.duct_mm, 5.0, 500.0);
            if !(2..=1000).contains(&t.line.len()) {
                c.error("line", "RANGE", format!("{} points: give 2 to 1000", t.line.len()));
            }
            let radius = t.duct_mm / 2000.0;
            for (i, p) in t.line.iter().enumerate() {
                c.within(&format!("line[{i}].0"), p.x, 0.0, 1.0);
                c.within(&format!("line[{i}].1"), p.y, radius - half[0], half[0] - radius);
                c.within(&format!("line[{i}].2"), p.z, radius - half[1], half[1] - radius);
            }
            if t.line.windows(2).any(|w| w[1].x - w[0].x < 1e-4) {
                c.error(
                    "line",
                    "ORDER",
                    "its points must go along the axis: let the first numbers rise",
                );
            }
            c.at("prestress", |c| c.prestress(&t.prestress));
        });
    }

    fn prestress(&mut self, p: &Prestress) {
        match StrandGrade::named(&p.steel) {
            Some(grade) => drop(self.within("stress_mpa", p.stress_mpa, 0.0, grade.strength_mpa)),
            None => self.error(
                "steel",
                "UNKNOWN_GRADE",
                format!(
                    "\"{}\" is no prestressing steel known here: give {}",
                    shorten(&p.steel),
                    StrandGrade::names()
                ),
            ),
        }
        self.count("strands", p.strands, 1, 1000);
        self.within("strand_mm2", p.strand_mm2, 1.0, 10_000.0);
        self.within("at_days", p.at_days, 0.0, 1e6);
        self.within("friction", p.friction, 0.0, 2.0);
        self.within("wobble_per_m", p.wobble_per_m, 0.0, 1.0);
        self.within("slip_mm", p.slip_mm, 0.0, 100.0);
        self.count("relaxation_class", u32::from(p.relaxation_class), 1, 3);
        if let Some(edge) = p.plate_mm {
            self.within("plate_mm", edge, 20.0, 2000.0);
        }
    }

    fn segments(&mut self, s: &Segments, radius_m: f32, length_m: f32) {
        self.count("count", s.count, 2, 100);
        self.within("thickness_m", s.thickness_m, 0.02, 10.0);
        self.within("first_joint_deg", s.first_joint_deg, -360.0, 360.0);
        self.within("stagger_deg", s.stagger_deg, -360.0, 360.0);
        self.concrete_name(s.concrete.as_deref());
        self.within("joint.stiffness_gpa_m", s.joint.stiffness_gpa_m, 0.0, 1e6);
        self.within("joint.friction", s.joint.friction, 0.0, 10.0);
        if self.within("ring_m", s.ring_m, 0.05, 100.0)
            && length_m / s.ring_m * s.count as f32 > MAX_PARTS
        {
            self.error(
                "ring_m",
                "TOO_MANY",
                format!("that makes more than {MAX_PARTS} segments: shorten the tunnel"),
            );
        }
        let room = 250.0 * s.ring_m.min(radius_m / s.count.max(1) as f32);
        self.within("joint.gap_mm", s.joint.gap_mm, 0.0, room.clamp(0.0, 100.0));
        if let Some(r) = &s.reinforcement {
            self.at("reinforcement", |c| {
                c.cover(r.cover_mm);
                c.grade(&r.steel, r.f_y_mpa);
                c.cage(
                    r.cover_mm,
                    r.hoops.as_ref(),
                    (1, r.bars.as_ref()),
                    [s.thickness_m, s.ring_m],
                );
            });
        }
    }

    /// Hoops and bars, so many of them at least, at both faces of a shell of this thickness and
    /// length, m.
    fn cage(
        &mut self,
        cover_mm: f32,
        hoops: Option<&Stirrups>,
        (least, bars): (u32, Option<&LiningBars>),
        [thickness_m, length_m]: [f32; 2],
    ) {
        let mut steel = 0.0;
        if let Some(h) = hoops {
            self.at("hoops", |c| c.stirrups(h, length_m));
            steel += h.diameter_mm;
        }
        if let Some(b) = bars {
            self.count("bars.count", b.count, least, 5000);
            self.within("bars.diameter_mm", b.diameter_mm, 1.0, 100.0);
            steel += b.diameter_mm;
        }
        if 2.0 * (cover_mm + steel) > 1000.0 * thickness_m {
            self.error(
                "cover_mm",
                "RANGE",
                "cover, hoops and bars do not fit into the thickness: make one of them smaller",
            );
        }
    }

    fn inner_lining(&mut self, l: &InnerLining, radius_m: f32, length_m: f32) {
        self.within("thickness_m", l.thickness_m, 0.02, 10.0);
        self.cover(l.cover_mm);
        self.grade(&l.steel, l.f_y_mpa);
        self.cage(l.cover_mm, l.hoops.as_ref(), (3, l.bars.as_ref()), [l.thickness_m, length_m]);
        if let Some(t) = &l.tendons {
            self.at("tendons", |c| {
                if c.within("spacing_m", t.spacing_m, 0.02, 1000.0)
                    && length_m / t.spacing_m > MAX_PARTS
                {
                    c.error(
                        "spacing_m",
                        "TOO_MANY",
                        format!("that makes more than {MAX_PARTS} of them: space them wider"),
                    );
                }
                let radius = t.duct_mm / 2000.0;
                c.within("duct_mm", t.duct_mm, 5.0, 500.0);
                c.within("depth_m", t.depth_m, radius, l.thickness_m - radius);
                if t.anchors_deg.is_empty() || t.anchors_deg.len() > 1000 {
                    c.error(
                        "anchors_deg",
                        "EMPTY",
                        "say at which angles the tendons are anchored, 1 to 1000 of them",
                    );
                }
                for (i, a) in t.anchors_deg.iter().enumerate() {
                    c.within(&format!("anchors_deg[{i}]"), *a, -360.0, 360.0);
                }
                c.at("prestress", |c| c.prestress(&t.prestress));
            });
        }
        self.within("thickness_m", l.thickness_m, 0.02, radius_m.max(0.02) * 10.0);
    }

    fn ground(&mut self, g: &Ground) {
        self.within("cover_m", g.cover_m, 0.0, 5000.0);
        self.within("weight_kn_m3", g.weight_kn_m3, 0.0, 100.0);
        self.within("lateral_ratio", g.lateral_ratio, 0.0, 10.0);
        if let Some(water) = g.water_m {
            self.within("water_m", water, -5000.0, 5000.0);
        }
        match g.model {
            GroundModel::Springs { radial_mpa_m, tangential_mpa_m } => {
                self.within("model.radial_mpa_m", radial_mpa_m, 0.0, 1e7);
                self.within("model.tangential_mpa_m", tangential_mpa_m, 0.0, 1e7);
            }
            GroundModel::Solid { youngs_mpa, poisson, thickness_m } => {
                self.above("model.youngs_mpa", youngs_mpa, 0.0, 1e7);
                self.within("model.poisson", poisson, 0.0, 0.49);
                self.above("model.thickness_m", thickness_m, 0.0, 1000.0);
            }
        }
    }

    /// Concrete over stirrups or hoops.
    fn cover(&mut self, mm: f32) {
        self.within("cover_mm", mm, 0.0, 500.0);
        if 0.0 < mm && mm < 1.0 {
            self.error(
                "cover_mm",
                "RANGE",
                format!("{mm} mm of cover is none: it is in millimetres, 35 for .035 m"),
            );
        }
    }

    /// What members and details have in common.
    fn condition(&mut self, exposure: Option<&Exposure>, slices: &[Slices], truth: &[Damage]) {
        if let Some(e) = exposure {
            self.at("exposure", |c| {
                c.text("class", &e.class);
                if let Some(foreign) = e.classes().find(|class| !Exposure::CLASSES.contains(class)) {
                    c.error("class", "EXPOSURE", format!("{foreign:?} is none of EN 206's classes: write X0, XC1 to XC4, XD1 to XD3, XS1 to XS3, XF1 to XF4 or XA1 to XA3"));
                }
                c.within("years", e.years, 0.0, 1000.0);
                if let Some(k) = &e.chloride {
                    c.within("chloride.surface_percent", k.surface_percent, 0.0, 100.0);
                    c.within("chloride.initial_percent", k.initial_percent, 0.0, 100.0);
                    c.within("chloride.diffusion_1e12_m2_s", k.diffusion_1e12_m2_s, 0.0, 1e6);
                    c.within("chloride.ageing", k.ageing, 0.0, 1.0);
                    c.within("chloride.critical_percent", k.critical_percent, 0.0, 100.0);
                    c.within("chloride.current_ua_cm2", k.current_ua_cm2, 0.0, 1000.0);
                }
            });
        }
        self.each("slices", slices, Self::slices);
        self.each("truth", truth, Self::damage);
    }

    pub(super) fn slices(&mut self, slices: &Slices) {
        match slices {
            Slices::Files { name, images, pixel_mm, .. } => {
                pixel_mm.iter().for_each(|mm| _ = self.within("pixel_mm", *mm, 1e-4, 100.0));
                self.of_files(name, images, slices.drilled());
            }
            Slices::Stack { name, images, voxel_mm, .. } => {
                for (i, mm) in voxel_mm.iter().flatten().enumerate() {
                    self.within(&format!("voxel_mm[{i}]"), *mm, 1e-4, 100.0);
                }
                self.of_files(name, images, slices.drilled());
            }
            Slices::Drawn { name, count, size, pixel_mm, .. } => {
                self.text("name", name);
                self.count("count", *count, 1, 10_000);
                self.count("size", *size, 16, 16_384);
                self.within("pixel_mm", *pixel_mm, 1e-4, 100.0);
            }
            Slices::Scanned { name, scanner, along, .. } => {
                self.text("name", name);
                self.text("scanner", scanner);
                if along.is_empty() {
                    self.error("along", "EMPTY", "names no place: give some between 0 and 1");
                }
                for (i, at) in along.iter().enumerate() {
                    self.within(&format!("along[{i}]"), *at, 0.0, 1.0);
                }
            }
        }
    }

    /// What is no concrete must be something that bears.
    pub(super) fn matter(&mut self, matter: &Matter) {
        self.text("name", &matter.name);
        self.within("modulus_gpa", matter.modulus_gpa, 1e-3, 1000.0);
        self.within("poisson", matter.poisson, 0.0, 0.49);
        self.within("density_kg_m3", matter.density_kg_m3, 1.0, 25_000.0);
        self.within("expansion_1e6_k", matter.expansion_1e6_k, 0.0, 200.0);
        if let Some(strength) = matter.strength_mpa {
            self.within("strength_mpa", strength, 0.1, 5000.0);
        }
    }

    fn georeference(&mut self, place: &Georeference) {
        let map = place.map.iter().flat_map(|m| [m.eastings, m.northings, m.height]);
        if !place.offset_m.into_iter().chain(map).all(|m| m.abs() < 1e8) {
            self.error("", "RANGE", "a coordinate is not on earth: give metres below 1e8");
        }
        if place.map.as_ref().is_some_and(|m| {
            let length = m.x_axis[0].hypot(m.x_axis[1]);
            !(length.is_finite() && length > 0.0)
        }) {
            self.error("map.x_axis", "RANGE", "must be a direction: east and north, not both 0");
        }
        if let Some(map) = &place.map {
            self.within("map.scale", map.scale as f32, 0.5, 2.0);
        }
        let degrees = [
            ("latitude_deg", place.latitude_deg, 90.0),
            ("longitude_deg", place.longitude_deg, 180.0),
            ("elevation_m", place.elevation_m, 1e4),
        ];
        for (field, value, most) in degrees {
            value.iter().for_each(|v| _ = self.within(field, *v as f32, -most, most));
        }
    }

    /// What slices of files have in common.
    fn of_files(&mut self, name: &str, images: &[String], drilled: Drilled) {
        self.text("name", name);
        let place = [
            ("along", drilled.along, 0.0, 1.0),
            ("angle_deg", drilled.angle_deg, -360.0, 360.0),
            ("depth_m", drilled.depth_m, 0.0, 100.0),
            ("diameter_mm", drilled.diameter_mm, 10.0, 2000.0),
        ];
        for (field, value, low, high) in place {
            value.iter().for_each(|v| _ = self.within(field, *v, low, high));
        }
        if images.is_empty() {
            self.error("images", "EMPTY", "names no image");
        }
        for (i, file) in images.iter().enumerate() {
            self.text(&format!("images[{i}]"), file);
        }
    }

    fn damage(&mut self, damage: &Damage) {
        match *damage {
            Damage::Crack { along, width_mm, depth, angle_deg } => {
                self.within("along", along, 0.0, 1.0);
                self.within("width_mm", width_mm, 0.0, 1000.0);
                self.within("depth", depth, 0.0, 1.0);
                self.within("angle_deg", angle_deg, -360.0, 360.0);
            }
            Damage::Voids { from, to, porosity, median_mm } => {
                self.share("from", from, "to", to);
                self.within("porosity", porosity, 0.0, 0.5);
                self.above("median_mm", median_mm, 0.0, 1000.0);
            }
            Damage::Honeycomb { along, length_m, porosity } => {
                self.within("along", along, 0.0, 1.0);
                self.above("length_m", length_m, 0.0, 1000.0);
                self.within("porosity", porosity, 0.0, 0.5);
            }
            Damage::Spall { along, angle_deg, diameter_m, depth_m } => {
                self.within("along", along, 0.0, 1.0);
                self.within("angle_deg", angle_deg, -360.0, 360.0);
                self.above("diameter_m", diameter_m, 0.0, 100.0);
                self.above("depth_m", depth_m, 0.0, 10.0);
            }
            Damage::Corrosion { from, to, section_loss } => {
                self.share("from", from, "to", to);
                self.within("section_loss", section_loss, 0.0, 1.0);
            }
            Damage::Softened { from, to, damage, side_deg } => {
                self.share("from", from, "to", to);
                self.within("damage", damage, 0.0, 1.0);
                if let Some(side) = side_deg {
                    self.within("side_deg", side, -360.0, 360.0);
                }
            }
        }
    }

    /// A stretch of an axis.
    fn share(&mut self, from_field: &str, from: f32, to_field: &str, to: f32) {
        let ok = self.within(from_field, from, 0.0, 1.0) & self.within(to_field, to, 0.0, 1.0);
        if ok && from >= to {
            self.error(to_field, "ORDER", format!("{to} is not beyond {from_field}, {from}"));
        }
    }

    fn lamp(&mut self, lamp: &Lamp) {
        let point = |s: &Strength| !matches!(s, Strength::WattPerSquareMetre(_) | Strength::Lux(_));
        match lamp {
            Lamp::Point { position, strength, colour, .. } => {
                self.vector("position", *position, FAR);
                self.strength(
                    *strength,
                    *colour,
                    point(strength),
                    "Watt, WattPerSteradian, Lumen or Candela",
                );
            }
            Lamp::Spot { position, target, strength, colour, inner_deg, outer_deg, .. } => {
                self.vector("position", *position, FAR);
                self.vector("target", *target, FAR);
                if position.distance(*target) < 1e-6 {
                    self.error(
                        "target",
                        "DEGENERATE",
                        "is where the lamp is: choose a point on its axis",
                    );
                }
                self.within("outer_deg", *outer_deg, 0.1, 90.0);
                if !(*inner_deg >= 0.0 && inner_deg < outer_deg) {
                    self.error(
                        "inner_deg",
                        "RANGE",
                        format!("{inner_deg} must be at least 0 and below outer_deg"),
                    );
                }
                self.strength(
                    *strength,
                    *colour,
                    point(strength),
                    "Watt, WattPerSteradian, Lumen or Candela",
                );
            }
            Lamp::Directional { direction, strength, colour, .. } => {
                self.nonzero("direction", *direction, 1e6);
                self.strength(*strength, *colour, !point(strength), "WattPerSquareMetre or Lux");
            }
            Lamp::Environment { radiance, image, .. } => {
                self.colour("radiance", *radiance, 1e9);
                if let Some(image) = image {
                    self.text("image", image);
                }
            }
        }
        if !matches!(lamp, Lamp::Environment { .. }) {
            self.text("name", lamp.name());
        }
    }

    fn strength(&mut self, strength: Strength, colour: Vec3, fits: bool, units: &str) {
        self.within("strength", strength.value(), 0.0, 1e12);
        if !fits {
            self.error("strength", "UNIT", format!("does not fit this lamp: give it in {units}"));
        }
        self.colour("colour", colour, 1e6);
        if colour.max_element() <= 0.0 {
            self.error(
                "colour",
                "RANGE",
                "is black: to switch the lamp off, set its strength to 0",
            );
        }
    }

    fn camera(&mut self, k: &Camera) {
        self.vector("position", k.position, FAR);
        self.vector("target", k.target, FAR);
        if k.position.distance(k.target) < 1e-6 {
            self.error(
                "target",
                "DEGENERATE",
                "is where the camera is: choose a point that it looks at",
            );
        }
        self.nonzero("up", k.up, 1e6);
        if !(k.fov_deg > 0.0 && k.fov_deg < 180.0) {
            self.error("fov_deg", "RANGE", format!("{} must be above 0 and below 180", k.fov_deg));
        }
        self.count("width", k.width, 1, 16_384);
        self.count("height", k.height, 1, 16_384);
        self.within("exposure", k.exposure, -30.0, 30.0);
        if let Some(lens) = &k.lens {
            self.at("lens", |c| c.lens(lens, k));
        }
    }

    fn lens(&mut self, lens: &Lens, k: &Camera) {
        let Lens { k1, k2, p1, p2, centre: [right, down] } = *lens;
        let mut is_sane = true;
        for (name, value) in [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)] {
            is_sane &= self.within(name, value, -10.0, 10.0);
        }
        for shift in [right, down] {
            is_sane &= self.within("centre", shift, -0.5, 0.5);
        }
        if is_sane && k.width > 0 && k.height > 0 && !super::resolve::camera(k).is_covered() {
            self.error(
                "",
                "RANGE",
                "folds the picture's edges back over it: check the numbers, or their order k1, k2, p1, p2",
            );
        }
    }

    fn meter(&mut self, meter: &Meter) {
        match meter {
            Meter::Patch { corner, u, v, .. } => {
                self.vector("corner", *corner, FAR);
                let edges = self.vector("u", *u, FAR) & self.vector("v", *v, FAR);
                if edges && u.as_dvec3().cross(v.as_dvec3()).length() < 1e-12 {
                    self.error(
                        "v",
                        "DEGENERATE",
                        "u and v span no area: make them differ in direction",
                    );
                }
            }
            Meter::Surface { along, angle_deg, size_m, .. } => {
                self.within("along", *along, 0.0, 1.0);
                self.within("angle_deg", *angle_deg, -360.0, 360.0);
                self.within("size_m", *size_m, 1e-4, 10.0);
            }
        }
    }

    fn place(&mut self, field: &str, place: &Place) {
        self.at(field, |c| match *place {
            Place::Start | Place::End | Place::Top | Place::Bottom | Place::Whole => {}
            Place::Section(along) | Place::Pipe(along) => {
                c.within("", along, 0.0, 1.0);
            }
            Place::Surface { from, to, side_deg } => {
                // Equal bounds are a line across.
                if from.to_bits() == to.to_bits() {
                    c.within("from", from, 0.0, 1.0);
                } else {
                    c.share("from", from, "to", to);
                }
                if let Some(side) = side_deg {
                    c.within("side_deg", side, -360.0, 360.0);
                }
            }
        });
    }

    fn support(&mut self, s: &Support) {
        self.place("place", &s.place);
        match s.hold {
            Hold::Fixed => {}
            Hold::Directions { x, y, z } => {
                if !(x || y || z) {
                    self.error("hold", "EMPTY", "holds no direction: set x, y or z");
                }
            }
            Hold::Symmetry => self.symmetry(s),
            Hold::Springs { stiffness_mpa_m, .. } => {
                self.colour("hold.stiffness_mpa_m", stiffness_mpa_m, 1e9);
                if stiffness_mpa_m == Vec3::ZERO {
                    self.error(
                        "hold.stiffness_mpa_m",
                        "EMPTY",
                        "holds no direction: give x, y or z a stiffness",
                    );
                }
            }
        }
    }

    fn symmetry(&mut self, s: &Support) {
        if !matches!(s.place, Place::Start | Place::End) {
            let message = "a plane of symmetry is where a member starts or ends: write Start or End, or hold this place by Directions";
            self.error("place", "NO_SYMMETRY", message);
        }
        if s.alone {
            let message = "a plane of symmetry stands for the member's own other half, not for other members: leave it out";
            self.error("alone", "NO_SYMMETRY", message);
        }
    }

    fn load(&mut self, l: &Load) {
        for (i, (day, factor)) in l.history.iter().enumerate() {
            self.within(&format!("history[{i}].0"), *day, -1e6, 1e6);
            self.within(&format!("history[{i}].1"), *factor, -1e6, 1e6);
        }
        if l.loading.is_some() && !l.action.can_be_raised() {
            self.error("loading", "LOADING", "weight and heat are not raised until members fail");
        }
        if let Some(crate::structure::Loading::Displacement { to_mm: Some(to) }) = l.loading {
            self.within("loading.to_mm", to, 0.01, 1e4);
        }
        if l.history.windows(2).any(|w| w[1].0 < w[0].0) {
            self.error("history", "ORDER", "its days must rise");
        }
        self.at("action", |c| c.action(&l.action));
    }

    fn action(&mut self, action: &Action) {
        let c = self;
        match action {
            Action::SelfWeight => {}
            Action::Force { place, force_kn } => {
                c.place("place", place);
                c.vector("force_kn", *force_kn, 1e9);
            }
            Action::Line { from, to, force_kn_m } => {
                c.share("from", *from, "to", *to);
                c.vector("force_kn_m", *force_kn_m, 1e9);
            }
            Action::Pressure { place, pressure_kpa } => {
                c.place("place", place);
                c.within("pressure_kpa", *pressure_kpa, -1e7, 1e7);
            }
            Action::InnerPressure { pressure_kpa } => {
                c.within("pressure_kpa", *pressure_kpa, -1e7, 1e7);
            }
            Action::Displacement { place, displacement_mm } => {
                c.place("place", place);
                c.vector("displacement_mm", *displacement_mm, 1e5);
            }
            Action::Air { inside_k, outside_k } => {
                c.within("inside_k", *inside_k, -100.0, 1500.0);
                c.within("outside_k", *outside_k, -100.0, 1500.0);
            }
            Action::PipeTemperature { warmer_k } => {
                c.within("warmer_k", *warmer_k, -200.0, 1500.0);
            }
            Action::Temperature { uniform_k, difference_k } => {
                c.within("uniform_k", *uniform_k, -200.0, 1500.0);
                c.within("difference_k", *difference_k, -1500.0, 1500.0);
            }
        }
    }

    pub(super) fn test(&mut self, test: &Test) {
        if test.actions.is_empty() {
            self.error(
                "actions",
                "EMPTY",
                "nothing acts: give a Force, a Line, a Pressure or a Displacement",
            );
        }
        self.each("actions", &test.actions, Self::action);
    }

    pub(super) fn reading(&mut self, r: &Reading) {
        if !r.value.is_finite() {
            let message = "is not a finite number: give the reading in SI units";
            self.error("value", "NOT_FINITE", message);
        }
        if !(r.std_error.is_finite() && r.std_error > 0.0) {
            let message =
                format!("{} is not above 0: say how uncertain the reading is", r.std_error);
            self.error("std_error", "RANGE", message);
        }
        self.within("at_days", r.at_days, 0.0, 1e6);
    }

    pub(super) fn gauge(&mut self, g: &Gauge) {
        self.within("along", g.along, 0.0, 1.0);
        self.within("angle_deg", g.angle_deg, -360.0, 360.0);
        self.within("depth_mm", g.depth_mm, 0.0, 10_000.0);
        if let Measures::Displacement(direction) = g.measures {
            self.nonzero("measures", direction, 1e6);
        }
    }

    fn scanner(&mut self, s: &Scanner) {
        if s.members.is_empty() {
            self.error("members", "EMPTY", "scans no member: name one");
        }
        self.at("tube", |c| {
            c.within("voltage_kv", s.tube.voltage_kv, 10.0, 20_000.0);
            c.above("charge_mas", s.tube.charge_mas, 0.0, 1e6);
            c.within("focus_mm", s.tube.focus_mm, 0.0, 50.0);
            for (i, (metal, thickness)) in s.tube.filters.iter().enumerate() {
                c.text(&format!("filters[{i}].0"), metal);
                c.within(&format!("filters[{i}].1"), *thickness, 0.0, 1000.0);
            }
        });
        self.at("detector", |c| {
            c.count("width", s.detector.width, 1, 16_384);
            c.count("height", s.detector.height, 1, 16_384);
            c.within("pixel_mm", s.detector.pixel_mm, 1e-4, 100.0);
        });
        self.at("orbit", |c| {
            c.count("projections", s.orbit.projections, 1, 100_000);
            c.above("arc_deg", s.orbit.arc_deg, 0.0, 3600.0);
            c.above("source_m", s.orbit.source_m, 0.0, 100.0);
            c.above("detector_m", s.orbit.detector_m, 0.0, 100.0);
            if s.orbit.along.is_empty() || s.orbit.along.len() > 10_000 {
                c.error("along", "EMPTY", "say where on the axis to scan, 1 to 10000 places");
            }
            for (i, along) in s.orbit.along.iter().enumerate() {
                c.within(&format!("along[{i}]"), *along, 0.0, 1.0);
            }
        });
    }
}
