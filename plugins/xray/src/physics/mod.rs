//! What photons of 5–500 keV do in matter: attenuation, scattering, tube spectra. Energies in keV,
//! lengths in m, cross sections per mass in m²/kg.
//!
//! Compton scattering by Klein and Nishina times the incoherent scattering function S(x), Rayleigh
//! scattering by Thomson times F²(x), photoelectric absorption. Left out: fluorescence (the K lines
//! of iron and calcium, 6.4 and 3.7 keV, end within 0.1 mm of concrete), Doppler broadening,
//! polarisation, electrons.

mod klein_nishina;
mod matter;
mod rayleigh;
mod spectrum;
mod table;

pub(crate) use klein_nishina::ELECTRON;
pub(crate) use klein_nishina::energy_before;
pub use klein_nishina::{Backward, Forward, ratio, shape, total as klein_nishina_total};
pub(crate) use matter::CUT;
pub(crate) use matter::transfer;
pub use matter::{Cross, Matter, Model};
pub use rayleigh::FormFactor;
pub use spectrum::{Spectrum, Tubes};
pub use table::{Attenuation, Forms, Library, Material};

/// Why physics data cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// A table that does not hold what it should.
    #[error("{file}, line {line}: {problem}; remake it by assets/xray/make.py")]
    Table {
        /// Which asset.
        file: &'static str,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// A material that no table has.
    #[error("no attenuation data of '{name}'; known: {known}")]
    UnknownMaterial {
        /// As asked.
        name: String,
        /// What could have been asked.
        known: String,
    },
    /// A tube that no table has.
    #[error("tube voltage {kv} kV is outside {low}-{high} kV")]
    Voltage {
        /// As asked.
        kv: f64,
        /// Lowest.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// A spectrum with nothing in it.
    #[error("the spectrum holds no photon between {CUT} and 500 keV; use thinner filters")]
    EmptySpectrum,
}
