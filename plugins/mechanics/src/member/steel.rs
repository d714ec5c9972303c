//! Bars, stirrups and tendons in the concrete.

use std::f64::consts::PI;

use glam::DVec3;
use intrados_scene::{
    file::Prestress,
    parametric::{SteelLine, steel_lines},
};

use super::{Draft, MemberError};
use crate::{
    element::embed::embed,
    material::{
        DAY,
        steel::{Bar, Relaxation, Strand},
    },
    mesh::Locator,
    model::{Steel, SteelKind, Tendon},
    prestress::{self, Jack, Path},
};

/// Yield stress of reinforcement, Pa: B500.
const YIELD: f64 = 500e6;

impl Draft<'_> {
    /// Lays all steel.
    pub(super) fn lay_steel(&mut self) -> Result<(), MemberError> {
        let mesh = std::mem::take(&mut self.model.mesh);
        let locator = Locator::new(&mesh);
        let laid: Result<Vec<Steel>, MemberError> =
            steel_lines(self.member).into_iter().map(|line| self.lay(&line, &locator, |h| mesh.corners(h as u32))).collect();
        drop(locator);
        self.model.mesh = mesh;
        self.model.steel = laid?;
        Ok(())
    }

    fn lay(&self, line: &SteelLine, locator: &Locator, corners: impl Fn(usize) -> [DVec3; 8]) -> Result<Steel, MemberError> {
        let (id, name) = (self.id(), line.name.clone());
        // Round members are meshed by chords: what lies outside of them by less than a hair's breadth is drawn in.
        let points: Vec<DVec3> = line.line.iter().map(|p| self.inward(p.as_dvec3())).collect();
        let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
        let embedded = embed(&points, find, corners);
        let pieces = embedded.map_err(|source| MemberError::Embed { id: id.clone(), line: name.clone(), source })?;
        let Some(stressing) = &line.prestress else {
            let bar = Bar::new(YIELD).map_err(|source| MemberError::Material { id, source })?;
            return Ok(Steel { name, pieces, area: 0.25 * PI * f64::from(line.diameter).powi(2), kind: SteelKind::Bar(bar) });
        };
        let tendon = jacked(stressing);
        let failed = |source| MemberError::Prestress { id: id.clone(), line: name.clone(), source };
        let path = Path::curve(&points.iter().map(|p| p.to_array()).collect::<Vec<_>>()).map_err(failed)?;
        let stations = tendon.stressed(&path).map_err(failed)?;
        let at: Vec<(f64, f64)> = stations.iter().map(|s| (s.length, s.stress())).collect();
        let stress = pieces
            .iter()
            .map(|piece| crate::model::interpolate(&at, 0.5 * (piece.along[0] + piece.along[1])).unwrap_or(tendon.jacking))
            .collect();
        let kind = SteelKind::Tendon(Tendon {
            strand: tendon.strand,
            at: f64::from(stressing.at_days) * DAY,
            jacking: tendon.jacking,
            stress,
            bonded: stressing.bonded,
        });
        Ok(Steel { name, pieces, area: tendon.area, kind })
    }

    /// The point, drawn towards the axis a little.
    fn inward(&self, p: DVec3) -> DVec3 {
        let mut local = self.axes.local(p);
        // Ends of tendons lie in the end faces.
        local.z = local.z.clamp(1e-6 * self.axes.length, (1.0 - 1e-6) * self.axes.length);
        self.axes.world(local)
    }
}

/// A tendon of the scene as one that is jacked.
fn jacked(p: &Prestress) -> prestress::Tendon {
    prestress::Tendon {
        strand: Strand {
            relaxation: match p.relaxation_class {
                1 => Relaxation::Ordinary,
                3 => Relaxation::Bars,
                _ => Relaxation::Low,
            },
            ..Strand::default()
        },
        area: f64::from(p.strands) * f64::from(p.strand_mm2) * 1e-6,
        jacking: f64::from(p.stress_mpa) * 1e6,
        friction: f64::from(p.friction),
        wobble: f64::from(p.wobble_per_m),
        slip: f64::from(p.slip_mm) / 1000.0,
        jack: if p.both_ends { Jack::Both } else { Jack::First },
    }
}
