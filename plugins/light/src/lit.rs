//! A scene as light sees it: triangles in world space with their normals, materials and lamps,
//! behind one ray tracer.

use std::{
    f32::consts::PI,
    sync::{Arc, OnceLock},
};

use glam::{Mat3, Vec2, Vec3};
use intrados_scene::{
    Camera, FinishKind, Hit, Material, Mesh, Object, Part, Ray, Scene, Surface, TextureRef, Tracer,
    finish::{Appearance, Unwrap},
    tracer,
};
use intrados_stage::{Cancelled, Job};
use wide::f32x8;

use crate::{
    bsdf::{Bsdf, warp::Discrete},
    eight::{self, Vec3x8, WIDE},
    emit::{Bounds, Emitter},
    field::Charts,
    film::LARGEST_SCALE,
    reach::Cells,
    rgb::luminance,
};

/// What a scene becomes before light can walk in it. Immutable; shared by all threads.
#[derive(Debug)]
pub struct LitScene {
    /// The scene it was made from.
    pub scene: Arc<Scene>,
    /// The tree.
    pub tracer: Tracer,
    facets: Vec<Facet>,
    /// Object and triangle within its mesh.
    places: Vec<[u32; 2]>,
    /// Per object.
    looks: Vec<Look>,
    /// Per object its colour, and whether it is plain: a Lambert surface of one colour without bent
    /// normals.
    colours: Vec<f32x8>,
    /// Lamps, surfaces or not, and how they are chosen: in proportion to their flux.
    pub(crate) sources: Vec<Source>,
    pub(crate) choice: Option<Discrete>,
    /// Per source what links ask of it.
    shapes: Vec<Shape>,
    /// How far off its place the tracer may see any shining triangle, m. A lamp in a coordinate
    /// plane has no other error there, and its walks would meet the lamp itself.
    lamp_slack: f32,
    scale: i32,
    /// Lamps that are no surfaces, ready to be sampled.
    pub(crate) beams: Vec<Emitter>,
    /// Index into `beams` of the light from beyond the scene.
    pub(crate) sky: Option<usize>,
    /// Pieces of surface, found when somebody asks.
    charts: OnceLock<Arc<Charts>>,
    /// Where the scene's cameras stand, and the angle of their pixels.
    eyes: Vec<(Vec3, f32)>,
    cells: OnceLock<Cells>,
}

/// What every hit asks of a triangle, one cache line: a corner a, how far off its place the tracer
/// may see it (m), b − a, 1/(2 area) | c − a, its object, its front's unit normal, the source that
/// it is. Whole numbers are bits; no source is a NaN.
#[derive(Debug, Clone, Copy)]
struct Facet([f32x8; 2]);

/// So many cameras have a say in how fine finishes are.
const MOST_EYES: usize = 4;

const NO_SOURCE: u32 = u32::MAX;

impl Facet {
    /// Where nothing was hit.
    const NOWHERE: Self = {
        let none = f32::from_bits(u32::MAX);
        Self([f32x8::new([0.0; 8]), f32x8::new([0.0, 0.0, 0.0, none, 0.0, 1.0, 0.0, none])])
    };

    fn new(corners: &[Vec3; 3], object: u32) -> Self {
        let [a, b, c] = *corners;
        let (ab, ac, slack) = (b - a, c - a, tracer::offset::slack(corners));
        let across = ab.cross(ac);
        let n = across.normalize_or(Vec3::Y);
        let inverse = 1.0 / across.length();
        let inverse = if inverse.is_finite() { inverse } else { 0.0 };
        let [object, none] = [object, NO_SOURCE].map(f32::from_bits);
        Self([
            f32x8::from([a.x, a.y, a.z, slack, ab.x, ab.y, ab.z, inverse]),
            f32x8::from([ac.x, ac.y, ac.z, object, n.x, n.y, n.z, none]),
        ])
    }

    fn normal(&self) -> Vec3 {
        Vec3::from_slice(&self.0[1].as_array()[4..7])
    }

    fn slack(&self) -> f32 {
        self.0[0].as_array()[3]
    }

    /// m²; none where it is too small or too large for numbers, or a point or a line.
    fn area(&self) -> f32 {
        let inverse = self.0[0].as_array()[7];
        if inverse > 0.0 { 0.5 / inverse } else { 0.0 }
    }

    fn set_source(&mut self, source: u32) {
        self.0[1].as_mut_array()[7] = f32::from_bits(source);
    }
}

/// What links ask of a source, one cache line: a, density per m² | b − a, red; c − a, green |
/// normal, blue. The density is 0 where the source is no triangle of one colour.
#[derive(Debug, Clone, Copy)]
struct Shape([f32x8; 2]);

/// Eight sources, and points on them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sources8 {
    pub(crate) point: Vec3x8,
    /// How far off the lamp's plane rounding may have put it, m.
    pub(crate) off: f32x8,
    pub(crate) normal: Vec3x8,
    pub(crate) radiance: Vec3x8,
    /// Probability density per m².
    pub(crate) density: f32x8,
    /// Lanes whose source is a triangle of one colour; the others hold nothing.
    pub(crate) simple: u32,
    pub(crate) chosen: [usize; WIDE],
}

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
    /// Of an object with a finish: how it is laid flat.
    unwrap: Option<Unwrap>,
}

/// Eight places that walks have reached. Masks have a bit a lane.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Points8 {
    pub(crate) position: Vec3x8,
    /// How far off the facet's plane rounding may have put it, m.
    pub(crate) off: f32x8,
    /// Unit normal of the facet's front.
    pub(crate) normal: Vec3x8,
    /// Toward the event before, unit.
    pub(crate) back: Vec3x8,
    /// Lambert's reflectance; only of plain lanes.
    pub(crate) albedo: Vec3x8,
    /// Weights of the second and third corner.
    pub(crate) at: [f32x8; 2],
    /// Which source it is; only of shining lanes.
    pub(crate) sources: f32x8,
    /// Lambert surfaces with true normals.
    pub(crate) plain: u32,
    /// Other surfaces.
    pub(crate) special: u32,
    /// Surfaces that are sources.
    pub(crate) shining: u32,
}

impl Points8 {
    pub(crate) fn at(&self, lane: usize) -> [f32; 2] {
        self.at.map(|v| v.as_array()[lane % WIDE])
    }

    pub(crate) fn source(&self, lane: usize) -> usize {
        self.sources.as_array()[lane % WIDE].to_bits() as usize
    }

    /// The walks of rows `rows` (at most eight) of `places`, as far as their way on needs.
    pub(crate) fn picked(places: &[Self], rows: &[u32]) -> Self {
        let mut out = Self::default();
        for (lane, &row) in rows.iter().enumerate() {
            let (from, at) = (&places[row as usize / WIDE], row as usize % WIDE);
            out.position.set(lane, from.position.lane(at));
            out.off.as_mut_array()[lane % WIDE] = from.off.as_array()[at];
            out.normal.set(lane, from.normal.lane(at));
            out.back.set(lane, from.back.lane(at));
            out.albedo.set(lane, from.albedo.lane(at));
            out.plain |= (from.plain >> at & 1) << lane;
            out.special |= (from.special >> at & 1) << lane;
        }
        out
    }

    /// Puts a flat Lambert surface into lane `lane`, seen along its normal.
    pub(crate) fn set_flat(
        &mut self,
        lane: usize,
        [position, error]: [Vec3; 2],
        normal: Vec3,
        albedo: Vec3,
    ) {
        self.position.set(lane, position);
        self.normal.set(lane, normal);
        self.back.set(lane, normal);
        self.albedo.set(lane, albedo);
        self.off.as_mut_array()[lane % WIDE] = error.dot(normal.abs());
        self.plain |= 1 << lane;
    }

    /// A plain lane as a point.
    pub(crate) fn plain_point(&self, lane: usize) -> Point {
        let bsdf = Bsdf::Lambert { albedo: self.albedo.lane(lane) };
        let normal = self.normal.lane(lane);
        // Any error with |n|·error = off.
        let error = normal.abs() * self.off.as_array()[lane % WIDE];
        Point {
            position: self.position.lane(lane),
            error,
            geometric: normal,
            shading: normal,
            bsdf,
        }
    }
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
}

impl LitScene {
    /// Compiles `scene`: flattens the objects, builds the tree, lists the lamps.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub fn build(scene: Arc<Scene>, job: &Job) -> Result<Self, Cancelled> {
        let total = scene.triangle_count();
        let (mut corners, mut places, mut looks) =
            (Vec::with_capacity(total), Vec::with_capacity(total), Vec::new());
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
        let facets = corners
            .iter()
            .zip(&places)
            .map(|(corners, place)| Facet::new(corners, place[0]))
            .collect();
        let colours = looks.iter().map(Look::colour).collect();
        let tracer = Tracer::build_job(&corners, job)?;
        let eye = |c: &Camera| (c.position, 2.0 * c.half_extent()[0] / c.width.max(1) as f32);
        let eyes = scene.cameras.iter().take(MOST_EYES).map(eye).collect();
        let mut lit = Self {
            eyes,
            scene,
            tracer,
            facets,
            places,
            looks,
            colours,
            sources: Vec::new(),
            choice: None,
            shapes: Vec::new(),
            lamp_slack: 0.0,
            scale: 0,
            beams: Vec::new(),
            sky: None,
            charts: OnceLock::new(),
            cells: OnceLock::new(),
        };
        lit.list_sources();
        Ok(lit)
    }

    fn list_sources(&mut self) {
        let mut flux = Vec::new();
        let brightest: Vec<Vec3> =
            self.scene.materials.iter().map(|material| brightest(&self.scene, material)).collect();
        for t in 0..self.facets.len() {
            let radiance = luminance(brightest[self.object(t as u32).material]);
            if radiance > 0.0 {
                self.facets[t].set_source(self.sources.len() as u32);
                self.lamp_slack = self.lamp_slack.max(self.facets[t].slack());
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
        self.scale = scale(flux.iter().sum(), bounds.disk_area());
        self.choice = Discrete::new(&shared(&flux, &self.sources, &self.beams));
        self.shapes =
            self.sources.iter().enumerate().map(|(i, source)| self.shape(i, source)).collect();
    }

    fn shape(&self, index: usize, source: &Source) -> Shape {
        let Source::Triangle(t) = *source else { return Shape([f32x8::ZERO; 2]) };
        let density = match (&self.object_material(t).emission_texture, &self.choice) {
            (None, Some(choice)) if self.area(t) > 0.0 => choice.probability(index) / self.area(t),
            _ => 0.0,
        };
        let [first, second] = self.facets[t as usize].0.map(f32x8::to_array);
        let [ax, ay, az, _, bx, by, bz, _] = first;
        let [cx, cy, cz, _, nx, ny, nz, _] = second;
        let light = self.object_material(t).emission;
        Shape([
            f32x8::from([ax, ay, az, density, bx, by, bz, light.x]),
            f32x8::from([cx, cy, cz, light.y, nx, ny, nz, light.z]),
        ])
    }

    fn object_material(&self, triangle: u32) -> &Material {
        &self.scene.materials[self.object(triangle).material]
    }

    /// Exponent of two of the typical radiance, W·m⁻²·sr⁻¹: that of all lamps' flux, spread evenly
    /// over a sphere around the scene.
    #[must_use]
    pub fn scale(&self) -> i32 {
        self.scale
    }

    /// A sphere around all that light from beyond must reach: objects and meters.
    fn reach(&self) -> Bounds {
        let [mut lo, mut hi] = self.scene.bounds();
        for meter in &self.scene.meters {
            for p in [
                meter.corner,
                meter.corner + meter.u,
                meter.corner + meter.v,
                meter.corner + meter.u + meter.v,
            ] {
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

    /// Whether anything has a surface of deltas only.
    #[must_use]
    pub(crate) fn has_smooth_glass(&self) -> bool {
        let smooth = |o: &Object| {
            matches!(
                Bsdf::new(&self.scene.materials[o.material].surface, Vec3::ONE, Vec3::ONE),
                Bsdf::SmoothDielectric { .. }
            )
        };
        self.scene.objects.iter().any(smooth)
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.facets.len()
    }

    /// Its pieces of surface.
    pub(crate) fn charts(&self) -> &Arc<Charts> {
        self.charts.get_or_init(|| Arc::new(Charts::new(self)))
    }

    /// The cells by which it is known where walks have been.
    pub(crate) fn cells(&self) -> &Cells {
        self.cells.get_or_init(|| Cells::new(self))
    }

    /// The object that a triangle belongs to.
    #[must_use]
    pub fn object(&self, triangle: u32) -> &Object {
        &self.scene.objects[self.places[triangle as usize][0] as usize]
    }

    /// Its place among the scene's objects.
    pub fn object_index(&self, triangle: u32) -> u32 {
        self.places[triangle as usize][0]
    }

    /// The corners of a triangle.
    pub(crate) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let [first, second] = &self.facets[triangle as usize].0;
        let vector = |v: &f32x8, begin: usize| Vec3::from_slice(&v.as_array()[begin..begin + 3]);
        let a = vector(first, 0);
        [a, a + vector(first, 4), a + vector(second, 0)]
    }

    /// Area of a triangle, m².
    pub(crate) fn area(&self, triangle: u32) -> f32 {
        self.facets[triangle as usize].area()
    }

    /// Unit normal of a triangle's front.
    pub(crate) fn normal(&self, triangle: u32) -> Vec3 {
        self.facets[triangle as usize].normal()
    }

    /// The point of a triangle with weights `at` of its second and third corner, and how far off
    /// its place the tracer may see it.
    pub(crate) fn place(&self, triangle: u32, at: [f32; 2]) -> [Vec3; 2] {
        let corners = self.corners(triangle);
        let (position, error) =
            tracer::offset::surface_point(&corners, at, self.facets[triangle as usize].slack());
        [position, error]
    }

    /// Eight sources by the uniform numbers `u`, and points on them by `place`.
    #[inline]
    pub(crate) fn sources(&self, choice: &Discrete, u: f32x8, place: [f32x8; 2]) -> Sources8 {
        let chosen = u.to_array().map(|u| choice.choose(u));
        let [[ax, ay, az, density, bx, by, bz, r], [cx, cy, cz, g, nx, ny, nz, b]] =
            eight::columns(|lane| self.shapes[chosen[lane]].0);
        let at = eight::triangle(place);
        let ab = Vec3x8::new(bx, by, bz) * at[0];
        let point = Vec3x8::new(ax, ay, az) + ab + Vec3x8::new(cx, cy, cz) * at[1];
        let normal = Vec3x8::new(nx, ny, nz);
        let across = normal.abs();
        Sources8 {
            point,
            off: eight::rounding(point, normal)
                + (across.x + across.y + across.z) * f32x8::splat(self.lamp_slack),
            normal,
            radiance: Vec3x8::new(r, g, b),
            density,
            simple: density.simd_gt(f32x8::ZERO).to_bitmask(),
            chosen,
        }
    }

    /// Probability density per m² with which a source is chosen and a point on it; 0 where that is
    /// not so simple.
    pub(crate) fn source_density(&self, source: usize) -> f32 {
        self.shapes[source].0[0].as_array()[3]
    }

    /// Radiance that the front of `triangle` emits at barycentrics `at` (weights of the second and
    /// third corner).
    pub(crate) fn emission(&self, triangle: u32, at: [f32; 2]) -> Vec3 {
        let [o, t] = self.places[triangle as usize];
        let object = &self.scene.objects[o as usize];
        let material = &self.scene.materials[object.material];
        match &material.emission_texture {
            Some(texture) => {
                material.emission
                    * self.texel(texture, object, t, self.looks[o as usize].mesh_weights(at))
            }
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

    /// Where eight rays met what they met; only the lanes of `live` count.
    #[inline]
    pub(crate) fn points(&self, rays: &[Ray; WIDE], hits: &[Hit; WIDE], live: u32) -> Points8 {
        let facet = |lane: usize| {
            self.facets.get(hits[lane].triangle as usize).unwrap_or(&Facet::NOWHERE).0
        };
        let [[ax, ay, az, slack, bx, by, bz, inverse], [cx, cy, cz, object, nx, ny, nz, source]] =
            eight::columns(facet);
        let (a, ab, ac) =
            (Vec3x8::new(ax, ay, az), Vec3x8::new(bx, by, bz), Vec3x8::new(cx, cy, cz));
        let normal = Vec3x8::new(nx, ny, nz);
        let [origin, way] = eight::split(rays);
        // Weights from the areas of the parts that the point cuts the triangle into; what is left
        // of its distance from the plane drops out, and a ray along the triangle, or past it, stays
        // on it.
        let from_a = way.mul_add(f32x8::from(hits.map(|hit| hit.t)), origin - a);
        let weight = |across: Vec3x8| {
            (across.dot(normal) * inverse).fast_max(f32x8::ZERO).fast_min(f32x8::ONE)
        };
        let at = [weight(from_a.cross(ac)), weight(ab.cross(from_a))];
        let (position, off) = eight::surface_point(a, ab, ac, at, normal, slack);
        let object = object
            .to_array()
            .map(|object| self.colours.get(object.to_bits() as usize).copied().unwrap_or_default());
        let [r, g, b, plain, ..] = f32x8::transpose(object);
        let hit =
            (0..WIDE).fold(0, |mask, lane| mask | u32::from(hits[lane].is_hit()) << lane) & live;
        let plain = plain.to_bitmask() & hit;
        Points8 {
            position,
            off,
            normal,
            back: way * f32x8::splat(-1.0),
            albedo: Vec3x8::new(r, g, b),
            at,
            sources: source,
            plain,
            special: hit & !plain,
            // NaN, no source, is not equal to itself.
            shining: source.simd_eq(source).to_bitmask() & hit,
        }
    }

    /// What is special in lane `lane`, which met `triangle`.
    pub(crate) fn special_point(&self, points: &Points8, lane: usize, triangle: u32) -> Point {
        let plain = points.plain_point(lane);
        let look = &self.looks[self.places[triangle as usize][0] as usize];
        match look.plain {
            Some(bsdf) => Point { bsdf, ..plain },
            None => {
                let weights = look.mesh_weights(points.at(lane));
                let (shading, bsdf) = self.shade(triangle, weights, &plain);
                Point { shading, bsdf, ..plain }
            }
        }
    }

    /// Shading normal and BSDF where they vary over the object.
    fn shade(&self, triangle: u32, weights: [f32; 3], plain: &Point) -> (Vec3, Bsdf) {
        let geometric = plain.geometric;
        let [o, t] = self.places[triangle as usize];
        let (object, look) = (&self.scene.objects[o as usize], &self.looks[o as usize]);
        let (mesh, material) =
            (&self.scene.meshes[object.mesh], &self.scene.materials[object.material]);
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
            shading = aligned(
                (tangent * n.x + bitangent * n.y + shading * n.z).normalize_or(shading),
                geometric,
            );
        }
        let mut base = material.base_colour;
        if let Some(texture) = &material.base_texture {
            base *= self.texel(texture, object, t, weights);
        }
        if !mesh.colours.is_empty() {
            base *= interpolate(corners.map(|i| mesh.colours[i]), weights);
        }
        if let (Some(finish), Some(unwrap)) = (&material.finish, &look.unwrap) {
            let place = unwrap.place(plain.position, shading);
            let seen = finish.at(place.at, self.footprint(plain.position), base);
            let [u, v] = place.axes;
            shading = aligned(
                (shading - seen.slope.x * u - seen.slope.y * v).normalize_or(shading),
                geometric,
            );
            base = seen.colour;
        }
        let packed = match &material.surface {
            Surface::Metallic { texture: Some(texture), .. } => {
                self.texel(texture, object, t, weights)
            }
            _ => Vec3::ONE,
        };
        (shading, Bsdf::new(&material.surface, base, packed))
    }

    /// What a finish at `place` tells, and none where the triangle has none: its appearance with
    /// the material's own colour.
    pub(crate) fn appearance(&self, triangle: u32, place: Vec3) -> Option<Appearance> {
        let look = &self.looks[self.places[triangle as usize][0] as usize];
        let material = self.object_material(triangle);
        let (finish, unwrap) = (material.finish.as_ref()?, look.unwrap?);
        let at = unwrap.place(place, self.normal(triangle)).at;
        Some(finish.at(at, self.footprint(place), material.base_colour))
    }

    /// How much of a face one pixel of the nearest camera covers, m. A function of the place alone,
    /// so that walks of both sides meet the same surface.
    fn footprint(&self, place: Vec3) -> f32 {
        let of = |&(eye, angle): &(Vec3, f32)| (place - eye).length() * angle;
        self.eyes.iter().map(of).reduce(f32::min).unwrap_or(1e-3).clamp(2e-4, 0.02)
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
    fn tangents(
        &self,
        object: &Object,
        look: &Look,
        t: u32,
        texture: &TextureRef,
        normal: Vec3,
        weights: [f32; 3],
    ) -> (Vec3, Vec3) {
        let mesh = &self.scene.meshes[object.mesh];
        let corners = mesh.triangles[t as usize].map(|i| i as usize);
        let linear = Mat3::from_mat4(object.transform);
        let fallback = || {
            let frame = crate::bsdf::Frame::new(normal);
            (frame.x, frame.y)
        };
        if !mesh.tangents.is_empty() {
            let tangent =
                linear * interpolate(corners.map(|i| mesh.tangents[i].truncate()), weights);
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
        // A normal map's +Y is up in the picture, and glTF counts v downward: the bitangent goes
        // with −v.
        let tangent = (e1 * d2.y - e2 * d1.y) / det;
        let bitangent = (e1 * d2.x - e2 * d1.x) / det;
        let x = (tangent - normal * normal.dot(tangent)).try_normalize();
        match x {
            Some(x) if det.abs() > 1e-20 => {
                (x, normal.cross(x) * if normal.cross(x).dot(bitangent) < 0.0 { -1.0 } else { 1.0 })
            }
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
            || material.finish.is_some()
            || matches!(material.surface, Surface::Metallic { texture: Some(_), .. });
        let determinant = linear.determinant();
        // Inverse transpose up to a positive factor; a flat scale has none, and then no normals
        // worth having.
        let normal_matrix =
            if determinant.abs() > 1e-30 { linear.inverse().transpose() } else { Mat3::IDENTITY };
        let plain = (!smooth && !textured)
            .then(|| Bsdf::new(&material.surface, material.base_colour, Vec3::ONE));
        let unwrap = material.finish.as_ref().map(|finish| {
            let placed = |p| object.transform.transform_point3(p);
            let triangles = (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(placed));
            match finish.kind() {
                FinishKind::Broken => Unwrap::of_rough(triangles),
                _ => Unwrap::of(triangles),
            }
        });
        Self { plain, normal_matrix, mirrored: determinant < 0.0, smooth, unwrap }
    }

    /// Red, green, blue and the mask of what is shaded eight at a time.
    fn colour(&self) -> f32x8 {
        let yes = f32::from_bits(u32::MAX);
        match self.plain {
            Some(Bsdf::Lambert { albedo: c }) => {
                f32x8::from([c.x, c.y, c.z, yes, 0.0, 0.0, 0.0, 0.0])
            }
            Some(Bsdf::Black) => f32x8::from([0.0, 0.0, 0.0, yes, 0.0, 0.0, 0.0, 0.0]),
            _ => f32x8::ZERO,
        }
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

/// Steel inside the concrete of its member: no light reaches it, and its triangles would only
/// burden the tree.
fn is_buried(object: &Object, has_concrete: &[bool]) -> bool {
    matches!(object.part, Part::Bar | Part::Stirrup | Part::Tendon)
        && object.member.is_some_and(|m| has_concrete[m])
}

/// The most that a material emits anywhere: only for choosing among lamps, where anything that can
/// shine must have a chance. Once a material, since a texture may have many texels and many
/// triangles.
fn brightest(scene: &Scene, material: &Material) -> Vec3 {
    match &material.emission_texture {
        Some(texture) => {
            material.emission
                * scene.textures[texture.texture].texels.iter().fold(Vec3::ZERO, |a, &b| a.max(b))
        }
        None => material.emission,
    }
}

/// See [`LitScene::scale`].
fn scale(flux: f32, disk_area: f32) -> i32 {
    let radiance = f64::from(flux) / (f64::from(PI) * 4.0 * f64::from(disk_area));
    if radiance.is_normal() {
        (radiance.log2().floor() as i32).clamp(-LARGEST_SCALE, LARGEST_SCALE)
    } else {
        0
    }
}

/// Weights for choosing among lamps: by flux, but with half of all walks for the lamps in the scene
/// and half for the light from beyond, where there are both. The flux of a sky grows with the
/// ground that it lights, and would leave nothing for a lamp in a room.
fn shared(flux: &[f32], sources: &[Source], beams: &[Emitter]) -> Vec<f32> {
    let beyond = |source: &Source| match source {
        Source::Beam(beam) => {
            matches!(beams[*beam as usize], Emitter::Directional { .. } | Emitter::Environment(_))
        }
        Source::Triangle(_) => false,
    };
    let total = |wanted: bool| {
        flux.iter()
            .zip(sources)
            .filter(|(_, s)| beyond(s) == wanted)
            .map(|(f, _)| f)
            .sum::<f32>()
            .max(f32::MIN_POSITIVE)
    };
    let totals = [total(false), total(true)];
    flux.iter().zip(sources).map(|(f, s)| f / totals[usize::from(beyond(s))]).collect()
}
