//! Links from where walks are to lamps, pinholes and patches.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use intrados_scene::{Ray, tracer::offset};
use intrados_stage::random::Key;
use intrados_transport::{Links, Side};
use wide::f32x8;

use crate::{
    LightProblem, Rgb,
    bsdf::{Bsdf, Frame, shading_correction, warp},
    eight::{self, Keys8, SEGMENT_END, Vec3x8, WIDE},
    emit::Emitter,
    lit::{Point, Points8, Source, Sources8},
    problem::{Departure, LightStates, Looks},
    sensor::{Patch, Pinhole},
};

/// A link that was found.
struct Found {
    value: Vec3,
    bin: u32,
    /// Density with which it was linked, per sr; infinite where no walk arrives by itself.
    density: f32,
    kernel_density: f32,
    ray: Ray,
}

impl Found {
    fn put(self, row: usize, looks: &mut Looks, links: &mut Links<Rgb>) {
        if self.value.max_element() > 0.0 {
            links.value[row] = self.value.into();
            links.bin[row] = self.bin;
            links.link_density[row] = self.density;
            links.kernel_density[row] = self.kernel_density;
            looks.push(row, self.ray);
        }
    }
}

/// Links of eight plain rows, of which those of `mask` were found.
struct Found8 {
    mask: u32,
    value: Vec3x8,
    bin: [u32; WIDE],
    density: f32x8,
    kernel_density: f32x8,
    /// Origin and direction.
    segment: [Vec3x8; 2],
}

impl Found8 {
    #[inline]
    fn put(&self, block: usize, looks: &mut Looks, links: &mut Links<Rgb>) {
        let mask = self.mask & self.value.largest().simd_gt(f32x8::ZERO).to_bitmask();
        // Rows that found nothing get value 0; special rows come later.
        let mut value = eight::colours(self.value);
        (0..WIDE).for_each(|lane| {
            value[lane] = if mask >> lane & 1 == 1 { value[lane] } else { Rgb::ZERO }
        });
        let all = 0xff >> (WIDE - (links.value.len() - block * WIDE).min(WIDE));
        eight::put(&mut links.value, block, all, value);
        eight::put(&mut links.bin, block, all, self.bin);
        eight::put(&mut links.link_density, block, all, self.density.to_array());
        eight::put(&mut links.kernel_density, block, all, self.kernel_density.to_array());
        looks.push_lanes(block, mask, eight::join(self.segment[0], self.segment[1], SEGMENT_END));
    }
}

/// |cosθ|/π toward `direction`, which is f·cosθ/albedo and the density of going there; 0 on the
/// other side of the surface than `back`.
#[inline]
fn lambert(place: &Points8, direction: Vec3x8) -> f32x8 {
    let (out, cos) = (place.back.dot(place.normal), direction.dot(place.normal));
    (out * cos).simd_gt(f32x8::ZERO).select(cos.abs() * f32x8::splat(FRAC_1_PI), f32x8::ZERO)
}

/// f·cosθ toward `wi`, as the walk of `side` uses it, and the density with which it would go there.
/// 0 where shading and true normal disagree.
#[inline]
pub(crate) fn toward(point: &Point, back: Vec3, wi: Vec3, side: Side) -> (Vec3, f32) {
    let frame = Frame::new(point.shading);
    let (f, pdf) = point.bsdf.eval_pdf(frame.local(back), frame.local(wi), side);
    if point.shading == point.geometric {
        return (f, pdf);
    }
    (f * bent(point, back, wi, side), pdf)
}

/// The factor of a bent normal: 0 where it contradicts the true one, and for the dual Veach's
/// correction.
pub(crate) fn bent(point: &Point, back: Vec3, wi: Vec3, side: Side) -> f32 {
    let correction = shading_correction(back, wi, point.shading, point.geometric);
    match side {
        Side::Dual => correction,
        Side::Primal if correction > 0.0 => 1.0,
        Side::Primal => 0.0,
    }
}

/// Rounding error of coordinates that were computed in a few steps, per axis.
#[inline]
fn rounding(p: Vec3) -> Vec3 {
    p.abs() * (4.0 * f32::EPSILON)
}

/// A ray from a point on a surface to infinity.
#[inline]
pub(crate) fn outward(point: &Point, direction: Vec3) -> Ray {
    let origin = offset::offset_origin(point.position, point.error, point.geometric, direction);
    Ray { origin: origin.into(), t_max: f32::INFINITY, direction: direction.into(), tag: 0 }
}

/// Whether a BSDF has anything but deltas.
#[inline]
fn connects(bsdf: &Bsdf) -> bool {
    !matches!(bsdf, Bsdf::Black | Bsdf::SmoothDielectric { .. })
}

impl LightProblem<'_> {
    pub(crate) fn link_to_lamp(
        &self,
        dimension: u32,
        keys: &[Key],
        states: &mut LightStates,
        links: &mut Links<Rgb>,
    ) {
        let Some(choice) = &self.lit.choice else { return };
        let LightStates { places, points, bins, looks, .. } = states;
        for (block, place) in
            places.iter().enumerate().filter(|(_, place)| place.plain | place.special != 0)
        {
            let keys = Keys8::new(&eight::rows(keys, block));
            let at = keys.pair(dimension + 1);
            let sources = self.lit.sources(choice, keys.unit(dimension), at);
            let simple = place.plain & sources.simple;
            lamp_link(place, &sources, eight::rows(bins, block), simple).put(block, looks, links);
            for lane in eight::lanes((place.plain | place.special) & !simple) {
                let row = block * WIDE + lane;
                let point = if place.plain >> lane & 1 == 1 {
                    place.plain_point(lane)
                } else {
                    points[row]
                };
                let at = at.map(|u| u.as_array()[lane]);
                if let Some(found) = self.special_lamp_link(
                    sources.chosen[lane],
                    at,
                    &point,
                    place.back.lane(lane),
                    bins[row],
                ) {
                    found.put(row, looks, links);
                }
            }
        }
    }

    fn special_lamp_link(
        &self,
        source: usize,
        place: [f32; 2],
        point: &Point,
        back: Vec3,
        bin: u32,
    ) -> Option<Found> {
        if !connects(&point.bsdf) {
            return None;
        }
        let (ray, direction, light, density) = match self.lit.sources[source] {
            Source::Triangle(triangle) => {
                let at = warp::triangle(place);
                let ([lamp, error], normal) =
                    (self.lit.place(triangle, at), self.lit.normal(triangle));
                let to = lamp - point.position;
                let squared = to.length_squared();
                let direction = to / squared.sqrt();
                let density =
                    self.source_density(source, triangle) * squared / -direction.dot(normal);
                if !(density > 0.0 && density.is_finite()) {
                    return None;
                }
                let ray = offset::segment(
                    point.position,
                    point.error,
                    point.geometric,
                    lamp,
                    error,
                    normal,
                );
                (ray, direction, self.lit.emission(triangle, at) / density, density)
            }
            Source::Beam(beam) => {
                let p = self.lit.choice.as_ref()?.probability(source);
                let light = self.lit.beams[beam as usize].toward(point.position, place)?;
                let mut ray = outward(point, light.direction);
                if light.distance.is_finite() {
                    ray.t_max = light.distance * (1.0 - 1e-5);
                }
                let density = if light.delta { f32::INFINITY } else { p * light.pdf };
                (ray, light.direction, light.radiance / (p * light.pdf), density)
            }
        };
        let (f, kernel_density) = toward(point, back, direction, Side::Primal);
        Some(Found { value: f * light, bin, density, kernel_density, ray })
    }

    pub(crate) fn link_to_eye(
        &self,
        eye: &Pinhole,
        first_bin: u32,
        dimension: u32,
        keys: &[Key],
        states: &mut LightStates,
        links: &mut Links<Rgb>,
    ) {
        let LightStates { places, points, departures, looks, .. } = states;
        for (block, place) in places.iter().enumerate() {
            if place.plain != 0 {
                eye_link(place, eye, first_bin).put(block, looks, links);
            }
            for lane in eight::lanes(place.special) {
                let row = block * WIDE + lane;
                if let Some(found) =
                    special_eye_link(&points[row], place.back.lane(lane), eye, first_bin)
                {
                    found.put(row, looks, links);
                }
            }
        }
        for departure in departures {
            let row = departure.row as usize;
            if let Some(found) = self.sky_link(departure, eye, first_bin, dimension, keys[row]) {
                found.put(row, looks, links);
            }
        }
    }

    /// Light from beyond that is seen directly: the pixel is drawn, not the origin.
    fn sky_link(
        &self,
        departure: &Departure,
        eye: &Pinhole,
        first_bin: u32,
        dimension: u32,
        key: Key,
    ) -> Option<Found> {
        let Emitter::Environment(light) = &self.lit.beams[departure.beam as usize] else {
            return None;
        };
        let pixels = eye.width * eye.height;
        let bin = ((key.unit(dimension) * pixels as f32) as u32).min(pixels - 1);
        let direction = eye.direction(bin, key.pair(dimension + 1));
        let p = self.starts_at(self.lit.sky_source());
        let value = light.radiance(direction) * (pixels as f32 / p);
        let ray = Ray::new(eye.position, direction, f32::INFINITY);
        Some(Found {
            value,
            bin: first_bin + bin,
            density: f32::INFINITY,
            kernel_density: 0.0,
            ray,
        })
    }

    pub(crate) fn link_to_patch(
        &self,
        patch: &Patch,
        bin: u32,
        dimension: u32,
        keys: &[Key],
        states: &mut LightStates,
        links: &mut Links<Rgb>,
    ) {
        let LightStates { places, points, departures, looks, .. } = states;
        for (block, place) in
            places.iter().enumerate().filter(|(_, place)| place.plain | place.special != 0)
        {
            let targets = patch.points(Keys8::new(&eight::rows(keys, block)).pair(dimension));
            if place.plain != 0 {
                patch_link(place, patch, targets, bin).put(block, looks, links);
            }
            for lane in eight::lanes(place.special) {
                let row = block * WIDE + lane;
                if let Some(found) = special_patch_link(
                    &points[row],
                    place.back.lane(lane),
                    patch,
                    targets.lane(lane),
                    bin,
                ) {
                    found.put(row, looks, links);
                }
            }
        }
        for departure in departures {
            let row = departure.row as usize;
            if let Some(found) = self.beam_link(
                departure,
                patch,
                bin,
                keys[row].pair(dimension),
                keys[row].pair(dimension + 2),
            ) {
                found.put(row, looks, links);
            }
        }
    }

    /// A lamp that is no surface shines on a patch by itself. Light from beyond arrives so even
    /// where no walk would start for the patch, outside of the scene.
    fn beam_link(
        &self,
        departure: &Departure,
        patch: &Patch,
        bin: u32,
        place: [f32; 2],
        way: [f32; 2],
    ) -> Option<Found> {
        let target = patch.point(place);
        let light = self.lit.beams[departure.beam as usize].toward(target, way)?;
        let cos = light.direction.dot(patch.normal);
        let p = self.starts_at(self.lit.source_of_beam(departure.beam));
        let ray = if light.distance.is_finite() {
            offset::segment(
                target,
                rounding(target),
                patch.normal,
                departure.origin,
                Vec3::ZERO,
                Vec3::ZERO,
            )
        } else {
            Ray::new(
                offset::offset_origin(target, rounding(target), patch.normal, light.direction),
                light.direction,
                f32::INFINITY,
            )
        };
        (cos > 0.0).then_some(Found {
            value: light.radiance * (cos / (p * light.pdf)),
            bin,
            density: f32::INFINITY,
            kernel_density: 0.0,
            ray,
        })
    }
}

#[inline]
fn lamp_link(place: &Points8, sources: &Sources8, bin: [u32; WIDE], simple: u32) -> Found8 {
    let to = sources.point - place.position;
    let squared = to.dot(to);
    let direction = to * (f32x8::ONE / squared.sqrt());
    let density = sources.density * squared / -direction.dot(sources.normal);
    let sane = density.simd_gt(f32x8::ZERO) & density.simd_lt(f32x8::splat(f32::INFINITY));
    let kernel_density = lambert(place, direction);
    let (albedo, light) = (place.albedo, sources.radiance * (kernel_density / density));
    let value = Vec3x8::new(albedo.x * light.x, albedo.y * light.y, albedo.z * light.z);
    let segment = eight::segment(
        place.position,
        place.off,
        place.normal,
        sources.point,
        sources.off,
        sources.normal,
    );
    Found8 { mask: simple & sane.to_bitmask(), value, bin, density, kernel_density, segment }
}

#[inline]
fn eye_link(place: &Points8, eye: &Pinhole, first_bin: u32) -> Found8 {
    let target = Vec3x8::splat(eye.position);
    let to = place.position - target;
    let (seen, bin, response) = eye.see(to);
    let f = lambert(place, to * (f32x8::splat(-1.0) / to.dot(to).sqrt()));
    Found8 {
        mask: place.plain & seen,
        value: place.albedo * (f * response),
        bin: bin.map(|bin| bin.wrapping_add(first_bin)),
        // No walk ever hits the pinhole by itself.
        density: f32x8::splat(f32::INFINITY),
        kernel_density: f32x8::ZERO,
        segment: eight::segment(
            place.position,
            place.off,
            place.normal,
            target,
            f32x8::ZERO,
            Vec3x8::default(),
        ),
    }
}

fn special_eye_link(point: &Point, back: Vec3, eye: &Pinhole, first_bin: u32) -> Option<Found> {
    if !connects(&point.bsdf) {
        return None;
    }
    let to = point.position - eye.position;
    let (bin, response) = eye.sees(to)?;
    let (f, _) = toward(point, back, -to.normalize(), Side::Dual);
    let ray = offset::segment(
        point.position,
        point.error,
        point.geometric,
        eye.position,
        Vec3::ZERO,
        Vec3::ZERO,
    );
    Some(Found {
        value: f * response,
        bin: first_bin + bin,
        density: f32::INFINITY,
        kernel_density: 0.0,
        ray,
    })
}

#[inline]
fn patch_link(place: &Points8, patch: &Patch, target: Vec3x8, bin: u32) -> Found8 {
    let normal = Vec3x8::splat(patch.normal);
    let to = target - place.position;
    let squared = to.dot(to);
    let direction = to * (f32x8::ONE / squared.sqrt());
    let cos = f32x8::ZERO - direction.dot(normal);
    let kernel_density = lambert(place, direction);
    Found8 {
        mask: place.plain & cos.simd_gt(f32x8::ZERO).to_bitmask(),
        // K·g/p with g = 1/A and p = 1/A
        value: place.albedo * (kernel_density * cos / squared),
        bin: [bin; WIDE],
        density: squared / (cos * f32x8::splat(patch.area)),
        kernel_density,
        segment: eight::segment(
            place.position,
            place.off,
            place.normal,
            target,
            eight::rounding(target, normal),
            normal,
        ),
    }
}

fn special_patch_link(
    point: &Point,
    back: Vec3,
    patch: &Patch,
    target: Vec3,
    bin: u32,
) -> Option<Found> {
    if !connects(&point.bsdf) {
        return None;
    }
    let (direction, cos, squared) = patch.seen(point.position, target)?;
    let (f, kernel_density) = toward(point, back, direction, Side::Dual);
    let ray = offset::segment(
        point.position,
        point.error,
        point.geometric,
        target,
        rounding(target),
        patch.normal,
    );
    Some(Found {
        value: f * (cos / squared),
        bin,
        density: squared / (cos * patch.area),
        kernel_density,
        ray,
    })
}
