//! What fields are spread over: cells of the specimen, groups of energy, cones around the way to
//! the other end.

use glam::{DVec3, UVec3};
use intrados_transport::Side;

use crate::{march::Lattice, problem::PhotonProblem, scanner::Scanner, specimen::Specimen};

/// Cells along the longest side of the specimen.
const CELLS: f64 = 14.0;
/// Most cells: slabs and plates.
const MOST: usize = 1 << 15;
/// Groups of energy.
pub(crate) const GROUPS: usize = 10;
/// Cosines between the cones.
const CONES: [f64; 7] = [0.985, 0.94, 0.85, 0.7, 0.45, 0.1, -0.4];
/// Cones.
pub(crate) const DIRECTIONS: usize = CONES.len() + 1;
/// Points along each side of a cell by which it is found how much of it is specimen.
const PROBES: u32 = 4;
/// Energies below this are one group, keV.
const LOWEST: f64 = 30.0;
/// Entries of the table that finds a cone.
const FINE: usize = 400;

/// The phase space of one problem in bins. A bin is (cell, group, cone), the cone fastest.
#[derive(Debug, Clone)]
pub struct Domain {
    pub(crate) lattice: Lattice,
    /// m³ of specimen in each cell.
    pub(crate) volume: Vec<f64>,
    /// By side and cell: unit vector to what walks of that side look for.
    axes: [Vec<DVec3>; 2],
    /// Lower ends of the groups but the first, keV.
    edges: Vec<f64>,
    /// Lowest and highest energy, keV.
    pub(crate) energies: [f64; 2],
    cones: Vec<u8>,
}

impl Domain {
    /// That of `problem`.
    #[must_use]
    pub fn new(problem: &PhotonProblem) -> Self {
        let (specimen, scanner) = (problem.specimen, problem.scanner);
        let lattice = lattice(specimen);
        let volume = (0..lattice.len()).map(|i| matter(specimen, &lattice, i)).collect();
        let toward = |target: DVec3| {
            (0..lattice.len()).map(|i| (target - lattice.centre(i)).normalize()).collect()
        };
        let axes = targets(scanner).map(toward);
        let top = problem.energies[1];
        let low = LOWEST.min(0.5 * top);
        let edges = (1..GROUPS).map(|g| low * (top / low).powf(g as f64 / GROUPS as f64)).collect();
        let cone = |i: usize| {
            let c = 2.0 * (i as f64 + 0.5) / FINE as f64 - 1.0;
            CONES.iter().filter(|&&edge| c < edge).count() as u8
        };
        Self {
            lattice,
            volume,
            axes,
            edges,
            energies: problem.energies,
            cones: (0..FINE).map(cone).collect(),
        }
    }

    /// Number of bins.
    pub(crate) fn bins(&self) -> usize {
        self.lattice.len() * GROUPS * DIRECTIONS
    }

    /// Group of an energy.
    #[inline]
    pub(crate) fn group(&self, kev: f64) -> usize {
        self.edges.iter().filter(|&&edge| kev >= edge).count()
    }

    /// Cone of a walk's way in a cell.
    #[inline]
    pub(crate) fn cone(&self, side: Side, cell: usize, way: DVec3) -> usize {
        let c = self.axes[side as usize][cell].dot(way);
        usize::from(
            self.cones[((c + 1.0) * (0.5 * FINE as f64)).clamp(0.0, FINE as f64 - 1.0) as usize],
        )
    }

    /// Bin of a walk.
    #[inline]
    pub(crate) fn bin(&self, side: Side, cell: usize, kev: f64, way: DVec3) -> usize {
        self.bin_of(side, cell, self.group(kev), way)
    }

    /// The same of a group.
    #[inline]
    pub(crate) fn bin_of(&self, side: Side, cell: usize, group: usize, way: DVec3) -> usize {
        (cell * GROUPS + group) * DIRECTIONS + self.cone(side, cell, way)
    }

    /// Lowest and highest energy of a group, keV.
    pub(crate) fn range(&self, group: usize) -> [f64; 2] {
        let low = if group == 0 { self.energies[0] } else { self.edges[group - 1] };
        [low, self.edges.get(group).copied().unwrap_or(self.energies[1])]
    }

    /// keV·sr of the bins of one cell. The cones are those of the table that finds them.
    pub(crate) fn extents(&self) -> Vec<f64> {
        let mut angle = [0.0; DIRECTIONS];
        self.cones
            .iter()
            .for_each(|&cone| angle[cone as usize] += 4.0 * std::f64::consts::PI / FINE as f64);
        let group = |g| {
            let [low, high] = self.range(g);
            angle.map(|sr| (high - low) * sr)
        };
        (0..GROUPS).flat_map(group).collect()
    }

    /// Cosine of a cone's middle.
    pub(crate) fn cosine(cone: usize) -> f64 {
        let high = if cone == 0 { 1.0 } else { CONES[cone - 1] };
        0.5 * (high + CONES.get(cone).copied().unwrap_or(-1.0))
    }
}

/// What walks of each side look for: the tube, the middle of the panel.
pub(crate) fn targets(scanner: &Scanner) -> [DVec3; 2] {
    [scanner.source, scanner.panel.centre]
}

fn lattice(specimen: &Specimen) -> Lattice {
    let [low, high] = specimen.bounds();
    let size = high - low;
    let mut edge = size.max_element() / CELLS;
    loop {
        let cells =
            (size / edge).map(|n| (n - 1e-6).ceil().max(1.0)).as_uvec3().max(UVec3::splat(2));
        let lattice = Lattice { origin: low, spacing: size / cells.as_dvec3(), cells };
        if lattice.len() <= MOST {
            return lattice;
        }
        edge *= 1.2;
    }
}

/// m³ of a cell that are specimen.
fn matter(specimen: &Specimen, lattice: &Lattice, cell: usize) -> f64 {
    let corner = lattice.corner(cell);
    let probe = |i: u32| {
        let at =
            UVec3::new(i % PROBES, i / PROBES % PROBES, i / (PROBES * PROBES)).as_dvec3() + 0.5;
        specimen.label(corner + lattice.spacing * at / f64::from(PROBES)).is_some()
    };
    let all = PROBES * PROBES * PROBES;
    let there = (0..all).filter(|&i| probe(i)).count();
    lattice.spacing.element_product() * there as f64 / f64::from(all)
}
