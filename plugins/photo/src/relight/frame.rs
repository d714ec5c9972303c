//! The reduced picture in which light is computed: which pixel of it shows what, wholly.

use glam::DVec3;
use intrados_scene::Camera;
use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use crate::{Located, Photograph, Pose, Site, site::Piece};

/// A pixel shows a piece wholly if its rim does so even with the picture moved by so many standard
/// errors.
const SURE: f64 = 2.0;

/// A photograph's picture with fewer pixels, and what these show.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// Pixels across and down.
    pub(super) size: [usize; 2],
    /// Pixels of the photograph a pixel.
    pub(super) scale: f64,
    /// Of its top, in the photograph, pixels.
    top: f64,
    /// Of the photograph.
    whole: [f64; 2],
    /// What each pixel shows and nothing else.
    pub(super) shown: Vec<Option<Shown>>,
    /// Whether a member's face is seen in its middle.
    pub(super) has_face: Vec<bool>,
}

/// What a pixel shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    pub(super) piece: Piece,
    /// Its middle, m.
    pub(super) place: DVec3,
    /// Covariance of where it is in the picture, pixels² of the frame: xx, xy, yy.
    pub(super) shift: [f64; 3],
}

impl Frame {
    /// A frame whose longer side has at most `longest` pixels.
    pub(super) fn new(
        site: &Site,
        located: &Located,
        longest: u32,
        job: &Job,
    ) -> Result<Self, Cancelled> {
        let whole = located.pose.size.map(f64::from);
        let scale = (whole[0].max(whole[1]) / f64::from(longest)).max(1.0);
        let columns = (whole[0] / scale).round().max(1.0);
        let scale = whole[0] / columns;
        let rows = (whole[1] / scale - 1e-9).ceil().max(1.0);
        let size = [columns as usize, rows as usize];
        let top = 0.5 * (whole[1] - rows * scale);
        let (shown, has_face) = (Vec::new(), Vec::new());
        let mut frame = Self { size, scale, top, whole, shown, has_face };
        let row = |y: usize| {
            if job.is_cancelled() {
                return Vec::new();
            }
            (0..size[0]).map(|x| frame.shows(site, located, [x, y])).collect::<Vec<_>>()
        };
        let found: Vec<_> = (0..size[1]).into_par_iter().flat_map_iter(row).collect();
        if job.is_cancelled() {
            return Err(Cancelled);
        }
        (frame.shown, frame.has_face) = found.into_iter().unzip();
        Ok(frame)
    }

    /// A frame by what it shows.
    #[cfg(test)]
    pub(super) fn flat(size: [usize; 2], shown: Vec<Option<Shown>>) -> Self {
        let has_face = vec![true; shown.len()];
        Self { size, scale: 1.0, top: 0.0, whole: size.map(|n| n as f64), shown, has_face }
    }

    /// What a pixel shows and nothing else, and whether its middle is on a member's face.
    fn shows(&self, site: &Site, located: &Located, [x, y]: [usize; 2]) -> (Option<Shown>, bool) {
        let at = self.in_photo([x as f64 + 0.5, y as f64 + 0.5]);
        let Some((piece, place)) = site.pieces(&located.pose, &[at])[0] else {
            return (None, false);
        };
        (self.shows_wholly(site, located, at, (piece, place)), piece.face.is_some())
    }

    fn shows_wholly(
        &self,
        site: &Site,
        located: &Located,
        at: [f64; 2],
        (piece, place): (Piece, DVec3),
    ) -> Option<Shown> {
        let c = located.pixel_covariance(place)?;
        let reach = |v: f64| 0.5 * self.scale + SURE * v.max(0.0).sqrt();
        let [dx, dy] = [reach(c[(0, 0)]), reach(c[(1, 1)])];
        let rim = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)]
            .map(|(i, j)| [at[0] + f64::from(i) * dx, at[1] + f64::from(j) * dy]);
        let seen = site.pieces(&located.pose, &rim);
        let is_whole = seen.iter().all(|s| s.is_some_and(|(other, _)| other == piece));
        let shift = [c[(0, 0)], c[(0, 1)], c[(1, 1)]].map(|v| v / self.scale.powi(2));
        is_whole.then_some(Shown { piece, place, shift })
    }

    /// The camera that takes the frame.
    pub(super) fn camera(&self, pose: &Pose) -> Camera {
        let [width, height] = self.size.map(|n| n as u32);
        Camera { width, height, ..pose.camera("relight") }
    }

    /// From the frame's pixels to the photograph's.
    fn in_photo(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.scale, self.top + y * self.scale]
    }

    /// From the photograph's pixels to the frame's.
    pub(super) fn of_photo(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x / self.scale, (y - self.top) / self.scale]
    }

    /// How far a place of the photograph is from its middle, squared; 1 in its corners.
    pub(super) fn radius2(&self, at: [f64; 2]) -> f64 {
        let [a, b] = [0, 1].map(|k| at[k] - 0.5 * self.whole[k]);
        (a * a + b * b) / (0.25 * (self.whole[0].powi(2) + self.whole[1].powi(2)))
    }

    /// Where pixel `index` has its middle in the photograph.
    pub(super) fn middle(&self, index: usize) -> [f64; 2] {
        let [x, y] = [index % self.size[0], index / self.size[0]];
        self.in_photo([x as f64 + 0.5, y as f64 + 0.5])
    }

    /// Pixels of the same piece within `reach` of pixel `index`, rows and columns, itself among
    /// them: their indices, and where they lie from it.
    pub(super) fn around(
        &self,
        index: usize,
        reach: usize,
    ) -> impl Iterator<Item = (usize, [f64; 2])> {
        let [width, height] = self.size;
        let (x, y) = (index % width, index / width);
        let piece = self.shown[index].map(|s| s.piece);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        rows.flat_map(move |j| columns.clone().map(move |i| (i, j)))
            .map(move |(i, j)| (j * width + i, [i as f64 - x as f64, j as f64 - y as f64]))
            .filter(move |(k, _)| self.shown[*k].map(|s| s.piece) == piece)
    }

    /// What lies between the pixels of `values` about a place of the photograph, of those alone
    /// that show `wanted`; `None` where too little does.
    pub(super) fn between(
        &self,
        values: &[[f64; 6]],
        at: [f64; 2],
        wanted: impl Fn(&Piece) -> bool,
    ) -> Option<[f64; 6]> {
        let [x, y] = self.of_photo(at).map(|c| c - 0.5);
        let (mut sum, mut whole) = ([0.0; 6], 0.0);
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)]
            .map(|(i, j)| (x.floor() + i as f64, y.floor() + j as f64))
        {
            let weight = (1.0 - (x - i).abs()) * (1.0 - (y - j).abs());
            let is_in = i >= 0.0 && j >= 0.0 && i < self.size[0] as f64 && j < self.size[1] as f64;
            if !is_in {
                continue;
            }
            let k = j as usize * self.size[0] + i as usize;
            if self.shown[k].is_some_and(|s| wanted(&s.piece)) {
                sum.iter_mut().zip(values[k]).for_each(|(s, v)| *s += weight * v);
                whole += weight;
            }
        }
        (whole > 0.25).then(|| sum.map(|s| s / whole))
    }

    /// The photograph's light, averaged over each pixel; `None` where any of it is burnt out or
    /// black, or outside.
    pub(super) fn averaged(&self, photograph: &Photograph) -> Vec<Option<[f64; 3]>> {
        let average = |k: usize| {
            let [x, y] = self.middle(k);
            let span = |c: f64| (c - 0.5 * self.scale).round().max(0.0) as u32;
            let (left, above) = (span(x), span(y));
            let side = (self.scale.round() as u32).max(1);
            let (mut sum, mut count) = (glam::DVec3::ZERO, 0.0);
            for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
                let light = photograph.light(left + i, above + j)?;
                if !super::noise::is_exposed(light) {
                    return None;
                }
                (sum, count) = (sum + light.as_dvec3(), count + 1.0);
            }
            Some((sum / count).to_array())
        };
        (0..self.shown.len()).into_par_iter().map(average).collect()
    }
}
