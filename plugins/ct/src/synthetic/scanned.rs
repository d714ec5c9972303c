//! Slices from the simulated scanner: X-rays through a specimen with the planted damage, all that
//! goes wrong with them, and corrections. *A simulated scan.*

use intrados_scene::{Member, Scene};
use intrados_stage::{Job, random::Key};
use intrados_xray::{
    scan::{Acquisition, Corrections, Detector, Forming, Protocol, Restored, ScanError},
    specimen::concrete::{Label, OUTSIDE, Subject},
};

use crate::{
    crack::{self, Crack},
    slice::Slice,
};
use intrados_raster::grid::{Grid, Mask};

/// What marks a simulated scan wherever a user sees it.
pub const MARK: &str = "a simulated scan";

/// Share of starved rays from which a slice is noise.
const STARVED: f64 = 0.02;

/// A slice of a scan, and what is truly in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// The picture, y up.
    pub slice: Slice,
    /// Pores and cracks.
    pub truth: Mask,
    /// True pore area / body area, cracks excluded; bars are no body.
    pub porosity: f64,
    /// True cracks, as the slice cuts them.
    pub cracks: Vec<Crack>,
    /// Body area, pixels.
    pub body_area: usize,
}

/// Slice `z` of a scan.
#[must_use]
pub fn layer(acquisition: &Acquisition, restored: &Restored, z: usize) -> Layer {
    let grid = &restored.volume.grid;
    let [width, height, _] = grid.size;
    let n = width * height;
    let labels = acquisition.target.truth.labels.get(z * n..(z + 1) * n).unwrap_or_default();
    let data = restored.volume.slice(z).chunks(width.max(1)).rev().flatten().copied().collect();
    let upright = |data: Vec<bool>| Mask {
        data: data.chunks(width.max(1)).rev().flatten().copied().collect(),
        width,
        height,
    };
    let [pores, cracks] = [Label::Pore, Label::Crack]
        .map(|label| upright(labels.iter().map(|l| *l == label as u8).collect()));
    let body_area = labels.iter().filter(|l| ![OUTSIDE, Label::Steel as u8].contains(l)).count();
    let pixel_mm = (1e3 * grid.voxel[0]) as f32;
    let truth = Mask {
        data: pores.data.iter().zip(&cracks.data).map(|(p, c)| *p || *c).collect(),
        width,
        height,
    };
    Layer {
        slice: Slice {
            name: format!("scanned slice {}, {:.0} keV", z + 1, restored.kev),
            grey: Grid { width, height, data },
            pixel_mm,
        },
        porosity: pores.count() as f64 / body_area.max(1) as f64,
        cracks: crack::find_in_labels(&cracks, pixel_mm, &crack::CrackSettings::default()).list,
        truth,
        body_area,
    }
}

/// What to scan: by which scanner of the scene, where, with which seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Name of the scanner.
    pub scanner: String,
    /// Place on the axis, 0 to 1.
    pub along: f32,
    /// Seed of concrete and noise.
    pub seed: u64,
}

/// Scans a member through a slit of one slice, and takes out again what can be.
///
/// # Errors
/// Cancelled, no such scanner, no parametric member, or hardly a photon comes through.
pub fn scan(
    scene: &Scene,
    member: &Member,
    request: &Request,
    job: &Job,
) -> Result<Layer, ScanError> {
    let Request { scanner, along, seed } = request;
    let bad = |why: String| ScanError::Bad(why);
    let tube = scene.structure.scanners.iter().find(|s| s.name == *scanner);
    let tube = tube.ok_or_else(|| bad(format!("the scene has no scanner \"{scanner}\"")))?;
    let subject = Subject::of(scene, &member.id)?;
    let protocol = Protocol::of_scene(tube, None, None, Detector::default())?;
    let across = protocol.field();
    let seed = Key::new(*seed, u64::from(along.to_bits())).bits(0).into();
    let taken = Acquisition::take(
        subject,
        *along,
        &protocol.slit(1, across),
        1,
        seed,
        &Forming::default(),
        job,
    )?;
    let restored = taken.restore(Corrections::ALL, job)?;
    if restored.starved > STARVED {
        return Err(bad(format!(
            "the slice at {along} of its axis is noise, since behind {:.0} % of its rays nothing certain is left: scan a core (a panel with a smaller field)",
            100.0 * restored.starved
        )));
    }
    let found = layer(&taken, &restored, 0);
    let core = if taken.target.place.is_some_and(|p| p.core) { "core" } else { "section" };
    let name = format!("{core} at {along:.3}, {:.0} keV ({MARK})", restored.kev);
    Ok(Layer { slice: Slice { name, ..found.slice }, ..found })
}
