//! What is looked through: voxels or simple solids of known materials.

pub mod concrete;

use glam::{DVec3, UVec3};

use crate::{
    march::{Lattice, slab},
    physics::Matter,
};

/// Most entries of a palette.
pub(crate) const PALETTE: usize = 32;
/// Most solids.
const SOLIDS: usize = 64;
/// Voxels along the edge of a cell that has its own majorant.
const MACRO: u32 = 8;

/// Why a specimen cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecimenError {
    /// Sizes that do not fit together.
    #[error("the volume has {voxels} voxels but {labels} labels; give one label a voxel")]
    Size {
        /// Product of the sides.
        voxels: usize,
        /// Labels given.
        labels: usize,
    },
    /// A label that the palette does not have.
    #[error("label {label} has no material; the palette has {entries}")]
    Label {
        /// The label.
        label: u8,
        /// Length of the palette.
        entries: usize,
    },
    /// A number that is none, or not positive.
    #[error("{0} must be a positive number")]
    Number(&'static str),
    /// Too many of something.
    #[error("at most {most} {what}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many there may be.
        most: usize,
    },
}

/// What a label stands for.
#[derive(Debug, Clone)]
pub struct Substance {
    /// Index of the material in the specimen's list.
    pub material: usize,
    /// kg/m³; 0 is nothing.
    pub density: f64,
}

/// A body with a closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Between two corners, m.
    Box([DVec3; 2]),
    /// Round a line from `base` to `top`, m.
    Cylinder {
        /// Centre of one end, m.
        base: DVec3,
        /// Centre of the other, m.
        top: DVec3,
        /// m.
        radius: f64,
    },
}

/// A body of one substance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// The body that it fills.
    pub shape: Shape,
    /// Of what: entry of the palette.
    pub label: u8,
}

/// Labels on a lattice, x fastest.
#[derive(Debug, Clone)]
struct Voxels {
    lattice: Lattice,
    labels: Vec<u8>,
    /// Cells of 8³ voxels, each with the number of its set of labels.
    cells: Lattice,
    set: Vec<u16>,
    sets: Vec<Vec<u8>>,
}

#[derive(Debug, Clone)]
enum Body {
    Solids(Vec<Solid>),
    Voxels(Voxels),
}

/// Materials in space. Around it is nothing.
#[derive(Debug, Clone)]
pub struct Specimen {
    materials: Vec<Matter>,
    palette: Vec<Substance>,
    body: Body,
    bounds: [DVec3; 2],
}

/// Attenuation per metre of every entry of the palette at one energy.
pub type Local = [f64; PALETTE];

impl Specimen {
    /// Solids; where they overlap, the later one counts.
    ///
    /// # Errors
    /// Any [`SpecimenError`].
    pub fn solids(
        materials: Vec<Matter>,
        palette: Vec<Substance>,
        solids: Vec<Solid>,
    ) -> Result<Self, SpecimenError> {
        check(&materials, &palette, solids.iter().map(|s| s.label))?;
        if solids.is_empty() || solids.len() > SOLIDS {
            return Err(SpecimenError::TooMany { what: "solids, and at least one", most: SOLIDS });
        }
        let boxes: Vec<[DVec3; 2]> = solids.iter().map(|s| s.shape.bounds()).collect();
        if !boxes.iter().all(|[a, b]| a.is_finite() && b.is_finite() && a.cmplt(*b).all()) {
            return Err(SpecimenError::Number("the size of a solid"));
        }
        let bounds = boxes
            .into_iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[a, b], [c, d]| [a.min(c), b.max(d)]);
        Ok(Self { materials, palette, body: Body::Solids(solids), bounds })
    }

    /// Voxels: one label each, x fastest, then y, then z.
    ///
    /// # Errors
    /// Any [`SpecimenError`].
    pub fn voxels(
        materials: Vec<Matter>,
        palette: Vec<Substance>,
        lattice: Lattice,
        labels: Vec<u8>,
    ) -> Result<Self, SpecimenError> {
        let sides = lattice.spacing;
        if !(sides.is_finite() && sides.cmpgt(DVec3::ZERO).all() && lattice.origin.is_finite()) {
            return Err(SpecimenError::Number("the spacing of voxels"));
        }
        if labels.len() != lattice.len() || labels.is_empty() {
            return Err(SpecimenError::Size { voxels: lattice.len(), labels: labels.len() });
        }
        let mut there = [false; 256];
        labels.iter().for_each(|&l| there[l as usize] = true);
        check(&materials, &palette, (0..=255).filter(|&l| there[l as usize]))?;
        let bounds = lattice.bounds();
        Ok(Self { materials, palette, body: Body::Voxels(Voxels::new(lattice, labels)), bounds })
    }

    /// Lowest and highest corner, m.
    #[must_use]
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The label of a specimen that is one solid: its pieces of a way are cut into cells, not the
    /// other way round.
    #[must_use]
    pub(crate) fn only(&self) -> Option<u8> {
        match &self.body {
            Body::Solids(solids) if solids.len() == 1 => solids.first().map(|s| s.label),
            _ => None,
        }
    }

    /// Material of a label.
    #[inline]
    #[must_use]
    pub(crate) fn matter(&self, label: u8) -> &Matter {
        &self.materials[self.palette[label as usize].material]
    }

    /// Density of a label, kg/m³.
    #[inline]
    #[must_use]
    pub fn density(&self, label: u8) -> f64 {
        self.palette[label as usize].density
    }

    /// Number of labels.
    #[must_use]
    pub fn labels(&self) -> usize {
        self.palette.len()
    }

    /// Attenuation per metre of every label at `kev`.
    #[inline]
    #[must_use]
    pub fn local(&self, kev: f64) -> Local {
        let mut local = [0.0; PALETTE];
        for (mu, substance) in local.iter_mut().zip(&self.palette) {
            if substance.density > 0.0 {
                *mu = substance.density * self.materials[substance.material].total(kev);
            }
        }
        local
    }

    /// The label at `p`; None where nothing is.
    #[must_use]
    pub fn label(&self, p: DVec3) -> Option<u8> {
        let label = match &self.body {
            Body::Voxels(v) => v.lattice.cell(p).map(|i| v.labels[i]),
            Body::Solids(solids) => {
                solids.iter().rev().find(|s| s.shape.contains(p)).map(|s| s.label)
            }
        };
        label.filter(|&l| self.density(l) > 0.0)
    }

    /// Calls `visit(label, from, to)` for every piece of one label that the way from `origin` along
    /// the unit vector `way` passes between distances `from` and `to`, in order, until it says
    /// false. Pieces of nothing may be left out.
    #[inline]
    pub(crate) fn trace(
        &self,
        origin: DVec3,
        way: DVec3,
        from: f64,
        to: f64,
        mut visit: impl FnMut(u8, f64, f64) -> bool,
    ) {
        match &self.body {
            Body::Voxels(v) => {
                v.lattice.march(origin, way, from, to, |cell, a, b| visit(v.labels[cell], a, b))
            }
            Body::Solids(solids) if solids.len() == 1 => {
                if let Some([a, b]) = solids[0].shape.crossed(origin, way) {
                    let (a, b) = (a.max(from), b.min(to));
                    if a < b {
                        visit(solids[0].label, a, b);
                    }
                }
            }
            Body::Solids(solids) => trace_solids(solids, origin, way, from, to, visit),
        }
    }

    /// Optical depth between two distances along a way.
    #[inline]
    #[must_use]
    pub fn depth(&self, local: &Local, origin: DVec3, way: DVec3, from: f64, to: f64) -> f64 {
        let mut depth = 0.0;
        self.trace(origin, way, from, to, |label, a, b| {
            depth += local[label as usize] * (b - a);
            true
        });
        depth
    }

    /// The distance from `from` on at which the optical depth has reached `depth`, and the label
    /// there; None if the way leaves before.
    #[must_use]
    pub fn reach(
        &self,
        local: &Local,
        origin: DVec3,
        way: DVec3,
        from: f64,
        depth: f64,
    ) -> Option<(f64, u8)> {
        let mut left = depth;
        let mut found = None;
        self.trace(origin, way, from, f64::INFINITY, |label, a, b| {
            let mu = local[label as usize];
            if mu * (b - a) > left {
                found = Some((a + left / mu, label));
                return false;
            }
            left -= mu * (b - a);
            true
        });
        found
    }

    /// A free flight: distance to the next collision and the label there, from uniform numbers;
    /// None if it leaves. Voxels by Woodcock's (1965) tracking with a majorant for every 8³ of
    /// them, solids in closed form.
    #[must_use]
    pub(crate) fn fly(
        &self,
        local: &Local,
        origin: DVec3,
        way: DVec3,
        mut unit: impl FnMut() -> f64,
    ) -> Option<(f64, u8)> {
        let mut left = exponential(unit());
        let Body::Voxels(v) = &self.body else {
            return self.reach(local, origin, way, 0.0, left);
        };
        let mut found = None;
        v.cells.march(origin, way, 0.0, f64::INFINITY, |cell, from, to| {
            let set = &v.sets[v.set[cell] as usize];
            let majorant = set.iter().fold(0.0, |m: f64, &l| m.max(local[l as usize]));
            let mut s = from;
            while majorant > 0.0 && left <= majorant * (to - s) {
                s += left / majorant;
                left = exponential(unit());
                let (label, u) = (v.lattice.cell(origin + s * way).map(|i| v.labels[i]), unit());
                if let Some(label) = label.filter(|&l| u * majorant < local[l as usize]) {
                    found = Some((s, label));
                    return false;
                }
            }
            left -= majorant * (to - s);
            true
        });
        found
    }
}

/// −ln(1 − u).
fn exponential(u: f64) -> f64 {
    -(-u).ln_1p()
}

fn check(
    materials: &[Matter],
    palette: &[Substance],
    mut labels: impl Iterator<Item = u8>,
) -> Result<(), SpecimenError> {
    if palette.len() > PALETTE {
        return Err(SpecimenError::TooMany { what: "substances", most: PALETTE });
    }
    if let Some(label) = labels.find(|&l| l as usize >= palette.len()) {
        return Err(SpecimenError::Label { label, entries: palette.len() });
    }
    if let Some(i) = palette.iter().position(|s| s.material >= materials.len()) {
        return Err(SpecimenError::Label { label: i as u8, entries: materials.len() });
    }
    if palette.iter().any(|s| !(s.density >= 0.0 && s.density < 1e5)) {
        return Err(SpecimenError::Number("a density in kg/m³"));
    }
    Ok(())
}

impl Voxels {
    fn new(lattice: Lattice, labels: Vec<u8>) -> Self {
        let count = (lattice.cells + (MACRO - 1)) / MACRO;
        let cells = Lattice {
            origin: lattice.origin,
            spacing: lattice.spacing * f64::from(MACRO),
            cells: count,
        };
        let mut there = vec![[0_u64; 4]; cells.len()];
        let mut voxel = labels.iter();
        for z in 0..lattice.cells.z {
            for y in 0..lattice.cells.y {
                for (x, &label) in (0..lattice.cells.x).zip(&mut voxel) {
                    there[cells.index(UVec3::new(x, y, z) / MACRO)][label as usize / 64] |=
                        1 << (label % 64);
                }
            }
        }
        let mut distinct = there.clone();
        distinct.sort_unstable();
        distinct.dedup();
        let number = |bits: &[u64; 4]| {
            distinct.binary_search(bits).unwrap_or(0).min(usize::from(u16::MAX)) as u16
        };
        let set = there.iter().map(number).collect();
        let sets = distinct
            .iter()
            .map(|bits| {
                (0..=255_u8).filter(|&l| bits[l as usize / 64] >> (l % 64) & 1 == 1).collect()
            })
            .collect();
        Self { lattice, labels, cells, set, sets }
    }
}

impl Shape {
    /// A box around it, m.
    #[must_use]
    pub fn bounds(&self) -> [DVec3; 2] {
        match *self {
            Self::Box(corners) => corners,
            Self::Cylinder { base, top, radius } => {
                let axis = (top - base).normalize();
                let reach = radius * (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
                [base.min(top) - reach, base.max(top) + reach]
            }
        }
    }

    /// Whether `p` is in it.
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        match *self {
            Self::Box([low, high]) => p.cmpge(low).all() && p.cmple(high).all(),
            Self::Cylinder { base, top, radius } => {
                let axis = top - base;
                let t = (p - base).dot(axis) / axis.length_squared();
                (0.0..=1.0).contains(&t)
                    && (p - base - t * axis).length_squared() <= radius * radius
            }
        }
    }

    /// Where a way is inside, from distance 0 on.
    #[inline]
    #[must_use]
    pub(crate) fn crossed(&self, origin: DVec3, way: DVec3) -> Option<[f64; 2]> {
        match *self {
            Self::Box(corners) => slab(corners, origin, way),
            Self::Cylinder { base, top, radius } => {
                let height = (top - base).length();
                let axis = (top - base) / height;
                let (along, rise) = (way.dot(axis), (origin - base).dot(axis));
                let (w, o) = (way - along * axis, origin - base - rise * axis);
                let (a, b, c) =
                    (w.length_squared(), o.dot(w), o.length_squared() - radius * radius);
                let (mut enter, mut leave) = if a > 1e-24 {
                    let root = b * b - a * c;
                    if root <= 0.0 {
                        return None;
                    }
                    let root = root.sqrt();
                    ((-b - root) / a, (-b + root) / a)
                } else if c < 0.0 {
                    (0.0, f64::INFINITY)
                } else {
                    return None;
                };
                if along.abs() > 1e-12 {
                    let (s, t) = (-rise / along, (height - rise) / along);
                    enter = enter.max(s.min(t));
                    leave = leave.min(s.max(t));
                } else if rise < 0.0 || rise > height {
                    return None;
                }
                let enter = enter.max(0.0);
                (enter < leave).then_some([enter, leave])
            }
        }
    }
}

fn trace_solids(
    solids: &[Solid],
    origin: DVec3,
    way: DVec3,
    from: f64,
    to: f64,
    mut visit: impl FnMut(u8, f64, f64) -> bool,
) {
    let mut spans = [[0.0; 2]; SOLIDS];
    let mut marks = [0.0; 2 * SOLIDS];
    let mut count = 0;
    for (span, solid) in spans.iter_mut().zip(solids) {
        *span = solid
            .shape
            .crossed(origin, way)
            .map_or([f64::INFINITY; 2], |[a, b]| [a.max(from), b.min(to)]);
        if span[0] < span[1] {
            marks[count..count + 2].copy_from_slice(span);
            count += 2;
        } else {
            *span = [f64::INFINITY; 2];
        }
    }
    let marks = &mut marks[..count];
    marks.sort_unstable_by(f64::total_cmp);
    for pair in marks.windows(2).filter(|pair| pair[0] < pair[1]) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let inside =
            (0..solids.len()).rev().find(|&i| spans[i][0] < middle && middle < spans[i][1]);
        if inside.is_some_and(|i| !visit(solids[i].label, pair[0], pair[1])) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{Library, Model};
    use intrados_stage::random::{Draw, Key};

    fn matters() -> (Vec<Matter>, Vec<Substance>) {
        let library = Library::builtin().unwrap();
        let materials =
            ["concrete", "steel"].map(|n| Matter::new(&library, n, Model::Bound).unwrap()).to_vec();
        let substance = |material, density| Substance { material, density };
        (materials, vec![substance(0, 0.0), substance(0, 2300.0), substance(1, 7874.0)])
    }

    fn bar() -> Vec<Solid> {
        let cylinder = |radius| Shape::Cylinder {
            base: DVec3::new(0.0, 0.0, -0.05),
            top: DVec3::new(0.0, 0.0, 0.05),
            radius,
        };
        vec![
            Solid { shape: cylinder(0.04), label: 1 },
            Solid { shape: cylinder(0.01), label: 2 },
            Solid { shape: cylinder(0.004), label: 0 },
        ]
    }

    /// Straight through a hollow bar in a cylinder.
    #[test]
    fn solids_lie_in_each_other() {
        let (materials, palette) = matters();
        let specimen = Specimen::solids(materials, palette, bar()).unwrap();
        let mut pieces = Vec::new();
        specimen.trace(DVec3::new(-1.0, 0.0, 0.0), DVec3::X, 0.0, 1e9, |label, a, b| {
            pieces.push((label, ((b - a) * 1e6).round() / 1e6));
            true
        });
        assert_eq!(pieces, [(1, 0.03), (2, 0.006), (0, 0.008), (2, 0.006), (1, 0.03)]);
        assert_eq!(
            (
                specimen.label(DVec3::X * 0.007),
                specimen.label(DVec3::ZERO),
                specimen.label(DVec3::X)
            ),
            (Some(2), None, None)
        );
    }

    /// The same bar of voxels: collisions of Woodcock's flights against exact ones along one way.
    /// Chance to get through and mean distance, 200 000 flights each, within four standard errors
    /// of exp(−τ) and of its own integral.
    #[test]
    fn flights_follow_the_optical_depth() {
        let (materials, palette) = matters();
        let lattice = Lattice {
            origin: DVec3::splat(-0.05),
            spacing: DVec3::splat(1e-3),
            cells: UVec3::splat(100),
        };
        let solid = Specimen::solids(materials.clone(), palette.clone(), bar()).unwrap();
        let labels =
            (0..lattice.len()).map(|i| solid.label(lattice.centre(i)).unwrap_or(0)).collect();
        let voxels = Specimen::voxels(materials, palette, lattice, labels).unwrap();
        let (origin, way) =
            (DVec3::new(-0.2, 0.003, -0.02), DVec3::new(1.0, 0.02, 0.1).normalize());
        for specimen in [&solid, &voxels] {
            let local = specimen.local(150.0);
            let depth = specimen.depth(&local, origin, way, 0.0, f64::INFINITY);
            let n = 200_000;
            let (mut through, mut sum) = (0.0, 0.0);
            for i in 0..n {
                let mut draw = Draw::new(Key::new(4, i));
                match specimen.fly(&local, origin, way, || draw.unit()) {
                    None => through += 1.0,
                    Some((s, label)) => {
                        assert_eq!(specimen.label(origin + s * way), Some(label));
                        sum += 1.0 - (-specimen.depth(&local, origin, way, 0.0, s)).exp();
                    }
                }
            }
            let (n, p) = (n as f64, (-depth).exp());
            assert!((through / n - p).abs() < 4.0 * (p / n).sqrt(), "{} {p}", through / n);
            // 1 − e^−τ(s) is uniform over (0, 1 − p).
            let mean = 0.5 * (1.0 - p) * (1.0 - p);
            assert!((sum / n - mean).abs() < 4.0 * (0.3 / n.sqrt()), "{} {mean}", sum / n);
        }
        let [a, b] =
            [&solid, &voxels].map(|s| s.depth(&s.local(150.0), origin, way, 0.0, f64::INFINITY));
        assert!((a / b - 1.0).abs() < 0.03, "{a} {b}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let (materials, palette) = matters();
        let lattice = Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, cells: UVec3::splat(2) };
        let of = |lattice, labels: Vec<u8>| {
            Specimen::voxels(materials.clone(), palette.clone(), lattice, labels).unwrap_err()
        };
        assert_eq!(of(lattice, vec![0; 7]), SpecimenError::Size { voxels: 8, labels: 7 });
        assert_eq!(of(lattice, vec![3; 8]), SpecimenError::Label { label: 3, entries: 3 });
        assert!(matches!(
            of(Lattice { spacing: DVec3::NAN, ..lattice }, vec![0; 8]),
            SpecimenError::Number(_)
        ));
        assert!(Specimen::solids(materials.clone(), palette.clone(), vec![]).is_err());
        let flat = Solid { shape: Shape::Box([DVec3::ZERO, DVec3::X]), label: 0 };
        assert!(Specimen::solids(materials, palette, vec![flat]).is_err());
    }
}
