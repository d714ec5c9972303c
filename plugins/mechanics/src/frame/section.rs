//! Cross-sections of beams, about axes y and z through their centroid.

use std::f64::consts::PI;

use glam::DVec2;
use intrados_scene::structure::{BoxSection, Section as Written};

/// What a section resists with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Section {
    /// m².
    pub(crate) area: f64,
    /// Areas that resist shear along y and along z, m².
    pub(crate) shear: [f64; 2],
    /// I_y = ∫ z² dA and I_z = ∫ y² dA, m⁴.
    pub(crate) second: [f64; 2],
    /// J, m⁴.
    pub(crate) torsion: f64,
    /// How far the farthest fibres are along y and along z, m.
    pub(crate) reach: [f64; 2],
}

/// Shear areas over areas of a rectangle and of a circle, by the energy of their parabolic shear
/// stresses.
const SHEAR_OF_RECTANGLE: f64 = 5.0 / 6.0;
const SHEAR_OF_CIRCLE: f64 = 0.9;

impl Section {
    /// A rectangle, `high` along y and `wide` along z.
    pub(crate) fn rectangle(high: f64, wide: f64) -> Self {
        let area = high * wide;
        Self {
            area,
            shear: [SHEAR_OF_RECTANGLE * area; 2],
            second: [high * wide.powi(3) / 12.0, wide * high.powi(3) / 12.0],
            torsion: torsion_of_rectangle(high.max(wide), high.min(wide)),
            reach: [0.5 * high, 0.5 * wide],
        }
    }

    pub(crate) fn round(diameter: f64) -> Self {
        let area = PI * diameter.powi(2) / 4.0;
        let second = PI * diameter.powi(4) / 64.0;
        Self {
            area,
            shear: [SHEAR_OF_CIRCLE * area; 2],
            second: [second; 2],
            torsion: 2.0 * second,
            reach: [0.5 * diameter; 2],
        }
    }

    /// A section as it is written, y towards angle 0.
    pub(crate) fn of(written: &Written) -> Self {
        match *written {
            Written::Rectangle { width_m, depth_m } => {
                Self::rectangle(f64::from(depth_m), f64::from(width_m))
            }
            Written::Round { diameter_m } => Self::round(f64::from(diameter_m)),
        }
    }

    /// A box girder, y up; and how far its centroid is above the middle of its depth, m. Torsion by
    /// Bredt, 4 A²/∮ds/t over the middle lines; shear along y in the webs, along z in the slabs.
    pub(crate) fn girder(s: &BoxSection) -> (Self, f64) {
        let of = f64::from;
        let (depth, web) = (of(s.depth_m), of(s.web_m));
        let (top, bottom) = (of(s.top_m), of(s.bottom_m));
        let (wide, narrow) = (of(s.top_width_m), of(s.bottom_width_m));
        let height = depth - top - bottom;
        // Rectangles: width, height, their middle over the soffit, and their middle across.
        let aside = 0.5 * (narrow - web);
        let parts = [
            (wide, top, depth - 0.5 * top, 0.0),
            (narrow, bottom, 0.5 * bottom, 0.0),
            (web, height, bottom + 0.5 * height, aside),
            (web, height, bottom + 0.5 * height, -aside),
        ];
        let area: f64 = parts.iter().map(|(b, h, ..)| b * h).sum();
        let middle = parts.iter().map(|(b, h, y, _)| b * h * y).sum::<f64>() / area;
        let second = parts.iter().fold([0.0; 2], |[about_y, about_z], &(b, h, y, z)| {
            [
                about_y + h * b.powi(3) / 12.0 + b * h * z * z,
                about_z + b * h.powi(3) / 12.0 + b * h * (y - middle).powi(2),
            ]
        });
        let (cell, tall) = (narrow - web, depth - 0.5 * (top + bottom));
        let around = cell / top + cell / bottom + 2.0 * tall / web;
        let section = Self {
            area,
            shear: [2.0 * web * tall, wide * top + narrow * bottom],
            second,
            torsion: 4.0 * (cell * tall).powi(2) / around,
            reach: [middle.max(depth - middle), 0.5 * wide],
        };
        (section, middle - 0.5 * depth)
    }

    /// What the outline of a cut encloses, given as pieces that go round it counterclockwise; and
    /// the place of its centroid, and the angle from the first axis to its principal axis nearest
    /// to it. None: it encloses nothing.
    ///
    /// Integrals by Green's theorem. A section that fills its box is a rectangle; of others,
    /// J = A⁴/(40 I_p) (Saint-Venant 1856), and five sixths of the area resist shear.
    pub(crate) fn outlined(pieces: &[[DVec2; 2]]) -> Option<(Self, DVec2, f64)> {
        let origin = pieces.first()?[0];
        let (mut area, mut first, mut square, mut mixed) = (0.0, DVec2::ZERO, DVec2::ZERO, 0.0);
        for [a, b] in pieces.iter().map(|piece| piece.map(|p| p - origin)) {
            let cross = a.perp_dot(b);
            area += 0.5 * cross;
            first += cross / 6.0 * (a + b);
            square += cross / 12.0 * (a * a + a * b + b * b);
            mixed += cross / 24.0 * (a.x * (2.0 * a.y + b.y) + b.x * (a.y + 2.0 * b.y));
        }
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let centre = first / area;
        // ∫ y², ∫ z² and ∫ y z about the centroid.
        let [yy, zz] = (square - area * centre * centre).to_array();
        let yz = mixed - area * centre.x * centre.y;
        let turn = if yz.abs() > 1e-6 * (yy + zz) { 0.5 * (2.0 * yz).atan2(yy - zz) } else { 0.0 };
        let turn = if turn.abs() > 0.25 * PI { turn - 0.5 * PI * turn.signum() } else { turn };
        let axis = DVec2::from_angle(turn);
        let (mean, half) = (0.5 * (yy + zz), 0.5 * (yy - zz));
        let lean = half * (2.0 * turn).cos() + yz * (2.0 * turn).sin();
        let second = [mean - lean, mean + lean];
        let mut box_of = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for p in pieces.iter().flatten() {
            let d = *p - origin - centre;
            let p = DVec2::new(d.dot(axis), d.dot(axis.perp()));
            box_of = [box_of[0].min(p), box_of[1].max(p)];
        }
        let size = box_of[1] - box_of[0];
        let reach = box_of[0].abs().max(box_of[1].abs()).to_array();
        let fills = (area / (size.x * size.y) - 1.0).abs() < 2e-3;
        let section = if fills {
            Self { reach, ..Self::rectangle(size.x, size.y) }
        } else {
            let torsion = area.powi(4) / (40.0 * (second[0] + second[1]));
            Self { area, shear: [SHEAR_OF_RECTANGLE * area; 2], second, torsion, reach }
        };
        Some((section, origin + centre, turn))
    }

    /// The largest stress of a fibre under N, M_y and M_z, Pa: |N|/A + |M_y|/W_y + |M_z|/W_z.
    pub(crate) fn edge_stress(&self, n: f64, m_y: f64, m_z: f64) -> f64 {
        n.abs() / self.area
            + m_y.abs() * self.reach[1] / self.second[0]
            + m_z.abs() * self.reach[0] / self.second[1]
    }
}

/// J = a b³/3 (1 − 192/π⁵ · b/a Σ tanh(n π a/2b)/n⁵), n odd (Timoshenko and Goodier, §109).
fn torsion_of_rectangle(long: f64, short: f64) -> f64 {
    let sum: f64 = (0..8)
        .map(|k| f64::from(2 * k + 1))
        .map(|n| (0.5 * n * PI * long / short).tanh() / n.powi(5))
        .sum();
    long * short.powi(3) / 3.0 * (1.0 - 192.0 / PI.powi(5) * short / long * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, expected: f64) -> bool {
        (found / expected - 1.0).abs() < 1e-3
    }

    /// Timoshenko and Goodier, table of §109: .1406 a⁴ of a square, .229 a b³ of 1 : 2.
    #[test]
    fn rectangles_twist_as_in_timoshenkos_table() {
        assert!(near(Section::rectangle(1.0, 1.0).torsion, 0.1406));
        assert!(near(Section::rectangle(2.0, 1.0).torsion, 0.2287 * 2.0));
    }

    #[test]
    fn a_turned_rectangle_is_known_by_its_outline() {
        let axis = DVec2::from_angle(0.3);
        let at = |y: f64, z: f64| DVec2::new(3.0, -1.0) + y * axis + z * axis.perp();
        let corners = [at(-0.4, -0.1), at(0.4, -0.1), at(0.4, 0.1), at(-0.4, 0.1)];
        let pieces: Vec<_> = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
        let (section, centre, turn) = Section::outlined(&pieces).unwrap();
        let exact = Section::rectangle(0.8, 0.2);
        assert!((turn - 0.3).abs() < 1e-9 && centre.distance(DVec2::new(3.0, -1.0)) < 1e-12);
        assert!(near(section.second[1], exact.second[1]) && near(section.area, 0.16));
        assert!(near(section.second[0], exact.second[0]) && near(section.torsion, exact.torsion));
    }

    /// A box of 2 × 1 m whose walls are .1 m thick: A and I as differences of two rectangles, J by
    /// Bredt, 4 (1.9 · .9)²/(2 · 1.9/.1 + 2 · .9/.1).
    #[test]
    fn a_box_girder_without_wings_is_a_box() {
        let girder = BoxSection {
            top_width_m: 2.0,
            bottom_width_m: 2.0,
            depth_m: 1.0,
            top_m: 0.1,
            bottom_m: 0.1,
            web_m: 0.1,
        };
        let (section, above) = Section::girder(&girder);
        assert!(above.abs() < 1e-7 && near(section.area, 2.0 - 1.8 * 0.8));
        assert!(near(section.second[1], (2.0 - 1.8 * 0.8f64.powi(3)) / 12.0));
        assert!(near(section.second[0], (8.0 - 0.8 * 1.8f64.powi(3)) / 12.0));
        assert!(near(section.torsion, 4.0 * (1.9f64 * 0.9).powi(2) / 56.0));
    }
}
