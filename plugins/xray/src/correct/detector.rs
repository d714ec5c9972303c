//! Dark and flat fields, dead and hot pixels.

use super::{bridge, median, running_median};

/// What a detector reads without beam and with nothing in it, `[row][bin]`, means of many frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Rows and bins.
    pub size: [usize; 2],
    /// Counts without beam.
    pub dark: Vec<f32>,
    /// Counts of the open beam.
    pub flat: Vec<f32>,
}

/// −ln((I − dark)/(flat − dark)) of stacked frames. A transmission below `floor` counts as `floor`:
/// an unlucky or a starved pixel then says "at least so much", not infinity. Half a photon over the
/// open beam's counts is a good floor.
#[must_use]
#[cfg(test)]
pub(crate) fn line_integrals(frames: &[f32], panel: &Panel, floor: f32) -> Vec<f32> {
    // A pixel without gain transmits nothing, whatever it reads.
    let open: Vec<f32> = panel
        .flat
        .iter()
        .zip(&panel.dark)
        .map(|(f, d)| if f > d { 1.0 / (f - d) } else { 0.0 })
        .collect();
    let pixels = panel.dark.iter().zip(&open).cycle();
    frames
        .iter()
        .zip(pixels)
        .map(|(i, (dark, open))| -((i - dark) * open).max(floor).ln())
        .collect()
}

/// Pixels that do not follow the beam: the gain (flat − dark) or the dark reading differs from the
/// running median of 11 along its row by more than `limit` robust standard deviations (1.4826 × the
/// median deviation) of all pixels, or there is no gain.
#[must_use]
pub fn bad_pixels(panel: &Panel, limit: f32) -> Vec<bool> {
    let bins = panel.size[1].max(1);
    let gain: Vec<f32> = panel.flat.iter().zip(&panel.dark).map(|(f, d)| f - d).collect();
    let mut bad: Vec<bool> = gain.iter().map(|g| g.is_nan() || *g <= 0.0).collect();
    for field in [&gain, &panel.dark] {
        let off: Vec<f32> = field
            .chunks(bins)
            .flat_map(|row| {
                row.iter()
                    .zip(running_median(row, 11))
                    .map(|(v, m)| (v - m).abs())
                    .collect::<Vec<_>>()
            })
            .collect();
        let spread = 1.4826 * median(&mut off.clone());
        // A field without any noise has no spread; a thousandth of its median is then enough.
        let spread = spread.max(1e-3 * median(&mut field.clone()).abs());
        bad.iter_mut()
            .zip(&off)
            .for_each(|(bad, off)| *bad |= off.is_nan() || *off > limit * spread);
    }
    bad
}

/// Replaces bad pixels of stacked frames by what lies between the nearest good ones of their row; a
/// row without any keeps its values.
pub fn mend(frames: &mut [f32], panel: &Panel, bad: &[bool]) {
    let [rows, bins] = panel.size;
    for (i, line) in frames.chunks_mut(bins.max(1)).enumerate() {
        let row = i % rows.max(1);
        bridge(line, |bin| bad.get(row * bins + bin).copied().unwrap_or(false));
    }
}
