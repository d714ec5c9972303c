//! Cross-sections of a member drawn from its planted truth, until a scanner makes them. *Drawn, not
//! scanned.*
//!
//! Everything happens in the image: no photon flies. The statistics are those of real slices of
//! mortar (sizes of pores, edge of a pore, correlation of the noise), so that detection meets what
//! it will meet; and because the picture is made from the truth, the truth mask is exact. The label
//! convention is that of the people who label: a pore is where the noise-free, blurred picture is
//! more than .08 darker than the matrix.

use glam::Vec3;
use intrados_raster::grid::{Grid, Mask};
use intrados_scene::{Damage, Frame, Member, Object, Part, Scene};
use intrados_stage::{
    Job,
    random::{Draw, Key},
};
use intrados_xray::specimen::concrete::wander;

use crate::{crack::Crack, slice::Slice};

/// What marks a drawn slice wherever a user sees it.
pub const MARK: &str = "drawn, not scanned";

/// Side of a drawn slice, pixels.
pub(crate) const SIDES: std::ops::RangeInclusive<u32> = 32..=4096;

/// Most drawn slices of one core.
pub(crate) const MOST_SLICES: u32 = 1000;

/// Darkness of the noise-free picture from which a pixel counts as pore.
const LABEL_LEVEL: f32 = 0.08;
/// How far below the matrix a pixel full of air lies, as in the slices that the statistics come
/// from.
const AIR_DROP: f32 = 0.44;
/// Standard deviation of the point spread, pixels.
const POINT_SPREAD: f32 = 0.3;
/// Standard deviation of the noise.
const NOISE: f32 = 0.028;
/// Air of ordinary, sound concrete: area share, and median diameter in mm.
const ORDINARY: (f64, f64) = (0.008, 1.0);
/// Standard deviation of the logarithm of pore radii.
const SIZE_SPREAD: f64 = 0.62;

/// One drawn slice and what is truly in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// The picture.
    pub slice: Slice,
    /// Pores and cracks, exactly.
    pub truth: Mask,
    /// True pore area / body area, cracks excluded.
    pub porosity: f64,
    /// True cracks.
    pub cracks: Vec<Crack>,
    /// Body area, pixels.
    pub body_area: usize,
}

/// Which slice of how many, how large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Number of the slice, from 0.
    pub index: u32,
    /// How many there are, evenly along the axis.
    pub count: u32,
    /// Pixels across the square slice.
    pub size: u32,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
    /// Seed.
    pub seed: u64,
}

impl Request {
    /// Refuses what cannot be drawn.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> Result<(), DrawError> {
        match () {
            () if !SIDES.contains(&self.size) => Err(DrawError::Size { size: self.size }),
            () if !(self.pixel_mm.is_finite() && self.pixel_mm > 0.0) => {
                Err(DrawError::Pixel(self.pixel_mm))
            }
            () if !(1..=MOST_SLICES).contains(&self.count) => Err(DrawError::Count(self.count)),
            () if self.index >= self.count => {
                Err(DrawError::Index { index: self.index, count: self.count })
            }
            () => Ok(()),
        }
    }

    /// A slice at a place on the axis, 0 to 1, to a thousandth.
    pub fn at(along: f64, size: u32, pixel_mm: f32) -> Self {
        let count = MOST_SLICES;
        let index = (along * f64::from(count)).clamp(0.0, f64::from(count) - 1.0) as u32;
        Self { index, count, size, pixel_mm, seed: 0 }
    }

    /// Place on the axis, 0 to 1: the middle of the slice's share.
    #[must_use]
    pub fn along(&self) -> f64 {
        (f64::from(self.index) + 0.5) / f64::from(self.count)
    }
}

/// Why no slice is drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DrawError {
    /// So many pixels across.
    #[error("drawn slices are {} to {} pixels across, not {size}", SIDES.start(), SIDES.end())]
    Size {
        /// How many.
        size: u32,
    },
    /// An edge of a pixel (mm) that is none.
    #[error("the edge of a pixel must be above 0 mm, not {0}")]
    Pixel(f32),
    /// So many slices.
    #[error("1 to {MOST_SLICES} slices of a core are drawn, not {0}")]
    Count(u32),
    /// A slice (from 0) that is not among them.
    #[error("slice {} of {count}", index + 1)]
    Index {
        /// Its number.
        index: u32,
        /// How many there are.
        count: u32,
    },
    /// There is no member of this number.
    #[error("no member {0}")]
    Member(usize),
}

/// Draws one cross-section of member `index` of the scene.
///
/// The outline is where the member's concrete and the section's plane meet, with its bars where
/// they pierce it. A section that does not fit into the picture shows as a round core, drilled
/// where there is most concrete around, whatever was planted. A slice shows what its own plane
/// meets and nothing beside it. Cracks lie across the axis as the sections do: one is drawn where
/// the plane lies no farther from it than its rough surface wanders, which is then taken to meet
/// the section in a line; it starts from the outer surface, or from the inner one of a hollow
/// section. Stiffness that is lost without a trace in the picture (`Softened`) is not drawn.
///
/// # Errors
/// The request cannot be drawn, or there is no such member.
pub fn draw(scene: &Scene, index: usize, request: Request) -> Result<Drawn, DrawError> {
    request.check()?;
    let member = scene.members.get(index).ok_or(DrawError::Member(index))?;
    let mut dice = Draw::coarse(Key::new(request.seed, u64::from(request.index)));
    let mut section = Section::of(scene, index, member, request);
    section.place();
    let mut body = section.body();
    let mut bars = section.discs(scene, index, &[Part::Bar, Part::Tendon]);
    let mut pores = Discs::default();
    let ordinary = body.count() as f64;
    pores.scatter(&mut dice, &body, ORDINARY.0 * ordinary, section.px(ORDINARY.1) / 2.0);
    let mut cracks = Vec::new();
    for damage in &member.truth {
        match *damage {
            Damage::Voids { from, to, porosity, median_mm }
                if (from..=to).contains(&(request.along() as f32)) =>
            {
                pores.scatter(
                    &mut dice,
                    &body,
                    boolean(porosity) * body.count() as f64,
                    section.px(f64::from(median_mm)) / 2.0,
                );
            }
            Damage::Honeycomb { along, length_m, porosity } if section.reaches(along, length_m) => {
                let nest = section.nest(&mut dice, &body);
                pores.scatter(
                    &mut dice,
                    &nest,
                    boolean(porosity) * nest.count() as f64,
                    section.px(4.0).max(3.0) / 2.0,
                );
            }
            Damage::Spall { along, angle_deg, diameter_m, depth_m }
                if section.reaches(along, diameter_m) =>
            {
                section.spall(&mut body, along, angle_deg, diameter_m, depth_m);
            }
            Damage::Crack { along, width_mm, depth, angle_deg } => {
                cracks.extend(section.crack(&mut dice, along, width_mm, depth, angle_deg));
            }
            Damage::Corrosion { from, to, section_loss }
                if (from..=to).contains(&(request.along() as f32)) =>
            {
                bars.iter_mut().for_each(|bar| {
                    bar.radius *= f64::from(1.0 - section_loss.clamp(0.0, 1.0)).sqrt()
                });
            }
            _ => {}
        }
    }
    Ok(render(&mut dice, request, body, &bars, &pores, &cracks))
}

/// A section as it was designed, in the pixels of a slice: nothing of what was planted is in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The concrete with its steel.
    pub body: Mask,
    /// Areas of the bars that pierce it, pixels.
    pub bars: Vec<f64>,
    /// Tendons that pierce it.
    pub tendons: usize,
}

/// The whole designed section of member `index` where a slice lies; `None` if it does not fit into
/// a picture of that size, which then shows a core, or if there is no such member.
pub(crate) fn designed(scene: &Scene, index: usize, request: Request) -> Option<Design> {
    let mut section = Section::of(scene, index, scene.members.get(index)?, request);
    if !section.centred() {
        return None;
    }
    let area = |disc: Disc| std::f64::consts::PI * disc.radius * disc.radius;
    let bars = section.discs(scene, index, &[Part::Bar]).into_iter().map(area).collect();
    Some(Design {
        body: section.body(),
        bars,
        tendons: section.discs(scene, index, &[Part::Tendon]).len(),
    })
}

/// Width and height of the box around the section of member `index` at a place on its axis (0 to
/// 1), mm; `None` if there is no such member.
pub(crate) fn extent_mm(scene: &Scene, index: usize, along: f64) -> Option<[f64; 2]> {
    let section = Section::of(
        scene,
        index,
        scene.members.get(index)?,
        Request::at(along, *SIDES.start(), 1.0),
    );
    let [low, high] = section.corners();
    Some([0, 1].map(|k| high[k] - low[k]))
}

/// Area of discs, per area, that leaves the share `porosity` covered when they fall at random and
/// overlap (the Boolean model).
fn boolean(porosity: f32) -> f64 {
    -(1.0 - f64::from(porosity.clamp(0.0, 0.9))).ln()
}

/// The section of a member in the pixels of a slice. Up in the picture is up in the world; of an
/// upright member it is 90 degrees, with 0 to the right. Angles turn anticlockwise.
struct Section {
    size: usize,
    pixel_mm: f64,
    frame: Frame,
    /// Unit, to the right and up in the picture.
    right: Vec3,
    up: Vec3,
    /// Place on the axis, 0 to 1.
    along: f64,
    /// Where the axis pierces the picture.
    axis: [f64; 2],
    /// The outline as pieces of line, unordered.
    outline: Vec<[[f64; 2]; 2]>,
    /// Whether the whole section fits into the picture.
    whole: bool,
}

impl Section {
    fn of(scene: &Scene, index: usize, member: &Member, request: Request) -> Self {
        let usable = member.frame.axis.length() > 0.0 && member.frame.zero.length() > 0.5;
        let frame = if usable { member.frame } else { Frame::of_box(member.kind, member.bounds) };
        let axis = frame.axis.normalize_or_zero();
        let lies = axis.y.abs() < 0.7;
        let up = if lies { (Vec3::Y - axis.y * axis).normalize_or_zero() } else { frame.ninety() };
        let mut section = Self {
            size: request.size as usize,
            pixel_mm: f64::from(request.pixel_mm),
            frame,
            // As 90 degrees is axis × 0 degrees.
            right: up.cross(axis),
            up,
            along: request.along(),
            axis: [0.0; 2],
            outline: Vec::new(),
            whole: true,
        };
        let concrete =
            scene.objects.iter().filter(|o| o.member == Some(index) && o.part == Part::Concrete);
        section.outline = concrete.flat_map(|object| section.pierced(scene, object)).collect();
        if section.outline.is_empty() {
            section.outline = section.of_box(member);
        }
        section
    }

    /// Millimetres in pixels.
    fn px(&self, mm: f64) -> f64 {
        mm / self.pixel_mm
    }

    /// Half the picture.
    fn middle(&self) -> f64 {
        0.5 * self.size as f64
    }

    /// A direction about the axis in the picture.
    fn direction(&self, angle_deg: f32) -> [f64; 2] {
        let radial = self.frame.radial(angle_deg);
        [f64::from(radial.dot(self.right)), -f64::from(radial.dot(self.up))]
    }

    /// A point in the picture, relative to the axis, and its distance in front of the section's
    /// plane, both in pixels.
    fn seen(&self, point: Vec3) -> ([f64; 2], f64) {
        let from = point - self.frame.point(self.along as f32);
        let mm = |direction: Vec3| self.px(1e3 * f64::from(from.dot(direction)));
        (
            [mm(self.right) + self.axis[0], -mm(self.up) + self.axis[1]],
            mm(self.frame.axis.normalize_or_zero()),
        )
    }

    /// Where the triangles of an object cross the section's plane.
    fn pierced(&self, scene: &Scene, object: &Object) -> Vec<[[f64; 2]; 2]> {
        let Some(mesh) = scene.meshes.get(object.mesh) else { return Vec::new() };
        let piece = |triangle: usize| {
            let corners =
                mesh.corners(triangle).map(|p| self.seen(object.transform.transform_point3(p)));
            let mut points = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(a, b)| {
                let ((p, above), (q, below)) = (corners[a], corners[b]);
                let t = above / (above - below);
                ((above < 0.0) != (below < 0.0))
                    .then(|| [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])])
            });
            Some([points.next()?, points.next()?])
        };
        (0..mesh.triangles.len()).filter_map(piece).collect()
    }

    /// The outline of a member without a mesh: its box or, judged by its volume, the ellipse in it.
    fn of_box(&self, member: &Member) -> Vec<[[f64; 2]; 2]> {
        let [low, high] = member.bounds;
        let corners = [self.seen(low).0, self.seen(high).0];
        let (middle, half) = (
            [0, 1].map(|k| 0.5 * (corners[0][k] + corners[1][k])),
            [0, 1].map(|k| 0.5 * (corners[0][k] - corners[1][k]).abs()),
        );
        let share = member.volume / f64::from((high - low).element_product()).max(1e-12);
        let round = (share - std::f64::consts::FRAC_PI_4).abs() < 0.04;
        let corner = |n: usize| {
            let (sin, cos) = (std::f64::consts::TAU * (n as f64 + 0.5)
                / if round { 90.0 } else { 4.0 })
            .sin_cos();
            let stretch = if round { 1.0 } else { std::f64::consts::SQRT_2 };
            [middle[0] + stretch * half[0] * cos, middle[1] + stretch * half[1] * sin]
        };
        (0..if round { 90 } else { 4 }).map(|n| [corner(n), corner(n + 1)]).collect()
    }

    /// The box around the outline.
    fn corners(&self) -> [[f64; 2]; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (k, p) in self.outline.iter().flatten().flat_map(|p| [(0, p[0]), (1, p[1])]) {
            low[k] = low[k].min(p);
            high[k] = high[k].max(p);
        }
        [low, high]
    }

    /// Moves the outline into the middle of the picture if all of it fits there, and says whether
    /// it does.
    fn centred(&mut self) -> bool {
        let [low, high] = self.corners();
        self.whole = (0..2).all(|k| high[k] - low[k] <= 0.98 * self.size as f64);
        if self.whole {
            self.shift([0, 1].map(|k| 0.5 * (low[k] + high[k])));
        }
        self.whole
    }

    /// Moves the outline into the picture: all of it where it fits, else the place where a core is
    /// drilled.
    fn place(&mut self) {
        if !self.centred() {
            let [low, high] = self.corners();
            self.shift(self.drilled(low, high));
        }
    }

    /// Moves a point to the middle of the picture, and all else with it.
    fn shift(&mut self, centre: [f64; 2]) {
        let shift = centre.map(|c| self.middle() - c);
        self.axis = [self.axis[0] + shift[0], self.axis[1] + shift[1]];
        self.outline.iter_mut().flatten().for_each(|p| *p = [p[0] + shift[0], p[1] + shift[1]]);
    }

    /// The place with most concrete around.
    fn drilled(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        const STEPS: usize = 48;
        let place = |n: usize| {
            [0, 1].map(|k| {
                low[k]
                    + (high[k] - low[k]) * ([n % STEPS, n / STEPS][k] as f64 + 0.5) / STEPS as f64
            })
        };
        let cells = Mask {
            width: STEPS,
            height: STEPS,
            data: (0..STEPS * STEPS).map(|n| self.is_inside(place(n))).collect(),
        };
        let depth = cells.distance();
        let best = (0..STEPS * STEPS)
            .max_by(|&a, &b| depth.data[a].total_cmp(&depth.data[b]).then(b.cmp(&a)));
        place(best.unwrap_or(0))
    }

    /// Whether a point lies in concrete (even-odd rule).
    fn is_inside(&self, [x, y]: [f64; 2]) -> bool {
        let crossed = |[a, b]: &&[[f64; 2]; 2]| {
            (a[1] <= y) != (b[1] <= y) && a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x
        };
        self.outline.iter().filter(crossed).count() % 2 == 1
    }

    /// The body in the picture: the section, or the round core of it.
    fn body(&self) -> Mask {
        let mut body = Mask::new(self.size, self.size, false);
        for (row, y) in body.data.chunks_mut(self.size).zip(0..) {
            let y = f64::from(y) + 0.5;
            let across = self.outline.iter().filter(|[a, b]| (a[1] <= y) != (b[1] <= y));
            let mut crossings: Vec<f64> =
                across.map(|[a, b]| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])).collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let at = |x: f64| (x - 0.5).ceil().clamp(0.0, self.size as f64) as usize;
                row[at(pair[0])..at(pair[1])].fill(true);
            }
        }
        let in_core = |i: usize| {
            let (x, y) = self.offset(i, [self.middle(); 2]);
            x.hypot(y) <= 0.45 * self.size as f64
        };
        if !self.whole {
            (0..body.data.len()).for_each(|i| body.data[i] &= in_core(i));
        }
        if !body.data.contains(&true) {
            body.data = (0..body.data.len()).map(in_core).collect();
        }
        body
    }

    /// From a point to the centre of pixel `i`.
    fn offset(&self, i: usize, from: [f64; 2]) -> (f64, f64) {
        ((i % self.size) as f64 + 0.5 - from[0], (i / self.size) as f64 + 0.5 - from[1])
    }

    /// Whether a damage of a given length, centred at `along`, reaches this slice.
    fn reaches(&self, along: f32, length_m: f32) -> bool {
        self.away_mm(along) <= 0.5e3 * f64::from(length_m)
    }

    fn away_mm(&self, along: f32) -> f64 {
        (self.along - f64::from(along)).abs() * 1e3 * f64::from(self.frame.axis.length())
    }

    /// The concrete along the ray from the axis at an angle: of a solid section from its surface
    /// through the axis to the other side, of a hollow one from its inner face (the intrados)
    /// outward. `None` where the ray meets no concrete.
    fn wall(&self, angle_deg: f32) -> Option<Wall> {
        const STEP: f64 = 0.5;
        let [dx, dy] = self.direction(angle_deg);
        let at = |t: f64| [self.axis[0] + t * dx, self.axis[1] + t * dy];
        let reach = self
            .outline
            .iter()
            .flatten()
            .map(|p| (p[0] - self.axis[0]).hypot(p[1] - self.axis[1]))
            .fold(0.0, f64::max);
        let steps = (reach / STEP).ceil().min(1e5) as usize + 1;
        let solid = |t: f64| self.is_inside(at(t));
        let first = (0..steps).map(|n| n as f64 * STEP).find(|&t| solid(t))?;
        let end = |from: f64, step: f64| {
            (1..steps * 2).map(|n| from + n as f64 * step).find(|&t| !solid(t)).unwrap_or(from)
        };
        let out = end(first, STEP);
        if first > 0.0 {
            return Some(Wall { from: at(first), inward: [dx, dy], length: out - first });
        }
        Some(Wall { from: at(out), inward: [-dx, -dy], length: out - end(0.0, -STEP) })
    }

    /// Where bars or tendons pierce the section, as discs of the same area.
    fn discs(&self, scene: &Scene, member: usize, parts: &[Part]) -> Vec<Disc> {
        let objects =
            scene.objects.iter().filter(|o| o.member == Some(member) && parts.contains(&o.part));
        let disc = |object: &Object| {
            let pieces = self.pierced(scene, object);
            let n = 2.0 * pieces.len() as f64;
            let [x, y] =
                pieces.iter().flatten().fold([0.0, 0.0], |s, p| [s[0] + p[0] / n, s[1] + p[1] / n]);
            let reach =
                pieces.iter().flatten().map(|p| (p[0] - x).hypot(p[1] - y)).fold(0.0, f64::max);
            let wedge = |[a, b]: &[[f64; 2]; 2]| {
                0.5 * ((a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x)).abs()
            };
            let radius = (pieces.iter().map(wedge).sum::<f64>() / std::f64::consts::PI).sqrt();
            // A bar that lies in the plane shows its length, not its section.
            (!pieces.is_empty() && reach <= self.px(60.0)).then_some(Disc { x, y, radius })
        };
        objects.filter_map(disc).collect()
    }

    /// The part of the body where the concrete was badly compacted: around any of its pixels.
    fn nest(&self, dice: &mut Draw, body: &Mask) -> Mask {
        let place: Vec<usize> = (0..body.data.len()).filter(|&i| body.data[i]).collect();
        let centre = place.get((dice.unit() * place.len() as f64) as usize).copied().unwrap_or(0);
        let (cx, cy) = self.offset(centre, [0.0; 2]);
        let radius = 0.25 * (place.len() as f64).sqrt();
        let inside = |i: usize| {
            let (x, y) = self.offset(i, [cx, cy]);
            body.data[i] && x.hypot(y) <= radius
        };
        Mask { data: (0..body.data.len()).map(inside).collect(), ..*body }
    }

    /// Takes a dish out of the body's side.
    fn spall(&self, body: &mut Mask, along: f32, angle_deg: f32, diameter_m: f32, depth_m: f32) {
        let Some(wall) = self.wall(angle_deg) else { return };
        let radius = 0.5e3 * f64::from(diameter_m);
        let share = (1.0 - (self.away_mm(along) / radius.max(1e-6)).powi(2)).max(0.0).sqrt();
        let (half, depth) = (self.px(radius) * share, self.px(1e3 * f64::from(depth_m)) * share);
        for i in 0..body.data.len() {
            let (x, y) = self.offset(i, wall.from);
            let (deep, side) =
                (x * wall.inward[0] + y * wall.inward[1], y * wall.inward[0] - x * wall.inward[1]);
            let dish = depth * (1.0 - (side / half.max(1e-6)).powi(2));
            body.data[i] &= !((-half..dish).contains(&deep) && side.abs() < half);
        }
    }

    /// A rough line from the surface inward, over `depth` of the wall; `None` where the crack
    /// passes in front of the section or behind it.
    fn crack(
        &self,
        dice: &mut Draw,
        along: f32,
        width_mm: f32,
        depth: f32,
        angle_deg: f32,
    ) -> Option<Line> {
        const STEP: f64 = 4.0;
        let wall = self.wall(angle_deg)?;
        let [dx, dy] = wall.inward;
        let run = f64::from(depth.clamp(0.0, 1.0)) * wall.length;
        if self.away_mm(along) > 1e3 * wander(1e-3 * self.pixel_mm * run) {
            return None;
        }
        let (mut side, mut slope, mut points) = (0.0, 0.0, Vec::new());
        for n in 0..=(run / STEP).ceil() as usize {
            let deep = (n as f64 * STEP).min(run);
            points
                .push([wall.from[0] + deep * dx - side * dy, wall.from[1] + deep * dy + side * dx]);
            // A slope with a memory of some ten steps, pulled back to the line: rough, and yet it
            // arrives.
            slope = 0.85 * slope + 0.22 * dice.normal() - 0.004 * side;
            side += STEP * slope.clamp(-1.0, 1.0);
        }
        Some(Line { points, width: self.px(f64::from(width_mm.max(0.0))) })
    }
}

/// Concrete between two faces, pixels.
struct Wall {
    /// On the face that people see.
    from: [f64; 2],
    /// Unit, into the concrete.
    inward: [f64; 2],
    length: f64,
}

/// A round pore or bar, pixels.
struct Disc {
    x: f64,
    y: f64,
    radius: f64,
}

#[derive(Default)]
struct Discs(Vec<Disc>);

impl Discs {
    /// Adds pores in `place` until their discs have `area` pixels together. Radii of the spheres
    /// are lognormal about `median`, and the plane cuts each anywhere.
    fn scatter(&mut self, dice: &mut Draw, place: &Mask, area: f64, median: f64) {
        const MOST: usize = 200_000;
        let mut left = area;
        for _ in 0..MOST {
            if left <= 0.0 {
                return;
            }
            let (x, y) = (dice.unit() * place.width as f64, dice.unit() * place.height as f64);
            let largest = (0.1 * place.width as f64).max(2.0 * median);
            let sphere = (median.max(0.3) * (SIZE_SPREAD * dice.normal()).exp()).min(largest);
            let cut = dice.between(-1.0, 1.0);
            if place.data[y as usize * place.width + x as usize] {
                let radius = sphere * (1.0 - cut * cut).sqrt();
                left -= std::f64::consts::PI * radius * radius;
                self.0.push(Disc { x, y, radius });
            }
        }
    }
}

/// A crack: a line with a width, pixels.
struct Line {
    points: Vec<[f64; 2]>,
    width: f64,
}

impl Line {
    /// The crack as far as it lies in the body.
    fn described(&self, body: &Mask, pixel_mm: f64) -> Crack {
        let inside = |p: &[f64; 2]| {
            let ([x, y], [w, h]) = (*p, [body.width as f64, body.height as f64]);
            (0.0..w).contains(&x)
                && (0.0..h).contains(&y)
                && body.data[y as usize * body.width + x as usize]
        };
        // The first point may lie a hair outside the surface; a piece counts where its far end is
        // inside.
        let pieces = self.points.windows(2).filter(|w| inside(&w[1]));
        let length_px: f64 = pieces.map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
        let middle = self.points.get(self.points.len() / 2).copied().unwrap_or_default();
        let span = |k: usize| {
            let [low, high] = self
                .points
                .iter()
                .filter(|p| inside(p))
                .fold([f64::INFINITY, 0.0], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
            (high - low).max(0.0) * pixel_mm
        };
        Crack {
            length_px,
            length_mm: length_px * pixel_mm,
            width_mm: self.width * pixel_mm,
            at_mm: middle.map(|v| v * pixel_mm),
            box_mm: [span(0), span(1)],
        }
    }
}

/// Share of each pixel that the discs cover. The edge is the overlap of a pixel with a half plane,
/// and no disc covers more than its area.
fn cover_discs(share: &mut Grid<f32>, discs: &[Disc]) {
    for disc in discs {
        let most = (std::f64::consts::PI * disc.radius * disc.radius).min(1.0);
        paint(share, [disc.x, disc.y], disc.radius + 1.0, |x, y| {
            (disc.radius + 0.5 - (x - disc.x).hypot(y - disc.y)).clamp(0.0, most)
        });
    }
}

/// Share of each pixel that a crack covers: the overlap of the pixel, seen across the crack, with
/// the crack's width.
fn cover_line(share: &mut Grid<f32>, line: &Line) {
    let half = 0.5 * line.width;
    for ends in line.points.windows(2) {
        let ([ax, ay], [bx, by]) = (ends[0], ends[1]);
        let (dx, dy) = (bx - ax, by - ay);
        let square = (dx * dx + dy * dy).max(1e-12);
        paint(
            share,
            [0.5 * (ax + bx), 0.5 * (ay + by)],
            0.5 * square.sqrt() + half + 1.0,
            |x, y| {
                let t = (((x - ax) * dx + (y - ay) * dy) / square).clamp(0.0, 1.0);
                let away = (x - ax - t * dx).hypot(y - ay - t * dy);
                ((away + 0.5).min(half) - (away - 0.5).max(-half)).clamp(0.0, 1.0)
            },
        );
    }
}

/// Raises pixels within `reach` of a point to a share given by the pixel's centre.
fn paint(share: &mut Grid<f32>, at: [f64; 2], reach: f64, value: impl Fn(f64, f64) -> f64) {
    let span = |c: f64, n: usize| {
        ((c - reach).floor().max(0.0) as usize)..((c + reach).ceil().clamp(0.0, n as f64) as usize)
    };
    for y in span(at[1], share.height) {
        for x in span(at[0], share.width) {
            let pixel = &mut share.data[y * share.width + x];
            *pixel = pixel.max(value(x as f64 + 0.5, y as f64 + 0.5) as f32);
        }
    }
}

fn render(
    dice: &mut Draw,
    request: Request,
    mut body: Mask,
    bars: &[Disc],
    pores: &Discs,
    cracks: &[Line],
) -> Drawn {
    let empty = || Grid::new(body.width, body.height, 0.0_f32);
    let (mut pore, mut crack, mut steel) = (empty(), empty(), empty());
    cover_discs(&mut pore, &pores.0);
    cracks.iter().for_each(|line| cover_line(&mut crack, line));
    cover_discs(&mut steel, bars);
    let either =
        Grid { data: pore.data.iter().zip(&crack.data).map(|(a, b)| a.max(*b)).collect(), ..pore };
    // Steel interrupts cracks and pores.
    let cut = |share: Grid<f32>| Grid {
        data: share.data.iter().zip(&steel.data).map(|(v, s)| v * (1.0 - s)).collect(),
        ..share
    };
    let drop = blurred(&cut(either), POINT_SPREAD).map(|v| AIR_DROP * v);
    let crack_drop = blurred(&cut(crack), POINT_SPREAD).map(|v| AIR_DROP * v);
    let steel = blurred(&steel, POINT_SPREAD);
    let texture = texture(dice, &body);
    let grey = |i: usize| {
        if body.data[i] {
            ((1.0 + texture.data[i] - drop.data[i]) + 1.3 * steel.data[i]).max(0.051)
        } else {
            0.0
        }
    };
    let grey = Grid {
        data: (0..body.data.len()).map(grey).collect(),
        width: body.width,
        height: body.height,
    };
    for (inside, &s) in body.data.iter_mut().zip(&steel.data) {
        *inside &= s < 0.5;
    }
    let truth = Mask {
        data: drop.data.iter().zip(&body.data).map(|(&d, &b)| b && d > LABEL_LEVEL).collect(),
        ..body
    };
    let body_area = body.count();
    let in_pores = (0..truth.data.len())
        .filter(|&i| truth.data[i] && crack_drop.data[i] <= LABEL_LEVEL)
        .count();
    let pixel_mm = f64::from(request.pixel_mm);
    let cracks: Vec<Crack> = cracks
        .iter()
        .map(|line| line.described(&body, pixel_mm))
        .filter(|c| c.length_px > 0.0)
        .collect();
    Drawn {
        slice: Slice {
            name: format!("slice {} of {} ({MARK})", request.index + 1, request.count),
            grey,
            pixel_mm: request.pixel_mm,
        },
        truth,
        porosity: in_pores as f64 / body_area.max(1) as f64,
        cracks,
        body_area,
    }
}

/// What sound concrete and the scanner add: aggregate, bright specks, rings, cupping, correlated
/// noise.
fn texture(dice: &mut Draw, body: &Mask) -> Grid<f32> {
    let (w, h) = (body.width, body.height);
    let (area, side) = (body.count() as f64, w as f64);
    let mut texture = noise(dice, w, h);
    for _ in 0..(area / 600.0) as usize {
        let (at, radius, shade) = (
            [side * dice.unit(), side * dice.unit()],
            dice.between(4.0, 22.0),
            0.012 * dice.normal(),
        );
        stamp(&mut texture, at, radius, shade);
    }
    for _ in 0..(area / 1300.0) as usize {
        let (at, radius, shade) = (
            [side * dice.unit(), side * dice.unit()],
            dice.between(0.6, 1.4),
            dice.between(0.08, 0.3),
        );
        stamp(&mut texture, at, radius, shade);
    }
    let waves: Vec<[f64; 3]> = (0..6)
        .map(|_| [0.0025 * dice.normal(), dice.between(0.05, 1.2), dice.between(0.0, 6.3)])
        .collect();
    let cupping = dice.between(-0.008, 0.008);
    for i in 0..w * h {
        let (x, y) = body.place(i);
        let r = (x as f64 - 0.5 * side).hypot(y as f64 - 0.5 * side);
        let rings: f64 = waves.iter().map(|[a, f, p]| a * (f * r + p).sin()).sum();
        texture.data[i] += (rings + cupping * (4.0 * (r / side).powi(2) - 0.5)) as f32;
    }
    texture
}

/// Adds a disc of another shade.
fn stamp(texture: &mut Grid<f32>, at: [f64; 2], radius: f64, shade: f64) {
    let span = |c: f64, n: usize| {
        ((c - radius - 1.0).max(0.0) as usize)..((c + radius + 1.0).max(0.0) as usize).min(n)
    };
    for y in span(at[1], texture.height) {
        for x in span(at[0], texture.width) {
            let share = (radius + 0.5 - (x as f64 + 0.5 - at[0]).hypot(y as f64 + 0.5 - at[1]))
                .clamp(0.0, 1.0);
            texture.data[y * texture.width + x] += (shade * share) as f32;
        }
    }
}

/// White noise blurred by three widths: autocorrelation about .4, .2, .2 at one, two and three
/// pixels.
fn noise(dice: &mut Draw, w: usize, h: usize) -> Grid<f32> {
    let mut sum = Grid::new(w, h, 0.0_f32);
    for (share, sigma) in [(0.68_f32, 0.39_f32), (0.22, 1.2), (0.10, 6.0)] {
        let white =
            Grid { width: w, height: h, data: (0..w * h).map(|_| dice.normal() as f32).collect() };
        let smooth = blurred(&white, sigma);
        let norm = NOISE * share.sqrt() / kernel(sigma).iter().map(|k| k * k).sum::<f32>();
        for (s, v) in sum.data.iter_mut().zip(&smooth.data) {
            *s += norm * v;
        }
    }
    sum
}

/// Sampled Gaussian, sum 1.
fn kernel(sigma: f32) -> Vec<f32> {
    let half = (4.0 * sigma).ceil() as i32;
    let raw: Vec<f32> = (-half..=half).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = raw.iter().sum();
    raw.into_iter().map(|v| v / sum).collect()
}

/// Gaussian blur; the border repeats.
fn blurred(grid: &Grid<f32>, sigma: f32) -> Grid<f32> {
    grid.convolved(&kernel(sigma), &Job::default())
}
