//! Damage in the map of a face: cracks with their widths, missing cover, rust, efflorescence; and
//! what would have been seen there, had it been there.

mod course;
mod dark;
mod defect;
mod returned;
mod width;

use glam::{DVec3, Vec3};
use intrados_raster::{Grid, Mask};
use intrados_scene::{Mouth, Scene, structure::Course};
use intrados_stage::{Cancelled, Job};
use serde::Serialize;

use crate::{
    Located, Photograph, Site,
    face::Surface,
    map::{MapError, unrolled},
    marks::{Mark, Marks, marks},
    relight::{ReflectanceMap, Relit},
    site::SeenFace,
};
use course::{Line, lines};
use dark::{DarkShape, unread_shapes};
use returned::{Opened, USUAL, returned};
use width::{FOUND, Piece, SHOWS, Slots, pieces, scatter};

pub use defect::{Crack, CrackPoint, Defect, Patch, UnreadShape};

/// Parts of the axis by which it is told what was seen.
pub(crate) const PARTS: usize = 10;
/// Between chord and axis: a crack runs along within 30°, across from 60° on (ours).
const ALONG_DEG: f64 = 30.0;
const ACROSS_DEG: f64 = 60.0;
/// A net has so many cracks and more, whose directions hardly agree: |⟨exp 2iθ⟩| below this (ours).
const NET: usize = 6;
const ASTRAY: f64 = 0.45;
/// Smallest patch, pixels.
const SMALLEST: usize = 60;
/// Points between two that are written.
const EVERY: usize = 4;

/// What a face shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaceReading {
    /// What is wrong with it.
    pub defects: Vec<Defect>,
    /// By tenth of the axis from its start, m² of the face of which the reflectance is known: of
    /// all else nothing is said.
    pub seen_m2: [f64; PARTS],
    /// The narrowest crack that takes away eight standard errors of light over 16 pixels of its
    /// length, mm: of narrower ones nothing is said. None where too little is seen to tell.
    pub narrowest_mm: Option<f64>,
    /// Long dark shapes that were read as nothing: cracks too wide for the network, joints, shadows.
    /// Nothing is said of the tenths of the axis that they lie in.
    pub unread: Vec<UnreadShape>,
    /// Millimetres a pixel of the map that was read.
    pub mm_px: f64,
}

/// What is known about the light and the place of a face, for its reading.
#[derive(Debug, Clone, Copy)]
pub struct Under<'a> {
    /// The scene as it was lit; none: what slots return is guessed.
    pub scene: Option<&'a Scene>,
    /// Id of the member.
    pub member: &'a str,
    /// From where it was seen.
    pub located: &'a Located,
    /// Seed of the walks.
    pub seed: u64,
}

/// A face of a member that a photograph shows, read.
#[derive(Debug, Clone)]
pub struct ReadFace {
    /// The face.
    pub seen: SeenFace,
    /// Its reflectance, at the photograph's own scale.
    pub map: ReflectanceMap,
    /// What it shows.
    pub reading: FaceReading,
}

/// Reads the faces that a photograph shows, of one member or of all: without the light that fell on
/// them where that is known, else as they look, shadows and all.
///
/// # Errors
/// [`MapError`]: a map of too many pixels, or the job was cancelled.
pub fn read_all(
    site: &Site,
    scene: &Scene,
    (relit, member): (Option<&Relit>, Option<usize>),
    shot: (&Photograph, &Located),
    seed: u64,
    job: &Job,
) -> Result<Vec<ReadFace>, MapError> {
    let mut faces = site.seen_faces(&shot.1.pose);
    faces.retain(|seen| member.is_none_or(|member| member == seen.member));
    let count = faces.len();
    let one = |(k, seen): (usize, SeenFace)| {
        job.step(k, count)?;
        let map = match relit {
            Some(relit) => relit.map(site, &seen, shot, own_scale(&seen), job)?,
            None => as_it_looks(site, &seen, shot, job)?,
        };
        let member = &scene.members[seen.member].id;
        let under = Under { scene: relit.map(Relit::scene), member, located: shot.1, seed };
        let reading = read(site, &seen, &map, under, job)?;
        Ok(ReadFace { seen, map, reading })
    };
    faces.into_iter().enumerate().map(one).collect()
}

/// A face with the light on it, as if that were its reflectance.
fn as_it_looks(
    site: &Site,
    seen: &SeenFace,
    (photograph, located): (&Photograph, &Located),
    job: &Job,
) -> Result<ReflectanceMap, MapError> {
    let Some(surface) = site.surface(seen.member) else { return Ok(ReflectanceMap::plain(None)) };
    let shot = (photograph, &located.pose);
    let face = unrolled(site, surface, &seen.face, shot, own_scale(seen), job)?;
    Ok(ReflectanceMap::plain(Some(face)))
}

/// Millimetres of a face to one pixel of the photograph.
#[must_use]
pub(crate) fn own_scale(seen: &SeenFace) -> f64 {
    let [around, along] = seen.middle.mm_px;
    (around * along).sqrt().max(0.02)
}

/// Reads the reflectance of a face.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn read(
    site: &Site,
    seen: &SeenFace,
    map: &ReflectanceMap,
    under: Under,
    job: &Job,
) -> Result<FaceReading, Cancelled> {
    let [width, height] = map.face.size;
    let colour = |light: &Option<Vec3>| light.unwrap_or(Vec3::NAN);
    let light = Grid { width, height, data: map.face.light.iter().map(colour).collect() };
    let known: Mask = light.map(|c| c.is_finite());
    let value = light.map(|c| c.element_sum() / 3.0);
    let marks = marks(&light, &known, job)?;
    let lines = lines(&marks.cracks());
    let slots = Slots::of(&value, &lines);
    let scatter = scatter(&value, &lines, &slots);
    let face = Face { site, seen, map, surface: site.surface(seen.member) };
    let shown = shown(&value, lines, &slots, scatter);
    let mut defects = face.cracks(&shown, scatter, under, job)?;
    net(&mut defects);
    defects.extend(face.patches(&marks));
    let mm_px = map.face.mm_px;
    let narrowest_mm = scatter.map(|s| FOUND * s * mm_px / (1.0 - USUAL[0]));
    let shapes = unread_shapes(&value, &known, &read_mask(&marks));
    let unread: Vec<UnreadShape> = shapes.iter().map(|shape| face.unread(shape)).collect();
    let seen_m2 = face.vouched(&known, &unread);
    Ok(FaceReading { defects, seen_m2, narrowest_mm, unread, mm_px })
}

/// Where anything was read that may be dark.
fn read_mask(marks: &Marks) -> Mask {
    let mut read = marks.cracks();
    for mark in [Mark::Spall, Mark::Steel, Mark::Rust] {
        read.unite(&marks.areas(mark));
    }
    read
}

/// Lines of which enough light is missing, with their pieces.
fn shown(
    value: &Grid<f32>,
    lines: Vec<Line>,
    slots: &Slots,
    scatter: Option<f64>,
) -> Vec<(Line, Vec<Piece>)> {
    let measured = |line: Line| {
        let pieces = pieces(value, &line, slots);
        (line, pieces)
    };
    let shows = |(_, pieces): &(Line, Vec<Piece>)| {
        let sum: f64 = pieces.iter().map(|p| p.missing).sum();
        let error = scatter.unwrap_or(0.0) * (pieces.len() as f64).sqrt();
        !pieces.is_empty() && sum > SHOWS * error && sum > 0.0
    };
    lines.into_iter().map(measured).filter(shows).collect()
}

/// The face that is read.
struct Face<'a> {
    site: &'a Site,
    seen: &'a SeenFace,
    map: &'a ReflectanceMap,
    surface: Option<&'a Surface>,
}

impl Face<'_> {
    fn cracks(
        &self,
        shown: &[(Line, Vec<Piece>)],
        scatter: Option<f64>,
        under: Under,
        job: &Job,
    ) -> Result<Vec<Defect>, Cancelled> {
        let opened: Vec<Option<Opened>> =
            shown.iter().map(|(line, pieces)| self.opened(line, pieces)).collect();
        let on_surface: Vec<Opened> = opened.iter().flatten().cloned().collect();
        let found = match under.scene {
            Some(scene) if !on_surface.is_empty() => {
                let eye = under.located.pose.position.as_vec3();
                returned(scene, under.member, eye, &on_surface, under.seed, job)?
            }
            _ => vec![USUAL; on_surface.len()],
        };
        let mut found = found.into_iter();
        let error = self.site.error(under.located, &self.seen.middle);
        let scale = error.map_or(0.0, |e| e.rel_mm_px[0].hypot(e.rel_mm_px[1]) / 2_f64.sqrt());
        let one = |((line, pieces), opened): (&(Line, Vec<Piece>), &Option<Opened>)| {
            let r = opened.as_ref().and_then(|_| found.next()).unwrap_or(USUAL);
            Defect::Crack(self.crack(line, pieces, r, [scatter.unwrap_or(0.0), scale]))
        };
        Ok(shown.iter().zip(&opened).map(one).collect())
    }

    /// Places on the face in metres, of points of its map.
    fn on_face(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let m = 1e-3 * self.map.face.mm_px;
        [self.map.face.corner[0] + x * m, self.map.face.corner[1] - y * m]
    }

    /// A crack's mouth on the member's surface, as wide as it looks.
    fn opened(&self, line: &Line, pieces: &[Piece]) -> Option<Opened> {
        let mm_px = self.map.face.mm_px;
        let width = mean(pieces.iter().map(|p| p.missing))? * mm_px / (1.0 - USUAL[0]);
        let every = line.points.iter().step_by(EVERY);
        let at: Vec<[f64; 2]> = every.map(|p| self.on_face(*p)).collect();
        let spots = self.surface?.spots(&self.seen.face, &at, &mut Default::default());
        let mouth: Vec<Mouth> = spots
            .into_iter()
            .flatten()
            .map(|spot| Mouth {
                at: spot.place,
                outward: spot.normal.as_vec3(),
                width: (1e-3 * width.max(0.02)) as f32,
            })
            .collect();
        (mouth.len() > 2).then_some(Opened { mouth })
    }

    fn crack(
        &self,
        line: &Line,
        pieces: &[Piece],
        r: [f64; 2],
        [scatter, scale]: [f64; 2],
    ) -> Crack {
        let mm_px = self.map.face.mm_px;
        // w = D/(1 − r): the light's own error is each piece's, that of r and of the scale are all
        // pieces' alike.
        let width = |missing: f64, count: usize| {
            let w = missing * mm_px / (1.0 - r[0]);
            let own = scatter / (count.max(1) as f64).sqrt() * mm_px / (1.0 - r[0]);
            [w.max(0.0), own.hypot(w * r[1] / (1.0 - r[0])).hypot(w * scale)]
        };
        let by_point = |k: usize| missing_at(pieces, k).map(|missing| width(missing, 1));
        let last = line.points.len() - 1;
        let written = (0..=last).filter(|k| k % EVERY == 0 || *k == last);
        let points = written
            .map(|k| {
                let [across_m, along_m] = self.on_face(line.points[k]);
                let found = by_point(k);
                CrackPoint {
                    across_m,
                    along_m,
                    width_mm: found.map(|w| w[0]),
                    error_mm: found.map(|w| w[1]),
                }
            })
            .collect();
        let mut missing: Vec<f64> = pieces.iter().map(|p| p.missing).collect();
        missing.sort_by(|a, b| b.total_cmp(a));
        let quarter = missing.len().div_ceil(4);
        let mean_of = |of: &[f64]| mean(of.iter().copied()).unwrap_or(0.0);
        let [width_mm, width_error_mm] = width(mean_of(&missing), missing.len());
        let [widest_mm, widest_error_mm] = width(mean_of(&missing[..quarter]), quarter);
        let [a, b] = [line.points[0], line.points[last]].map(|p| self.on_face(p));
        let to_axis_deg = (b[0] - a[0]).abs().atan2((b[1] - a[1]).abs()).to_degrees();
        let course = match to_axis_deg {
            angle if angle < ALONG_DEG => Course::Along,
            angle if angle < ACROSS_DEG => Course::Diagonal,
            _ => Course::Across,
        };
        Crack {
            points,
            length_m: 1e-3 * mm_px * line.length(),
            width_mm,
            width_error_mm,
            widest_mm,
            widest_error_mm,
            course,
            to_axis_deg,
            returned: r,
        }
    }

    fn patches(&self, marks: &Marks) -> Vec<Defect> {
        let steel = marks.areas(Mark::Steel);
        let of = |mark: Mark| {
            let found = marks.areas(mark).components();
            let large = found.members.into_iter().filter(|pixels| pixels.len() >= SMALLEST);
            large.map(|pixels| (self.patch(&pixels), pixels)).collect::<Vec<_>>()
        };
        let spall = |(patch, pixels): (Patch, Vec<usize>)| {
            let bare = pixels.iter().filter(|&&i| steel.data[i]).count();
            Defect::Spall { patch, bars_bare: bare * 4 >= SMALLEST }
        };
        let mut defects: Vec<Defect> = of(Mark::Spall).into_iter().map(spall).collect();
        defects.extend(of(Mark::Rust).into_iter().map(|(patch, _)| Defect::Rust(patch)));
        let salts = of(Mark::Efflorescence).into_iter();
        defects.extend(salts.map(|(patch, _)| Defect::Efflorescence(patch)));
        defects
    }

    fn patch(&self, pixels: &[usize]) -> Patch {
        let width = self.map.face.size[0];
        let at = |i: &usize| self.on_face([(i % width) as f64 + 0.5, (i / width) as f64 + 0.5]);
        let middle = [0, 1].map(|k| mean(pixels.iter().map(|i| at(i)[k])).unwrap_or(0.0));
        let reach_m = pixels.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], i| {
            [low.min(at(i)[1]), high.max(at(i)[1])]
        });
        let pixel = 1e-3 * self.map.face.mm_px;
        Patch {
            across_m: middle[0],
            along_m: middle[1],
            reach_m,
            area_m2: pixels.len() as f64 * pixel * pixel,
        }
    }

    fn unread(&self, shape: &DarkShape) -> UnreadShape {
        let mm_px = self.map.face.mm_px;
        UnreadShape {
            patch: self.patch(&shape.pixels),
            width_mm: shape.width * mm_px,
            length_m: 1e-3 * shape.length * mm_px,
        }
    }

    /// m² that are known, by tenth of the axis; none where something dark was not read.
    fn vouched(&self, known: &Mask, unread: &[UnreadShape]) -> [f64; PARTS] {
        let mut seen = self.seen(known);
        let length = self.surface.map_or(0.0, Surface::length);
        for shape in unread {
            let [low, high] = shape.patch.reach_m.map(|along| along / length * PARTS as f64);
            for (part, seen) in seen.iter_mut().enumerate() {
                if (part as f64) < high && (part + 1) as f64 > low {
                    *seen = 0.0;
                }
            }
        }
        seen
    }

    /// m² that are known, by tenth of the axis.
    fn seen(&self, known: &Mask) -> [f64; PARTS] {
        let mut seen = [0.0; PARTS];
        let Some(length) = self.surface.map(Surface::length) else { return seen };
        let pixel = 1e-3 * self.map.face.mm_px;
        for (y, row) in known.data.chunks(known.width.max(1)).enumerate() {
            let along = self.on_face([0.0, y as f64 + 0.5])[1] / length;
            let part = ((along * PARTS as f64).max(0.0) as usize).min(PARTS - 1);
            seen[part] += row.iter().filter(|known| **known).count() as f64 * pixel * pixel;
        }
        seen
    }
}

/// Light that is missing at a point of a line, pixels: between the middles of its pieces, which are
/// straight where cracks taper. None where its piece is not seen.
fn missing_at(pieces: &[Piece], k: usize) -> Option<f64> {
    let own = pieces.iter().position(|p| (p.points[0]..=p.points[1]).contains(&k))?;
    let middle = |p: &Piece| 0.5 * (p.points[0] + p.points[1]) as f64;
    let at = k as f64;
    let next = if at < middle(&pieces[own]) { own.checked_sub(1) } else { Some(own + 1) };
    let (a, b) = (&pieces[own], next.and_then(|n| pieces.get(n)).unwrap_or(&pieces[own]));
    let span = middle(b) - middle(a);
    let t = if span == 0.0 { 0.0 } else { (at - middle(a)) / span };
    Some(a.missing + t * (b.missing - a.missing))
}

fn mean(of: impl Iterator<Item = f64>) -> Option<f64> {
    let (n, sum) = of.fold((0_usize, 0.0), |(n, sum), x| (n + 1, sum + x));
    (n > 0).then(|| sum / n as f64)
}

/// Many cracks of all directions are a net.
fn net(defects: &mut [Defect]) {
    let mut count = 0;
    let (mut sum, mut length) = (DVec3::ZERO, 0.0);
    for defect in defects.iter() {
        if let Defect::Crack(crack) = defect {
            let [a, b] = [&crack.points[0], &crack.points[crack.points.len() - 1]];
            let angle = 2.0 * (b.across_m - a.across_m).atan2(b.along_m - a.along_m);
            sum += crack.length_m * DVec3::new(angle.cos(), angle.sin(), 0.0);
            length += crack.length_m;
            count += 1;
        }
    }
    if count >= NET && sum.length() < ASTRAY * length {
        for defect in defects {
            if let Defect::Crack(crack) = defect {
                crack.course = Course::Map;
            }
        }
    }
}
