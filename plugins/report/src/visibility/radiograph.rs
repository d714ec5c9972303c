//! What the scene's scanner would reveal of each planted void, crack and rusted bar, in its best
//! projection and in the whole scan.
//!
//! Every defect is a fault of the sound section ([`FaultyScan`]), and one line through the section
//! tells what each makes of a pixel: exactly, since a void lets many times more through and first
//! order would not do. What hides it is the number of photons at the scan's dose, scattered ones
//! included, and the electronics:
//!
//! ```text
//! CNR² = Σ_p (n A δP)²/(n A (P₂ + S₂) + e²)
//! ```
//!
//! n photons from the tube, A the pixel's area, P₂ and S₂ the means of the squares of what primary
//! and scattered photons count. The whole scan adds its projections' squares. A crack is a share of
//! the band that it wanders in. Concrete's own grain is not among what hides: it is no noise, but
//! may look like one.

use intrados_scene::{Damage, Scene, structure::Scanner};
use intrados_stage::{Cancelled, Job};
use intrados_xray::{
    perturbed::{Fault, FaultyScan, Planted, section},
    scan::{Detector, Protocol, ScanError},
    specimen::{
        Specimen,
        concrete::{Subject, of_member},
    },
};
use serde::Serialize;

use super::SEEN_FROM;

/// Directions over half a turn.
pub(crate) const VIEWS: u32 = 12;
/// Slices that the beam is cut for, as `scan` does.
pub(crate) const SLICES: usize = 4;
/// Height of the section, over the beam's.
const HEIGHT: f64 = 1.2;
/// A pixel is looked at by so many lines, one above the other: a crack is thinner.
const LINES: u32 = 2;
/// Pixels and walks of the scatter.
const SCATTER: ([u32; 2], u64) = ([8, 1], 40_000);

/// One defect in one scanner.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RadiographedDefect {
    /// Id of the member.
    pub member: String,
    /// What it is.
    pub defect: String,
    /// Name of the scanner.
    pub scanner: String,
    /// The place of the member's axis, of those that are scanned, where most is seen of it.
    pub along: f32,
    /// The angle of the best projection, degrees.
    pub view_deg: f64,
    /// By which share the signal changes there where it changes most.
    pub contrast: f64,
    /// Contrast to noise in that projection.
    pub contrast_to_noise: f64,
    /// In all projections of the scan.
    pub whole_scan: f64,
    /// Whether one projection would show it.
    pub seen: bool,
}

/// Every planted void, crack and rusted bar of a scene in each of its scanners.
///
/// # Errors
/// The job was cancelled.
pub(crate) fn radiograph(
    scene: &Scene,
    seed: u64,
    job: &Job,
) -> Result<Vec<RadiographedDefect>, Cancelled> {
    let mut told: Vec<RadiographedDefect> = Vec::new();
    let planted = |m: &Subject| {
        m.planted.iter().any(|d| {
            matches!(d, Damage::Voids { .. } | Damage::Crack { .. } | Damage::Corrosion { .. })
        })
    };
    let structure = &scene.structure;
    let scanned = |s: &Scanner| {
        let ids = structure
            .assemblies
            .iter()
            .map(|a| a.id.as_str())
            .filter(|id| s.members.iter().any(|m| m == id));
        ids.filter_map(|id| Subject::of(scene, id).ok()).filter(planted).collect::<Vec<_>>()
    };
    let places: Vec<(&Scanner, Subject, f32)> = structure
        .scanners
        .iter()
        .flat_map(|s| scanned(s).into_iter().map(move |m| (s, m)))
        .flat_map(|(s, m)| s.orbit.along.iter().map(move |&along| (s, m, along)))
        .collect();
    for (k, &(scanner, member, along)) in places.iter().enumerate() {
        job.step(k, places.len())?;
        let found = match at(scanner, member, along, seed, job) {
            Ok(found) => found,
            Err(_) if job.is_cancelled() => return Err(Cancelled),
            Err(why) => {
                tracing::warn!("{} at {along}: no projection: {why}", member.id());
                continue;
            }
        };
        for one in found {
            match told.iter_mut().find(|t| {
                (&t.member, &t.defect, &t.scanner) == (&one.member, &one.defect, &one.scanner)
            }) {
                Some(before) if before.contrast_to_noise < one.contrast_to_noise => *before = one,
                Some(_) => {}
                None => told.push(one),
            }
        }
    }
    Ok(told)
}

/// At one place of a member.
fn at(
    scanner: &Scanner,
    member: Subject,
    along: f32,
    seed: u64,
    job: &Job,
) -> Result<Vec<RadiographedDefect>, ScanError> {
    let open = Protocol::of_scene(scanner, None, None, Detector::default())?;
    let across = open.field();
    let protocol = open.slit(SLICES, across);
    let (recipe, _) =
        of_member(member, along, across, HEIGHT * protocol.height(across), protocol.voxel(), seed)?;
    let (specimen, faults) = section(&recipe)?;
    let voids = member.planted.iter().any(|d| matches!(d, Damage::Voids { .. }));
    let (planted, faults): (Vec<Planted>, Vec<Fault>) =
        faults.into_iter().filter(|(p, _)| voids || !matches!(p, Planted::Pore(_))).unzip();
    if faults.is_empty() {
        return Ok(Vec::new());
    }
    let scatter = scatter(&specimen, &protocol, seed, job)?;
    let views = (0..VIEWS).map(|v| std::f64::consts::PI * f64::from(v) / f64::from(VIEWS));
    let views: Vec<(f64, Vec<[f64; 2]>)> =
        views.map(|angle| (angle, view(&specimen, &faults, &protocol, &scatter, angle))).collect();
    let told = |(j, what): (usize, &Planted)| {
        let (angle, best) = views.iter().max_by(|a, b| a.1[j][0].total_cmp(&b.1[j][0]))?;
        let [square, contrast] = best[j];
        let mean = views.iter().map(|v| v.1[j][0]).sum::<f64>() / f64::from(VIEWS);
        Some(RadiographedDefect {
            member: member.id().to_owned(),
            defect: name(what),
            scanner: scanner.name.clone(),
            along,
            view_deg: angle.to_degrees(),
            contrast,
            contrast_to_noise: square.sqrt(),
            whole_scan: (mean * protocol.orbit.views() as f64).sqrt(),
            seen: square.sqrt() >= SEEN_FROM,
        })
    };
    Ok(planted.iter().enumerate().filter_map(told).collect())
}

fn name(planted: &Planted) -> String {
    match *planted {
        Planted::Crack(width) => format!("crack {:.2} mm wide", 1e3 * width),
        Planted::Pore(diameter) => format!("pore of {:.1} mm, the median", 1e3 * diameter),
        Planted::Loss(radius, share) => {
            format!("{:.0} % less of a bar of {:.0} mm", 100.0 * share, 2e3 * radius)
        }
    }
}

/// Scatter by columns of a coarse panel.
fn scatter(
    specimen: &Specimen,
    protocol: &Protocol,
    seed: u64,
    job: &Job,
) -> Result<Vec<f64>, Cancelled> {
    let scanner = protocol.scanner(SCATTER.0, 0.0);
    let scan = FaultyScan {
        job: job.clone(),
        links: 2,
        ..FaultyScan::new(specimen, &scanner, Vec::new(), SCATTER.1, seed)
    };
    Ok(scan.scatter(&[])?.readings)
}

/// CNR² and contrast of every fault in one view.
fn view(
    specimen: &Specimen,
    faults: &[Fault],
    protocol: &Protocol,
    scatter: &[f64],
    angle: f64,
) -> Vec<[f64; 2]> {
    let (columns, rows) = (protocol.orbit.bins() as u32, protocol.orbit.rows() as u32);
    let scanner = protocol.scanner([columns, LINES * rows], angle);
    let scan = FaultyScan::new(specimen, &scanner, faults.to_vec(), 0, 0);
    // A view's photons per m² at 1 m are per sr.
    let photons =
        protocol.fluence / scanner.intensity(scanner.panel.normal()).max(f64::MIN_POSITIVE);
    let area = f64::from(LINES) * scanner.panel.area();
    let middle: [f64; 2] = protocol.spectrum.bins().fold([0.0; 2], |[a, b], (kev, share)| {
        let signal = share * protocol.response.of(kev, 1.0);
        [a + signal, b + signal * kev]
    });
    let electronic = protocol.detector.electronic * middle[1] / middle[0];
    // Lines of one pixel lie in rows beside each other.
    let mut pixels = std::collections::BTreeMap::<u32, (f64, f64, Vec<f64>)>::new();
    for shadow in scan.shadows() {
        let (column, row) = (shadow.pixel as u32 % columns, shadow.pixel as u32 / columns / LINES);
        let entry = pixels
            .entry(row * columns + column)
            .or_insert_with(|| (0.0, 0.0, vec![0.0; faults.len()]));
        (entry.0, entry.1) = (entry.0 + shadow.signal, entry.1 + shadow.square);
        shadow.changes.iter().for_each(|&(j, change)| entry.2[j] += change / f64::from(LINES));
    }
    let mut told = vec![[0.0_f64; 2]; faults.len()];
    for (pixel, (signal, square, changes)) in pixels {
        let scattered = scatter[(pixel % columns) as usize * scatter.len() / columns as usize];
        // Of pixels at a fault's edge some lines do not meet it: what they see is like what the
        // others see.
        let size = square / signal.max(f64::MIN_POSITIVE);
        let mean = (signal / f64::from(LINES)).max(f64::MIN_POSITIVE);
        let noise = photons * area * (mean + scattered) * size + electronic * electronic;
        for (one, change) in told.iter_mut().zip(changes) {
            one[0] += (photons * area * change).powi(2) / noise;
            one[1] = one[1].max(change.abs() / (mean + scattered));
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The foot of the bundled column C4: its rusted bars and its crack are seen at once, a pore of
    /// 4 mm behind 400 mm of concrete hardly. Four times the dose doubles the ratio (electronic
    /// noise is small beside that of photons), and the whole scan sees more than its best
    /// projection but less than so many of them.
    #[test]
    fn planted_damage_is_told_by_its_dose() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let (scanner, member) = (&scene.structure.scanners[0], Subject::of(&scene, "C4").unwrap());
        let mut strong = scanner.clone();
        strong.tube.charge_mas *= 4.0;
        let [once, more] =
            [scanner, &strong].map(|s| at(s, member, 0.25, 1, &Job::default()).unwrap());
        for (a, b) in once.iter().zip(&more) {
            assert!(
                a.contrast_to_noise == 0.0
                    || (b.contrast_to_noise / a.contrast_to_noise - 2.0).abs() < 0.1,
                "{a:?} {b:?}"
            );
            let views = f64::from(scanner.orbit.projections);
            assert!(
                a.whole_scan >= a.contrast_to_noise
                    && a.whole_scan <= views.sqrt() * a.contrast_to_noise * 1.000_001,
                "{a:?}"
            );
        }
        let best = |what: &str| {
            once.iter()
                .filter(|p| p.defect.contains(what))
                .map(|p| p.contrast_to_noise)
                .fold(0.0, f64::max)
        };
        let (bar, crack, pore) = (best("less of a bar"), best("crack"), best("pore"));
        assert!(
            bar > SEEN_FROM && crack > SEEN_FROM && pore > 0.5 && pore < 20.0,
            "{bar} {crack} {pore}"
        );
    }
}
