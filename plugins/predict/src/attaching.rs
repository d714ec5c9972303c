//! What is looked at before evidence is attached, by whoever attaches it: whether a prediction could
//! use it, and what speaks against it.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use intrados_ct::{Picture, Slice, Slices, source::SliceSource};
use intrados_gauges::monitoring;
use intrados_scene::{
    Scene,
    attach::{Attachment, Cut, Proposal, What},
};
use intrados_stage::Job;
use intrados_survey::photographed::{self, PhotoError};

/// Why something is not attached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// It does not fit; one line.
    #[error("{0}")]
    Because(String),
    /// Somebody asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Refuses what a prediction would not use; gives what the user should know of the rest.
///
/// # Errors
/// [`Unfit`].
pub fn examine(
    proposal: &Proposal<'_>,
    what: &Attachment,
    job: &Job,
) -> Result<Vec<String>, Unfit> {
    let given: &[PathBuf] = match &what.what {
        What::Slices { files, .. } | What::Stack { files, .. } => files,
        What::Photograph { files, .. } => files,
        What::Table { file, .. } => std::slice::from_ref(file),
        What::Finding(_) | What::LoadTest { .. } => &[],
    };
    let mut notes = doubts(proposal, what, given)?;
    notes.extend(placed(proposal, what, job)?);
    notes.extend(proposal.notes.iter().cloned());
    notes.extend(unused_readings(proposal));
    Ok(notes)
}

/// Which of the readings that are attached no prediction uses, and why: one line for each reason.
fn unused_readings(proposal: &Proposal<'_>) -> Vec<String> {
    let scene = &proposal.scene;
    let is_added = |kind: &str, gauge: &str| {
        proposal.added.iter().any(|one| one.kind == kind && one.name == gauge)
    };
    let structure = &scene.structure;
    let readings = structure.readings.iter().filter(|r| is_added("gauge", &r.of));
    let readings = readings.filter_map(|r| Some((&r.of, intrados_gauges::refusal(scene, r)?)));
    let series = structure.series.iter().filter(|s| is_added("monitoring", &s.gauge));
    let series = series.filter_map(|s| Some((&s.gauge, monitoring::refusal(scene, s)?)));
    let mut reasons: HashSet<String> = HashSet::new();
    readings
        .chain(series)
        .filter(|(_, why)| reasons.insert(why.clone()))
        .map(|(gauge, why)| format!("gauge {gauge}: not used, because {why}"))
        .collect()
}

/// Refuses what a report cannot show as a photograph of a finding.
///
/// # Errors
/// [`Unfit`].
pub fn picture(file: &Path) -> Result<(), Unfit> {
    let ending = file.extension().unwrap_or_default().to_ascii_lowercase();
    let bad = |why| Err(Unfit::Because(format!("{}: {why}", file.display())));
    match ["jpg", "jpeg", "png"].iter().any(|known| ending == *known) {
        false => bad("is neither a JPEG nor a PNG: convert it"),
        true if file.is_file() && Picture::read(file, 8).is_none() => {
            bad("is no picture, or larger than 20 000 pixels: save it again")
        }
        true => Ok(()),
    }
}

/// Refuses slices that a prediction would not use; gives what their files say against it.
fn doubts(
    proposal: &Proposal<'_>,
    what: &Attachment,
    given: &[PathBuf],
) -> Result<Vec<String>, Unfit> {
    let scene = &proposal.scene;
    let member = scene.members.iter().position(|m| m.id == what.member).unwrap_or_default();
    let mut doubts = Vec::new();
    let ours = |slice: &SliceSource| slice.core == proposal.name;
    for slice in SliceSource::of_member(scene, member).into_iter().filter(ours) {
        if let Some(why) = slice.refusal(scene) {
            return Err(Unfit::Because(as_given(&why, given)));
        }
        doubts.extend(slice.doubt().map(|doubt| as_given(&doubt, given)));
    }
    if let What::Slices { files, pixel_mm, cut } = &what.what {
        let is_label = |file: &&PathBuf| file.to_string_lossy().contains("_mask-");
        for file in files.iter().filter(|file| !is_label(file)) {
            if let Some(why) = too_wide(scene, member, file, *pixel_mm, cut) {
                return Err(Unfit::Because(why));
            }
        }
    }
    Ok(doubts)
}

/// How much wider than its core, or than its member from corner to corner, what a picture shows may
/// be.
const WIDER: f64 = 1.1;

/// Why what a picture shows is larger than what it was cut out of: its pixels are not so large.
fn too_wide(
    scene: &Scene,
    index: usize,
    path: &Path,
    pixel_mm: Option<f32>,
    cut: &Cut,
) -> Option<String> {
    let picture = Slices::open(path, pixel_mm).ok()?.only().ok()?;
    let [wide, thin] = shown_mm(&picture);
    let member = scene.members.get(index)?;
    let size = f64::from((member.bounds[1] - member.bounds[0]).length()) * 1e3;
    let pixel = picture.pixel_mm;
    let path = path.display();
    match cut.diameter_mm.map(f64::from) {
        // Across, it is as wide as the core; along, as thin.
        Some(core) if thin > WIDER * core => Some(format!(
            "{path}: at {pixel} mm a pixel what it shows is {thin:.0} mm across, and the core {core} mm: is --pixel-mm in µm, or --diameter-mm wrong?"
        )),
        _ if size > 0.0 && wide > WIDER * size => Some(format!(
            "{path}: at {pixel} mm a pixel what it shows is {:.1} m wide, and {} {:.1} m from corner to corner: is the pixel in µm? write {}",
            wide / 1e3,
            member.name,
            size / 1e3,
            pixel / 1000.0
        )),
        _ => None,
    }
}

/// Sides of the box around what is not air, mm, the longer one first: what is brighter than the
/// middle between the darkest and the brightest hundredth.
fn shown_mm(slice: &Slice) -> [f64; 2] {
    let (width, height) = (slice.grey.width, slice.grey.height);
    let mut sorted: Vec<f32> = slice.grey.data.iter().copied().filter(|g| g.is_finite()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let rank = |share: usize| sorted.get((sorted.len().saturating_sub(1)) * share / 100);
    let [Some(dark), Some(bright)] = [rank(1), rank(99)] else { return [0.0; 2] };
    let middle = 0.5 * (dark + bright);
    // A line of which so little is bright is noise.
    let is_seen = |bright: usize, of: usize| 20 * bright > of;
    let extent = |lines: usize, of: usize, at: &dyn Fn(usize, usize) -> usize| {
        let seen = (0..lines).filter(|&line| {
            let bright = (0..of)
                .filter(|&k| slice.grey.data.get(at(line, k)).is_some_and(|grey| *grey > middle));
            is_seen(bright.count(), of)
        });
        let ends = seen.fold([usize::MAX, 0], |[a, b], line| [a.min(line), b.max(line)]);
        (ends[1] + 1).saturating_sub(ends[0]) as f64 * f64::from(slice.pixel_mm)
    };
    let across = extent(width, height, &|column, row| row * width + column);
    let down = extent(height, width, &|row, column| row * width + column);
    [across.max(down), across.min(down)]
}

/// Refuses a photograph that cannot be placed; says from where it was taken.
fn placed(proposal: &Proposal<'_>, what: &Attachment, job: &Job) -> Result<Option<String>, Unfit> {
    let What::Photograph { files, .. } = &what.what else { return Ok(None) };
    let all = &proposal.scene.structure.photographs;
    let ours = all.iter().find(|p| p.member == what.member && p.name == proposal.name);
    let Some(photo) = ours else { return Ok(None) };
    match photographed::placed(&proposal.scene, photo, job) {
        Ok((_, _, located)) => {
            let [x, y, z] = located.pose.position.to_array();
            let rms = located.rms_px;
            Ok(Some(format!("taken from ({x:.2}, {y:.2}, {z:.2}) m, picks fit to {rms:.1} pixels")))
        }
        Err(PhotoError::Cancelled(_)) => Err(Unfit::Cancelled),
        Err(PhotoError::Because(why)) => {
            let given = as_given(&why, files);
            let named = files.iter().any(|f| given.contains(&f.display().to_string()));
            let line = if named { given } else { format!("{}: {given}", files[0].display()) };
            Err(Unfit::Because(line))
        }
    }
}

/// A message about a copy, about the file that it was made of.
fn as_given(message: &str, given: &[PathBuf]) -> String {
    let named = |file: &&PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        message.split_once(": ").is_some_and(|(path, _)| {
            Path::new(path).file_name().is_some_and(|n| n.to_string_lossy() == name)
        })
    };
    let rest = message.split_once(": ").map_or(message, |(_, rest)| rest);
    given
        .iter()
        .find(named)
        .map_or_else(|| message.to_owned(), |file| format!("{}: {rest}", file.display()))
}
