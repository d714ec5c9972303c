//! Ours: the corrected slice, and a network that tells pores and cracks apart.
//!
//! The network is that of the crate with weights of its own (`assets/ct/member.ron`): it has
//! learnt on drawn slices with the grain, blur and noise of scans of members, and a pore ends for
//! it where half of the contrast is reached. Its shapes are spheres, lobed discs and sums of sines;
//! it has seen none of these cases. What is chosen here was chosen on rehearsals.

use intrados_stage::Job;
use serde::{Deserialize, Serialize};

use super::{
    ExperimentError,
    reference::{self, MethodMarks},
};
use intrados_ct::{
    crack, detect,
    network::{Class, Network},
    normal::{Normal, normalised},
    slice::Slice,
};
use intrados_raster::grid::{Grid, Mask};

/// What was chosen on rehearsals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Probability from which a pixel is dark.
    pub dark: f32,
    /// Least mean probability of a pore over its pixels, to be one.
    pub sure: f32,
    /// Probability from which a crack grows, and from which it is seeded.
    pub crack: [f32; 2],
    /// Fewest pixels of a crack.
    pub long: usize,
    /// Least length over mean width of a crack.
    pub elongation: f32,
    /// Farthest that a scrap of crack may lie from a crack to be part of it, pixels.
    pub scrap: f32,
}

impl Default for Choice {
    fn default() -> Self {
        let detect::DetectSettings { chance, crack, .. } = detect::DetectSettings::of_members();
        Self {
            dark: chance,
            sure: 0.7,
            crack: [crack.possible, crack.likely],
            long: crack.min_pixels,
            elongation: crack.likely_elongation,
            scrap: 15.0,
        }
    }
}

/// Pores and cracks of a slice.
///
/// # Errors
/// The job was cancelled.
pub(crate) fn found(
    slice: &Slice,
    network: &Network,
    choice: &Choice,
    job: &Job,
) -> Result<MethodMarks, ExperimentError> {
    let settings = detect::DetectSettings::default();
    let Some(mut normal) = normalised(slice, &settings, job)? else { return Ok(nothing(slice)) };
    // The same body as the references': what the rim shows is blur.
    let body = reference::body(&slice.grey, reference::otsu_threshold(&slice.grey));
    normal.seen = body.clone();
    // Air is nothing, by physics: its contrast is known.
    let opinion = network.look(&normal.flat(Some(1.0), job)?, &normal.seen, job)?;
    let [pore, crack] = [Class::Pore, Class::Crack].map(|class| opinion.of(class));
    let concrete = Mask {
        data: body.data.iter().zip(&normal.body.data).map(|(a, b)| *a && *b).collect(),
        ..body
    };
    let mut cracks = cracks(crack, &normal, &concrete, slice, choice);
    let dark = |i: usize| {
        concrete.data[i] && !cracks.data[i] && pore.data[i] + crack.data[i] > choice.dark
    };
    let dark = Mask { data: (0..cracks.data.len()).map(dark).collect(), ..cracks };
    let (mut objects, mut scraps) = (Vec::new(), Vec::new());
    for pixels in dark.components().members {
        let mean =
            |of: &Grid<f32>| pixels.iter().map(|i| of.data[*i]).sum::<f32>() / pixels.len() as f32;
        let (p, c) = (mean(pore), mean(crack));
        let length = crack::length(&pixels, dark.width);
        match () {
            () if p >= c && p + c >= choice.sure => objects.push(pixels),
            () if length * length >= f64::from(choice.elongation) * pixels.len() as f64
                && pixels.len() >= choice.long =>
            {
                pixels.iter().for_each(|i| cracks.data[*i] = true);
            }
            () => scraps.push(pixels),
        }
    }
    if cracks.count() > 0 {
        let away = cracks.map(|v| !v).distance_within();
        for pixels in
            scraps.iter().filter(|pixels| pixels.iter().any(|i| away.data[*i] <= choice.scrap))
        {
            pixels.iter().for_each(|i| cracks.data[*i] = true);
        }
    }
    let mut pores = dark.map(|_| false);
    objects.iter().flatten().for_each(|i| pores.data[*i] = true);
    Ok(MethodMarks { pores, objects, cracks })
}

fn cracks(
    chance: &Grid<f32>,
    normal: &Normal,
    body: &Mask,
    slice: &Slice,
    choice: &Choice,
) -> Mask {
    let settings = crack::CrackSettings {
        possible: choice.crack[0],
        likely: choice.crack[1],
        min_pixels: choice.long,
        likely_elongation: choice.elongation,
        ..crack::CrackSettings::default()
    };
    crack::find_likely(chance, &normal.grey, body, 1.0, slice.pixel_mm, &settings).mask
}

fn nothing(slice: &Slice) -> MethodMarks {
    let empty = slice.grey.map(|_| false);
    MethodMarks { pores: empty.clone(), objects: Vec::new(), cracks: empty }
}
