//! A field from what walks have found.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Cell, Charts, Entry, LightField, NONE, Node,
    lobe::{Boxes, Focus, Lobe, square},
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
    /// Photon: flux over all walks of its kind, so that the sum over a cell is the flux that it receives. Suffix: an unbiased estimate of
    /// the irradiance.
    pub(crate) value: f32,
    pub(crate) photon: bool,
}

/// Fewest lessons in a cell (the root of a chart apart).
const PER_CELL: usize = 1000;
/// Fewest lessons that make a lobe of their own; below, that of a larger piece serves. Few lessons from far away through an opening are
/// enough for a whole chart: they all pass one focus.
const PER_LOBE: usize = 128;
/// Fewest lessons that make a lobe at all.
const FEWEST: usize = 8;
/// Lessons that what a larger piece has seen counts for.
const PSEUDO: f32 = 16.0;
/// A chart with fewer lessons stays unknown.
const PER_CHART: usize = 32;
/// Lobes of less than this share of a cell are not kept.
const LEAST_SHARE: f32 = 0.005;
/// Deepest tree.
const DEPTH: usize = 24;
/// No lesson may bring more than this share of all that its cell has seen.
const LARGEST: f32 = 0.05;
/// Least |cosine| of flights to a plane that may be their focus.
const SLANT: f32 = 0.03;
/// Planes tried.
const PLANES: usize = 96;

/// One chart's part of a field.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    entries: Vec<Entry>,
    lobes: Vec<Lobe>,
}

/// A convex piece of a surface within a node.
type Polygon = Vec<Vec3>;

/// What a larger piece knows of the light from one origin.
#[derive(Clone, Copy)]
struct Known {
    lobe: u32,
    /// Its share of the irradiance.
    share: f32,
    /// Its share of the lessons.
    rate: f32,
}

/// By origin.
type Inherited = BTreeMap<u32, Known>;

impl Known {
    /// The share of an origin in a smaller piece, of `n` lessons, that has seen `own` of it, bringing `share`: few lessons say little.
    fn share(above: Option<&Self>, n: usize, own: usize, share: f32) -> f32 {
        let Some(above) = above else { return share };
        let evidence = (own as f32).max(above.rate * n as f32);
        (evidence * share + PSEUDO * above.share) / (evidence + PSEUDO)
    }
}

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
            let mut builder = Builder { part: Part::default(), normal, reach: [lo, hi] };
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
        let (nodes, cells, entries, lobes) =
            (self.nodes.len() as u32, self.cells.len() as u32, self.entries.len() as u32, self.lobes.len() as u32);
        self.roots[key as usize] = nodes;
        self.nodes.extend(part.nodes.into_iter().map(|node| match node {
            Node::Leaf(cell) => Node::Leaf(cell + cells),
            Node::Split { axis, at, left, right } => Node::Split { axis, at, left: left + nodes, right: right + nodes },
        }));
        self.cells.extend(part.cells.into_iter().map(|c| Cell { first: c.first + entries, end: c.end + entries, ..c }));
        self.entries.extend(part.entries.into_iter().map(|e| Entry { lobe: e.lobe + lobes, ..e }));
        self.lobes.extend(part.lobes);
    }
}

/// The polygons that a key stands for, and the normal of their side.
fn surface(lit: &LitScene, charts: &Charts, extras: &[Extra], key: u32) -> (Vec<Polygon>, Vec3) {
    let chart = key as usize / 2;
    if chart >= charts.len() {
        let extra = &extras[key as usize - 2 * charts.len()];
        return (vec![extra.corners.to_vec()], extra.normal);
    }
    let triangles = charts.triangles(chart);
    let normal: Vec3 = triangles.iter().map(|&t| lit.normal(t) * lit.area(t)).sum();
    let normal = normal.normalize_or(Vec3::Y) * if key % 2 == 0 { 1.0 } else { -1.0 };
    (triangles.iter().map(|&t| lit.corners(t).to_vec()).collect(), normal)
}

struct Builder {
    part: Part,
    normal: Vec3,
    reach: [Vec3; 2],
}

/// What the lessons of a piece say together.
struct Summary {
    irradiance: f32,
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
    Summary { irradiance: (sum[0] * scale[0] + sum[1] * scale[1]) as f32, scale: scale.map(|s| s as f32), most }
}

impl Summary {
    fn weight(&self, lesson: &Lesson) -> f32 {
        let k = usize::from(!lesson.photon);
        lesson.value.min(self.most[k]) * self.scale[k]
    }
}

fn area(polygon: &[Vec3]) -> f32 {
    let fan = |pair: &[Vec3]| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]);
    0.5 * polygon[1..].windows(2).map(fan).sum::<Vec3>().length()
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

impl Builder {
    /// Grows the tree of a piece; returns its node.
    fn grow(&mut self, lessons: &mut [Lesson], polygons: Vec<Polygon>, inherited: &Inherited, depth: usize) -> u32 {
        let total_area: f32 = polygons.iter().map(|p| area(p)).sum();
        let [lo, hi] = bounds(&polygons);
        let node = self.part.nodes.len() as u32;
        self.part.nodes.push(Node::Leaf(0));
        let summary = summarise(lessons, total_area);
        let size = hi - lo;
        let axis = size.max_position();
        let at = 0.5 * (lo[axis] + hi[axis]);
        let split = depth < DEPTH && lessons.len() >= 2 * PER_CELL && size[axis] > 1e-4 * (self.reach[1] - self.reach[0]).length() && lo[axis] < at && at < hi[axis];
        if !split {
            self.leaf(node, lessons, &summary, inherited, [lo, hi]);
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
        let inherited = self.pass_on(&below, &above, &summary, inherited, [lo, hi]);
        drop((below, above));
        let (first, second) = lessons.split_at_mut(middle);
        let left = self.grow(first, low, &inherited, depth + 1);
        let right = self.grow(second, high, &inherited, depth + 1);
        self.part.nodes[node as usize] = Node::Split { axis: axis as u8, at, left, right };
        node
    }

    /// What the two parts of a piece may need to know from it: lobes of origins of which a part has too few lessons itself.
    fn pass_on(&mut self, below: &[Lesson], above: &[Lesson], summary: &Summary, inherited: &Inherited, span: [Vec3; 2]) -> Inherited {
        let mut all: BTreeMap<u32, (Vec<Lesson>, [usize; 2])> = BTreeMap::new();
        for (k, part) in [below, above].into_iter().enumerate() {
            for lesson in part {
                let entry = all.entry(lesson.from).or_default();
                entry.0.push(*lesson);
                entry.1[k] += 1;
            }
        }
        let n = below.len() + above.len();
        let mut out = inherited.clone();
        out.iter_mut().filter(|(from, _)| !all.contains_key(from)).for_each(|(_, known)| {
            (known.share, known.rate) = (Known::share(Some(known), n, 0, 0.0), 0.0);
        });
        for (from, (lessons, counts)) in all {
            let flux: f32 = lessons.iter().map(|l| summary.weight(l)).sum();
            let known = inherited.get(&from);
            let share = Known::share(known, n, lessons.len(), flux / summary.irradiance.max(f32::MIN_POSITIVE));
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let wanted = lessons.len() >= least && counts.iter().any(|&n| n < PER_LOBE);
            let lobe = if wanted { self.lobe(&lessons, summary, span) } else { None };
            if let Some(lobe) = lobe.or(known.map(|k| k.lobe)) {
                out.insert(from, Known { lobe, share, rate: lessons.len() as f32 / n as f32 });
            }
        }
        out
    }

    fn leaf(&mut self, node: u32, lessons: &mut [Lesson], summary: &Summary, inherited: &Inherited, span: [Vec3; 2]) {
        let cell = self.part.cells.len() as u32;
        self.part.nodes[node as usize] = Node::Leaf(cell);
        let first = self.part.entries.len() as u32;
        let n = lessons.len();
        let mut found: Vec<(u32, f32)> = Vec::new();
        let mut rest: Vec<Lesson> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for (from, range) in origins(lessons) {
            let own = &lessons[range];
            seen.insert(from);
            let flux: f32 = own.iter().map(|l| summary.weight(l)).sum();
            let known = inherited.get(&from);
            let share = Known::share(known, n, own.len(), flux / summary.irradiance.max(f32::MIN_POSITIVE));
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let lobe = if own.len() >= least && share > LEAST_SHARE { self.lobe(own, summary, span) } else { None };
            match lobe.or(known.map(|k| k.lobe)) {
                Some(lobe) if share > LEAST_SHARE => found.push((lobe, share)),
                _ => rest.extend(own),
            }
        }
        for (_, known) in inherited.iter().filter(|(from, _)| !seen.contains(from)) {
            let share = Known::share(Some(known), n, 0, 0.0);
            if share > LEAST_SHARE {
                found.push((known.lobe, share));
            }
        }
        let left: f32 = rest.iter().map(|l| summary.weight(l)).sum::<f32>() / summary.irradiance.max(f32::MIN_POSITIVE);
        if (left > LEAST_SHARE && rest.len() >= FEWEST) || found.is_empty() {
            found.push((self.square(&rest, summary), left.max(LEAST_SHARE)));
        }
        let total: f32 = found.iter().map(|f| f.1).sum();
        let mut sum = 0.0;
        for (lobe, share) in found {
            sum += share / total;
            self.part.entries.push(Entry { lobe, sum, p: share / total });
        }
        self.part.cells.push(Cell { irradiance: summary.irradiance, first, end: self.part.entries.len() as u32 });
    }

    /// A lobe of lessons from one origin, if they have a focus plane in front of the piece `span`.
    fn lobe(&mut self, lessons: &[Lesson], summary: &Summary, span: [Vec3; 2]) -> Option<u32> {
        let focus = focus(lessons, summary, span, self.reach)?;
        let (u, v) = ((focus.axis + 1) % 3, (focus.axis + 2) % 3);
        let sign = (focus.at - 0.5 * (span[0] + span[1])[focus.axis]).signum();
        let mut places: Vec<([f32; 2], f32)> = lessons
            .iter()
            .filter(|l| l.direction[focus.axis] * sign > SLANT)
            .map(|l| {
                let t = (focus.at - l.position[focus.axis]) / l.direction[focus.axis];
                let z = l.position + t * l.direction;
                ([z[u], z[v]], summary.weight(l))
            })
            .collect();
        if !(places.iter().map(|p| p.1).sum::<f32>() > 0.0) {
            return None;
        }
        let [lo, hi] = places.iter().fold([[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]], |[lo, hi], (p, _)| {
            [[lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])]]
        });
        let margin = 0.02 + 1.0 / (places.len() as f32).sqrt();
        let pad = [0, 1].map(|k| margin * (hi[k] - lo[k]) + 1e-6 * hi[k].abs().max(lo[k].abs()) + 1e-9);
        let boxes = Boxes::new(&mut places, [lo[0] - pad[0], lo[1] - pad[1]], [hi[0] + pad[0], hi[1] + pad[1]]);
        Some(self.keep(Lobe::Focus(focus, boxes)))
    }

    /// A lobe over the directions about the normal.
    fn square(&mut self, lessons: &[Lesson], summary: &Summary) -> u32 {
        let frame = Frame::new(self.normal);
        let mut places: Vec<([f32; 2], f32)> = lessons.iter().map(|l| (square(frame.to_local(l.direction)), summary.weight(l))).collect();
        let boxes = Boxes::new(&mut places, [0.0; 2], [1.0; 2]);
        self.keep(Lobe::Square(frame, boxes))
    }

    fn keep(&mut self, lobe: Lobe) -> u32 {
        self.part.lobes.push(lobe);
        self.part.lobes.len() as u32 - 1
    }
}

/// The plane across an axis where the flights come closest: least √(Var u · Var v)·⟨|d|⟩/distance², the solid angle of the bundle.
fn focus(lessons: &[Lesson], summary: &Summary, [lo, hi]: [Vec3; 2], reach: [Vec3; 2]) -> Option<Focus> {
    let total: f32 = lessons.iter().map(|l| summary.weight(l)).sum();
    let mut best: Option<(f32, Focus)> = None;
    for axis in 0..3 {
        for sign in [1.0_f32, -1.0] {
            // With u = a + c·b on plane c, b = d_u/d_axis and a = o_u − o_axis·b: the variances are quadratic in c.
            let (mut w, mut slant) = (0.0_f64, 0.0_f64);
            let mut m = [[0.0_f64; 5]; 2];
            for lesson in lessons {
                let d = lesson.direction[axis] * sign;
                if d <= SLANT {
                    continue;
                }
                let weight = f64::from(summary.weight(lesson));
                w += weight;
                slant += weight * f64::from(d);
                for (k, m) in m.iter_mut().enumerate() {
                    let other = (axis + 1 + k) % 3;
                    let b = f64::from(lesson.direction[other] / lesson.direction[axis]);
                    let a = f64::from(lesson.position[other]) - f64::from(lesson.position[axis]) * b;
                    for (m, x) in m.iter_mut().zip([a, b, a * a, a * b, b * b]) {
                        *m += weight * x;
                    }
                }
            }
            if w < 0.8 * f64::from(total) || w <= 0.0 {
                continue;
            }
            let m = m.map(|m| m.map(|x| x / w));
            let slant = slant / w;
            let near = if sign > 0.0 { hi[axis] } else { lo[axis] };
            let far = if sign > 0.0 { reach[1][axis] } else { reach[0][axis] };
            let from = 0.5 * (lo[axis] + hi[axis]);
            let range = far - near;
            if range * sign <= 0.0 {
                continue;
            }
            for k in 0..=PLANES {
                let at = near + range * (k as f32 + 0.02) / (PLANES as f32 + 0.02);
                let c = f64::from(at);
                let var = |m: &[f64; 5]| (m[2] - m[0] * m[0] + 2.0 * c * (m[3] - m[0] * m[1]) + c * c * (m[4] - m[1] * m[1])).max(1e-18);
                let distance = f64::from(at - from).powi(2);
                let cost = ((var(&m[0]) * var(&m[1])).sqrt() * slant / distance.max(1e-30)) as f32;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, Focus { axis, at }));
                }
            }
        }
    }
    best.map(|b| b.1)
}
