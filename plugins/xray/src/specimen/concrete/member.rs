//! From a scene's member to a recipe.

use glam::{DVec3, Vec3};
use intrados_scene::{
    Assembly, Damage, Frame, Part, Scene, SteelLine, SurfaceDamage,
    structure::{Body, Section},
};

use super::{
    GrowError,
    crack::{HURST, SPAN},
    recipe::{Air, Bar, Crack, Honeycomb, Outline, Recipe, Spall},
};

/// Air of ordinary, sound concrete: share, median diameter in m.
const ORDINARY: (f64, f64) = (0.008, 1e-3);
/// Spread of pore diameters.
const SPREAD: f64 = 0.45;
/// Share of entrapped air.
const ENTRAPPED: f64 = 0.15;
/// Roughness of cracks over 16 mm, m.
pub(super) const ROUGHNESS: f64 = 2e-3;
/// How far the middle of a member's crack `depth` deep (m) leaves its mean plane on its way, root
/// mean square, m: heights at a distance r differ by r^H.
#[must_use]
pub fn wander(depth: f64) -> f64 {
    ROUGHNESS * (depth / SPAN).powf(HURST)
}

/// Largest core, m.
const CORE: f64 = 0.2;

/// Where a specimen was in the world, m: its origin and its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Middle of the scan plane.
    pub origin: DVec3,
    /// Unit x, y, z; z is what the scanner turns about.
    pub axes: [DVec3; 3],
    /// Whether it is a core, not the whole section.
    pub core: bool,
}

impl Place {
    /// From the world to the specimen.
    #[must_use]
    pub fn local(&self, p: Vec3) -> DVec3 {
        self.turned(p.as_dvec3() - self.origin)
    }

    /// A direction of the world in the specimen.
    #[must_use]
    pub fn turned(&self, d: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(d)))
    }
}

/// What a scanner looks at: an assembly whose inside the scene describes, and what has happened to
/// it.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    assembly: &'a Assembly,
    body: &'a Body,
    /// Damage that was planted in it.
    pub planted: &'a [Damage],
    /// Cracks and missing cover that mechanics tells of, of this assembly or of others.
    pub surface: &'a [SurfaceDamage],
}

/// There is nothing of that id whose inside a scanner could look at.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}: only members whose inside the scene describes by measures can be scanned")]
pub struct Opaque(String);

impl<'a> Subject<'a> {
    /// The assembly of that id, with the damage that the scene plants in it.
    ///
    /// # Errors
    /// There is none, or only its surface is known.
    pub fn of(scene: &'a Scene, id: &str) -> Result<Self, Opaque> {
        let assembly = scene.structure.assembly(id);
        let (assembly, body) = assembly
            .and_then(|a| Some((a, a.body.as_ref()?)))
            .ok_or_else(|| Opaque(id.to_owned()))?;
        let planted = scene.members.iter().find(|m| m.id == id).map_or(&[][..], |m| &m.truth);
        Ok(Self { assembly, body, planted, surface: &[] })
    }

    /// Its id.
    #[must_use]
    pub fn id(&self) -> &'a str {
        &self.assembly.id
    }

    /// As on its drawing, before anything happened to it.
    #[must_use]
    pub(crate) fn as_built(self) -> Self {
        Self { planted: &[], surface: &[], ..self }
    }

    /// With what mechanics tells of its surface.
    #[must_use]
    pub fn worn(self, surface: &'a [SurfaceDamage]) -> Self {
        Self { surface, ..self }
    }
}

/// The recipe of what a scanner with a field of view of `field` metres across looks at, at the
/// place `along` of a member: its whole section if it fits, else a core. `height` is how much of
/// the axis is seen, `finest` the voxel's edge (m).
///
/// # Errors
/// The place is not on the member, or the member is too thin.
pub fn of_member(
    member: Subject,
    along: f32,
    field: f64,
    height: f64,
    finest: f64,
    seed: u64,
) -> Result<(Recipe, Place), GrowError> {
    let frame = member.assembly.frame;
    let (length, axis) = (f64::from(frame.axis.length()), frame.axis.normalize_or_zero());
    if !(0.0..=1.0).contains(&along) || length <= 0.0 {
        let what = format!("{}: {along} is no place on its axis, 0 to 1", member.id());
        return Err(GrowError::Bad(what));
    }
    let core = |thickness: f64| {
        Outline::Round(0.5 * CORE.min(0.9 * field)).within_thickness(thickness, height)
    };
    let (zero, ninety) = (frame.zero, frame.ninety());
    let point = frame.point(along);
    // Axes of the specimen, where its origin is, its outline and height.
    let (axes, origin, (outline, height), cored) = match member.body {
        Body::Column { section, .. } | Body::Beam { section, .. } => {
            let whole = match *section {
                Section::Rectangle { width_m, depth_m } => {
                    Outline::Rectangle([0.5 * f64::from(depth_m), 0.5 * f64::from(width_m)])
                }
                Section::Round { diameter_m } => Outline::Round(0.5 * f64::from(diameter_m)),
            };
            // A corner that sticks out by a hundredth does little harm.
            let cored = 2.0 * whole.reach() > 1.03 * field;
            let radius = (0.5 * CORE).min(0.45 * field).min(0.98 * whole.half().min_element());
            let outline = if cored { Outline::Round(radius) } else { whole };
            ([zero, ninety, axis], point, (outline, height), cored)
        }
        // Through the web, across.
        Body::BoxGirder { section, .. } => {
            let (web, at) = (section.web_m, 0.5 * section.bottom_width_m - 0.5 * section.web_m);
            ([axis, zero, ninety], point + at * ninety, core(f64::from(web)), true)
        }
        // Through the lining, radially.
        Body::Tunnel { radius_m, segments, cushion_mm, inner_lining, .. } => {
            let (from, thickness) = match (inner_lining, segments) {
                (Some(lining), _) => (*radius_m, lining.thickness_m),
                (None, Some(segments)) => (*radius_m + cushion_mm / 1000.0, segments.thickness_m),
                (None, None) => {
                    let what = format!("{}: has neither segments nor an inner lining", member.id());
                    return Err(GrowError::Bad(what));
                }
            };
            (
                [axis, -ninety, zero],
                point + (from + 0.5 * thickness) * zero,
                core(f64::from(thickness)),
                true,
            )
        }
    };
    let place = Place {
        origin: origin.as_dvec3(),
        axes: axes.map(|a| a.as_dvec3().normalize_or_zero()),
        core: cored,
    };
    let mut recipe = Recipe::sound(outline, height, finest, seed);
    recipe.bars = bars(&member.assembly.steel, &place, &recipe);
    let world = World { body: member.body, frame, place: &place, along, length };
    member.planted.iter().for_each(|damage| world.plant(damage, &mut recipe));
    // Sound concrete has some air too.
    if recipe.air.is_empty() {
        let [from, to] = [-0.5 * height, 0.5 * height];
        recipe.air.push(Air {
            from,
            to,
            porosity: ORDINARY.0,
            median: ORDINARY.1,
            spread: SPREAD,
            entrapped: 2.0 * ENTRAPPED,
        });
    }
    member
        .surface
        .iter()
        .filter(|d| member.assembly.holds(&d.member))
        .for_each(|d| recipe.tell(d, &place));
    Ok((recipe, place))
}

impl Outline {
    /// A core no longer than what it is drilled from.
    fn within_thickness(self, thickness: f64, height: f64) -> (Self, f64) {
        (self, height.min(thickness))
    }
}

fn bars(steel: &[SteelLine], place: &Place, recipe: &Recipe) -> Vec<Bar> {
    let (reach, end) = (recipe.outline.reach() + 0.05, 0.5 * recipe.height + 0.05);
    let line = |l: &SteelLine| {
        let points: Vec<DVec3> = l.bent().into_iter().map(|p| place.local(p)).collect();
        // Of a tendon's duct, what its strands fill.
        let radius = match &l.prestress {
            Some(p) => (f64::from(p.strands) * f64::from(p.strand_mm2) * 1e-6
                / std::f64::consts::PI)
                .sqrt(),
            None => 0.5 * f64::from(l.diameter),
        };
        let bar =
            Bar { line: near(&points, reach, end), radius, ribbed: l.part == Part::Bar, loss: 0.0 };
        (bar.line.len() > 1 && radius > 0.0).then_some(bar)
    };
    steel.iter().filter_map(line).collect()
}

/// The stretch of a line that comes near the specimen, one point before and after.
fn near(points: &[DVec3], reach: f64, end: f64) -> Vec<DVec3> {
    let meets = |w: &[DVec3]| {
        let (low, high) = (w[0].min(w[1]), w[0].max(w[1]));
        low.x < reach
            && low.y < reach
            && high.x > -reach
            && high.y > -reach
            && low.z < end
            && high.z > -end
    };
    let first = points.windows(2).position(meets);
    let last = points.windows(2).rposition(meets);
    match (first, last) {
        (Some(a), Some(b)) => points[a..=b + 1].to_vec(),
        _ => Vec::new(),
    }
}

struct World<'a> {
    body: &'a Body,
    frame: Frame,
    place: &'a Place,
    along: f32,
    length: f64,
}

impl World<'_> {
    /// Heights between two places on the member's axis; a core that lies across is at one place.
    fn range(&self, from: f32, to: f32, recipe: &Recipe) -> Option<[f64; 2]> {
        let half = 0.5 * recipe.height;
        if self.along_axis() {
            let z = |a: f32| f64::from(a - self.along) * self.length;
            let (from, to) = (z(from).max(-half), z(to).min(half));
            (from < to).then_some([from, to])
        } else {
            (from..=to).contains(&self.along).then_some([-half, half])
        }
    }

    /// Whether the specimen's axis is the member's.
    fn along_axis(&self) -> bool {
        self.place.axes[2].dot(self.frame.axis.normalize_or_zero().as_dvec3()) > 0.9
    }

    /// A point of the member's surface, and the direction out there.
    fn surface(&self, along: f32, angle_deg: f32) -> (DVec3, DVec3) {
        let out = self.frame.radial(angle_deg);
        let far = match self.body {
            Body::Column { section, .. } | Body::Beam { section, .. } => match *section {
                Section::Round { diameter_m } => 0.5 * diameter_m,
                Section::Rectangle { width_m, depth_m } => {
                    // Where the ray in that direction leaves the rectangle.
                    let (c, s) =
                        (out.dot(self.frame.zero).abs(), out.dot(self.frame.ninety()).abs());
                    (0.5 * depth_m / c.max(1e-6)).min(0.5 * width_m / s.max(1e-6))
                }
            },
            Body::BoxGirder { section, .. } => 0.5 * section.bottom_width_m,
            // The intrados, seen from the axis, looks inward.
            Body::Tunnel { radius_m, .. } => *radius_m,
        };
        let sign = if matches!(self.body, Body::Tunnel { .. }) { -1.0 } else { 1.0 };
        (
            self.place.local(self.frame.point(along) + far * out),
            self.place.turned(sign * out.as_dvec3()),
        )
    }

    /// How far it is through the member from a point of its surface.
    fn through(&self, angle_deg: f32) -> f64 {
        match self.body {
            Body::Column { section, .. } | Body::Beam { section, .. } => match *section {
                Section::Round { diameter_m } => f64::from(diameter_m),
                Section::Rectangle { .. } => {
                    let (p, _) = self.surface(self.along, angle_deg);
                    2.0 * p.truncate().length()
                }
            },
            Body::BoxGirder { section, .. } => f64::from(section.web_m),
            Body::Tunnel { inner_lining, segments, .. } => {
                let lining = inner_lining
                    .as_ref()
                    .map(|l| l.thickness_m)
                    .or(segments.as_ref().map(|s| s.thickness_m));
                f64::from(lining.unwrap_or(0.3))
            }
        }
    }

    fn plant(&self, damage: &Damage, recipe: &mut Recipe) {
        match *damage {
            Damage::Voids { from, to, porosity, median_mm } => {
                if let Some([from, to]) = self.range(from, to, recipe).filter(|_| porosity > 0.0) {
                    let median = 1e-3 * f64::from(median_mm);
                    recipe.air.push(Air {
                        from,
                        to,
                        porosity: f64::from(porosity),
                        median,
                        spread: SPREAD,
                        entrapped: ENTRAPPED,
                    });
                }
            }
            Damage::Honeycomb { along, length_m, porosity } => {
                let half = (0.5 * f64::from(length_m) / self.length) as f32;
                if let Some([from, to]) =
                    self.range(along - half, along + half, recipe).filter(|_| porosity > 0.0)
                {
                    recipe.honeycombs.push(Honeycomb { from, to, porosity: f64::from(porosity) });
                }
            }
            Damage::Corrosion { from, to, section_loss } => {
                if self.range(from, to, recipe).is_some() {
                    recipe.bars.iter_mut().for_each(|bar| bar.loss = f64::from(section_loss));
                }
            }
            Damage::Crack { along, width_mm, depth, angle_deg } => {
                let (mouth, outward) = self.surface(along, angle_deg);
                let normal = self.place.turned(self.frame.axis.as_dvec3()).normalize_or_zero();
                let inward = -outward;
                let depth = f64::from(depth) * self.through(angle_deg);
                // Far from the specimen it is not seen.
                let reach =
                    if self.along_axis() { 0.5 * recipe.height } else { recipe.outline.reach() }
                        + 0.03;
                if mouth.dot(normal).abs() < reach && depth > 0.0 && width_mm > 0.0 {
                    let width = 1e-3 * f64::from(width_mm);
                    recipe.cracks.push(Crack {
                        mouth,
                        normal,
                        inward,
                        depth,
                        width,
                        round: true,
                        roughness: ROUGHNESS,
                    });
                }
            }
            Damage::Spall { along, angle_deg, diameter_m, depth_m } => {
                let (centre, outward) = self.surface(along, angle_deg);
                let reach = 0.5 * recipe.height + 0.5 * f64::from(diameter_m);
                if centre.z.abs() < reach {
                    recipe.spalls.push(Spall {
                        centre,
                        outward,
                        radius: 0.5 * f64::from(diameter_m),
                        depth: f64::from(depth_m),
                    });
                }
            }
            // Nothing that X-rays see.
            Damage::Softened { .. } => {}
        }
    }
}
