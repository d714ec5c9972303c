//! A slice as a picture: window and level, and the labels over it.

use egui::{Color32, ColorImage};

use super::source::Read;

/// Longer side of what is shown, pixels; larger slices are thinned.
const SIDE: usize = 1024;
/// Outlines: blue and vermilion, as in the report.
pub(super) const PORE: Color32 = Color32::from_rgb(0, 114, 189);
/// See [`PORE`].
pub(super) const CRACK: Color32 = Color32::from_rgb(213, 62, 0);
/// How strongly labelled pixels are tinted.
const TINT: f32 = 0.45;

/// How labels are laid over a slice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Overlay {
    None,
    #[default]
    Outline,
    Filled,
}

impl Overlay {
    pub(super) const ALL: [Self; 3] = [Self::None, Self::Outline, Self::Filled];

    pub(super) fn name(self) -> String {
        match self {
            Self::None => tr!("No labels"),
            Self::Outline => tr!("Outlines"),
            Self::Filled => tr!("Filled labels"),
        }
    }
}

fn step(read: &Read) -> usize {
    read.slice.grey.width.max(read.slice.grey.height).div_ceil(SIDE).max(1)
}

fn image(read: &Read, pixel: impl Fn(usize, usize) -> Color32) -> ColorImage {
    let step = step(read);
    let (w, h) = (read.slice.grey.width.div_ceil(step), read.slice.grey.height.div_ceil(step));
    ColorImage::new([w, h], (0..w * h).map(|i| pixel(i % w * step, i / w * step)).collect())
}

/// Grey from black at `range[0]` to white at `range[1]`.
pub(super) fn grey(read: &Read, [low, high]: [f32; 2]) -> ColorImage {
    let scale = 255.0 / (high - low).max(f32::MIN_POSITIVE);
    let grey = &read.slice.grey;
    image(read, |x, y| {
        Color32::from_gray(((grey.data[y * grey.width + x] - low) * scale).clamp(0.0, 255.0) as u8)
    })
}

/// What was found, clear elsewhere.
pub(super) fn labels(read: &Read, overlay: Overlay) -> ColorImage {
    let found = &read.found;
    let (width, height, step) = (found.labels.width, found.labels.height, step(read));
    let kind = |x: usize, y: usize| {
        let i = y.min(height - 1) * width + x.min(width - 1);
        match (found.crack_mask.data[i], found.labels.data[i]) {
            (true, _) => 2,
            (false, 0) => 0,
            (false, _) => 1_u8,
        }
    };
    image(read, |x, y| {
        let here = kind(x, y);
        let colour = match here {
            1 => PORE,
            2 => CRACK,
            _ => return Color32::TRANSPARENT,
        };
        let around = [
            kind(x + step, y),
            kind(x, y + step),
            kind(x.saturating_sub(step), y),
            kind(x, y.saturating_sub(step)),
        ];
        match (overlay, around.iter().any(|k| *k != here)) {
            (Overlay::None, _) | (Overlay::Outline, false) => Color32::TRANSPARENT,
            (Overlay::Filled, false) => colour.gamma_multiply(TINT),
            _ => colour,
        }
    })
}

/// A sinogram with the views from the top; what is not there yet is clear.
pub(super) fn sinogram(row: &intrados_xray::scan::Row) -> ColorImage {
    let high =
        row.lines.iter().copied().filter(|v| v.is_finite()).fold(f32::MIN_POSITIVE, f32::max);
    let (bins, views) = (row.bins.max(1), row.views.max(1));
    let pixel = |i: usize| match row.lines.get(i) {
        None => Color32::TRANSPARENT,
        Some(v) => Color32::from_gray((255.0 * v / high).clamp(0.0, 255.0) as u8),
    };
    ColorImage::new([bins, views], (0..bins * views).map(pixel).collect())
}
