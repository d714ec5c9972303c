//! What may be known of a scan when it is corrected: the data sheets of tube and panel
//! ([`Protocol`]), the drawing of what is scanned, and the scan itself.
//!
//! What made the readings stays out: concrete is ordinary concrete, whatever was cast; bars are as
//! they were laid, whatever rust has left; the tube is what its maker says. A correction that knew
//! the specimen would be praised for it (an inverse crime: Colton and Kress 1998).

use glam::DVec3;
use intrados_stage::Job;

use super::{Energies, Protocol, ScanError, Straight};
use crate::{
    physics::{Library, Matter, Model},
    recon::{ReconError, Window},
    specimen::{
        Shape, Solid, Specimen, Substance,
        concrete::{Bar, Outline, Recipe, Subject, of_member},
    },
    volume::{Grid, Sinogram},
};

/// Ordinary concrete, kg/m³.
const CONCRETE: f64 = 2300.0;
/// Steel, kg/m³.
const STEEL: f64 = 7850.0;
/// How far beyond the beam photons wander and come back, m.
const BEYOND: f64 = 0.15;
/// Most bars that scatter by themselves.
const BARS: usize = 40;
/// Longest way through steel, m.
const WAY: f64 = 0.25;

/// What the drawing says of what is scanned.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Across the axis of turning.
    pub outline: Outline,
    /// How much of that axis there is, m.
    pub height: f64,
    /// Bars as they were laid.
    pub bars: Vec<Bar>,
}

impl Drawing {
    /// A member at a place of its axis, as `protocol` sees it: its section, or a core of it. What
    /// has happened to it since is not on the drawing.
    ///
    /// # Errors
    /// The place is not on the member, or the member is too thin.
    pub fn of_member(member: Subject, along: f32, protocol: &Protocol) -> Result<Self, ScanError> {
        let (field, voxel) = (protocol.field(), protocol.voxel());
        let (recipe, _) =
            of_member(member.as_built(), along, field, protocol.looked_at(), voxel, 0)?;
        Ok(Self::of_recipe(&recipe))
    }

    /// Of a recipe, without what is wrong with it.
    #[must_use]
    pub fn of_recipe(recipe: &Recipe) -> Self {
        let bars = recipe.bars.iter().map(|bar| Bar { loss: 0.0, ..bar.clone() }).collect();
        Self { outline: recipe.outline, height: recipe.height, bars }
    }

    /// It as photons wander through it: ordinary concrete and its bars.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn solids(&self, protocol: &Protocol) -> Result<Specimen, ScanError> {
        self.solids_within(half(self.outline, self.height, protocol))
    }

    /// The same from so far below the scan plane to so far above it, m.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn solids_within(&self, half: f64) -> Result<Specimen, ScanError> {
        solids(self.outline, &self.bars, CONCRETE, half)
    }
}

/// How far above the scan plane concrete scatters: beyond the beam, but not beyond its own
/// `height`.
pub(super) fn half(outline: Outline, height: f64, protocol: &Protocol) -> f64 {
    let beam = protocol.height(2.0 * outline.reach());
    if height < beam { 0.5 * height } else { 0.5 * beam + BEYOND }
}

/// Outline and bars as solids, `half` high above and below the scan plane; `concrete` of so many
/// kg/m³.
pub(super) fn solids(
    outline: Outline,
    bars: &[Bar],
    concrete: f64,
    half: f64,
) -> Result<Specimen, ScanError> {
    let library = Library::builtin()?;
    let materials = vec![
        Matter::new(&library, "concrete", Model::Bound)?,
        Matter::new(&library, "steel", Model::Bound)?,
    ];
    let palette = vec![
        Substance { material: 0, density: concrete },
        Substance { material: 1, density: STEEL },
    ];
    let (base, top) = (DVec3::Z * -half, DVec3::Z * half);
    let body = match outline {
        Outline::Round(radius) => Shape::Cylinder { base, top, radius },
        Outline::Rectangle([a, b]) => {
            Shape::Box([DVec3::new(-a, -b, -half), DVec3::new(a, b, half)])
        }
    };
    let mut solids = vec![Solid { shape: body, label: 0 }];
    // Of what is bent, hooks and stirrups, nothing is taken but the straight run of a bar.
    let run = |bar: &Bar| {
        let is_straight = bar.line.len() == 2;
        let pieces = bar.line.windows(2).map(|w| (w[0], w[1]));
        pieces
            .filter(|_| is_straight || bar.ribbed)
            .max_by(|(a, b), (c, d)| a.distance(*b).total_cmp(&c.distance(*d)))
    };
    for (bar, (a, b)) in bars.iter().filter_map(|b| Some((b, run(b)?))).take(BARS) {
        let within = |p: DVec3| p.z.abs() <= half && outline.within(p) > 0.0;
        let (low, high) = if a.z < b.z { (a, b) } else { (b, a) };
        let cut = |p: DVec3, q: DVec3, z: f64| {
            if (q.z - p.z).abs() > 1e-9 {
                p + (q - p) * ((z - p.z) / (q.z - p.z)).clamp(0.0, 1.0)
            } else {
                p
            }
        };
        let (base, top) = (cut(low, high, -half), cut(low, high, half));
        if within(base) && within(top) && top.z - base.z > 0.01 {
            let radius = bar.radius * (1.0 - bar.loss).max(0.01).sqrt();
            solids.push(Solid { shape: Shape::Cylinder { base, top, radius }, label: 1 });
        }
    }
    Ok(Specimen::solids(materials, palette, solids)?)
}

/// Ordinary concrete and steel behind a tube as its data sheet has it, and their attenuation at the
/// one energy to which line integrals are brought.
#[derive(Debug, Clone)]
pub struct Standard {
    energies: Energies,
    /// The mean energy behind so much concrete, keV.
    pub kev: f64,
    /// Attenuation of concrete and steel there, 1/m.
    pub mu: [f64; 2],
}

impl Standard {
    /// `behind`: metres of concrete.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn new(protocol: &Protocol, behind: f64) -> Result<Self, ScanError> {
        let library = Library::builtin()?;
        let (concrete, steel) =
            (library.material("concrete")?.clone(), library.material("steel")?.clone());
        let mu = move |kev: f64| {
            [
                CONCRETE * concrete.attenuation(kev).total(),
                0.0,
                STEEL * steel.attenuation(kev).total(),
                0.0,
            ]
        };
        let energies = Energies::new(protocol, &mu);
        let kev = energies.mean([behind, 0.0, 0.0, 0.0]);
        let [concrete, _, steel, _] = mu(kev);
        Ok(Self { energies, kev, mu: [concrete, steel] })
    }

    /// Line integrals as if all photons had the one energy, behind at most `way` metres of
    /// concrete; where `metal`, steel is found by itself on `grid` (see [`Straight`]).
    ///
    /// # Errors
    /// As the reconstruction that shows the steel.
    pub fn straighten(
        &self,
        lines: &mut Sinogram,
        way: f64,
        metal: Option<(&Grid, Window)>,
        job: &Job,
    ) -> Result<(), ReconError> {
        let straight = Straight::new(&self.energies, [1.0, 0.0], self.mu, [way, WAY]);
        match metal {
            Some((grid, window)) => straight.correct(lines, grid, window, job),
            None => {
                straight.correct_concrete(lines);
                Ok(())
            }
        }
    }
}
