//! Maps of one face from several photographs, taken together by their errors.

use glam::Vec3;

use super::ReflectanceMap;
use crate::FaceMap;

/// Fewest pixels that two maps must share for the scale between them.
const OVERLAP: usize = 200;
/// Most pixels of the merged map.
const MOST_PIXELS: f64 = (1 << 25) as f64;

/// Several maps as one.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// The map, as bright as the first one.
    pub map: ReflectanceMap,
    /// By what each map was multiplied; `None` of those that share too little with the others and
    /// are left out.
    pub scales: Vec<Option<[f64; 3]>>,
    /// χ² a degree of freedom of what overlaps; where it is above 1 the errors there are larger by
    /// its root.
    pub reduced_chi2: f64,
}

/// Sums of what a pixel of the merged map is known by: weights, weights times logarithms.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    weight: [f64; 3],
    value: [f64; 3],
    square: [f64; 3],
    count: u32,
}

/// Merges maps of one face at one scale, best known first: the next one is always that which shares
/// most with what is merged; the scale between is the median over what is shared. `None` where
/// there is nothing to merge.
#[must_use]
pub fn merged(maps: &[ReflectanceMap]) -> Option<Merged> {
    let first = maps.first()?;
    let m = 1e-3 * first.face.mm_px;
    let places: Vec<[i64; 2]> = maps.iter().map(|map| place(map, first, m)).collect();
    let low = [0, 1].map(|k| places.iter().map(|p| p[k]).min().unwrap_or(0));
    let size = [0, 1].map(|k| {
        let ends = maps.iter().zip(&places).map(|(map, p)| p[k] + map.face.size[k] as i64);
        (ends.max().unwrap_or(0) - low[k]).max(0) as usize
    });
    let fits = size[0] as f64 * size[1] as f64 <= MOST_PIXELS
        && maps.iter().all(|map| map.face.mm_px == first.face.mm_px);
    if !fits {
        return None;
    }
    let mut sums = vec![Sums::default(); size[0] * size[1]];
    let offsets: Vec<[usize; 2]> =
        places.iter().map(|p| [0, 1].map(|k| (p[k] - low[k]) as usize)).collect();
    let mut scales = vec![None; maps.len()];
    scales[0] = Some([1.0; 3]);
    add(&mut sums, size[0], first, offsets[0], [1.0; 3]);
    loop {
        let shared = |i: usize| scale(&sums, size[0], &maps[i], offsets[i]);
        let open = (0..maps.len()).filter(|i| scales[*i].is_none());
        let next =
            open.map(|i| (i, shared(i))).max_by_key(|(i, (n, _))| (*n, std::cmp::Reverse(*i)));
        let Some((i, (_, by))) = next.filter(|(_, (n, _))| *n >= OVERLAP) else { break };
        scales[i] = Some(by);
        add(&mut sums, size[0], &maps[i], offsets[i], by);
    }
    let corner = [
        first.face.corner[0] + (low[0] - places[0][0]) as f64 * m,
        first.face.corner[1] - (low[1] - places[0][1]) as f64 * m,
    ];
    let reduced_chi2 = chi2(&sums);
    let known = |s: &Sums| {
        let light = (s.count > 0)
            .then(|| Vec3::from([0, 1, 2].map(|c| (s.value[c] / s.weight[c]).exp() as f32)));
        // What contradicts is known no better than it contradicts.
        let wide = if s.count > 1 { reduced_chi2.max(1.0) } else { 1.0 };
        let error = match s.count {
            0 => Vec3::INFINITY,
            _ => Vec3::from(s.weight.map(|w| (wide / w).sqrt() as f32)),
        };
        (light, error)
    };
    let (light, log_error) = sums.iter().map(known).unzip();
    let face = FaceMap { size, mm_px: first.face.mm_px, corner, light };
    Some(Merged { map: ReflectanceMap { face, log_error, turn: first.turn }, scales, reduced_chi2 })
}

/// Where a map's corner lies on the grid of the first, pixels across and down; of what goes around,
/// by as many turns as bring their middles nearest.
fn place(map: &ReflectanceMap, first: &ReflectanceMap, m: f64) -> [i64; 2] {
    let mut across = map.face.corner[0] - first.face.corner[0];
    if let Some(turn) = first.turn {
        let middle = 0.5 * m * (map.face.size[0] as f64 - first.face.size[0] as f64);
        across -= ((across + middle) / turn).round() * turn;
    }
    let down = first.face.corner[1] - map.face.corner[1];
    [(across / m).round() as i64, (down / m).round() as i64]
}

/// Pixels of a map, known ones, with their index in the merged one.
fn known<'a>(
    map: &'a ReflectanceMap,
    width: usize,
    [right, down]: [usize; 2],
) -> impl Iterator<Item = (usize, [f64; 3], [f64; 3])> + 'a {
    let columns = map.face.size[0].max(1);
    map.face.light.iter().zip(&map.log_error).enumerate().filter_map(move |(k, (light, error))| {
        let (rho, error) = ((*light)?.as_dvec3(), error.as_dvec3());
        let is_known = rho.min_element() > 0.0 && error.is_finite() && error.min_element() > 0.0;
        let at = (k / columns + down) * width + k % columns + right;
        is_known.then(|| (at, rho.to_array().map(f64::ln), error.to_array().map(|e| e.powi(-2))))
    })
}

fn add(sums: &mut [Sums], width: usize, map: &ReflectanceMap, at: [usize; 2], by: [f64; 3]) {
    for (k, log, weight) in known(map, width, at) {
        let sum = &mut sums[k];
        sum.count += 1;
        for c in 0..3 {
            let value = log[c] + by[c].ln();
            sum.weight[c] += weight[c];
            sum.value[c] += weight[c] * value;
            sum.square[c] += weight[c] * value * value;
        }
    }
}

/// Pixels that a map shares with what is merged, and what it is to be multiplied by.
fn scale(sums: &[Sums], width: usize, map: &ReflectanceMap, at: [usize; 2]) -> (usize, [f64; 3]) {
    let mut steps: [Vec<f64>; 3] = Default::default();
    for (k, log, _) in known(map, width, at).filter(|(k, ..)| sums[*k].count > 0) {
        (0..3).for_each(|c| steps[c].push(sums[k].value[c] / sums[k].weight[c] - log[c]));
    }
    let count = steps[0].len();
    let median = |mut all: Vec<f64>| match all.len() {
        0 => 1.0,
        n => all.select_nth_unstable_by(n / 2, f64::total_cmp).1.exp(),
    };
    (count, steps.map(median))
}

/// Σ w (x − x̄)² over the degrees of freedom; 1 where nothing overlaps.
fn chi2(sums: &[Sums]) -> f64 {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for s in sums.iter().filter(|s| s.count > 1) {
        for c in 0..3 {
            sum += (s.square[c] - s.value[c] * s.value[c] / s.weight[c]).max(0.0);
            freedom += f64::from(s.count - 1);
        }
    }
    if freedom > 0.0 { sum / freedom } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    /// A map of a planted pattern with noise, its corner moved by whole pixels, all of it times
    /// `scale`.
    fn map(
        seed: u64,
        [right, down]: [i64; 2],
        size: [usize; 2],
        scale: f64,
        error: f64,
    ) -> ReflectanceMap {
        let light = |k: usize| {
            let (x, y) = ((k % size[0]) as i64 + right, (k / size[0]) as i64 + down);
            let log = pattern(x, y) + error * Key::new(seed, k as u64).normal(0) + scale.ln();
            Some(Vec3::splat(log.exp() as f32))
        };
        let n = size[0] * size[1];
        let corner = [right as f64 * 2e-3, -down as f64 * 2e-3];
        let face = FaceMap { size, mm_px: 2.0, corner, light: (0..n).map(light).collect() };
        ReflectanceMap { face, log_error: vec![Vec3::splat(error as f32); n], turn: None }
    }

    fn pattern(x: i64, y: i64) -> f64 {
        -1.0 + 0.2 * (0.3 * x as f64).sin() + 0.1 * (0.2 * y as f64).cos()
    }

    /// Errors of the merged map are those of a weighted mean, and hold.
    #[test]
    fn merged_maps_are_better_than_each_by_as_much_as_they_say() {
        let maps = [
            map(1, [0, 0], [60, 50], 1.0, 0.04),
            map(2, [30, -10], [60, 50], 2.0, 0.03),
            map(3, [500, 0], [60, 50], 1.0, 0.03),
        ];
        let all = merged(&maps).unwrap();
        assert!((all.scales[1].unwrap()[0] - 0.5).abs() < 0.005, "{:?}", all.scales);
        // The third shares nothing with the others.
        assert_eq!(all.scales[2], None);
        assert!((all.reduced_chi2 - 1.0).abs() < 0.1, "{}", all.reduced_chi2);
        let face = &all.map.face;
        let (mut squares, mut count) = (0.0, 0.0);
        for (k, light) in face.light.iter().enumerate() {
            let Some(light) = light else { continue };
            let at = [0, 1].map(|c| [k % face.size[0], k / face.size[0]][c] as f64 * 2e-3);
            let x = ((face.corner[0] + at[0]) / 2e-3).round() as i64;
            let y = ((-face.corner[1] + at[1]) / 2e-3).round() as i64;
            let error = f64::from(all.map.log_error[k].x);
            if (30..60).contains(&x) && (0..40).contains(&y) {
                let both = (1.0_f64 / (0.04_f64.powi(-2) + 0.03_f64.powi(-2))).sqrt();
                assert!((error / both - 1.0).abs() < 0.06, "{error} {both}");
            }
            squares += ((f64::from(light.x).ln() - pattern(x, y)) / error).powi(2);
            count += 1.0;
        }
        let mean: f64 = squares / count;
        assert!((0.9..1.1).contains(&mean), "{mean} of {count}");
    }

    /// What goes around is brought together over the seam.
    #[test]
    fn a_turn_further_is_the_same_place() {
        let mut maps = [map(1, [0, 0], [60, 50], 1.0, 0.02), map(2, [0, 0], [60, 50], 1.0, 0.02)];
        maps.iter_mut().for_each(|m| m.turn = Some(0.2));
        maps[1].face.corner[0] += 0.4;
        let all = merged(&maps).unwrap();
        assert_eq!(all.map.face.size, [60, 50]);
        assert!((all.reduced_chi2 - 1.0).abs() < 0.1);
    }
}
