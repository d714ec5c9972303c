//! A surface of quadrangles as a picture: every pixel shows the nearest face, its value in false
//! colour, its slope in brightness, the mesh as lines.

use egui::{Color32, ColorImage, Rect, Ui, vec2};
use glam::Vec3;
use intrados_scene::Camera;
use rayon::prelude::*;

use crate::orbit;

/// Radians per point dragged.
const TURN: f32 = 0.008;
/// Nothing is there.
pub(crate) const NOTHING: u32 = u32::MAX;
/// Rows that one core draws at a time.
const BAND: usize = 32;
/// Share of its brightness that a face keeps when it is seen edge on.
const EDGE_ON: f32 = 0.55;
/// Share of the brightness of lines.
const LINE: f32 = 0.72;

/// What is drawn.
pub(crate) struct Surface<'a> {
    /// Where the vertices are, m.
    pub(crate) positions: &'a [Vec3],
    /// Their values.
    pub(crate) values: &'a [f32],
    /// Corners of the faces.
    pub(crate) faces: &'a [[u32; 4]],
    /// Whether the mesh is drawn over it.
    pub(crate) mesh: bool,
    /// Towards the sun, under an open sky; none: light comes from the eye.
    pub(crate) sun: Option<Vec3>,
}

/// A picture, and what is where in it.
#[derive(Default)]
pub(crate) struct Drawn {
    pub(crate) size: [usize; 2],
    pub(crate) image: ColorImage,
    /// Of every pixel the index of the face, or [`NOTHING`].
    faces: Vec<u32>,
}

impl Drawn {
    /// Of every pixel the face; [`NOTHING`] where there is none.
    pub(crate) fn faces(&self) -> &[u32] {
        &self.faces
    }

    /// The face at a share of the picture's width and height.
    pub(crate) fn face(&self, x: f32, y: f32) -> Option<u32> {
        let [w, h] = self.size;
        let inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
        let at = (y * h as f32) as usize * w + (x * w as f32) as usize;
        self.faces.get(at).copied().filter(|f| inside && *f != NOTHING)
    }
}

/// From the world to the picture: pixels right and down, and depth.
pub(crate) fn project(camera: &Camera, [w, h]: [usize; 2], p: Vec3) -> Vec3 {
    let ([right, up, forward], [hx, hy]) = (camera.frame(), camera.half_extent());
    let d = p - camera.position;
    let z = d.dot(forward);
    Vec3::new(
        0.5 * (1.0 + d.dot(right) / (z * hx)) * w as f32,
        0.5 * (1.0 - d.dot(up) / (z * hy)) * h as f32,
        z,
    )
}

/// A triangle in the picture: corners, values there over depth, face, brightness.
struct Triangle {
    corners: [Vec3; 3],
    values: [f32; 3],
    face: u32,
    shade: f32,
    /// Twice its area in pixels, with its sign.
    area: f32,
}

/// Draws with `over` × `over` samples a pixel.
pub(crate) fn draw(
    camera: &Camera,
    size: [usize; 2],
    over: usize,
    surface: &Surface,
    colour: impl Fn(f32) -> [u8; 3] + Sync,
) -> Drawn {
    let fine = size.map(|n| n * over);
    let near = 1e-3 * (camera.target - camera.position).length();
    let seen: Vec<Vec3> = surface.positions.iter().map(|&p| project(camera, fine, p)).collect();
    let mut triangles = Vec::with_capacity(2 * surface.faces.len());
    for (face, corners) in (0_u32..).zip(surface.faces) {
        let at = corners.map(|c| surface.positions[c as usize]);
        let normal = (at[2] - at[0]).cross(at[3] - at[1]).normalize_or_zero();
        let towards = (camera.position - at[0]).normalize_or_zero();
        let shade = match surface.sun {
            None => EDGE_ON + (1.0 - EDGE_ON) * normal.dot(towards).abs(),
            Some(sun) => daylight(normal * normal.dot(towards).signum(), sun),
        };
        // Both halves begin with an edge of the face, go on along another, and return along the
        // diagonal.
        for [a, b, c] in [[0, 1, 2], [2, 3, 0]].map(|t| t.map(|k: usize| corners[k] as usize)) {
            let corners = [seen[a], seen[b], seen[c]];
            let area =
                (corners[1] - corners[0]).truncate().perp_dot((corners[2] - corners[0]).truncate());
            // What reaches behind the eye is left out.
            if area.abs() > 1e-6 && corners.iter().all(|p| p.z > near && p.is_finite()) {
                let values = [a, b, c].map(|v| surface.values.get(v).copied().unwrap_or(f32::NAN));
                let values = std::array::from_fn(|k| values[k] / corners[k].z);
                triangles.push(Triangle { corners, values, face, shade, area });
            }
        }
    }
    // The nearest first: what they hide is not coloured.
    let nearest = |t: &Triangle| t.corners.iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
    triangles.sort_by_cached_key(|t| (nearest(t).to_bits(), t.face));
    let [w, h] = fine;
    let mut bands: Vec<Vec<&Triangle>> = vec![Vec::new(); h.div_ceil(BAND)];
    for t in &triangles {
        let [from, to] = [f32::min, f32::max]
            .map(|choose| t.corners.iter().map(|p| p.y).reduce(choose).unwrap_or(0.0));
        if to >= 0.0 {
            bands
                .iter_mut()
                .take(to as usize / BAND + 1)
                .skip(from.max(0.0) as usize / BAND)
                .for_each(|band| band.push(t));
        }
    }
    let line = surface.mesh.then_some(0.55 * over as f32);
    let mut pixels = vec![(0.0_f32, NOTHING, [0; 3]); w * h];
    pixels.par_chunks_mut(w * BAND).zip(&bands).enumerate().for_each(|(band, (rows, of_band))| {
        of_band.iter().for_each(|t| fill(t, rows, w, band * BAND, line, &colour));
    });
    gather(&pixels, size, over)
}

/// How bright a face is under an open sky and a sun: what looks down or away keeps half.
fn daylight(normal: Vec3, sun: Vec3) -> f32 {
    0.5 + 0.16 * (0.5 + 0.5 * normal.y) + 0.34 * normal.dot(sun).max(0.0)
}

/// Fills what of a triangle lies in a band of rows.
fn fill(
    t: &Triangle,
    rows: &mut [(f32, u32, [u8; 3])],
    w: usize,
    from: usize,
    line: Option<f32>,
    colour: &impl Fn(f32) -> [u8; 3],
) {
    let count = rows.len() / w;
    let [a, b, c] = t.corners;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let (top, bottom) =
        ((low.y.max(0.0) as usize).max(from), (high.y.max(0.0) as usize + 1).min(from + count));
    let (left, right) = (low.x.max(0.0) as usize, (high.x.max(0.0) as usize + 1).min(w));
    let inverse = 1.0 / t.area;
    let height = |p: Vec3, q: Vec3| (t.area / (q - p).truncate().length().max(1e-6)).abs();
    // Heights above the two edges that are the face's own.
    let heights = [height(a, b), height(b, c)];
    let slope = |p0: Vec3, p1: Vec3| (p0.y - p1.y) * inverse;
    let slopes = [slope(a, b), slope(b, c)];
    for y in top..bottom {
        let p = glam::Vec2::new(0.5, y as f32 + 0.5);
        let share = |p0: Vec3, p1: Vec3| {
            (p1.truncate() - p0.truncate()).perp_dot(p - p0.truncate()) * inverse
        };
        let first = [share(a, b), share(b, c)];
        let [left, right] = within(first, slopes, [left, right]);
        for x in left..right {
            let (of_c, of_a) = (first[0] + slopes[0] * x as f32, first[1] + slopes[1] * x as f32);
            let of_b = 1.0 - of_a - of_c;
            if of_a < 0.0 || of_b < 0.0 || of_c < 0.0 {
                continue;
            }
            let near = of_a / a.z + of_b / b.z + of_c / c.z;
            let pixel = &mut rows[(y - from) * w + x];
            if near <= pixel.0 {
                continue;
            }
            let value = (of_a * t.values[0] + of_b * t.values[1] + of_c * t.values[2]) / near;
            let is_line =
                line.is_some_and(|width| of_c * heights[0] < width || of_a * heights[1] < width);
            let shade = if is_line { LINE * t.shade } else { t.shade };
            *pixel = (near, t.face, colour(value).map(|v| (f32::from(v) * shade) as u8));
        }
    }
}

/// Of a row of samples those where two shares, `first` + `slopes` x, and one less both are not
/// negative, and one more on either side.
fn within(first: [f32; 2], slopes: [f32; 2], [mut left, mut right]: [usize; 2]) -> [usize; 2] {
    let third = (1.0 - first[0] - first[1], -slopes[0] - slopes[1]);
    for (first, slope) in first.into_iter().zip(slopes).chain([third]) {
        let zero = -first / slope;
        if slope > 0.0 {
            left = left.max((zero - 1.0).max(0.0) as usize);
        } else if slope < 0.0 {
            right = right.min((zero + 2.0).max(0.0) as usize);
        }
    }
    [left, right]
}

/// Samples to pixels; where nothing is, the pixel stays clear.
fn gather(samples: &[(f32, u32, [u8; 3])], [w, h]: [usize; 2], over: usize) -> Drawn {
    let mut drawn = Drawn {
        size: [w, h],
        image: ColorImage::filled([w, h], Color32::TRANSPARENT),
        faces: vec![NOTHING; w * h],
    };
    let rows =
        drawn.image.pixels.par_chunks_mut(w.max(1)).zip(drawn.faces.par_chunks_mut(w.max(1)));
    rows.enumerate().for_each(|(y, (colours, faces))| {
        for (x, (colour, face)) in colours.iter_mut().zip(faces).enumerate() {
            let (mut sum, mut nearest, mut covered) = ([0_u32; 3], 0.0, 0);
            for k in 0..over * over {
                let (near, of, rgb) =
                    samples[(y * over + k / over) * w * over + x * over + k % over];
                if of == NOTHING {
                    continue;
                }
                covered += 1;
                rgb.iter().zip(&mut sum).for_each(|(v, sum)| *sum += u32::from(*v));
                if near > nearest {
                    (nearest, *face) = (near, of);
                }
            }
            let [r, g, b] = sum.map(|v| (v / (over * over) as u32) as u8);
            *colour =
                Color32::from_rgba_premultiplied(r, g, b, (255 * covered / (over * over)) as u8);
        }
    });
    drawn
}

/// Corners of the box around points.
pub(crate) fn bounds(points: &[Vec3]) -> [Vec3; 2] {
    points
        .iter()
        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)])
}

/// Where a point is in the window.
pub(crate) fn place(camera: &Camera, rect: Rect, p: Vec3) -> egui::Pos2 {
    let at = project(camera, [rect.width() as usize, rect.height() as usize], p);
    rect.min + vec2(at.x, at.y)
}

/// Drag to turn, Shift or another button to move, wheel to come nearer, double-click to see all
/// again.
pub(crate) fn hand(ui: &Ui, response: &egui::Response, rect: Rect, camera: Camera) -> Camera {
    let delta = response.drag_delta();
    if response.dragged() && delta != egui::Vec2::ZERO {
        let moves =
            ui.input(|i| i.modifiers.shift) || !response.dragged_by(egui::PointerButton::Primary);
        return match moves {
            true => orbit::pan(&camera, delta.x / rect.width(), delta.y / rect.width()),
            false => orbit::orbit(&camera, delta.x * TURN, delta.y * TURN),
        };
    }
    let scroll = if response.hovered() { ui.input(|i| i.smooth_scroll_delta().y) } else { 0.0 };
    if scroll != 0.0 { orbit::dolly(&camera, (-scroll * 0.003).exp()) } else { camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            name: String::new(),
            position: Vec3::new(0.0, 0.0, 4.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 60.0,
            width: 64,
            height: 64,
            exposure: 0.0,
            lens: None,
        }
    }

    /// Two squares one behind the other, the nearer one smaller, values growing with x.
    #[test]
    fn the_nearer_face_hides_the_other_and_values_are_linear_across_it() {
        let square =
            |s: f32, z: f32| [[-s, -s], [s, -s], [s, s], [-s, s]].map(|[x, y]| Vec3::new(x, y, z));
        let positions = [square(1.0, 0.0), square(0.5, 1.0)].concat();
        let values: Vec<f32> = positions.iter().map(|p| 100.0 + 50.0 * p.x).collect();
        let surface = Surface {
            positions: &positions,
            values: &values,
            faces: &[[0, 1, 2, 3], [4, 5, 6, 7]],
            mesh: false,
            sun: None,
        };
        let drawn = draw(&camera(), [64, 64], 2, &surface, |v| [v as u8; 3]);
        assert_eq!(
            (drawn.face(0.5, 0.5), drawn.face(0.01, 0.5), drawn.face(2.0, 0.5)),
            (Some(1), None, None)
        );
        let at = |x: usize| drawn.image.pixels[32 * 64 + x];
        // x of the far square at pixel 18: tan 30° · 4 · (18.5/32 − 1).
        let x = 30_f32.to_radians().tan() * 4.0 * (18.5 / 32.0 - 1.0);
        assert_eq!(drawn.face(18.5 / 64.0, 0.5), Some(0));
        let shade = EDGE_ON + (1.0 - EDGE_ON) * (4.0 / 18_f32.sqrt());
        assert!((f32::from(at(18).r()) - shade * (100.0 + 50.0 * x)).abs() < 2.0, "{:?}", at(18));
        assert_eq!((at(0), at(32).a()), (Color32::TRANSPARENT, 255));
    }

    #[test]
    fn what_is_behind_the_eye_is_left_out() {
        let positions = [
            Vec3::new(-1.0, -1.0, 9.0),
            Vec3::new(1.0, -1.0, 9.0),
            Vec3::new(1.0, 1.0, -9.0),
            Vec3::new(-1.0, 1.0, -9.0),
        ];
        let surface = Surface {
            positions: &positions,
            values: &[0.0; 4],
            faces: &[[0, 1, 2, 3]],
            mesh: true,
            sun: None,
        };
        let drawn = draw(&camera(), [16, 16], 1, &surface, |_| [255; 3]);
        assert!(drawn.image.pixels.iter().all(|p| *p == Color32::TRANSPARENT));
    }
}
