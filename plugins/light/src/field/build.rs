//! A field from what walks have found.

use std::{collections::HashMap, sync::Arc};

use glam::Vec3;
use intrados_transport::field::{FieldEvidence, shares};
use rayon::prelude::*;
use wide::f64x4;

use super::{
    Charts, LightField, NONE, Node,
    lobe::{Haze, Lobe, Plane, Spot},
};
use crate::{LitScene, bsdf::Frame};

/// What one walk found at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrainingSample {
    /// Chart and side of the place.
    pub(crate) key: u32,
    /// Chart where what arrives comes from; [`NONE`]: from beyond.
    pub(crate) from: u32,
    pub(crate) position: Vec3,
    /// Toward where it comes from, unit.
    pub(crate) direction: Vec3,
    /// How far, m.
    pub(crate) distance: f32,
    /// Photon: flux over all walks of its kind, so that the sum over a cell is the flux that it
    /// receives. Suffix: an unbiased estimate of the irradiance.
    pub(crate) value: f32,
    pub(crate) photon: bool,
}

/// Fewest lessons in a cell (the root of a chart apart).
const PER_CELL: usize = 8000;
/// Fewest lessons that make a lobe of their own; below, that of a larger piece serves. Few lessons
/// from far away through an opening are enough for a whole chart: they all pass one focus.
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
const SLANT: f64 = 0.03;
/// Planes tried.
const PLANES: usize = 64;
/// Spots that stand for a piece of surface.
const SPOTS: u64 = 128;

/// Pieces with more lessons than this are shared among threads.
const SHARED: usize = 1 << 15;

/// One chart's part of a field.
enum Tree {
    Split { axis: usize, at: f32, parts: Box<[Tree; 2]> },
    Leaf(Seen),
}

/// What a cell sees: lobes, and how much of them; what arrives besides, and its haze.
struct Seen {
    lobes: Vec<(Arc<Lobe>, f32)>,
    rest: f32,
    haze: Option<Haze>,
}

/// A convex piece of a surface within a node.
type Polygon = Vec<Vec3>;

/// What a larger piece knows of the light from one origin.
#[derive(Clone)]
struct Known {
    from: u32,
    lobe: Arc<Lobe>,
    /// How much of the lobe is seen, where this is known better than at the lobe.
    scale: f32,
    /// Its share of the lessons.
    rate: f32,
}

/// What a field is spread over.
pub(crate) struct Charted<'g> {
    pub(crate) lit: &'g LitScene,
    pub(crate) charts: &'g Charts,
    /// Places that have keys behind those of the charts.
    pub(crate) extras: &'g [Extra],
}

/// The other places that have keys: patches of sensors.
pub(crate) struct Extra {
    pub(crate) corners: [Vec3; 4],
    pub(crate) normal: Vec3,
}

/// Builds a field from lessons: the same for the same lessons in any order of threads.
pub(crate) fn build(
    &Charted { lit, charts, extras }: &Charted,
    lessons: Vec<TrainingSample>,
) -> LightField {
    let keys = 2 * charts.len() + extras.len();
    let reach = lit.scene.bounds();
    // By key: where each comes from and which it is, so that those of one origin will stand
    // together, in the order of the walks.
    let mut by_key = vec![Vec::new(); keys];
    for (i, lesson) in lessons.iter().enumerate() {
        by_key[lesson.key as usize].push(u64::from(lesson.from) << 32 | i as u64);
    }
    let trees: Vec<Option<Tree>> = by_key
        .into_par_iter()
        .enumerate()
        .map(|(key, mut names)| {
            if names.len() < PER_CHART {
                return None;
            }
            names.sort_unstable();
            let mut own: Vec<TrainingSample> =
                names.into_iter().map(|name| lessons[name as u32 as usize]).collect();
            let (polygons, normal) = surface(lit, charts, extras, key);
            let mut spare = own.clone();
            Some(Builder { charts, normal, reach }.grow(&mut own, &mut spare, polygons, &[], 0))
        })
        .collect();
    let mut field = LightField { roots: vec![NONE; keys], ..LightField::default() };
    for (key, tree) in trees.into_iter().enumerate() {
        if let Some(tree) = tree {
            field.roots[key] = field.take(tree, &mut HashMap::new());
        }
    }
    field
}

impl LightField {
    /// Takes a tree over and returns its node; `numbers` are those of the lobes of its chart.
    fn take(&mut self, tree: Tree, numbers: &mut HashMap<*const Lobe, u32>) -> u32 {
        let node = self.nodes.len() as u32;
        self.nodes.push(Node::Leaf(self.cells.len() as u32));
        match tree {
            Tree::Split { axis, at, parts } => {
                let [left, right] = parts.map(|part| self.take(part, numbers));
                self.nodes[node as usize] = Node::Split { axis: axis as u8, at, left, right };
            }
            Tree::Leaf(Seen { lobes, rest, haze }) => {
                let mut number = |lobe: &Arc<Lobe>| {
                    *numbers.entry(Arc::as_ptr(lobe)).or_insert_with(|| {
                        self.lobes.push(lobe.put(&mut self.cuts, &mut self.boxes));
                        self.lobes.len() as u32 - 1
                    })
                };
                let seen: Vec<(u32, &Lobe, f32)> =
                    lobes.iter().map(|(lobe, scale)| (number(lobe), &**lobe, *scale)).collect();
                let number = if haze.is_some() { self.hazes.len() as u32 } else { NONE };
                self.hazes.extend(haze);
                self.add_cell(&seen, rest, number);
            }
        }
        node
    }
}

/// The polygons that a key stands for, and the normal of their side.
fn surface(lit: &LitScene, charts: &Charts, extras: &[Extra], key: usize) -> (Vec<Polygon>, Vec3) {
    let chart = key / 2;
    if chart >= charts.len() {
        let extra = &extras[key - 2 * charts.len()];
        return (vec![extra.corners.to_vec()], extra.normal);
    }
    let normal = charts.normal(chart as u32) * if key.is_multiple_of(2) { 1.0 } else { -1.0 };
    (charts.triangles(chart).iter().map(|&t| lit.corners(t).to_vec()).collect(), normal)
}

struct Builder<'a> {
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

/// Lessons of two kinds as one estimate, weighed by their inverse variances ([`shares`]).
fn summarise(lessons: &[TrainingSample], area: f32) -> Summary {
    let sums = |most: [f32; 2]| {
        let (mut n, mut sum, mut squares, mut largest) =
            ([0_usize; 2], [0.0_f64; 2], [0.0_f64; 2], [0.0_f32; 2]);
        for lesson in lessons {
            let k = usize::from(!lesson.photon);
            let v = lesson.value.min(most[k]);
            n[k] += 1;
            sum[k] += f64::from(v);
            squares[k] += f64::from(v) * f64::from(v);
            largest[k] = largest[k].max(v);
        }
        (n, sum, squares, largest)
    };
    let (n, mut sum, mut squares, largest) = sums([f32::INFINITY; 2]);
    let most = [0, 1].map(|k| if n[k] < 40 { f32::INFINITY } else { LARGEST * sum[k] as f32 });
    if largest[0] > most[0] || largest[1] > most[1] {
        (_, sum, squares, _) = sums(most);
    }
    let [photons, suffixes] =
        [0, 1].map(|k| FieldEvidence { n: n[k] as u64, sum: sum[k], squares: squares[k] });
    let shares = shares(&photons, &suffixes);
    let per = [1.0 / f64::from(area.max(f32::MIN_POSITIVE)), 1.0 / n[1].max(1) as f64];
    Summary { scale: [0, 1].map(|k| (shares[k] * per[k]) as f32), most }
}

impl Summary {
    fn weight(&self, lesson: &TrainingSample) -> f32 {
        let k = usize::from(!lesson.photon);
        lesson.value.min(self.most[k]) * self.scale[k]
    }

    fn flux(&self, lessons: &[TrainingSample]) -> f32 {
        lessons.iter().map(|l| self.weight(l)).sum()
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
        let [a, b] =
            crate::bsdf::warp::triangle([(rest / area.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0), v]);
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
    polygons
        .iter()
        .flatten()
        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[lo, hi], &p| [lo.min(p), hi.max(p)])
}

/// Lessons by where they come from: those of one origin stand together.
fn origins(lessons: &[TrainingSample]) -> impl Iterator<Item = (u32, &[TrainingSample])> {
    lessons.chunk_by(|a, b| a.from == b.from).map(|own| (own[0].from, own))
}

/// Moves those below a plane to the front; both parts keep their order. `spare` is as long.
fn part(
    lessons: &mut [TrainingSample],
    spare: &mut [TrainingSample],
    axis: usize,
    at: f32,
) -> usize {
    let (mut below, mut above) = (0, 0);
    for i in 0..lessons.len() {
        let lesson = lessons[i];
        let first = lesson.position[axis] < at;
        // Both are written, one of them over what does not count: no branch to mispredict.
        spare[above] = lesson;
        lessons[below] = lesson;
        below += usize::from(first);
        above += usize::from(!first);
    }
    lessons[below..].copy_from_slice(&spare[..above]);
    below
}

impl Builder<'_> {
    /// Grows the tree of a piece from its lessons, which stand in the order of their origins;
    /// `spare` has room for as many.
    fn grow(
        &self,
        lessons: &mut [TrainingSample],
        spare: &mut [TrainingSample],
        polygons: Vec<Polygon>,
        inherited: &[Known],
        depth: usize,
    ) -> Tree {
        let total_area: f32 = polygons.iter().map(|p| across(p).length()).sum();
        let spots = spots(&polygons, self.normal);
        let [lo, hi] = bounds(&polygons);
        let summary = summarise(lessons, total_area);
        let size = hi - lo;
        let axis = size.max_position();
        let at = 0.5 * (lo[axis] + hi[axis]);
        let least = 1e-4 * (self.reach[1] - self.reach[0]).length();
        if depth >= DEPTH
            || lessons.len() < 2 * PER_CELL
            || size[axis] <= least
            || lo[axis] >= at
            || at >= hi[axis]
        {
            return Tree::Leaf(self.leaf(lessons, &summary, inherited, &spots));
        }
        let inherited = self.pass_on(lessons, axis, at, &summary, inherited, &spots);
        let shared = lessons.len() > SHARED;
        let middle = part(lessons, spare, axis, at);
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for polygon in &polygons {
            let [a, b] = cut(polygon, axis, at);
            low.extend((!a.is_empty()).then_some(a));
            high.extend((!b.is_empty()).then_some(b));
        }
        drop(polygons);
        let (first, second) = lessons.split_at_mut(middle);
        let (spare, other) = spare.split_at_mut(middle);
        let left = || self.grow(first, spare, low, &inherited, depth + 1);
        let right = || self.grow(second, other, high, &inherited, depth + 1);
        let (left, right) = if shared { rayon::join(left, right) } else { (left(), right()) };
        Tree::Split { axis, at, parts: Box::new([left, right]) }
    }

    /// What the two parts of a piece may need to know from it: lobes of origins of which a part has
    /// too few lessons itself.
    fn pass_on(
        &self,
        lessons: &[TrainingSample],
        axis: usize,
        at: f32,
        summary: &Summary,
        inherited: &[Known],
        spots: &[Spot],
    ) -> Vec<Known> {
        let n = lessons.len();
        let mut out = Vec::with_capacity(inherited.len());
        let mut rest = inherited;
        for (from, own) in origins(lessons) {
            let before = rest.partition_point(|k| k.from < from);
            out.extend(rest[..before].iter().map(|k| Known {
                scale: scale(k, n, 0, 0.0, spots),
                rate: 0.0,
                ..k.clone()
            }));
            rest = &rest[before..];
            let known = rest.first().filter(|k| k.from == from);
            rest = &rest[usize::from(known.is_some())..];
            let below = own.iter().filter(|l| l.position[axis] < at).count();
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let wanted = own.len() >= least && below.min(own.len() - below) < PER_LOBE;
            let lobe = if wanted { self.lobe(from, own, summary, spots) } else { None };
            let rate = own.len() as f32 / n as f32;
            if let Some(lobe) = lobe {
                out.push(Known { from, lobe, scale: 1.0, rate });
            } else if let Some(known) = known {
                out.push(Known {
                    scale: scale(known, n, own.len(), summary.flux(own), spots),
                    rate,
                    ..known.clone()
                });
            }
        }
        out.extend(rest.iter().map(|k| Known {
            scale: scale(k, n, 0, 0.0, spots),
            rate: 0.0,
            ..k.clone()
        }));
        out
    }

    fn leaf(
        &self,
        lessons: &[TrainingSample],
        summary: &Summary,
        inherited: &[Known],
        spots: &[Spot],
    ) -> Seen {
        let n = lessons.len();
        let mut lobes = Vec::new();
        let mut rest: Vec<&[TrainingSample]> = Vec::new();
        let mut unseen = vec![true; inherited.len()];
        for (from, own) in origins(lessons) {
            let known = inherited.binary_search_by_key(&from, |k| k.from).ok();
            let least = if known.is_some() { PER_LOBE } else { FEWEST };
            let lobe = if own.len() >= least { self.lobe(from, own, summary, spots) } else { None };
            if let Some(i) = known {
                unseen[i] = false;
            }
            match (lobe, known) {
                (Some(lobe), _) => lobes.push((lobe, 1.0)),
                (None, Some(i)) => {
                    let known = &inherited[i];
                    lobes.push((
                        known.lobe.clone(),
                        scale(known, n, own.len(), summary.flux(own), spots),
                    ));
                }
                (None, None) => rest.push(own),
            }
        }
        for (known, _) in inherited.iter().zip(unseen).filter(|(_, unseen)| *unseen) {
            lobes.push((known.lobe.clone(), scale(known, n, 0, 0.0, spots)));
        }
        let flux: f32 = rest.iter().map(|own| summary.flux(own)).sum();
        let flights = rest.iter().copied().flatten().map(|l| (l.direction, summary.weight(l)));
        Seen { lobes, rest: flux, haze: (flux > 0.0).then(|| Haze::new(self.normal, flights)) }
    }

    /// A lobe of lessons from one origin, which arrive at `spots`.
    fn lobe(
        &self,
        from: u32,
        lessons: &[TrainingSample],
        summary: &Summary,
        spots: &[Spot],
    ) -> Option<Arc<Lobe>> {
        if from as usize >= self.charts.len() {
            return None;
        }
        let plane = focus(&Flights::new(lessons, summary), self.charts.normal(from), spots)?;
        let sign = lessons
            .iter()
            .map(|l| summary.weight(l) * plane.frame.z.dot(l.direction))
            .sum::<f32>()
            .signum();
        let mut places: Vec<([f32; 2], f32)> = lessons
            .iter()
            .filter(|l| plane.frame.z.dot(l.direction) * sign > 1e-3)
            .map(|l| (plane.coordinates(l.position, l.direction), summary.weight(l)))
            .collect();
        let lit = places.iter().any(|p| p.1 > 0.0);
        lit.then(|| Arc::new(Lobe::new(plane, &mut places, spots)))
    }
}

/// How much of a larger piece's lobe a smaller one sees, of `n` lessons of which `own` have brought
/// `flux` from there: few say little.
fn scale(known: &Known, n: usize, own: usize, flux: f32, spots: &[Spot]) -> f32 {
    let [expected, _] = known.lobe.mean(spots);
    let evidence = (own as f32).max(known.rate * n as f32);
    // Where nothing of it can arrive, nobody asks.
    let seen = if expected > 0.0 { (flux / expected).min(20.0) } else { 1.0 };
    (evidence * seen + PSEUDO * known.scale) / (evidence + PSEUDO)
}

/// Flights in columns, four to a step.
struct Flights {
    weight: Vec<f64x4>,
    position: Vec<[f64x4; 3]>,
    direction: Vec<[f64x4; 3]>,
    distance: Vec<f64x4>,
    total: f64,
}

impl Flights {
    fn new(lessons: &[TrainingSample], summary: &Summary) -> Self {
        let n = lessons.len().div_ceil(4);
        let mut out = Self {
            weight: Vec::with_capacity(n),
            position: Vec::with_capacity(n),
            direction: Vec::with_capacity(n),
            distance: Vec::with_capacity(n),
            total: 0.0,
        };
        let mut total = f64x4::ZERO;
        for four in lessons.chunks(4) {
            // Fewer than four: the last one again, with weight 0.
            let column = |of: &dyn Fn(&TrainingSample) -> f32| {
                f64x4::from(
                    [0, 1, 2, 3].map(|i: usize| f64::from(of(&four[i.min(four.len() - 1)]))),
                )
            };
            let weight = f64x4::from(
                [0, 1, 2, 3]
                    .map(|i: usize| four.get(i).map_or(0.0, |l| f64::from(summary.weight(l)))),
            );
            total += weight;
            out.weight.push(weight);
            out.position.push([0, 1, 2].map(|k| column(&|l| l.position[k])));
            out.direction.push([0, 1, 2].map(|k| column(&|l| l.direction[k])));
            out.distance.push(column(&|l| l.distance));
        }
        out.total = total.reduce_add();
        out
    }
}

/// Means over flights of what a plane's crossing is made of.
struct Bundle {
    slant: f64,
    /// Of each coordinate u = a + c·b where the plane is at c: a, b, a², ab, b².
    moments: [[f64; 5]; 2],
    /// Distance along the flight, t = p + c·q: p, q.
    reach: [f64; 2],
    /// Where the flights begin, and where they come from, along the normal.
    ends: [f64; 2],
}

impl Bundle {
    /// Of flights that cross planes with the normal of `frame` the same way, if most do.
    fn new(flights: &Flights, frame: &Frame) -> Option<Self> {
        let c = |x: f32| f64x4::splat(f64::from(x));
        let [x, y, z] = [frame.x, frame.y, frame.z].map(|v| v.to_array().map(c));
        let dot =
            |a: &[f64x4; 3], b: &[f64x4; 3]| a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
        let along = flights
            .weight
            .iter()
            .zip(&flights.direction)
            .fold(f64x4::ZERO, |sum, (w, d)| w.mul_add(dot(&z, d), sum));
        let sign = f64x4::splat(along.reduce_add().signum());
        let mut sums = [f64x4::ZERO; 16];
        for i in 0..flights.weight.len() {
            let (direction, position) = (&flights.direction[i], &flights.position[i]);
            let d = dot(&z, direction);
            let ahead = (d * sign).simd_gt(f64x4::splat(SLANT));
            let w = ahead.select(flights.weight[i], f64x4::ZERO);
            let q = f64x4::ONE / ahead.select(d, f64x4::ONE);
            let o = dot(&z, position);
            let lines = [x, y].map(|axis| {
                let b = dot(&axis, direction) * q;
                [dot(&axis, position) - o * b, b]
            });
            let [[a, b], [e, f]] = lines;
            let end = d.mul_add(flights.distance[i], o);
            let terms = [
                f64x4::ONE,
                d.abs(),
                a,
                b,
                a * a,
                a * b,
                b * b,
                e,
                f,
                e * e,
                e * f,
                f * f,
                -o * q,
                q,
                o,
                end,
            ];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum = w.mul_add(term, *sum));
        }
        let [weight, means @ ..] = sums.map(f64x4::reduce_add);
        if weight < 0.8 * flights.total || weight <= 0.0 {
            return None;
        }
        let [slant, a, b, aa, ab, bb, e, f, ee, ef, ff, p, q, o, end] =
            means.map(|sum| sum / weight);
        Some(Self {
            slant,
            moments: [[a, b, aa, ab, bb], [e, f, ee, ef, ff]],
            reach: [p, q],
            ends: [o, end],
        })
    }

    /// Solid angle of the bundle, up to a factor, seen from where the flights arrive by the plane
    /// at `c`.
    fn width(&self, c: f64) -> f64 {
        let variance = |m: &[f64; 5]| {
            (m[2] - m[0] * m[0] + 2.0 * c * (m[3] - m[0] * m[1]) + c * c * (m[4] - m[1] * m[1]))
                .max(1e-18)
        };
        let t = self.reach[0] + c * self.reach[1];
        (variance(&self.moments[0]) * variance(&self.moments[1])).sqrt() * self.slant
            / (t * t).max(1e-30)
    }
}

/// The focus plane of flights: the surface with normal `normal` that they come from, unless they
/// pass something narrower on their way.
fn focus(flights: &Flights, normal: Vec3, spots: &[Spot]) -> Option<Plane> {
    let frame = Frame::new(normal);
    let origin = Bundle::new(flights, &frame);
    let (mut best, mut least) = match &origin {
        Some(b) => (Some(Plane { frame, at: b.ends[1] as f32 }), b.width(b.ends[1])),
        None => (None, f64::INFINITY),
    };
    for axis in Vec3::AXES {
        let frame = Frame::new(axis);
        let Some(bundle) = Bundle::new(flights, &frame) else { continue };
        let [mean, far] = bundle.ends;
        let ahead = (far - mean).signum();
        // In front of all of the piece.
        let near = spots
            .iter()
            .map(|s| f64::from(axis.dot(s.position)))
            .fold(mean, |a, b| if (b - a) * ahead > 0.0 { b } else { a });
        if (far - near) * ahead <= 0.0 {
            continue;
        }
        // Closer together where they are near, since there a plane's distance matters more.
        let at = |k: f64| near + (far - near) * (k / PLANES as f64).powi(2);
        let width = |k: f64| bundle.width(at(k));
        let Some(k) = (1..PLANES).min_by(|&a, &b| width(a as f64).total_cmp(&width(b as f64)))
        else {
            continue;
        };
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
