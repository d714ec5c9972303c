//! Where the slice that the CT tab shows lies on its member.

use egui::{Color32, Rect, Ui};
use glam::Vec3;
use intrados_scene::Camera;

use crate::{colours, ct::Plane, surface::place};

/// Share of its ink that the outline keeps on surfaces that are turned away.
const BEHIND: f32 = 0.4;

/// The outline of a slice on the surface of its member, cut once for each slice and surface.
#[derive(Debug, Default)]
pub(super) struct SliceOutline {
    /// Hash of the scene, the member, the slice.
    of: Option<(String, usize, Plane)>,
    pieces: Vec<Piece>,
}

/// Where a triangle and the slice meet.
#[derive(Debug, Clone, Copy)]
struct Piece {
    ends: [Vec3; 2],
    /// Of the triangle, outwards.
    normal: Vec3,
}

impl SliceOutline {
    /// Cuts the surface of a member of a scene, where that or the slice is another than before.
    pub(super) fn follow<T: Iterator<Item = [Vec3; 3]>>(
        &mut self,
        (scene, member, plane): (&str, usize, Plane),
        triangles: impl FnOnce() -> T,
    ) {
        let is_same = |(s, m, p): &(String, usize, Plane)| (&**s, *m, *p) == (scene, member, plane);
        if !self.of.as_ref().is_some_and(is_same) {
            self.of = Some((scene.to_owned(), member, plane));
            self.pieces = triangles().filter_map(|triangle| Piece::of(triangle, plane)).collect();
        }
    }

    /// Draws it, paler where the surface is turned away.
    pub(super) fn draw(&self, ui: &Ui, rect: Rect, camera: &Camera) {
        let forward = camera.target - camera.position;
        let is_before = |p: &Vec3| (*p - camera.position).dot(forward) > 0.0;
        let before = self.pieces.iter().filter(|piece| piece.ends.iter().all(is_before));
        let lines: Vec<([egui::Pos2; 2], bool)> = before
            .map(|Piece { ends, normal }| {
                let is_seen = normal.dot(camera.position - ends[0]) > 0.0;
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
}

impl Piece {
    /// None: they do not meet.
    fn of([a, b, c]: [Vec3; 3], plane: Plane) -> Option<Self> {
        let height = |p: Vec3| (p - plane.at).dot(plane.normal);
        let crossing = |(a, b): (Vec3, Vec3)| {
            let (ha, hb) = (height(a), height(b));
            ((ha >= 0.0) != (hb >= 0.0)).then(|| a.lerp(b, ha / (ha - hb)))
        };
        let mut ends = [(a, b), (b, c), (c, a)].into_iter().filter_map(crossing);
        Some(Self { ends: [ends.next()?, ends.next()?], normal: (b - a).cross(c - a) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pillar of a square section, 1 m wide: its four sides, of two triangles each.
    fn pillar() -> Vec<[Vec3; 3]> {
        let corner = |k: usize, y: f32| {
            let [x, z] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]][k % 4];
            Vec3::new(x, y, z)
        };
        let side = |k: usize| {
            let [a, b, c, d] =
                [corner(k, 0.0), corner(k + 1, 0.0), corner(k + 1, 3.0), corner(k, 3.0)];
            [[a, b, c], [c, d, a]]
        };
        (0..4).flat_map(side).collect()
    }

    fn across(y: f32) -> Plane {
        Plane { at: Vec3::Y * y, normal: Vec3::Y }
    }

    #[test]
    fn an_outline_lies_in_the_plane_and_goes_once_round() {
        let sides = pillar();
        let round = |y: f32| {
            let pieces = sides.iter().filter_map(|t| Piece::of(*t, across(y)));
            let lines: Vec<[Vec3; 2]> = pieces.map(|piece| piece.ends).collect();
            assert!(lines.iter().flatten().all(|p| (p.y - y).abs() < 1e-5), "{lines:?}");
            lines.iter().map(|[a, b]| a.distance(*b)).sum::<f32>()
        };
        for y in [0.7, 1.5, 2.9] {
            assert!((round(y) - 4.0).abs() < 1e-4, "{y}: {}", round(y));
        }
        assert!(round(3.2) == 0.0 && round(-0.1) == 0.0);
    }

    #[test]
    fn a_surface_is_cut_once_for_each_slice_and_anew_for_another_surface() {
        let mut outline = SliceOutline::default();
        let mut cuts = 0;
        let mut follow = |scene: &str, member: usize, y: f32| {
            outline.follow((scene, member, across(y)), || {
                cuts += 1;
                pillar().into_iter()
            });
            (cuts, outline.pieces.len())
        };
        assert_eq!(follow("a", 0, 1.5), (1, 8));
        assert_eq!(follow("a", 0, 1.5), (1, 8));
        assert_eq!(follow("a", 0, 1.6).0, 2);
        assert_eq!(follow("a", 1, 1.6).0, 3);
        assert_eq!(follow("b", 1, 1.6).0, 4);
        assert_eq!(follow("b", 1, 9.0), (5, 0));
    }
}
