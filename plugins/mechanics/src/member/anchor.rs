//! Anchorages of tendons: what they press against the concrete with, and the spirals behind.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{Draft, MemberError};
use crate::{
    element::embed::embed,
    material::steel::Bar,
    mesh::Locator,
    model::{Matter, Plate, Steel, SteelKind, Tendon},
};

/// Pressure under a plate at jacking, over the mean strength of the concrete then. EN 1992-1-1
/// (6.63) allows √(A_c1/A_c0) of what concrete bears: this is so where concrete reaches beyond the
/// plate by a twentieth of its edge on every side. Approvals of anchorages go from about 1 upwards,
/// by the spirals that they prescribe.
const BEARING: f64 = 1.1;
/// Force that the spiral's steel takes in each direction at its design strength, over that of the
/// jack: .15 P γ with γ = 1.2 (EN 1992-2 J.104.2).
const BURSTING: f64 = 0.15 * 1.2;
/// Length of the zone that the spiral holds together, over the plate's edge (EN 1992-2 J.104.2).
const ZONE: f64 = 1.2;
/// Diameter of the spiral, over the plate's edge.
const WIDE: f64 = 0.9;
/// From one turn of the spiral to the next, m.
const PITCH: f64 = 0.05;
/// Points a turn.
const TURN: usize = 12;
/// Of spirals, Pa: yield stress, and what it is designed with.
const YIELD: [f64; 2] = [500e6, 500e6 / 1.15];
/// How near to an end of the axis, as a share of it, a tendon ends in that end.
pub(super) const END: f64 = 1e-4;

/// An end of a tendon.
struct End {
    at: DVec3,
    /// Unit, into the concrete.
    inward: DVec3,
    /// Unit: edges of the plate.
    edges: [DVec3; 2],
    /// Whether it is in an end of the member: there is concrete on one side of it only.
    outside: bool,
    /// m.
    side: f64,
}

impl Draft<'_> {
    /// Gives tendons their plates and answers their spirals. `edges` are those of plates that the
    /// scene knows, m, one a line.
    pub(super) fn anchor(
        &mut self,
        steel: &mut [Steel],
        edges: &[Option<f64>],
        locator: &Locator,
    ) -> Result<Vec<Steel>, MemberError> {
        let mut spirals = Vec::new();
        let (mut loose, mut unheld) = (0, 0);
        for (steel, &edge) in steel.iter_mut().zip(edges) {
            let Steel { name, pieces, area, kind: SteelKind::Tendon(tendon), .. } = steel else {
                continue;
            };
            let force = *area * tendon.jacking;
            for which in 0..2 {
                let Some(piece) = (if which == 0 { pieces.first() } else { pieces.last() }) else {
                    continue;
                };
                if !self.is_tunnel() && self.is_mirrored(piece.ends[which]) {
                    // It runs on: nothing is anchored there.
                    continue;
                }
                let along = (piece.ends[1] - piece.ends[0]).normalize_or_zero();
                let end = self.end(
                    piece.ends[which],
                    if which == 0 { along } else { -along },
                    edge,
                    tendon,
                    force,
                    piece.host,
                    locator,
                );
                tendon.plates[which] = Plate::square(locator, end.at, end.edges, end.side);
                loose += usize::from(tendon.plates[which].is_none());
                if end.outside && tendon.plates[which].is_some() {
                    let name = format!("spiral {} of {name}", which + 1);
                    match self.spiral(name, &end, force, locator)? {
                        Some(spiral) => spirals.push(spiral),
                        None => unheld += 1,
                    }
                }
            }
        }
        for (count, what) in [
            (loose, "have no room for their plate: their force enters at points"),
            (unheld, "have no room for a spiral"),
        ] {
            if count > 0 {
                self.notes.push(format!("{count} ends of tendons {what}"));
            }
        }
        Ok(spirals)
    }

    #[allow(clippy::too_many_arguments, reason = "all of it is known where an end is")]
    fn end(
        &self,
        at: DVec3,
        inward: DVec3,
        edge: Option<f64>,
        tendon: &Tendon,
        force: f64,
        host: usize,
        locator: &Locator,
    ) -> End {
        let [zero, ninety, axis] = self.axes.unit;
        let place = self.axes.local(at).z / self.axes.length;
        let outside = !self.is_tunnel() && !(END..=1.0 - END).contains(&place);
        // In an end of a member plates lie in its face; elsewhere they are square to the tendon.
        let edges = if outside {
            [zero, ninety]
        } else {
            let across = if inward.dot(axis).abs() < 0.9 { axis } else { zero };
            let first = across.reject_from(inward).normalize_or_zero();
            [first, inward.cross(first)]
        };
        let body = &self.model.bodies[locator.mesh().hexes[host].region as usize];
        let strength = match &body.matter {
            Matter::Concrete(mix) => mix.0.at(tendon.at - body.birth).fcm,
            _ => f64::INFINITY,
        };
        End {
            at,
            inward,
            edges,
            outside,
            side: edge.unwrap_or_else(|| (force / (BEARING * strength)).sqrt()),
        }
    }

    /// The spiral behind a plate; none: it does not lie in the concrete.
    fn spiral(
        &self,
        name: String,
        end: &End,
        force: f64,
        locator: &Locator,
    ) -> Result<Option<Steel>, MemberError> {
        let turns = (ZONE * end.side / PITCH).ceil().max(1.0);
        let count = turns as usize * TURN;
        let point = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / TURN as f64).sin_cos();
            let around = 0.5 * WIDE * end.side * (cos * end.edges[0] + sin * end.edges[1]);
            end.at + (0.5 + k as f64 / TURN as f64) * PITCH * end.inward + around
        };
        let points: Vec<DVec3> = (0..=count).map(point).collect();
        let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
        let Ok(pieces) = embed(&points, find, |h| locator.mesh().corners(h as u32)) else {
            return Ok(None);
        };
        let bar =
            Bar::new(YIELD[0]).map_err(|source| MemberError::Material { id: self.id(), source })?;
        // A plane through the tendon cuts every turn twice.
        let area = BURSTING * force / YIELD[1] / (2.0 * turns);
        Ok(Some(Steel {
            name,
            pieces,
            area,
            count: 1.0,
            kind: SteelKind::Bar(bar),
            rust: None,
            gone: Vec::new(),
            bond: None,
            displaces: true,
        }))
    }
}
