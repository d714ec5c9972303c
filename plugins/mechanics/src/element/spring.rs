//! Ground on a face: springs per area (Winkler), one along the radius, two across it.
//!
//! The law sees the face's displacement as (radial, first tangent, second tangent) and answers the
//! traction that resists it.

use super::quad::{self, Quadrature, Spot};
use super::{Element, ElementError};
use glam::DVec3;

/// Stiffness and force of the ground on a face of four nodes. `outward(spot)` is the direction
/// towards the ground (a radius; need not be the facet's normal), `law(point, displacement)`
/// answers traction (Pa) and its derivative (Pa/m).
///
/// # Errors
/// [`ElementError::Degenerate`] without area or direction, [`ElementError::NotFinite`].
pub(crate) fn ground(
    nodes: &[DVec3; 4],
    u: &[f64; 12],
    rule: &Quadrature,
    outward: impl Fn(&Spot) -> DVec3,
    mut law: impl FnMut(usize, &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]),
) -> Result<Element<12>, ElementError> {
    let mut element = Element::zero();
    for (point, natural) in rule.points().enumerate() {
        let spot = quad::spot(nodes, natural, point)?;
        let normal = outward(&spot).try_normalize().ok_or(ElementError::Degenerate { point })?;
        let tangent = spot
            .tangent
            .reject_from_normalized(normal)
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        let rows = [normal, tangent, normal.cross(tangent)]
            .map(|axis| std::array::from_fn(|c: usize| spot.shape[c / 3] * axis[c % 3]));
        let moved = rows.map(|row: [f64; 12]| row.iter().zip(u).map(|(r, u)| r * u).sum());
        let (traction, tangent) = law(point, &moved);
        element.add(&rows, &traction, &tangent, spot.area);
    }
    element.finite()
}

/// Ground that pushes and never pulls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winkler {
    /// k_r (Pa/m), E/((1 + ν) R) for a uniformly pressed tunnel.
    pub radial: f64,
    /// k_t (Pa/m), 0 … k_r/3.
    pub tangential: f64,
    /// Ground pressure before the lining moves (Pa).
    pub pressure: f64,
}

impl Winkler {
    /// p = p₀ + k_r u_r where positive, with shear k_t u_t; nothing where the lining has come away.
    #[must_use]
    pub(crate) fn respond(&self, moved: &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let pressure = self.pressure + self.radial * moved[0];
        if pressure < 0.0 {
            return ([0.0; 3], [[0.0; 3]; 3]);
        }
        let (k, t) = (self.radial, self.tangential);
        ([pressure, t * moved[1], t * moved[2]], [[k, 0.0, 0.0], [0.0, t, 0.0], [0.0, 0.0, t]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{differences, noise};
    use crate::element::rod::rod;

    /// Ring of bars on ground under inner pressure: u = p/(E t/R² + k_r) = 0.25914 mm (research
    /// §2), all nodes moving alike; the polygon's error falls with n².
    #[test]
    fn ring_in_the_ground() {
        let (radius, thick, e, p) = (3.0f64, 0.3, 34.5e9, 0.3e6);
        let soil = Winkler { radial: 30e6 / 1.3 / radius, tangential: 1e6, pressure: 0.0 };
        let exact = p / (e * thick / (radius * radius) + soil.radial);
        assert!((exact - 0.25914e-3).abs() < 5e-9);
        let error = |n: usize| {
            let at = |i: usize, z: f64| {
                let angle = std::f64::consts::TAU * i as f64 / n as f64;
                DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
            };
            let face = [at(0, 0.0), at(1, 0.0), at(1, 1.0), at(0, 1.0)];
            let radial = |x: DVec3| DVec3::new(x.x, x.y, 0.0).normalize();
            let move_face: [f64; 12] = std::array::from_fn(|c| radial(face[c / 3])[c % 3]);
            let ground = ground(
                &face,
                &[0.0; 12],
                &Quadrature::gauss(2),
                |s| radial(s.at),
                |_, d| soil.respond(d),
            )
            .unwrap();
            let bar = rod(&[face[0], face[1]], &[0.0; 6], thick, |s| (e * s, e)).unwrap();
            let soft: f64 = (0..12)
                .map(|i| {
                    move_face[i]
                        * (0..12).map(|j| ground.stiffness[i][j] * move_face[j]).sum::<f64>()
                })
                .sum();
            let move_bar: [f64; 6] = std::array::from_fn(|c| move_face[c]);
            let stiff: f64 = (0..6)
                .map(|i| {
                    move_bar[i] * (0..6).map(|j| bar.stiffness[i][j] * move_bar[j]).sum::<f64>()
                })
                .sum();
            // Pressure works on the chord's normal; both ends move (cos π/n) along it.
            let half = std::f64::consts::PI / n as f64;
            let load = p * 2.0 * radius * half.sin() * half.cos();
            (load / (soft + stiff) - exact).abs() / exact
        };
        let (coarse, fine) = (error(40), error(80));
        assert!(fine < 1e-3 && (coarse / fine - 4.0).abs() < 0.1, "{coarse} {fine}");
    }

    #[test]
    fn ground_lets_go_and_its_tangent_agrees_with_differences() {
        let face = [
            DVec3::ZERO,
            DVec3::new(2.0, 0.1, 0.0),
            DVec3::new(2.1, 1.0, 0.3),
            DVec3::new(0.0, 1.2, 0.0),
        ];
        let soil = Winkler { radial: 9.0, tangential: 2.0, pressure: 0.4 };
        let at = |u: &[f64; 12]| {
            ground(&face, u, &Quadrature::gauss(2), |s| s.normal, |_, d| soil.respond(d)).unwrap()
        };
        for seed in 0..4 {
            let u = noise::<12>(seed).map(|x| 0.2 * x);
            let slope = differences(&u, 1e-7, |u| at(u).force);
            let worst = at(&u)
                .stiffness
                .as_flattened()
                .iter()
                .zip(slope.as_flattened())
                .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            assert!(worst < 1e-6, "{worst}");
        }
        let away: [f64; 12] = std::array::from_fn(|c| if c % 3 == 2 { -0.5 } else { 0.0 });
        assert!(at(&away).force.iter().all(|f| *f == 0.0));
        assert!(
            ground(
                &face,
                &[0.0; 12],
                &Quadrature::nodal(),
                |_| DVec3::ZERO,
                |_, d| soil.respond(d)
            )
            .is_err()
        );
    }
}
