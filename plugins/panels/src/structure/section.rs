//! A plane that cuts the structure open, so that one can look into it.

use std::sync::Arc;

use egui::Ui;
use glam::Vec3;
use intrados_report::surface::Facet;
use intrados_scene::Camera;

use crate::lang::{slide, term};

/// Directions that planes may be across, by what an engineer calls them.
const AXES: [(&str, Vec3); 3] = [("x", Vec3::X), ("height", Vec3::Y), ("z", Vec3::Z)];

/// How far before the eye drawing begins, of the distance to what is looked at.
const NEAR: f32 = 1e-2;

/// Where the structure is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Section {
    /// Which of the [`AXES`] it is across.
    axis: usize,
    /// How far along the structure, from 0 to 1.
    share: f32,
    /// Whether the side is kept that lies farther along the axis.
    keeps_far: bool,
}

impl Section {
    /// Through a point of a structure of these bounds, across z; what lies before it is taken away.
    pub(super) fn through(at: Vec3, [low, high]: [Vec3; 2]) -> Self {
        let share = (at.z - low.z) / (high.z - low.z);
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 };
        Self { axis: 2, share, keeps_far: false }
    }

    /// Its place on the axis, m, in a structure of these bounds.
    fn level(&self, [low, high]: [Vec3; 2]) -> f32 {
        let axis = self.normal();
        low.dot(axis) + self.share * (high - low).dot(axis)
    }

    fn normal(&self) -> Vec3 {
        AXES.get(self.axis).map_or(Vec3::Z, |a| a.1)
    }

    /// What is left of the facets.
    pub(super) fn cut(&self, facets: &[Facet], bounds: [Vec3; 2]) -> Vec<Facet> {
        let (axis, level) = (self.normal(), self.level(bounds));
        let side = if self.keeps_far { 1.0 } else { -1.0 };
        let above = |p: Vec3| side * (p.dot(axis) - level);
        facets.iter().flat_map(|f| clipped(f, above)).collect()
    }

    /// Its row of tools.
    pub(super) fn tools(&mut self, ui: &mut Ui, bounds: [Vec3; 2]) {
        ui.label(tr!("Cut across"));
        for (index, (name, _)) in AXES.iter().enumerate() {
            if ui.selectable_value(&mut self.axis, index, term(name)).changed() {
                self.share = 0.5;
            }
        }
        let label = ui.label(tr!("at|cut"));
        let axis = self.normal();
        let [from, to] = bounds.map(|b| b.dot(axis));
        let mut level = self.level(bounds);
        ui.spacing_mut().slider_width = 110.0;
        let slider = slide(&mut level, from..=to).suffix(" m").max_decimals(2);
        if ui.add(slider).labelled_by(label.id).changed() && to > from {
            self.share = ((level - from) / (to - from)).clamp(0.0, 1.0);
        }
        if ui.button(tr!("Other side")).clicked() {
            self.keeps_far = !self.keeps_far;
        }
    }
}

/// What of the facets lies before the eye. One that reaches behind it could not be drawn as it is: to
/// who stands in a tunnel the walls would be missing up to the end of the zone that he is in.
pub(super) fn before(facets: Arc<Vec<Facet>>, camera: &Camera) -> Arc<Vec<Facet>> {
    let [_, _, forward] = camera.frame();
    let near = NEAR * (camera.target - camera.position).length();
    let above = |p: Vec3| (p - camera.position).dot(forward) - near;
    if facets.iter().all(|f| f.corners.iter().all(|p| above(*p) >= 0.0)) {
        return facets;
    }
    Arc::new(facets.iter().flat_map(|f| clipped(f, above)).collect())
}

/// The triangles of a facet where `above` is not negative (Sutherland and Hodgman 1974).
fn clipped(facet: &Facet, above: impl Fn(Vec3) -> f32) -> Vec<Facet> {
    let heights = facet.corners.map(&above);
    if heights.iter().all(|h| *h >= 0.0) {
        return vec![*facet];
    }
    let mut kept = Vec::with_capacity(4);
    for k in 0..3 {
        let (a, b) = (facet.corners[k], facet.corners[(k + 1) % 3]);
        let (ha, hb) = (heights[k], heights[(k + 1) % 3]);
        if ha >= 0.0 {
            kept.push(a);
        }
        if ha * hb < 0.0 {
            kept.push(a.lerp(b, ha / (ha - hb)));
        }
    }
    let fan = (1..kept.len().saturating_sub(1)).map(|k| [kept[0], kept[k], kept[k + 1]]);
    fan.map(|corners| Facet { corners, ..*facet }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(facets: &[Facet]) -> f32 {
        let of = |f: &Facet| {
            let [a, b, c] = f.corners;
            0.5 * (b - a).cross(c - a).length()
        };
        facets.iter().map(of).sum()
    }

    #[test]
    fn of_what_reaches_behind_the_eye_that_is_left_which_lies_before_it() {
        let corners =
            [Vec3::new(-1.0, 1.0, -4.0), Vec3::new(1.0, 1.0, -4.0), Vec3::Y + 4.0 * Vec3::Z];
        let facets = Arc::new(vec![Facet { corners, member: 2, zone: 1 }]);
        let from = |z: f32| Camera {
            position: Vec3::Z * z,
            target: Vec3::Z * (z - 1.0),
            ..Camera::overview([Vec3::ZERO, Vec3::ONE])
        };
        assert!(Arc::ptr_eq(&before(Arc::clone(&facets), &from(5.0)), &facets), "all is before it");
        let half = before(Arc::clone(&facets), &from(0.0));
        assert!(half.iter().all(|f| f.corners.iter().all(|p| p.z <= -NEAR + 1e-5)));
        // Of a triangle that is cut in the middle of its height, three quarters are at its foot.
        assert!((area(&half) / area(&facets) - 0.75).abs() < 0.01, "{}", area(&half));
        assert!(before(facets, &from(-5.0)).is_empty());
    }

    #[test]
    fn both_sides_of_a_cut_together_are_the_whole_and_neither_crosses_it() {
        let corners = [Vec3::ZERO, Vec3::new(2.0, 0.0, 1.0), Vec3::new(0.0, 3.0, 1.0)];
        let facets = [Facet { corners, member: 0, zone: 0 }];
        let bounds = crate::surface::bounds(&corners);
        for axis in 0..3 {
            let near = Section { axis, share: 0.3, keeps_far: false };
            let far = Section { keeps_far: true, ..near };
            let [near_side, far_side] = [near, far].map(|s| s.cut(&facets, bounds));
            assert!((area(&near_side) + area(&far_side) - area(&facets)).abs() < 1e-5);
            assert!(!near_side.is_empty() && !far_side.is_empty());
            let (way, level) = (near.normal(), near.level(bounds));
            let heights = |side: &[Facet]| {
                let points: Vec<f32> =
                    side.iter().flat_map(|f| f.corners).map(|p| p.dot(way) - level).collect();
                points
            };
            assert!(heights(&near_side).iter().all(|h| *h < 1e-5));
            assert!(heights(&far_side).iter().all(|h| *h > -1e-5));
        }
    }
}
