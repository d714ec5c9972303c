//! The cylinder behind which scatter is measured: solid concrete, 400 mm high, 800 mm from the
//! tube, 400 mm before the panel, a beam of 200 mm at its axis.

#![allow(dead_code, reason = "each example needs a part of it")]

use glam::DVec3;

use intrados_xray::{
    physics::{Library, Matter, Model, PhysicsError, Spectrum, Tubes},
    scanner::{Beam, Scanner},
    specimen::{Shape, Solid, Specimen, Substance},
};

/// Distances of tube and panel from the axis, m.
const TO: [f64; 2] = [0.8, 0.4];
/// Half the height of the cylinder, m.
const HALF_HEIGHT: f64 = 0.2;

/// A tube and its filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tube {
    /// 225 kV behind 1 mm of copper.
    Kv225,
    /// 450 kV behind 3 mm of copper.
    Kv450,
}

impl Tube {
    /// Its spectrum.
    ///
    /// # Errors
    /// [`PhysicsError`] if the program's tables are damaged.
    pub(crate) fn spectrum(self) -> Result<Spectrum, PhysicsError> {
        let (kv, copper) = if self == Self::Kv225 { (225.0, 1e-3) } else { (450.0, 3e-3) };
        let library = Library::builtin()?;
        Tubes::builtin()?.filtered(kv, &[(library.material("copper")?, copper)])
    }

    /// As the peer has it, lines at whole keV: of bins of 0.1 keV every tenth, which
    /// [`Model::Peer`] rounds down.
    ///
    /// # Errors
    /// [`PhysicsError`] if the program's tables are damaged.
    pub(crate) fn peer_spectrum(self) -> Result<Spectrum, PhysicsError> {
        let spectrum = self.spectrum()?;
        let between = |e: f64| 0.5 * (spectrum.density(e - 0.25) + spectrum.density(e + 0.25));
        let bin = |i: u32| {
            (
                f64::from(i) * 0.1 + 0.05,
                if i.is_multiple_of(10) { between(f64::from(i / 10)) } else { 0.0 },
            )
        };
        Spectrum::new(&(80..10 * spectrum.top() as u32).map(bin).collect::<Vec<_>>())
    }
}

/// A concrete cylinder of so many metres across.
///
/// # Errors
/// [`PhysicsError`] if the program's tables are damaged.
pub(crate) fn cylinder(diameter: f64, model: Model) -> Result<Specimen, PhysicsError> {
    let concrete = Matter::new(&Library::builtin()?, "concrete", model)?;
    let (base, top) = (DVec3::Z * -HALF_HEIGHT, DVec3::Z * HALF_HEIGHT);
    let solid = Solid { shape: Shape::Cylinder { base, top, radius: 0.5 * diameter }, label: 0 };
    Specimen::solids(vec![concrete], vec![Substance { material: 0, density: 2300.0 }], vec![solid])
        .map_err(|e| PhysicsError::UnknownMaterial { name: e.to_string(), known: String::new() })
}

/// The scanner of that cylinder: an even fluence as wide as the cylinder, `height` high at the axis
/// (m), and a panel of `pixels` of `pitch` (m).
#[must_use]
pub(crate) fn scanner(
    diameter: f64,
    height: f64,
    spectrum: Spectrum,
    pixels: [u32; 2],
    pitch: [f64; 2],
) -> Scanner {
    let radius = 0.5 * diameter;
    let across = 1.02 * radius / (TO[0] * TO[0] - radius * radius).sqrt();
    let beam = Beam { flat: true, ..Beam::symmetric(across, 0.5 * height / TO[0]) };
    Scanner::new(TO[0], TO[1], pixels, pitch, spectrum, beam)
}

/// One patch on the axis, 20 mm wide, as high as the beam there but 20 mm at most.
#[must_use]
pub(crate) fn patch(diameter: f64, height: f64, spectrum: Spectrum) -> Scanner {
    let high = (height * (TO[0] + TO[1]) / TO[0]).clamp(1e-3, 0.02);
    scanner(diameter, height, spectrum, [1, 1], [0.02, high])
}
