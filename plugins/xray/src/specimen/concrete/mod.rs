//! Concrete of one's own: grains, pores, cracks, steel as bodies with closed forms, so that the
//! truth is exact, painted onto voxels of any size.
//!
//! A [`Recipe`] says what there is; [`Concrete::grow`] places it, the largest bodies first, none
//! overlapping; [`Concrete::paint`] makes voxels of it, each by 64 points, so that a voxel on a
//! surface holds its parts. Everything is a function of the recipe and its seed. The specimen's z
//! axis is what a scanner turns about, the scan plane is z = 0.

mod body;
mod crack;
mod honeycomb;
mod member;
mod paint;
mod place;
mod recipe;
mod steel;
mod told;

pub use body::{Body, Kind};
pub use crack::{Path, Relief};
pub use member::{Opaque, Place, Subject, of_member, wander};
pub use paint::{FULL, Label, OUTSIDE, Painted, substances};
pub(crate) use paint::{RUST, STEEL};
pub use recipe::{Air, Bar, Crack, Honeycomb, Outline, Recipe, Rock, Spall};

use intrados_stage::{Cancelled, Job};

use crack::Surface;
use honeycomb::Nest;
use steel::Rod;

/// A specimen whose every body is known.
#[derive(Debug, Clone)]
pub struct Concrete {
    /// What it was made from.
    pub recipe: Recipe,
    /// Grains of aggregate and pores, the largest first.
    pub bodies: Vec<Body>,
    /// Volume share of the grains.
    pub aggregate: f64,
    /// Volume share of pores too small to be placed; it thins the mortar.
    pub fine_air: f64,
    surfaces: Vec<Surface>,
    nests: Vec<Nest>,
    rods: Vec<Rod>,
}

impl Concrete {
    /// Places everything.
    ///
    /// # Errors
    /// [`GrowError`].
    pub fn grow(recipe: &Recipe, job: &Job) -> Result<Self, GrowError> {
        recipe.check().map_err(GrowError::Bad)?;
        let rods: Vec<Rod> =
            recipe.bars.iter().enumerate().map(|(i, bar)| Rod::new(bar, recipe.seed, i)).collect();
        let mut placed = place::place(recipe, &rods, job)?;
        let nests = recipe
            .honeycombs
            .iter()
            .enumerate()
            .map(|(i, h)| Nest::new(recipe, h, i, &placed.bodies, &rods))
            .collect();
        let surfaces = recipe
            .cracks
            .iter()
            .enumerate()
            .map(|(i, c)| Surface::new(recipe, c, i, &placed.bodies))
            .collect();
        placed.bodies.shrink_to_fit();
        let (bodies, aggregate, fine_air) = (placed.bodies, placed.aggregate, placed.fine_air);
        Ok(Self { recipe: recipe.clone(), bodies, aggregate, fine_air, surfaces, nests, rods })
    }

    /// The pores, honeycomb apart.
    pub fn pores(&self) -> impl Iterator<Item = &Body> {
        self.bodies.iter().filter(|b| b.kind == Kind::Pore)
    }
}

/// Why nothing was grown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The recipe cannot be followed.
    #[error("{0}")]
    Bad(String),
}

#[cfg(test)]
mod tests;
