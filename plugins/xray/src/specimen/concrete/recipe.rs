//! What a specimen is to be made of.

use glam::{DVec2, DVec3};

/// Most cells of the lattice on which bodies are placed.
const CELLS: f64 = 2.5e8;

/// Across the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// Of this radius, m.
    Round(f64),
    /// Half sides along x and y, m.
    Rectangle([f64; 2]),
}

impl Outline {
    /// How far a point lies within (positive) or beyond the edge, m.
    #[inline]
    #[must_use]
    pub fn within(&self, p: DVec3) -> f64 {
        match *self {
            Self::Round(radius) => radius - p.truncate().length(),
            Self::Rectangle([a, b]) => (a - p.x.abs()).min(b - p.y.abs()),
        }
    }

    /// Half sides of the box around it, m.
    #[must_use]
    pub fn half(&self) -> DVec2 {
        match *self {
            Self::Round(radius) => DVec2::splat(radius),
            Self::Rectangle(half) => DVec2::from_array(half),
        }
    }

    /// m².
    #[must_use]
    pub fn area(&self) -> f64 {
        match *self {
            Self::Round(radius) => std::f64::consts::PI * radius * radius,
            Self::Rectangle([a, b]) => 4.0 * a * b,
        }
    }

    /// Largest distance from the axis, m.
    #[must_use]
    pub fn reach(&self) -> f64 {
        match *self {
            Self::Round(radius) => radius,
            Self::Rectangle([a, b]) => a.hypot(b),
        }
    }
}

/// What grains are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rock {
    /// Quartz gravel, 2650 kg/m³.
    #[default]
    Quartz,
    /// 2700 kg/m³.
    Limestone,
    /// 2680 kg/m³.
    Granite,
}

impl Rock {
    /// Name of its material, and kg/m³.
    #[must_use]
    pub fn material(self) -> (&'static str, f64) {
        match self {
            Self::Quartz => ("quartz", 2650.0),
            Self::Limestone => ("limestone", 2700.0),
            Self::Granite => ("granite", 2680.0),
        }
    }
}

/// Pores between two heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Lowest z, m.
    pub from: f64,
    /// Highest z, m.
    pub to: f64,
    /// Share of the volume.
    pub porosity: f64,
    /// Median of the number of entrained pores by diameter (log-normal), m.
    pub median: f64,
    /// Standard deviation of the logarithm of the diameter.
    pub spread: f64,
    /// Share of the pores' volume that is entrapped: two to four times the median, flattened.
    pub entrapped: f64,
}

/// Where mortar is missing between the grains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Honeycomb {
    /// Lowest z, m.
    pub from: f64,
    /// Highest z, m.
    pub to: f64,
    /// Share of the volume there.
    pub porosity: f64,
}

/// A crack: a rough surface through `mouth`, open by `width`, that goes `depth` deep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crack {
    /// A point where it begins, m.
    pub mouth: DVec3,
    /// Unit, across its mean plane.
    pub normal: DVec3,
    /// Unit, in its plane, the way it goes.
    pub inward: DVec3,
    /// m; over the last tenth of it the opening closes.
    pub depth: f64,
    /// Opening across the surface, m.
    pub width: f64,
    /// Whether it goes round the grains that it meets instead of through them.
    pub round: bool,
    /// Root mean square of the difference in height of two points 16 mm apart, m.
    pub roughness: f64,
}

/// A bar, a stirrup or the strands of a tendon.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Points of its axis, m.
    pub line: Vec<DVec3>,
    /// Nominal radius, m.
    pub radius: f64,
    /// Whether it has ribs.
    pub ribbed: bool,
    /// Share of its cross-section lost to corrosion.
    pub loss: f64,
}

/// Cover fallen off: a shallow bowl.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spall {
    /// Its middle on the surface, m.
    pub centre: DVec3,
    /// Unit, out of the specimen.
    pub outward: DVec3,
    /// Radius on the surface, m.
    pub radius: f64,
    /// m.
    pub depth: f64,
}

impl Spall {
    /// Whether the cover is missing at `p`: half an ellipsoid, uneven by a tenth.
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        self.inside(p) < 1.0
    }

    /// Whether any of it may be within `half` of `p`.
    pub(super) fn reaches(&self, p: DVec3, half: f64) -> bool {
        self.inside(p) < 1.2 * (1.0 + half / self.depth.min(self.radius).max(1e-9)).powi(2)
    }

    fn inside(&self, p: DVec3) -> f64 {
        let d = p - self.centre;
        let out = d.dot(self.outward);
        let (u, v) = self.outward.any_orthonormal_pair();
        let (a, b) = (d.dot(u) / self.radius, d.dot(v) / self.radius);
        let uneven = 1.0 + 0.1 * ((7.0 * a + 3.0 * b).sin() * (5.0 * b - 2.0 * a).cos());
        (a * a + b * b + (out / self.depth).powi(2)) * uneven
    }
}

/// What a specimen is made of and what is wrong with it. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Across the axis.
    pub outline: Outline,
    /// Along the axis, the scan plane in the middle.
    pub height: f64,
    /// The smallest voxel it will be painted on: finer grains and pores are part of the mortar.
    pub finest: f64,
    /// Of the grains.
    pub rock: Rock,
    /// Diameter of the largest grain.
    pub largest: f64,
    /// Volume share of all aggregate, down to dust.
    pub share: f64,
    /// 0: smooth gravel; 1: crushed rock.
    pub angular: f64,
    /// Pores.
    pub air: Vec<Air>,
    /// Voids between grains.
    pub honeycombs: Vec<Honeycomb>,
    /// Cracks.
    pub cracks: Vec<Crack>,
    /// Steel.
    pub bars: Vec<Bar>,
    /// Missing cover.
    pub spalls: Vec<Spall>,
    /// Of all its random numbers.
    pub seed: u64,
}

impl Recipe {
    /// Sound concrete of quartz gravel up to 16 mm, without pores and steel.
    #[must_use]
    pub(crate) fn sound(outline: Outline, height: f64, finest: f64, seed: u64) -> Self {
        Self {
            outline,
            height,
            finest,
            rock: Rock::default(),
            largest: 0.016,
            share: 0.7,
            angular: 0.6,
            air: Vec::new(),
            honeycombs: Vec::new(),
            cracks: Vec::new(),
            bars: Vec::new(),
            spalls: Vec::new(),
            seed,
        }
    }

    /// m³.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.outline.area() * self.height
    }

    /// Edge of the cells on which bodies are placed.
    #[must_use]
    pub(crate) fn cell(&self) -> f64 {
        let half = self.outline.half();
        (0.5 * self.finest).max((4.0 * half.x * half.y * self.height / CELLS).cbrt())
    }

    pub(super) fn check(&self) -> Result<(), String> {
        let positive = |v: f64| v > 0.0 && v < 100.0;
        let half = self.outline.half();
        if ![half.x, half.y, self.height, self.finest, self.largest].into_iter().all(positive) {
            return Err("a specimen's sizes must be above 0 and below 100 m".to_owned());
        }
        if !(0.0..0.9).contains(&self.share) || !(0.0..=1.0).contains(&self.angular) {
            return Err("the share of aggregate must be from 0 to 0.9, its angularity from 0 to 1"
                .to_owned());
        }
        let airy = |a: &Air| {
            (0.0..=0.5).contains(&a.porosity)
                && positive(a.median)
                && (0.0..=2.0).contains(&a.spread)
                && a.from < a.to
        };
        if !self.air.iter().all(|a| airy(a) && (0.0..=1.0).contains(&a.entrapped)) {
            return Err("porosity must be from 0 to 0.5, the pores' median diameter above 0, their spread from 0 to 2".to_owned());
        }
        if !self.honeycombs.iter().all(|h| (0.0..=0.5).contains(&h.porosity) && h.from < h.to) {
            return Err("the porosity of honeycomb must be from 0 to 0.5".to_owned());
        }
        let crack = |c: &Crack| {
            let unit = |v: DVec3| (v.length() - 1.0).abs() < 1e-6;
            unit(c.normal)
                && unit(c.inward)
                && c.normal.dot(c.inward).abs() < 1e-6
                && c.mouth.is_finite()
                && (0.0..1.0).contains(&c.width)
        };
        if !self.cracks.iter().all(|c| {
            crack(c) && (0.0..100.0).contains(&c.depth) && (0.0..1.0).contains(&c.roughness)
        }) {
            return Err("a crack needs a plane, a width and a depth".to_owned());
        }
        let spall = |s: &Spall| {
            s.centre.is_finite()
                && positive(s.radius)
                && positive(s.depth)
                && (s.outward.length() - 1.0).abs() < 1e-6
        };
        if !self.spalls.iter().all(spall) {
            return Err("a spall needs a place, a radius and a depth".to_owned());
        }
        let bar = |b: &Bar| {
            b.line.iter().all(|p| p.is_finite())
                && b.radius > 0.0
                && b.radius < 1.0
                && (0.0..=1.0).contains(&b.loss)
        };
        if !self.bars.iter().all(bar) {
            return Err("a bar needs a line, a radius and a loss from 0 to 1".to_owned());
        }
        Ok(())
    }
}
