//! The scene as photographs look at it: what a ray meets, of which member, and what of it is seen
//! from where.

use glam::{DVec3, Vec3};
use intrados_scene::{
    Hit, Part, Ray, Scene, Tracer,
    tracer::{Scratch, offset},
};
use intrados_stage::{Cancelled, Job};

use crate::{Located, Pick, Pose, face::Surface, pose::Covariance};

/// A pick counts as seen while nothing lies between it and the camera up to this share of the
/// distance: models and picks are no more exact.
const NEAR: f64 = 0.01;

/// Surfaces of a scene, and those of its members apart.
#[derive(Debug)]
pub struct Site {
    triangles: Vec<Triangle>,
    tracer: Tracer,
    /// Of each member; `None` where it has no surface of concrete.
    surfaces: Vec<Option<Surface>>,
}

/// A triangle in the world, and whose it is.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    corners: [Vec3; 3],
    member: Option<usize>,
}

/// What a pixel shows of a member.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Index of the member.
    pub member: usize,
    /// Where, m.
    pub place: DVec3,
    /// Unit, out of the surface towards the camera.
    pub normal: DVec3,
    /// On the member's axis, 0 to 1.
    pub along: f64,
    /// About it, degrees, 0 to 360.
    pub angle_deg: f64,
    /// Index of the face among [`Surface::faces`]; `None` of its ends.
    pub face: Option<usize>,
    /// From the camera, m.
    pub distance_m: f64,
    /// Cosine between the normal and the ray: 0 is glancing.
    pub cosine: f64,
    /// mm on the surface that a pixel covers around the axis, and along it.
    pub mm_px: [f64; 2],
}

/// By how much what a pixel shows may be wrong because the pose is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SightError {
    /// Standard error of the place around the axis, and along it, mm.
    pub place_mm: [f64; 2],
    /// Standard errors of [`Sight::mm_px`], as shares.
    pub rel_mm_px: [f64; 2],
}

impl Site {
    /// The surfaces that light meets: concrete and scenery, without what lies in the concrete.
    ///
    /// # Errors
    /// [`Cancelled`] if the job is.
    pub fn new(scene: &Scene, job: &Job) -> Result<Self, Cancelled> {
        let seen =
            scene.objects.iter().filter(|o| matches!(o.part, Part::Concrete | Part::Scenery));
        let triangles: Vec<Triangle> = seen
            .flat_map(|object| {
                let mesh = &scene.meshes[object.mesh];
                let member = object.member.filter(|_| object.part == Part::Concrete);
                let is_mirrored = object.transform.determinant() < 0.0;
                (0..mesh.triangles.len()).map(move |i| {
                    let mut corners = mesh.corners(i).map(|p| object.transform.transform_point3(p));
                    if is_mirrored {
                        corners.swap(1, 2);
                    }
                    Triangle { corners, member }
                })
            })
            .collect();
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.corners).collect();
        let tracer = Tracer::build_job(&corners, job)?;
        let mut own = vec![Vec::new(); scene.members.len()];
        for triangle in &triangles {
            if let Some(list) = triangle.member.and_then(|m| own.get_mut(m)) {
                list.push(triangle.corners);
            }
        }
        let surfaces = scene
            .members
            .iter()
            .zip(own)
            .map(|(member, corners)| Surface::new(member, corners, job))
            .collect::<Result<_, _>>()?;
        Ok(Self { triangles, tracer, surfaces })
    }

    /// The surface of a member; `None` where it has none, or there is no such member.
    #[must_use]
    pub fn surface(&self, member: usize) -> Option<&Surface> {
        self.surfaces.get(member)?.as_ref()
    }

    /// Whether a camera there sees at least half of the places that were picked in its picture, and
    /// not through something. Pass it to [`locate`](crate::locate).
    #[must_use]
    pub fn admits(&self, pose: &Pose, picks: &[Pick]) -> bool {
        let rays: Vec<Ray> = picks
            .iter()
            .map(|pick| {
                let to = pick.place - pose.position;
                Ray::new(pose.position.as_vec3(), to.as_vec3(), (1.0 - NEAR) as f32)
            })
            .collect();
        let mut hidden = vec![false; rays.len()];
        self.tracer.any(&rays, &mut hidden, &mut Scratch::default());
        2 * hidden.iter().filter(|hidden| **hidden).count() <= picks.len()
    }

    /// For each ray from a surface to the camera, whether nothing is between.
    pub(crate) fn are_clear(&self, rays: &[Ray], scratch: &mut Scratch) -> Vec<bool> {
        let mut blocked = vec![false; rays.len()];
        self.tracer.any(rays, &mut blocked, scratch);
        blocked.into_iter().map(|blocked| !blocked).collect()
    }

    /// What places in a picture show; `None` where that is no member.
    #[must_use]
    pub fn sights(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Vec<Option<Sight>> {
        let ray = |pixel: &[f64; 2]| {
            // A ray without direction meets nothing.
            let way = pose.ray(*pixel).unwrap_or(DVec3::ZERO).as_vec3();
            Ray::new(pose.position.as_vec3(), way, f32::INFINITY)
        };
        let rays: Vec<Ray> = pixels.iter().map(ray).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.tracer.closest(&rays, &mut hits, &mut Scratch::default());
        rays.iter().zip(&hits).map(|(ray, hit)| self.sight(pose, ray, *hit)).collect()
    }

    fn sight(&self, pose: &Pose, ray: &Ray, hit: Hit) -> Option<Sight> {
        let triangle = self.triangles.get(hit.triangle as usize)?;
        let member = triangle.member?;
        let surface = self.surface(member)?;
        let place = offset::hit_point(&triangle.corners, ray).0.as_dvec3();
        let to_camera = pose.position - place;
        let distance_m = to_camera.length();
        let outward = normal(&triangle.corners);
        let normal = if outward.dot(to_camera) < 0.0 { -outward } else { outward };
        let [around, along] = surface.tangents(normal);
        let slopes = pose.slopes_by_place(place)?;
        let px_m = |t: DVec3| slopes[0].dot(t).hypot(slopes[1].dot(t));
        let (at, angle_deg) = surface.coordinates(place);
        Some(Sight {
            member,
            place,
            normal,
            along: at,
            angle_deg,
            face: surface.face_of(place, normal),
            distance_m,
            cosine: normal.dot(to_camera) / distance_m,
            mm_px: [around, along].map(|t| 1e3 / px_m(t)),
        })
    }

    /// By how much a sight may be wrong: the covariance of the pose carried to the picture, and
    /// from there to the surface. `None` where the surface is seen edge-on.
    #[must_use]
    pub fn error(&self, located: &Located, sight: &Sight) -> Option<SightError> {
        let tangents = self.surface(sight.member)?.tangents(sight.normal);
        let slopes = located.pose.slopes_by_place(sight.place)?;
        let by_surface =
            nalgebra::Matrix2::from_fn(|i, j| slopes[i].dot(tangents[j])).try_inverse()?;
        let in_picture = located.pixel_covariance(sight.place)?;
        let place = by_surface * in_picture * by_surface.transpose();
        let place_mm = [0, 1].map(|k| 1e3 * place[(k, k)].max(0.0).sqrt());
        let mut rel_mm_px = [0.0; 2];
        for (error, tangent) in rel_mm_px.iter_mut().zip(tangents) {
            *error = scale_error(&located.pose, &located.covariance, sight.place, tangent)?;
        }
        Some(SightError { place_mm, rel_mm_px })
    }
}

/// Unit normal of a triangle, outward.
pub(crate) fn normal([a, b, c]: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// Standard error of the logarithm of pixels a metre along a tangent, by differences.
fn scale_error(pose: &Pose, covariance: &Covariance, place: DVec3, tangent: DVec3) -> Option<f64> {
    let log_px_m = |pose: &Pose| {
        let slopes = pose.slopes_by_place(place)?;
        Some(slopes[0].dot(tangent).hypot(slopes[1].dot(tangent)).ln())
    };
    let distance = pose.position.distance(place);
    let mut gradient = nalgebra::SVector::<f64, { crate::pose::UNKNOWNS }>::zeros();
    for k in 0..crate::pose::UNKNOWNS {
        // k1 is kept in single precision.
        let step = match k {
            3..=5 => 1e-5 * distance,
            7 => 1e-4,
            _ => 1e-5,
        };
        let [to, from] = [step, -step].map(|h| {
            let mut by = [0.0; crate::pose::UNKNOWNS];
            by[k] = h;
            log_px_m(&pose.moved(&by))
        });
        gradient[k] = (to? - from?) / (2.0 * step);
    }
    Some((gradient.transpose() * covariance * gradient)[0].max(0.0).sqrt())
}
