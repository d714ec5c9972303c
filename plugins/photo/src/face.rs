//! Faces of members, and where on them a place lies: flat ones as they are, round members and
//! linings unrolled.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use intrados_scene::{
    Hit, Member, MemberKind, Ray, Tracer, attach,
    tracer::{Scratch, offset},
};
use intrados_stage::{Cancelled, Job};

/// The concrete surface of a member.
#[derive(Debug)]
pub struct Surface {
    /// Its faces: one that goes all around, or flat ones by name.
    pub faces: Vec<Face>,
    pub(crate) triangles: Vec<[Vec3; 3]>,
    tracer: Tracer,
    start: DVec3,
    axis: DVec3,
    /// Whether the member stands: its ends are a bottom and a top.
    is_upright: bool,
    length: f64,
    zero: DVec3,
    ninety: DVec3,
}

/// A face of a member, as one sees it who stands before it: across to the right, along the axis
/// upwards, both in metres. Along begins at the axis's start; across at the axis, of what goes
/// around at angle 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Front, Right, Back …; "Around" of round members; "Inside" of linings.
    pub name: String,
    /// From and to across, m.
    pub across: [f64; 2],
    /// From and to along, m.
    pub along: [f64; 2],
    /// How it is flattened.
    pub chart: Chart,
}

impl Face {
    /// Half of the way around, m; `None` of flat ones.
    pub(crate) fn half_turn(&self) -> Option<f64> {
        match self.chart {
            Chart::Flat(_) => None,
            Chart::Around(radius) | Chart::Inside(radius) => Some(PI * radius),
        }
    }

    /// A place across on this part of the face: of what goes around, as many turns further as bring
    /// it nearest to the part's middle.
    #[must_use]
    pub(crate) fn turned(&self, across: f64) -> f64 {
        let Some(half) = self.half_turn() else { return across };
        let low = 0.5 * (self.across[0] + self.across[1]) - half;
        low + (across - low).rem_euclid(2.0 * half)
    }
}

/// How a face is flattened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Chart {
    /// By parallel projection against this normal.
    Flat(DVec3),
    /// By the angle about the axis, times this radius (the mean one, m); seen from outside.
    Around(f64),
    /// The same seen from the axis.
    Inside(f64),
}

/// A place of a face on the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) place: Vec3,
    /// How far rounding may have moved it.
    pub(crate) error: Vec3,
    /// Outward.
    pub(crate) normal: DVec3,
}

/// Share of squared cosines between normals and radii from which a member is round: of a polygon of
/// sixteen sides it is .987, of one of eight .95.
const ROUND: f64 = 0.97;
/// Cosine between a flat face's normal and that of what belongs to it.
const OWN: f64 = 0.7;

impl Surface {
    /// `None` where nothing is there.
    pub(crate) fn new(
        member: &Member,
        triangles: Vec<[Vec3; 3]>,
        job: &Job,
    ) -> Result<Option<Self>, Cancelled> {
        let frame = member.frame;
        let length = f64::from(frame.axis.length());
        if triangles.is_empty() || length <= 0.0 || frame.zero == Vec3::ZERO {
            return Ok(None);
        }
        let tracer = Tracer::build_job(&triangles, job)?;
        let axis = frame.axis.as_dvec3() / length;
        let mut surface = Self {
            faces: Vec::new(),
            triangles,
            tracer,
            start: frame.start.as_dvec3(),
            axis,
            is_upright: frame.is_upright(),
            length,
            zero: frame.zero.as_dvec3(),
            ninety: axis.cross(frame.zero.as_dvec3()),
        };
        surface.faces = surface.find_faces(member);
        Ok(Some(surface))
    }

    /// Place on the axis, 0 to 1, and angle about it, degrees, 0 to 360.
    #[must_use]
    pub(crate) fn coordinates(&self, place: DVec3) -> (f64, f64) {
        let p = place - self.start;
        let angle = p.dot(self.ninety).atan2(p.dot(self.zero)).to_degrees().rem_euclid(360.0);
        (p.dot(self.axis) / self.length, angle)
    }

    /// The end of the member that a place is nearer to, as people call it.
    pub(crate) fn end_at(&self, place: DVec3) -> &'static str {
        let is_far = self.coordinates(place).0 > 0.5;
        match (self.is_upright, is_far, is_far == (self.axis.y > 0.0)) {
            (true, _, true) => "top",
            (true, _, false) => "bottom",
            (false, false, _) => "start",
            (false, true, _) => "end",
        }
    }

    /// Unit tangents of a surface with this normal: around the axis to the right as one stands
    /// before it, and along.
    #[must_use]
    pub fn tangents(&self, normal: DVec3) -> [DVec3; 2] {
        let around = self.axis.cross(normal).try_normalize().unwrap_or(self.zero);
        [around, normal.cross(around)]
    }

    /// The face that a place belongs to; `None` of the member's ends.
    #[must_use]
    pub(crate) fn face_of(&self, place: DVec3, normal: DVec3) -> Option<usize> {
        let is_own = |face: &Face| match face.chart {
            Chart::Flat(n) => n.dot(normal) > OWN,
            Chart::Around(_) => normal.dot(self.radial(place)) > 0.0 && self.is_side(normal),
            Chart::Inside(_) => normal.dot(self.radial(place)) < 0.0 && self.is_side(normal),
        };
        self.faces.iter().position(is_own)
    }

    fn is_side(&self, normal: DVec3) -> bool {
        normal.dot(self.axis).abs() < OWN
    }

    fn radial(&self, place: DVec3) -> DVec3 {
        let p = place - self.start;
        (p - p.dot(self.axis) * self.axis).normalize_or_zero()
    }

    /// Where on a face a place lies: across and along, m.
    #[must_use]
    pub fn on_face(&self, face: &Face, place: DVec3) -> [f64; 2] {
        let p = place - self.start;
        let around = |radius: f64, sign: f64| {
            let angle = p.dot(self.ninety).atan2(p.dot(self.zero));
            (sign * angle).rem_euclid(TAU) * radius
        };
        let across = match face.chart {
            Chart::Flat(n) => p.dot(self.axis.cross(n)),
            Chart::Around(radius) => around(radius, 1.0),
            Chart::Inside(radius) => around(radius, -1.0),
        };
        [across, p.dot(self.axis)]
    }

    /// Of all of it but its ends, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let area = |corners: &[Vec3; 3]| {
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let doubled = (b - a).cross(c - a);
            let is_end = doubled.dot(self.axis).abs() > OWN * doubled.length();
            if is_end { 0.0 } else { 0.5 * doubled.length() }
        };
        self.triangles.iter().map(area).sum()
    }

    /// Of the member's axis, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Where in the world places of a face (across, along, m) lie, m, and the unit normals there;
    /// `None` where nothing is.
    #[must_use]
    pub fn places(&self, face: &Face, at: &[[f64; 2]]) -> Vec<Option<[DVec3; 2]>> {
        let spots = self.spots(face, at, &mut Scratch::default());
        spots.into_iter().map(|s| s.map(|s| [s.place.as_dvec3(), s.normal])).collect()
    }

    /// What of the surface lies at places (across, along, m) of a face; `None` where nothing does.
    pub(crate) fn spots(
        &self,
        face: &Face,
        at: &[[f64; 2]],
        scratch: &mut Scratch,
    ) -> Vec<Option<Spot>> {
        let rays: Vec<Ray> = at.iter().map(|at| self.toward(face, *at)).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.tracer.closest(&rays, &mut hits, scratch);
        let spot = |(ray, hit): (&Ray, &Hit)| {
            let corners = self.triangles.get(hit.triangle as usize)?;
            let (place, _, error) = offset::hit_point(corners, ray);
            let outward = normal(corners);
            let way = Vec3::from_array(ray.direction).as_dvec3();
            let normal = if outward.dot(way) > 0.0 { -outward } else { outward };
            let is_own = normal.dot(-way) > OWN * way.length();
            is_own.then_some(Spot { place, error, normal })
        };
        rays.iter().zip(&hits).map(spot).collect()
    }

    /// The ray that meets the surface at a place of a face first.
    fn toward(&self, face: &Face, [across, along]: [f64; 2]) -> Ray {
        let axis = self.start + along * self.axis;
        let radial = |angle: f64| angle.cos() * self.zero + angle.sin() * self.ninety;
        let (origin, way) = match face.chart {
            Chart::Flat(n) => (axis + across * self.axis.cross(n) + self.far() * n, -n),
            Chart::Around(radius) => {
                let radial = radial(across / radius);
                (axis + self.far() * radial, -radial)
            }
            Chart::Inside(radius) => (axis, radial(-across / radius)),
        };
        Ray::new(origin.as_vec3(), way.as_vec3(), f32::INFINITY)
    }

    /// Points at 0, 90, 180 and 270 degrees of both ends.
    pub(crate) fn rims(&self, radius: f64) -> Vec<DVec3> {
        let along = self.extent(|p| p.dot(self.axis));
        let way = [self.zero, self.ninety, -self.zero, -self.ninety];
        along
            .iter()
            .flat_map(|along| way.map(|way| self.start + *along * self.axis + radius * way))
            .collect()
    }

    /// Beyond the surface everywhere, m from the axis.
    fn far(&self) -> f64 {
        let corners = self.triangles.iter().flatten();
        let across = |p: &Vec3| {
            let p = p.as_dvec3() - self.start;
            (p - p.dot(self.axis) * self.axis).length()
        };
        1.0 + corners.map(across).fold(0.0, f64::max)
    }

    fn find_faces(&self, member: &Member) -> Vec<Face> {
        let is_lining = matches!(member.kind, MemberKind::Lining | MemberKind::Segment);
        let along = self.extent(|p| p.dot(self.axis));
        if is_lining || self.roundness() > ROUND {
            let radius = self.radius(is_lining);
            let across = [0.0, TAU * radius];
            let (name, chart) = match is_lining {
                true => ("Inside", Chart::Inside(radius)),
                false => ("Around", Chart::Around(radius)),
            };
            return vec![Face { name: name.into(), across, along, chart }];
        }
        let named = attach::Face::ALL.into_iter().filter_map(|face| {
            let angle = face.angle_deg(member.kind, member.frame).ok()?;
            Some((face.name(), member.frame.radial(angle).as_dvec3()))
        });
        let flat = |(name, n): (&str, DVec3)| {
            let right = self.axis.cross(n);
            let chart = Chart::Flat(n);
            Face { name: name.into(), across: self.extent(|p| p.dot(right)), along, chart }
        };
        named.map(flat).collect()
    }

    fn extent(&self, of: impl Fn(DVec3) -> f64) -> [f64; 2] {
        let values = self.triangles.iter().flatten().map(|p| of(p.as_dvec3() - self.start));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }

    /// Middle, area-weighted normal (m²) of each triangle of the sides.
    fn sides(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.triangles.iter().filter_map(|corners| {
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let area = 0.5 * (b - a).cross(c - a);
            self.is_side(area.normalize_or_zero()).then_some(((a + b + c) / 3.0, area))
        })
    }

    /// Mean of squared cosines between the sides' normals and radii: 1 of a cylinder.
    fn roundness(&self) -> f64 {
        let (mut sum, mut whole) = (0.0, 0.0);
        for (middle, area) in self.sides() {
            sum += area.dot(self.radial(middle)).powi(2) / area.length();
            whole += area.length();
        }
        if whole > 0.0 { sum / whole } else { 0.0 }
    }

    /// Mean radius of the sides that look outward, or inward, m.
    fn radius(&self, inward: bool) -> f64 {
        let (mut sum, mut whole) = (0.0, 0.0);
        for (middle, area) in self.sides() {
            if (area.dot(self.radial(middle)) < 0.0) == inward {
                let p = middle - self.start;
                sum += (p - p.dot(self.axis) * self.axis).length() * area.length();
                whole += area.length();
            }
        }
        if whole > 0.0 { (sum / whole).max(1e-3) } else { 0.5 * self.far() }
    }
}

/// Unit normal of a triangle, outward.
pub(crate) fn normal([a, b, c]: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}
