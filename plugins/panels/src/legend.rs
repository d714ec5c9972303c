//! The legend of a picture in false colour that becomes a file. In the window a picture has its
//! legend beside it; a file has to say by itself what its colours mean, so it is drawn under it.

use std::sync::Arc;

use egui::{
    Color32, ColorImage, Galley, Pos2, Rect, TextStyle, Ui, Vec2, epaint::Vertex, pos2, vec2,
};
use intrados_light::tone::{ABOVE, BELOW, FalseColour};

use crate::{colours::ink, scale};

/// Room at the rim, points.
const MARGIN: f32 = 6.0;
/// Height of the bar of colours, and the side of a sample of one colour, points.
const BAR: f32 = 10.0;
/// Room between what stands side by side, and between lines, points.
const APART: Vec2 = vec2(12.0, 2.0);
/// Under a narrower picture texts would break after every word, points.
const LEAST: f32 = 240.0;

/// What is said about the colours of a picture.
pub(crate) struct Legend {
    /// The colours from the lower end of the range to the upper.
    bar: Vec<[u8; 3]>,
    /// Numbers by their places on the bar, 0 to 1; those that matter most come first.
    marks: Vec<(f32, String)>,
    /// Colours of what is not on the bar.
    samples: Vec<([u8; 3], String)>,
    /// What it is of, in words.
    lines: Vec<String>,
}

impl Legend {
    /// Of a scale whose values have the colours of `colour` and are written by `number`.
    pub(crate) fn new(
        scale: &FalseColour,
        colour: impl Fn(f32) -> [u8; 3],
        number: impl Fn(f32) -> String,
        lines: Vec<String>,
    ) -> Self {
        let count = scale::steps(scale);
        let middle = |k: u8| scale::at(scale, (f32::from(k) + 0.5) / f32::from(count));
        let mut samples = vec![(scale.map.unknown(), tr!("unknown"))];
        if scale.is_clipped {
            let [low, high] = scale.range.map(&number);
            samples.push((BELOW, tr!("below {}", low)));
            samples.push((ABOVE, tr!("above {}", high)));
        }
        Self {
            bar: (0..count).map(|k| colour(middle(k))).collect(),
            marks: places(scale).into_iter().map(|(share, x)| (share, number(x))).collect(),
            samples,
            lines,
        }
    }

    /// Of colours that no [`FalseColour`] has: from one end to the other, numbers by their places
    /// between, and colours of what is not among them.
    pub(crate) fn plain(
        bar: Vec<[u8; 3]>,
        marks: Vec<(f32, String)>,
        samples: Vec<([u8; 3], String)>,
        lines: Vec<String>,
    ) -> Self {
        Self { bar, marks, samples, lines }
    }

    /// The legend in the window's colours and font, at least so many pixels wide.
    pub(crate) fn drawn(&self, ui: &Ui, width: usize) -> ColorImage {
        let density = ui.ctx().pixels_per_point();
        let width = width.max((LEAST * density).ceil() as usize);
        let mut page = Page::new(ui, width as f32 / density);
        self.bar(&mut page);
        self.numbers(&mut page);
        self.lines.iter().for_each(|line| page.line(line));
        self.samples(&mut page);
        page.printed(width)
    }

    fn bar(&self, page: &mut Page<'_>) {
        let [left, right] = page.sides();
        let x = |k: usize| left + (right - left) * k as f32 / self.bar.len() as f32;
        for (k, colour) in self.bar.iter().enumerate() {
            let step = Rect::from_x_y_ranges(x(k)..=x(k + 1), page.below..=page.below + BAR);
            page.patches.push((step, ink(*colour)));
        }
        page.below += BAR + APART.y;
    }

    /// Where two numbers have no room beside each other, the one that matters less is left out.
    fn numbers(&self, page: &mut Page<'_>) {
        let [left, right] = page.sides();
        let mut taken: Vec<Rect> = Vec::new();
        for (share, number) in &self.marks {
            let text = page.laid_out(number, f32::INFINITY);
            let size = text.size();
            let middle = left + (right - left) * share - 0.5 * size.x;
            let own =
                Rect::from_min_size(pos2(middle.min(right - size.x).max(left), page.below), size);
            if !taken.iter().any(|other| other.expand(0.5 * APART.x).intersects(own)) {
                taken.push(own);
                page.texts.push((own.min, text));
            }
        }
        page.below = taken.iter().map(|own| own.bottom()).fold(page.below, f32::max) + APART.y;
    }

    fn samples(&self, page: &mut Page<'_>) {
        let [left, right] = page.sides();
        let mut x = left;
        let mut high = 0.0_f32;
        for (colour, name) in &self.samples {
            let text = page.laid_out(name, f32::INFINITY);
            let size = text.size();
            let wide = BAR + 0.5 * APART.x + size.x;
            if x > left && x + wide > right {
                x = left;
                page.below += high + APART.y;
            }
            let corner = pos2(x, page.below + 0.5 * (size.y - BAR));
            page.patches.push((Rect::from_min_size(corner, Vec2::splat(BAR)), ink(*colour)));
            page.texts.push((pos2(x + wide - size.x, page.below), text));
            x += wide + APART.x;
            high = high.max(size.y);
        }
        page.below += high;
    }
}

/// Values that are written at the bar, with their places on it; the ends come first.
fn places(scale: &FalseColour) -> Vec<(f32, f32)> {
    if scale.is_logarithmic {
        let marks = scale::marks(scale.range).into_iter();
        return marks.map(|(share, _, value)| (share, value)).collect();
    }
    // Where bands meet, if there are some.
    let shares: &[f32] = match scale.bands {
        0 | 1 => &[0.0, 1.0, 0.5, 0.25, 0.75],
        _ => &[0.0, 1.0, 0.2, 0.4, 0.6, 0.8],
    };
    shares.iter().map(|share| (*share, scale::at(scale, *share))).collect()
}

/// What is drawn, from above to below, in points.
struct Page<'a> {
    ui: &'a Ui,
    width: f32,
    /// Where the next line begins.
    below: f32,
    patches: Vec<(Rect, Color32)>,
    texts: Vec<(Pos2, Arc<Galley>)>,
}

impl<'a> Page<'a> {
    fn new(ui: &'a Ui, width: f32) -> Self {
        Self { ui, width, below: MARGIN, patches: Vec::new(), texts: Vec::new() }
    }

    /// Where lines begin and end.
    fn sides(&self) -> [f32; 2] {
        [MARGIN, self.width - MARGIN]
    }

    fn laid_out(&self, text: &str, width: f32) -> Arc<Galley> {
        let font = TextStyle::Small.resolve(self.ui.style());
        let colour = self.ui.visuals().text_color();
        self.ui.painter().layout(text.to_owned(), font, colour, width)
    }

    /// A text of its own, in as many rows as it needs.
    fn line(&mut self, text: &str) {
        let [left, right] = self.sides();
        let text = self.laid_out(text, right - left);
        let high = text.size().y;
        self.texts.push((pos2(left, self.below), text));
        self.below += high + APART.y;
    }

    /// The page as a picture of so many pixels across.
    fn printed(&self, width: usize) -> ColorImage {
        let density = self.ui.ctx().pixels_per_point();
        let height = ((self.below + MARGIN) * density).ceil() as usize;
        let mut image = ColorImage::filled([width, height], self.ui.visuals().panel_fill);
        for (rect, colour) in &self.patches {
            fill(&mut image, *rect * density, *colour);
        }
        // Only now: laying a text out may have brought new letters.
        let letters = self.ui.ctx().fonts(|fonts| fonts.image());
        for (at, text) in &self.texts {
            write(&mut image, &letters, *at, text);
        }
        image
    }
}

/// Fills a rectangle of pixels.
fn fill(image: &mut ColorImage, rect: Rect, colour: Color32) {
    let [width, height] = image.size;
    let pixel = |x: f32, most: usize| (x.round().max(0.0) as usize).min(most);
    let columns = pixel(rect.left(), width)..pixel(rect.right(), width);
    for y in pixel(rect.top(), height)..pixel(rect.bottom(), height) {
        image.pixels[y * width..][columns.clone()].fill(colour);
    }
}

/// Writes a text letter by letter: a pixel of the window's font is a pixel of the picture, for it
/// was laid out at the window's density.
fn write(image: &mut ColorImage, letters: &ColorImage, at: Pos2, text: &Galley) {
    let density = text.pixels_per_point;
    let from = (at * density).round();
    for row in &text.rows {
        for corners in row.visuals.mesh.vertices.chunks_exact(4) {
            let within = (corners[0].pos + row.pos.to_vec2()) * density;
            letter(image, letters, (from + within.to_vec2()).round(), corners);
        }
    }
}

/// Copies one letter out of all `letters`, with its left upper corner at a pixel. Its corners know
/// where it is among them, in pixels.
fn letter(image: &mut ColorImage, letters: &ColorImage, at: Pos2, corners: &[Vertex]) {
    let [first, .., last] = corners else { return };
    let [width, height] = image.size;
    let place = |from: f32, by: usize, most: usize| {
        usize::try_from(from as i64 + by as i64).ok().filter(|x| *x < most)
    };
    for (j, v) in (first.uv.y as usize..last.uv.y as usize).enumerate() {
        for (i, u) in (first.uv.x as usize..last.uv.x as usize).enumerate() {
            let (Some(x), Some(y)) = (place(at.x, i, width), place(at.y, j, height)) else {
                continue;
            };
            let Some(texel) = letters.pixels.get(v * letters.size[0] + u) else { continue };
            let pixel = &mut image.pixels[y * width + x];
            *pixel = pixel.blend(first.color * *texel);
        }
    }
}

/// A picture with its legend under it. Beside a picture that is narrower, the legend's background
/// goes on.
pub(crate) fn put_under(picture: &ColorImage, legend: &ColorImage) -> ColorImage {
    let width = picture.width().max(legend.width());
    let background = legend.pixels.first().copied().unwrap_or(Color32::BLACK);
    let mut both = ColorImage::filled([width, picture.height() + legend.height()], background);
    for (from, image) in [(0, picture), (picture.height(), legend)] {
        for (y, row) in image.pixels.chunks_exact(image.width().max(1)).enumerate() {
            both.pixels[(from + y) * width..][..row.len()].copy_from_slice(row);
        }
    }
    both
}

#[cfg(test)]
mod tests {
    use egui::{Context, RawInput};

    use super::*;
    use crate::Colours;

    fn legend(range: [f32; 2], is_logarithmic: bool, is_clipped: bool) -> Legend {
        let scale = FalseColour { is_clipped, ..Colours::default().over(range, is_logarithmic) };
        Legend::new(&scale, |v| scale.encode(v), |v| format!("{v:.2}"), vec!["what it is".into()])
    }

    /// A legend as a window without a screen draws it.
    fn drawn(legend: &Legend, width: usize) -> ColorImage {
        let mut image = None;
        let mut output = Context::default()
            .run_ui(RawInput::default(), |ui| image = Some(legend.drawn(ui, width)));
        output.textures_delta.clear();
        image.expect("a frame")
    }

    fn count(image: &ColorImage, colour: [u8; 3]) -> usize {
        image.pixels.iter().filter(|p| **p == ink(colour)).count()
    }

    #[test]
    fn ends_come_first_and_what_lies_beyond_is_named_where_it_is_clipped() {
        let marks = |legend: &Legend| -> Vec<(f32, String)> {
            legend.marks.iter().take(2).cloned().collect()
        };
        let free = legend([-2.0, 2.0], false, false);
        assert_eq!(marks(&free), [(0.0, "-2.00".to_owned()), (1.0, "2.00".to_owned())]);
        assert_eq!((free.marks.len(), free.samples.len()), (5, 1));
        let clipped = legend([0.01, 100.0], true, true);
        assert_eq!(marks(&clipped), [(0.0, "0.01".to_owned()), (1.0, "100.00".to_owned())]);
        let beyond: Vec<[u8; 3]> = clipped.samples.iter().skip(1).map(|s| s.0).collect();
        assert_eq!(beyond, [BELOW, ABOVE]);
    }

    #[test]
    fn all_colours_are_drawn_and_text_beside_them() {
        let legend = legend([0.0, 1.0], false, true);
        let image = drawn(&legend, 600);
        assert_eq!(image.width(), 600);
        for colour in legend.bar.iter().chain(legend.samples.iter().map(|s| &s.0)) {
            assert!(count(&image, *colour) > 20, "{colour:?}");
        }
        let silent = drawn(&Legend { lines: vec![" ".into()], ..legend }, 600);
        let background =
            |image: &ColorImage| image.pixels.iter().filter(|p| **p == image.pixels[0]).count();
        assert_eq!(image.size, silent.size);
        assert!(background(&image) + 50 < background(&silent), "nothing is written");
    }

    #[test]
    fn a_narrow_picture_gets_background_beside_it() {
        let legend = drawn(&legend([0.0, 1.0], false, false), 20);
        assert!(legend.width() >= LEAST as usize);
        let red = Color32::from_rgb(200, 10, 10);
        let both = put_under(&ColorImage::filled([20, 30], red), &legend);
        assert_eq!(both.size, [legend.width(), 30 + legend.height()]);
        assert_eq!(both.pixels.iter().filter(|p| **p == red).count(), 600);
        let rim = legend[(0, 0)];
        assert_eq!([both[(19, 29)], both[(20, 29)], both[(0, 30)]], [red, rim, rim]);
    }
}
