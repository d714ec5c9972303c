//! Faces of members by name.

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Frame, MemberKind};

/// A face of a member. Upright members have `Front` (angle 0), `Right`, `Back`, `Left`, as one sees
/// them who stands before the front; lying ones `Top`, `Bottom`, `Front` and `Back` (a beam along
/// +x has its front towards +z); tunnels and pipes `Crown`, `Invert`, `Left` and `Right`, as one
/// sees them who looks along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Face {
    /// Of a column, towards angle 0; of a beam along +x, towards +z.
    Front,
    /// Opposite of the front.
    Back,
    /// Of a column, right of its front; of a tunnel, to the right who looks along the axis.
    Right,
    /// Opposite of it.
    Left,
    /// Of what lies.
    Top,
    /// Opposite of it.
    Bottom,
    /// Of a tunnel, its highest line.
    Crown,
    /// Opposite of it.
    Invert,
}

/// Why a face has no angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FaceError {
    /// The member has faces of other names.
    #[error(
        "{} is no face of {of}: choose {}, {}, {} or {}, or give angle_deg",
        face.name(), has[0].name(), has[1].name(), has[2].name(), has[3].name()
    )]
    NoFace {
        /// The one that was asked for.
        face: Face,
        /// What the member is, for people.
        of: &'static str,
        /// Those that it has.
        has: [Face; 4],
    },
    /// A shaft has no crown.
    #[error("the member's axis is upright, so that it has no crown: give angle_deg")]
    NoCrown,
}

/// How names of faces are given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sort {
    /// What stands.
    Upright,
    /// What lies.
    Lying,
    /// Tunnels and pipes.
    Tunnel,
}

impl Sort {
    pub(crate) fn of(kind: MemberKind, frame: Frame) -> Self {
        match kind {
            MemberKind::Lining | MemberKind::Segment | MemberKind::Pipe => Self::Tunnel,
            _ if frame.is_upright() => Self::Upright,
            _ => Self::Lying,
        }
    }

    /// What has them, for people.
    fn what(self) -> &'static str {
        match self {
            Self::Upright => "what stands",
            Self::Lying => "what lies",
            Self::Tunnel => "a tunnel",
        }
    }

    fn faces(self) -> [Face; 4] {
        match self {
            Self::Upright => [Face::Front, Face::Right, Face::Back, Face::Left],
            Self::Lying => [Face::Top, Face::Front, Face::Bottom, Face::Back],
            Self::Tunnel => [Face::Crown, Face::Right, Face::Invert, Face::Left],
        }
    }
}

impl Face {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Front,
        Self::Back,
        Self::Right,
        Self::Left,
        Self::Top,
        Self::Bottom,
        Self::Crown,
        Self::Invert,
    ];

    /// Its name, as files write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Back => "Back",
            Self::Right => "Right",
            Self::Left => "Left",
            Self::Top => "Top",
            Self::Bottom => "Bottom",
            Self::Crown => "Crown",
            Self::Invert => "Invert",
        }
    }

    /// The face of that name, whatever the case of its letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|face| face.name().eq_ignore_ascii_case(name))
    }

    /// The face of a member that has this angle about its axis, within half a degree.
    pub(crate) fn at(angle_deg: f32, kind: MemberKind, frame: Frame) -> Option<Self> {
        let off = |own: f32| (own - angle_deg + 180.0).rem_euclid(360.0) - 180.0;
        let is_there = |face: &Self| face.angle_deg(kind, frame).is_ok_and(|a| off(a).abs() < 0.5);
        Sort::of(kind, frame).faces().into_iter().find(is_there)
    }

    /// Its angle about the axis of a member, degrees, 0 to 360.
    ///
    /// # Errors
    /// The member has no face of this name.
    pub fn angle_deg(self, kind: MemberKind, frame: Frame) -> Result<f32, FaceError> {
        let sort = Sort::of(kind, frame);
        let axis = frame.axis.normalize_or_zero();
        let up = (Vec3::Y - Vec3::Y.dot(axis) * axis).normalize_or_zero();
        // Names are given in turns of a quarter: from the front of what stands towards angle 90,
        // from the top of what lies towards axis × top.
        let (first, next) = match sort {
            Sort::Upright => (frame.zero, frame.ninety()),
            Sort::Lying | Sort::Tunnel => (up, axis.cross(up)),
        };
        let Some(turn) = sort.faces().iter().position(|face| *face == self) else {
            return Err(FaceError::NoFace { face: self, of: sort.what(), has: sort.faces() });
        };
        if first == Vec3::ZERO {
            return Err(FaceError::NoCrown);
        }
        let way = [first, next, -first, -next][turn];
        let degrees = way.dot(frame.ninety()).atan2(way.dot(frame.zero)).to_degrees();
        // Directions in single precision are right to some hundred-thousandths of a degree.
        Ok(((degrees * 100.0).round() / 100.0).rem_euclid(360.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of angles at the head of `file`, and the same members of models that lie along
    /// another axis.
    #[test]
    fn faces_have_the_angles_of_the_members_frame() {
        let frame = |axis, zero| Frame { start: Vec3::ZERO, axis, zero };
        let column = (MemberKind::Column, frame(3.0 * Vec3::Y, Vec3::Z));
        let beam = (MemberKind::Beam, frame(6.0 * Vec3::X, Vec3::Y));
        let slab = (MemberKind::Slab, frame(8.0 * Vec3::Z, Vec3::X));
        let tunnel = (MemberKind::Lining, frame(20.0 * Vec3::Z, Vec3::X));
        for ((kind, frame), face, angle) in [
            (column, Face::Front, 0.0),
            (column, Face::Right, 90.0),
            (column, Face::Back, 180.0),
            (column, Face::Left, 270.0),
            (beam, Face::Top, 0.0),
            (beam, Face::Front, 90.0),
            (beam, Face::Bottom, 180.0),
            (beam, Face::Back, 270.0),
            (slab, Face::Top, 90.0),
            (slab, Face::Bottom, 270.0),
            (tunnel, Face::Crown, 90.0),
            (tunnel, Face::Invert, 270.0),
            // Who looks along +z has +x to the left.
            (tunnel, Face::Left, 0.0),
            (tunnel, Face::Right, 180.0),
        ] {
            assert_eq!(face.angle_deg(kind, frame).unwrap(), angle, "{face:?} of {kind:?}");
        }
        for ((kind, frame), face, right) in [
            (column, Face::Crown, "Left"),
            (beam, Face::Left, "Bottom"),
            (tunnel, Face::Top, "Invert"),
        ] {
            let message = face.angle_deg(kind, frame).unwrap_err().to_string();
            assert!(message.contains(right), "{message}");
        }
        let shaft = frame(20.0 * Vec3::Y, Vec3::X);
        assert_eq!(Face::Crown.angle_deg(MemberKind::Lining, shaft), Err(FaceError::NoCrown));
    }
}
