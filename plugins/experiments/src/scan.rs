//! The physical making of a case: projections with all that is wrong with them.
//!
//! What makes them is not what corrects them: voxels and pixels are half as large, the tube's
//! voltage, filter and scintillator, the axis, the distance and the views' angles are a little
//! other than the data sheet says, and the photons are scattered by the specimen with its grains,
//! pores and bars.

use std::f64::consts::TAU;

use glam::{DVec3, UVec3};
use intrados_stage::{Job, random::Key};
use intrados_xray::{
    correct::Panel,
    march::Lattice,
    physics::{Library, Matter, Model, Spectrum},
    scan::{Detector, Energies, Protocol, Rays, ScatterMap, Standard, Tube, expose},
    scanner::Response,
    specimen::{
        Specimen, Substance,
        concrete::{FULL, Outline, Painted},
    },
    volume::{Beam, Grid, Orbit},
};

use super::{
    ExperimentError,
    case::{CaseSet, ExperimentCase, Grains},
    scatter::{Head, Scatter, ScatterEffort},
    shapes::{Bodies, PlantedTruth},
};
use intrados_raster::grid::Grid as Picture;

/// From the source to the axis, and on to the panel, m.
const SOURCE: f64 = 0.8;
const BEHIND: f64 = 0.4;
/// Diameter of the focal spot, m.
const SPOT: f64 = 4e-4;
/// Thickness of the scintillator (caesium iodide), m: thin, and thick above 300 kV.
const SCINTILLATOR: [f64; 2] = [2e-3, 8e-3];
/// Voxels and pixels of the making along one of the slice's.
const FINE: usize = 2;
/// Layers of fine voxels: all that the row of the scan plane sees.
const LAYERS: usize = 4;
/// Field of the panel over the specimen's largest width.
const FIELD: f64 = 1.05;
/// How the true scatter is found.
const EFFORT: ScatterEffort =
    ScatterEffort { views: 6, columns: 20, walks: 1 << 16, links: 4, steered: false };
/// Edge of the cells that scatter, across and along the axis, m.
const CELL: [f64; 2] = [2.5e-3, 20e-3];
/// How far beyond the beam photons wander and come back, m.
const BEYOND: f64 = 0.15;
/// Densities of the cells that scatter: so many steps up to this one, kg/m³.
const GRADES: usize = 28;
const DENSEST: f64 = 3000.0;
/// Steel, kg/m³.
const STEEL: f64 = 7850.0;

/// What everybody may know of a scan.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Voltage and filter as the operator set them, the scintillator by its maker.
    pub tube: Tube,
    /// One row of the panel, that of the scan plane: a fan. Axis and angles as they should be.
    pub orbit: Orbit,
    /// Width of the panel and height of the beam on it, m.
    pub lit: [f64; 2],
    /// Diameter of the focal spot, m.
    pub spot: f64,
    /// Outline of the member by its drawing.
    pub outline: Outline,
    /// The slice to be reconstructed.
    pub slice: Grid,
    /// Detected photons that the open beam brings to the middle pixel.
    pub open: f64,
    /// Electronic noise of a reading, in detected photons.
    pub electronic: f64,
}

/// A scan as it comes from the scanner.
#[derive(Debug, Clone)]
pub struct RawScan {
    /// What is known of it.
    pub sheet: Sheet,
    /// Raw readings `[view][bin]`.
    pub frames: Vec<f32>,
    /// Dark and flat field.
    pub panel: Panel,
}

/// A case made.
#[derive(Debug, Clone)]
pub struct Made {
    /// What the methods get.
    pub scan: RawScan,
    /// What they are judged by.
    pub truth: PlantedTruth,
    /// True attenuation of the slice's pixels at the energy of corrected slices, 1/m.
    pub attenuation: Picture<f32>,
    /// Scatter over primary behind the middle of the member.
    pub scatter_to_primary: f64,
    /// Relative standard error of that scatter, root mean square of its patches.
    pub scatter_error: f64,
    /// Mean share of the open beam behind the member's middle.
    pub transmission: f64,
}

impl Sheet {
    fn of(case: &ExperimentCase, cases: &CaseSet) -> Self {
        let outline = case.outline();
        let voxel = 2.0 * outline.reach() * FIELD / cases.across as f64;
        let pixel = voxel * (SOURCE + BEHIND) / SOURCE;
        let beam = Beam::Fan { source_axis: SOURCE, axis_detector: BEHIND, curved: false };
        let orbit = Orbit::circle(beam, cases.views, TAU, [1, cases.across], [pixel; 2]);
        let half = outline.half();
        let size = [half.x, half.y].map(|h| (h * FIELD / voxel).ceil() as usize * 2);
        Self {
            tube: Tube {
                kv: case.kv,
                filters: vec![("copper".to_owned(), 1e-3 * case.copper_mm)],
                scintillator: SCINTILLATOR[usize::from(case.kv > 300.0)],
            },
            lit: [pixel * cases.across as f64, 1e-3 * case.beam_mm * (SOURCE + BEHIND) / SOURCE],
            spot: SPOT,
            outline,
            slice: Grid::centred([size[0], size[1], 1], [voxel; 3]),
            open: 1e3 * case.photons * cases.dose,
            electronic: 2.0 * Detector::default().electronic,
            orbit,
        }
    }

    /// Edge of a voxel of the slice, m.
    #[must_use]
    pub fn voxel(&self) -> f64 {
        self.slice.voxel[0]
    }

    /// From the source to the axis and to the panel, m.
    #[must_use]
    pub(crate) fn distances(&self) -> [f64; 2] {
        [SOURCE, SOURCE + BEHIND]
    }
}

/// The things that are other than the sheet says.
#[derive(Debug, Clone)]
struct Reality {
    tube: Tube,
    source: f64,
    /// Of the axis, pixels of the sheet.
    shift: f64,
    mortar: f64,
    key: Key,
}

impl Reality {
    fn of(case: &ExperimentCase, sheet: &Sheet) -> Self {
        let key = Key::new(case.seed, 7);
        let off = |d: u32| 2.0 * key.unit64(d) - 1.0;
        Self {
            tube: sheet.tube.as_it_is(key),
            source: SOURCE * (1.0 + 0.002 * off(3)),
            shift: 0.6 * off(4),
            mortar: 2120.0 * (1.0 + 0.03 * off(5)),
            key,
        }
    }

    fn orbit(&self, sheet: &Sheet) -> Orbit {
        let beam = Beam::Cone { source_axis: self.source, axis_detector: BEHIND };
        let pixel = sheet.orbit.pixel[0] / FINE as f64;
        let (views, bins) = (sheet.orbit.views(), sheet.orbit.bins() * FINE);
        let mut orbit = Orbit::circle(beam, views, TAU, [FINE, bins], [pixel; 2]);
        orbit.centre[0] += self.shift * FINE as f64;
        orbit.centre[1] += 0.2;
        orbit
            .angles
            .iter_mut()
            .enumerate()
            .for_each(|(i, a)| *a += 3e-4 * self.key.normal(100 + 8 * i as u32));
        orbit
    }
}

/// A member cast, and the scatter behind it.
#[derive(Debug, Clone)]
pub struct Cast {
    sheet: Sheet,
    painted: Painted,
    truth: PlantedTruth,
    real: Reality,
    spectrum: Spectrum,
    response: Response,
    /// Of the grains: name of the material, kg/m³.
    rock: (&'static str, f64),
    scatter: Scatter,
}

/// Makes a case.
///
/// # Errors
/// Cancelled, or the program's tables are damaged.
pub(crate) fn make(
    case: &ExperimentCase,
    cases: &CaseSet,
    job: &Job,
) -> Result<Made, ExperimentError> {
    cast(case, cases, job)?.exposed(case, job)
}

/// Casts the member of a case and finds the scatter behind it.
///
/// # Errors
/// Cancelled, or the program's tables are damaged.
pub(crate) fn cast(
    case: &ExperimentCase,
    cases: &CaseSet,
    job: &Job,
) -> Result<Cast, ExperimentError> {
    let sheet = Sheet::of(case, cases);
    let edge = sheet.voxel() / FINE as f64;
    let [nx, ny, _] = sheet.slice.size;
    let grid = Grid::centred([nx * FINE, ny * FINE, LAYERS], [edge; 3]);
    job.relabel(format!("{}: casting", case.id));
    let bodies = Bodies::grow(case, 0.5 * edge * LAYERS as f64);
    let (painted, voids) = bodies.paint(case, &grid, job)?;
    let truth = PlantedTruth::of(&painted, &voids, FINE);
    let real = Reality::of(case, &sheet);
    let (spectrum, response) = real.tube.radiation()?;
    let rock = match case.grains {
        Grains::Quartz => ("quartz", 2650.0),
        Grains::Limestone => ("limestone", 2700.0),
        Grains::Granite => ("granite", 2680.0),
    };
    job.relabel(format!("{}: scatter", case.id));
    let head = Head {
        spectrum: spectrum.clone(),
        response: response.clone(),
        distances: [real.source, real.source + BEHIND],
        lit: sheet.lit,
        spot: SPOT,
    };
    let specimen = scattering(&painted, [real.mortar, rock.1], sheet.lit[1])?;
    let scatter = head.scatter(&specimen, EFFORT, case.seed ^ 0x5ca7, job)?;
    Ok(Cast { sheet, painted, truth, real, spectrum, response, rock, scatter })
}

impl Cast {
    /// Scans it.
    ///
    /// # Errors
    /// Cancelled, or the program's tables are damaged.
    pub(crate) fn exposed(self, case: &ExperimentCase, job: &Job) -> Result<Made, ExperimentError> {
        let Self { sheet, painted, truth, real, spectrum, response, rock, scatter } = self;
        job.relabel(format!("{}: exposing", case.id));
        let detector = Detector { blur: 0.35 * FINE as f64, ..Detector::default() };
        let mut protocol = Protocol {
            tube: real.tube.clone(),
            spectrum,
            fluence: 1.0,
            focus: SPOT,
            orbit: real.orbit(&sheet),
            detector,
            response,
        };
        let library = Library::builtin()?;
        let materials = [
            library.material("mortar")?.clone(),
            library.material(rock.0)?.clone(),
            library.material("steel")?.clone(),
        ];
        let densities = [real.mortar, rock.1, STEEL];
        let mu = |kev: f64| {
            let [m, r, s] = [0, 1, 2].map(|k| densities[k] * materials[k].attenuation(kev).total());
            [m, r, s, 0.0]
        };
        let attenuation = averaged(&painted, mu(energy(&sheet)?));
        let energies = Energies::new(&protocol, mu);
        let [_, panel] = protocol.distances();
        // Photons of a fine pixel: what counts alike is (Σ signal)²/Σ signal².
        let area = protocol.orbit.pixel[0] * protocol.orbit.pixel[1];
        protocol.fluence = sheet.open / (FINE * FINE) as f64 * panel * panel / area
            * energies.open[1]
            / energies.open[0].powi(2);
        let rays = Rays::new(&painted);
        let middle = rays.view(&protocol.orbit, protocol.orbit.angles[0], protocol.distances())
            [protocol.orbit.bins() / 2];
        let transmission = f64::from(energies.behind(middle)[0]) / energies.open[0];
        let (to_primary, rel_error) = (scatter.to_primary, scatter.rel_error);
        let scatter_map = ScatterMap { estimate: scatter.estimate, to_primary, rel_error };
        let exposure =
            expose(&rays, &energies, Some(&scatter_map), &protocol, case.seed ^ 0xe4, job)?;
        let binned = |fine: &[f32]| -> Vec<f32> {
            let wide = protocol.orbit.bins();
            let sum = |frame: &[f32], bin: usize| {
                (0..FINE)
                    .map(|row| frame[row * wide + bin * FINE..][..FINE].iter().sum::<f32>())
                    .sum::<f32>()
            };
            fine.chunks(FINE * wide)
                .flat_map(|frame| (0..wide / FINE).map(move |bin| sum(frame, bin)))
                .collect()
        };
        let panel = Panel {
            size: [1, sheet.orbit.bins()],
            dark: binned(&exposure.panel.dark),
            flat: binned(&exposure.panel.flat),
        };
        Ok(Made {
            scan: RawScan { frames: binned(&exposure.frames), panel, sheet },
            truth,
            attenuation,
            scatter_to_primary: to_primary,
            scatter_error: rel_error,
            transmission,
        })
    }

    /// The same with another dose.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn with_dose(mut self, by: f64) -> Self {
        self.sheet.open *= by;
        self
    }
}

/// Attenuation of the slice's pixels: means of their voxels.
fn averaged(painted: &Painted, mu: [f64; 4]) -> Picture<f32> {
    let [nx, ny, nz] = painted.grid.size;
    let (w, h) = (nx / FINE, ny / FINE);
    let voxel = |i: usize| {
        (0..3).map(|k| f64::from(painted.shares[i][k]) * mu[k]).sum::<f64>() / f64::from(FULL)
    };
    let pixel = |i: usize| {
        let at = |z: usize, y: usize, x: usize| {
            ((nz - FINE) / 2 + z) * ny * nx + (i / w * FINE + y) * nx + i % w * FINE + x
        };
        let all = (0..FINE * FINE * FINE)
            .map(|k| voxel(at(k / (FINE * FINE), k / FINE % FINE, k % FINE)));
        (all.sum::<f64>() / (FINE * FINE * FINE) as f64) as f32
    };
    Picture { width: w, height: h, data: (0..w * h).map(pixel).collect() }
}

/// The member as photons wander through it: cells of the density that their grains, pores and
/// cracks leave, bars in them, as long as they may come from.
fn scattering(
    painted: &Painted,
    [mortar, rock]: [f64; 2],
    lit: f64,
) -> Result<Specimen, ExperimentError> {
    let library = Library::builtin()?;
    let materials = vec![
        Matter::new(&library, "concrete", Model::Bound)?,
        Matter::new(&library, "steel", Model::Bound)?,
    ];
    let grade = |i: usize| DENSEST * i as f64 / GRADES as f64;
    let mut palette: Vec<Substance> =
        (0..=GRADES).map(|i| Substance { material: 0, density: grade(i) }).collect();
    palette.push(Substance { material: 1, density: STEEL });
    let [nx, ny, nz] = painted.grid.size;
    let edge = painted.grid.voxel[0];
    let by = ((CELL[0] / edge).round() as usize).max(1);
    let (wide, deep) = (nx.div_ceil(by), ny.div_ceil(by));
    let high = 0.5 * lit * SOURCE / (SOURCE + BEHIND) + BEYOND;
    let tall = (2.0 * high / CELL[1]).ceil() as u32;
    let full = f64::from(FULL);
    let cell = |c: usize| {
        let (x0, y0) = (c % wide * by, c / wide * by);
        let mut sums = [0.0; 3];
        for y in y0..(y0 + by).min(ny) {
            for x in x0..(x0 + by).min(nx) {
                let shares = painted.shares[(nz / 2 * ny + y) * nx + x];
                (0..3).for_each(|k| sums[k] += f64::from(shares[k]) / full / (by * by) as f64);
            }
        }
        let density = sums[0] * mortar + sums[1] * rock;
        if sums[2] >= 0.5 {
            GRADES as u8 + 1
        } else {
            (density / DENSEST * GRADES as f64).round().min(GRADES as f64) as u8
        }
    };
    let layer: Vec<u8> = (0..wide * deep).map(cell).collect();
    let labels = layer.iter().copied().cycle().take(layer.len() * tall as usize).collect();
    let low = |k: usize| painted.grid.origin[k] - 0.5 * edge;
    let lattice = Lattice {
        origin: DVec3::new(low(0), low(1), -0.5 * f64::from(tall) * CELL[1]),
        spacing: DVec3::new(edge * by as f64, edge * by as f64, CELL[1]),
        cells: UVec3::new(wide as u32, deep as u32, tall),
    };
    Ok(Specimen::voxels(materials, palette, lattice, labels)?)
}

/// Ordinary concrete behind the tube as the sheet has it, at the mean energy behind half the
/// member.
pub(crate) fn standard(sheet: &Sheet) -> Result<Standard, ExperimentError> {
    let (spectrum, response) = sheet.tube.radiation()?;
    let (tube, orbit) = (sheet.tube.clone(), sheet.orbit.clone());
    let protocol = Protocol {
        tube,
        spectrum,
        fluence: 1.0,
        focus: sheet.spot,
        orbit,
        detector: Detector::default(),
        response,
    };
    Ok(Standard::new(&protocol, sheet.outline.reach())?)
}

/// The energy at which corrected slices show attenuation, keV.
///
/// # Errors
/// The program's tables are damaged.
pub(crate) fn energy(sheet: &Sheet) -> Result<f64, ExperimentError> {
    Ok(standard(sheet)?.kev)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        case::{Kind, Pores, Section},
        correct::plain,
        reference::otsu,
        score::scored,
    };

    fn tiny() -> (ExperimentCase, CaseSet) {
        let case = ExperimentCase {
            id: "tiny".into(),
            kind: Kind::Beam,
            section: Section::Rectangle(40.0, 30.0),
            grains: Grains::Quartz,
            bars: Vec::new(),
            pores: Some(Pores { porosity: 0.06, scale_mm: 5.0, shape: 3.0, range_mm: (4.0, 8.0) }),
            cracks: None,
            kv: 225.0,
            copper_mm: 1.0,
            beam_mm: 5.0,
            photons: 500.0,
            seed: 99,
        };
        (
            case.clone(),
            CaseSet { schema: String::new(), dose: 1.0, views: 90, across: 72, cases: vec![case] },
        )
    }

    /// From casting to a score: large pores of a small member at a high dose are found by the plain
    /// reference; what the panel reads does not depend on the number of threads, and another dose
    /// is other noise.
    #[test]
    fn a_tiny_case_from_end_to_end() {
        let (case, cases) = tiny();
        let job = Job::default();
        let body = cast(&case, &cases, &job).unwrap();
        let made = body.clone().exposed(&case, &job).unwrap();
        let score = scored(&otsu(&plain(&made.scan, &job).unwrap()), &made.truth, 1);
        let (pores, area) = (made.truth.pores.components().members.len(), made.truth.pores.count());
        println!(
            "{pores} pores of {area} pixels, {:?}; scatter {:.3} of primary, {:.3} comes through",
            score.terms, made.scatter_to_primary, made.transmission
        );
        assert!(pores >= 3 && made.truth.cracks.count() == 0 && score.score > 75.0, "{score:?}");
        assert!(score.ci95[0] <= score.score && score.score <= score.ci95[1]);
        assert!(
            (0.002..0.05).contains(&made.scatter_to_primary)
                && (0.05..0.5).contains(&made.transmission)
        );
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let alone = one.install(|| body.clone().exposed(&case, &job).unwrap());
        assert!(alone.scan.frames == made.scan.frames && alone.truth == made.truth);
        assert!(body.with_dose(0.5).exposed(&case, &job).unwrap().scan.frames != made.scan.frames);
    }

    #[test]
    fn it_stops_when_asked() {
        let (case, cases) = tiny();
        let job = Job::default();
        job.cancel();
        assert!(matches!(make(&case, &cases, &job), Err(ExperimentError::Cancelled(_))));
    }
}
