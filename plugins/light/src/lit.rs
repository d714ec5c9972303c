//! A scene as light sees it: triangles in world space with their normals, materials and lamps, behind one ray tracer.

use std::{f32::consts::PI, sync::Arc};

use glam::{Mat3, Vec2, Vec3};
use intrados_scene::{Hit, Mesh, Object, Part, Ray, Scene, Surface, TextureRef, Tracer, tracer};
use intrados_stage::{Cancelled, Job};

use crate::{
    bsdf::{Bsdf, warp::Discrete},
    emit::{Bounds, Emitter},
    rgb::luminance,
};

/// What a scene becomes before light can walk in it. Immutable; shared by all threads.
#[derive(Debug)]
pub struct LitScene {
    /// The scene it was made from.
    pub scene: Arc<Scene>,
    /// The tree.
    pub tracer: Tracer,
    /// World corners, anticlockwise seen from the front.
    corners: Vec<[Vec3; 3]>,
    /// Unit normals of the front, facet by facet.
    normals: Vec<Vec3>,
    /// How far off its place the tracer may see each facet, m.
    slacks: Vec<f32>,
    /// Object and triangle within its mesh.
    places: Vec<[u32; 2]>,
    /// Per object.
    looks: Vec<Look>,
    /// Lamps, surfaces or not, and how they are chosen: in proportion to their flux.
    pub(crate) sources: Vec<Source>,
    pub(crate) choice: Option<Discrete>,
    /// Per triangle the source that it is, or `NO_SOURCE`; empty where no surface shines.
    source_of: Vec<u32>,
    /// Lamps that are no surfaces, ready to be sampled.
    pub(crate) beams: Vec<Emitter>,
    /// Index into `beams` of the light from beyond the scene.
    pub(crate) sky: Option<usize>,
}

pub(crate) const NO_SOURCE: u32 = u32::MAX;

/// One lamp among those that walks choose from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Source {
    /// A shining triangle.
    Triangle(u32),
    /// Index into the beams.
    Beam(u32),
}

/// How an object looks.
#[derive(Debug)]
struct Look {
    /// The BSDF itself where it is the same all over the object.
    plain: Option<Bsdf>,
    /// Object normals → world normals.
    normal_matrix: Mat3,
    /// Whether the transform mirrors, so that two corners were swapped.
    mirrored: bool,
    smooth: bool,
}

/// A point that a walk has reached, with all that is known of the surface there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub(crate) position: Vec3,
    /// Bound on the rounding error of `position`, per axis.
    pub(crate) error: Vec3,
    /// Unit normal of the facet's front.
    pub(crate) geometric: Vec3,
    /// Unit shading normal, on the same side.
    pub(crate) shading: Vec3,
    pub(crate) bsdf: Bsdf,
    pub(crate) triangle: u32,
}

impl LitScene {
    /// Compiles `scene`: flattens the objects, builds the tree, lists the lamps.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub fn build(scene: Arc<Scene>, job: &Job) -> Result<Self, Cancelled> {
        let total = scene.triangle_count();
        let (mut corners, mut places, mut looks) = (Vec::with_capacity(total), Vec::with_capacity(total), Vec::new());
        let mut has_concrete = vec![false; scene.members.len()];
        for object in scene.objects.iter().filter(|o| o.part == Part::Concrete) {
            object.member.into_iter().for_each(|m| has_concrete[m] = true);
        }
        for (o, object) in scene.objects.iter().enumerate() {
            job.step(0, 1)?;
            let mesh = &scene.meshes[object.mesh];
            let look = Look::new(&scene, object, mesh);
            if is_buried(object, &has_concrete) {
                looks.push(look);
                continue;
            }
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(t).map(|p| object.transform.transform_point3(p));
                corners.push(if look.mirrored { [a, c, b] } else { [a, b, c] });
                places.push([o as u32, t as u32]);
            }
            looks.push(look);
        }
        let normals = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or(Vec3::Y)).collect();
        let slacks = corners.iter().map(tracer::offset::slack).collect();
        let tracer = Tracer::build_job(&corners, job)?;
        let mut lit = Self {
            scene,
            tracer,
            corners,
            normals,
            slacks,
            places,
            looks,
            sources: Vec::new(),
            choice: None,
            source_of: Vec::new(),
            beams: Vec::new(),
            sky: None,
        };
        lit.list_sources();
        Ok(lit)
    }

    fn list_sources(&mut self) {
        let mut flux = Vec::new();
        for t in 0..self.corners.len() {
            let radiance = luminance(self.mean_emission(t));
            if radiance > 0.0 {
                if self.source_of.is_empty() {
                    self.source_of = vec![NO_SOURCE; self.corners.len()];
                }
                self.source_of[t] = self.sources.len() as u32;
                self.sources.push(Source::Triangle(t as u32));
                flux.push(PI * radiance * self.area(t as u32));
            }
        }
        let bounds = self.reach();
        for lamp in &self.scene.lamps {
            let beam = Emitter::new(&lamp.kind, bounds);
            if matches!(beam, Emitter::Environment(_)) {
                self.sky = Some(self.beams.len());
            }
            flux.push(luminance(beam.flux()));
            self.sources.push(Source::Beam(self.beams.len() as u32));
            self.beams.push(beam);
        }
        self.choice = Discrete::new(&shared(&flux, &self.sources, &self.beams));
    }

    /// A sphere around all that light from beyond must reach: objects and meters.
    fn reach(&self) -> Bounds {
        let [mut lo, mut hi] = self.scene.bounds();
        for meter in &self.scene.meters {
            for p in [meter.corner, meter.corner + meter.u, meter.corner + meter.v, meter.corner + meter.u + meter.v] {
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
        Bounds::of_box([lo, hi])
    }

    /// Index among the sources of beam `beam`: beams stand behind the shining triangles.
    pub(crate) fn source_of_beam(&self, beam: u32) -> usize {
        self.sources.len() - self.beams.len() + beam as usize
    }

    /// Index among the sources of the light from beyond; call it only if there is one.
    pub(crate) fn sky_source(&self) -> usize {
        self.source_of_beam(self.sky.unwrap_or(0) as u32)
    }

    /// Emission of a triangle with its texture's mean at the corners: only for choosing among lamps.
    fn mean_emission(&self, triangle: usize) -> Vec3 {
        let object = &self.scene.objects[self.places[triangle][0] as usize];
        let material = &self.scene.materials[object.material];
        match &material.emission_texture {
            // Anything that can shine must have a chance; a texture is bounded by its brightest texel.
            Some(texture) => material.emission * self.scene.textures[texture.texture].texels.iter().fold(Vec3::ZERO, |a, &b| a.max(b)),
            None => material.emission,
        }
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.corners.len()
    }

    /// World corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.corners[triangle as usize]
    }

    /// The object that a triangle belongs to.
    #[must_use]
    pub fn object(&self, triangle: u32) -> &Object {
        &self.scene.objects[self.places[triangle as usize][0] as usize]
    }

    /// Area of a triangle, m².
    pub(crate) fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Unit normal of a triangle's front.
    pub(crate) fn normal(&self, triangle: u32) -> Vec3 {
        self.normals[triangle as usize]
    }

    /// The source that a triangle is.
    pub(crate) fn source_of(&self, triangle: u32) -> Option<usize> {
        self.source_of.get(triangle as usize).filter(|&&s| s != NO_SOURCE).map(|&s| s as usize)
    }

    /// Radiance that the front of `triangle` emits at barycentrics `at` (weights of the second and third corner).
    pub(crate) fn emission(&self, triangle: u32, at: [f32; 2]) -> Vec3 {
        let [o, t] = self.places[triangle as usize];
        let object = &self.scene.objects[o as usize];
        let material = &self.scene.materials[object.material];
        match &material.emission_texture {
            Some(texture) => material.emission * self.texel(texture, object, t, self.looks[o as usize].mesh_weights(at)),
            None => material.emission,
        }
    }

    /// Who was hit, for people: the object's name, its member, the point.
    #[must_use]
    pub fn pick(&self, ray: &Ray) -> Option<(usize, Vec3)> {
        let mut hits = [Hit { t: f32::INFINITY, triangle: Hit::NONE }];
        self.tracer.closest(std::slice::from_ref(ray), &mut hits, &mut tracer::Scratch::default());
        let hit = hits[0];
        (hit.triangle != Hit::NONE).then(|| {
            let point = Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
            (self.places[hit.triangle as usize][0] as usize, point)
        })
    }

    /// The surface where `ray` met `triangle`, and the barycentrics there.
    #[inline]
    pub(crate) fn point(&self, ray: &Ray, triangle: u32) -> (Point, [f32; 2]) {
        let corners = &self.corners[triangle as usize];
        let at = tracer::offset::barycentric(corners, ray);
        let (position, error) = tracer::offset::surface_point(corners, at, self.slacks[triangle as usize]);
        let o = self.places[triangle as usize][0] as usize;
        let look = &self.looks[o];
        let geometric = self.normals[triangle as usize];
        let point = match look.plain {
            Some(bsdf) => Point { position, error, geometric, shading: geometric, bsdf, triangle },
            None => {
                let (shading, bsdf) = self.shade(triangle, look.mesh_weights(at), geometric);
                Point { position, error, geometric, shading, bsdf, triangle }
            }
        };
        (point, at)
    }

    /// Shading normal and BSDF where they vary over the object.
    fn shade(&self, triangle: u32, weights: [f32; 3], geometric: Vec3) -> (Vec3, Bsdf) {
        let [o, t] = self.places[triangle as usize];
        let (object, look) = (&self.scene.objects[o as usize], &self.looks[o as usize]);
        let (mesh, material) = (&self.scene.meshes[object.mesh], &self.scene.materials[object.material]);
        let corners = mesh.triangles[t as usize].map(|i| i as usize);
        let mut shading = geometric;
        if look.smooth {
            let n = look.normal_matrix * interpolate(corners.map(|i| mesh.normals[i]), weights);
            shading = aligned(n.normalize_or(geometric), geometric);
        }
        if let Some((texture, strength)) = &material.normal_texture {
            let n = self.texel(texture, object, t, weights) * 2.0 - 1.0;
            let n = Vec3::new(n.x * strength, n.y * strength, n.z);
            let (tangent, bitangent) = self.tangents(object, look, t, texture, shading, weights);
            shading = aligned((tangent * n.x + bitangent * n.y + shading * n.z).normalize_or(shading), geometric);
        }
        let mut base = material.base_colour;
        if let Some(texture) = &material.base_texture {
            base *= self.texel(texture, object, t, weights);
        }
        if !mesh.colours.is_empty() {
            base *= interpolate(corners.map(|i| mesh.colours[i]), weights);
        }
        let packed = match &material.surface {
            Surface::Metallic { texture: Some(texture), .. } => self.texel(texture, object, t, weights),
            _ => Vec3::ONE,
        };
        (shading, Bsdf::new(&material.surface, base, packed))
    }

    fn texel(&self, texture: &TextureRef, object: &Object, t: u32, weights: [f32; 3]) -> Vec3 {
        self.scene.textures[texture.texture].sample(self.uv(texture, object, t, weights))
    }

    fn uv(&self, texture: &TextureRef, object: &Object, t: u32, weights: [f32; 3]) -> Vec2 {
        let mesh = &self.scene.meshes[object.mesh];
        let set = &mesh.uv[texture.set.min(1)];
        if set.is_empty() {
            return Vec2::ZERO;
        }
        let [a, b, c] = mesh.triangles[t as usize].map(|i| set[i as usize]);
        texture.transform.transform_point2(a * weights[0] + b * weights[1] + c * weights[2])
    }

    /// Tangent and bitangent in the world: the mesh's own, else from the texture coordinates.
    fn tangents(&self, object: &Object, look: &Look, t: u32, texture: &TextureRef, normal: Vec3, weights: [f32; 3]) -> (Vec3, Vec3) {
        let mesh = &self.scene.meshes[object.mesh];
        let corners = mesh.triangles[t as usize].map(|i| i as usize);
        let linear = Mat3::from_mat4(object.transform);
        let fallback = || {
            let frame = crate::bsdf::Frame::new(normal);
            (frame.x, frame.y)
        };
        if !mesh.tangents.is_empty() {
            let tangent = linear * interpolate(corners.map(|i| mesh.tangents[i].truncate()), weights);
            let tangent = tangent - normal * normal.dot(tangent);
            let hand = mesh.tangents[corners[0]].w * if look.mirrored { -1.0 } else { 1.0 };
            return tangent.try_normalize().map_or_else(fallback, |x| (x, normal.cross(x) * hand));
        }
        let set = &mesh.uv[texture.set.min(1)];
        if set.is_empty() {
            return fallback();
        }
        let [p, q, r] = corners.map(|i| linear * mesh.positions[i]);
        let [a, b, c] = corners.map(|i| set[i]);
        let (e1, e2, d1, d2) = (q - p, r - p, b - a, c - a);
        let det = d1.perp_dot(d2);
        // glTF counts v downward, its bitangent goes with +v.
        let tangent = (e1 * d2.y - e2 * d1.y) / det;
        let bitangent = (e2 * d1.x - e1 * d2.x) / det;
        let x = (tangent - normal * normal.dot(tangent)).try_normalize();
        match x {
            Some(x) if det.abs() > 1e-20 => (x, normal.cross(x) * if normal.cross(x).dot(bitangent) < 0.0 { -1.0 } else { 1.0 }),
            _ => fallback(),
        }
    }
}

impl Look {
    fn new(scene: &Scene, object: &Object, mesh: &Mesh) -> Self {
        let linear = Mat3::from_mat4(object.transform);
        let material = &scene.materials[object.material];
        let smooth = !mesh.normals.is_empty();
        let textured = material.base_texture.is_some()
            || material.normal_texture.is_some()
            || !mesh.colours.is_empty()
            || matches!(material.surface, Surface::Metallic { texture: Some(_), .. });
        let determinant = linear.determinant();
        // Inverse transpose up to a positive factor; a flat scale has none, and then no normals worth having.
        let normal_matrix = if determinant.abs() > 1e-30 { linear.inverse().transpose() } else { Mat3::IDENTITY };
        let plain = (!smooth && !textured).then(|| Bsdf::new(&material.surface, material.base_colour, Vec3::ONE));
        Self { plain, normal_matrix, mirrored: determinant < 0.0, smooth }
    }

    /// Weights of the mesh's three corners from barycentrics in the world's order.
    fn mesh_weights(&self, [b, c]: [f32; 2]) -> [f32; 3] {
        if self.mirrored { [1.0 - b - c, c, b] } else { [1.0 - b - c, b, c] }
    }
}

fn interpolate(v: [Vec3; 3], w: [f32; 3]) -> Vec3 {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

/// `n` turned to the side of `reference`.
fn aligned(n: Vec3, reference: Vec3) -> Vec3 {
    if n.dot(reference) < 0.0 { -n } else { n }
}

/// Steel inside the concrete of its member: no light reaches it, and its triangles would only burden the tree.
fn is_buried(object: &Object, has_concrete: &[bool]) -> bool {
    matches!(object.part, Part::Bar | Part::Stirrup | Part::Tendon) && object.member.is_some_and(|m| has_concrete[m])
}

/// Weights for choosing among lamps: by flux, but with half of all walks for the lamps in the scene and half for the light from beyond, where
/// there are both. The flux of a sky grows with the ground that it lights, and would leave nothing for a lamp in a room.
fn shared(flux: &[f32], sources: &[Source], beams: &[Emitter]) -> Vec<f32> {
    let beyond = |source: &Source| match source {
        Source::Beam(beam) => matches!(beams[*beam as usize], Emitter::Directional { .. } | Emitter::Environment(_)),
        Source::Triangle(_) => false,
    };
    let total =
        |wanted: bool| flux.iter().zip(sources).filter(|(_, s)| beyond(s) == wanted).map(|(f, _)| f).sum::<f32>().max(f32::MIN_POSITIVE);
    let totals = [total(false), total(true)];
    flux.iter().zip(sources).map(|(f, s)| f / totals[usize::from(beyond(s))]).collect()
}
