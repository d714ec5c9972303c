//! What a surface's shape says: the box along its own faces, a round section, a tube.

use glam::DVec3;

use super::source::Surface;
use crate::{Frame, MemberKind};

/// A box along the faces of a body.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Box3 {
    pub(super) centre: DVec3,
    /// Orthonormal, right-handed.
    pub(super) unit: [DVec3; 3],
    /// Along each of them, m.
    pub(super) size: [f64; 3],
}

/// A body between two round faces about one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tube {
    /// Middle of its first end.
    pub(super) start: DVec3,
    /// To the middle of its other end.
    pub(super) axis: DVec3,
    /// Radii, m.
    pub(super) inner: f64,
    pub(super) outer: f64,
}

/// Directions that differ by less count as one: the cosine of some 2.6 degrees.
const SAME: f64 = 0.999;
/// Directions are at right angles within some 3 degrees.
const ACROSS: f64 = 0.05;
/// How many directions are looked at.
const MOST_DIRECTIONS: usize = 400;

/// Directions of a surface's faces with their areas, the largest first; a face and its opposite
/// are one.
fn directions(surface: &Surface) -> Vec<(DVec3, f64)> {
    let mut found: Vec<(DVec3, f64)> = Vec::new();
    for [a, b, c] in surface.faces() {
        let normal = 0.5 * (b - a).cross(c - a);
        let area = normal.length();
        let Some(n) = normal.try_normalize() else { continue };
        match found.iter().position(|(d, _)| d.dot(n).abs() > SAME) {
            Some(known) => found[known].1 += area,
            None if found.len() < MOST_DIRECTIONS => found.push((n, area)),
            None => {}
        }
    }
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found
}

/// So much smaller the box along the longest extent must be than that along faces, to be the better
/// one.
const TIGHTER: f64 = 0.9;

/// The box of a body: along its faces, or along its longest extent where that is the tighter one, as
/// of what tapers or is bent in plan, whose largest faces run askew.
pub(super) fn boxed(surface: &Surface) -> Option<Box3> {
    let of_faces = boxed_by_faces(surface)?;
    let volume = |b: &Box3| b.size.iter().product::<f64>();
    let of_extent = boxed_by_extent(surface);
    let tighter = of_extent.filter(|b| volume(b) < TIGHTER * volume(&of_faces));
    Some(tighter.unwrap_or(of_faces))
}

/// The box along the direction in which a surface extends most, upright across it.
fn boxed_by_extent(surface: &Surface) -> Option<Box3> {
    let (mut area, mut sum) = (0.0, DVec3::ZERO);
    let origin = surface.points.first().copied()?;
    let mut moments = glam::DMat3::ZERO;
    for corners in surface.faces() {
        let [a, b, c] = corners.map(|p| p - origin);
        let own = 0.5 * (b - a).cross(c - a).length();
        let s = a + b + c;
        area += own;
        sum += own * s / 3.0;
        // ∫ x xᵀ over a triangle.
        for v in [a, b, c, s] {
            moments += glam::DMat3::from_cols(v * v.x, v * v.y, v * v.z) * (own / 12.0);
        }
    }
    let mean = sum / area.max(1e-12);
    moments -= glam::DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z) * area;
    let mut along = DVec3::new(1.0, 0.9, 0.8);
    for _ in 0..100 {
        along = (moments * along).try_normalize()?;
    }
    let up = if along.y.abs() < 0.9 { DVec3::Y } else { DVec3::Z };
    framed(surface, along, up.reject_from(along).try_normalize()?)
}

/// The box along two directions and the one across both.
fn framed(surface: &Surface, x: DVec3, y: DVec3) -> Option<Box3> {
    let unit = [x, y, x.cross(y)];
    let spans = unit.map(|u| surface.span(u));
    let middle = |i: usize| 0.5 * (spans[i][0] + spans[i][1]) * unit[i];
    let centre = middle(0) + middle(1) + middle(2);
    centre.is_finite().then(|| Box3 { centre, unit, size: spans.map(|[l, h]| h - l) })
}

/// Sections across a member that are looked at.
const SECTIONS: usize = 9;

/// Height and width of a member's section, m, towards its zero and across that: those of the section
/// in the middle of all by size, since slope along the axis is no depth.
pub(super) fn across(surface: &Surface, frame: Frame) -> [f64; 2] {
    let axis = frame.axis.as_dvec3();
    let along = axis.normalize_or_zero();
    let ways = [frame.zero, frame.ninety()].map(|v| v.as_dvec3());
    let [mut heights, mut widths]: [Vec<f64>; 2] = Default::default();
    for k in 0..SECTIONS {
        let at = frame.start.as_dvec3() + axis * ((k as f64 + 0.5) / SECTIONS as f64);
        let mut spans = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for corners in surface.faces() {
            let off = corners.map(|p| (p - at).dot(along));
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                if (off[i] > 0.0) != (off[j] > 0.0) {
                    let p = corners[i].lerp(corners[j], off[i] / (off[i] - off[j]));
                    for (span, way) in spans.iter_mut().zip(ways) {
                        *span = [span[0].min(p.dot(way)), span[1].max(p.dot(way))];
                    }
                }
            }
        }
        if spans[0][1] > spans[0][0] && spans[1][1] > spans[1][0] {
            heights.push(spans[0][1] - spans[0][0]);
            widths.push(spans[1][1] - spans[1][0]);
        }
    }
    let whole = ways.map(|way| surface.span(way)).map(|[low, high]| high - low);
    [(heights, whole[0]), (widths, whole[1])].map(|(mut found, whole)| {
        found.sort_by(f64::total_cmp);
        found.get(found.len() / 2).copied().unwrap_or(whole)
    })
}

/// Mean depth of a plate, m, of its volume over the area that it covers seen along `way`: crossfall
/// is no depth.
pub(super) fn mean_depth(surface: &Surface, way: DVec3) -> Option<f64> {
    let seen = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).dot(way).abs();
    let area = 0.5 * surface.faces().map(seen).sum::<f64>();
    let depth = surface.volume() / area;
    (depth > 0.0 && depth.is_finite()).then_some(depth)
}

/// The box along the largest faces that stand at right angles to each other; upright where nothing
/// speaks against it.
fn boxed_by_faces(surface: &Surface) -> Option<Box3> {
    let found = directions(surface);
    let first = found.first()?.0;
    let second = found.iter().map(|d| d.0).find(|d| d.dot(first).abs() < ACROSS);
    let second = second.unwrap_or_else(|| if first.y.abs() < 0.7 { DVec3::Y } else { DVec3::X });
    // The world's own axes where they differ by rounding alone.
    let tidy = |v: DVec3| {
        let near = DVec3::AXES.into_iter().find(|a| v.dot(*a).abs() > 1.0 - 1e-9);
        near.unwrap_or(v)
    };
    let x = tidy(first);
    framed(surface, x, tidy(second.reject_from(x).try_normalize()?))
}

impl Box3 {
    /// The frame of a member of this kind in the box: upright members have their axis up and their
    /// zero nearest to +z; all others lie along their longest measure that is not the most upright,
    /// with their zero up. A pile stands; a footing that is wider than high lies, as its bars do.
    pub(super) fn frame(&self, kind: MemberKind) -> Frame {
        let upright = |i: &usize| self.unit[*i].y.abs();
        let up = (0..3).max_by(|a, b| upright(a).total_cmp(&upright(b))).unwrap_or(1);
        let towards = |i: usize, way: DVec3| {
            if self.unit[i].dot(way) < 0.0 { -self.unit[i] } else { self.unit[i] }
        };
        let [p, q] = [(up + 1) % 3, (up + 2) % 3];
        let lies = self.size[up] < self.size[p].max(self.size[q]);
        let (along, axis, zero) = match kind {
            MemberKind::Column | MemberKind::Wall | MemberKind::Footing
                if !(kind == MemberKind::Footing && lies) =>
            {
                let front = if self.unit[p].z.abs() > self.unit[q].z.abs() { p } else { q };
                (up, towards(up, DVec3::Y), towards(front, DVec3::Z))
            }
            _ => {
                let long = if self.size[p] >= self.size[q] { p } else { q };
                (long, towards(long, DVec3::new(1.0, 0.0, 0.999)), towards(up, DVec3::Y))
            }
        };
        let length = self.size[along];
        Frame {
            start: (self.centre - 0.5 * length * axis).as_vec3(),
            axis: (length * axis).as_vec3(),
            zero: zero.as_vec3(),
        }
    }
}

/// Least share of all directions about the axis that a tube's faces must look into.
const AROUND: usize = 10;
/// How far corners may lie from the two radii, of the wall's thickness.
const ROUGH: f64 = 0.02;

/// The tube that a surface is, if it is one: all corners on two radii about one axis, all around,
/// ends at right angles to it. Chords of n sides lie within r (1 − cos π/n) of their circle, so
/// that corners and not faces are asked.
pub(super) fn tube(surface: &Surface) -> Option<Tube> {
    let found = directions(surface);
    // The axis is the direction of the flat ends: all other faces stand across it.
    let flat = found.iter().map(|d| d.0).find(|axis| {
        let across = found.iter().filter(|d| d.0.dot(*axis).abs() < ACROSS).count();
        across + 1 == found.len() && across >= AROUND / 2
    })?;
    let [low, high] = surface.span(flat);
    let end = |at: f64| {
        let near = |p: &DVec3| (p.dot(flat) - at).abs() < 1e-3 * (high - low).max(1e-9);
        circle(&surface.points.iter().copied().filter(near).collect::<Vec<DVec3>>(), flat)
    };
    // Ends are often plumb where the tunnel falls: the axis leads from one middle to the other.
    let (start, axis) = (end(low)?, end(high)? - end(low)?);
    let along = axis.try_normalize()?;
    let radius = |p: DVec3| (p - start).reject_from(along).length();
    let radii: Vec<f64> = surface.faces().flatten().map(radius).collect();
    let [inner, outer] =
        radii.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], &r| [l.min(r), h.max(r)]);
    let wall = outer - inner;
    let on_a_face = |r: &f64| (r - inner).min(outer - r) < ROUGH * wall;
    let is_tube = inner > 0.2 * outer && radii.iter().all(on_a_face);
    let volume = std::f64::consts::PI * (outer * outer - inner * inner) * axis.length();
    // Few sides take some per cent off; a half ring takes half.
    (is_tube && (0.85..=1.01).contains(&(surface.volume() / volume))).then_some(Tube {
        start,
        axis,
        inner,
        outer,
    })
}

/// Centre of the circle through points of one plane: the middle of their extent in two directions,
/// refined by the mean of the outermost ones.
fn circle(points: &[DVec3], axis: DVec3) -> Option<DVec3> {
    let first = *points.first()?;
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    // Kåsa (1976): least squares of x² + y² + D x + E y + F over the outermost points.
    let local: Vec<(f64, f64)> =
        points.iter().map(|p| ((*p - first).dot(x), (*p - first).dot(y))).collect();
    let count = local.len() as f64;
    let (mx, my) = local.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / count, s.1 + p.1 / count));
    let reach = |p: &(f64, f64)| (p.0 - mx).hypot(p.1 - my);
    let far = local.iter().map(reach).fold(0.0, f64::max);
    let outer = local.iter().filter(|p| reach(p) > 0.8 * far);
    let mut m = glam::DMat3::ZERO;
    let mut v = DVec3::ZERO;
    for &(px, py) in outer {
        let row = DVec3::new(px - mx, py - my, 1.0);
        m += glam::DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        v -= row * ((px - mx).powi(2) + (py - my).powi(2));
    }
    if m.determinant().abs() < 1e-12 {
        return None;
    }
    let solved = m.inverse() * v;
    Some(first + (mx - 0.5 * solved.x) * x + (my - 0.5 * solved.y) * y)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::Mesh;

    fn surface(mesh: &Mesh, turn: DQuat, at: DVec3) -> Surface {
        Surface {
            points: mesh.positions.iter().map(|p| turn * p.as_dvec3() + at).collect(),
            triangles: mesh.triangles.clone(),
        }
    }

    #[test]
    fn a_turned_beam_has_its_box_along_its_own_faces() {
        let mesh = crate::parametric::solid::cells(&[-0.3, 0.3], &[-0.2, 0.2], |_, _| true, 8.0);
        let turn = DQuat::from_rotation_y(0.5) * DQuat::from_rotation_x(0.1);
        let found = boxed(&surface(&mesh, turn, DVec3::new(1e5, 20.0, -3e4))).unwrap();
        let mut sizes = found.size;
        sizes.sort_by(f64::total_cmp);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-5;
        assert!(near(sizes[0], 0.4) && near(sizes[1], 0.6) && near(sizes[2], 8.0), "{sizes:?}");
        assert!(
            (DMat3::from_cols_array_2d(&found.unit.map(|u| u.to_array())).determinant() - 1.0)
                .abs()
                < 1e-9
        );
        let frame = found.frame(MemberKind::Beam);
        assert!((frame.axis.length() - 8.0).abs() < 1e-4 && frame.zero.y > 0.9, "{frame:?}");
    }

    /// A girder whose web tapers from .6 to 1.6 m over 30 m and rises by 4 %: its largest faces run
    /// askew, and its slope is no depth.
    #[test]
    fn a_tapered_girder_in_a_slope_is_as_wide_as_its_section() {
        let mesh = crate::parametric::solid::cells(&[-0.5, 0.5], &[-0.7, 0.7], |_, _| true, 30.0);
        let mut girder = surface(&mesh, DQuat::IDENTITY, DVec3::ZERO);
        let z = girder.span(DVec3::Z);
        for p in &mut girder.points {
            let along = (p.z - z[0]) / (z[1] - z[0]);
            p.x = if p.x > 0.0 { 0.3 + along } else { -0.3 };
            p.y += 0.04 * p.z;
        }
        let found = boxed(&girder).unwrap();
        let frame = found.frame(MemberKind::Beam);
        let [height, width] = across(&girder, frame);
        assert!((height - 1.4).abs() < 0.03 && (width - 1.1).abs() < 0.06, "{height} {width}");
        let slope = frame.axis.y.abs() / frame.axis.length();
        assert!((slope - 0.04).abs() < 0.01, "{slope}");
    }

    /// A deck 10 m wide and .3 m thick that falls by 2.5 % to both sides.
    #[test]
    fn crossfall_is_no_depth() {
        let mesh =
            crate::parametric::solid::cells(&[-5.0, 0.0, 5.0], &[0.0, 0.3], |_, _| true, 20.0);
        let mut deck = surface(&mesh, DQuat::IDENTITY, DVec3::ZERO);
        deck.points.iter_mut().for_each(|p| p.y -= 0.025 * p.x.abs());
        let depth = mean_depth(&deck, DVec3::Y).unwrap();
        assert!((depth - 0.3).abs() < 1e-6, "{depth}");
    }

    #[test]
    fn a_footing_lies_and_a_pile_stands() {
        let frame = |size: [f64; 3]| {
            let unit = [DVec3::X, DVec3::Y, DVec3::Z];
            Box3 { centre: DVec3::ZERO, unit, size }.frame(MemberKind::Footing)
        };
        let footing = frame([2.1, 0.7, 5.0]);
        assert!(footing.axis.z.abs() > 4.9 && footing.zero.y > 0.9, "{footing:?}");
        let pile = frame([0.6, 9.0, 0.6]);
        assert!(pile.axis.y > 8.9, "{pile:?}");
    }

    #[test]
    fn a_tunnel_is_a_tube_and_a_column_or_half_of_one_is_none() {
        let ring = |inner: f32, to: f32| crate::parametric::solid::ring(inner, 3.0, 0.0, to, 20.0);
        let turn = DQuat::from_rotation_y(1.0) * DQuat::from_rotation_x(0.05);
        let at = DVec3::new(5.0, -30.0, 7.0);
        let tau = std::f32::consts::TAU;
        let found = tube(&surface(&ring(2.7, tau), turn, at)).unwrap();
        assert!((found.inner - 2.7).abs() < 1e-3 && (found.outer - 3.0).abs() < 1e-3, "{found:?}");
        assert!(
            (found.axis.length() - 20.0).abs() < 1e-3 && found.start.distance(at) < 1e-2
                || (found.start + found.axis).distance(at) < 1e-2,
            "{found:?}"
        );
        // Falls by two per cent between plumb ends.
        let mut falling = surface(&ring(2.7, tau), DQuat::IDENTITY, at);
        falling.points.iter_mut().for_each(|p| p.y -= 0.02 * (p.z - at.z));
        let found = tube(&falling).unwrap();
        assert!((found.axis.y.abs() / found.axis.z.abs() - 0.02).abs() < 1e-4, "{found:?}");
        assert!((found.inner - 2.7).abs() < 0.01, "{found:?}");
        assert_eq!(tube(&surface(&ring(2.7, 0.5 * tau), turn, at)), None);
        assert_eq!(tube(&surface(&ring(0.0, tau), turn, at)), None);
    }
}
