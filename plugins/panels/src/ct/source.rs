//! Where slices come from, and what is read of one.

use glam::Vec3;
use intrados_ct::{
    detect::{DetectSettings, Detection, Method, detect},
    slice::Slice,
    source::{Known, Origin, SliceRead, SliceShelf, SliceSource},
    synthetic::scanned::layer,
};
use intrados_scene::{AxisRuns, Scene};
use intrados_stage::{Estimate, Job, alone};
use intrados_xray::plugin::Scanned;

use crate::{lang::fixed, number::percent};

/// Steps of the histogram.
const BINS: usize = 128;

/// One slice of a member.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// A slice that the scene tells of: the prediction reads the same.
    Told(SliceSource),
    /// Slice of a scan that somebody took here.
    Taken(Scanned, usize),
}

/// The slices that a scene tells of a member, each with the name of its core.
pub(super) fn told(scene: &Scene, member: usize) -> Vec<(String, Source)> {
    SliceSource::of_member(scene, member)
        .into_iter()
        .map(|source| (source.core.clone(), Source::Told(source)))
        .collect()
}

/// The slices of a scan.
pub(super) fn scanned(scan: &Scanned) -> Vec<(String, Source)> {
    (0..scan.restored.volume.grid.size[2])
        .map(|z| (tr!("scan"), Source::Taken(scan.clone(), z)))
        .collect()
}

/// Where a slice lies in the structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    /// A point of it, m.
    pub(crate) at: Vec3,
    /// Unit, across it.
    pub(crate) normal: Vec3,
}

impl Plane {
    /// Of a slice across its member, `offset_m` from the place of its core along the axis. How
    /// others are turned about the axis, nobody knows.
    fn across(scene: &Scene, source: &SliceSource, offset_m: f64) -> Option<Self> {
        let frame = scene.members.get(source.member)?.frame;
        let normal = frame.axis.try_normalize()?;
        let along = source.along().filter(|_| source.axis() == Some(AxisRuns::Through))?;
        Some(Self { at: frame.point(along as f32) + offset_m as f32 * normal, normal })
    }

    /// Of slice `z` of a scan.
    fn scanned(scan: &Scanned, z: usize) -> Option<Self> {
        let place = scan.acquisition.target.place?;
        let normal = place.axes[2];
        let at = place.origin + scan.restored.volume.grid.at(2, z) * normal;
        Some(Self { at: at.as_vec3(), normal: normal.as_vec3() })
    }
}

/// A slice, and what was found in it.
pub(super) struct Read {
    pub(super) slice: Slice,
    pub(super) found: Detection,
    /// Grey that the histogram begins and ends at, and its shares of the body's pixels.
    pub(super) range: [f32; 2],
    pub(super) histogram: Vec<f64>,
    /// Mean grey of the body.
    pub(super) matrix: f32,
    /// Pore area over body area as it was planted, where that is known.
    pub(super) truth: Option<f64>,
    /// Where it lies; none: nobody knows.
    pub(super) plane: Option<Plane>,
}

/// Reads one slice, in a thread of its own: the frame's passes must not wait for it.
pub(super) fn read(
    scene: &Scene,
    source: &Source,
    method: Method,
    shelf: &SliceShelf,
    job: &Job,
) -> Result<Read, String> {
    alone(|| {
        let (slice, found, truth, plane) = load(scene, source, method, shelf, job)?;
        Ok(Read { plane, ..Read::of(slice, found, truth) })
    })
}

/// The porosities of slices, told one by one as they are read.
pub(super) fn profile(
    scene: &Scene,
    sources: &[Source],
    method: Method,
    shelf: &SliceShelf,
    tell: impl Fn(usize, Result<Estimate, String>) + Send + Sync,
    job: &Job,
) -> Result<(), String> {
    alone(|| {
        // Of the steps of one slice nobody needs to know.
        let quiet = Job::default();
        for (k, source) in sources.iter().enumerate() {
            job.step(k, sources.len()).map_err(|e| e.to_string())?;
            tell(
                k,
                load(scene, source, method, shelf, &quiet).map(|(_, found, ..)| found.porosity),
            );
        }
        Ok(())
    })
}

impl Source {
    /// How it is read by a method: of the networks the one that knows slices of its kind.
    fn settings(&self, method: Method) -> DetectSettings {
        let is_scan = match self {
            Self::Told(source) => source.origin() == Origin::Scanned,
            Self::Taken(..) => true,
        };
        if is_scan && method == Method::Network {
            DetectSettings::of_members()
        } else {
            DetectSettings { method, ..DetectSettings::default() }.in_members()
        }
    }
}

/// The slice, what was found in it, its planted porosity where it was made, and where it lies.
fn load(
    scene: &Scene,
    source: &Source,
    method: Method,
    shelf: &SliceShelf,
    job: &Job,
) -> Result<(Slice, Detection, Option<f64>, Option<Plane>), String> {
    let how = source.settings(method);
    match source {
        Source::Told(source) => {
            let SliceRead { slice, found, known, offset_m, .. } =
                source.read(scene, &how, shelf, job).map_err(|e| e.to_string())?;
            let made = known.filter(|k| !matches!(k, Known::Labels(_)));
            let truth = made.map(|known| known.truth(&found, &how).0);
            Ok((slice, found, truth, Plane::across(scene, source, offset_m)))
        }
        Source::Taken(scan, z) => {
            let layer = layer(&scan.acquisition, &scan.restored, *z);
            let found = detect(&layer.slice, &how, job).map_err(|e| e.to_string())?;
            Ok((layer.slice, found, Some(layer.porosity), Plane::scanned(scan, *z)))
        }
    }
}

impl Read {
    fn of(slice: Slice, found: Detection, truth: Option<f64>) -> Self {
        let body: Vec<f32> = slice
            .grey
            .data
            .iter()
            .zip(&found.body.data)
            .filter(|(_, inside)| **inside)
            .map(|(grey, _)| *grey)
            .collect();
        let matrix =
            (body.iter().map(|v| f64::from(*v)).sum::<f64>() / body.len().max(1) as f64) as f32;
        let (low, high) =
            body.iter().fold((0.0_f32, 1.3 * matrix), |(low, high), v| (low.min(*v), high.max(*v)));
        // A few bright bars must not squeeze all of the concrete into one step.
        let range = [low.max(-0.3 * matrix), high.min(2.5 * matrix).max(low + f32::MIN_POSITIVE)];
        let mut histogram = vec![0.0; BINS];
        for v in &body {
            let at = (v - range[0]) / (range[1] - range[0]) * BINS as f32;
            histogram[(at.max(0.0) as usize).min(BINS - 1)] += 1.0 / body.len() as f64;
        }
        Self { slice, found, range, histogram, matrix, truth, plane: None }
    }

    /// Name, size and porosity.
    pub(super) fn caption(&self) -> String {
        let Self { slice, found, .. } = self;
        let caption = tr!(
            "{}: {} × {} pixels of {} mm, porosity {} ± {}",
            slice.name,
            slice.grey.width,
            slice.grey.height,
            fixed(slice.pixel_mm, 3),
            percent(found.porosity.value),
            percent(found.porosity.std_error)
        );
        match self.truth {
            None => caption,
            Some(truth) => tr!("{} (planted {})", caption, percent(truth)),
        }
    }

    /// Black and white that suit concrete: nothing, and a little more than the concrete, so that
    /// metal is white.
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
            let inside =
                px >= 0 && py >= 0 && (px as usize) < labels.width && (py as usize) < labels.height;
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
    use intrados_raster::grid::Grid;

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
        let found = detect(&slice, &DetectSettings::default(), &Job::default()).unwrap();
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
