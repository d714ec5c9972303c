//! How is scanned.

use std::f64::consts::{FRAC_PI_2, TAU};

use intrados_scene::structure;
use intrados_stage::random::Key;

use super::ScanError;
use crate::{
    physics::{Library, Matter, Model, PhysicsError, Spectrum, Tubes},
    scanner::{self, Response, Scanner},
    volume::{Beam, Grid, Orbit},
};

/// Most rays of a scan: 4 bytes each, some times over.
const RAYS: usize = 1 << 27;
/// Above this voltage, kV, the scintillator is at least so thick, m.
const HARD: (f64, f64) = (300.0, 8e-3);

/// Concrete above and below the beam, m.
const MARGIN: f64 = 0.012;

/// What a real panel does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    /// Thickness of the scintillator (caesium iodide), m.
    pub scintillator: f64,
    /// Standard deviation of its blur, in pixels.
    pub blur: f64,
    /// Electronic noise of a reading, in detected photons.
    pub electronic: f64,
    /// Standard deviation of the pixels' gain.
    pub gain: f64,
    /// By how much gains change between the flat field and the scan.
    pub drift: f64,
    /// Share of dead pixels.
    pub dead: f64,
    /// Frames that the dark and the flat field are the mean of.
    pub fields: u32,
}

impl Default for Detector {
    fn default() -> Self {
        Self {
            scintillator: 2e-3,
            blur: 0.35,
            electronic: 4.0,
            gain: 0.02,
            drift: 0.01,
            dead: 1e-4,
            fields: 64,
        }
    }
}

/// What leaves the tube, and what stops it: by data sheet, or as it truly is.
#[derive(Debug, Clone, PartialEq)]
pub struct Tube {
    /// Voltage, kV.
    pub kv: f64,
    /// Materials before it, and how thick, m.
    pub filters: Vec<(String, f64)>,
    /// Thickness of the panel's scintillator (caesium iodide), m.
    pub scintillator: f64,
}

impl Tube {
    /// Photons by energy, and what the panel makes of them.
    ///
    /// # Errors
    /// The voltage or a material is not known.
    pub fn radiation(&self) -> Result<(Spectrum, Response), PhysicsError> {
        let (library, tubes) = (Library::builtin()?, Tubes::builtin()?);
        let filters = self
            .filters
            .iter()
            .map(|(name, d)| Ok((library.material(name)?, *d)))
            .collect::<Result<Vec<_>, PhysicsError>>()?;
        let spectrum = tubes.filtered(self.kv, &filters)?;
        let iodide = Matter::new(&library, "caesium iodide", Model::Bound)?;
        let areal = library.material("caesium iodide")?.density * self.scintillator;
        Ok((spectrum, Response::Scintillator(Box::new(iodide), areal)))
    }

    /// Another of the same make: generators lose up to a fiftieth of their voltage on the way,
    /// filters and scintillators are up to a twentieth thicker or thinner than their sheets say.
    #[must_use]
    pub fn as_it_is(&self, key: Key) -> Self {
        let off = |d: u32| 2.0 * key.unit64(d) - 1.0;
        Self {
            kv: self.kv * (0.99 + 0.01 * off(0)),
            filters: self
                .filters
                .iter()
                .map(|(name, d)| (name.clone(), d * (1.0 + 0.05 * off(1))))
                .collect(),
            scintillator: self.scintillator * (1.0 + 0.05 * off(2)),
        }
    }
}

/// Tube, detector and orbit, as data sheets have them.
#[derive(Debug, Clone)]
pub struct Protocol {
    /// Of what `spectrum` and `response` are made.
    pub tube: Tube,
    /// Photons by energy.
    pub spectrum: Spectrum,
    /// Photons of one view per m² at 1 m.
    pub fluence: f64,
    /// Focal spot, m.
    pub focus: f64,
    /// Rays.
    pub orbit: Orbit,
    /// What the panel does to them.
    pub detector: Detector,
    /// What pixels make of photons.
    pub response: Response,
}

impl Protocol {
    /// As a scene says, with another number of views, or with `width` pixels across the same field
    /// of view.
    ///
    /// # Errors
    /// The tube or a filter is not known, or there are more rays than memory is asked for.
    pub fn of_scene(
        scanner: &structure::Scanner,
        views: Option<usize>,
        width: Option<usize>,
        detector: Detector,
    ) -> Result<Self, ScanError> {
        let bad = |text: String| ScanError::Bad(format!("scanner \"{}\": {text}", scanner.name));
        let (library, tubes) = (Library::builtin()?, Tubes::builtin()?);
        let kv = f64::from(scanner.tube.voltage_kv);
        let bare = tubes.bare(kv).map_err(|e| bad(e.to_string()))?;
        let mut filters = Vec::new();
        for (metal, mm) in &scanner.tube.filters {
            let name = match metal.as_str() {
                "Al" => "aluminium",
                "Cu" => "copper",
                "Sn" => "tin",
                "Fe" => "steel",
                other => other,
            };
            filters.push((
                library.material(name).map_err(|e| bad(e.to_string()))?,
                1e-3 * f64::from(*mm),
            ));
        }
        // Hard tubes have deep scintillators before them, of which collimators make pixels.
        let scintillator =
            if kv > HARD.0 { HARD.1.max(detector.scintillator) } else { detector.scintillator };
        let tube = Tube {
            kv,
            filters: filters.iter().map(|(m, d)| (m.name.clone(), *d)).collect(),
            scintillator,
        };
        let (spectrum, response) = tube.radiation().map_err(|e| bad(e.to_string()))?;
        let through = |e: f64| {
            (-filters.iter().map(|(m, d)| m.density * d * m.attenuation(e).total()).sum::<f64>())
                .exp()
        };
        // The table is per cm² and mAs, at 1 m, by bins of 1 keV.
        let fluence = 1e4
            * f64::from(scanner.tube.charge_mas)
            * bare.iter().map(|(e, f)| f * through(*e)).sum::<f64>();
        let (source_axis, axis_detector) =
            (f64::from(scanner.orbit.source_m), f64::from(scanner.orbit.detector_m));
        let (full, rows) = (scanner.detector.width as usize, scanner.detector.height as usize);
        let width = width.unwrap_or(full);
        let pixel = 1e-3 * f64::from(scanner.detector.pixel_mm) * full as f64 / width as f64;
        // Pixels stay square; a row or two are a fan.
        let rows = ((rows * width) as f64 / full as f64).round().max(1.0) as usize;
        let views = views.unwrap_or(scanner.orbit.projections as usize);
        if views * rows * width > RAYS || width < 8 || views < 8 {
            return Err(bad(format!(
                "{views} views of {width} × {rows} pixels; at least 8 views and 8 pixels across, at most {RAYS} rays"
            )));
        }
        let beam = Beam::Cone { source_axis, axis_detector };
        let arc = f64::from(scanner.orbit.arc_deg).to_radians().min(TAU);
        let mut orbit = Orbit::circle(beam, views, arc, [rows, width], [pixel; 2]);
        // An arc that is no full turn has a view at both ends.
        if arc < 0.999 * TAU {
            orbit.angles = (0..views).map(|i| arc * i as f64 / (views - 1) as f64).collect();
        }
        Ok(Self {
            tube,
            spectrum,
            fluence,
            focus: 1e-3 * f64::from(scanner.tube.focus_mm),
            orbit,
            detector,
            response,
        })
    }

    /// The same with tube and panel as they are: [`Tube::as_it_is`]. A voltage that the tables do
    /// not reach stays as it is.
    ///
    /// # Errors
    /// The program's tables are damaged.
    pub fn as_it_is(&self, key: Key) -> Result<Self, ScanError> {
        let tube = self.tube.as_it_is(key);
        let (tube, (spectrum, response)) = match tube.radiation() {
            Err(PhysicsError::Voltage { .. }) => {
                let tube = Tube { kv: self.tube.kv, ..tube };
                let radiation = tube.radiation()?;
                (tube, radiation)
            }
            radiation => (tube, radiation?),
        };
        Ok(Self { tube, spectrum, response, ..self.clone() })
    }

    /// `count` slices round the scan plane that hold a specimen which reaches so far from the axis,
    /// m, as far as the panel sees it.
    #[must_use]
    pub fn slices(&self, reach: f64, count: usize) -> Grid {
        let voxel = self.voxel();
        let size = |length: f64| ((length / voxel).ceil() as usize).max(1);
        let across = size(2.12 * reach).min(size(self.field()));
        Grid::centred([across, across, count.max(1)], [voxel; 3])
    }

    /// From the source to the axis and to the panel, m.
    #[must_use]
    pub fn distances(&self) -> [f64; 2] {
        match self.orbit.beam {
            Beam::Cone { source_axis, axis_detector }
            | Beam::Fan { source_axis, axis_detector, .. } => {
                [source_axis, source_axis + axis_detector]
            }
            Beam::Parallel => [1.0, 1.0],
        }
    }

    /// Edge of a voxel: a pixel at the axis, m.
    #[must_use]
    pub fn voxel(&self) -> f64 {
        self.orbit.pixel[0] / self.orbit.beam.magnification()
    }

    /// What is seen in every view, m across.
    #[must_use]
    pub fn field(&self) -> f64 {
        let [axis, panel] = self.distances();
        let slope = 0.5 * self.orbit.pixel[0] * (self.orbit.bins() as f64 - 1.0) / panel;
        2.0 * axis * slope / (1.0 + slope * slope).sqrt()
    }

    /// Height of the beam where it leaves a specimen of so many metres across, and two voxels more.
    #[must_use]
    pub fn height(&self, across: f64) -> f64 {
        let [axis, panel] = self.distances();
        self.orbit.pixel[1] * self.orbit.rows() as f64 * (axis + 0.5 * across) / panel
            + 2.0 * self.voxel()
    }

    /// How much of a specimen's axis is to be grown: grains whose middle lies beyond the beam reach
    /// into it, m.
    pub(super) fn looked_at(&self) -> f64 {
        self.height(self.field()) + 2.0 * MARGIN
    }

    /// The same with jaws at tube and panel that leave only the rows which see `slices` slices of a
    /// specimen `across` metres wide: members scatter far more photons into an open panel than come
    /// straight through.
    #[must_use]
    pub fn slit(mut self, slices: usize, across: f64) -> Self {
        let [axis, panel] = self.distances();
        let near = (axis - 0.5 * across).max(0.1 * axis);
        let high = self.voxel() * slices as f64 * panel / near / self.orbit.pixel[1];
        let rows = (high.ceil() as usize + 2).min(self.orbit.rows());
        self.orbit.detector[0] = rows;
        self.orbit.centre[1] = 0.5 * (rows as f64 - 1.0);
        self
    }

    /// Bins of energy as the panel sees them, behind nothing: keV, photons, mean signal, mean of
    /// its square.
    pub(super) fn bins(&self) -> Vec<(f64, f64, [f64; 2])> {
        let of = |(kev, share): (f64, f64)| {
            // A scintillator stops a photon, all of it, or none.
            let mean = self.response.of(kev, 1.0);
            (kev, share, [mean, mean * kev])
        };
        self.spectrum.bins().filter(|b| b.1 > 0.0).map(of).collect()
    }

    /// Photons that the open beam brings to the middle of the panel: what counts alike is (Σ
    /// signal)²/Σ signal².
    pub(super) fn open(&self) -> f64 {
        let [_, panel] = self.distances();
        let [a, b] = self.bins().iter().fold([0.0; 2], |[a, b], (_, share, [mean, square])| {
            [a + share * mean, b + share * square]
        });
        self.fluence * self.orbit.pixel[0] * self.orbit.pixel[1] * a * a / b / (panel * panel)
    }

    /// The same with a panel of which so many rows are lit, round its middle; `None` if it has not
    /// so many.
    #[must_use]
    pub fn lit(mut self, rows: usize) -> Option<Self> {
        (rows > 0 && rows <= self.orbit.rows()).then(|| {
            self.orbit.detector[0] = rows;
            self.orbit.centre[1] = 0.5 * (rows as f64 - 1.0);
            self
        })
    }

    /// The same scanner for walks, with `pixels` large ones over the panel, in the view at `angle`.
    /// Its columns run against those of the orbit.
    #[must_use]
    pub fn scanner(&self, pixels: [u32; 2], angle: f64) -> Scanner {
        let [axis, panel] = self.distances();
        let size = [
            self.orbit.pixel[0] * self.orbit.bins() as f64,
            self.orbit.pixel[1] * self.orbit.rows() as f64,
        ];
        let pitch = [0, 1].map(|k| size[k] / f64::from(pixels[k]));
        let beam = scanner::Beam::symmetric(0.5 * size[0] / panel, 0.5 * size[1] / panel);
        let mut scanner =
            Scanner::new(axis, panel - axis, pixels, pitch, self.spectrum.clone(), beam);
        scanner.spot = self.focus;
        scanner.panel.response = self.response.clone();
        scanner.turned(angle + FRAC_PI_2)
    }
}
