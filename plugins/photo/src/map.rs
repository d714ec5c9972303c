//! A face of a member, evenly resampled from one photograph: undistorted, at so many millimetres a
//! pixel.

use glam::{DVec3, Vec3};
use intrados_scene::{Ray, tracer::Scratch, tracer::offset};
use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use crate::{
    Photograph, Pose,
    face::{Face, Spot, Surface},
    site::{FLATTEST, Site},
};

/// Most pixels of a map.
const MOST_PIXELS: u64 = 1 << 25;
/// Most pixels of a photograph across one of a map that are averaged: of finer ones, every so many.
const MOST_AVERAGED: f64 = 16.0;

/// A face's light, unrolled.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceMap {
    /// Pixels across and along.
    pub size: [usize; 2],
    /// Millimetres a pixel.
    pub mm_px: f64,
    /// Across and along, m, of the upper left corner (not middle) of the first pixel.
    pub corner: [f64; 2],
    /// Linear light by rows from the far end of the axis; `None` where it is unknown: not seen, or
    /// flatter than 10°.
    pub light: Vec<Option<Vec3>>,
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// Too large.
    #[error(
        "the map of {face} has {megapixels:.0} megapixels: choose more than {mm_px} mm a pixel"
    )]
    Large {
        /// Name of the face.
        face: String,
        /// Of the map.
        megapixels: f64,
        /// What was asked for.
        mm_px: f64,
    },
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl FaceMap {
    /// Share of the map that is known.
    #[must_use]
    pub fn known(&self) -> f64 {
        let known = self.light.iter().filter(|light| light.is_some()).count();
        known as f64 / self.light.len().max(1) as f64
    }

    /// Where a place of the face (across and along, m) is on the map, pixels from its top left.
    #[must_use]
    pub fn pixel(&self, [across, along]: [f64; 2]) -> [f64; 2] {
        let scale = 1e3 / self.mm_px;
        [(across - self.corner[0]) * scale, (self.corner[1] - along) * scale]
    }

    /// Six lines of a world file: m to the right and downwards a pixel, and the middle of the first
    /// one; across is x, along is y.
    #[must_use]
    pub fn world_file(&self) -> String {
        let m = 1e-3 * self.mm_px;
        let [x, y] = [self.corner[0] + 0.5 * m, self.corner[1] - 0.5 * m];
        format!("{m:.9}\n0\n0\n{:.9}\n{x:.9}\n{y:.9}\n", -m)
    }
}

/// Where a pixel of a map is looked up in a photograph.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Its middle, pixels.
    pub(crate) at: [f64; 2],
    /// Its sides across and along, pixels.
    pub(crate) sides: [[f64; 2]; 2],
}

/// The light of a face in a photograph, at `mm_px` millimetres a pixel.
///
/// # Errors
/// [`MapError`]: too many pixels, or cancelled.
pub fn unrolled(
    site: &Site,
    surface: &Surface,
    face: &Face,
    (photograph, pose): (&Photograph, &Pose),
    mm_px: f64,
    job: &Job,
) -> Result<FaceMap, MapError> {
    let light = |look: &Look| sample(photograph, look);
    let (size, light) = resampled(site, surface, face, pose, mm_px, job, light)?;
    Ok(FaceMap { size, mm_px, corner: [face.across[0], face.along[1]], light })
}

/// What `of` finds at each pixel of a face's map, by rows from the far end of the axis, where the
/// camera sees it; and the map's pixels across and along.
pub(crate) fn resampled<T: Clone + Send>(
    site: &Site,
    surface: &Surface,
    face: &Face,
    pose: &Pose,
    mm_px: f64,
    job: &Job,
    of: impl Fn(&Look) -> Option<T> + Sync,
) -> Result<([usize; 2], Vec<Option<T>>), MapError> {
    let m = 1e-3 * mm_px;
    // A face of 200 pixels and rounding has 200.
    let pixels = |[from, to]: [f64; 2]| ((to - from) / m - 1e-3).ceil().max(1.0);
    let [columns, rows] = [pixels(face.across), pixels(face.along)];
    let fits = columns * rows <= MOST_PIXELS as f64;
    if !fits {
        let megapixels = 1e-6 * columns * rows;
        return Err(MapError::Large { face: face.name.clone(), megapixels, mm_px });
    }
    let size = [columns as usize, rows as usize];
    let corner = [face.across[0], face.along[1]];
    let row = |y: usize| {
        if job.is_cancelled() {
            return vec![None; size[0]];
        }
        let along = corner[1] - (y as f64 + 0.5) * m;
        let at: Vec<[f64; 2]> =
            (0..size[0]).map(|x| [corner[0] + (x as f64 + 0.5) * m, along]).collect();
        let mut scratch = Scratch::default();
        let spots = surface.spots(face, &at, &mut scratch);
        let seen = seen(site, pose, &spots, &mut scratch);
        let found = |(spot, seen): (&Option<Spot>, bool)| {
            let spot = spot.as_ref().filter(|_| seen)?;
            let place = spot.place.as_dvec3();
            let (at, slopes) = (pose.project(place)?, pose.slopes_by_place(place)?);
            let side = |t: DVec3| [slopes[0].dot(t) * m, slopes[1].dot(t) * m];
            of(&Look { at, sides: surface.tangents(spot.normal).map(side) })
        };
        spots.iter().zip(seen).map(found).collect::<Vec<_>>()
    };
    let found: Vec<Option<T>> = (0..size[1]).into_par_iter().flat_map_iter(row).collect();
    if job.is_cancelled() {
        return Err(Cancelled.into());
    }
    Ok((size, found))
}

/// Which spots the camera sees: in its picture, not too flat, and nothing between.
fn seen(site: &Site, pose: &Pose, spots: &[Option<Spot>], scratch: &mut Scratch) -> Vec<bool> {
    let ray = |spot: &Option<Spot>| {
        let spot = spot.as_ref()?;
        let to = pose.position - spot.place.as_dvec3();
        let is_in = pose.project(spot.place.as_dvec3()).is_some_and(|at| pose.holds(at));
        if !is_in || spot.normal.dot(to) < FLATTEST * to.length() {
            return None;
        }
        let normal = spot.normal.as_vec3();
        let origin = offset::offset_origin(spot.place, spot.error, normal, to.as_vec3());
        let to = pose.position.as_vec3() - origin;
        Some(Ray::new(origin, to, 1.0 - 1e-5))
    };
    let rays: Vec<Option<Ray>> = spots.iter().map(ray).collect();
    let real: Vec<Ray> = rays.iter().flatten().copied().collect();
    let mut clear = site.are_clear(&real, scratch).into_iter();
    rays.iter().map(|ray| ray.is_some() && clear.next() == Some(true)).collect()
}

/// Mean light over a pixel of the map.
pub(crate) fn sample(photograph: &Photograph, Look { at, sides }: &Look) -> Option<Vec3> {
    let counts = sides.map(|[x, y]| x.hypot(y).ceil().clamp(1.0, MOST_AVERAGED) as u32);
    let share = |k: u32, of: u32| (f64::from(k) + 0.5) / f64::from(of) - 0.5;
    let mut sum = Vec3::ZERO;
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            let (s, t) = (share(i, counts[0]), share(j, counts[1]));
            sum +=
                photograph.light_at([0, 1].map(|k| at[k] + s * sides[0][k] + t * sides[1][k]))?;
        }
    }
    Some(sum / (counts[0] * counts[1]) as f32)
}
