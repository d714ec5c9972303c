//! The scene as photographs look at it: what a ray meets, of which member, and what of it is seen
//! from where.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use intrados_scene::{
    Hit, Part, Ray, Scene, Tracer,
    tracer::{Scratch, offset},
};
use intrados_stage::{Cancelled, Job};

use crate::{
    Located, Pick, Pose,
    face::{Face, Surface, normal},
    pose::{Covariance, UNKNOWNS},
};

/// A pick counts as seen while nothing lies between it and the camera up to this share of the
/// distance: models and picks are no more exact.
const NEAR: f64 = 0.01;
/// An edge lies in its own surface: what is nearer by less than this share does not hide it.
const BEFORE_EDGE: f64 = 2e-3;
/// Most points of one edge.
const MOST_POINTS: f64 = 16_384.0;
/// Points of the grid along the picture's longer side, by which faces are looked for.
const GRID: f64 = 128.0;
/// Sine of the flattest view that shows anything: 10°.
pub(crate) const FLATTEST: f64 = 0.173_648;

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
    object: u32,
    member: Option<usize>,
}

/// A piece of surface that is smooth: a face of a member, or what of another object looks one way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Piece {
    /// Index of the object.
    pub(crate) object: u32,
    /// Index of the member.
    pub(crate) member: Option<usize>,
    /// Index of the member's face.
    pub(crate) face: Option<usize>,
    /// Of what is no member's face: to which side of the world's axes it looks.
    pub(crate) way: usize,
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

/// A face of a member that a camera sees.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenFace {
    /// Index of the member.
    pub member: usize,
    /// The part of the face within which all lies that is seen of it.
    pub face: Face,
    /// About the middle of what is seen.
    pub middle: Sight,
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
        let objects = (0..).zip(&scene.objects);
        let seen = objects.filter(|(_, o)| matches!(o.part, Part::Concrete | Part::Scenery));
        let triangles: Vec<Triangle> = seen
            .flat_map(|(index, object)| {
                let mesh = &scene.meshes[object.mesh];
                let member = object.member.filter(|_| object.part == Part::Concrete);
                let is_mirrored = object.transform.determinant() < 0.0;
                (0..mesh.triangles.len()).map(move |i| {
                    let mut corners = mesh.corners(i).map(|p| object.transform.transform_point3(p));
                    if is_mirrored {
                        corners.swap(1, 2);
                    }
                    Triangle { corners, object: index, member }
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

    /// Whether a camera there sees the places that were picked in its picture, and not through
    /// something: three quarters of them, since models are not exact. Pass it to
    /// [`locate`](crate::locate).
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
        4 * hidden.iter().filter(|hidden| **hidden).count() <= picks.len()
    }

    /// For each ray from a surface to the camera, whether nothing is between.
    pub(crate) fn are_clear(&self, rays: &[Ray], scratch: &mut Scratch) -> Vec<bool> {
        let mut blocked = vec![false; rays.len()];
        self.tracer.any(rays, &mut blocked, scratch);
        blocked.into_iter().map(|blocked| !blocked).collect()
    }

    /// Points of an edge that the camera sees, no farther apart in the picture than `step_px`.
    pub(crate) fn seen_along(&self, pose: &Pose, [a, b]: &[DVec3; 2], step_px: f64) -> Vec<DVec3> {
        // What an edge is long in the picture, at its nearest.
        let near = [a, b, &(0.5 * (*a + *b))].map(|p| p.distance(pose.position));
        let near = near.into_iter().fold(f64::INFINITY, f64::min).max(0.05);
        let length = pose.focal_px * a.distance(*b) / near;
        let pieces = (length / step_px).ceil().clamp(2.0, MOST_POINTS) as u32;
        let places: Vec<DVec3> = (0..=pieces)
            .map(|k| a.lerp(*b, f64::from(k) / f64::from(pieces)))
            .filter(|place| pose.project(*place).is_some_and(|at| pose.holds(at)))
            .collect();
        let rays: Vec<Ray> = places
            .iter()
            .map(|place| {
                let to = (*place - pose.position).as_vec3();
                Ray::new(pose.position.as_vec3(), to, (1.0 - BEFORE_EDGE) as f32)
            })
            .collect();
        let clear = self.are_clear(&rays, &mut Scratch::default());
        places.into_iter().zip(clear).filter_map(|(place, clear)| clear.then_some(place)).collect()
    }

    /// What places in a picture show; `None` where that is no member.
    #[must_use]
    pub fn sights(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Vec<Option<Sight>> {
        self.looked(pose, pixels, |ray, hit| self.sight(pose, ray, hit))
    }

    /// What `of` makes of the ray through each place in a picture and of what it meets.
    fn looked<T>(
        &self,
        pose: &Pose,
        pixels: &[[f64; 2]],
        of: impl Fn(&Ray, Hit) -> Option<T>,
    ) -> Vec<Option<T>> {
        let ray = |pixel: &[f64; 2]| {
            // A ray without direction meets nothing.
            let way = pose.ray(*pixel).unwrap_or(DVec3::ZERO).as_vec3();
            Ray::new(pose.position.as_vec3(), way, f32::INFINITY)
        };
        let rays: Vec<Ray> = pixels.iter().map(ray).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.tracer.closest(&rays, &mut hits, &mut Scratch::default());
        rays.iter().zip(&hits).map(|(ray, hit)| of(ray, *hit)).collect()
    }

    /// What piece of surface pixels show, and where; `None` where it is nothing or flatter than
    /// 10°.
    pub(crate) fn pieces(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Vec<Option<(Piece, DVec3)>> {
        self.looked(pose, pixels, |ray, hit| {
            let triangle = self.triangles.get(hit.triangle as usize)?;
            let place = offset::hit_point(&triangle.corners, ray).0.as_dvec3();
            let to_camera = (pose.position - place).normalize();
            let outward = normal(&triangle.corners);
            let normal = if outward.dot(to_camera) < 0.0 { -outward } else { outward };
            if normal.dot(to_camera) < FLATTEST {
                return None;
            }
            let surface = triangle.member.and_then(|member| self.surface(member));
            let face = surface.and_then(|surface| surface.face_of(place, normal));
            let size = normal.abs();
            let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            let way =
                if face.is_some() { 0 } else { 1 + 2 * axis + usize::from(normal[axis] < 0.0) };
            Some((Piece { object: triangle.object, member: triangle.member, face, way }, place))
        })
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

    /// Faces that a camera sees less flatly than 10°, each as large as what is seen of it: looked
    /// for on a grid of the picture.
    #[must_use]
    pub fn seen_faces(&self, pose: &Pose) -> Vec<SeenFace> {
        let [width, height] = pose.size.map(f64::from);
        let cell = width.max(height) / GRID;
        let [columns, rows] = [width, height].map(|side| (side / cell).ceil() as u32);
        let middle = |k: u32| (f64::from(k) + 0.5) * cell;
        let pixels: Vec<[f64; 2]> =
            (0..rows).flat_map(|y| (0..columns).map(move |x| [middle(x), middle(y)])).collect();
        let mut seen: BTreeMap<(usize, usize), Vec<Sight>> = BTreeMap::new();
        for sight in self.sights(pose, &pixels).into_iter().flatten() {
            if let Some(face) = sight.face.filter(|_| sight.cosine >= FLATTEST) {
                seen.entry((sight.member, face)).or_default().push(sight);
            }
        }
        seen.into_iter().filter_map(|(of, sights)| self.seen_face(of, &sights, cell)).collect()
    }

    fn seen_face(
        &self,
        (member, index): (usize, usize),
        sights: &[Sight],
        cell: f64,
    ) -> Option<SeenFace> {
        let surface = self.surface(member)?;
        let mut face = surface.faces.get(index)?.clone();
        let mean = sights.iter().map(|s| s.place).sum::<DVec3>() / sights.len() as f64;
        let far = |sight: &&Sight| sight.place.distance_squared(mean);
        let middle = sights.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        // What goes around is cut on the far side of what is seen.
        let seam = surface.on_face(&face, middle.place)[0];
        if let Some(half) = face.half_turn() {
            face.across = [seam - half, seam + half];
        }
        let mut window = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for sight in sights {
            let [across, along] = surface.on_face(&face, sight.place);
            let at = [face.turned(across), along];
            for (k, [low, high]) in window.iter_mut().enumerate() {
                // What lies between the grid's points.
                let margin = 1.5e-3 * cell * sight.mm_px[k];
                (*low, *high) = (low.min(at[k] - margin), high.max(at[k] + margin));
            }
        }
        for (whole, [low, high]) in [&mut face.across, &mut face.along].into_iter().zip(window) {
            *whole = [whole[0].max(low), whole[1].min(high)];
        }
        Some(SeenFace { member, face, middle: *middle })
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

/// Standard error of the logarithm of pixels a metre along a tangent, by differences.
fn scale_error(pose: &Pose, covariance: &Covariance, place: DVec3, tangent: DVec3) -> Option<f64> {
    let log_px_m = |pose: &Pose| {
        let slopes = pose.slopes_by_place(place)?;
        Some(slopes[0].dot(tangent).hypot(slopes[1].dot(tangent)).ln())
    };
    let distance = pose.position.distance(place);
    let mut gradient = nalgebra::SVector::<f64, UNKNOWNS>::zeros();
    for k in 0..UNKNOWNS {
        // k1 is kept in single precision.
        let step = match k {
            3..=5 => 1e-5 * distance,
            7 => 1e-4,
            _ => 1e-5,
        };
        let [to, from] = [step, -step].map(|h| {
            let mut by = [0.0; UNKNOWNS];
            by[k] = h;
            log_px_m(&pose.moved(&by))
        });
        gradient[k] = (to? - from?) / (2.0 * step);
    }
    Some((gradient.transpose() * covariance * gradient)[0].max(0.0).sqrt())
}
