//! Where slices come from, and what is read of one.

use std::path::PathBuf;

use intrados_damage::{
    detect::{Detection, Method, Reading, Settings, detect},
    drawn,
    grid::Grid,
    slice::Slice,
};
use intrados_scene::{Scene, Slices};
use intrados_stage::{Job, alone};
use intrados_xray::plugin::Scanned;

use crate::number::percent;

/// Steps of the histogram.
const BINS: usize = 128;

/// One slice of a member.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// Picture, and edge of a pixel in mm.
    File(PathBuf, f32),
    Drawn(drawn::Request),
    /// Slice of a scan.
    Scanned(Scanned, usize),
}

/// The slices that a scene tells of a member, each with the name of its core.
pub(super) fn told(slices: &[Slices]) -> Vec<(String, Source)> {
    let mut list = Vec::new();
    for s in slices {
        match s {
            Slices::Files { name, images, pixel_mm, .. } => {
                list.extend(images.iter().map(|image| (name.clone(), Source::File(image.clone(), *pixel_mm))));
            }
            &Slices::Drawn { ref name, count, size, pixel_mm, seed } => {
                list.extend((0..count).map(|index| (name.clone(), Source::Drawn(drawn::Request { index, count, size, pixel_mm, seed }))));
            }
        }
    }
    list
}

/// The slices of a scan.
pub(super) fn scanned(scan: &Scanned) -> Vec<(String, Source)> {
    (0..scan.restored.volume.grid.size[2]).map(|z| ("scan".to_owned(), Source::Scanned(scan.clone(), z))).collect()
}

/// A slice, and what was found in it.
pub(super) struct Read {
    pub(super) slice: Slice,
    pub(super) found: Detection,
    pub(super) caption: String,
    /// Grey that the histogram begins and ends at, and its shares of the body's pixels.
    pub(super) range: [f32; 2],
    pub(super) histogram: Vec<f64>,
    /// Mean grey of the body.
    pub(super) matrix: f32,
    /// Pore area over body area as it was planted, where that is known.
    pub(super) truth: Option<f64>,
}

/// Reads one slice, in a thread of its own: the frame's passes must not wait for it.
pub(super) fn read(scene: &Scene, member: usize, source: &Source, method: Method, job: &Job) -> Result<Read, String> {
    alone(|| {
        let (slice, truth) = load(scene, member, source)?;
        let found = find(&slice, method, job)?;
        Ok(Read::of(slice, found, truth))
    })
}

/// The porosities of slices, told one by one as they are read.
pub(super) fn profile(
    scene: &Scene,
    member: usize,
    sources: &[Source],
    method: Method,
    tell: impl Fn(usize, Result<Reading, String>) + Send + Sync,
    job: &Job,
) -> Result<(), String> {
    alone(|| {
        for (k, source) in sources.iter().enumerate() {
            // Of the detection's own steps nobody needs to know.
            job.step(k, sources.len()).map_err(|e| e.to_string())?;
            tell(k, load(scene, member, source).and_then(|(slice, _)| Ok(find(&slice, method, &Job::default())?.porosity)));
        }
        Ok(())
    })
}

fn find(slice: &Slice, method: Method, job: &Job) -> Result<Detection, String> {
    detect(slice, &Settings { method, ..Settings::default() }, job).map_err(|e| e.to_string())
}

fn load(scene: &Scene, member: usize, source: &Source) -> Result<(Slice, Option<f64>), String> {
    match source {
        Source::File(path, pixel_mm) => Ok((Slice::read(path, *pixel_mm).map_err(|e| e.to_string())?, None)),
        // Its name says that it was drawn and not scanned.
        Source::Drawn(request) => {
            let drawn = drawn::draw(scene, member, *request)?;
            Ok((drawn.slice, Some(drawn.porosity)))
        }
        Source::Scanned(scan, z) => Ok(layer(scan, *z)),
    }
}

/// A slice of a scan with y up, and its true porosity.
fn layer(scan: &Scanned, z: usize) -> (Slice, Option<f64>) {
    use intrados_xray::specimen::concrete::{Label, OUTSIDE};
    let volume = &scan.restored.volume;
    let [width, height, _] = volume.grid.size;
    let lines: Vec<&[f32]> = volume.slice(z).chunks(width.max(1)).rev().collect();
    let data = lines.concat();
    let n = width * height;
    let labels = scan.acquisition.target.truth.labels.get(z * n..(z + 1) * n).unwrap_or_default();
    let count = |is: &dyn Fn(u8) -> bool| labels.iter().filter(|l| is(**l)).count() as f64;
    let body = count(&|l| l != OUTSIDE && l != Label::Steel as u8);
    let truth = (body > 0.0).then(|| count(&|l| l == Label::Pore as u8) / body);
    let name = format!("scanned slice {}, {:.0} keV", z + 1, scan.restored.kev);
    (Slice { name, grey: Grid { width, height, data }, pixel_mm: (1e3 * volume.grid.voxel[0]) as f32 }, truth)
}

impl Read {
    fn of(slice: Slice, found: Detection, truth: Option<f64>) -> Self {
        let body: Vec<f32> = slice.grey.data.iter().zip(&found.body.data).filter(|(_, inside)| **inside).map(|(grey, _)| *grey).collect();
        let matrix = (body.iter().map(|v| f64::from(*v)).sum::<f64>() / body.len().max(1) as f64) as f32;
        let (low, high) = body.iter().fold((0.0_f32, 1.3 * matrix), |(low, high), v| (low.min(*v), high.max(*v)));
        // A few bright bars must not squeeze all of the concrete into one step.
        let range = [low.max(-0.3 * matrix), high.min(2.5 * matrix).max(low + f32::MIN_POSITIVE)];
        let mut histogram = vec![0.0; BINS];
        for v in &body {
            let at = (v - range[0]) / (range[1] - range[0]) * BINS as f32;
            histogram[(at.max(0.0) as usize).min(BINS - 1)] += 1.0 / body.len() as f64;
        }
        let caption = format!(
            "{}: {} × {} pixels of {:.3} mm, porosity {} ± {}{}",
            slice.name,
            slice.grey.width,
            slice.grey.height,
            slice.pixel_mm,
            percent(found.porosity.value),
            percent(found.porosity.std_error),
            truth.map_or_else(String::new, |t| format!(" (planted {})", percent(t)))
        );
        Self { slice, found, caption, range, histogram, matrix, truth }
    }

    /// Black and white that suit concrete: nothing, and a little more than the concrete, so that metal is white.
    pub(super) fn suitable(&self) -> [f32; 2] {
        [0.0, 1.3 * self.matrix]
    }

    /// The pore at a pixel or within `reach` pixels of it, the nearest by its outline.
    pub(super) fn pore_at(&self, x: f32, y: f32, reach: f32) -> Option<u32> {
        let labels = &self.found.labels;
        let r = reach.ceil() as isize;
        let (cx, cy) = (x.floor() as isize, y.floor() as isize);
        let mut best = None;
        for (dx, dy) in (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx, dy))) {
            let (px, py) = (cx + dx, cy + dy);
            let inside = px >= 0 && py >= 0 && (px as usize) < labels.width && (py as usize) < labels.height;
            let far = ((dx * dx + dy * dy) as f32).sqrt();
            if !inside || far > reach {
                continue;
            }
            let label = labels.data[py as usize * labels.width + px as usize];
            let is_pore = label != 0 && self.found.pores.iter().any(|p| p.label == label);
            if is_pore && best.is_none_or(|(least, _)| far < least) {
                best = Some((far, label));
            }
        }
        best.map(|(_, label)| label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of concrete with one pore in the upper right.
    fn disc() -> Read {
        let grey = |i: usize| {
            let from = |x: f32, y: f32| ((i % 100) as f32 - x).hypot((i / 100) as f32 - y);
            if from(50.0, 50.0) > 45.0 {
                0.0
            } else if from(60.0, 40.0) < 4.0 {
                600.0
            } else {
                1000.0
            }
        };
        let grey = Grid { width: 100, height: 100, data: (0..10_000).map(grey).collect() };
        let slice = Slice { name: "disc".into(), grey, pixel_mm: 0.1 };
        let found = find(&slice, Method::Classical, &Job::default()).unwrap();
        Read::of(slice, found, None)
    }

    #[test]
    fn a_click_beside_a_pore_finds_it_and_one_far_from_it_does_not() {
        let read = disc();
        let label = read.found.pores[0].label;
        assert_eq!(read.pore_at(60.0, 40.0, 0.0), Some(label));
        assert_eq!(read.pore_at(66.5, 40.0, 4.0), Some(label));
        assert_eq!(read.pore_at(66.5, 40.0, 1.0), None);
        assert_eq!(read.pore_at(-50.0, 400.0, 4.0), None);
    }

    #[test]
    fn the_histogram_has_all_of_the_body_in_it() {
        let read = disc();
        assert!((read.histogram.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        // One step holds the matrix, another the pore.
        assert_eq!(read.histogram.iter().filter(|h| **h > 0.0).count(), 2);
        assert!(read.suitable()[1] > 1000.0 && read.truth.is_none());
    }
}
