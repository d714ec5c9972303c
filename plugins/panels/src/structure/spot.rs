//! Places on members that the pointer is on.

use egui::Vec2;
use glam::Vec3;
use intrados_report::surface::Facet;
use intrados_scene::{Camera, Frame, Member, attach::Face};

/// A surface that turns so far towards its member's axis is an end, not a face; cosine.
const END: f32 = 0.7;
/// Farthest that a surface turns from the face that it belongs to, degrees.
const TURNED: f32 = 45.0;

/// A place on the surface of a member.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    /// Index of the member.
    pub(crate) member: usize,
    /// Zone of its axis.
    pub(super) zone: usize,
    /// m.
    pub(super) at: Vec3,
    /// Unit, outwards.
    normal: Vec3,
}

impl Spot {
    /// Where the line of sight through a share of the picture's width and height meets a facet.
    pub(super) fn seen(camera: &Camera, share: Vec2, facet: &Facet) -> Option<Self> {
        let [a, b, c] = facet.corners;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let ([right, up, forward], [hx, hy]) = (camera.frame(), camera.half_extent());
        let sight = forward + (2.0 * share.x - 1.0) * hx * right + (1.0 - 2.0 * share.y) * hy * up;
        let distance = (a - camera.position).dot(normal) / sight.dot(normal);
        let at = camera.position + distance * sight;
        (distance > 0.0 && at.is_finite()).then_some(Self {
            member: facet.member,
            zone: facet.zone,
            at,
            normal,
        })
    }

    /// Share of the member's axis, from its start.
    pub(crate) fn along(&self, frame: Frame) -> f32 {
        let share = (self.at - frame.start).dot(frame.axis) / frame.axis.length_squared();
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The face that it lies on; none: an end, or between two faces.
    pub(crate) fn face(&self, member: &Member) -> Option<Face> {
        let frame = member.frame;
        if self.normal.dot(frame.axis.normalize_or_zero()).abs() > END {
            return None;
        }
        let angle = self.normal.dot(frame.ninety()).atan2(self.normal.dot(frame.zero)).to_degrees();
        let off = |own: f32| ((own - angle + 180.0).rem_euclid(360.0) - 180.0).abs();
        let known = Face::ALL.into_iter();
        let known = known.filter_map(|f| Some((f, off(f.angle_deg(member.kind, frame).ok()?))));
        known.filter(|(_, off)| *off < TURNED).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(f, _)| f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_sight_meets_the_facet_where_it_is_drawn() {
        let camera = Camera {
            name: String::new(),
            position: Vec3::new(0.3, 0.4, 4.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 40.0,
            width: 640,
            height: 400,
            exposure: 0.0,
            lens: None,
        };
        let corners = [Vec3::new(-1.0, -1.0, 0.5), Vec3::new(1.0, -1.0, 0.5), Vec3::Y * 1.2];
        let facet = Facet { corners, member: 3, zone: 2 };
        let at = 0.3 * corners[0] + 0.3 * corners[1] + 0.4 * corners[2];
        let seen = crate::surface::project(&camera, [640, 400], at);
        let share = egui::vec2(seen.x / 640.0, seen.y / 400.0);
        let spot = Spot::seen(&camera, share, &facet).unwrap();
        assert!(spot.at.distance(at) < 1e-4 && spot.member == 3, "{spot:?}");
    }
}
