//! Materials as walks need them: tables over equal steps of energy, and the scattering kernel.

use intrados_stage::random::Draw;
use std::f64::consts::PI;

use rayon::prelude::*;

use super::{
    Attenuation, FormFactor, Library, PhysicsError, klein_nishina as kn,
    rayleigh::{look, uniform},
};

/// Photons below this are absorbed, keV: they come no further than 0.3 mm in concrete.
pub(crate) const CUT: f64 = 8.0;
/// Highest energy of the tables, keV.
const TOP: f64 = 500.0;
/// Step of the tables, keV.
const STEP: f64 = 0.25;

/// x = sin(θ/2)/λ in 1/Å; hc = 12.398 keV·Å.
#[inline]
#[must_use]
pub(crate) fn transfer(kev: f64, c: f64) -> f64 {
    kev / 12.398_42 * (0.5 * (1.0 - c)).max(0.0).sqrt()
}

/// Which physics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// Compton with binding by S(x), Rayleigh by F²(x).
    #[default]
    Bound,
    /// The same attenuation, but Compton's angles of free electrons.
    Free,
    /// `mc_fd`: angles of free electrons, F² = exp(−(x/0.6 Å⁻¹)²), attenuation of the next lower
    /// whole keV.
    Peer,
}

/// One material.
#[derive(Debug, Clone)]
pub struct Matter {
    /// Its name.
    pub name: String,
    model: Model,
    /// μ/ρ by steps of energy.
    table: Vec<Attenuation>,
    /// S/Z by steps of x.
    incoherent: Vec<f64>,
    form: FormFactor,
    /// ∫ of the Compton shape over all angles, and of the Rayleigh shape times E^1.5, by steps of
    /// energy.
    norms: Vec<[f64; 2]>,
}

/// μ/ρ of one material at one energy.
pub type Cross = Attenuation;

impl Matter {
    /// The material called `name` in `library`.
    ///
    /// # Errors
    /// [`PhysicsError::UnknownMaterial`].
    pub fn new(library: &Library, name: &str, model: Model) -> Result<Self, PhysicsError> {
        let material = library.material(name)?;
        let energy = |i: usize| {
            if model == Model::Peer { (STEP * i as f64).floor() } else { STEP * i as f64 }
        };
        let table =
            (0..=(TOP / STEP) as usize).map(|i| material.attenuation(energy(i).max(5.0))).collect();
        let incoherent = uniform(&material.forms.x, &material.forms.incoherent);
        let form = if model == Model::Peer {
            FormFactor::gaussian()
        } else {
            FormFactor::new(&material.forms)
        };
        let mut matter =
            Self { name: name.to_owned(), model, table, incoherent, form, norms: Vec::new() };
        matter.norms = (0..=(TOP / STEP) as usize)
            .into_par_iter()
            .map(|i| matter.norms_at((STEP * i as f64).max(1.0)))
            .collect();
        Ok(matter)
    }

    fn norms_at(&self, kev: f64) -> [f64; 2] {
        let compton = if self.model == Model::Bound {
            // S rises within x < 1: equal steps of sin(θ/2), dΩ = 8π s ds.
            let n = 500;
            let step = 1.0 / f64::from(n);
            let at = |s: f64| {
                let c = 1.0 - 2.0 * s * s;
                8.0 * PI * s * kn::shape(kev, c) * self.bound(kev, c)
            };
            (0..n).map(|i| at((f64::from(i) + 0.5) * step)).sum::<f64>() * step
        } else {
            kn::total(kev)
        };
        [compton, self.form.total(kev) * kev.powf(1.5)]
    }

    /// S/Z.
    #[inline]
    fn bound(&self, kev: f64, c: f64) -> f64 {
        if self.model == Model::Bound { look(&self.incoherent, transfer(kev, c)) } else { 1.0 }
    }

    #[inline]
    fn norms(&self, kev: f64) -> [f64; 2] {
        let at = (kev / STEP).clamp(1.0 / STEP, TOP / STEP - 1e-6);
        let (i, t) = (at as usize, at.fract());
        let [a, b] = [self.norms[i], self.norms[i + 1]];
        [a[0] + t * (b[0] - a[0]), (a[1] + t * (b[1] - a[1])) / (kev * kev.sqrt())]
    }

    /// μ/ρ at `kev`.
    #[inline]
    #[must_use]
    pub fn cross(&self, kev: f64) -> Cross {
        let at = (kev / STEP).clamp(0.0, (TOP / STEP) - 1e-6);
        let i = at as usize;
        if self.model == Model::Peer {
            return self.table[i];
        }
        let (t, a, b) = (at - i as f64, &self.table[i], &self.table[i + 1]);
        Cross {
            photo: a.photo + t * (b.photo - a.photo),
            compton: a.compton + t * (b.compton - a.compton),
            rayleigh: a.rayleigh + t * (b.rayleigh - a.rayleigh),
        }
    }

    /// Total μ/ρ at `kev`.
    #[inline]
    #[must_use]
    pub fn total(&self, kev: f64) -> f64 {
        self.cross(kev).total()
    }

    /// Density of a Compton direction, per sr.
    #[inline]
    #[must_use]
    pub fn compton_pdf(&self, kev: f64, c: f64) -> f64 {
        kn::shape(kev, c) * self.bound(kev, c) / self.norms(kev)[0]
    }

    /// Density of a Rayleigh direction, per sr.
    #[inline]
    #[must_use]
    pub fn rayleigh_pdf(&self, kev: f64, c: f64) -> f64 {
        0.5 * (1.0 + c * c) * self.form.square(transfer(kev, c)) / self.norms(kev)[1]
    }

    /// Cosine after a Compton event: Klein and Nishina's, kept with probability S/Z.
    #[must_use]
    pub(crate) fn compton_sample(&self, photons: &kn::Forward, draw: &mut Draw) -> f64 {
        loop {
            let c = photons.sample(draw);
            if self.model != Model::Bound || draw.unit() < self.bound(photons.kev, c) {
                return c;
            }
        }
    }

    /// Cosine after a Rayleigh event.
    #[must_use]
    pub(crate) fn rayleigh_sample(&self, kev: f64, draw: &mut Draw) -> f64 {
        self.form.sample(kev, draw)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use intrados_stage::random::Key;
    use intrados_transport::chi2::{Grid, rectangle};

    #[test]
    fn samples_follow_the_densities() {
        let library = Library::builtin().unwrap();
        let grid = Grid { bounds: [[-1.0, 1.0], [0.0, 1.0]], cells: [200, 4] };
        for model in [Model::Bound, Model::Peer] {
            let matter = Matter::new(&library, "concrete", model).unwrap();
            for (kev, low) in [(20.3, -1.0), (150.0, 0.9)] {
                let draw = |i| {
                    let mut draw = Draw::new(Key::new(5, i));
                    Some([matter.compton_sample(&kn::Forward::new(kev), &mut draw), draw.unit()])
                };
                let chi =
                    rectangle(grid, 1_000_000, draw, |[c, _]| TAU * matter.compton_pdf(kev, c));
                assert!(chi.passes(8), "compton {model:?} {kev}: {chi:?}");
                let draw = |i| {
                    let mut draw = Draw::new(Key::new(6, i));
                    Some([matter.rayleigh_sample(kev, &mut draw), draw.unit()])
                        .filter(|[c, _]| *c >= low)
                };
                // The peak within a few degrees is what there is.
                let grid = Grid { bounds: [[low, 1.0], [0.0, 1.0]], cells: [200, 4] };
                let chi =
                    rectangle(grid, 1_000_000, draw, |[c, _]| TAU * matter.rayleigh_pdf(kev, c));
                assert!(chi.passes(8), "rayleigh {model:?} {kev}: {chi:?}");
            }
        }
    }

    /// ∫ S dσ_KN over all angles is what the attenuation table has as its incoherent part: two
    /// tables of one library, each other's check. r_e²/2 · N_A · electrons a kg (concrete: Σ w
    /// Z/A).
    #[test]
    fn binding_explains_the_incoherent_attenuation() {
        let library = Library::builtin().unwrap();
        let matter = Matter::new(&library, "quartz", Model::Bound).unwrap();
        let electrons = 6.022_140_76e26 * (0.467_435 * 14.0 / 28.085 + 0.532_565 * 8.0 / 15.999);
        for kev in [20.0, 60.0, 200.0, 450.0] {
            let sigma = 0.5 * 2.817_940_3e-15_f64.powi(2) * matter.norms(kev)[0] * electrons;
            assert!(
                (sigma / matter.cross(kev).compton - 1.0).abs() < 5e-3,
                "{kev}: {sigma} {}",
                matter.cross(kev).compton
            );
        }
    }
}
