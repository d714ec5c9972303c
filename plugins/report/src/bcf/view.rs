//! From where to look at a place of a member.

use glam::Vec3;
use intrados_scene::{Frame, Member};

/// Nearer than this nobody steps, m.
const NEAREST: f32 = 1.5;
/// Crossings that are nearer to each other are one: a ray met the edge of two triangles, m.
const SAME: f32 = 1e-4;

/// A camera: where it stands, and units where it looks and what is up; m, y up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    pub(super) eye: Vec3,
    pub(super) direction: Vec3,
    pub(super) up: Vec3,
}

/// At a piece of the axis (none: all of it) and a side (none: across, at a person's height): a
/// beam from outside, a lining from within, where its axis runs in the air.
pub(super) fn view(
    member: &Member,
    surface: &[[Vec3; 3]],
    along: Option<[f64; 2]>,
    angle_deg: Option<f64>,
) -> View {
    let frame = member.frame;
    let [from, to] = along.unwrap_or([0.0, 1.0]).map(|a| a as f32);
    let middle = frame.point(0.5 * (from + to));
    let out = angle_deg.map_or_else(|| beside(frame), |a| frame.radial(a as f32));
    let out = out.normalize_or(Vec3::Z);
    // Far enough that the piece fits into sixty degrees.
    let back = ((to - from).abs() * frame.axis.length()).max(NEAREST);
    let crossings = crossings(surface, middle, out);
    let (eye, direction) = match crossings.as_slice() {
        [inner, ..] if crossings.len().is_multiple_of(2) => {
            (middle + (inner - back.min(*inner)) * out, out)
        }
        [.., outer] => (middle + (outer + back) * out, -out),
        [] => {
            let [low, high] = member.bounds;
            (0.5 * (low + high) + (high - low).length().max(NEAREST) * out, -out)
        }
    };
    let upright = |v: Vec3| v.reject_from_normalized(direction).try_normalize();
    let level = upright(Vec3::Y).filter(|_| direction.y.abs() < 0.999);
    let up =
        level.or_else(|| upright(frame.axis)).unwrap_or_else(|| direction.any_orthonormal_vector());
    View { eye, direction, up }
}

/// Level, across the axis; where that is upright, the side at which angles begin.
fn beside(frame: Frame) -> Vec3 {
    let side = frame.axis.normalize_or_zero().cross(Vec3::Y);
    if side.length() > 0.1 { side } else { frame.zero }
}

/// How far away a ray crosses a surface, the nearest first (Möller and Trumbore 1997).
fn crossings(surface: &[[Vec3; 3]], start: Vec3, direction: Vec3) -> Vec<f32> {
    const EDGE: f32 = 1e-5;
    let cross = |&[a, b, c]: &[Vec3; 3]| {
        let (ab, ac, from) = (b - a, c - a, start - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let v = from.dot(p) / determinant;
        let q = from.cross(ab);
        let w = direction.dot(q) / determinant;
        let distance = ac.dot(q) / determinant;
        let is_met = v >= -EDGE && w >= -EDGE && v + w <= 1.0 + EDGE && distance > 0.0;
        (is_met && distance.is_finite()).then_some(distance)
    };
    let mut found: Vec<f32> = surface.iter().filter_map(cross).collect();
    found.sort_by(f32::total_cmp);
    found.dedup_by(|b, a| *b - *a < SAME);
    found
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use intrados_scene::MemberKind;

    use super::*;

    /// A tube about z, 10 m long: shells of these radii, of eight flat sides with corners at 0°.
    fn tube(radii: &[f32]) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for &r in radii {
            for k in 0..8 {
                let corner = |k: i32, z: f32| {
                    let (sin, cos) = (TAU * k as f32 / 8.0).sin_cos();
                    Vec3::new(r * cos, r * sin, z)
                };
                let [a, b] = [k, k + 1].map(|k| corner(k, 0.0));
                let [c, d] = [k, k + 1].map(|k| corner(k, 10.0));
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
        triangles
    }

    fn member() -> Member {
        let frame = Frame { start: Vec3::ZERO, axis: 10.0 * Vec3::Z, zero: Vec3::X };
        Member {
            id: "T".into(),
            name: "T".into(),
            kind: MemberKind::Lining,
            concrete: String::new(),
            concrete_assumed: false,
            exposure: None,
            frame,
            bounds: [Vec3::new(-3.0, -3.0, 0.0), Vec3::new(3.0, 3.0, 10.0)],
            volume: 0.0,
            slices: Vec::new(),
            truth: Vec::new(),
        }
    }

    fn near(a: Vec3, b: Vec3) -> bool {
        a.distance(b) < 1e-3
    }

    /// 0° is where two sides of the shell meet: the ray crosses four triangles of each there.
    #[test]
    fn a_lining_is_looked_at_from_within_and_a_solid_from_outside() {
        let at =
            |surface: &[[Vec3; 3]], angle| view(&member(), surface, Some([0.5, 0.5]), Some(angle));
        let lining = at(&tube(&[2.5, 3.0]), 0.0);
        assert!(near(lining.eye, Vec3::new(1.0, 0.0, 5.0)), "{lining:?}");
        assert!(near(lining.direction, Vec3::X) && near(lining.up, Vec3::Y), "{lining:?}");
        let pile = at(&tube(&[3.0]), 0.0);
        assert!(near(pile.eye, Vec3::new(4.5, 0.0, 5.0)), "{pile:?}");
        assert!(near(pile.direction, Vec3::NEG_X), "{pile:?}");
        // Nobody steps beyond the axis; a crown is looked at along the tunnel.
        let narrow = at(&tube(&[1.0, 1.2]), 90.0);
        assert!(near(narrow.eye, Vec3::new(0.0, 0.0, 5.0)), "{narrow:?}");
        assert!(near(narrow.direction, Vec3::Y) && near(narrow.up, Vec3::Z), "{narrow:?}");
    }

    #[test]
    fn a_member_without_a_surface_is_looked_at_by_its_box() {
        let v = view(&member(), &[], None, None);
        assert!(v.direction.is_normalized() && v.up.dot(v.direction).abs() < 1e-6, "{v:?}");
        let middle = Vec3::new(0.0, 0.0, 5.0);
        assert!(near((middle - v.eye).normalize(), v.direction) && v.eye.distance(middle) > 10.0);
    }
}
