//! Grey values made comparable: sound concrete 1, no cupping, a contrast as usual.

use intrados_raster::grid::median;
use std::borrow::Cow;

use intrados_stage::{Cancelled, Job};

use crate::{settings::DetectSettings, slice::Slice};
use intrados_raster::grid::{Grid, Mask};

/// A slice in units of its concrete.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// Grey relative to sound concrete; 1 outside the body.
    pub grey: Grid<f32>,
    /// The same with metal as it is.
    raw: Grid<f32>,
    /// Concrete, pores included; no air outside, no metal.
    pub body: Mask,
    /// The body with metal that shows.
    pub seen: Mask,
    /// The body with its bars and ducts filled in.
    pub solid: Mask,
    /// Pixels of the section along its outline that are not read, since their edge is blurred.
    pub rim: usize,
}

/// Depths of air below sound concrete that the network has learnt, and what it is brought to where
/// it lies outside.
const USUAL_DROP: std::ops::RangeInclusive<f64> = 0.30..=0.58;
const MIDDLE_DROP: f64 = 0.45;
/// Standard deviation of the Gaussian over which sound concrete is averaged, pixels.
const FLAT: f64 = 20.0;

/// Normalises a slice; `None` if there is nothing but air.
pub fn normalised(
    slice: &Slice,
    settings: &DetectSettings,
    job: &Job,
) -> Result<Option<Normal>, Cancelled> {
    Cut { slice: Cow::Borrowed(slice), seen: None, rim: 0 }.normalised(settings, job)
}

/// Grey below which a pixel that is open to the outside is no part of the body, relative to sound
/// concrete; pores of masked slices are paler.
const OUTSIDE: f32 = 0.4;
/// Width of the blurred edge between body and air, pixels.
pub(crate) const RIM: f32 = 3.0;
/// Half the width of the mouths of pores that are closed, pixels; a bar is no thicker.
const MOUTH: f32 = 8.0;
/// Grey of metal, relative to sound concrete.
const METAL: f32 = 1.6;
/// Diameter up to which air that concrete encloses is a pore, mm: what is wider was left open, as
/// ducts for strands are (from 40 mm on).
const LARGEST_VOID_MM: f32 = 30.0;
/// Diameter of the thinnest bars, mm: what is narrower is none that was masked out.
const THINNEST_BAR_MM: f32 = 6.0;
/// Share of the air that is blank in a slice that was cut out already, its open pores apart.
const BLANK: f64 = 0.5;

/// A slice with blank air.
pub(crate) struct Cut<'a> {
    slice: Cow<'a, Slice>,
    /// The body, if it was cut out here.
    seen: Option<Mask>,
    /// See [`Normal::rim`].
    rim: usize,
}

/// The slice with blank air, if it is not so already: streaks beyond the outline, and in what a
/// spall has left, are no concrete, and the blurred edge is neither crack nor pore.
pub(crate) fn cut_out<'a>(slice: &'a Slice, job: &Job) -> Result<Cut<'a>, Cancelled> {
    let as_it_is = Cut { slice: Cow::Borrowed(slice), seen: None, rim: 0 };
    job.check()?;
    let (grey, air) = (&slice.grey, air_outside(&slice.grey));
    job.check()?;
    let mean = grey.data.iter().map(|v| f64::from(*v)).sum::<f64>() / grey.data.len().max(1) as f64;
    let Some(bright) = median(grey.data.iter().copied().filter(|v| f64::from(*v) > mean)) else {
        return Ok(as_it_is);
    };
    let mut body = grey.map(|v| v - air > OUTSIDE * (bright - air));
    let dark = body.map(|inside| !inside);
    job.check()?;
    body.fill_gaps((body.count() / 50).max(disc(LARGEST_VOID_MM / slice.pixel_mm)));
    job.check()?;
    let outside =
        || grey.data.iter().zip(&body.data).filter(|(_, b)| !**b).map(|(v, _)| (v - air).abs());
    let blank = outside().filter(|v| *v < 1e-3 * (bright - air)).count();
    if blank as f64 >= BLANK * outside().count() as f64 {
        return Ok(as_it_is);
    }
    // Pores that are open to the outside are pores; what a spall has left is wider.
    job.check()?;
    let wide = body.map(|inside| !inside).distance_within().map(|away| away <= MOUTH);
    job.check()?;
    let closed = wide.distance_within().map(|deep| deep > MOUTH);
    body.unite(&closed);
    job.check()?;
    bare(&mut body, &dark, &grey.map(|v| v - air > METAL * (bright - air)), job)?;
    job.check()?;
    let deep = body.distance();
    let seen = deep.map(|d| d > RIM);
    let data = grey.data.iter().zip(&seen.data).map(|(&v, &s)| if s { v } else { air }).collect();
    Ok(Cut {
        slice: Cow::Owned(Slice { grey: Grid { data, ..*grey }, ..slice.clone() }),
        rim: body.count() - seen.count(),
        seen: Some(seen),
    })
}

impl Cut<'_> {
    /// See [`normalised`].
    pub(crate) fn normalised(
        self,
        settings: &DetectSettings,
        job: &Job,
    ) -> Result<Option<Normal>, Cancelled> {
        let air = air_outside(&self.slice.grey);
        job.check()?;
        let grey = self.slice.grey.map(|v| v - air);
        let Some(rough) = median(grey.data.iter().copied().filter(|&v| v > 0.0)) else {
            return Ok(None);
        };
        job.check()?;
        let known = self.seen.is_some();
        let mut seen = self.seen.unwrap_or_else(|| grey.map(|v| v > 0.05 * rough).opened());
        job.check()?;
        let shown = || grey.data.iter().zip(&seen.data).filter(|(_, s)| **s).map(|(&v, _)| v);
        let Some(middle) = median(shown()) else { return Ok(None) };
        let matrix = refined(shown(), middle);
        let raw = grey.map(|v| v / matrix);
        job.check()?;
        if !known {
            // An enclosed gap is a void if it is small, else a bar or a duct that was masked out.
            let bar = disc(THINNEST_BAR_MM / self.slice.pixel_mm);
            seen.fill_gaps((seen.count() / 50).max(bar));
        }
        let body = Mask {
            data: seen.data.iter().zip(&raw.data).map(|(&s, &v)| s && v < settings.metal).collect(),
            ..seen
        };
        job.check()?;
        let mut solid = seen.clone();
        solid.fill_gaps(usize::MAX);
        let inside =
            |(&v, &b): (&f32, &bool)| if b { v.clamp(-1.0, settings.ceiling) } else { 1.0 };
        let grey = Grid { data: raw.data.iter().zip(&body.data).map(inside).collect(), ..raw };
        Ok((body.count() > 0).then_some(Normal { grey, raw, body, seen, solid, rim: self.rim }))
    }
}

/// Pixels of a disc so wide.
fn disc(diameter: f32) -> usize {
    (0.25 * std::f32::consts::PI * diameter * diameter) as usize
}

/// Takes out of the body what is `dark` behind a bar that lies bare: a spall reaches behind it.
fn bare(body: &mut Mask, dark: &Mask, metal: &Mask, job: &Job) -> Result<(), Cancelled> {
    let near =
        |what: &Mask, reach: f32| what.map(|v| !v).distance_within().map(|away| away <= reach);
    let both = |a: &Mask, b: &Mask| Mask {
        data: a.data.iter().zip(&b.data).map(|(&a, &b)| a && b).collect(),
        ..*a
    };
    let bared = both(metal, &near(&body.map(|inside| !inside), RIM));
    job.check()?;
    let behind = near(&both(metal, &near(&bared, 2.0 * MOUTH)), RIM);
    job.check()?;
    for gap in both(body, dark).components().members {
        if gap.iter().any(|&i| behind.data[i]) {
            gap.into_iter().for_each(|i| body.data[i] = false);
        }
    }
    Ok(())
}

/// The grey of the air around the specimen: that of the picture's border, where the border is even
/// and darker than the rest; else 0.
fn air_outside(grey: &Grid<f32>) -> f32 {
    let ([low, air, high], rest) = border_and_rest(grey, |v, [_, _, high]| v > high);
    if high - low < 0.2 * (rest - air) { air } else { 0.0 }
}

/// Whether the picture's border is even and brighter than the rest: concrete in bright air, whose
/// pores would be taken for what is sound.
pub(crate) fn is_inverted(grey: &Grid<f32>) -> bool {
    let ([low, air, high], rest) = border_and_rest(grey, |v, [low, ..]| v < low);
    if high - low >= 0.2 * (air - rest) {
        return false;
    }
    // What is darker is a body only where there is much of it, and no evener than the border: in a
    // picture from within the concrete pores and hollows are dark too.
    let mut dark: Vec<f32> =
        grey.data.iter().copied().filter(|&v| v < 0.5 * (air + rest)).collect();
    let mut tenth = |n: usize| {
        let at = dark.len().saturating_sub(1) * n / 10;
        if dark.is_empty() { 0.0 } else { *dark.select_nth_unstable_by(at, f32::total_cmp).1 }
    };
    let spread = tenth(9) - tenth(1);
    4 * dark.len() > grey.data.len() && spread >= high - low
}

/// A tenth, half and nine tenths of the grey values of the picture's border, and the median of all
/// that is `beside` them.
fn border_and_rest(grey: &Grid<f32>, beside: impl Fn(f32, [f32; 3]) -> bool) -> ([f32; 3], f32) {
    let (w, h) = (grey.width, grey.height);
    let rows = grey.data[..w].iter().chain(&grey.data[w * (h - 1)..]);
    let mut border: Vec<f32> = rows
        .copied()
        .chain((0..h).flat_map(|y| [grey.data[y * w], grey.data[y * w + w - 1]]))
        .collect();
    border.sort_by(f32::total_cmp);
    let tenths = [1, 5, 9].map(|tenth| border[(border.len() - 1) * tenth / 10]);
    let rest =
        median(grey.data.iter().copied().filter(|&v| beside(v, tenths))).unwrap_or(tenths[1]);
    (tenths, rest)
}

/// The mean of what lies within 5 % of `middle`: finer than a median of coarse grey levels.
fn refined(values: impl Iterator<Item = f32>, middle: f32) -> f32 {
    let near = values.filter(|v| (v - middle).abs() <= 0.05 * middle.abs());
    let (sum, count) = near.fold((0.0_f64, 0_usize), |(sum, n), v| (sum + f64::from(v), n + 1));
    if count == 0 { middle } else { (sum / count as f64) as f32 }
}

impl Normal {
    /// What the network sees: grey without what changes slowly (cupping), and the usual contrast
    /// where `air_drop`, the depth of air, is unusual.
    /// # Errors
    /// The job was cancelled.
    pub fn flat(&self, air_drop: Option<f64>, job: &Job) -> Result<Grid<f32>, Cancelled> {
        let level = self.level(&self.level(&self.grey.map(|_| 1.0), 0.15, job)?, 0.07, job)?;
        let gain = air_drop
            .filter(|drop| !USUAL_DROP.contains(drop))
            .map_or(1.0, |drop| MIDDLE_DROP / drop) as f32;
        let value = |i: usize| {
            if self.seen.data[i] {
                1.0 + gain * (self.raw.data[i] / level.data[i] - 1.0)
            } else {
                1.0
            }
        };
        Ok(Grid { data: (0..level.data.len()).map(value).collect(), ..level })
    }

    /// The mean of the body around each pixel, of what lies within `reach` of `around`.
    fn level(&self, around: &Grid<f32>, reach: f32, job: &Job) -> Result<Grid<f32>, Cancelled> {
        let sound =
            |i: usize| self.body.data[i] && (self.grey.data[i] - around.data[i]).abs() < reach;
        let weight = |i: usize| f32::from(u8::from(sound(i)));
        let blurred = |value: bool| {
            job.check()?;
            let data = (0..self.grey.data.len())
                .map(|i| weight(i) * if value { self.grey.data[i] } else { 1.0 })
                .collect();
            Ok(Grid { data, ..*around }.blurred(FLAT, job))
        };
        let (weights, sums) = (blurred(false)?, blurred(true)?);
        job.check()?;
        let mean = |(&s, &w): (&f32, &f32)| if w > 1e-3 { s / w } else { 1.0 };
        Ok(Grid { data: sums.data.iter().zip(&weights.data).map(mean).collect(), ..*around })
    }

    /// Distance of every pixel to the nearest bar or duct, pixels; `None` without one.
    pub(crate) fn to_bar(&self) -> Option<Grid<f32>> {
        let free = Mask {
            data: self.solid.data.iter().zip(&self.body.data).map(|(&s, &b)| b || !s).collect(),
            ..self.solid
        };
        free.data.contains(&false).then(|| free.distance_within())
    }
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;
    use crate::detect::detect;

    /// A section of 220 × 220 with a dish fallen off its upper side, its edges blurred over some
    /// pixels, in air that is blank or has streaks of a tenth of the concrete's grey.
    fn scanned(streaks: f32) -> Slice {
        let inside = |i: usize| {
            let (x, y) = ((i % 300) as f32 - 150.0, (i / 300) as f32 - 150.0);
            x.abs() < 110.0 && y.abs() < 110.0 && y > -110.0 + 20.0 * (1.0 - (x / 80.0).powi(2))
        };
        let sharp = Grid {
            width: 300,
            height: 300,
            data: (0..90_000).map(|i| f32::from(u8::from(inside(i)))).collect(),
        };
        let blurred = if streaks > 0.0 { sharp.blurred(1.2, &Job::default()) } else { sharp };
        let noise = |i: usize, v: f32| {
            if v > 0.0 || streaks > 0.0 {
                0.03 * (Key::new(1, i as u64).unit(1) - 0.5)
            } else {
                0.0
            }
        };
        let streak = |i: usize| streaks * (0.05 * (i % 300) as f32 + 0.09 * (i / 300) as f32).sin();
        let data = blurred
            .data
            .iter()
            .enumerate()
            .map(|(i, &v)| v + noise(i, v) + (1.0 - v) * streak(i))
            .collect();
        Slice { name: "scan".into(), grey: Grid { data, ..blurred }, pixel_mm: 1.0 }
    }

    /// Before slices were cut out, the streaks beyond this outline counted as concrete, full of
    /// pores and cracks.
    #[test]
    fn neither_streaks_nor_the_rim_of_a_spall_are_damage() {
        let found = detect(&scanned(0.1), &DetectSettings::default(), &Job::default()).unwrap();
        assert!(
            found.cracks.is_empty() && found.porosity.value < 1e-3,
            "{:?} {:?}",
            found.cracks,
            found.porosity
        );
        // Less a rim of three pixels: 214² less the dish, two thirds of some 164 × 20.
        let (body, expected) =
            (found.body.count() as f64, 214.0 * 214.0 - 2.0 / 3.0 * 164.0 * 20.0);
        assert!((body / expected - 1.0).abs() < 0.01, "{body} {expected}");
    }

    /// A pore of 16 pixels behind a wall of two, which the rim takes; a bar in the edge of the
    /// dish, and a gap behind it.
    #[test]
    fn a_pore_at_the_edge_is_in_the_body_and_what_a_spall_reaches_behind_a_bar_is_not() {
        let mut slice = scanned(0.1);
        let mut fill = |grey: f32, of: &dyn Fn(f32, f32) -> bool| {
            for (i, v) in slice.grey.data.iter_mut().enumerate() {
                if of((i % 300) as f32 - 150.0, (i / 300) as f32 - 150.0) {
                    *v = grey;
                }
            }
        };
        fill(0.02, &|x, y| (x - 100.0).hypot(y) < 8.0);
        fill(0.02, &|x, y| x.abs() < 30.0 && (-80.0..-72.0).contains(&y));
        fill(3.0, &|x, y| x.abs() < 60.0 && (-92.0..-80.0).contains(&y));
        let normal = cut_out(&slice, &Job::default())
            .unwrap()
            .normalised(&DetectSettings::default(), &Job::default())
            .unwrap()
            .unwrap();
        let is_in = |x: usize, y: usize| normal.body.data[y * 300 + x];
        assert!(is_in(250, 150) && is_in(245, 150), "the pore");
        assert!(
            !is_in(150, 74) && is_in(150, 90) && is_in(60, 90),
            "the gap, and concrete around it"
        );
    }

    /// A gap in a core of 18 mm: 2.6 mm wide it is a pore although it is over 2 % of the section,
    /// 6.6 mm wide it is left out as a bar or a duct.
    #[test]
    fn of_blank_gaps_those_narrower_than_any_bar_are_pores() {
        for (radius, pores) in [(13.0, 1), (33.0, 0)] {
            let grey = |i: usize| {
                let (x, y) = ((i % 200) as f32 - 100.0, (i / 200) as f32 - 100.0);
                f32::from(u8::from(x.hypot(y) < 90.0 && (x + 20.0).hypot(y) >= radius))
            };
            let data = (0..200 * 200).map(grey).collect();
            let grey = Grid { width: 200, height: 200, data };
            let slice = Slice { name: "core".into(), grey, pixel_mm: 0.1 };
            let found = detect(&slice, &DetectSettings::default(), &Job::default()).unwrap();
            assert_eq!(found.pores.len(), pores, "{radius}");
        }
    }

    #[test]
    fn what_is_cut_out_already_stays_as_it_is() {
        assert!(matches!(cut_out(&scanned(0.0), &Job::default()).unwrap().slice, Cow::Borrowed(_)));
        assert!(matches!(cut_out(&scanned(0.1), &Job::default()).unwrap().slice, Cow::Owned(_)));
    }
}
