//! Closed meshes, all winding outward: extruded grids of cells, ring sectors, tubes along lines.
//! Axis z, lengths in metres.

use std::f32::consts::TAU;

use glam::{Mat3, Vec2, Vec3};

use crate::Mesh;

/// Extrudes the filled cells of a grid along z: any section of upright and level edges. Neighbours
/// share their vertices' places, so the surface has no gaps.
pub(crate) fn cells(
    xs: &[f32],
    ys: &[f32],
    filled: impl Fn(usize, usize) -> bool,
    length: f32,
) -> Mesh {
    let (nx, ny) = (xs.len().saturating_sub(1), ys.len().saturating_sub(1));
    let solid = |i: usize, j: usize| i < nx && j < ny && filled(i, j);
    let mut mesh = Mesh::default();
    let mut face = |corners: [Vec3; 4]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    for (i, x) in xs.windows(2).enumerate() {
        for (j, y) in ys.windows(2).enumerate().filter(|(j, _)| solid(i, *j)) {
            let at = |a: usize, b: usize, z: f32| Vec3::new(x[a], y[b], z);
            face([at(0, 0, length), at(1, 0, length), at(1, 1, length), at(0, 1, length)]);
            face([at(0, 0, 0.0), at(0, 1, 0.0), at(1, 1, 0.0), at(1, 0, 0.0)]);
            // `wrapping_sub` leaves the grid at 0, where nothing is solid.
            let sides = [
                (solid(i, j.wrapping_sub(1)), (0, 0), (1, 0)),
                (solid(i + 1, j), (1, 0), (1, 1)),
                (solid(i, j + 1), (1, 1), (0, 1)),
                (solid(i.wrapping_sub(1), j), (0, 1), (0, 0)),
            ];
            for (_, a, b) in sides.into_iter().filter(|(neighbour, _, _)| !neighbour) {
                face([
                    at(a.0, a.1, 0.0),
                    at(b.0, b.1, 0.0),
                    at(b.0, b.1, length),
                    at(a.0, a.1, length),
                ]);
            }
        }
    }
    mesh
}

/// How many chords a full turn is cut into.
pub(crate) const CHORDS: usize = 96;

/// The body between two radii, two angles (radians) and z = 0 and `length`. `inner` 0 makes it
/// solid; a range of a full turn closes it. Round faces have round normals.
pub(crate) fn ring(inner: f32, outer: f32, from: f32, to: f32, length: f32) -> Mesh {
    let full = to - from >= TAU - 1e-5;
    let n = ((to - from) / TAU * CHORDS as f32).ceil().max(1.0) as usize;
    let direction = |i: usize| {
        // The last direction of a full turn is the first, to the bit.
        let i = if full && i == n { 0 } else { i };
        Vec2::from_angle(from + (to - from) * i as f32 / n as f32)
    };
    let mut mesh = Mesh::default();
    for i in 0..n {
        let (a, b) = (direction(i), direction(i + 1));
        let (na, nb) = (a.extend(0.0), b.extend(0.0));
        let at = |d: Vec2, r: f32, z: f32| (d * r).extend(z);
        quad(
            &mut mesh,
            [at(a, outer, 0.0), at(b, outer, 0.0), at(b, outer, length), at(a, outer, length)],
            [na, nb, nb, na],
        );
        if inner > 0.0 {
            quad(
                &mut mesh,
                [at(b, inner, 0.0), at(a, inner, 0.0), at(a, inner, length), at(b, inner, length)],
                [-nb, -na, -na, -nb],
            );
            quad(
                &mut mesh,
                [
                    at(a, inner, length),
                    at(a, outer, length),
                    at(b, outer, length),
                    at(b, inner, length),
                ],
                [Vec3::Z; 4],
            );
            quad(
                &mut mesh,
                [at(a, inner, 0.0), at(b, inner, 0.0), at(b, outer, 0.0), at(a, outer, 0.0)],
                [Vec3::NEG_Z; 4],
            );
        } else {
            triangle(
                &mut mesh,
                [Vec3::Z * length, at(a, outer, length), at(b, outer, length)],
                Vec3::Z,
            );
            triangle(&mut mesh, [Vec3::ZERO, at(b, outer, 0.0), at(a, outer, 0.0)], Vec3::NEG_Z);
        }
    }
    if !full {
        for (d, sign) in [(direction(0), -1.0), (direction(n), 1.0)] {
            let normal = d.perp().extend(0.0) * sign;
            let at = |r: f32, z: f32| (d * r).extend(z);
            let corners = [at(inner, 0.0), at(outer, 0.0), at(outer, length), at(inner, length)];
            quad(
                &mut mesh,
                if sign < 0.0 { corners } else { [corners[1], corners[0], corners[3], corners[2]] },
                [normal; 4],
            );
        }
    }
    mesh
}

fn quad(mesh: &mut Mesh, corners: [Vec3; 4], normals: [Vec3; 4]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend(normals);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

fn triangle(mesh: &mut Mesh, corners: [Vec3; 3], normal: Vec3) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend([normal; 3]);
    mesh.triangles.push([first, first + 1, first + 2]);
}

/// Sides of a round bar.
pub(crate) const SIDES: usize = 8;

/// A round bar along a line, closed into a ring if `closed`, else with flat ends. Its cross-section
/// is a regular octagon of the circle's area, so that the steel has its weight.
pub(crate) fn tube(line: &[Vec3], diameter: f32, closed: bool) -> Mesh {
    // n/2 sin(2π/n) R² = π r²
    let octagon = (SIDES as f32 / 2.0 * (TAU / SIDES as f32).sin() / std::f32::consts::PI).sqrt();
    let radius = 0.5 * diameter / octagon;
    let n = line.len();
    let mut mesh = Mesh::default();
    let frames = frames(line, closed);
    for (p, frame) in line.iter().zip(&frames) {
        for k in 0..SIDES {
            let out = *frame * Vec2::from_angle(TAU * k as f32 / SIDES as f32).extend(0.0);
            mesh.positions.push(*p + radius * out);
            mesh.normals.push(out.normalize_or_zero());
        }
    }
    let index = |i: usize, k: usize| ((i % n) * SIDES + k % SIDES) as u32;
    for i in 0..if closed { n } else { n.saturating_sub(1) } {
        // A ring's frame comes back turned: join it to the nearest sides.
        let twist = if closed && i + 1 == n { twist(&frames) } else { 0 };
        for k in 0..SIDES {
            let [a, b, c, d] = [
                index(i, k),
                index(i, k + 1),
                index(i + 1, k + 1 + twist),
                index(i + 1, k + twist),
            ];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    if let (false, Some(first), Some(last)) = (closed, frames.first(), frames.last()) {
        for (i, normal) in [(0, -first.z_axis), (n - 1, last.z_axis)] {
            let start = mesh.positions.len() as u32;
            for k in 0..SIDES {
                mesh.positions.push(mesh.positions[index(i, k) as usize]);
                mesh.normals.push(normal);
            }
            for k in 1..SIDES as u32 - 1 {
                let (a, b) = if i == 0 { (k + 1, k) } else { (k, k + 1) };
                mesh.triangles.push([start, start + a, start + b]);
            }
        }
    }
    mesh
}

/// By how many sides the frame at the end of a ring is turned against that at its beginning.
fn twist(frames: &[Mat3]) -> usize {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return 0 };
    let back = carry(*last, first.z_axis);
    let angle = back.x_axis.dot(first.y_axis).atan2(back.x_axis.dot(first.x_axis));
    (angle / TAU * SIDES as f32).round().rem_euclid(SIDES as f32) as usize
}

/// A frame (across, across, along) at each point, carried along without turning about the line.
fn frames(line: &[Vec3], closed: bool) -> Vec<Mat3> {
    let n = line.len();
    let leg = |i: usize| (line[(i + 1) % n] - line[i % n]).normalize_or(Vec3::Z);
    let mut list: Vec<Mat3> = Vec::with_capacity(n);
    for i in 0..n {
        let (before, after) = match (closed, i) {
            (false, 0) => (leg(0), leg(0)),
            (false, _) if i + 1 == n => (leg(i - 1), leg(i - 1)),
            _ => (leg(i + n - 1), leg(i)),
        };
        let along = (before + after).normalize_or(after);
        let frame = match list.last() {
            None => {
                let x = along.any_orthonormal_vector();
                Mat3::from_cols(x, along.cross(x), along)
            }
            Some(last) => carry(*last, along),
        };
        list.push(frame);
    }
    list
}

/// Turns a frame the shortest way so that it points `along`.
fn carry(frame: Mat3, along: Vec3) -> Mat3 {
    let x = (frame.x_axis - frame.x_axis.dot(along) * along)
        .normalize_or(along.any_orthonormal_vector());
    Mat3::from_cols(x, along.cross(x), along)
}

#[cfg(test)]
mod tests {
    use std::{collections::HashMap, f64::consts::PI};

    use super::*;

    /// Every directed edge, by place, has its opposite: closed and consistently wound.
    fn is_closed(mesh: &Mesh) -> bool {
        let mut count: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        for i in 0..mesh.triangles.len() {
            let c = mesh.corners(i).map(key);
            for k in 0..3 {
                *count.entry([c[k], c[(k + 1) % 3]]).or_default() += 1;
                *count.entry([c[(k + 1) % 3], c[k]]).or_default() -= 1;
            }
        }
        !count.is_empty() && count.values().all(|n| *n == 0)
    }

    fn close(found: f64, expected: f64, relative: f64) {
        assert!((found / expected - 1.0).abs() < relative, "{found} is not {expected}");
    }

    #[test]
    fn a_box_girder_has_the_volume_of_its_section() {
        // top slab 6 × .3, bottom slab 3 × .25, two webs .4 × (2 − .55); across x, up y
        let xs = [-3.0, -1.5, -1.1, 1.1, 1.5, 3.0];
        let ys = [0.0, 0.25, 1.7, 2.0];
        let mesh =
            cells(&xs, &ys, |i, j| j == 2 || ((1..4).contains(&i) && (j == 0 || i != 2)), 30.0);
        assert!(is_closed(&mesh));
        close(mesh.volume(), (6.0 * 0.3 + 3.0 * 0.25 + 2.0 * 0.4 * 1.45) * 30.0, 1e-6);
    }

    #[test]
    fn rings_have_the_volume_of_their_polygon_and_nearly_of_their_circle() {
        let n = CHORDS as f64;
        let polygon = 0.5 * n * (2.0 * PI / n).sin();
        for (inner, outer) in [(0.0, 0.25), (2.75, 3.3)] {
            let mesh = ring(inner, outer, 0.3, 0.3 + TAU, 2.0);
            assert!(is_closed(&mesh));
            let squares = f64::from(outer).powi(2) - f64::from(inner).powi(2);
            close(mesh.volume(), polygon * squares * 2.0, 1e-5);
            close(mesh.volume(), PI * squares * 2.0, 1e-3);
            assert!(mesh.normals.iter().all(|m| (m.length() - 1.0).abs() < 1e-5));
        }
        let quarter = ring(2.0, 3.0, 0.0, TAU / 4.0, 1.5);
        assert!(is_closed(&quarter));
        close(quarter.volume(), polygon / 4.0 * 5.0 * 1.5, 1e-5);
    }

    #[test]
    fn shading_normals_point_outward() {
        for mesh in [
            ring(1.0, 2.0, 0.0, 2.0, 1.0),
            ring(0.0, 1.0, 0.0, TAU, 1.0),
            tube(&[Vec3::ZERO, Vec3::Y, Vec3::new(1.0, 2.0, 0.5)], 0.1, false),
        ] {
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                let flat = (b - a).cross(c - a);
                for v in mesh.triangles[i] {
                    assert!(flat.dot(mesh.normals[v as usize]) > 0.0);
                }
            }
        }
    }

    #[test]
    fn bars_have_the_volume_of_a_round_bar() {
        let straight = tube(&[Vec3::ZERO, Vec3::Z * 3.0], 0.025, false);
        assert!(is_closed(&straight));
        close(straight.volume(), PI * 0.0125_f64.powi(2) * 3.0, 1e-5);
        let hoop: Vec<Vec3> =
            (0..64).map(|i| Vec2::from_angle(TAU * i as f32 / 64.0).extend(0.0)).collect();
        let mesh = tube(&hoop, 0.1, true);
        assert!(is_closed(&mesh));
        // Pappus: area times the way of its centre
        close(mesh.volume(), PI * 0.05_f64.powi(2) * 2.0 * PI, 3e-3);
    }

    #[test]
    fn a_bent_ring_out_of_plane_is_closed() {
        let line: Vec<Vec3> = (0..40)
            .map(|i| {
                let t = TAU * i as f32 / 40.0;
                Vec3::new(t.cos(), t.sin(), 0.3 * (2.0 * t).sin())
            })
            .collect();
        let mesh = tube(&line, 0.05, true);
        assert!(is_closed(&mesh) && mesh.volume() > 0.0);
    }
}
