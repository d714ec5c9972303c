//! Long dark shapes that were not read. The network knows cracks up to some forty pixels wide; a
//! wider one looks to it like a joint or a shadow. Whatever is dark like a slot, long, and read as
//! nothing is named, and its place is not called sound.

use intrados_raster::{Grid, Mask, grid::median};

/// Share of the face's median light below which a place is as dark as a slot (ours): a slot returns
/// a fifth or less of what the concrete beside it does, stains and wet concrete half and more.
const DARK: f32 = 0.35;
/// Narrowest and shortest, pixels: what is smaller is texture.
const NARROWEST: f64 = 3.0;
const SHORTEST: f64 = 32.0;
/// How many times as long as wide a line is.
const LONG: f64 = 4.0;
/// Share of its pixels that were read as something, from which a shape counts as read.
const READ: f64 = 0.3;

/// A long dark shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DarkShape {
    /// Its pixels.
    pub(super) pixels: Vec<usize>,
    /// Twice the distance from its innermost pixel to the rim, pixels.
    pub(super) width: f64,
    /// Its area over that width, pixels.
    pub(super) length: f64,
}

/// Dark shapes that are long and of which little was read as anything.
pub(super) fn unread_shapes(value: &Grid<f32>, known: &Mask, read: &Mask) -> Vec<DarkShape> {
    let seen = known.data.iter().zip(&value.data).filter(|(known, _)| **known);
    let Some(usual) = median(seen.map(|(_, light)| *light)) else { return Vec::new() };
    let is_dark = |(known, light): (&bool, &f32)| *known && *light < DARK * usual;
    let data = known.data.iter().zip(&value.data).map(is_dark).collect();
    let dark = Mask { width: known.width, height: known.height, data };
    let inside = dark.distance();
    let shape = |pixels: Vec<usize>| {
        let half = pixels.iter().map(|&i| inside.data[i]).fold(0.0, f32::max);
        let width = 2.0 * f64::from(half);
        DarkShape { width, length: pixels.len() as f64 / width.max(1.0), pixels }
    };
    let is_line = |shape: &DarkShape| {
        shape.width >= NARROWEST && shape.length >= SHORTEST.max(LONG * shape.width)
    };
    let is_unread = |shape: &DarkShape| {
        let count = shape.pixels.iter().filter(|&&i| read.data[i]).count();
        (count as f64) < READ * shape.pixels.len() as f64
    };
    let shapes = dark.components().members.into_iter().map(shape);
    shapes.filter(is_line).filter(is_unread).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use intrados_stage::{Job, random::Key};

    use super::*;
    use crate::{marks::marks, reading::read_mask};

    const SIDE: usize = 512;

    /// Rough concrete with an upright slot of this width, pixels, that returns this share of light.
    fn slotted(width: usize, returned: f32) -> Grid<f32> {
        let mut data = Vec::with_capacity(SIDE * SIDE);
        for i in 0..SIDE * SIDE {
            let x = i % SIDE;
            let grain = 0.4 + 0.08 * (Key::new(7, i as u64).unit(0) - 0.5);
            let is_slot = x.abs_diff(SIDE / 2) * 2 < width;
            data.push(if is_slot { returned * grain } else { grain });
        }
        Grid { width: SIDE, height: SIDE, data }
    }

    /// One knob: the width of a crack from two pixels to a quarter of the picture. It is read, or it
    /// is named; it is never nothing.
    #[test]
    fn a_wide_crack_is_read_or_named_and_never_nothing() {
        for width in [4, 8, 14, 24, 40, 64, 100] {
            let value = slotted(width, 0.15);
            let known = value.map(|_| true);
            let marks = marks(&value.map(Vec3::splat), &known, &Job::default()).unwrap();
            let is_read = marks.cracks().count() > 100;
            let named = unread_shapes(&value, &known, &read_mask(&marks));
            assert!(is_read || named.len() == 1, "{width} pixels: {named:?}");
            let within = |shape: &DarkShape| (shape.width / width as f64 - 1.0).abs() < 0.3;
            assert!(named.iter().all(within), "{width} pixels");
        }
    }

    #[test]
    fn sound_concrete_and_stains_have_no_dark_shapes() {
        for (width, returned) in [(0, 1.0), (30, 0.5), (200, 0.15)] {
            let value = slotted(width, returned);
            let known = value.map(|_| true);
            let none = known.map(|_| false);
            assert!(unread_shapes(&value, &known, &none).is_empty(), "{width} {returned}");
        }
    }
}
