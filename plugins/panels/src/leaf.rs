//! One picture that is to be written to a file, and what several kinds of them need.

use egui::{Color32, ColorImage};
use intrados_scene::Scene;

/// Makes a picture off the frame.
pub(crate) type Drawing = Box<dyn FnOnce() -> ColorImage + Send>;

/// A picture that is to be written.
pub(crate) struct Leaf {
    /// What its file is called, without an ending; English, as all files are.
    pub(crate) name: String,
    /// What it shows, for whoever is sent it.
    pub(crate) what: String,
    /// What its colours mean, where they are no colours of things.
    pub(crate) legend: Option<ColorImage>,
    pub(crate) draw: Drawing,
}

/// What a picture of a scene shows, with what it was made of and by what.
pub(crate) fn said(scene: &Scene, what: &str) -> String {
    let what = format!("{}: {what}", scene.name);
    tr!("{}; scene hash {}; Intrados {}", what, scene.hash, env!("CARGO_PKG_VERSION"))
}

/// A picture before a ground: a file has none of its own.
pub(crate) fn on_ground(mut image: ColorImage, ground: Color32) -> ColorImage {
    image.pixels.iter_mut().for_each(|pixel| *pixel = ground.blend(*pixel));
    image
}

/// Draws a line through places (pixels) over a picture, three pixels wide.
pub(crate) fn mark(image: &mut ColorImage, line: &[[f64; 2]], ink: Color32) {
    let [width, height] = image.size;
    for pair in line.windows(2) {
        let [a, b] = pair else { continue };
        let span = [0, 1].map(|k| b[k] - a[k]);
        let steps = span[0].abs().max(span[1].abs()).ceil().clamp(1.0, 1e5);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let [x, y] = [0, 1].map(|k| (a[k] + share * span[k]).round() as i64);
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                let place = |at: i64, most: usize| usize::try_from(at).ok().filter(|at| *at < most);
                if let (Some(x), Some(y)) = (place(x + dx, width), place(y + dy, height)) {
                    image.pixels[y * width + x] = ink;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_goes_from_place_to_place_and_never_over_the_rim() {
        let mut image = ColorImage::filled([10, 6], Color32::BLACK);
        mark(&mut image, &[[-5.0, 2.0], [5.0, 2.0], [f64::NAN, 2.0]], Color32::RED);
        let red: Vec<usize> =
            (0..60).filter(|at| image.pixels[*at] == Color32::RED).map(|at| at / 10).collect();
        assert!(red.contains(&1) && red.contains(&3) && !red.contains(&5));
        assert_eq!(image[(5, 2)], Color32::RED);
        assert_eq!(image[(8, 2)], Color32::BLACK);
    }
}
