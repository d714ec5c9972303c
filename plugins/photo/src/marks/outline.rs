//! From how probable damage is to where it is.

use intrados_raster::{Grid, Mask};

use super::Mark;

/// How probable, and how long, a line must be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Threshold {
    /// Its pixels.
    pub(super) low: f32,
    /// At least one of its pixels.
    pub(super) high: f32,
    /// The diagonal of the box around it, pixels.
    pub(super) length: f32,
}

/// Of cracks: one choice for all photographs.
pub(super) const CRACKS: Threshold = Threshold { low: 0.55, high: 0.9, length: 60.0 };

/// How probable an area must be, by kind: chosen on 160 lessons that training did not see, so that
/// of what is found more than half is right.
pub(super) fn sure(mark: Mark) -> f32 {
    match mark {
        Mark::Crack => 0.9,
        Mark::Steel | Mark::Rust => 0.8,
        Mark::Spall | Mark::Efflorescence => 0.6,
    }
}

/// The smallest area, pixels: what is smaller is coarse texture as often as damage.
pub(super) const SMALLEST: usize = 150;

/// Lines: connected over edges and corners, long enough, somewhere probable enough.
pub(super) fn lines(grid: &Grid<f32>, threshold: Threshold) -> Mask {
    let mut mask = grid.map(|_| false);
    for pixels in groups(&grid.map(|p| p > threshold.low)) {
        let best = pixels.iter().map(|&i| grid.data[i]).fold(0.0, f32::max);
        let [mut low, mut high] = [[usize::MAX; 2], [0; 2]];
        for &i in &pixels {
            let (x, y) = grid.place(i);
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x), high[1].max(y)];
        }
        let [w, h] = [0, 1].map(|k| (high[k] - low[k] + 1) as f32);
        if best > threshold.high && w.hypot(h) >= threshold.length {
            pixels.into_iter().for_each(|i| mask.data[i] = true);
        }
    }
    mask
}

/// Areas that are large enough.
pub(super) fn areas(grid: &Grid<f32>, sure: f32) -> Mask {
    let mut mask = grid.map(|_| false);
    for pixels in groups(&grid.map(|p| p > sure)).into_iter().filter(|g| g.len() >= SMALLEST) {
        pixels.into_iter().for_each(|i| mask.data[i] = true);
    }
    mask
}

/// Pixels that touch over edges or corners.
fn groups(mask: &Mask) -> Vec<Vec<usize>> {
    let (w, h) = (mask.width, mask.height);
    let mut waiting = mask.data.clone();
    let mut groups = Vec::new();
    for seed in 0..waiting.len() {
        if !waiting[seed] {
            continue;
        }
        waiting[seed] = false;
        let mut group = vec![seed];
        let mut next = 0;
        while let Some(&i) = group.get(next) {
            next += 1;
            let (x, y) = mask.place(i);
            for y in y.saturating_sub(1)..(y + 2).min(h) {
                for j in (x.saturating_sub(1)..(x + 2).min(w)).map(|x| y * w + x) {
                    if waiting[j] {
                        waiting[j] = false;
                        group.push(j);
                    }
                }
            }
        }
        groups.push(group);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_with_a_sure_place_stay_and_others_go() {
        let mut grid = Grid::new(40, 20, 0.0_f32);
        let mut line = |places: Vec<(usize, usize)>, p: f32| {
            places.into_iter().for_each(|(x, y)| grid.data[y * 40 + x] = p);
        };
        line((2..18).map(|k| (k, k)).collect(), 0.6); // diagonal, over corners, sure at one place
        line(vec![(9, 9)], 0.95);
        line((2..30).map(|x| (x, 19)).collect(), 0.6); // nowhere sure
        line((30..34).map(|x| (x, 2)).collect(), 0.99); // short
        let threshold = Threshold { low: 0.5, high: 0.9, length: 15.0 };
        let found = lines(&grid, threshold);
        assert_eq!(found.count(), 16);
        assert!((2..18).all(|k| found.data[k * 40 + k]));
    }
}
