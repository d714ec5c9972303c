//! Where the slice that the CT tab shows lies on its member.

use egui::{Color32, Rect, Ui};
use glam::Vec3;
use intrados_scene::Camera;

use crate::{colours, ct::Plane, surface::place};

/// Share of its ink that the outline keeps on surfaces that are turned away.
const BEHIND: f32 = 0.4;

/// Draws the outline of the plane on the surface of a member, paler where that is turned away.
pub(super) fn draw(
    ui: &Ui,
    rect: Rect,
    camera: &Camera,
    triangles: impl Iterator<Item = [Vec3; 3]>,
    plane: Plane,
) {
    let forward = camera.target - camera.position;
    let is_before = |p: &Vec3| (*p - camera.position).dot(forward) > 0.0;
    let lines: Vec<([egui::Pos2; 2], bool)> = triangles
        .filter_map(|triangle| Some((triangle, met(triangle, plane)?)))
        .filter(|(_, ends)| ends.iter().all(is_before))
        .map(|([a, b, c], ends)| {
            let is_seen = (b - a).cross(c - a).dot(camera.position - a) > 0.0;
            (ends.map(|p| place(camera, rect, p)), is_seen)
        })
        .collect();
    let painter = ui.painter().with_clip_rect(rect);
    for (width, ink) in [(4.0, Color32::from_black_alpha(150)), (2.0, colours::SELECTED)] {
        for (ends, is_seen) in &lines {
            let ink = if *is_seen { ink } else { ink.gamma_multiply(BEHIND) };
            painter.line_segment(*ends, (width, ink));
        }
    }
}

/// Where a triangle and the plane meet.
fn met(triangle: [Vec3; 3], plane: Plane) -> Option<[Vec3; 2]> {
    let height = |p: Vec3| (p - plane.at).dot(plane.normal);
    let crossing = |(a, b): (Vec3, Vec3)| {
        let (ha, hb) = (height(a), height(b));
        ((ha >= 0.0) != (hb >= 0.0)).then(|| a.lerp(b, ha / (ha - hb)))
    };
    let [a, b, c] = triangle;
    let mut ends = [(a, b), (b, c), (c, a)].into_iter().filter_map(crossing);
    Some([ends.next()?, ends.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_lies_in_the_plane_and_goes_once_round() {
        // A pillar of a square section, 1 m wide: its four sides, of two triangles each.
        let corner = |k: usize, y: f32| {
            let [x, z] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]][k % 4];
            Vec3::new(x, y, z)
        };
        let sides: Vec<[Vec3; 3]> = (0..4)
            .flat_map(|k| {
                let [a, b, c, d] =
                    [corner(k, 0.0), corner(k + 1, 0.0), corner(k + 1, 3.0), corner(k, 3.0)];
                [[a, b, c], [c, d, a]]
            })
            .collect();
        let round = |y: f32| {
            let plane = Plane { at: Vec3::Y * y, normal: Vec3::Y };
            let lines: Vec<[Vec3; 2]> = sides.iter().filter_map(|t| met(*t, plane)).collect();
            assert!(lines.iter().flatten().all(|p| (p.y - y).abs() < 1e-5), "{lines:?}");
            lines.iter().map(|[a, b]| a.distance(*b)).sum::<f32>()
        };
        for y in [0.7, 1.5, 2.9] {
            assert!((round(y) - 4.0).abs() < 1e-4, "{y}: {}", round(y));
        }
        assert!(round(3.2) == 0.0 && round(-0.1) == 0.0);
    }
}
