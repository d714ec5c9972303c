//! What speaks against a sinogram that somebody else has measured: whether its values can be line
//! integrals, and its rays run as they are said to.
//!
//! Views of parallel rays half a turn apart mirror each other, p(θ + π, u) = p(θ, −u), and the
//! middle of mass of a view runs on a sine about the axis (Helgason and Ludwig). Counts are most
//! where nothing is in the way, line integrals least.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::median;
use crate::volume::{Beam, Orbit, Sinogram};

/// Largest line integral behind which a detector of 20 bits counts anything, and more than twice
/// that for what is extrapolated: e^−30 is no measurement.
const MOST_INTEGRAL: f32 = 30.0;
/// Line integrals that are all less than this are of hardly anything.
const LEAST_INTEGRAL: f32 = 0.005;
/// The axis is off where it seems to be by so many bins.
const AXIS_OFF: f64 = 0.75;
/// Views that are the same, but for noise, differ by less than this share of what neighbours do.
const SAME: f64 = 0.3;
/// Fewer views than this share of a row's bins are hardly all of a scan.
const FEW_VIEWS: f64 = 0.1;
/// A bin is dead if it varies by less than this share of what its neighbours vary.
const DEAD: f64 = 1e-3;
/// By so much of the middle one the masses of nine tenths of all views may differ: what is noise and
/// hardening of the beam; and a single view's, before it is taken for dead.
const UNEVEN: f64 = 0.25;
const LOST: f64 = 0.5;
/// Share of the most beyond which rays beside the specimen have something.
const BESIDE: f64 = 0.05;

/// Why values are no line integrals; `None` where they may be.
#[must_use]
pub fn no_integrals(sinogram: &Sinogram) -> Option<String> {
    let bins = sinogram.orbit.bins();
    let edge = (bins / 20).max(1);
    let pick = |from: usize, to: usize| -> Vec<f32> {
        sinogram.data.chunks(bins).flat_map(move |line| line[from..to].iter().copied()).collect()
    };
    let pick = |from, to| median(&mut pick(from, to));
    let beside = [pick(0, edge), pick(bins - edge, bins)];
    let within = pick(bins / 3, bins - bins / 3);
    // A stump of the specimen may reach over one edge.
    if beside[0].min(beside[1]) > within && within >= 0.0 {
        return Some(format!(
            "its rays beside the specimen have more ({:.4}) than those through it ({within:.4}): these are counts or transmission I/I₀, no line integrals; give −ln(I/I₀)",
            beside[0].min(beside[1])
        ));
    }
    // Through the specimen far below what is beside it: as many as are attenuated have a sign lost.
    let most = beside[0].abs().max(beside[1].abs());
    if within < 0.0 && within < -10.0 * most {
        return Some(format!(
            "its rays through the specimen have less than nothing ({within:.4}): the sign is turned; give −ln(I/I₀), not ln(I/I₀)"
        ));
    }
    None
}

/// What else speaks against it, one line each.
#[must_use]
pub fn sinogram_doubts(sinogram: &Sinogram, is_arc_given: bool) -> Vec<String> {
    let orbit = &sinogram.orbit;
    let mut doubts: Vec<String> = size_doubt(sinogram).into_iter().collect();
    let (views, bins) = (orbit.views(), orbit.bins());
    if (views as f64) < FEW_VIEWS * bins as f64 {
        doubts.push(format!(
            "it has {views} views of {bins} bins, too few for slices: are its pages sinograms of rows (--by-row), or the other way round?"
        ));
        return doubts;
    }
    if orbit.beam == Beam::Parallel {
        let middle = sinogram.row(orbit.rows() / 2);
        let mass = mass_doubt(&middle, bins);
        let is_uneven = mass.is_some();
        doubts.extend(mass.or_else(|| beside_doubt(&middle, bins)));
        if is_uneven {
            return doubts;
        }
        // By another arc than the true one the axis would seem off, too.
        let arc = if is_arc_given { None } else { arc_doubt(&middle, orbit) };
        doubts.extend(arc.or_else(|| axis_doubt(&middle, orbit)));
    }
    doubts
}

/// Views whose mass is another than that of others: of one section all have the same (Helgason and
/// Ludwig, order 0).
fn mass_doubt(row: &[f32], bins: usize) -> Option<String> {
    let masses: Vec<f32> = row.chunks(bins).map(|line| line.iter().sum()).collect();
    let mut sorted = masses.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| sorted.get((share * (sorted.len() - 1) as f64) as usize).copied();
    let [low, middle, high] = [at(0.05)?, at(0.5)?, at(0.95)?].map(f64::from);
    if middle <= 0.0 {
        return None;
    }
    if high - low > UNEVEN * middle {
        return Some(format!(
            "the sums of its views run from {:.0} to {:.0} % of the middle one, and all views of one section have the same: are its views in columns (turn it round), or is the specimen cut off?",
            100.0 * low / middle,
            100.0 * high / middle
        ));
    }
    let off = |mass: f32| (f64::from(mass) - middle).abs() > LOST * middle;
    let lost: Vec<usize> = (0..masses.len()).filter(|v| off(masses[*v])).collect();
    let (first, n) = (lost.first()?, lost.len());
    let them = if n == 1 { "it" } else { "them" };
    let more = if n == 1 { String::new() } else { format!(" and {} more", n - 1) };
    Some(format!(
        "view {first}{more} (from 0) has {:.0} % of the mass of others: it was not taken, or twice; leave {them} out",
        100.0 * f64::from(masses[*first]) / middle
    ))
}

/// Rays beside the specimen that have something, or less than nothing.
fn beside_doubt(row: &[f32], bins: usize) -> Option<String> {
    let edge = (bins / 40).max(1);
    let most = row.iter().copied().fold(0.0_f32, f32::max);
    let ends = |line: &[f32]| -> [f32; 2] {
        [&line[..edge], &line[bins - edge..]].map(|end| median(&mut end.to_vec()))
    };
    // A stump of the specimen may reach over one edge.
    let clearer = |line: &[f32]| {
        let [a, b] = ends(line);
        if a.abs() < b.abs() { a } else { b }
    };
    let mut beside: Vec<f32> = row.chunks(bins).map(clearer).collect();
    beside.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| beside.get((share * (beside.len() - 1) as f64) as usize).copied();
    let [low, middle, high] = [at(0.05)?, at(0.5)?, at(0.95)?];
    let limit = BESIDE as f32 * most;
    if middle.abs() <= limit {
        return None;
    }
    Some(match (middle < 0.0, high - low < 0.2 * middle.abs()) {
        (true, _) => format!(
            "its rays beside the specimen have less than nothing ({middle:.4}): a mean was taken away; its slices lack as much attenuation"
        ),
        (false, true) => format!(
            "its rays beside the specimen have {middle:.4} in every view: an offset was added, or something that fills the picture is around it; its slices show as much attenuation more"
        ),
        (false, false) => format!(
            "its rays at both edges still have {middle:.4} of up to {most:.4}: the specimen reaches over the detector, or the sinogram was cropped; its slices are brighter towards their edge"
        ),
    })
}

fn size_doubt(sinogram: &Sinogram) -> Option<String> {
    let mut all = sinogram.data.clone();
    if all.is_empty() {
        return None;
    }
    // One hot pixel says nothing.
    let at = (0.999 * (all.len() - 1) as f64) as usize;
    let most = *all.select_nth_unstable_by(at, f32::total_cmp).1;
    if most > MOST_INTEGRAL {
        return Some(format!(
            "its line integrals reach {most:.0}, behind which nothing is left to be counted: they are scaled, by the edge of a pixel perhaps, and so is the attenuation of its slices"
        ));
    }
    (most < LEAST_INTEGRAL).then(|| {
        format!(
            "its line integrals reach {most:.2e} alone, as of hardly anything: they are scaled, by the edge of a pixel perhaps, and so is the attenuation of its slices"
        )
    })
}

/// The axis by the middles of mass of the views, if it falls elsewhere than the orbit says.
fn axis_doubt(row: &[f32], orbit: &Orbit) -> Option<String> {
    let bins = orbit.bins();
    let edge = (bins / 40).max(1);
    let (mut normal, mut side) = (DMat3::ZERO, DVec3::ZERO);
    for (line, angle) in row.chunks(bins).zip(&orbit.angles) {
        let mass: f64 = line.iter().map(|v| f64::from(*v)).sum();
        let most = line.iter().copied().fold(0.0_f32, f32::max);
        // Where the specimen is cut off, its middle of mass is another's.
        let is_cut = [&line[..edge], &line[bins - edge..]]
            .into_iter()
            .any(|end| median(&mut end.to_vec()) > 0.05 * most);
        if mass <= 0.0 || is_cut {
            return None;
        }
        let moment: f64 = line.iter().enumerate().map(|(i, v)| i as f64 * f64::from(*v)).sum();
        let known = DVec3::new(1.0, angle.cos(), angle.sin());
        normal += DMat3::from_cols(known, known * known.y, known * known.z);
        side += known * (moment / mass);
    }
    let axis = (normal.inverse() * side).x;
    let assumed = orbit.centre[0];
    ((axis - assumed).abs() > AXIS_OFF).then(|| {
        format!(
            "its axis seems to fall on bin {axis:.1}, not {assumed:.1}: give --axis-bin {axis:.1} if it does"
        )
    })
}

/// Whether the views reach over another arc than the orbit says: the first comes again.
fn arc_doubt(row: &[f32], orbit: &Orbit) -> Option<String> {
    let (views, bins) = (orbit.views(), orbit.bins());
    let line = |view: usize| row.get(view * bins..(view + 1) * bins);
    // About the axis, between bins in proportion.
    let mirrored = |view: usize| -> Option<Vec<f32>> {
        let line = line(view)?;
        let at = |u: usize| {
            let from = (2.0 * orbit.centre[0] - u as f64).clamp(0.0, (bins - 1) as f64);
            let low = from as usize;
            let share = (from - low as f64) as f32;
            let high = line.get(low + 1).unwrap_or(&line[low]);
            line[low] * (1.0 - share) + high * share
        };
        Some((0..bins).map(at).collect())
    };
    let off = |a: &[f32], b: &[f32]| -> f64 {
        a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
    };
    let first = line(0)?;
    let step = off(first, line(1)?);
    let arc = orbit.angles.get(1)? * views as f64;
    if (arc - PI).abs() < 1e-6 && off(first, &mirrored(views - 1)?) < SAME * step {
        let all = 180.0 * views as f64 / (views as f64 - 1.0);
        return Some(format!(
            "its last view mirrors its first: both ends of half a turn seem to be in it; give --arc-deg {all:.4} if they are"
        ));
    }
    let half = mirrored(views / 2)?;
    if (arc - PI).abs() < 1e-6 && views % 2 == 0 && off(first, &half) < SAME * step {
        return Some(
            "the view in its middle mirrors its first: it seems to run a whole turn; give --arc-deg 360 if it does"
                .into(),
        );
    }
    if (arc - TAU).abs() < 1e-6 && off(first, line(views - 1)?) < SAME * step {
        let all = 360.0 * views as f64 / (views as f64 - 1.0);
        return Some(format!(
            "its last view is its first: both ends of a turn seem to be in it; give --arc-deg {all:.4} if they are"
        ));
    }
    None
}

/// Bins of a row that read the same in every view while their neighbours vary: dead, or stuck. Each
/// gets the mean of its neighbours; gives their numbers.
pub fn mend_dead_bins(sinogram: &mut Sinogram) -> Vec<usize> {
    let [rows, bins] = sinogram.orbit.detector;
    let mut dead = Vec::new();
    for row in 0..rows {
        let lines = sinogram.row(row);
        let spread: Vec<f64> = (0..bins).map(|bin| spread(&lines, bins, bin)).collect();
        let is_dead = |bin: usize| {
            let beside = [bin.checked_sub(1), (bin + 1 < bins).then_some(bin + 1)];
            let beside: Vec<f64> = beside.into_iter().flatten().map(|b| spread[b]).collect();
            beside.len() == 2 && spread[bin] < DEAD * beside[0].min(beside[1])
        };
        for bin in (0..bins).filter(|bin| is_dead(*bin)) {
            for view in 0..sinogram.orbit.views() {
                let at = (view * rows + row) * bins + bin;
                sinogram.data[at] = 0.5 * (sinogram.data[at - 1] + sinogram.data[at + 1]);
            }
            if !dead.contains(&bin) {
                dead.push(bin);
            }
        }
    }
    dead
}

/// Standard deviation of a bin over the views.
fn spread(lines: &[f32], bins: usize, bin: usize) -> f64 {
    let values = || lines.iter().skip(bin).step_by(bins).map(|v| f64::from(*v));
    let n = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / n;
    (values().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Views of two discs of 1/bin, one of them beside the axis, over `arc`.
    fn discs(views: usize, arc: f64, axis: f64, ends: bool) -> Sinogram {
        const BINS: usize = 64;
        let mut orbit = Orbit::circle(Beam::Parallel, views, PI, [1, BINS], [1e-3; 2]);
        let step = arc / (views as f64 - f64::from(u8::from(ends)));
        let chord = |u: f64, r: f64| 0.1 * 2.0 * (r * r - u * u).max(0.0).sqrt();
        let data = (0..views * BINS).map(|i| {
            let [view, bin] = [i / BINS, i % BINS];
            let (sin, cos) = (view as f64 * step).sin_cos();
            let u = bin as f64 - axis;
            (chord(u - 3.0 * cos + 2.0 * sin, 18.0) + chord(u - 9.0 * cos - 4.0 * sin, 4.0)) as f32
        });
        let data = data.collect();
        orbit.centre = [31.5, 0.0];
        Sinogram { orbit, data }
    }

    #[test]
    fn plain_sinograms_are_not_doubted_and_others_are() {
        let plain = discs(90, PI, 31.5, false);
        assert_eq!(sinogram_doubts(&plain, false), Vec::<String>::new());
        assert_eq!(no_integrals(&plain), None);
        // By more and more the axis is off: least to most.
        for (off, is_said) in [(0.4, false), (1.0, true), (-3.0, true), (6.0, true)] {
            let doubts = sinogram_doubts(&discs(90, PI, 31.5 + off, false), false);
            let said = format!("bin {:.1}, not 31.5", 31.5 + off);
            assert_eq!(doubts.iter().any(|d| d.contains(&said)), is_said, "{off} {doubts:?}");
        }
        for (sinogram, said) in [
            (discs(90, PI, 31.5, true), "--arc-deg 182.02"),
            (discs(90, TAU, 31.5, false), "--arc-deg 360"),
            (discs(5, PI, 31.5, false), "--by-row"),
        ] {
            let doubts = sinogram_doubts(&sinogram, false);
            assert!(doubts.len() == 1 && doubts[0].contains(said), "{doubts:?}");
        }
        // What was done to it, turned one by one.
        let with = |change: fn(&mut Vec<f32>)| {
            let mut sinogram = plain.clone();
            change(&mut sinogram.data);
            sinogram_doubts(&sinogram, false)
        };
        for (change, said) in [
            ((|d| d.iter_mut().for_each(|v| *v += 1.0)) as fn(&mut Vec<f32>), "offset"),
            (|d| d.iter_mut().for_each(|v| *v -= 1.0), "less than nothing"),
            (|d| d[20 * 64..21 * 64].fill(0.0), "view 20 (from 0) has 0 %"),
            (|d| d[20 * 64..22 * 64].iter_mut().for_each(|v| *v *= 2.0), "view 20 and 1 more"),
        ] {
            let doubts = with(change);
            assert!(doubts.len() == 1 && doubts[0].contains(said), "{said}: {doubts:?}");
        }
        assert_eq!(with(|d| d.iter_mut().for_each(|v| *v += 0.01)), Vec::<String>::new());
        let turned = Sinogram {
            data: (0..90 * 64).map(|i| plain.data[(i % 90) * 64 + i / 90]).collect(),
            orbit: Orbit::circle(Beam::Parallel, 64, PI, [1, 90], [1e-3; 2]),
        };
        let doubts = sinogram_doubts(&turned, false);
        assert!(doubts.len() == 1 && doubts[0].contains("in columns"), "{doubts:?}");
        let cropped = Sinogram {
            data: plain.data.chunks(64).flat_map(|line| line[20..44].to_vec()).collect(),
            orbit: Orbit::circle(Beam::Parallel, 90, PI, [1, 24], [1e-3; 2]),
        };
        let doubts = sinogram_doubts(&cropped, false);
        assert!(doubts.len() == 1 && doubts[0].contains("over the detector"), "{doubts:?}");
        let negative = Sinogram { data: plain.data.iter().map(|v| -v).collect(), ..plain.clone() };
        assert!(no_integrals(&negative).unwrap().contains("sign is turned"));
        let scaled = |by: f32| {
            let data = plain.data.iter().map(|v| v * by).collect();
            sinogram_doubts(&Sinogram { data, ..plain.clone() }, false).len()
        };
        assert_eq!([5.0, 1.0, 0.1, 2000.0, 5e-4].map(scaled), [0, 0, 0, 1, 1]);
        // Counts, transmission, what an electronic offset leaves of them.
        for [open, dark] in [[60_000.0, 0.0], [1.0, 0.0], [4095.0, 100.0]] {
            let data = plain.data.iter().map(|v| dark + open * (-v).exp()).collect();
            let counts = Sinogram { data, ..plain.clone() };
            assert!(no_integrals(&counts).is_some(), "{open}");
        }
    }

    #[test]
    fn dead_bins_are_mended_and_named() {
        let plain = discs(90, PI, 31.5, false);
        assert_eq!(mend_dead_bins(&mut plain.clone()), Vec::<usize>::new());
        for (bin, stuck) in [(40, 0.0), (20, 5.0), (31, 1.0)] {
            let mut sinogram = plain.clone();
            sinogram.data.iter_mut().skip(bin).step_by(64).for_each(|v| *v = stuck);
            assert_eq!(mend_dead_bins(&mut sinogram), [bin]);
            let off = sinogram.data.iter().zip(&plain.data).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f32::max) < 0.5);
        }
    }
}
