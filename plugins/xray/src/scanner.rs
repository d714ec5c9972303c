//! Tube and detector.

use glam::{DMat3, DVec3};

use crate::physics::{Matter, Spectrum};

/// What a pixel makes of a photon.
#[derive(Debug, Clone, Default)]
pub enum Response {
    /// Its energy, all of it.
    #[default]
    Energy,
    /// One.
    Counting,
    /// Its energy times the chance to be stopped by a layer of so many kg/m², on the way through at
    /// its angle.
    Scintillator(Box<Matter>, f64),
}

impl Response {
    /// Of a photon of `kev` that comes under the cosine `cos` (keV, or 1).
    #[inline]
    #[must_use]
    pub fn of(&self, kev: f64, cos: f64) -> f64 {
        match self {
            Self::Energy => kev,
            Self::Counting => 1.0,
            Self::Scintillator(matter, areal) => {
                kev * -(-matter.total(kev) * areal / cos.max(1e-3)).exp_m1()
            }
        }
    }
}

/// A flat panel of pixels.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Its middle, m.
    pub centre: DVec3,
    /// Along the columns' numbers, unit.
    pub u: DVec3,
    /// Along the rows' numbers, unit, across `u`.
    pub v: DVec3,
    /// Size of a pixel along both, m.
    pub pitch: [f64; 2],
    /// Columns, rows.
    pub pixels: [u32; 2],
    /// What pixels make of photons.
    pub response: Response,
}

impl Panel {
    /// Away from the tube if u, v are as [`Scanner::new`] makes them.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.u.cross(self.v)
    }

    /// Number of pixels.
    #[must_use]
    pub fn len(&self) -> u32 {
        self.pixels[0] * self.pixels[1]
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Area of a pixel, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.pitch[0] * self.pitch[1]
    }

    /// A place in pixel `bin`: (0.5, 0.5) is its middle.
    #[inline]
    #[must_use]
    pub fn place(&self, bin: u32, [a, b]: [f64; 2]) -> DVec3 {
        let (column, row) = (f64::from(bin % self.pixels[0]), f64::from(bin / self.pixels[0]));
        self.centre
            + self.u * (self.pitch[0] * (column + a - 0.5 * f64::from(self.pixels[0])))
            + self.v * (self.pitch[1] * (row + b - 0.5 * f64::from(self.pixels[1])))
    }

    /// The pixel that a way from `origin` meets from in front, and the cosine.
    #[must_use]
    pub(crate) fn met(&self, origin: DVec3, way: DVec3) -> Option<(u32, f64)> {
        let cos = way.dot(self.normal());
        let s = (self.centre - origin).dot(self.normal()) / cos;
        if !(cos > 0.0 && s > 0.0) {
            return None;
        }
        let p = origin + s * way - self.centre;
        let at =
            |axis: DVec3, k: usize| p.dot(axis) / self.pitch[k] + 0.5 * f64::from(self.pixels[k]);
        let (a, b) = (at(self.u, 0), at(self.v, 1));
        let inside =
            a >= 0.0 && b >= 0.0 && a < f64::from(self.pixels[0]) && b < f64::from(self.pixels[1]);
        inside.then(|| (b as u32 * self.pixels[0] + a as u32, cos))
    }
}

/// How the beam is cut: slopes along the panel's u and v over the distance along its normal. A
/// small range of one of them is a fan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Lowest and highest slope along u.
    pub u: [f64; 2],
    /// Lowest and highest slope along v.
    pub v: [f64; 2],
    /// Whether the collimator makes the fluence over the panel even, instead of the same per sr.
    pub flat: bool,
}

impl Beam {
    /// Symmetric, by half-slopes.
    #[must_use]
    pub const fn symmetric(u: f64, v: f64) -> Self {
        Self { u: [-u, u], v: [-v, v], flat: false }
    }

    /// ∫ of 1, or of (1 + t²)^-3/2 (the solid angle), over the slopes.
    fn measure(&self) -> f64 {
        if self.flat {
            return (self.u[1] - self.u[0]) * (self.v[1] - self.v[0]);
        }
        let corner = |a: f64, b: f64| (a * b / (1.0 + a * a + b * b).sqrt()).atan();
        corner(self.u[1], self.v[1]) - corner(self.u[0], self.v[1]) - corner(self.u[1], self.v[0])
            + corner(self.u[0], self.v[0])
    }
}

/// A tube, its beam, and the panel.
#[derive(Debug, Clone)]
pub struct Scanner {
    /// Focal spot's middle, m.
    pub source: DVec3,
    /// Its diameter, m; 0 is a point.
    pub spot: f64,
    /// What leaves the tube.
    pub spectrum: Spectrum,
    /// Where it goes.
    pub beam: Beam,
    /// What receives it.
    pub panel: Panel,
}

impl Scanner {
    /// Looking along x at the axis z through the origin: the tube at −`to_axis`, the panel at
    /// +`to_panel` (m), u along −y... v along z.
    #[must_use]
    pub fn new(
        to_axis: f64,
        to_panel: f64,
        pixels: [u32; 2],
        pitch: [f64; 2],
        spectrum: Spectrum,
        beam: Beam,
    ) -> Self {
        let panel = Panel {
            centre: DVec3::X * to_panel,
            u: DVec3::Y,
            v: DVec3::Z,
            pitch,
            pixels,
            response: Response::Energy,
        };
        Self { source: DVec3::X * -to_axis, spot: 0.0, spectrum, beam, panel }
    }

    /// The same, turned by `angle` (rad) about z.
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let turn = DMat3::from_rotation_z(angle);
        let mut turned = self.clone();
        for p in
            [&mut turned.source, &mut turned.panel.centre, &mut turned.panel.u, &mut turned.panel.v]
        {
            *p = turn * *p;
        }
        turned
    }

    /// Photons per sr that one emitted photon stands for, in a direction (unit).
    #[inline]
    #[must_use]
    pub fn intensity(&self, way: DVec3) -> f64 {
        let cos = way.dot(self.panel.normal());
        if cos <= 0.0 {
            return 0.0;
        }
        let (a, b) = (way.dot(self.panel.u) / cos, way.dot(self.panel.v) / cos);
        let Beam { u, v, flat } = self.beam;
        if a < u[0] || a > u[1] || b < v[0] || b > v[1] {
            return 0.0;
        }
        // dΩ = cos³ da db.
        (if flat { 1.0 / (cos * cos * cos) } else { 1.0 }) / self.beam.measure()
    }

    /// A direction, even over the slopes, and the emission over its density.
    #[must_use]
    pub(crate) fn emit(&self, [a, b]: [f64; 2]) -> (DVec3, f64) {
        let Beam { u, v, flat } = self.beam;
        let (a, b) = (u[0] + a * (u[1] - u[0]), v[0] + b * (v[1] - v[0]));
        let length = (1.0 + a * a + b * b).sqrt();
        let way = (self.panel.normal() + a * self.panel.u + b * self.panel.v) / length;
        let even = (u[1] - u[0]) * (v[1] - v[0]) / self.beam.measure();
        (way, if flat { 1.0 } else { even / length.powi(3) })
    }

    /// A place in the focal spot, a disk across the panel's normal.
    #[must_use]
    pub fn spot(&self, [a, b]: [f64; 2]) -> DVec3 {
        if self.spot <= 0.0 {
            return self.source;
        }
        let (r, (sin, cos)) = (0.5 * self.spot * a.sqrt(), (std::f64::consts::TAU * b).sin_cos());
        self.source + r * (cos * self.panel.u + sin * self.panel.v)
    }

    /// What comes over an area without a specimen, at a point of the panel: photons per m² and
    /// emitted photon, times the cosine.
    #[must_use]
    pub fn open(&self, p: DVec3) -> f64 {
        let d = p - self.source;
        let way = d.normalize();
        self.intensity(way) * way.dot(self.panel.normal()).max(0.0) / d.length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scanner(flat: bool) -> Scanner {
        let spectrum = Spectrum::new(&[(100.0, 1.0)]).unwrap();
        Scanner::new(
            0.8,
            0.4,
            [30, 20],
            [0.02, 0.03],
            spectrum,
            Beam { flat, u: [-0.2, 0.15], v: [-0.3, 0.25] },
        )
    }

    /// One photon is one photon: what comes to the panel over all of it (the beam lies within), and
    /// what is emitted on average. Midpoint rule.
    #[test]
    fn nothing_is_lost() {
        for flat in [false, true] {
            let scanner = scanner(flat);
            let (n, side) = (400, 1.0);
            let (mut sum, mut weight) = (0.0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
                    let p = scanner.panel.centre
                        + side * ((at(i) - 0.5) * DVec3::Y + (at(j) - 0.5) * DVec3::Z);
                    sum += scanner.open(p) * (side / f64::from(n)).powi(2);
                    weight += scanner.emit([at(i), at(j)]).1 / f64::from(n * n);
                }
            }
            assert!((sum - 1.0).abs() < 5e-3 && (weight - 1.0).abs() < 1e-5, "{sum} {weight}");
        }
    }

    #[test]
    fn pixels_are_met_where_they_are() {
        let scanner = scanner(false).turned(0.7);
        for bin in [0, 29, 30, 599] {
            let p = scanner.panel.place(bin, [0.3, 0.8]);
            let (met, cos) =
                scanner.panel.met(scanner.source, (p - scanner.source).normalize()).unwrap();
            assert!(met == bin && cos > 0.8 && cos <= 1.0);
        }
        assert_eq!(scanner.panel.met(scanner.source, -scanner.panel.normal()), None);
    }
}
