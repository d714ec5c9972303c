//! Bricks that turn with what they are in: small strains in axes that go along with the element
//! (co-rotated), so that forces act where things are and columns buckle.
//!
//! The axes are those of R in F = R U, the polar decomposition of the displacement's gradient in
//! the middle of the brick. Displacements without that rotation, ū = Rᵀ(x − x_c) − (X − X_c), go
//! into the element of small displacements; its forces f̄ come back as f = R Pᵀ f̄, P being what a
//! small movement of the nodes leaves of ū: P = 1 + S H, where H v is the spin of the axes and S
//! the arms of the nodes (Nour-Omid and Rankin 1991). So forces are the derivative of the energy,
//! whatever the turn, and
//!
//! ```text
//! K = R (Pᵀ K̄ P − F H − Hᵀ Fᵀ P) Rᵀ, F = [f̄]ₓ, symmetric up to what vanishes in equilibrium.
//! ```

use glam::{DMat3, DVec3};

use super::hex8;

/// Axes of a brick that go along with it.
#[derive(Debug, Clone)]
pub(crate) struct Turn {
    /// R.
    rotation: DMat3,
    /// Middle of the nodes before and now, m.
    middle: [DVec3; 2],
    /// H by node: spin = Σ H v.
    spin: [DMat3; 8],
}

/// [a]ₓ: b ↦ a × b.
fn cross(a: DVec3) -> DMat3 {
    DMat3::from_cols_array(&[0.0, a.z, -a.y, -a.z, 0.0, a.x, a.y, -a.x, 0.0])
}

/// R of F = R U by Newton's iteration (Higham 1986); none: F folds space, or does not settle.
fn rotation(gradient: DMat3) -> Option<DMat3> {
    if gradient.determinant() <= 0.0 {
        return None;
    }
    let mut r = gradient;
    for _ in 0..30 {
        let next = 0.5 * (r + r.inverse().transpose());
        let change = (next - r).to_cols_array().iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        r = next;
        if change < 1e-14 {
            return Some(r);
        }
    }
    None
}

/// Three numbers a node as a vector.
fn at(u: &[f64], node: usize) -> DVec3 {
    DVec3::new(u[3 * node], u[3 * node + 1], u[3 * node + 2])
}

impl Turn {
    /// Of a brick with these displacements; none: it is folded.
    pub(crate) fn of(corners: &[DVec3; 8], u: &[f64; 24]) -> Option<Self> {
        let inverse = hex8::jacobian(corners, DVec3::ZERO).inverse().transpose();
        let slopes = hex8::slopes(DVec3::ZERO).map(|slope| inverse * slope);
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let gradient = (0..8).fold(DMat3::IDENTITY, |sum, a| sum + outer(at(u, a), slopes[a]));
        let rotation = rotation(gradient)?;
        let stretch = rotation.transpose() * gradient;
        let trace = stretch.x_axis.x + stretch.y_axis.y + stretch.z_axis.z;
        let turns = (DMat3::from_diagonal(DVec3::splat(trace)) - stretch).inverse();
        let before = corners.iter().sum::<DVec3>() / 8.0;
        let moved = (0..8).map(|a| at(u, a)).sum::<DVec3>() / 8.0;
        Some(Self {
            rotation,
            middle: [before, before + moved],
            spin: slopes.map(|slope| turns * cross(slope)),
        })
    }

    /// Displacement in the turning axes of what stood at `place` and moved by `u`, m.
    pub(crate) fn local(&self, place: DVec3, u: DVec3) -> DVec3 {
        self.rotation.transpose() * (place + u - self.middle[1]) - (place - self.middle[0])
    }

    /// The same of the brick's nodes.
    pub(crate) fn locals(&self, corners: &[DVec3; 8], u: &[f64; 24]) -> [f64; 24] {
        let local: [DVec3; 8] = std::array::from_fn(|a| self.local(corners[a], at(u, a)));
        std::array::from_fn(|i| local[i / 3][i % 3])
    }

    /// Brings stiffness and force of an element back into the world. Its first unknowns are the
    /// displacements of the brick's nodes, and of what stands at more `places` (before, with
    /// displacement in the turning axes); unknowns after these do not turn.
    pub(crate) fn bring_back(&self, places: &[(DVec3, DVec3)], k: &mut [f64], f: &mut [f64]) {
        let (width, nodes) = (f.len(), places.len());
        // S: arms of the nodes in the turning axes.
        let arms: Vec<DMat3> =
            places.iter().map(|&(place, local)| cross(place - self.middle[0] + local)).collect();
        // K P = K + (K S) H.
        for i in 0..width {
            let row = &mut k[i * width..(i + 1) * width];
            let lever =
                (0..nodes).fold(DVec3::ZERO, |sum, a| sum + arms[a].transpose() * at(row, a));
            for (a, spin) in self.spin.iter().enumerate() {
                let more = spin.transpose() * lever;
                (0..3).for_each(|c| row[3 * a + c] += more[c]);
            }
        }
        // Pᵀ (K P) and Pᵀ f.
        for j in 0..width {
            let lever = (0..nodes).fold(DVec3::ZERO, |sum, a| {
                let column = DVec3::from_array(std::array::from_fn(|c| k[(3 * a + c) * width + j]));
                sum + arms[a].transpose() * column
            });
            for (a, spin) in self.spin.iter().enumerate() {
                let more = spin.transpose() * lever;
                (0..3).for_each(|c| k[(3 * a + c) * width + j] += more[c]);
            }
        }
        let lever = (0..nodes).fold(DVec3::ZERO, |sum, a| sum + arms[a].transpose() * at(f, a));
        for (a, spin) in self.spin.iter().enumerate() {
            let more = spin.transpose() * lever;
            (0..3).for_each(|c| f[3 * a + c] += more[c]);
        }
        // − F H − Hᵀ Fᵀ − Hᵀ Fᵀ S H, the last by its symmetric part.
        let levers = (0..nodes)
            .fold(DMat3::ZERO, |sum, a| sum + cross(at(f, a)) * arms[a].transpose())
            .transpose();
        let levers = -0.5 * (levers + levers.transpose());
        for (a, first) in self.spin.iter().enumerate() {
            for (b, second) in self.spin.iter().enumerate() {
                let block = first.transpose() * levers * *second;
                for r in 0..3 {
                    (0..3).for_each(|c| k[(3 * a + r) * width + 3 * b + c] += block.col(c)[r]);
                }
            }
        }
        for a in 0..nodes {
            let force = cross(at(f, a));
            for (b, spin) in self.spin.iter().enumerate() {
                let block = force * *spin;
                for r in 0..3 {
                    for c in 0..3 {
                        let value = block.col(c)[r];
                        k[(3 * a + r) * width + 3 * b + c] -= value;
                        k[(3 * b + c) * width + 3 * a + r] -= value;
                    }
                }
            }
        }
        self.rotate(nodes, k, f);
    }

    /// R K Rᵀ and R f of the first `nodes`.
    fn rotate(&self, nodes: usize, k: &mut [f64], f: &mut [f64]) {
        let (width, r) = (f.len(), self.rotation);
        for a in 0..nodes {
            let turned = r * at(f, a);
            (0..3).for_each(|c| f[3 * a + c] = turned[c]);
            for i in 0..width {
                let row = &mut k[i * width..(i + 1) * width];
                let turned = r * at(row, a);
                (0..3).for_each(|c| row[3 * a + c] = turned[c]);
            }
        }
        for a in 0..nodes {
            for j in 0..width {
                let place = |c: usize| (3 * a + c) * width + j;
                let turned = r * DVec3::new(k[place(0)], k[place(1)], k[place(2)]);
                (0..3).for_each(|c| k[place(c)] = turned[c]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::hex8::{CORNERS, Kind, Modes};
    use crate::tensor::{apply, stiffness};

    /// A skew brick.
    fn corners() -> [DVec3; 8] {
        CORNERS.map(|c| DVec3::new(c.x + 0.2 * c.y, 0.7 * c.y + 0.1 * c.x * c.z, 1.3 * c.z))
    }

    /// Displacements that turn by `angle` about an oblique axis and strain by thousandths.
    fn moved(angle: f64) -> [f64; 24] {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle);
        let strained = corners().map(|p| {
            p + 1e-3 * DVec3::new(p.x + 2.0 * p.y * p.z, -p.y + p.x * p.x, 0.5 * p.z * p.x)
        });
        std::array::from_fn(|i| {
            (turn * strained[i / 3] + DVec3::new(3.0, -1.0, 2.0) - corners()[i / 3])[i % 3]
        })
    }

    fn element(u: &[f64; 24]) -> (Vec<f64>, Vec<f64>) {
        let (corners, law) = (corners(), stiffness(30.0, 0.2));
        let turn = Turn::of(&corners, u).unwrap();
        let local = turn.locals(&corners, u);
        let solid =
            hex8::integrate(Kind::Plain, &corners, &local, &mut Modes::default(), |_, e| {
                (apply(&law, e), law)
            })
            .unwrap();
        let (mut k, mut f) = (solid.stiffness.as_flattened().to_vec(), solid.force.to_vec());
        let places: Vec<_> = (0..8).map(|a| (corners[a], at(&local, a))).collect();
        turn.bring_back(&places, &mut k, &mut f);
        (k, f)
    }

    #[test]
    fn a_turned_brick_strains_as_it_did_and_its_forces_turn_with_it() {
        let (_, still) = element(&moved(0.0));
        for angle in [0.3, 1.2, 3.0] {
            let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle);
            let (_, turned) = element(&moved(angle));
            for a in 0..8 {
                assert!((turn * at(&still, a)).distance(at(&turned, a)) < 1e-10, "{angle} {a}");
            }
        }
    }

    #[test]
    fn forces_are_in_balance_where_the_brick_is_now() {
        let (u, corners) = (moved(0.8), corners());
        let (_, f) = element(&u);
        let force: DVec3 = (0..8).map(|a| at(&f, a)).sum();
        let moment: DVec3 = (0..8).map(|a| (corners[a] + at(&u, a)).cross(at(&f, a))).sum();
        let size: f64 = (0..8).map(|a| at(&f, a).length()).sum();
        assert!(force.length() < 1e-12 * size.max(1.0) && moment.length() < 1e-10 * size);
    }

    #[test]
    fn the_stiffness_is_what_forces_change_by() {
        let u = moved(0.8);
        let (k, f) = element(&u);
        let scale = k.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for j in 0..24 {
            let mut more = u;
            more[j] += 1e-6;
            let (_, g) = element(&more);
            for i in 0..24 {
                let numeric = (g[i] - f[i]) / 1e-6;
                // What the stress adds is a thousandth; what is left out its square.
                let off = (numeric - k[24 * i + j]).abs() / scale;
                assert!(off < 2e-5, "{i} {j} {off}");
            }
        }
    }
}
