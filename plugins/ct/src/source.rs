//! Where slices of a scene's members come from: files, drawings, simulated scans. The prediction
//! and the window read them here, and so refuse the same ones.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use intrados_scene::{AxisRuns, Drilled, Scene, Slices};
use intrados_stage::Job;
use intrados_xray::volume::{Reader, VolumeError};
use serde::{Deserialize, Serialize};

use crate::{
    SliceError,
    crack::{self, Crack},
    detect::{DetectSettings, Detection, detect},
    slice::{self, PixelFrom, Slice, read_masks},
    stack::{self, Normal, Plane, Section},
    synthetic::{
        drawn,
        scanned::{self, Layer},
    },
};
use intrados_raster::grid::Mask;

/// Where a slice comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// A file of real data.
    File,
    /// Drawn from the planted truth.
    Drawn,
    /// A simulated scan of the planted truth.
    Scanned,
}

impl Origin {
    /// Its name, as in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Drawn => "drawn",
            Self::Scanned => "scanned",
        }
    }
}

/// One slice that can be read.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceSource {
    /// The member that it is of, by its place in the scene's list.
    pub member: usize,
    /// Name of the core.
    pub core: String,
    /// Number of that core among those of the scene.
    pub number: usize,
    what: What,
}

#[derive(Debug, Clone, PartialEq)]
enum What {
    File { image: PathBuf, masks: Vec<PathBuf>, pixel_mm: Option<f32>, drilled: Drilled },
    Drawn(drawn::Request),
    Stack { images: Arc<[PathBuf]>, voxel_mm: Option<[f32; 3]>, plane: Plane, drilled: Drilled },
    Scanned(scanned::Request),
}

/// A slice that was read.
#[derive(Debug)]
pub struct SliceRead {
    /// The picture.
    pub slice: Slice,
    /// What was found in it.
    pub found: Detection,
    /// What is known of it beforehand.
    pub known: Option<Known>,
    /// What the file's own tags say of its pixels, where that contradicts the scene.
    pub doubt: Option<String>,
    /// From the place of its source to its own, along the member's axis, m.
    pub offset_m: f64,
}

/// What is known of a slice beforehand.
#[derive(Debug, Clone)]
pub enum Known {
    /// What was drawn.
    Drawn(Arc<drawn::Drawn>),
    /// What was scanned.
    Scanned(Arc<Layer>),
    /// Labels of pores and cracks.
    Labels(Mask),
}

/// What was scanned of a scene, since a scan takes half a minute, and the sections of the volume
/// that was cut last. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct SliceShelf(Arc<Mutex<Shelf>>);

#[derive(Debug, Default)]
struct Shelf {
    /// Hash of the scene that all of it is of.
    scene: String,
    scanned: Vec<Ordered>,
    cut: Option<(Volume, Sections)>,
}

/// The files of a volume, and the edges of its voxels where they are given, mm.
type Volume = (Arc<[PathBuf]>, Option<[f32; 3]>);

/// Sections along [`Plane::all`].
type Sections = Arc<Vec<Option<Section>>>;

/// What was scanned of a member.
#[derive(Debug)]
struct Ordered {
    member: usize,
    request: scanned::Request,
    layer: Arc<Layer>,
}

impl SliceShelf {
    /// From the shelf, or scanned and put there.
    fn fetch(
        &self,
        scene: &Scene,
        member: usize,
        request: &scanned::Request,
        job: &Job,
    ) -> Result<Arc<Layer>, SliceError> {
        let is_it = |o: &&Ordered| o.member == member && o.request == *request;
        if let Some(found) = self.of(scene).scanned.iter().find(is_it) {
            return Ok(Arc::clone(&found.layer));
        }
        let layer = Arc::new(scanned::scan(scene, &scene.members[member], request, job)?);
        let ordered = Ordered { member, request: request.clone(), layer: Arc::clone(&layer) };
        self.of(scene).scanned.push(ordered);
        Ok(layer)
    }

    /// From the shelf, or cut, if it `fits`, and put there in place of what was cut before.
    fn sections(
        &self,
        scene: &Scene,
        volume: &Volume,
        fits: impl FnOnce() -> Result<(), SliceError>,
        job: &Job,
    ) -> Result<Sections, SliceError> {
        if let Some((of, sections)) = &self.of(scene).cut
            && of == volume
        {
            return Ok(Arc::clone(sections));
        }
        fits()?;
        let (images, voxel_mm) = volume;
        let sections = Arc::new(stack::sections(images, *voxel_mm, &Plane::all(), job)?);
        self.of(scene).cut = Some((volume.clone(), Arc::clone(&sections)));
        Ok(sections)
    }

    /// What there is of a scene; of another one all is thrown away.
    fn of(&self, scene: &Scene) -> MutexGuard<'_, Shelf> {
        let mut shelf = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if shelf.scene != scene.hash {
            *shelf = Shelf { scene: scene.hash.clone(), ..Shelf::default() };
        }
        shelf
    }
}

impl SliceSource {
    /// All slices of a scene.
    #[must_use]
    pub fn all(scene: &Scene) -> Vec<Self> {
        (0..scene.members.len()).flat_map(|member| Self::of_member(scene, member)).collect()
    }

    /// All slices of one member.
    #[must_use]
    pub fn of_member(scene: &Scene, member: usize) -> Vec<Self> {
        let first: usize = scene.members.iter().take(member).map(|m| m.slices.len()).sum();
        let mut all = Vec::new();
        for (k, slices) in scene.members.get(member).into_iter().flat_map(|m| &m.slices).enumerate()
        {
            let source =
                |core: &String, what| Self { member, core: core.clone(), number: first + k, what };
            match slices {
                Slices::Files { name, images, masks, pixel_mm, drilled } => {
                    all.extend(images.iter().enumerate().map(|(k, image)| {
                        let masks = masks.get(k).cloned().unwrap_or_default();
                        source(
                            name,
                            What::File {
                                image: image.clone(),
                                masks,
                                pixel_mm: *pixel_mm,
                                drilled: *drilled,
                            },
                        )
                    }))
                }
                Slices::Stack { name, images, voxel_mm, drilled } => {
                    let images: Arc<[PathBuf]> = images.as_slice().into();
                    all.extend(Plane::all().into_iter().map(|plane| {
                        source(
                            name,
                            What::Stack {
                                images: Arc::clone(&images),
                                voxel_mm: *voxel_mm,
                                plane,
                                drilled: *drilled,
                            },
                        )
                    }));
                }
                &Slices::Drawn { ref name, count, size, pixel_mm, seed } => {
                    let request = |index| drawn::Request { index, count, size, pixel_mm, seed };
                    all.extend(
                        (0..count.min(drawn::MOST_SLICES))
                            .map(|index| source(name, What::Drawn(request(index)))),
                    );
                }
                Slices::Scanned { name, scanner, along, seed } => {
                    all.extend(along.iter().map(|&along| {
                        source(
                            name,
                            What::Scanned(scanned::Request {
                                scanner: scanner.clone(),
                                along,
                                seed: *seed,
                            }),
                        )
                    }))
                }
            }
        }
        all
    }

    /// What it is called in the ledger of evidence.
    #[must_use]
    pub fn label(&self) -> String {
        let core = &self.core;
        match &self.what {
            What::File { image, .. } => format!("{core}, {}", image.display()),
            What::Stack { images, plane, .. } => {
                let file = images.first().map_or(Path::new(""), PathBuf::as_path).display();
                let way = match plane.normal {
                    Normal::X => "across x",
                    Normal::Y => "across y",
                    Normal::Z => "slice",
                };
                format!("{core}, {file}, {way} at {:.0} %", 100.0 * plane.share)
            }
            What::Drawn(request) => {
                format!("{core}, section {} of {}", request.index + 1, request.count)
            }
            What::Scanned(request) => format!("{core}, scanned at {} of the axis", request.along),
        }
    }

    /// Where it comes from.
    #[must_use]
    pub fn origin(&self) -> Origin {
        match self.what {
            What::File { .. } | What::Stack { .. } => Origin::File,
            What::Drawn(_) => Origin::Drawn,
            What::Scanned(_) => Origin::Scanned,
        }
    }

    /// Its place on the member's axis, 0 to 1; none where nobody knows it.
    #[must_use]
    pub fn along(&self) -> Option<f64> {
        match &self.what {
            What::File { drilled, .. } | What::Stack { drilled, .. } => {
                drilled.along.map(f64::from)
            }
            What::Drawn(request) => Some(request.along()),
            What::Scanned(request) => Some(f64::from(request.along)),
        }
    }

    /// Where it was drilled, as far as the scene says; none of slices that were made.
    #[must_use]
    pub fn drilled(&self) -> Option<Drilled> {
        match &self.what {
            What::File { drilled, .. } | What::Stack { drilled, .. } => Some(*drilled),
            What::Drawn(_) | What::Scanned(_) => None,
        }
    }

    /// Which way the member's axis runs in its picture; none: nobody knows.
    #[must_use]
    pub fn axis(&self) -> Option<AxisRuns> {
        match &self.what {
            What::File { drilled, .. } => drilled.axis,
            What::Stack { drilled, plane, .. } => drilled.axis.map(|axis| plane.axis(axis)),
            What::Drawn(_) | What::Scanned(_) => Some(AxisRuns::Through),
        }
    }

    /// Whether it lies across its member, as far as anybody knows.
    fn is_across(&self) -> bool {
        match &self.what {
            What::Stack { plane, drilled, .. } if drilled.axis.is_none() => {
                plane.normal == Normal::Z
            }
            _ => !matches!(self.axis(), Some(AxisRuns::Right | AxisRuns::Down)),
        }
    }

    /// Why it will not be used, as far as can be told without looking for damage in it; none where
    /// nothing is known against it.
    #[must_use]
    pub fn refusal(&self, scene: &Scene) -> Option<String> {
        let looked = match &self.what {
            What::File { image, masks, pixel_mm, .. } => {
                opened(scene, self.member, image, *pixel_mm, self.longest_mm(scene))
                    .and_then(|mut file| pixels(&mut file, masks).map_err(SliceError::from))
                    .map(drop)
            }
            What::Stack { images, voxel_mm, .. } => self.piled(scene, images, *voxel_mm),
            What::Drawn(_) | What::Scanned(_) => Ok(()),
        };
        looked.err().map(|why| why.to_string())
    }

    /// What the file's own tags say of its pixels against the scene.
    #[must_use]
    pub fn doubt(&self) -> Option<String> {
        let (image, pixel_mm) = match &self.what {
            What::File { image, pixel_mm, .. } => (image, pixel_mm),
            What::Stack { images, voxel_mm, plane, .. } => {
                // Said once of all sections.
                return (Plane::all().first() == Some(plane))
                    .then(|| pile_doubts(images, *voxel_mm))
                    .flatten();
            }
            What::Drawn(_) | What::Scanned(_) => return None,
        };
        slice::Slices::open(image, *pixel_mm).ok()?.doubt()
    }

    /// What its section was designed as, where a slice of this size shows all of it.
    #[must_use]
    pub fn design(&self, scene: &Scene, slice: &Slice) -> Option<drawn::Design> {
        // Of a core's outline nothing follows.
        if !self.is_across() || self.drilled().is_some_and(|d| d.diameter_mm.is_some()) {
            return None;
        }
        let size = u32::try_from(slice.grey.width.max(slice.grey.height)).ok()?;
        // Where nobody knows where it lies, the middle stands for all.
        drawn::designed(
            scene,
            self.member,
            drawn::Request::at(self.along().unwrap_or(0.5), size, slice.pixel_mm),
        )
    }

    /// Reads it by `how`.
    ///
    /// # Errors
    /// The file or its labels are missing or damaged, it cannot be one of its member, or the job
    /// was cancelled.
    pub fn read(
        &self,
        scene: &Scene,
        how: &DetectSettings,
        shelf: &SliceShelf,
        job: &Job,
    ) -> Result<SliceRead, SliceError> {
        let (mut doubt, mut offset_m) = (None, 0.0);
        let (slice, known) = match &self.what {
            What::File { image, masks, pixel_mm, .. } => {
                let longest = self.longest_mm(scene);
                let mut file = opened(scene, self.member, image, *pixel_mm, longest)?;
                doubt = file.doubt();
                let (slice, labels) = pixels(&mut file, masks)?;
                (slice, labels.map(Known::Labels))
            }
            What::Stack { images, voxel_mm, plane, drilled } => {
                if Plane::all().first() == Some(plane) {
                    doubt = pile_doubts(images, *voxel_mm);
                }
                let volume = (Arc::clone(images), *voxel_mm);
                let fits = || self.piled(scene, images, *voxel_mm);
                let sections = shelf.sections(scene, &volume, fits, job)?;
                let planes = Plane::all();
                let at = planes.iter().position(|p| p == plane).unwrap_or_default();
                let Some(section) = sections.get(at).and_then(Option::as_ref) else {
                    let why = "its slices lie too far apart for sections along them";
                    return Err(SliceError::Unfit(format!("{}: {why}", self.label())));
                };
                let mm = section.from_middle_mm;
                offset_m = drilled.axis.map_or(0.0, |axis| {
                    1e-3 * match axis {
                        AxisRuns::Right => mm[0],
                        AxisRuns::Down => mm[1],
                        AxisRuns::Through => mm[2],
                    }
                });
                (section.slice.clone(), None)
            }
            What::Drawn(request) => {
                let member = || scene.members[self.member].name.clone();
                let drawn = drawn::draw(scene, self.member, *request)
                    .map_err(|reason| SliceError::Drawn { member: member(), reason })?;
                (drawn.slice.clone(), Some(Known::Drawn(Arc::new(drawn))))
            }
            What::Scanned(request) => {
                let layer = shelf.fetch(scene, self.member, request, job)?;
                (layer.slice.clone(), Some(Known::Scanned(layer)))
            }
        };
        let found = detect(&slice, how, job)?;
        if let Some(drilled) = &self.drilled() {
            fits(scene, self.member, drilled, self.longest_mm(scene), &slice, &found)?;
        }
        Ok(SliceRead { slice, found, known, doubt, offset_m })
    }

    /// The longest that its picture may show of its member, mm; none: its section is.
    fn longest_mm(&self, scene: &Scene) -> Option<f64> {
        let is_pile = matches!(self.what, What::Stack { .. });
        let along = !self.is_across() || (is_pile && self.axis().is_none());
        along.then(|| 1e3 * f64::from(scene.members[self.member].frame.axis.length()))
    }

    /// Refuses a volume whose headers do not fit, or of which nobody knows how large it is.
    fn piled(
        &self,
        scene: &Scene,
        images: &[PathBuf],
        voxel_mm: Option<[f32; 3]>,
    ) -> Result<(), SliceError> {
        let voxel = voxel_mm.map(|edges| edges.map(|mm| 1e-3 * f64::from(mm)));
        let reader = Reader::pile(images.to_vec(), voxel)?;
        let grid = reader.grid();
        let sides = [0, 1, 2].map(|k| 1e3 * grid.voxel[k] * grid.size[k] as f64);
        let member = &scene.members[self.member];
        let longest = widest_mm(scene, self.member)
            .unwrap_or(f64::INFINITY)
            .max(1e3 * f64::from(member.frame.axis.length()));
        let (least, most) = (sides[0].min(sides[1]), sides.into_iter().fold(0.0, f64::max));
        let path = reader.path().display();
        let unfit = |why: String| Err(SliceError::Unfit(format!("{path}: {why}")));
        match () {
            () if most > WIDEST[0] * longest => unfit(format!(
                "the volume is {} long and the member {}: voxel_mm in µm?",
                length(most),
                length(longest)
            )),
            () if least < NARROWEST_MM => unfit(format!(
                "the volume is {} wide, hardly a grain: voxel_mm in m or cm?",
                length(least)
            )),
            () => Ok(()),
        }
    }
}

/// What the user should know of a volume before it counts.
fn pile_doubts(images: &[PathBuf], voxel_mm: Option<[f32; 3]>) -> Option<String> {
    let voxel = voxel_mm.map(|edges| edges.map(|mm| 1e-3 * f64::from(mm)));
    let reader = Reader::pile(images.to_vec(), voxel).ok()?;
    let mut doubts = reader.doubts().to_vec();
    // What a given size answers is no question any more.
    if voxel.is_some() {
        let is_asked = |d: &String| {
            d.ends_with("give the edge of a pixel")
                || d.contains(" mm apart")
                || d.ends_with("give voxel_mm")
        };
        doubts.retain(|d| !is_asked(d));
    }
    (!doubts.is_empty()).then(|| doubts.join("; "))
}

impl Known {
    /// Pores and cracks.
    #[must_use]
    pub fn mask(&self) -> &Mask {
        match self {
            Self::Drawn(drawn) => &drawn.truth,
            Self::Scanned(layer) => &layer.truth,
            Self::Labels(mask) => mask,
        }
    }

    /// Pore area over body area, cracks excluded, the cracks, and the body's area in pixels, beside
    /// what was found.
    #[must_use]
    pub fn truth(&self, found: &Detection, how: &DetectSettings) -> (f64, Vec<Crack>, usize) {
        match self {
            Self::Drawn(drawn) => (drawn.porosity, drawn.cracks.clone(), drawn.body_area),
            Self::Scanned(layer) => (layer.porosity, layer.cracks.clone(), layer.body_area),
            Self::Labels(mask) => {
                let cracks = crack::find_in_labels(mask, found.pixel_mm, &how.crack);
                let pores =
                    mask.data.iter().zip(&cracks.mask.data).filter(|(m, c)| **m && !**c).count();
                (pores as f64 / found.body.count() as f64, cracks.list, found.body.count())
            }
        }
    }
}

/// Narrowest picture of a member, mm: on less there is hardly a grain of aggregate.
const NARROWEST_MM: f64 = 10.0;

/// How much wider than the member's section a picture may be, air and all; and what it shows, as a
/// share of the section's diagonal.
const WIDEST: [f64; 2] = [4.0, 1.2];

/// What a core shows across, over its diameter: slices along its axis cut it off its middle, too.
const ACROSS: std::ops::RangeInclusive<f64> = 0.5..=1.15;

/// What a core shows that is shorter than half its diameter, the long way, over its diameter: a slice
/// along its axis shows its length the thin way.
const SHORT: std::ops::RangeInclusive<f64> = 0.8..=1.15;

/// A file of slices whose header is sound, and whose pixels are of a size that a picture of this
/// member can have.
fn opened(
    scene: &Scene,
    member: usize,
    image: &Path,
    pixel_mm: Option<f32>,
    longest: Option<f64>,
) -> Result<slice::Slices, SliceError> {
    let slices = slice::Slices::open(image, pixel_mm)?;
    let unfit = |why: String| Err(SliceError::Unfit(format!("{}: {why}", image.display())));
    let picture = slices.sides_mm().into_iter().fold(0.0, f64::max);
    let section = widest_mm(scene, member).unwrap_or(f64::INFINITY).max(longest.unwrap_or(0.0));
    match () {
        () if slices.pixel_from() == PixelFrom::Nobody => unfit(match slices.doubt() {
            Some(doubt) => format!("how large are its pixels? add pixel_mm ({doubt})"),
            None => "neither the scene nor the file says how large its pixels are: add pixel_mm"
                .to_owned(),
        }),
        () if picture > WIDEST[0] * section => unfit(format!(
            "the picture is {} wide and the member {}: pixel_mm in µm?",
            length(picture),
            length(section)
        )),
        () if picture < NARROWEST_MM => unfit(format!(
            "the picture is {} wide, hardly a grain: pixel_mm in m or cm?",
            length(picture)
        )),
        () => Ok(slices),
    }
}

/// Refuses what shows more than the member has there, or another thing than the core that was
/// drilled.
fn fits(
    scene: &Scene,
    member: usize,
    drilled: &Drilled,
    longest: Option<f64>,
    slice: &Slice,
    found: &Detection,
) -> Result<(), SliceError> {
    let pixels = found.seen.pixels();
    let side = |place: &dyn Fn(usize) -> usize| {
        let ends = pixels
            .iter()
            .map(|&i| place(i))
            .fold([usize::MAX, 0], |[a, b], v| [a.min(v), b.max(v)]);
        (ends[1] + 1).saturating_sub(ends[0]) as f64 * f64::from(slice.pixel_mm)
    };
    let sides = [side(&|i| i % found.seen.width), side(&|i| i / found.seen.width)];
    let (wide, thin) = (sides[0].max(sides[1]), sides[0].min(sides[1]));
    let diagonal = drawn::extent_mm(scene, member, f64::from(drilled.along.unwrap_or(0.5)))
        .map_or(f64::INFINITY, |[a, b]| a.hypot(b))
        .max(longest.unwrap_or(0.0));
    let unfit = |why: String| Err(SliceError::Unfit(format!("{}: {why}", slice.name)));
    match drilled.diameter_mm.map(f64::from) {
        _ if wide > WIDEST[1] * diagonal => unfit(format!(
            "what it shows is {} wide and the member {} from corner to corner: is pixel_mm right?",
            length(wide),
            length(diagonal)
        )),
        Some(core) if !ACROSS.contains(&(thin / core)) && !SHORT.contains(&(wide / core)) => {
            unfit(format!(
                "what it shows is {} across and the core {}: is pixel_mm or diameter_mm wrong?",
                length(thin),
                length(core)
            ))
        }
        _ => Ok(()),
    }
}

/// The longer side of the box around a member's section, mm.
fn widest_mm(scene: &Scene, member: usize) -> Option<f64> {
    drawn::extent_mm(scene, member, 0.5)
        .map(|[a, b]| a.max(b))
        .filter(|mm| mm.is_finite() && *mm > 0.0)
}

/// A length for people.
fn length(mm: f64) -> String {
    if mm >= 1000.0 {
        format!("{:.1} m", 1e-3 * mm)
    } else {
        format!("{} mm", (mm * 10.0).round() / 10.0)
    }
}

/// A file's pixels, and its labels where there are any.
fn pixels(
    file: &mut slice::Slices,
    masks: &[PathBuf],
) -> Result<(Slice, Option<Mask>), VolumeError> {
    let slice = file.only()?;
    let labels = if masks.is_empty() { None } else { Some(read_masks(masks, &slice)?) };
    Ok((slice, labels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_raster::grid::Grid;

    /// No scene has a scanner of this name, so that only the shelf can know the slice.
    #[test]
    fn what_was_scanned_is_not_scanned_again() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let of = |seed| scanned::Request { scanner: "none".into(), along: 0.5, seed };
        let (shelf, job) = (SliceShelf::default(), Job::default());
        let slice = Slice {
            name: "disc".into(),
            grey: Grid { width: 1, height: 1, data: vec![0.0] },
            pixel_mm: 0.1,
        };
        let truth = Mask { width: 1, height: 1, data: vec![false] };
        let layer =
            Arc::new(Layer { slice, truth, porosity: 0.05, cracks: Vec::new(), body_area: 1 });
        let scanned = vec![Ordered { member: 0, request: of(1), layer }];
        *shelf.0.lock().unwrap() = Shelf { scene: scene.hash.clone(), scanned, cut: None };
        assert_eq!(shelf.fetch(&scene, 0, &of(1), &job).unwrap().porosity, 0.05);
        assert!(
            shelf.fetch(&scene, 0, &of(2), &job).is_err()
                && shelf.fetch(&scene, 1, &of(1), &job).is_err()
        );
        shelf.0.lock().unwrap().scene = "another".into();
        assert!(shelf.fetch(&scene, 0, &of(1), &job).is_err());
    }
}
