//! A field from what walks have found.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Charts, LightField, NONE, Node,
    lobe::{Haze, Lobe, Plane, Spot},
};
use crate::{LitScene, bsdf::Frame};

/// What one walk found at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lesson {
    /// Chart and side of the place.
    pub(crate) key: u32,
    /// Chart where what arrives comes from; [`NONE`]: from beyond.
    pub(crate) from: u32,
    pub(crate) position: Vec3,
    /// Toward where it comes from, unit.
    pub(crate) direction: Vec3,
    /// How far, m.
    pub(crate) distance: f32,
    /// Photon: flux over all walks of its kind, so that the sum over a cell is the flux that it receives. Suffix: an unbiased estimate of
    /// the irradiance.
    pub(crate) value: f32,
    pub(crate) photon: bool,
}

/// Fewest lessons in a cell (the root of a chart apart).
const PER_CELL: usize = 8000;
/// Fewest lessons that make a lobe of their own; below, that of a larger piece serves. Few lessons from far away through an opening are
/// enough for a whole chart: they all pass one focus.
const PER_LOBE: usize = 128;
/// Fewest lessons that make a lobe at all.
const FEWEST: usize = 8;
/// Lessons that what a larger piece has seen counts for.
const PSEUDO: f32 = 16.0;
/// A chart with fewer lessons stays unknown.
const PER_CHART: usize = 32;
/// Deepest tree.
const DEPTH: usize = 24;
/// No lesson may bring more than this share of all that its cell has seen.
const LARGEST: f32 = 0.05;
/// Least |cosine| of flights to a plane that may be their focus.
const SLANT: f32 = 0.03;
/// Planes tried.
const PLANES: usize = 64;
/// Spots that stand for a piece of surface.
const SPOTS: u64 = 128;

/// One chart's part of a field.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    cells: Vec<Seen>,
    lobes: Vec<Lobe>,
    hazes: Vec<Haze>,
}

/// What a cell sees: lobes, and how much of them; what arrives besides, and its haze.
struct Seen {
    lobes: Vec<(u32, f32)>,
    rest: f32,
    haze: u32,
}

/// A convex piece of a surface within a node.
type Polygon = Vec<Vec3>;

/// What a larger piece knows of the light from one origin.
#[derive(Clone, Copy)]
struct Known {
    lobe: u32,
    /// How much of the lobe is seen, where this is known better than at the lobe.
    scale: f32,
    /// Its share of the lessons.
    rate: f32,
}

/// By origin.
type Inherited = BTreeMap<u32, Known>;

/// The other places that have keys: patches of sensors.
pub(crate) struct Extra {
    pub(crate) corners: [Vec3; 4],
    pub(crate) normal: Vec3,
}

/// Builds a field from lessons: the same for the same lessons in any order of threads.
pub(crate) fn build(lit: &LitScene, charts: &Charts, extras: &[Extra], mut lessons: Vec<Lesson>) -> LightField {
    // Stable: within a key they keep the order in which walks brought them.
    lessons.sort_by_key(|l| l.key);
    let keys = 2 * charts.len() + extras.len();
    let [lo, hi] = lit.scene.bounds();
    let runs: Vec<(usize, usize)> = {
        let mut begin = 0;
        let mut runs = Vec::new();
        for i in 1..=lessons.len() {
            if i == lessons.len() || lessons[i].key != lessons[begin].key {
                runs.push((begin, i));
                begin = i;
            }
        }
        runs
    };
    let mut pieces: Vec<&mut [Lesson]> = Vec::with_capacity(runs.len());
    let mut rest = lessons.as_mut_slice();
    for (begin, end) in runs {
        let (head, tail) = rest.split_at_mut(end - begin);
        pieces.push(head);
        rest = tail;
    }
    let parts: Vec<(u32, Part)> = pieces
        .into_par_iter()
        .filter(|lessons| lessons.len() >= PER_CHART)
        .map(|lessons| {
            let key = lessons[0].key;
            let (polygons, normal) = surface(lit, charts, extras, key);
            let mut builder = Builder { part: Part::default(), charts, normal, reach: [lo, hi] };
            builder.grow(lessons, polygons, &Inherited::new(), 0);
            (key, builder.part)
        })
        .collect();
    let mut field = LightField { roots: vec![NONE; keys], ..LightField::default() };
    for (key, part) in parts {
        field.take(key, part);
    }
    field
}

impl LightField {
    fn take(&mut self, key: u32, part: Part) {
        let (nodes, cells) = (self.nodes.len() as u32, self.cells.len() as u32);
        let hazes = self.hazes.len() as u32;
        self.roots[key as usize] = nodes;
        self.nodes.extend(part.nodes.into_iter().map(|node| match node {
            Node::Leaf(cell) => Node::Leaf(cell + cells),
            Node::Split { axis, at, left, right } => Node::Split { axis, at, left: left + nodes, right: right + nodes },
        }));
        self.hazes.extend(part.hazes);
        // Lobes of larger pieces that no cell has any need for are left behind.
        let mut numbers = vec![NONE; part.lobes.len()];
        for Seen { lobes: seen, rest, haze } in part.cells {
            let seen: Vec<(u32, &Lobe, f32)> = seen
                .into_iter()
                .map(|(lobe, scale)| {
                    let (number, lobe) = (&mut numbers[lobe as usize], &part.lobes[lobe as usize]);
                    if *number == NONE {
                        *number = self.lobes.len() as u32;
                        self.lobes.push(lobe.put(&mut self.cuts, &mut self.boxes));
                    }
                    (*number, lobe, scale)
                })
                .collect();
            self.add_cell(&seen, rest, if haze == NONE { NONE } else { haze + hazes });
        }
    }
}

/// The polygons that a key stands for, and the normal of their side.
fn surface(lit: &LitScene, charts: &Charts, extras: &[Extra], key: u32) -> (Vec<Polygon>, Vec3) {
    let chart = key as usize / 2;
    if chart >= charts.len() {
        let extra = &extras[key as usize - 2 * charts.len()];
        return (vec![extra.corners.to_vec()], extra.normal);
    }
    let normal = charts.normal(chart as u32) * if key % 2 == 0 { 1.0 } else { -1.0 };
    (charts.triangles(chart).iter().map(|&t| lit.corners(t).to_vec()).collect(), normal)
}

struct Builder<'a> {
    part: Part,
    charts: &'a Charts,
    normal: Vec3,
    reach: [Vec3; 2],
}

/// What the lessons of a piece say together.
struct Summary {
    /// What the value of a photon counts, and that of a suffix.
    scale: [f32; 2],
    /// The largest value that counts.
    most: [f32; 2],
}

/// Lessons of two kinds as one estimate, each in proportion to how many equally large values it amounts to (n_eff = (Σv)²/Σv²).
fn summarise(lessons: &[Lesson], area: f32) -> Summary {
    let mut most = [f32::INFINITY; 2];
    let (mut n, mut sum, mut squares) = ([0_usize; 2], [0.0_f64; 2], [0.0_f64; 2]);
    for pass in 0..2 {
        (n, sum, squares) = ([0; 2], [0.0; 2], [0.0; 2]);
        for lesson in lessons {
            let k = usize::from(!lesson.photon);
            let v = f64::from(lesson.value.min(most[k]));
            n[k] += 1;
            sum[k] += v;
            squares[k] += v * v;
        }
        if pass == 0 {
            most = [0, 1].map(|k| (LARGEST * sum[k] as f32).max(if n[k] < 40 { f32::INFINITY } else { 0.0 }));
        }
    }
    let effective = [0, 1].map(|k| if squares[k] > 0.0 { sum[k] * sum[k] / squares[k] } else { 0.0 });
    let per = [1.0 / f64::from(area.max(f32::MIN_POSITIVE)), 1.0 / n[1].max(1) as f64];
    let all = effective[0] + effective[1];
    let scale = if all > 0.0 { [0, 1].map(|k| effective[k] / all * per[k]) } else { [0.0; 2] };
    Summary { scale: scale.map(|s| s as f32), most }
}

impl Summary {
    fn weight(&self, lesson: &Lesson) -> f32 {
        let k = usize::from(!lesson.photon);
        lesson.value.min(self.most[k]) * self.scale[k]
    }
}

/// Area and normal of a polygon, as one vector.
fn across(polygon: &[Vec3]) -> Vec3 {
    let fan = |pair: &[Vec3]| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]);
    0.5 * polygon[1..].windows(2).map(fan).sum::<Vec3>()
}

/// Spots spread over polygons by their areas, on the side of `normal`.
fn spots(polygons: &[Polygon], normal: Vec3) -> Vec<Spot> {
    let total: f32 = polygons.iter().map(|p| across(p).length()).sum();
    let (mut spots, mut sum) = (Vec::new(), 0.0);
    for polygon in polygons {
        let vector = across(polygon);
        let begin = (sum / total * SPOTS as f32 - 0.5).ceil().max(0.0) as u64;
        sum += vector.length();
        let end = (sum / total * SPOTS as f32 - 0.5).ceil().max(0.0) as u64;
        let up = vector.normalize_or(normal);
        let up = if up.dot(normal) < 0.0 { -up } else { up };
        for i in begin..end.min(SPOTS) {
            // Roberts' R2 sequence (2018): points that keep apart.
            let at = [0.754_877_7, 0.569_840_3].map(|step: f32| (0.5 + step * i as f32).fract());
            spots.push(Spot { position: place(polygon, at), normal: up });
        }
    }
    if spots.is_empty() {
        spots.extend(polygons.first().map(|p| Spot { position: place(p, [0.5; 2]), normal }));
    }
    spots
}

/// A place in a convex polygon, uniform by area.
fn place(polygon: &[Vec3], [u, v]: [f32; 2]) -> Vec3 {
    let piece = |pair: &[Vec3]| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]).length();
    let mut rest = u * polygon[1..].windows(2).map(piece).sum::<f32>();
    let mut out = polygon[0];
    for pair in polygon[1..].windows(2) {
        let area = piece(pair);
        let [a, b] = crate::bsdf::warp::triangle([(rest / area.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0), v]);
        out = polygon[0] + a * (pair[0] - polygon[0]) + b * (pair[1] - polygon[0]);
        if rest <= area {
            break;
        }
        rest -= area;
    }
    out
}

/// The parts of a convex polygon below and above a plane (Sutherland and Hodgman 1974).
fn cut(polygon: &[Vec3], axis: usize, at: f32) -> [Polygon; 2] {
    let mut sides = [Polygon::new(), Polygon::new()];
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (a, b) = (p[axis] - at, q[axis] - at);
        if a <= 0.0 {
            sides[0].push(p);
        }
        if a >= 0.0 {
            sides[1].push(p);
        }
        if a * b < 0.0 {
            let r = p + (q - p) * (a / (a - b));
            sides[0].push(r);
            sides[1].push(r);
        }
    }
    sides.map(|side| if side.len() > 2 { side } else { Polygon::new() })
}

fn bounds(polygons: &[Polygon]) -> [Vec3; 2] {
    polygons.iter().flatten().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[lo, hi], &p| [lo.min(p), hi.max(p)])
}

/// Lessons by where they come from: lessons of one origin stand together, in the order of the origins.
fn origins(lessons: &mut [Lesson]) -> Vec<(u32, std::ops::Range<usize>)> {
    lessons.sort_by_key(|l| l.from);
    let mut out: Vec<(u32, std::ops::Range<usize>)> = Vec::new();
    for (i, lesson) in lessons.iter().enumerate() {
        match out.last_mut() {
            Some((from, range)) if *from == lesson.from => range.end = i + 1,
            _ => out.push((lesson.from, i..i + 1)),
        }
    }
    out
}

impl Builder<'_> {
    /// Grows the tree of a piece; returns its node.
    fn grow(&mut self, lessons: &mut [Lesson], polygons: Vec<Polygon>, inherited: &Inherited, depth: usize) -> u32 {
        let total_area: f32 = polygons.iter().map(|p| across(p).length()).sum();
        let spots = spots(&polygons, self.normal);
        let [lo, hi] = bounds(&polygons);
        let node = self.part.nodes.len() as u32;
        self.part.nodes.push(Node::Leaf(0));
        let summary = summarise(lessons, total_area);
        let size = hi - lo;
        let axis = size.max_position();
        let at = 0.5 * (lo[axis] + hi[axis]);
        let split = depth < DEPTH
            && lessons.len() >= 2 * PER_CELL
            && size[axis] > 1e-4 * (self.reach[1] - self.reach[0]).length()
            && lo[axis] < at
            && at < hi[axis];
        if !split {
            self.leaf(node, lessons, &summary, inherited, &spots);
            return node;
        }
        // Stable partition.
        let (below, above): (Vec<Lesson>, Vec<Lesson>) = lessons.iter().partition(|l| l.position[axis] < at);
        let middle = below.len();
        lessons[..middle].copy_from_slice(&below);
        lessons[middle..].copy_from_slice(&above);
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for polygon in &polygons {
            let [a, b] = cut(polygon, axis, at);
            if !a.is_empty() {
                low.push(a);
            }
            if !b.is_empty() {
                high.push(b);
            }
        }
        drop(polygons);
        let inherited = self.pass_on(&below, &above, &summary, inherited, &spots);
        drop((below, above));
        let (first, second) = lessons.split_at_mut(middle);
        let left = self.grow(first, low, &inherited, depth + 1);
        let right = self.grow(second, high, &inherited, depth + 1);
        self.part.nodes[node as usize] = Node::Split { axis: axis as u8, at, left, right };
        node
    }

    /// What the two parts of a piece may need to know from it: lobes of origins of which a part has too few lessons itself.
    fn pass_on(&mut self, below: &[Lesson], above: &[Lesson], summary: &Summary, inherited: &Inherited, spots: &[Spot]) -> Inherited {
        let mut all: BTreeMap<u32, (Vec<Lesson>, [usize; 2])> = BTreeMap::new();
        for (k, part) in [below, above].into_iter().enumerate() {
            for lesson in part {
                let entry = all.entry(lesson.from).or_default();
                entry.0.push(*lesson);
                entry.1[k] += 1;
            }
        }
        let n = below.len() + above.len();
        let mut out = Inherited::new();
        for (&from, known) in inherited.iter().filter(|(from, _)| !all.contains_key(from)) {
            out.insert(from, Known { scale: self.scale(known, n, 0, 0.0, spots), rate: 0.0, ..*known });
        }
        for (from, (lessons, counts)) in all {
            let known = inherited.get(&from);
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let wanted = lessons.len() >= least && counts.iter().any(|&n| n < PER_LOBE);
            let lobe = if wanted { self.lobe(from, &lessons, summary, spots) } else { None };
            let rate = lessons.len() as f32 / n as f32;
            if let Some(lobe) = lobe {
                out.insert(from, Known { lobe, scale: 1.0, rate });
            } else if let Some(known) = known {
                let flux = lessons.iter().map(|l| summary.weight(l)).sum();
                out.insert(from, Known { scale: self.scale(known, n, lessons.len(), flux, spots), rate, ..*known });
            }
        }
        out
    }

    /// How much of a larger piece's lobe a smaller one sees, of `n` lessons of which `own` have brought `flux` from there: few say little.
    fn scale(&self, known: &Known, n: usize, own: usize, flux: f32, spots: &[Spot]) -> f32 {
        let lobe = &self.part.lobes[known.lobe as usize];
        let [expected, _] = lobe.mean(spots);
        let evidence = (own as f32).max(known.rate * n as f32);
        // Where nothing of it can arrive, nobody asks.
        let seen = if expected > 0.0 { (flux / expected).min(20.0) } else { 1.0 };
        (evidence * seen + PSEUDO * known.scale) / (evidence + PSEUDO)
    }

    fn leaf(&mut self, node: u32, lessons: &mut [Lesson], summary: &Summary, inherited: &Inherited, spots: &[Spot]) {
        let cell = self.part.cells.len() as u32;
        self.part.nodes[node as usize] = Node::Leaf(cell);
        let n = lessons.len();
        let mut lobes = Vec::new();
        let mut rest: Vec<Lesson> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for (from, range) in origins(lessons) {
            let own = &lessons[range];
            seen.insert(from);
            let known = inherited.get(&from);
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let lobe = if own.len() >= least { self.lobe(from, own, summary, spots) } else { None };
            match (lobe, known) {
                (Some(lobe), _) => lobes.push((lobe, 1.0)),
                (None, Some(known)) => {
                    let flux = own.iter().map(|l| summary.weight(l)).sum();
                    let scale = self.scale(known, n, own.len(), flux, spots);
                    lobes.push((known.lobe, scale));
                }
                (None, None) => rest.extend(own),
            }
        }
        for (_, known) in inherited.iter().filter(|(from, _)| !seen.contains(from)) {
            let scale = self.scale(known, n, 0, 0.0, spots);
            lobes.push((known.lobe, scale));
        }
        let flux: f32 = rest.iter().map(|l| summary.weight(l)).sum();
        let haze = if flux > 0.0 {
            self.part.hazes.push(Haze::new(self.normal, rest.iter().map(|l| (l.direction, summary.weight(l)))));
            self.part.hazes.len() as u32 - 1
        } else {
            NONE
        };
        self.part.cells.push(Seen { lobes, rest: flux, haze });
    }

    /// A lobe of lessons from one origin, which arrive at `spots`.
    fn lobe(&mut self, from: u32, lessons: &[Lesson], summary: &Summary, spots: &[Spot]) -> Option<u32> {
        if from as usize >= self.charts.len() {
            return None;
        }
        let plane = focus(lessons, summary, self.charts.normal(from), spots)?;
        let sign = lessons.iter().map(|l| summary.weight(l) * plane.frame.z.dot(l.direction)).sum::<f32>().signum();
        let mut places: Vec<([f32; 2], f32)> = lessons
            .iter()
            .filter(|l| plane.frame.z.dot(l.direction) * sign > 1e-3)
            .map(|l| (plane.coordinates(l.position, l.direction), summary.weight(l)))
            .collect();
        if !(places.iter().map(|p| p.1).sum::<f32>() > 0.0) {
            return None;
        }
        self.part.lobes.push(Lobe::new(plane, &mut places, spots));
        Some(self.part.lobes.len() as u32 - 1)
    }
}

/// Sums over flights of what a plane's crossing is made of.
struct Bundle {
    weight: f64,
    slant: f64,
    /// Of each coordinate u = a + c·b where the plane is at c: Σ a, b, a², ab, b².
    moments: [[f64; 5]; 2],
    /// Distance along the flight, t = p + c·q: Σ p, q.
    reach: [f64; 2],
    /// Where the flights begin, and where they come from, along the normal.
    ends: [f64; 2],
}

impl Bundle {
    /// Of flights that cross planes with the normal of `frame` the same way, if most do.
    fn new(lessons: &[Lesson], summary: &Summary, frame: &Frame) -> Option<Self> {
        let z = frame.z;
        let total: f64 = lessons.iter().map(|l| f64::from(summary.weight(l))).sum();
        let along: f64 = lessons.iter().map(|l| f64::from(summary.weight(l) * z.dot(l.direction))).sum();
        let mut bundle = Self { weight: 0.0, slant: 0.0, moments: [[0.0; 5]; 2], reach: [0.0; 2], ends: [0.0; 2] };
        for lesson in lessons {
            let d = z.dot(lesson.direction);
            if d * along.signum() as f32 <= SLANT {
                continue;
            }
            let (w, q) = (f64::from(summary.weight(lesson)), 1.0 / f64::from(d));
            let o = f64::from(z.dot(lesson.position));
            bundle.weight += w;
            bundle.slant += w * f64::from(d.abs());
            for (m, axis) in bundle.moments.iter_mut().zip([frame.x, frame.y]) {
                let b = f64::from(axis.dot(lesson.direction)) * q;
                let a = f64::from(axis.dot(lesson.position)) - o * b;
                for (m, x) in m.iter_mut().zip([a, b, a * a, a * b, b * b]) {
                    *m += w * x;
                }
            }
            bundle.reach[0] -= w * o * q;
            bundle.reach[1] += w * q;
            bundle.ends[0] += w * o;
            bundle.ends[1] += w * (o + f64::from(d * lesson.distance));
        }
        let w = bundle.weight;
        if w < 0.8 * total || w <= 0.0 {
            return None;
        }
        bundle.slant /= w;
        bundle.moments = bundle.moments.map(|m| m.map(|x| x / w));
        bundle.reach = bundle.reach.map(|x| x / w);
        bundle.ends = bundle.ends.map(|x| x / w);
        Some(bundle)
    }

    /// Solid angle of the bundle, up to a factor, seen from where the flights arrive by the plane at `c`.
    fn width(&self, c: f64) -> f64 {
        let variance = |m: &[f64; 5]| (m[2] - m[0] * m[0] + 2.0 * c * (m[3] - m[0] * m[1]) + c * c * (m[4] - m[1] * m[1])).max(1e-18);
        let t = self.reach[0] + c * self.reach[1];
        (variance(&self.moments[0]) * variance(&self.moments[1])).sqrt() * self.slant / (t * t).max(1e-30)
    }
}

/// The focus plane of flights: the surface with normal `normal` that they come from, unless they pass something narrower on
/// their way.
fn focus(lessons: &[Lesson], summary: &Summary, normal: Vec3, spots: &[Spot]) -> Option<Plane> {
    let frame = Frame::new(normal);
    let origin = Bundle::new(lessons, summary, &frame);
    let (mut best, mut least) = match &origin {
        Some(b) => (Some(Plane { frame, at: b.ends[1] as f32 }), b.width(b.ends[1])),
        None => (None, f64::INFINITY),
    };
    for axis in Vec3::AXES {
        let frame = Frame::new(axis);
        let Some(bundle) = Bundle::new(lessons, summary, &frame) else { continue };
        let [mean, far] = bundle.ends;
        let ahead = (far - mean).signum();
        // In front of all of the piece.
        let near = spots.iter().map(|s| f64::from(axis.dot(s.position))).fold(mean, |a, b| if (b - a) * ahead > 0.0 { b } else { a });
        if (far - near) * ahead <= 0.0 {
            continue;
        }
        // Closer together where they are near, since there a plane's distance matters more.
        let at = |k: f64| near + (far - near) * (k / PLANES as f64).powi(2);
        let width = |k: f64| bundle.width(at(k));
        let Some(k) = (1..PLANES).min_by(|&a, &b| width(a as f64).total_cmp(&width(b as f64))) else { continue };
        let k = narrowest(width, k as f64 - 1.0, k as f64 + 1.0);
        if width(k) < least {
            (best, least) = (Some(Plane { frame, at: at(k) as f32 }), width(k));
        }
    }
    best
}

/// Least value of a function with one dip between `a` and `b`, by golden sections.
fn narrowest(of: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..12 {
        let (c, d) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
        if of(c) < of(d) { b = d } else { a = c }
    }
    0.5 * (a + b)
}
