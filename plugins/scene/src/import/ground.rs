//! Which members stand on the ground: footings and tunnels do, and slabs that are called so; columns
//! and walls do where nothing reaches up to their foot; what lies does where it is the lowest of all.
//! The others are carried.

use glam::Vec3;

use crate::MemberKind;

/// Slack in plan and in height, m: mortar beds, bearings, and models that were drawn by hand.
const SLACK: f32 = 0.05;
/// How far above the lowest point of all a slab on the ground may lie, m.
const LOWEST: f32 = 0.5;

/// A member as far as it matters here.
#[derive(Debug, Clone, Copy)]
pub(super) struct Standing {
    pub(super) kind: MemberKind,
    /// Corners of its bounding box, m.
    pub(super) bounds: [Vec3; 2],
    /// Whether its axis is level.
    pub(super) is_level: bool,
    /// Whether it is a tunnel.
    pub(super) is_tube: bool,
    /// Whether it is called what lies on the ground.
    pub(super) is_grounded: bool,
}

/// For each member, whether it stands on the ground.
pub(super) fn on_ground(members: &[Standing]) -> Vec<bool> {
    let lowest = members.iter().map(|m| m.bounds[0].y).fold(f32::INFINITY, f32::min);
    let carried = |m: &Standing| members.iter().any(|other| reaches(other, m));
    members
        .iter()
        .map(|m| match m.kind {
            _ if m.is_tube || m.is_grounded => true,
            MemberKind::Footing => true,
            _ if m.is_level => m.bounds[0].y < lowest + LOWEST && !carried(m),
            _ => !carried(m),
        })
        .collect()
}

/// Whether `other` begins below the foot of `m` and reaches up to it.
pub(super) fn reaches(other: &Standing, m: &Standing) -> bool {
    let foot = m.bounds[0].y;
    let overlap = |i: usize| {
        other.bounds[0][i] < m.bounds[1][i] + SLACK && other.bounds[1][i] > m.bounds[0][i] - SLACK
    };
    other.bounds[0].y < foot - SLACK && other.bounds[1].y > foot - SLACK && overlap(0) && overlap(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(kind: MemberKind, from: [f32; 3], to: [f32; 3], is_level: bool) -> Standing {
        Standing {
            kind,
            bounds: [from.into(), to.into()],
            is_level,
            is_tube: false,
            is_grounded: false,
        }
    }

    /// A footing and a column on it, a column on the bare slope beside, a beam over both, a slab on
    /// the beam, and one that lies on the ground.
    #[test]
    fn the_ground_holds_what_nothing_else_does() {
        use MemberKind::{Beam, Column, Footing, Slab};
        let members = [
            standing(Footing, [-1.0, -0.6, -1.0], [1.0, 0.0, 1.0], true),
            standing(Column, [-0.2, 0.0, -0.2], [0.2, 3.0, 0.2], false),
            standing(Column, [4.8, 0.5, -0.2], [5.2, 3.0, 0.2], false),
            standing(Beam, [-0.2, 3.0, -0.2], [5.2, 3.5, 0.2], true),
            standing(Slab, [-0.2, 3.5, -2.0], [5.2, 3.7, 2.0], true),
            standing(Slab, [10.0, -0.5, -2.0], [15.0, -0.3, 2.0], true),
        ];
        assert_eq!(on_ground(&members), [true, false, true, false, false, true]);
        // An approach slab lies on the fill, though it ends on a beam.
        let approach = Standing { is_grounded: true, ..members[4] };
        assert!(on_ground(&[&members[..4], &[approach]].concat())[4]);
        // Without its footing the first column stands on the ground.
        assert!(on_ground(&members[1..])[0]);
    }
}
