//! Anchorages: a tendon that ends in a bearing plate pulls at the plate, not at the point of the
//! concrete where its line ends.
//!
//! The plate presses evenly, so its end of the tendon moves with the mean displacement of the
//! concrete under it: u = Σ w_n u_n over the nodes there. In the piece that ends there, u takes the
//! place of the displacement of the point, in strain and, transposed, in force: stiffness stays
//! symmetric, and force and moment are those of the anchor exactly as long as Σ w_n = 1 and Σ w_n
//! x_n is the point itself.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Failure, Steel, SteelKind, System, Trial, structure::Moved};
use crate::{element::hex8, mesh::Locator};

/// Points along an edge of a plate where its pressure is taken up; even, so that every point has
/// one opposite.
const POINTS: usize = 16;

/// A bearing plate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plate {
    /// Nodes of the concrete that it presses on, with their shares: these sum to 1, and the mean
    /// place with these weights is the end of the tendon.
    pub shares: Vec<(u32, f64)>,
    /// Its edge, m.
    pub side: f64,
}

impl Plate {
    /// A square plate around the end of a tendon, its edges along two unit vectors. Points that lie
    /// in no concrete are left out, and so are those opposite; `None` if less than half of the
    /// plate has concrete under it.
    #[must_use]
    pub(crate) fn square(
        locator: &Locator,
        end: DVec3,
        edges: [DVec3; 2],
        side: f64,
    ) -> Option<Self> {
        let mut shares = BTreeMap::<u32, f64>::new();
        let mut count = 0_usize;
        for k in 0..POINTS * POINTS / 2 {
            let share = |i: usize| (i as f64 + 0.5) / POINTS as f64 - 0.5;
            let away = side * (share(k / POINTS) * edges[0] + share(k % POINTS) * edges[1]);
            let (Some(here), Some(there)) =
                (locator.locate(end + away), locator.locate(end - away))
            else {
                continue;
            };
            count += 2;
            for host in [here, there] {
                let nodes = &locator.mesh().hexes[host.hex as usize].nodes;
                nodes
                    .iter()
                    .zip(hex8::shape(host.natural))
                    .for_each(|(n, shape)| *shares.entry(*n).or_default() += shape);
            }
        }
        let even = 1.0 / count as f64;
        (2 * count >= POINTS * POINTS).then(|| Self {
            shares: shares.into_iter().map(|(n, share)| (n, share * even)).collect(),
            side,
        })
    }
}

impl Steel {
    /// Plates that a piece ends in: which of its ends, and the plate.
    fn plates(&self, piece: usize) -> impl Iterator<Item = (usize, &Plate)> {
        let plates =
            if let SteelKind::Tendon(tendon) = &self.kind { Some(&tendon.plates) } else { None };
        let ends = [piece == 0, piece + 1 == self.pieces.len()];
        plates
            .into_iter()
            .flatten()
            .enumerate()
            .filter(move |(end, _)| ends[*end])
            .filter_map(|(end, plate)| Some((end, plate.as_ref()?)))
    }

    /// Whether a piece does as the brick does that it lies in: it neither slips nor ends in a plate.
    pub(super) fn is_bonded(&self, piece: usize) -> bool {
        self.bond.is_none() && self.plates(piece).next().is_none()
    }

    /// Nodes under the plates that a piece ends in.
    pub(super) fn under(&self, piece: usize) -> impl Iterator<Item = u32> {
        self.plates(piece).flat_map(|(_, plate)| plate.shares.iter().map(|share| share.0))
    }
}

/// How an end counts in what a piece gets longer.
const SIGN: [f64; 2] = [-1.0, 1.0];

impl System<'_> {
    /// How much more a piece strains than its host, because plates move otherwise than the points
    /// where it ends.
    pub(super) fn seated(&self, bar: usize, piece: usize, moved: &Moved, x: &[f64]) -> f64 {
        let steel = &self.model.steel[bar];
        let of = &steel.pieces[piece];
        let along = (of.ends[1] - of.ends[0]).normalize_or_zero();
        let mesh = &self.model.mesh;
        let pulled = |node: u32| along.dot(moved.node(mesh.nodes[node as usize], node, x));
        let host = &mesh.hexes[of.host].nodes;
        let more = steel.plates(piece).map(|(end, plate)| {
            let point: f64 = host
                .iter()
                .zip(hex8::shape(of.natural[end]))
                .map(|(n, shape)| shape * pulled(*n))
                .sum();
            SIGN[end]
                * (plate.shares.iter().map(|&(n, share)| share * pulled(n)).sum::<f64>() - point)
        });
        more.sum::<f64>() / of.length()
    }

    /// The same of a whole tendon without bond, in the mean; nothing for other steel.
    pub(super) fn seated_mean(&self, bar: usize, moved: impl Fn(usize) -> Moved, x: &[f64]) -> f64 {
        let pieces = &self.model.steel[bar].pieces;
        let Some(last) = pieces.len().checked_sub(1) else { return 0.0 };
        let ends = if last == 0 { 0..1 } else { 0..2 };
        let longer: f64 = ends
            .map(|end| end * last)
            .map(|piece| {
                pieces[piece].length() * self.seated(bar, piece, &moved(pieces[piece].host), x)
            })
            .sum();
        longer / pieces.iter().map(crate::element::rod::Piece::length).sum::<f64>()
    }

    /// Stiffness and force of a piece that ends in a plate, on its host and the nodes under the
    /// plate; false: it does not.
    pub(super) fn anchored(
        &self,
        [bar, piece]: [usize; 2],
        moved: &Moved,
        mean: f64,
        trial: Trial,
        x: &[f64],
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), Failure> {
        let steel = &self.model.steel[bar];
        let of = &steel.pieces[piece];
        let mut row = of
            .strain_row()
            .map_err(|source| Failure::Element { element: steel.name.clone(), source })?
            .to_vec();
        let strain = row.iter().zip(&moved.local).map(|(r, u)| r * u).sum::<f64>()
            + self.seated(bar, piece, moved, x);
        let along = (of.ends[1] - of.ends[0]).normalize_or_zero();
        for (end, plate) in steel.plates(piece) {
            let share =
                |weight: f64| (0..3).map(move |c| SIGN[end] * weight * along[c] / of.length());
            // Away from the point, onto the plate.
            let point = hex8::shape(of.natural[end]).into_iter().flat_map(share);
            row.iter_mut().zip(point).for_each(|(row, point)| *row -= point);
            row.extend(plate.shares.iter().flat_map(|&(_, weight)| share(weight)));
        }
        let before = &trial.history.steel[bar][piece];
        let (stress, tangent, _) =
            steel.answer(piece, strain, mean, before, [trial.history.time, trial.time]);
        let volume = steel.area_at(piece, trial.time) * of.length();
        for (i, of_i) in row.iter().enumerate() {
            f[i] = volume * stress * of_i;
            row.iter()
                .enumerate()
                .for_each(|(j, of_j)| k[i * row.len() + j] = volume * tangent * of_i * of_j);
        }
        Ok(())
    }
}
