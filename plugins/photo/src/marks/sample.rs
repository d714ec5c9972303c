//! What training shows of a lesson: a crop, turned, enlarged or reduced, as a camera took it; and
//! what is to be said of each of its pixels.

use glam::{Vec2, Vec3, vec2};
use intrados_light::luminance;
use intrados_raster::Grid;
use intrados_stage::{
    Cancelled, Job,
    random::{Draw, Key},
};

use super::{
    MARKS, Mark, camera,
    lesson::{Lesson, Mouth},
    sight::Sight,
};

/// How a crop lies in a lesson.
#[derive(Debug, Clone, Copy)]
struct Frame {
    /// Pixels of the crop a pixel of the lesson.
    zoom: f32,
    /// The crop's middle, in pixels of the lesson.
    middle: Vec2,
    /// Where the crop's columns and rows run.
    axes: [Vec2; 2],
    /// Pixels along the crop's side.
    side: usize,
}

impl Frame {
    fn drawn(lesson: usize, side: usize, draw: &mut Draw) -> Self {
        let smallest = side as f64 / lesson as f64;
        let zoom = match draw.count(0, 9) {
            0..=2 => 1.0,
            3..=6 => draw.log_between(smallest, 1.8) as f32,
            // As one sees who comes close: cracks a dozen pixels wide, with soft borders.
            _ => draw.log_between(1.8, 4.5) as f32,
        };
        let room = (lesson as f32 - side as f32 / zoom).max(0.0);
        let mut place = || 0.5 * lesson as f32 + room * (draw.unit() as f32 - 0.5);
        let middle = vec2(place(), place());
        let x = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y][draw.count(0, 3)];
        let y = if draw.chance(0.5) { x.perp() } else { -x.perp() };
        Self { zoom, middle, axes: [x, y], side }
    }

    /// Moves so far that a place of the lesson that shows a kind is in sight.
    fn show(&mut self, lesson: &Lesson, mark: usize, draw: &mut Draw) {
        let shown = lesson.labels.iter().enumerate().filter(|(_, l)| l[mark] > 0.5);
        let shown: Vec<usize> = shown.map(|(i, _)| i).collect();
        let Some(last) = shown.len().checked_sub(1) else { return };
        let i = shown[draw.count(0, last)];
        let place = vec2((i % lesson.side) as f32, (i / lesson.side) as f32);
        let half = Vec2::splat(0.5 * self.side as f32 / self.zoom);
        let mut off = || 1.4 * (draw.unit() as f32 - 0.5);
        let whole = Vec2::splat(lesson.side as f32);
        self.middle = (place + half * vec2(off(), off())).clamp(half, (whole - half).max(half));
    }

    /// Of a place of the crop, in pixels of the lesson.
    fn source(&self, at: Vec2) -> Vec2 {
        let from = (at - 0.5 * self.side as f32) / self.zoom;
        self.middle + from.x * self.axes[0] + from.y * self.axes[1]
    }

    /// Of a place of the lesson, in pixels of the crop.
    fn place(&self, at: Vec2) -> Vec2 {
        let from = self.zoom * (at - self.middle);
        vec2(from.dot(self.axes[0]), from.dot(self.axes[1])) + 0.5 * self.side as f32
    }

    /// What the lesson has there, from four places of each pixel.
    fn sampled<T: Copy>(
        &self,
        data: &[T],
        side: usize,
        mix: impl Fn([(T, f32); 16]) -> T,
    ) -> Grid<T> {
        let value = |i: usize| {
            let corner = vec2((i % self.side) as f32, (i / self.side) as f32);
            let four: [_; 4] = std::array::from_fn(|k| {
                let inside = vec2((k % 2) as f32, (k / 2) as f32) * 0.5 + 0.25;
                bilinear(self.source(corner + inside), side)
            });
            mix(std::array::from_fn(|k| {
                let (place, weight) = four[k / 4][k % 4];
                (data[place], 0.25 * weight)
            }))
        };
        let data = (0..self.side * self.side).map(value).collect();
        Grid { width: self.side, height: self.side, data }
    }
}

/// The four pixels around a place and their weights.
fn bilinear(at: Vec2, side: usize) -> [(usize, f32); 4] {
    let at = (at - 0.5).clamp(Vec2::ZERO, Vec2::splat(side as f32 - 1.0));
    let low = at.floor().min(Vec2::splat(side as f32 - 2.0));
    let f = at - low;
    let first = low.y as usize * side + low.x as usize;
    [
        (first, (1.0 - f.x) * (1.0 - f.y)),
        (first + 1, f.x * (1.0 - f.y)),
        (first + side, (1.0 - f.x) * f.y),
        (first + side + 1, f.x * f.y),
    ]
}

/// What is shown and what is to be said of it.
pub(super) struct Sample {
    pub(super) sight: Sight,
    /// What covers each pixel, in [0, 1].
    pub(super) truth: Grid<[f32; MARKS]>,
    /// Whether what is said of each kind there counts.
    pub(super) counts: Grid<[bool; MARKS]>,
    /// How bright it is, as a root.
    grey: Grid<f32>,
}

impl Sample {
    /// Of a lesson, as `key` draws it; somewhere around a place that shows the kind `about`.
    pub(super) fn drawn(
        lesson: &Lesson,
        side: usize,
        about: Option<usize>,
        key: Key,
    ) -> Result<Self, Cancelled> {
        let mut draw = Draw::new(key);
        let mut frame = Frame::drawn(lesson.side, side, &mut draw);
        if let Some(mark) = about {
            frame.show(lesson, mark, &mut draw);
        }
        let light = frame.sampled(&lesson.light, lesson.side, |sixteen| {
            sixteen.into_iter().map(|(l, w)| w * l).sum::<Vec3>()
        });
        let truth = frame.sampled(&lesson.labels, lesson.side, |sixteen| {
            std::array::from_fn(|m| sixteen.iter().map(|(l, w)| w * l[m]).sum())
        });
        let roots = camera::taken(&light, key.split(1, 0));
        let lines: Vec<Vec<Mouth>> = lesson.courses.iter().map(|c| placed(c, &frame)).collect();
        let mut sample = Self {
            sight: Sight::new(&roots.map(|r| r * r), &roots.map(|_| true), &Job::default())?,
            counts: roots.map(|_| [true; MARKS]),
            truth,
            grey: roots.map(luminance),
        };
        sample.draw_cracks(&lines);
        Ok(sample)
    }

    /// A stain is where it covers enough to be seen; lime on what is as pale counts neither as
    /// efflorescence nor as none.
    pub(super) fn judge_stains(&mut self) {
        let lime = self.truth.map(|t| f64::from(t[LIME]));
        let pale = brighter(&self.grey.map(f64::from), &lime);
        for (i, truth) in self.truth.data.iter_mut().enumerate() {
            for stain in [RUST, LIME] {
                truth[stain] = f32::from(u8::from(truth[stain] > COVERED));
            }
            let seen = pale.data[i] > BRIGHTER;
            self.counts.data[i][LIME] = seen == (truth[LIME] > 0.5) || lime.data[i] < 0.05;
        }
    }

    /// Cracks are as wide as they are, at least three pixels; one that is too faint to be seen
    /// counts neither as a crack nor as none.
    fn draw_cracks(&mut self, lines: &[Vec<Mouth>]) {
        let grey = &self.grey;
        let wide = self.truth.map(|t| t[0] > 0.4);
        let spall = self.truth.map(|t| t[1] > 0.5);
        let width = grey.width;
        let mut course = grey.map(|_| false);
        for (at, radius) in lines.iter().flat_map(|line| along(line)) {
            if let Some(i) = pixel(at, grey).filter(|&i| !spall.data[i] && radius > 0.03) {
                course.data[i] = true;
            }
        }
        let seen = seen(&course, &wide, grey);
        self.truth.data.iter_mut().for_each(|t| t[0] = 0.0);
        let near = |i: usize, reach: i32| {
            let (x, y) = ((i % width) as i32, (i / width) as i32);
            let offsets = (-reach..=reach).flat_map(move |v| (-reach..=reach).map(move |u| (u, v)));
            let inside = move |c: i32, n: usize| (0..n as i32).contains(&c);
            offsets
                .map(move |(u, v)| (x + u, y + v))
                .filter(move |&(u, v)| inside(u, width) && inside(v, grey.height))
                .map(move |(u, v)| v as usize * width + u as usize)
        };
        for i in course.pixels().into_iter().filter(|&i| !seen.data[i]) {
            near(i, 3).for_each(|j| self.counts.data[j][0] = false);
        }
        for i in course.pixels().into_iter().filter(|&i| seen.data[i]) {
            near(i, 1).for_each(|j| {
                self.truth.data[j][0] = 1.0;
                self.counts.data[j][0] = true;
            });
        }
        for i in wide.pixels() {
            self.truth.data[i][0] = 1.0;
        }
    }
}

/// A course in pixels of the crop.
fn placed(course: &[Mouth], frame: &Frame) -> Vec<Mouth> {
    course
        .iter()
        .map(|m| Mouth { at: frame.place(m.at), width: m.width * frame.zoom, ..*m })
        .collect()
}

/// Places along the visible parts of a course, half a pixel from each other, and half widths.
fn along(course: &[Mouth]) -> Vec<(Vec2, f32)> {
    let mut places = Vec::new();
    for pair in course.windows(2).filter(|pair| pair[0].visible && pair[1].visible) {
        let steps = (2.0 * pair[0].at.distance(pair[1].at)).ceil().clamp(1.0, 64.0);
        places.extend((0..steps as usize).map(|k| {
            let s = k as f32 / steps;
            let width = pair[0].width + s * (pair[1].width - pair[0].width);
            (pair[0].at.lerp(pair[1].at, s), 0.5 * width)
        }));
    }
    places
}

fn pixel(at: Vec2, grid: &Grid<f32>) -> Option<usize> {
    let inside = at.min_element() >= 0.0 && at.x < grid.width as f32 && at.y < grid.height as f32;
    inside.then(|| at.y as usize * grid.width + at.x as usize)
}

/// Places of stains among the kinds.
const RUST: usize = Mark::Rust as usize;
const LIME: usize = Mark::Efflorescence as usize;
/// Share that a stain must cover to be one.
pub(super) const COVERED: f32 = 0.3;
/// By what share the root of light of lime must be above what is around it to be seen.
const BRIGHTER: f64 = 0.05;
/// Half side of the squares that are around lime.
const NEAR: usize = 24;

/// By what share each place is brighter than what is bare around it; 0 where nothing is.
fn brighter(tone: &Grid<f64>, covered: &Grid<f64>) -> Grid<f64> {
    let bare = covered.map(|c| f64::from(u8::from(c < 0.1)));
    let number = boxed(&bare, NEAR);
    let sum = boxed(&times(tone, &bare), NEAR);
    let [own, area] = [boxed(tone, 2), boxed(&tone.map(|_| 1.0), 2)];
    let of = |i: usize| {
        let around = sum.data[i] / number.data[i].max(1.0);
        if number.data[i] < 20.0 {
            0.0
        } else {
            own.data[i] / area.data[i] / around.max(1e-6) - 1.0
        }
    };
    Grid { width: tone.width, height: tone.height, data: (0..tone.data.len()).map(of).collect() }
}

fn times(a: &Grid<f64>, b: &Grid<f64>) -> Grid<f64> {
    let data = a.data.iter().zip(&b.data).map(|(a, b)| a * b).collect();
    Grid { width: a.width, height: a.height, data }
}

/// Contrast of a line to the scatter around it below which nobody would draw it.
const FAINTEST: f32 = 0.55;
/// Half sides of the squares over which a line's tone and that of its surroundings are averaged.
const LINE: usize = 7;
const AROUND: usize = 14;

/// Where a course is to be seen: its tone, averaged along it, against what is around it.
fn seen(course: &Grid<bool>, wide: &Grid<bool>, grey: &Grid<f32>) -> Grid<bool> {
    let number = |mask: &Grid<bool>| mask.map(|m| f64::from(u8::from(m)));
    let tone = grey.map(f64::from);
    let on = number(course);
    let mut near = boxed(&on, 2);
    let lips = boxed(&number(wide), 2);
    near.data.iter_mut().zip(&lips.data).for_each(|(n, w)| *n += w);
    let off = near.map(|n| if n > 0.5 { 0.0 } else { 1.0 });
    let [line, lines] = [boxed(&times(&tone, &on), LINE), boxed(&on, LINE)];
    let plain = times(&tone, &off);
    let [sum, squares, count] =
        [boxed(&plain, AROUND), boxed(&times(&plain, &tone), AROUND), boxed(&off, AROUND)];
    let mut seen = course.clone();
    for i in course.pixels() {
        let n = count.data[i];
        if n < 20.0 {
            // Nothing but crack all around.
            continue;
        }
        let mean = sum.data[i] / n;
        let scatter = (squares.data[i] / n - mean * mean).max(0.0).sqrt() + 0.006 * mean;
        let depth = mean - line.data[i] / lines.data[i].max(1.0);
        seen.data[i] = depth as f32 > FAINTEST * scatter as f32;
    }
    seen
}

/// Sums over squares of `2 reach + 1` pixels, cut off at the border.
fn boxed(grid: &Grid<f64>, reach: usize) -> Grid<f64> {
    let (w, h) = (grid.width, grid.height);
    let mut table = vec![0.0; (w + 1) * (h + 1)];
    for y in 0..h {
        let mut row = 0.0;
        for x in 0..w {
            row += grid.data[y * w + x];
            table[(y + 1) * (w + 1) + x + 1] = table[y * (w + 1) + x + 1] + row;
        }
    }
    let at = |x: usize, y: usize| table[y * (w + 1) + x];
    let sum = |i: usize| {
        let (x, y) = (i % w, i / w);
        let (x0, y0) = (x.saturating_sub(reach), y.saturating_sub(reach));
        let (x1, y1) = ((x + reach + 1).min(w), (y + reach + 1).min(h));
        at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)
    };
    Grid { width: w, height: h, data: (0..w * h).map(sum).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(points: &[[f32; 2]], width: f32) -> Vec<Mouth> {
        points.iter().map(|&p| Mouth { at: p.into(), width, visible: true }).collect()
    }

    /// A dark line down the middle of noise, as deep as told.
    fn lesson(depth: f32) -> Lesson {
        let light = (0..192 * 192_u32).map(|i| {
            let line = if (95..97).contains(&(i % 192)) { depth } else { 0.0 };
            let noise = 0.02 * (Key::new(1, u64::from(i)).unit(0) - 0.5);
            Vec3::splat(0.5 - line + noise)
        });
        Lesson {
            side: 192,
            light: light.collect(),
            labels: vec![[0.0; MARKS]; 192 * 192],
            courses: vec![course(&[[96.0, 0.0], [96.0, 192.0]], 2.0)],
        }
    }

    #[test]
    fn clear_lines_are_cracks_and_faint_ones_do_not_count() {
        let count = |depth: f32| {
            let (mut cracks, mut spared) = (0, 0);
            for seed in 0..20 {
                let sample = Sample::drawn(&lesson(depth), 128, None, Key::new(seed, 0)).unwrap();
                cracks += sample.truth.data.iter().filter(|t| t[0] > 0.5).count();
                spared += sample.counts.data.iter().filter(|c| !c[0]).count();
            }
            (cracks, spared)
        };
        let ((clear, unclear), (none, faint)) = (count(0.4), count(0.0));
        // Haze, blur and noise hide some of them.
        assert!(clear > 20 * 3 * 75 && unclear < clear / 5, "{clear} {unclear}");
        assert!(faint > 20 * 5 * 100 && none < faint / 10, "{none} {faint}");
    }

    /// Where the line is drawn, the picture is dark: the crop and its courses lie alike.
    #[test]
    fn labels_lie_where_the_picture_is_dark() {
        for seed in 0..40 {
            let lesson = lesson(0.45);
            let frame = Frame::drawn(192, 128, &mut Draw::new(Key::new(seed, 3)));
            let light = frame.sampled(&lesson.light, 192, |sixteen| {
                sixteen.into_iter().map(|(l, w)| w * l).sum::<Vec3>()
            });
            let grey = light.map(luminance);
            for (at, _) in along(&placed(&lesson.courses[0], &frame)) {
                let inner = at.min_element() > 2.0 && at.max_element() < 126.0;
                if let Some(i) = pixel(at, &grey).filter(|_| inner) {
                    assert!(grey.data[i] < 0.35, "seed {seed}, {at}: {}", grey.data[i]);
                }
            }
        }
    }
}
