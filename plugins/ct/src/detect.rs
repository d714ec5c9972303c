//! Pores and cracks in a CT slice: what is dark, components, filters, a table.
//!
//! The grey of air around the specimen is taken off and the rest divided by the matrix's, so that
//! sound concrete is 1. [`Method::Classical`] calls a pixel dark where it lies below Sauvola's
//! threshold T = m (1 + k (s/r − 1)), m and s the mean and standard deviation in the window around
//! it (Sauvola and Pietikäinen 2000). A 4-connected component of dark pixels is a pore if it
//! *misses* enough *mass*, Σ (1 − grey): a speck of noise does not, even where it is large. The
//! constants were chosen on eleven labelled slices of real mortar (see the README), the same ones
//! that the test scores: on other specimens expect .02 less F1 and .01 less Dice.

use intrados_stage::{Cancelled, Estimate, Job, random::Key};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::function::erf::erfc;

use crate::{
    crack::{self, Crack},
    network::{Class, Network},
    normal::{self, Normal},
    slice::Slice,
};
use intrados_raster::grid::{Components, Grid, Mask, median};

pub use crate::{
    error::DetectError,
    settings::{DetectSettings, Method},
};

/// One pore.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pore {
    /// Its number in [`Detection::labels`].
    pub label: u32,
    /// Centroid from the slice's left edge, mm.
    pub x_mm: f64,
    /// Centroid from the slice's top edge, mm.
    pub y_mm: f64,
    /// Area, pixels.
    pub area_px: usize,
    /// Area, mm².
    pub area_mm2: f64,
    /// Volume of the sphere whose great circle it would be, mm³: what one section can say.
    pub volume_mm3: f64,
    /// Diameter of the circle of the same area, mm.
    pub diameter_mm: f64,
    /// 4π area / perimeter², 1 for a disc; the perimeter is π/4 of the pixel edges (Cauchy and
    /// Crofton).
    pub circularity: f64,
    /// Depth of the centroid below the body's outer surface (or the border of the picture, where
    /// that cuts the body), mm.
    pub depth_mm: f64,
    /// Distance of the centroid to the nearest bar or duct that the slice shows or that was masked
    /// out, mm; `None` without one.
    pub bar_mm: Option<f64>,
    /// Σ (1 − grey) over it: pixels' worth of missing concrete.
    pub missing_mass: f64,
}

/// What was found in one slice.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Grey relative to sound concrete; 1 outside the body.
    pub grey: Grid<f32>,
    /// Concrete, pores included; no air outside, no metal.
    pub body: Mask,
    /// The body with the metal that shows.
    pub seen: Mask,
    /// Numbers of the pores and of the dark parts of cracks, from 1; 0 is sound.
    pub labels: Grid<u32>,
    /// The pores, cracks excluded.
    pub pores: Vec<Pore>,
    /// The cracks.
    pub cracks: Vec<Crack>,
    /// Pixels of the cracks, the faint ones included.
    pub crack_mask: Mask,
    /// Pore area / body area, with the error of reading this slice: where a pore ends, noise, a
    /// threshold lowered by pores around, specks that may be pores, and the outline's blurred rim.
    pub porosity: Estimate,
    /// Standard error of the porosity as a sample of the concrete around the slice: bootstrap over
    /// square blocks.
    pub sampling_error: f64,
    /// Standard deviation of the noise in the matrix.
    pub noise: f64,
    /// Grey that pure air lies below sound concrete.
    pub air_drop: f64,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
}

/// √3: standard deviations in a bound that an error is equally likely to lie anywhere within.
const LIKELY: f64 = 1.732_050_807_568_877_2;

/// Finds the pores and cracks of one slice.
///
/// # Errors
/// No body, air that is brighter than concrete, a setting out of range, or the job was cancelled.
pub fn detect(
    slice: &Slice,
    settings: &DetectSettings,
    job: &Job,
) -> Result<Detection, DetectError> {
    settings.check()?;
    let settings = &settings.on_pixels(slice.pixel_mm);
    if normal::is_inverted(&slice.grey) {
        return Err(DetectError::Inverted(slice.name.clone()));
    }
    let cut = normal::cut_out(slice, job)?;
    job.step(1, 12)?;
    let normal =
        cut.normalised(settings, job)?.ok_or_else(|| DetectError::NoBody(slice.name.clone()))?;
    job.step(2, 12)?;
    let local = sauvola(&normal.grey, settings);
    job.step(3, 12)?;
    let by_local = Air {
        grey: &normal.grey,
        value: &normal.grey,
        body: &normal.body,
        threshold: &local,
        settings,
    };
    match settings.method {
        Method::Classical => {
            let threshold =
                filled(&local, air_drop(&normal.grey, &by_local.components(0.0, job)?), settings);
            let classical = Air { threshold: &threshold, ..by_local };
            job.step(4, 12)?;
            let found = classical.components(0.0, job)?;
            job.step(4, 12)?;
            let air_drop = air_drop(&normal.grey, &found).unwrap_or(1.0);
            job.step(5, 12)?;
            let cracks = crack::find(
                &normal.grey,
                &normal.body,
                air_drop,
                slice.pixel_mm,
                &settings.crack,
                job,
            );
            job.step(6, 12)?;
            // Pores lower the threshold of their neighbours. With the dark pixels made sound it
            // would be as it is far from any pore.
            let fill = |(&dark, &v): (&bool, &f32)| if dark { 1.0 } else { v };
            let sound = Grid {
                data: classical.dark(0.0).data.iter().zip(&normal.grey.data).map(fill).collect(),
                ..normal.grey
            };
            let alone = sauvola(&sound, settings);
            let noise = noise(&normal.grey, &threshold, &normal.body);
            let decided = Decided {
                found,
                cracks,
                air_drop,
                noise,
                shift: settings.threshold_error,
                alone: Some(&alone),
            };
            Ok(decided.told(&classical, &normal, slice.pixel_mm, job)?)
        }
        Method::Network | Method::Members => {
            let noise = noise(&normal.grey, &local, &normal.body);
            job.check()?;
            // Members are scanned with the contrast of air against concrete that physics gives.
            let (network, air_drop) = match settings.method {
                Method::Members => (Network::of_members(), Some(1.0)),
                _ => (Network::builtin(), air_drop(&normal.grey, &by_local.components(0.0, job)?)),
            };
            let network = network.ok_or(DetectError::NoNetwork)?;
            let grey = normal.flat(air_drop, job)?;
            job.step(4, 12)?;
            let opinion = network.look(&grey, &normal.seen, job)?;
            job.step(5, 12)?;
            let [pore, crack] = [Class::Pore, Class::Crack].map(|class| opinion.of(class));
            let sound = Grid {
                data: pore.data.iter().zip(&crack.data).map(|(p, c)| 1.0 - p - c).collect(),
                ..*pore
            };
            let threshold = sound.map(|_| 1.0 - settings.chance);
            job.step(5, 12)?;
            let air = Air {
                grey: &grey,
                value: &sound,
                body: &normal.body,
                threshold: &threshold,
                settings,
            };
            let found = air.components(0.0, job)?;
            job.step(5, 12)?;
            let air_drop = air_drop.unwrap_or(1.0);
            let chance =
                crack::outside_nests(crack, &air.dark(0.0), &normal.body, &settings.crack, job);
            job.step(6, 12)?;
            let cracks = crack::find_likely(
                &chance,
                &normal.grey,
                &normal.body,
                air_drop,
                slice.pixel_mm,
                &settings.crack,
            );
            let decided = Decided {
                found,
                cracks,
                air_drop,
                noise,
                shift: settings.chance_error,
                alone: None,
            };
            Ok(decided.told(&air, &normal, slice.pixel_mm, job)?)
        }
    }
}

/// A local threshold that is nowhere below half way from sound concrete to air, lest a pore larger
/// than the window count as what is usual there; nor, by that, above what it is in sound concrete.
fn filled(local: &Grid<f32>, air_drop: Option<f64>, settings: &DetectSettings) -> Grid<f32> {
    let half_way = air_drop.map_or(f32::NEG_INFINITY, |drop| 1.0 - 0.5 * drop as f32);
    local.map(|t| t.max(half_way.min(1.0 - settings.k)))
}

/// What was decided of a slice, before it is told with error bars.
struct Decided<'a> {
    found: Components,
    cracks: crack::Found,
    air_drop: f64,
    noise: f64,
    /// Standard uncertainty of the threshold.
    shift: f32,
    /// The threshold as it would be without pores around.
    alone: Option<&'a Grid<f32>>,
}

impl Decided<'_> {
    fn told(
        self,
        air: &Air,
        normal: &Normal,
        pixel_mm: f32,
        job: &Job,
    ) -> Result<Detection, Cancelled> {
        let Self { found, cracks, air_drop, noise, shift, alone } = self;
        let is_crack: Vec<bool> = found.members.iter().map(|pixels| cracks.cover(pixels)).collect();
        let pores_mask = found.labels.map(|label| label != 0 && !is_crack[label as usize - 1]);
        let body_area = normal.body.count() as f64;
        job.step(6, 12)?;
        let area = |air: &Air, shift: f32| {
            let found = air.components(shift, job)?;
            let areas = air.areas(&found, &normal.grey);
            let pores = found.members.iter().zip(areas).filter(|(pixels, _)| !cracks.cover(pixels));
            Ok(pores.map(|(_, area)| area).sum::<f64>() / body_area)
        };
        let areas = air.areas(&found, &normal.grey);
        let own = |k: usize| if is_crack[k] { 0.0 } else { areas[k] };
        let porosity = (0..areas.len()).map(own).sum::<f64>() / body_area;
        job.step(7, 12)?;
        let more = area(air, shift)?;
        job.step(8, 12)?;
        let by_threshold = 0.5 * (more - area(air, -shift)?).abs();
        job.step(9, 12)?;
        let by_noise = noise_error(air, &pores_mask, noise) / body_area;
        let by_neighbours = match alone {
            Some(threshold) => (area(&Air { threshold, ..*air }, 0.0)? - porosity).abs() / LIKELY,
            None => 0.0,
        };
        // Filters are there to count pores. What they refuse is air where a network says so (labelled
        // slices, simulated scans), noise where a threshold does; all of it may be the other.
        let refused =
            |(i, dark): (usize, &bool)| *dark && found.labels.data[i] == 0 && !cracks.mask.data[i];
        let specks = air.dark(0.0).data.iter().enumerate().filter(|&speck| refused(speck)).count()
            as f64
            / body_area;
        let by_specks = specks / LIKELY;
        let counted = if air.settings.method == Method::Classical { 0.0 } else { specks };
        // Pores that a crack runs through belong to its dark pixels; or it is wide there itself.
        let besides = cracks.besides / body_area;
        let by_depth = match air.settings.method {
            Method::Members => depth_error(&found, &is_crack) / body_area,
            Method::Classical | Method::Network => 0.0,
        };
        let errors = [by_threshold, by_noise, by_neighbours, by_specks, by_depth, besides / LIKELY];
        let inside = Estimate {
            value: porosity + counted + besides,
            std_error: errors.iter().map(|e| e * e).sum::<f64>().sqrt(),
        };
        job.step(10, 12)?;
        let pores = table(&found, &is_crack, normal, pixel_mm);
        job.step(11, 12)?;
        Ok(Detection {
            sampling_error: block_bootstrap(&pores_mask, &normal.body),
            porosity: with_rim(inside, &found, own, normal),
            pores,
            labels: found.labels,
            cracks: cracks.list,
            crack_mask: cracks.mask,
            noise,
            air_drop,
            pixel_mm,
            grey: normal.grey.clone(),
            body: normal.body.clone(),
            seen: normal.seen.clone(),
        })
    }
}

impl Detection {
    /// Every dark pixel that was kept, of pores and of cracks: what label masks are compared with.
    #[must_use]
    pub fn mask(&self) -> Mask {
        self.labels.map(|label| label != 0)
    }
}

/// Rows that one task works on; fixed, so that sums run in the same order for any number of
/// threads.
const BAND: usize = 64;

/// Sauvola's threshold at every pixel. Column sums slide down a band and prefix sums run along each
/// row, which is an integral image that needs one row of memory.
pub fn sauvola(grey: &Grid<f32>, settings: &DetectSettings) -> Grid<f32> {
    let (w, h, half) = (grey.width, grey.height, settings.window / 2);
    let mut threshold = Grid::new(w, h, 0.0_f32);
    threshold.data.par_chunks_mut(w * BAND).enumerate().for_each(|(band, rows)| {
        let y0 = band * BAND;
        let mut columns = vec![[0.0_f64; 2]; w];
        let add = |columns: &mut [[f64; 2]], y: usize, sign: f64| {
            for (sums, &v) in columns.iter_mut().zip(&grey.data[y * w..(y + 1) * w]) {
                let v = f64::from(v);
                sums[0] += sign * v;
                sums[1] += sign * v * v;
            }
        };
        (y0.saturating_sub(half)..(y0 + half).min(h)).for_each(|y| add(&mut columns, y, 1.0));
        let mut prefix = vec![[0.0_f64; 2]; w + 1];
        for (dy, row) in rows.chunks_mut(w).enumerate() {
            let y = y0 + dy;
            if y + half < h {
                add(&mut columns, y + half, 1.0);
            }
            if dy > 0 && y > half {
                add(&mut columns, y - half - 1, -1.0);
            }
            let height = (y + half + 1).min(h) - y.saturating_sub(half);
            for x in 0..w {
                prefix[x + 1] = [prefix[x][0] + columns[x][0], prefix[x][1] + columns[x][1]];
            }
            for (x, t) in row.iter_mut().enumerate() {
                let (from, to) = (x.saturating_sub(half), (x + half + 1).min(w));
                let n = ((to - from) * height) as f64;
                let mean = (prefix[to][0] - prefix[from][0]) / n;
                let variance = (prefix[to][1] - prefix[from][1]) / n - mean * mean;
                let s = variance.max(0.0).sqrt();
                *t = (mean * (1.0 + f64::from(settings.k) * (s / f64::from(settings.r) - 1.0)))
                    as f32;
            }
        }
    });
    threshold
}

/// What decides whether a pixel is air.
#[derive(Clone, Copy)]
struct Air<'a> {
    /// What mass is missing from.
    grey: &'a Grid<f32>,
    /// What is compared with the threshold: grey, or how probably it is sound.
    value: &'a Grid<f32>,
    body: &'a Mask,
    threshold: &'a Grid<f32>,
    settings: &'a DetectSettings,
}

impl Air<'_> {
    /// Dark pixels at a threshold raised by `shift`.
    fn dark(&self, shift: f32) -> Mask {
        let pixel =
            |i: usize| self.body.data[i] && self.value.data[i] < self.threshold.data[i] + shift;
        Mask { data: (0..self.body.data.len()).map(pixel).collect(), ..*self.body }
    }

    /// The components that pass the filters, at a threshold raised by `shift`.
    fn components(&self, shift: f32, job: &Job) -> Result<Components, Cancelled> {
        let mut found = match self.settings.hysteresis {
            None => self.dark(shift).components(),
            Some(extra) => {
                let core = self.dark(shift);
                let mut grown = self.dark(shift + extra.max(0.0)).components();
                grown.members.retain(|pixels| pixels.iter().any(|&i| core.data[i]));
                grown
            }
        };
        job.check()?;
        if let Some(height) = self.settings.split {
            found.members = split(&found, height);
            job.check()?;
        }
        found.members.retain(|pixels| self.keeps(pixels));
        found.labels.data.fill(0);
        for (n, pixels) in found.members.iter().enumerate() {
            pixels.iter().for_each(|&i| found.labels.data[i] = n as u32 + 1);
        }
        Ok(found)
    }

    /// Areas of pores, pixels. A slice of a scan is as thick as a pixel: where it only grazes a pore
    /// no pixel is all air, and yet the outline shows (Holmes 1927); and that of a pore hardly wider
    /// than the blur is that of its blur. So what is narrow counts as the air that it lacks with its
    /// edge, over what a pixel of the wide ones lacks. Outlines of 4 to 16 pixels were twice to 1.4
    /// times as large as what was planted (simulated scans).
    fn areas(&self, found: &Components, grey: &Grid<f32>) -> Vec<f64> {
        /// Pores are wide from this area on, pixels: a slice that cuts less of a pore five pixels in
        /// radius may graze it.
        const WIDE: usize = 50;
        /// What a pixel of wide pores lacks, edge and all, and as how many pixels that counts (of
        /// simulated scans).
        const USUAL: (f64, f64) = (1.1, 50.0);
        let outlined = found.members.iter().map(|pixels| pixels.len() as f64);
        if self.settings.method != Method::Members {
            return outlined.collect();
        }
        let lacks: Vec<f64> = (0..found.members.len())
            .map(|k| missing_mass(grey, &with_edge(found, k, self.body)))
            .collect();
        let wide = found.members.iter().zip(&lacks).filter(|(pixels, _)| pixels.len() >= WIDE);
        let [mass, area] = wide.fold([USUAL.0 * USUAL.1, USUAL.1], |[m, a], (p, lacks)| {
            [m + lacks, a + p.len() as f64]
        });
        let narrow = |lacks: f64| (lacks * area / mass.max(1e-9)).max(0.0);
        let of =
            |(area, lacks): (f64, &f64)| if area < WIDE as f64 { narrow(*lacks) } else { area };
        outlined.zip(&lacks).map(of).collect()
    }

    fn keeps(&self, pixels: &[usize]) -> bool {
        let at_rim = || {
            pixels.iter().any(|&i| {
                self.body.neighbours(i).iter().any(|n| n.is_none_or(|n| !self.body.data[n]))
            })
        };
        let mass = missing_mass(self.grey, pixels) as f32;
        let s = self.settings;
        pixels.len() >= s.min_area && mass >= s.min_mass && (mass >= s.rim_mass || !at_rim())
    }
}

fn missing_mass(grey: &Grid<f32>, pixels: &[usize]) -> f64 {
    pixels.iter().map(|&i| f64::from(1.0 - grey.data[i])).sum()
}

/// The pixels of component `k` and those of the body around it that are no other's.
fn with_edge(found: &Components, k: usize, body: &Mask) -> Vec<usize> {
    let label = k as u32 + 1;
    let (w, h) = (body.width, body.height);
    let mut all: Vec<usize> = Vec::new();
    for &i in &found.members[k] {
        let (x, y) = body.place(i);
        let rows = y.saturating_sub(1)..(y + 2).min(h);
        all.extend(
            rows.flat_map(|y| (x.saturating_sub(1)..(x + 2).min(w)).map(move |x| y * w + x)),
        );
    }
    all.sort_unstable();
    all.dedup();
    all.retain(|&i| body.data[i] && [0, label].contains(&found.labels.data[i]));
    all
}

/// Splits components along the saddles of their distance map: pixels join the basin of a peak from
/// the top down, and two basins that meet become one unless both peaks rise by at least `height`
/// above the saddle.
pub fn split(found: &Components, height: f32) -> Vec<Vec<usize>> {
    let distance = found.labels.map(|l| l != 0).distance();
    let mut basin = found.labels.map(|_| usize::MAX);
    let mut parts = Vec::new();
    for pixels in &found.members {
        let mut order = pixels.clone();
        order.sort_by(|&a, &b| distance.data[b].total_cmp(&distance.data[a]).then(a.cmp(&b)));
        // Each basin: its peak and the basin that it was merged into (itself while it stands
        // alone).
        let mut basins: Vec<(f32, usize)> = Vec::new();
        let root = |basins: &[(f32, usize)], mut b: usize| {
            while basins[b].1 != b {
                b = basins[b].1;
            }
            b
        };
        for &i in &order {
            let here = distance.data[i];
            let mut touching: Vec<usize> =
                found.labels.neighbours(i).into_iter().flatten().map(|n| basin.data[n]).collect();
            touching.retain(|&b| b != usize::MAX);
            touching.iter_mut().for_each(|b| *b = root(&basins, *b));
            touching.sort_unstable();
            touching.dedup();
            let Some(&first) = touching.first() else {
                basin.data[i] = basins.len();
                basins.push((here, basins.len()));
                continue;
            };
            // Basins are numbered from the highest peak down, so that the first is the one that
            // stays.
            for &b in &touching[1..] {
                if basins[b].0 - here < height {
                    basins[b].1 = first;
                }
            }
            basin.data[i] = first;
        }
        let mut split = vec![Vec::new(); basins.len()];
        for &i in pixels {
            split[root(&basins, basin.data[i])].push(i);
            // Numbers are per component: the next one must not see these.
        }
        pixels.iter().for_each(|&i| basin.data[i] = usize::MAX);
        parts.extend(split.into_iter().filter(|p| !p.is_empty()));
    }
    parts
}

/// Standard deviation of the noise: 1.4826 · the median absolute deviation from the local
/// threshold, in the body. Pores are too few to move it.
fn noise(grey: &Grid<f32>, threshold: &Grid<f32>, body: &Mask) -> f64 {
    let pixels =
        || (0..body.data.len()).filter(|&i| body.data[i]).map(|i| grey.data[i] - threshold.data[i]);
    let middle = median(pixels()).unwrap_or(0.0);
    1.4826 * f64::from(median(pixels().map(|v| (v - middle).abs())).unwrap_or(0.0))
}

/// How far below sound concrete pure air lies: the upper quartile of the darkest pixels of
/// components large enough to have one that is nothing but air. `None` where there is none; then
/// attenuation says 1.
fn air_drop(grey: &Grid<f32>, found: &Components) -> Option<f64> {
    let deepest =
        |pixels: &Vec<usize>| pixels.iter().map(|&i| 1.0 - grey.data[i]).fold(0.0, f32::max);
    let mut drops: Vec<f32> = found.members.iter().filter(|p| p.len() >= 25).map(deepest).collect();
    drops.sort_by(f32::total_cmp);
    drops.get(drops.len() * 3 / 4).map(|&d| f64::from(d.clamp(0.05, 1.0)))
}

/// Standard error of the pore area, pixels, from noise: a pixel at a pore's edge with grey g is
/// called air with probability Φ((T − g)/σ), or as the network says. The noise of CT is correlated
/// over about two pixels, so that four pixels decide together.
fn noise_error(air: &Air, pores: &Mask, noise: f64) -> f64 {
    const DECIDE_TOGETHER: f64 = 4.0;
    if noise <= 0.0 {
        return 0.0;
    }
    let classical = air.settings.method == Method::Classical;
    let near =
        |i: usize| pores.data[i] || pores.neighbours(i).iter().flatten().any(|&n| pores.data[n]);
    let variance = |i: usize| {
        let p = match classical {
            // Φ of how far below the threshold it is.
            true => {
                0.5 * erfc(
                    f64::from(air.grey.data[i] - air.threshold.data[i])
                        / (noise * std::f64::consts::SQRT_2),
                )
            }
            false => 1.0 - f64::from(air.value.data[i]),
        };
        p * (1.0 - p)
    };
    let sum: f64 =
        (0..pores.data.len()).filter(|&i| air.body.data[i] && near(i)).map(variance).sum();
    (DECIDE_TOGETHER * sum).sqrt()
}

/// Standard error of the pore area, pixels, of scans: a slice is about a pixel thick, over which the
/// radius of a pore's section changes by some .2 of one, in each pore by itself (forty simulated
/// scans).
fn depth_error(found: &Components, is_crack: &[bool]) -> f64 {
    const RADIUS: f64 = 0.2;
    let pores = found.members.iter().zip(is_crack).filter(|(_, is_crack)| !**is_crack);
    // (2π r)² of a disc of that area.
    let round = pores.map(|(pixels, _)| 4.0 * std::f64::consts::PI * pixels.len() as f64);
    RADIUS * round.sum::<f64>().sqrt()
}

/// The porosity of the whole section, of what was read of its inside. Along a sawn face there are
/// as many pores as on the line where reading ends; a mould parts none, and leaves .4 of them
/// (forty simulated scans): both are as likely. The error is of that, and of how many pores happen
/// to lie there.
fn with_rim(
    inside: Estimate,
    found: &Components,
    area: impl Fn(usize) -> f64,
    normal: &Normal,
) -> Estimate {
    const LINE: f32 = 2.0;
    /// Share of what lies on the line.
    const SHARE: f64 = 0.7;
    let body = normal.body.count();
    let rim = normal.rim as f64 / (normal.rim + body).max(1) as f64;
    if rim == 0.0 {
        return inside;
    }
    let deep = normal.seen.distance();
    let on_line = |i: &usize| normal.body.data[*i] && deep.data[*i] <= LINE;
    let line = (0..normal.body.data.len()).filter(on_line).count().max(1) as f64;
    let (mut along, mut squares, mut areas) = (0.0, 0.0, 0.0);
    for (k, pixels) in found.members.iter().enumerate() {
        along += area(k) * pixels.iter().filter(|i| on_line(i)).count() as f64
            / (pixels.len() as f64 * line);
        // Of a pore wider than the rim no more than a strip lies in it.
        let diameter = (4.0 / std::f64::consts::PI * area(k)).sqrt();
        squares += area(k).powi(2) * (f64::from(normal::RIM) / diameter.max(1e-9)).min(1.0);
        areas += area(k);
    }
    // Pores at random places: the variance of their area is their number times the mean square of
    // one's (Campbell).
    let happens = SHARE * inside.value * squares / areas.max(1e-9) / normal.rim as f64;
    let of_rim = (0.3 / LIKELY * along).hypot(happens.sqrt());
    Estimate {
        value: (1.0 - rim) * inside.value + rim * SHARE * along,
        std_error: ((1.0 - rim) * inside.std_error).hypot(rim * of_rim),
    }
}

/// Standard error of the porosity by resampling square blocks, which keeps neighbouring pixels
/// together (Künsch 1989).
fn block_bootstrap(pores: &Mask, body: &Mask) -> f64 {
    const BLOCK: usize = 32;
    const DRAWS: u32 = 200;
    let across = body.width.div_ceil(BLOCK);
    let mut blocks = vec![[0.0_f64; 2]; across * body.height.div_ceil(BLOCK)];
    for i in (0..body.data.len()).filter(|&i| body.data[i]) {
        let (x, y) = body.place(i);
        let block = &mut blocks[y / BLOCK * across + x / BLOCK];
        block[0] += f64::from(u8::from(pores.data[i]));
        block[1] += 1.0;
    }
    blocks.retain(|b| b[1] > 0.0);
    let draw = |d: u32| {
        let key = Key::new(0x0070_6f72, u64::from(d));
        let pick = |n: usize| {
            blocks[((key.unit64(n as u32) * blocks.len() as f64) as usize).min(blocks.len() - 1)]
        };
        let sum = (0..blocks.len()).map(pick).fold([0.0, 0.0], |a, b| [a[0] + b[0], a[1] + b[1]]);
        sum[0] / sum[1]
    };
    let draws: Vec<f64> = (0..DRAWS).map(draw).collect();
    let mean = draws.iter().sum::<f64>() / f64::from(DRAWS);
    (draws.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(DRAWS - 1)).sqrt()
}

/// Volume of the sphere whose great circle has this area: 4/3 · area^(3/2) / √π.
fn sphere_mm3(area_mm2: f64) -> f64 {
    4.0 / 3.0 * area_mm2.powf(1.5) / std::f64::consts::PI.sqrt()
}

fn table(found: &Components, is_crack: &[bool], normal: &Normal, pixel_mm: f32) -> Vec<Pore> {
    let (grey, distance, to_bar) = (&normal.grey, normal.solid.distance(), normal.to_bar());
    let mm = f64::from(pixel_mm);
    let pore = |(n, pixels): (usize, &Vec<usize>)| {
        let label = n as u32 + 1;
        let area = pixels.len() as f64;
        let [mut x, mut y, mut edges] = [0.0, 0.0, 0.0];
        for &i in pixels {
            let (u, v) = grey.place(i);
            x += (u as f64 + 0.5) / area;
            y += (v as f64 + 0.5) / area;
            let outside = found
                .labels
                .neighbours(i)
                .into_iter()
                .filter(|n| n.is_none_or(|n| found.labels.data[n] != label));
            edges += outside.count() as f64;
        }
        let perimeter = std::f64::consts::FRAC_PI_4 * edges;
        let middle = y as usize * grey.width + x as usize;
        Pore {
            label,
            x_mm: x * mm,
            y_mm: y * mm,
            area_px: pixels.len(),
            area_mm2: area * mm * mm,
            volume_mm3: sphere_mm3(area * mm * mm),
            diameter_mm: (4.0 * area / std::f64::consts::PI).sqrt() * mm,
            circularity: (4.0 * std::f64::consts::PI * area / (perimeter * perimeter)).min(1.0),
            depth_mm: f64::from(distance.data[middle]) * mm,
            bar_mm: to_bar.as_ref().map(|to_bar| f64::from(to_bar.data[middle]) * mm),
            missing_mass: missing_mass(grey, pixels),
        }
    };
    found.members.iter().enumerate().filter(|(n, _)| !is_crack[*n]).map(pore).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of concrete 92 mm across with pores of 2 to 12 mm and some noise, on a picture of 100
    /// mm, and the porosity of the disc.
    fn disc(side: usize) -> (Slice, f64) {
        let pixel = 100.0 / side as f32;
        let at =
            |i: usize| [(i % side) as f32 + 0.5, (i / side) as f32 + 0.5].map(|v| v * pixel - 50.0);
        let pore = |n: u32| {
            let key = Key::new(3, u64::from(n));
            ([0, 1].map(|k| 60.0 * (key.unit(k) - 0.5)), 1.0 + 5.0 * key.unit(2).powi(3))
        };
        let pores: Vec<([f32; 2], f32)> = (0..25).map(pore).collect();
        let grey = |i: usize| {
            let [x, y] = at(i);
            match () {
                () if x.hypot(y) > 46.0 => 0.0,
                () if pores.iter().any(|([u, v], r)| (x - u).hypot(y - v) < *r) => 50.0,
                () => 1000.0 + 20.0 * (Key::new(4, i as u64).unit(0) - 0.5),
            }
        };
        let data: Vec<f32> = (0..side * side).map(grey).collect();
        let count = |of: f32| data.iter().filter(|v| (1.0..of).contains(*v)).count() as f64;
        let porosity = count(100.0) / count(2000.0);
        (
            Slice {
                name: "disc".into(),
                grey: Grid { width: side, height: side, data },
                pixel_mm: pixel,
            },
            porosity,
        )
    }

    /// A wide pore, and one that the slice fills by two fifths, both blurred: the outline of the second
    /// holds more than twice its air.
    #[test]
    fn a_pore_that_the_slice_grazes_counts_as_the_air_that_it_lacks() {
        let job = Job::default();
        let near = |i: usize, x: f32| ((i % 80) as f32 - x).hypot((i / 80) as f32 - 40.0);
        let share = |i: usize| match () {
            () if near(i, 25.0) <= 9.0 => 1.0,
            () if near(i, 60.0) <= 2.0 => 0.4,
            () => 0.0,
        };
        let air: Vec<f32> = (0..6400).map(share).collect();
        let true_px: Vec<f64> = [25.0, 60.0]
            .map(|x| (0..6400).filter(|&i| near(i, x) < 12.0).map(|i| f64::from(air[i])).sum())
            .to_vec();
        let blurred = Grid { width: 80, height: 80, data: air }.blurred(0.8, &job);
        let grey = blurred.map(|v| 1.0 - v);
        let (body, threshold) = (grey.map(|_| true), grey.map(|_| 0.85));
        let areas = |method| {
            let settings = &DetectSettings { method, ..DetectSettings::default() };
            let air =
                Air { grey: &grey, value: &grey, body: &body, threshold: &threshold, settings };
            let found = air.components(0.0, &job).unwrap();
            let outlined: Vec<f64> = found.members.iter().map(|p| p.len() as f64).collect();
            (air.areas(&found, &grey), outlined)
        };
        let (found, outlined) = areas(Method::Members);
        assert!(outlined.len() == 2 && outlined[1] > 2.0 * true_px[1], "{outlined:?} {true_px:?}");
        assert!((found[0] - outlined[0]).abs() < 1e-9);
        assert!((found[1] / true_px[1] - 1.0).abs() < 0.15, "{found:?} {true_px:?}");
        let (classical, outlined) = areas(Method::Classical);
        assert_eq!(classical, outlined, "where people drew the edges");
    }

    /// With a window of 51 pixels and nothing else, pores as wide as it were hollow: 4.80, 3.66 and
    /// 2.19 % of 4.85 on pictures of 2048², 4096² and 8192².
    #[test]
    fn finer_pixels_show_the_same_pores() {
        for chosen_at_mm in [DetectSettings::default().chosen_at_mm, None] {
            let settings = DetectSettings { chosen_at_mm, ..DetectSettings::default() };
            let mut found = Vec::new();
            for side in [512, 1024, 2048] {
                let (slice, truth) = disc(side);
                let read = detect(&slice, &settings, &Job::default()).unwrap();
                println!(
                    "{side}: {:.4} of {truth:.4}, {} pores",
                    read.porosity.value,
                    read.pores.len()
                );
                assert!(
                    (read.porosity.value / truth - 1.0).abs() < 0.03,
                    "{side}: {} of {truth}",
                    read.porosity.value
                );
                found.push(read.pores.len());
            }
            assert!(found.iter().all(|n| n.abs_diff(found[0]) <= 1), "{found:?}");
        }
    }

    #[test]
    fn windows_and_filters_are_in_millimetres() {
        let fine = DetectSettings::default().on_pixels(0.025);
        assert_eq!(
            (fine.window, fine.min_area, fine.min_mass, fine.crack.min_length),
            (205, 48, 8.0, 144.0)
        );
        let coarse = DetectSettings::default().on_pixels(0.9);
        assert_eq!((coarse.window, coarse.min_area), (51, 3));
        assert_eq!(
            DetectSettings { chosen_at_mm: None, ..DetectSettings::default() }
                .on_pixels(0.025)
                .window,
            51
        );
    }

    #[test]
    fn bright_air_is_refused_and_a_cancel_is_heard() {
        let (slice, _) = disc(256);
        let inverted = Slice { grey: slice.grey.map(|v| 1100.0 - v), ..slice.clone() };
        let why = detect(&inverted, &DetectSettings::default(), &Job::default()).unwrap_err();
        assert!(
            matches!(&why, DetectError::Inverted(_)) && why.to_string().contains("invert"),
            "{why}"
        );
        let job = Job::default();
        job.cancel();
        let network = Network::builtin().unwrap();
        assert!(network.look(&slice.grey, &slice.grey.map(|v| v > 0.0), &job).is_err());
        for method in [Method::Classical, Method::Network] {
            let settings = DetectSettings { method, ..DetectSettings::default() };
            assert!(matches!(detect(&slice, &settings, &job), Err(DetectError::Cancelled(_))));
        }
    }
}
