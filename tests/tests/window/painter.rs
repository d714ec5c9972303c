//! Draws the triangles of a window as a graphics card does, on the processor alone: the same
//! picture on every machine.

use std::{cell::RefCell, collections::HashMap, rc::Rc};

use egui::{
    Color32, ImageData, Pos2, Rect, TextureId, TexturesDelta,
    epaint::{ClippedPrimitive, Primitive, Vertex},
};
use egui_kittest::TestRenderer;
use image::{Rgb, RgbImage};

/// Textures of a window so far.
#[derive(Clone, Default)]
pub(crate) struct Painter(Rc<RefCell<HashMap<TextureId, Texture>>>);

struct Texture {
    size: [usize; 2],
    /// Premultiplied, rows from the top.
    pixels: Vec<Color32>,
}

impl TestRenderer for Painter {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        let mut textures = self.0.borrow_mut();
        for (id, changes) in delta.set.drain() {
            for change in changes {
                let ImageData::Color(image) = change.image;
                match (change.pos, textures.get_mut(&id)) {
                    (Some([x, y]), Some(texture)) => {
                        for (row, pixels) in image.pixels.chunks(image.size[0]).enumerate() {
                            let from = (y + row) * texture.size[0] + x;
                            texture.pixels[from..from + pixels.len()].copy_from_slice(pixels);
                        }
                    }
                    _ => {
                        let (size, pixels) = (image.size, image.pixels.clone());
                        textures.insert(id, Texture { size, pixels });
                    }
                }
            }
        }
        // A texture that is freed may still be in the picture of this frame.
        delta.clear();
    }
}

impl Texture {
    /// Between the middles of its pixels in proportion, red, green, blue, alpha from 0 to 1.
    fn at(&self, uv: Pos2) -> [f32; 4] {
        let [w, h] = self.size;
        let along = |x: f32, n: usize| {
            let x = (x * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let low = x as usize;
            (low, (low + 1).min(n - 1), x - low as f32)
        };
        let ((x0, x1, s), (y0, y1, t)) = (along(uv.x, w), along(uv.y, h));
        let of = |x: usize, y: usize| self.pixels[y * w + x].to_array().map(f32::from);
        let [a, b, c, d] = [of(x0, y0), of(x1, y0), of(x0, y1), of(x1, y1)];
        std::array::from_fn(|k| {
            let (above, below) = (a[k] + (b[k] - a[k]) * s, c[k] + (d[k] - c[k]) * s);
            (above + (below - above) * t) / 255.0
        })
    }
}

/// Twice the area of a triangle, positive where it turns clockwise on the screen.
fn area(a: Pos2, b: Pos2, c: Pos2) -> f32 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

impl Painter {
    /// The picture of what a frame has put out.
    pub(crate) fn paint(&self, primitives: &[ClippedPrimitive], size: [u32; 2]) -> RgbImage {
        let textures = self.0.borrow();
        let mut canvas = vec![[0.0_f32; 3]; (size[0] * size[1]) as usize];
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let Primitive::Mesh(mesh) = primitive else { continue };
            let Some(texture) = textures.get(&mesh.texture_id) else { continue };
            for corners in mesh.indices.chunks_exact(3) {
                let corners = [0, 1, 2].map(|k| mesh.vertices[corners[k] as usize]);
                triangle(&mut canvas, size, *clip_rect, corners, texture);
            }
        }
        let pixel = |x: u32, y: u32| {
            let value = canvas[(y * size[0] + x) as usize];
            Rgb(value.map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8))
        };
        RgbImage::from_fn(size[0], size[1], pixel)
    }
}

/// One triangle over what is there: premultiplied, in sRGB, as egui wants it.
fn triangle(
    canvas: &mut [[f32; 3]],
    [width, height]: [u32; 2],
    clip: Rect,
    mut corners: [Vertex; 3],
    texture: &Texture,
) {
    let [a, b, c] = corners.map(|v| v.pos);
    let whole = area(a, b, c);
    if whole == 0.0 || !whole.is_finite() {
        return;
    }
    if whole < 0.0 {
        corners.swap(1, 2);
    }
    let whole = whole.abs();
    let places = corners.map(|v| v.pos);
    let bounds = Rect::from_points(&places).intersect(clip);
    let from = |x: f32| (x - 0.5).ceil().max(0.0) as u32;
    let to = |x: f32, n: u32| ((x - 0.5).ceil().max(0.0) as u32).min(n);
    // A pixel on an edge that two triangles share belongs to one of them.
    let owns = [0, 1, 2].map(|k| {
        let (p, q) = (places[(k + 1) % 3], places[(k + 2) % 3]);
        p.y == q.y && q.x > p.x || q.y < p.y
    });
    for y in from(bounds.min.y)..to(bounds.max.y, height) {
        for x in from(bounds.min.x)..to(bounds.max.x, width) {
            let at = Pos2::new(x as f32 + 0.5, y as f32 + 0.5);
            let shares =
                [0, 1, 2].map(|k| area(places[(k + 1) % 3], places[(k + 2) % 3], at) / whole);
            let is_in = shares.iter().zip(owns).all(|(s, owns)| *s > 0.0 || *s == 0.0 && owns);
            if !is_in {
                continue;
            }
            let mix = |of: &dyn Fn(&Vertex) -> f32| -> f32 {
                corners.iter().zip(shares).map(|(v, s)| s * of(v)).sum()
            };
            let painted = texture.at(Pos2::new(mix(&|v| v.uv.x), mix(&|v| v.uv.y)));
            let source: [f32; 4] = std::array::from_fn(|k| {
                painted[k] * mix(&|v| f32::from(v.color.to_array()[k])) / 255.0
            });
            let pixel = &mut canvas[(y * width + x) as usize];
            for (under, over) in pixel.iter_mut().zip(source) {
                *under = over + *under * (1.0 - source[3]);
            }
        }
    }
}
