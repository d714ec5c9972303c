//! Where two members touch: what of the surface of one lies within a tolerance of the other, or
//! inside it.

use glam::DVec3;

use super::solid::{Sample, Solid, distance, meets, samples};

/// How near surfaces count as touching: this share of the smaller member's shortest side, within
/// bounds, m.
const NEAR: f64 = 0.03;
const NEAREST: f64 = 5e-3;
const FARTHEST: f64 = 0.05;
/// Faces meet where so much of what is near does, over what does not.
const FACES: f64 = 0.5;
/// Samples of what may touch.
const SAMPLES: usize = 1200;

/// Where two members touch.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub(super) samples: Vec<Sample>,
    /// Middle of it, m.
    pub(super) middle: DVec3,
    /// Unit, from the first member to the second.
    pub(super) normal: DVec3,
}

/// How near two bodies must be to touch, m.
pub(super) fn tolerance(a: &Solid, b: &Solid) -> f64 {
    let shortest =
        |s: &Solid| s.directions().map(|d| s.extent(d)).into_iter().fold(f64::MAX, f64::min);
    (NEAR * shortest(a).min(shortest(b))).clamp(NEAREST, FARTHEST)
}

/// Where two bodies touch, if they do.
pub(super) fn patch(a: &Solid, b: &Solid, reach: f64) -> Option<Patch> {
    let room = [a.bounds[0].max(b.bounds[0]) - reach, a.bounds[1].min(b.bounds[1]) + reach];
    if room[0].cmpgt(room[1]).any() {
        return None;
    }
    let mut both = [of(a, b, room, reach), of(b, a, room, reach)];
    // Where faces meet, what is beside them within the tolerance is no contact.
    let area = |wanted: bool| {
        let all = both.iter().flatten().filter(|(_, meets)| *meets == wanted);
        all.map(|(s, _)| s.area).sum::<f64>()
    };
    if area(true) > FACES * area(false) {
        both.iter_mut().for_each(|samples| samples.retain(|(_, meets)| *meets));
    }
    let [from_a, from_b] = both.map(|all| all.into_iter().map(|s| s.0).collect::<Vec<_>>());
    let outward: DVec3 = from_a.iter().map(|s| s.area * s.normal).sum::<DVec3>()
        - from_b.iter().map(|s| s.area * s.normal).sum::<DVec3>();
    // What pierces another shows all round: then the way from one to the other tells.
    let way = 0.5 * (b.bounds[0] + b.bounds[1] - a.bounds[0] - a.bounds[1]);
    let samples = [from_a, from_b].concat();
    let area: f64 = samples.iter().map(|s| s.area).sum();
    if area <= 0.0 {
        return None;
    }
    let middle = samples.iter().map(|s| s.area / area * s.at).sum();
    let normal = if outward.length() > 0.1 * area { outward } else { way }.normalize_or(DVec3::Y);
    Some(Patch { samples, middle, normal })
}

/// What of the surface of `a` within a box is near `b` or inside it, and whether a face of `b` meets
/// it there.
fn of(a: &Solid, b: &Solid, room: [DVec3; 2], reach: f64) -> Vec<(Sample, bool)> {
    let others = b.near([room[0] - reach, room[1] + reach]);
    let touches = |s: Sample| {
        if others.iter().any(|t| meets(&s, t, reach)) {
            return Some((s, true));
        }
        let is_near = others.iter().any(|t| distance(s.at, t) <= reach) || b.holds(s.at);
        is_near.then_some((s, false))
    };
    samples(&a.near(room), room, SAMPLES).into_iter().filter_map(touches).collect()
}

/// The pair of places where two bodies that do not touch are nearest, as a patch of one sample.
pub(super) fn gap(a: &Solid, b: &Solid) -> Option<Patch> {
    let (of_a, of_b) = (a.samples(SAMPLES), b.samples(SAMPLES));
    let pairs = of_a.iter().flat_map(|p| of_b.iter().map(move |q| (p, q)));
    let (p, q) =
        pairs.min_by(|x, y| x.0.at.distance(x.1.at).total_cmp(&y.0.at.distance(y.1.at)))?;
    let middle = 0.5 * (p.at + q.at);
    let normal = (q.at - p.at).normalize_or(p.normal);
    Some(Patch { samples: vec![Sample { at: middle, ..*p }], middle, normal })
}

#[cfg(test)]
mod tests {
    use super::{super::solid::cuboid, *};

    #[test]
    fn what_stands_on_another_touches_it_over_its_foot() {
        let slab = cuboid(DVec3::ZERO, DVec3::new(6.0, 0.2, 4.0));
        let column = cuboid(DVec3::new(1.0, -3.0, 1.0), DVec3::new(1.4, 0.0, 1.3));
        let found = patch(&column, &slab, tolerance(&column, &slab)).unwrap();
        let foot = DVec3::new(1.2, 0.0, 1.15);
        assert!(found.middle.distance(foot) < 0.02 && found.normal.dot(DVec3::Y) > 0.99);
        let away = cuboid(DVec3::new(1.0, -3.0, 1.0), DVec3::new(1.4, -0.03, 1.3));
        assert!(patch(&away, &slab, tolerance(&away, &slab)).is_none());
        let near = gap(&away, &slab).unwrap();
        assert!((near.middle.y + 0.015).abs() < 1e-2 && near.middle.x > 0.9);
    }

    #[test]
    fn what_pierces_another_touches_it_too() {
        let column = cuboid(DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.5, 3.0, 0.5));
        let beam = cuboid(DVec3::new(0.2, 1.0, 0.1), DVec3::new(4.0, 1.5, 0.4));
        let found = patch(&beam, &column, tolerance(&beam, &column)).unwrap();
        assert!((found.middle.x - 0.35).abs() < 0.1, "{:?}", found.middle);
    }
}
