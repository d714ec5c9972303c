//! The joint of zero thickness between two faces: segment joints, cushion layers, construction
//! joints.
//!
//! Nodes 1–4 are the lower face, 5–8 the upper one opposite (a flattened brick); the right-handed
//! normal of 1–4 looks up. The law sees the jump u_upper − u_lower in the frame (normal, first
//! tangent, second tangent) of the middle surface and answers tractions. Openings are positive.

use super::quad::{self, Quadrature, Spot};
use super::{Element, ElementError};
use glam::DVec3;

/// Frame of a point: normal, tangent along the first natural direction, and the third.
#[must_use]
pub(crate) fn frame(spot: &Spot) -> [DVec3; 3] {
    [spot.normal, spot.tangent, spot.normal.cross(spot.tangent)]
}

/// Stiffness and force of the joint: `law(point, jump)` answers traction (Pa) and its derivative
/// (Pa/m). [`Quadrature::nodal`] couples no two nodes and does not oscillate under high penalties;
/// where a joint gapes within an element, take [`Quadrature::gauss`] with many points.
///
/// # Errors
/// [`ElementError::Degenerate`] without area, [`ElementError::NotFinite`].
pub(crate) fn interface(
    nodes: &[DVec3; 8],
    u: &[f64; 24],
    rule: &Quadrature,
    mut law: impl FnMut(usize, &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]),
) -> Result<Element<24>, ElementError> {
    let middle: [DVec3; 4] = std::array::from_fn(|a| 0.5 * (nodes[a] + nodes[a + 4]));
    let mut element = Element::zero();
    for (point, natural) in rule.points().enumerate() {
        let spot = quad::spot(&middle, natural, point)?;
        let rows = frame(&spot).map(|axis| {
            let mut row = [0.0; 24];
            for (a, n) in spot.shape.into_iter().enumerate() {
                for i in 0..3 {
                    row[3 * a + i] = -n * axis[i];
                    row[3 * (a + 4) + i] = n * axis[i];
                }
            }
            row
        });
        let jump = std::array::from_fn(|k| rows[k].iter().zip(u).map(|(r, u)| r * u).sum());
        let (traction, tangent) = law(point, &jump);
        element.add(&rows, &traction, &tangent, spot.area);
    }
    element.finite()
}

/// A linear joint: cushion of thickness t_c with normal = E_c/t_c and shear = G_c/t_c (Pa/m).
#[must_use]
pub(crate) fn elastic(normal: f64, shear: f64, jump: &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    (
        [normal * jump[0], shear * jump[1], shear * jump[2]],
        [[normal, 0.0, 0.0], [0.0, shear, 0.0], [0.0, 0.0, shear]],
    )
}

/// Share of the stiffness that an open joint keeps, so that a part that is held by joints alone has
/// a place: 10 Pa a millimetre for 10 GPa/m.
const OPEN: f64 = 1e-6;

/// No tension, Coulomb friction: |τ| ≤ c − μ σ while closed, nothing while open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Normal stiffness, penalty or E_c/t_c (Pa/m).
    pub normal: f64,
    /// Shear stiffness before sliding (Pa/m).
    pub shear: f64,
    /// μ.
    pub friction: f64,
    /// c (Pa).
    pub cohesion: f64,
}

/// What the joint answers to a jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    /// Normal and two shear tractions (Pa).
    pub traction: [f64; 3],
    /// ∂traction/∂jump (Pa/m). Not symmetric while sliding: the column of the normal jump carries
    /// −μ k_n; a symmetric solver drops it and iterates more.
    pub tangent: [[f64; 3]; 3],
    /// Slip so far (m), to be kept once the step has converged.
    pub slipped: [f64; 2],
}

impl Friction {
    /// The answer to a jump, given the slip of the last converged state (return mapping along the
    /// trial direction). An open joint forgets its slip: when it closes it sticks where it lands.
    #[must_use]
    pub(crate) fn respond(&self, jump: &[f64; 3], slipped: &[f64; 2]) -> Answer {
        let [opening, a, b] = *jump;
        // What touches without pressure is closed, or a model at rest would fall apart.
        if opening > 0.0 {
            let (traction, tangent) = elastic(
                OPEN * self.normal,
                OPEN * self.shear,
                &[opening, a - slipped[0], b - slipped[1]],
            );
            return Answer { traction, tangent, slipped: [a, b] };
        }
        let pressure = -self.normal * opening;
        let trial = [self.shear * (a - slipped[0]), self.shear * (b - slipped[1])];
        let (size, limit) =
            (trial[0].hypot(trial[1]), (self.cohesion + self.friction * pressure).max(0.0));
        if size <= limit {
            let (_, tangent) = elastic(self.normal, self.shear, jump);
            return Answer {
                traction: [-pressure, trial[0], trial[1]],
                tangent,
                slipped: *slipped,
            };
        }
        let way = trial.map(|t| t / size);
        let shear = way.map(|w| limit * w);
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        // A sliding joint keeps a little stiffness too, in the tangent alone: the answer does not
        // change, and nothing is without a place.
        let along = |i: usize, j: usize| {
            limit / size * self.shear * (unit(i, j) - way[i] * way[j])
                + OPEN * self.shear * unit(i, j)
        };
        let by_normal = way.map(|w| -self.friction * self.normal * w);
        Answer {
            traction: [-pressure, shear[0], shear[1]],
            tangent: [
                [self.normal, 0.0, 0.0],
                [by_normal[0], along(0, 0), along(0, 1)],
                [by_normal[1], along(1, 0), along(1, 1)],
            ],
            slipped: [a - shear[0] / self.shear, b - shear[1] / self.shear],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{differences, noise, off};

    const PLATE: [DVec3; 4] = [
        DVec3::ZERO,
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(2.0, 1.0, 0.5),
        DVec3::new(0.0, 1.0, 0.5),
    ];

    fn plate() -> [DVec3; 8] {
        std::array::from_fn(|a| PLATE[a % 4])
    }

    #[test]
    fn uniform_jump_and_rigid_motion() {
        let normal = DVec3::new(0.0, -0.5, 1.0).normalize();
        let shift = 0.2 * normal + 0.1 * DVec3::X;
        for rule in [Quadrature::nodal(), Quadrature::gauss(1), Quadrature::gauss(3)] {
            let u: [f64; 24] =
                std::array::from_fn(|c| 0.7 + if c < 12 { 0.0 } else { shift[c % 3] });
            let element = interface(&plate(), &u, &rule, |_, jump| {
                assert!(off(jump, &[0.2, 0.1, 0.0]) < 1e-13);
                elastic(10.0, 4.0, jump)
            })
            .unwrap();
            let upper: DVec3 = element.force[12..].chunks_exact(3).map(DVec3::from_slice).sum();
            let area = 2.0 * 1.25f64.sqrt();
            assert!((upper - area * (2.0 * normal + 0.4 * DVec3::X)).length() < 1e-13);
            let turn: [f64; 24] =
                std::array::from_fn(|c| DVec3::new(0.1, 0.2, -0.3).cross(plate()[c / 3])[c % 3]);
            assert!(
                interface(&plate(), &turn, &rule, |_, jump| elastic(10.0, 4.0, jump))
                    .unwrap()
                    .force
                    .iter()
                    .all(|f| f.abs() < 1e-14)
            );
        }
        assert!(
            interface(&[DVec3::ONE; 8], &[0.0; 24], &Quadrature::nodal(), |_, jump| elastic(
                1.0, 1.0, jump
            ))
            .is_err()
        );
    }

    #[test]
    fn tangent_by_differences_sliding_sticking_and_open() {
        let law = Friction { normal: 100.0, shear: 40.0, friction: 0.6, cohesion: 0.1 };
        for (seed, close) in [(1, -0.02), (2, -0.3), (3, 0.3), (4, 0.0)] {
            let u: [f64; 24] = std::array::from_fn(|c| {
                0.05 * noise::<24>(seed)[c] + if c >= 12 && c % 3 == 2 { close } else { 0.0 }
            });
            let at = |u: &[f64; 24]| {
                interface(&plate(), u, &Quadrature::gauss(2), |_, jump| {
                    let answer = law.respond(jump, &[0.01, -0.02]);
                    (answer.traction, answer.tangent)
                })
                .unwrap()
            };
            let slope = differences(&u, 1e-7, |u| at(u).force);
            let (ours, slope) = (at(&u).stiffness, slope);
            let worst = ours
                .as_flattened()
                .iter()
                .zip(slope.as_flattened())
                .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            assert!(worst < 1e-5, "seed {seed}: {worst}");
        }
    }

    #[test]
    fn friction_limits_shear_and_keeps_its_slip() {
        let law = Friction { normal: 100.0, shear: 50.0, friction: 0.5, cohesion: 0.0 };
        let stuck = law.respond(&[-0.1, 0.03, 0.04], &[0.0; 2]);
        assert_eq!((stuck.traction, stuck.slipped), ([-10.0, 1.5, 2.0], [0.0; 2]));
        let slid = law.respond(&[-0.1, 0.3, 0.4], &[0.0; 2]);
        assert!(
            off(&slid.traction, &[-10.0, 3.0, 4.0]) < 1e-14
                && off(&slid.slipped, &[0.24, 0.32]) < 1e-14
        );
        let back = law.respond(&[-0.1, 0.24, 0.32], &slid.slipped);
        assert!(back.traction[1].abs() < 1e-13 && back.traction[2].abs() < 1e-13);
        let open = law.respond(&[0.01, 0.3, 0.4], &slid.slipped);
        // Nothing but the millionth that keeps it in its place.
        assert!(
            open.slipped == [0.3, 0.4] && open.traction.iter().all(|t| t.abs() < 5.0 * OPEN),
            "{open:?}"
        );
    }

    /// Janssen's joint: M/φ = E b a²/12 closed, (9/8) E b a² m (1 − 2m)² with m = M/(N a) > 1/6, kn
    /// = E/a, rigid sides. Two unknowns, w and φ, by Newton.
    #[test]
    fn janssen_joint_opens() {
        let (a, b, e) = (0.4, 1.5, 30e9);
        let lower =
            [DVec3::ZERO, DVec3::new(a, 0.0, 0.0), DVec3::new(a, b, 0.0), DVec3::new(0.0, b, 0.0)];
        let nodes: [DVec3; 8] = std::array::from_fn(|k| lower[k % 4]);
        let joint = Friction { normal: e / a, shear: e / a, friction: 0.5, cohesion: 0.0 };
        let rule = Quadrature::gauss(48);
        let normal_force = 2e6;
        for m in [0.05, 0.15, 0.2, 0.3, 0.4] {
            let moment = m * normal_force * a;
            let (mut w, mut phi) = (-normal_force / (e / a * a * b), 0.0);
            let lever: [f64; 24] = std::array::from_fn(|c| {
                if c >= 12 && c % 3 == 2 { nodes[c / 3].x - 0.5 * a } else { 0.0 }
            });
            let lift: [f64; 24] =
                std::array::from_fn(|c| if c >= 12 && c % 3 == 2 { 1.0 } else { 0.0 });
            for _ in 0..60 {
                let u: [f64; 24] = std::array::from_fn(|c| w * lift[c] + phi * lever[c]);
                let element = interface(&nodes, &u, &rule, |_, jump| {
                    let answer = joint.respond(jump, &[0.0; 2]);
                    (answer.traction, answer.tangent)
                })
                .unwrap();
                let project = |x: &[f64; 24], y: &[f64; 24]| {
                    (0..24)
                        .map(|i| {
                            x[i] * (0..24).map(|j| element.stiffness[i][j] * y[j]).sum::<f64>()
                        })
                        .sum::<f64>()
                };
                let (kww, kwp, kpp) =
                    (project(&lift, &lift), project(&lift, &lever), project(&lever, &lever));
                let rw =
                    -normal_force - element.force.iter().zip(lift).map(|(f, l)| f * l).sum::<f64>();
                let rp = moment - element.force.iter().zip(lever).map(|(f, l)| f * l).sum::<f64>();
                let det = kww * kpp - kwp * kwp;
                w += (kpp * rw - kwp * rp) / det;
                phi += (kww * rp - kwp * rw) / det;
                if rw.abs() < 1e-9 * normal_force && rp.abs() < 1e-9 * moment {
                    break;
                }
            }
            let exact = if m <= 1.0 / 6.0 {
                e * b * a * a / 12.0
            } else {
                1.125 * e * b * a * a * m * (1.0 - 2.0 * m).powi(2)
            };
            let stiffness = moment / phi;
            let tolerance = if m < 1.0 / 6.0 { 1e-9 } else { 5e-3 };
            assert!(
                (stiffness / exact - 1.0).abs() < tolerance,
                "m = {m}: {stiffness:.6e} for {exact:.6e}"
            );
        }
    }
}
