//! How bars keep cracks apart: a crack's tension goes into the bars across it and comes back into
//! the concrete by bond, so that the next crack cannot be near.
//!
//! A bar does this to the concrete about it up to 1.5 times as far as its axis is from the surface,
//! so that it is 2.5 times that in all (MC2010, 7.6.4.4, as EN 1992-1-1, 7.3.2), but within 7.5 of
//! its diameters (CEB-FIP 1978), however the mesh divides it. Its steel is spread evenly over that
//! zone, as far as it is concrete that hangs together with the brick that the bar lies in.

use std::collections::{BTreeSet, HashSet};

use glam::DVec3;

use super::{Matter, Model, Steel, SteelKind};
use crate::{
    element::{hex8, rod::Piece},
    material::law::Ties,
    mesh::{HexFace, voxel::distance::Triangles},
};

/// How far from its axis a bar keeps cracks apart, over its distance from the surface.
const DEEP: f64 = 1.5;
/// The most of that, in diameters.
const REACH: f64 = 7.5;
/// Cosine from which on a face is square to an axis.
const SQUARE: f64 = 0.99;
/// Cosine from which on a face's normal runs along a bar: it is where the bar ends.
const ALONG: f64 = 0.7;
/// Cosine down to which a bar holds together what cracks across an axis.
const OBLIQUE: f64 = 0.3;
/// Pieces of a bar are looked at together up to so many diameters.
const STRETCH: f64 = 3.0;

/// What the bars about every brick do to its cracks. `ρ` being their share of the concrete, bonded
/// by 1.8 f_ct: l of a bar hands on a crack's tension where 4 · 1.8 ρ l/φ = 1; cracks lie 2 l apart
/// at most, two thirds of that in the mean, so that there are 5.4 ρ/φ of them a metre (MC2010,
/// 7.6.4.4, without cover).
pub(super) fn ties(model: &Model) -> Vec<Ties> {
    let mut ties = vec![Ties::NONE; model.mesh.hexes.len()];
    let bars = || {
        model.steel.iter().filter_map(|steel| match &steel.kind {
            SteelKind::Bar(bar) => Some((steel, bar, 0.0)),
            SteelKind::Stressed(bar, stress) => {
                Some((steel, bar, stress.iter().copied().fold(0.0, f64::max)))
            }
            SteelKind::Tendon(_) => None,
        })
    };
    if bars().next().is_none() {
        return ties;
    }
    let neighbours = model.mesh.neighbours();
    let surface = surface(model);
    // Which points of a brick are reached along each axis, a bit each; and cracks and what is borne
    // at yielding by bars that reach so, over all of the brick.
    let mut reached = vec![[0_u8; 3]; ties.len()];
    let mut holding = vec![[[0.0; 2]; 3]; ties.len()];
    for (steel, bar, stressed) in bars() {
        for stretch in stretches(steel, STRETCH * steel.diameter()) {
            let reach = (REACH * steel.diameter()).min(DEEP * beside(&surface, stretch));
            let zone = Zone::about(model, &neighbours, stretch, reach);
            for (axis, along, square) in (0..3).map(|axis| lengths(stretch, axis)) {
                for part in &zone.0 {
                    let dense = part.share * steel.area / model.mesh.hex_volume(part.hex);
                    let tie = &mut ties[part.hex as usize];
                    let cracks = 5.4 * dense * along / steel.diameter();
                    let yielding = dense * square * bar.yielding;
                    tie.cracks[axis] += cracks;
                    tie.yielding[axis] += yielding;
                    tie.left[axis] += dense * square * (bar.yielding - stressed).max(0.0);
                    tie.stiffness[axis] += dense * square * bar.modulus;
                    if square > OBLIQUE * along {
                        reached[part.hex as usize][axis] |= part.points;
                        holding[part.hex as usize][axis][0] += cracks;
                        holding[part.hex as usize][axis][1] += yielding;
                    }
                }
            }
        }
    }
    for ((tie, points), holding) in ties.iter_mut().zip(reached).zip(holding) {
        tie.reached = points.map(|points| f64::from(points.count_ones()) / 8.0);
        for (axis, [cracks, yielding]) in holding.into_iter().enumerate() {
            if tie.reached[axis] > 0.0 {
                let more = 1.0 / tie.reached[axis] - 1.0;
                tie.cracks[axis] += more * cracks;
                tie.yielding[axis] += more * yielding;
            }
        }
    }
    ties
}

/// All that has nothing behind it, but for planes of symmetry: there concrete goes on.
fn surface(model: &Model) -> Triangles {
    let mesh = &model.mesh;
    let held: HashSet<(u32, u8)> = model.holds.iter().copied().collect();
    let goes_on = |face: HexFace| {
        let normal = mesh.face_middle(face).1.normalize_or_zero();
        let axis = normal.abs().max_position();
        normal.abs()[axis] > SQUARE
            && mesh.face(face).iter().all(|&node| held.contains(&(node, axis as u8)))
    };
    Triangles::of_faces(mesh, mesh.outer_faces().into_iter().filter(|&face| !goes_on(face)))
}

/// How far the surface beside a stretch of a bar is from it, m.
fn beside(surface: &Triangles, stretch: &[Piece]) -> f64 {
    let [from, to] = ends(stretch);
    let along = (to - from).normalize_or_zero();
    surface.distance_where(0.5 * (from + to), |[a, b, c]| {
        (b - a).cross(c - a).normalize_or_zero().dot(along).abs() < ALONG
    })
}

fn ends(stretch: &[Piece]) -> [DVec3; 2] {
    [stretch[0].ends[0], stretch[stretch.len() - 1].ends[1]]
}

/// Pieces in a row, at least one, at most some `length` m long.
fn stretches(steel: &Steel, length: f64) -> Vec<&[Piece]> {
    let mut rest = &steel.pieces[..];
    let mut found = Vec::new();
    while let Some(first) = rest.first() {
        let within = |piece: &&Piece| piece.along[1] - first.along[0] <= length;
        let (now, later) = rest.split_at(rest.iter().take_while(within).count().max(1));
        found.push(now);
        rest = later;
    }
    found
}

/// Σ L |t| and Σ L t² of pieces along an axis, t being their direction.
fn lengths(pieces: &[Piece], axis: usize) -> (usize, f64, f64) {
    let (mut once, mut twice) = (0.0, 0.0);
    for piece in pieces.iter().filter(|piece| piece.length() > 0.0) {
        let along = (piece.ends[1] - piece.ends[0]).abs()[axis];
        once += along;
        twice += along * along / piece.length();
    }
    (axis, once, twice)
}

/// Bricks about a stretch of a bar.
struct Zone(Vec<Part>);

/// A brick, what share of the stretch is its own, and which of its points lie in the zone, a bit
/// each.
struct Part {
    hex: u32,
    share: f64,
    points: u8,
}

impl Zone {
    fn about(
        model: &Model,
        neighbours: &[[Option<u32>; 6]],
        stretch: &[Piece],
        reach: f64,
    ) -> Self {
        let concrete = |hex: u32| {
            let region = model.mesh.hexes[hex as usize].region;
            matches!(model.bodies[region as usize].matter, Matter::Concrete(_))
        };
        let hosts = stretch.iter().map(|piece| piece.host as u32).filter(|&hex| concrete(hex));
        let mut queue: Vec<u32> = hosts.collect();
        let mut seen: BTreeSet<u32> = queue.iter().copied().collect();
        let (mut near, mut whole) = (Vec::new(), 0.0);
        let axis = Axis::along(ends(stretch));
        // As far along the bar as the bricks reach that it lies in.
        let [low, high] = axis.span(queue.iter().map(|&hex| points(model, hex)));
        while let Some(hex) = queue.pop() {
            let within = |point: &&DVec3| {
                let [along, apart] = axis.place(**point);
                apart <= reach && low <= along && along <= high
            };
            let all = points(model, hex);
            let reached = (0..).zip(&all).filter(|(_, point)| within(point));
            let points = reached.fold(0, |points, (k, _)| points | (1_u8 << k));
            if points == 0 {
                continue;
            }
            let share = f64::from(points.count_ones()) * model.mesh.hex_volume(hex);
            whole += share;
            near.push(Part { hex, share, points });
            for next in neighbours[hex as usize].iter().flatten() {
                if concrete(*next) && seen.insert(*next) {
                    queue.push(*next);
                }
            }
        }
        if whole > 0.0 {
            near.iter_mut().for_each(|part| part.share /= whole);
            return Self(near);
        }
        // Bricks much larger than the zone: the bar's own, which holds none of their points.
        let length = stretch.iter().map(Piece::length).sum::<f64>().max(f64::MIN_POSITIVE);
        let own = |piece: &Piece| Part {
            hex: piece.host as u32,
            share: piece.length() / length,
            points: 0,
        };
        Self(stretch.iter().map(own).collect())
    }
}

/// Where the law of a brick is asked.
fn points(model: &Model, hex: u32) -> [DVec3; 8] {
    let corners = model.mesh.corners(hex);
    hex8::GAUSS.map(|natural| {
        hex8::shape(natural).iter().zip(&corners).map(|(n, corner)| *n * *corner).sum()
    })
}

/// A straight stretch of a bar.
struct Axis {
    from: DVec3,
    along: DVec3,
}

impl Axis {
    fn along([from, to]: [DVec3; 2]) -> Self {
        Self { from, along: (to - from).normalize_or_zero() }
    }

    /// How far along it and how far from it a point is, m.
    fn place(&self, point: DVec3) -> [f64; 2] {
        let along = (point - self.from).dot(self.along);
        [along, point.distance(self.from + along * self.along)]
    }

    /// The least and the most that points are along it, and a little more, m.
    fn span(&self, bricks: impl Iterator<Item = [DVec3; 8]>) -> [f64; 2] {
        let [low, high] = bricks
            .flatten()
            .map(|point| self.place(point)[0])
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], along| {
                [low.min(along), high.max(along)]
            });
        let more = 1e-6 * (high - low);
        [low - more, high + more]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        element::embed::embed,
        material::{concrete::Given, law::Setting, steel::Bar},
        mesh::{Locator, block},
        model::Body,
    };

    /// A bar of 16 mm through the middle of a prism of 1 × .6 × .4 m, in bricks of a size.
    fn prism(h: f64) -> Model {
        let lines = |length: f64| {
            let n = (length / h).round().max(1.0);
            (0..=n as usize).map(|k| length * k as f64 / n).collect::<Vec<f64>>()
        };
        let mesh = block(&lines(1.0), &lines(0.6), &lines(0.4), "concrete").unwrap();
        let locator = Locator::new(&mesh);
        let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
        let ends = [DVec3::new(0.0, 0.301, 0.201), DVec3::new(1.0, 0.301, 0.201)];
        let pieces = embed(&ends, find, |hex| mesh.corners(hex as u32)).unwrap();
        let properties = Given { fcm: Some(38e6), ..Given::default() }.complete().unwrap();
        let steel = Steel {
            name: "bar".into(),
            pieces,
            area: 2.01e-4,
            count: 1.0,
            kind: SteelKind::Bar(Bar::new(500e6).unwrap()),
            rust: None,
            gone: Vec::new(),
            bond: None,
            displaces: true,
        };
        let matter = Matter::Concrete(Box::new((properties, Setting::short_term(h))));
        Model {
            mesh,
            bodies: vec![Body { matter, birth: f64::NEG_INFINITY }],
            steel: vec![steel],
            ..Model::default()
        }
    }

    /// Whatever the bricks, cracks are as many as in a zone of 15 diameters about the bar, up to its
    /// edge, and none is counted beyond; bricks larger than that zone have what a bar in all of them
    /// makes.
    #[test]
    fn a_bar_keeps_cracks_apart_about_itself_whatever_the_mesh() {
        let zone = 2.01e-4 / (std::f64::consts::PI * 0.12_f64.powi(2));
        for (h, allowed) in [(0.02, 0.06), (0.05, 0.15)] {
            let model = prism(h);
            let ties = ties(&model);
            let expected = 5.4 * zone / 0.016;
            let mut steel = 0.0;
            for (hex, tie) in ties.iter().enumerate() {
                let centre = model.mesh.centre(hex as u32);
                let off = DVec3::new(0.0, centre.y - 0.301, centre.z - 0.201).length();
                assert_eq!([tie.cracks[1], tie.cracks[2]], [0.0; 2]);
                assert!(off < 0.12 + h || tie.cracks[0] == 0.0, "{off}");
                steel += tie.left[0] / 500e6 * model.mesh.hex_volume(hex as u32);
                let [cracks, wrong] = [tie.cracks[0], (tie.cracks[0] / expected - 1.0).abs()];
                assert!(cracks == 0.0 || wrong < allowed, "{h}: {cracks} {expected}");
                assert!((tie.yielding[0] / 500e6 * 5.4 / 0.016 - cracks).abs() < 1e-3 * expected);
            }
            assert!((steel / 2.01e-4 - 1.0).abs() < 1e-9, "{steel}");
        }
        let whole = ties(&prism(1.0));
        let expected = 5.4 * 2.01e-4 / (0.24 * 0.016);
        assert!((whole[0].cracks[0] / expected - 1.0).abs() < 1e-3);
        // Three bars that are told as one.
        let mut lumped = prism(1.0);
        (lumped.steel[0].area, lumped.steel[0].count) = (3.0 * 2.01e-4, 3.0);
        assert!((ties(&lumped)[0].cracks[0] / (3.0 * expected) - 1.0).abs() < 1e-3);
    }

    /// Half of a prism is no thinner than all of it.
    #[test]
    fn concrete_goes_on_beyond_a_plane_of_symmetry() {
        let mut model = prism(0.1);
        let point = DVec3::new(0.5, 0.01, 0.2);
        assert!((surface(&model).distance(point) - 0.01).abs() < 1e-9);
        let nodes = (0..).zip(&model.mesh.nodes);
        model.holds = nodes.filter(|(_, p)| p.y < 1e-9).map(|(n, _)| (n, 1)).collect();
        assert!((surface(&model).distance(point) - 0.2).abs() < 1e-9);
    }
}
