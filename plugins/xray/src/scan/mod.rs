//! A scan from end to end: a specimen in the scanner of a scene, projections with all that is wrong
//! with them, and slices from which it has been taken out again.
//!
//! [`Protocol`] says how is scanned, [`Rays`] how far every ray goes through what (exact through
//! the voxels), [`Exposure`] what the panel reads: primary photons of the whole spectrum, scatter
//! by Monte Carlo, blur, counting noise, gains that drift. [`restore`] takes it back to attenuation
//! per metre; every correction can be left out, and none knows more than data sheet, drawing and
//! scan ([`Drawing`], [`Standard`]).

mod acquire;
mod expose;
mod known;
mod protocol;
mod rays;
mod restore;
mod scatter_map;
mod steel;

pub use acquire::{Acquisition, Forming, Row};
pub use expose::{Exposure, expose};
pub use known::{Drawing, Standard};
pub use protocol::{Detector, Protocol, Tube};
pub use rays::{Energies, Rays};
pub use restore::{Corrections, Counts, Known, Restored, calmed, restore};
pub use scatter_map::{Behind, ScatterMap, ScatterSettings};
pub use steel::Straight;

use intrados_stage::{Cancelled, Job};

use crate::{
    physics::{Library, PhysicsError},
    recon::ReconError,
    specimen::{
        Specimen, SpecimenError,
        concrete::{
            Concrete, GrowError, Opaque, Painted, Place, Recipe, Subject, of_member, substances,
        },
    },
    volume::Grid,
};

/// Most voxels of a specimen and its slices: 5 bytes each, and 4 more in the slices.
const VOXELS: usize = 1 << 28;

/// Why nothing was scanned.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The scene asks for what cannot be.
    #[error("{0}")]
    Bad(String),
    /// The program's own tables are damaged.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
}

impl From<GrowError> for ScanError {
    fn from(error: GrowError) -> Self {
        match error {
            GrowError::Cancelled(c) => Self::Cancelled(c),
            GrowError::Bad(text) => Self::Bad(text),
        }
    }
}

impl From<Opaque> for ScanError {
    fn from(error: Opaque) -> Self {
        Self::Bad(error.to_string())
    }
}

impl From<ReconError> for ScanError {
    fn from(error: ReconError) -> Self {
        match error {
            ReconError::Cancelled(c) => Self::Cancelled(c),
            ReconError::Bad(text) => Self::Bad(text),
        }
    }
}

impl From<SpecimenError> for ScanError {
    fn from(error: SpecimenError) -> Self {
        Self::Bad(error.to_string())
    }
}

/// What is scanned, grown and painted.
#[derive(Debug, Clone)]
pub struct Target {
    /// The specimen.
    pub concrete: Concrete,
    /// Where it was in the world.
    pub place: Option<Place>,
    /// Its voxels, as high as the beam.
    pub painted: Painted,
    /// Slices to be reconstructed.
    pub slices: Grid,
    /// The truth on the grid of the slices.
    pub truth: Painted,
}

impl Target {
    /// A subject at a place of its axis, as `protocol` sees it; `slices` of them round the scan
    /// plane.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn of_member(
        member: Subject,
        along: f32,
        protocol: &Protocol,
        slices: usize,
        seed: u64,
        job: &Job,
    ) -> Result<Self, ScanError> {
        let (field, voxel) = (protocol.field(), protocol.voxel());
        let (recipe, place) = of_member(member, along, field, protocol.looked_at(), voxel, seed)?;
        Self::grown(&recipe, Some(place), protocol, slices, job)
    }

    /// Any specimen.
    ///
    /// # Errors
    /// [`ScanError`].
    pub(crate) fn grown(
        recipe: &Recipe,
        place: Option<Place>,
        protocol: &Protocol,
        slices: usize,
        job: &Job,
    ) -> Result<Self, ScanError> {
        let (voxel, reach) = (protocol.voxel(), recipe.outline.reach());
        if 2.0 * reach > 1.03 * protocol.field() {
            return Err(ScanError::Bad(format!(
                "the specimen is {:.0} mm across and the scanner sees {:.0} mm: use a wider detector or scan a core",
                2e3 * reach,
                1e3 * protocol.field()
            )));
        }
        // As high as the beam where it leaves the specimen.
        let size = |length: f64| ((length / voxel).ceil() as usize).max(1);
        let half = recipe.outline.half();
        let high = protocol.height(2.0 * reach).min(recipe.height.max(voxel));
        let body = Grid::centred([size(2.0 * half.x), size(2.0 * half.y), size(high)], [voxel; 3]);
        let slices = protocol.slices(reach, slices);
        let count = body.size.iter().map(|&n| n as f64).product::<f64>() + slices.len() as f64;
        if count > VOXELS as f64 {
            return Err(ScanError::Bad(format!(
                "the scan needs {:.1e} voxels; at most {:.1e} are kept in memory: narrow the beam to a slit, or take fewer slices or pixels across",
                count, VOXELS as f64
            )));
        }
        job.relabel("growing concrete");
        let concrete = Concrete::grow(recipe, job)?;
        job.relabel("painting voxels");
        let painted = concrete.paint(&body, job)?;
        let truth = concrete.paint(&slices, job)?;
        Ok(Self { concrete, place, painted, slices, truth })
    }

    /// It as photons wander through it: outline and what rust has left of its bars, in concrete of
    /// its mean density.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn solids(&self, protocol: &Protocol) -> Result<Specimen, ScanError> {
        let recipe = &self.concrete.recipe;
        let (_, rock) = recipe.rock.material();
        let [void, _] = self.painted.voids;
        let air = void as f64 / (self.painted.points as f64).max(1.0) + self.concrete.fine_air;
        let density = (recipe.share * rock + (1.0 - recipe.share) * 1900.0) * (1.0 - air);
        known::solids(
            recipe.outline,
            &recipe.bars,
            density,
            known::half(recipe.outline, recipe.height, protocol),
        )
    }

    /// True attenuation at `kev` of every voxel of the slices, 1/m.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn attenuation(&self, kev: f64) -> Result<Vec<f32>, ScanError> {
        let mu = substances(&self.concrete, &Library::builtin()?)?(kev);
        let full = f64::from(crate::specimen::concrete::FULL);
        Ok(self
            .truth
            .shares
            .iter()
            .map(|s| (0..4).map(|k| f64::from(s[k]) / full * mu[k]).sum::<f64>() as f32)
            .collect())
    }
}

#[cfg(test)]
mod tests;
