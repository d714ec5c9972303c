//! Padding: what a scanner writes outside its round field of view. It is no measurement, and counts
//! as the air around the specimen.

/// Least share of a picture that is taken for padding where no header says so.
const LEAST: f64 = 0.005;
/// Gap between padding and what was measured, as a share of what was measured.
const GAP: f32 = 0.1;
/// Air is measured beside padding where the grey there lies so low, as a share of what was measured.
/// Beside a border of zeros around a body without air it lies in the middle.
const AIR: f32 = 0.35;

/// Gives padding the grey of air: the median of what is darker than half way between the darkest and
/// the brightest that was measured.
pub(super) fn fill(values: &mut [f32], is_padding: &[bool]) {
    if !is_padding.contains(&true) {
        return;
    }
    let measured = values.iter().zip(is_padding).filter(|(v, out)| !**out && v.is_finite());
    let mut measured: Vec<f32> = measured.map(|(v, _)| *v).collect();
    let air = air(&mut measured).unwrap_or(0.0);
    values.iter_mut().zip(is_padding).filter(|(_, out)| **out).for_each(|(v, _)| *v = air);
}

/// The grey of air, about.
fn air(measured: &mut [f32]) -> Option<f32> {
    if measured.is_empty() {
        return None;
    }
    measured.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| measured[(share * (measured.len() - 1) as f64) as usize];
    let half = 0.5 * (at(0.001) + at(0.999));
    let dark = measured.partition_point(|v| *v < half);
    measured.get(dark / 2).copied()
}

/// Gives padding that no header declares the grey of air. It is taken for padding if it is one value
/// alone, fills three of the picture's corners and hangs together with them, lies beyond all else by
/// a gap, and ends at something dark: air that was measured. A
/// border of zeros around a body without air is left as it is, since it may be air.
pub fn without_padding(values: &mut [f32], width: usize) {
    if let Some(is_padding) = undeclared(values, width) {
        fill(values, &is_padding);
    }
}

fn undeclared(values: &[f32], width: usize) -> Option<Vec<bool>> {
    let height = values.len().checked_div(width)?;
    if width < 8 || height < 8 || values.len() != width * height {
        return None;
    }
    let corners = [0, width - 1, width * (height - 1), width * height - 1];
    let greys = corners.map(|i| values[i]);
    let count = |v: f32| greys.iter().filter(|g| g.to_bits() == v.to_bits()).count();
    let pad = greys.into_iter().find(|g| count(*g) >= 3)?;
    let [low, high] = values
        .iter()
        .filter(|v| **v != pad)
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
    let gap = (low - pad).max(pad - high);
    if !(low < high && gap > GAP * (high - low)) {
        return None;
    }
    let is_padding = joined(values, width, pad, &corners);
    let size = is_padding.iter().filter(|out| **out).count();
    // A pore or a hole of the same value is air, and so is what lies around it.
    let same = values.iter().filter(|v| **v == pad).count();
    if (size as f64) < LEAST * values.len() as f64 || size != same {
        return None;
    }
    let mut rim = rim(values, width, &is_padding);
    let (_, middle, _) = (!rim.is_empty()).then(|| {
        let half = rim.len() / 2;
        rim.select_nth_unstable_by(half, f32::total_cmp)
    })?;
    (*middle < low + AIR * (high - low)).then_some(is_padding)
}

/// Pixels of a value that hang together with one of the corners.
fn joined(values: &[f32], width: usize, pad: f32, corners: &[usize]) -> Vec<bool> {
    let mut found = vec![false; values.len()];
    let mut open: Vec<usize> = corners.to_vec();
    while let Some(i) = open.pop() {
        if found[i] || values[i] != pad {
            continue;
        }
        found[i] = true;
        open.extend(neighbours(i, width, values.len()));
    }
    found
}

/// What was measured beside padding.
fn rim(values: &[f32], width: usize, is_padding: &[bool]) -> Vec<f32> {
    let is_rim = |i: &usize| {
        !is_padding[*i] && neighbours(*i, width, values.len()).any(|next| is_padding[next])
    };
    (0..values.len()).filter(is_rim).map(|i| values[i]).collect()
}

fn neighbours(i: usize, width: usize, all: usize) -> impl Iterator<Item = usize> {
    let x = i % width;
    let sides = [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then_some(i + 1),
        i.checked_sub(width),
        (i + width < all).then_some(i + width),
    ];
    sides.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of concrete, 1.5, with a pore, in air in a round field of 32 pixels.
    fn field(pad: f32, air: f32, disc: f64) -> Vec<f32> {
        let grey = |i: usize| {
            let [x, y] = [(i % 64) as f64 - 31.5, (i / 64) as f64 - 31.5];
            match x.hypot(y) {
                r if r > 31.0 => pad,
                r if r > disc => air,
                r if r < 3.0 => air,
                _ => 1.5,
            }
        };
        (0..64 * 64).map(grey).collect()
    }

    #[test]
    fn padding_becomes_air_and_air_stays() {
        for pad in [-3024.0, -2000.0, -0.5, 65_535.0] {
            let mut picture = field(pad, 0.1, 22.0);
            without_padding(&mut picture, 64);
            assert_eq!(picture, field(0.1, 0.1, 22.0), "{pad}");
        }
        // Nothing is padded; a body that fills the field; a marker in a corner.
        for mut picture in [field(0.0, 0.0, 22.0), field(0.0, 0.3, 40.0)] {
            let before = picture.clone();
            without_padding(&mut picture, 64);
            assert_eq!(picture, before);
        }
        let mut marked = field(0.0, 0.0, 22.0);
        marked[..4].fill(2.0);
        let before = marked.clone();
        without_padding(&mut marked, 64);
        assert_eq!(marked, before);
    }
}
