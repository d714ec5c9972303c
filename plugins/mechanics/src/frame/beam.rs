//! A straight beam of two nodes in space, exact at its nodes: Timoshenko's beam under loads that
//! are even along it (Przemieniecki 1968, §5.6), with ends that may let go.
//!
//! x runs from the first end to the second, y as the beam says, z = x × y. Forces and moments of a
//! section are what the part beyond it (towards larger x) does to the part before it, as
//! right-handed vectors: N = ∫σ dA, M_y = ∫σ z dA, M_z = −∫σ y dA. Where y is up, a beam that sags
//! has M_z above 0.
//!
//! Unknowns: displacements and rotations of the first end, then of the second, three components
//! each.

use glam::{DMat3, DVec3};
use nalgebra::{SMatrix, SVector};

use super::section::Section;

pub(crate) type Matrix = SMatrix<f64, 12, 12>;
pub(crate) type Vector = SVector<f64, 12>;

/// A beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beam {
    /// Where it begins and ends, m.
    pub(crate) ends: [DVec3; 2],
    /// Unit, across: its y axis.
    pub(crate) across: DVec3,
    pub(crate) section: Section,
    /// E and G, Pa.
    pub(crate) moduli: [f64; 2],
    /// Which displacements (x, y, z) and rotations (about x, y, z) its ends do not take along.
    pub(crate) released: [[bool; 6]; 2],
}

/// What acts along a beam, evenly.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Along {
    /// In the world, N/m.
    pub(crate) force: DVec3,
    /// Strain of the axis, and curvature as change of strain with y, of what would be free: heat.
    pub(crate) strain: [f64; 2],
}

impl std::ops::AddAssign for Along {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        (0..2).for_each(|i| self.strain[i] += other.strain[i]);
    }
}

impl Along {
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { force: factor * self.force, strain: self.strain.map(|e| factor * e) }
    }
}

/// Forces and moments of a section.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Forces {
    /// N, V_y, V_z (N).
    pub(crate) force: DVec3,
    /// T, M_y, M_z (N m).
    pub(crate) moment: DVec3,
}

impl Beam {
    pub(crate) fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    /// Its axes x, y, z in the world.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let along = (self.ends[1] - self.ends[0]).normalize_or_zero();
        let across = self.across.reject_from(along).normalize_or_zero();
        [along, across, along.cross(across)]
    }

    /// The world in its own axes.
    fn turn(&self) -> Matrix {
        let axes = self.axes();
        Matrix::from_fn(|r, c| if r / 3 == c / 3 { axes[r % 3][c % 3] } else { 0.0 })
    }

    /// Stiffness, and what `along` does to the ends where they are held, in the world.
    pub(crate) fn integrate(&self, along: &Along) -> (Matrix, Vector) {
        let (stiffness, load) = self.own(along);
        let turn = self.turn();
        (turn.transpose() * stiffness * turn, turn.transpose() * load)
    }

    /// Stiffness and load in its own axes.
    fn own(&self, along: &Along) -> (Matrix, Vector) {
        let (l, s, [e, g]) = (self.length(), &self.section, self.moduli);
        let mut k = Matrix::zeros();
        let mut spring = |a: usize, b: usize, stiffness: f64| {
            for (r, c, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                k[(r, c)] += sign * stiffness;
            }
        };
        spring(0, 6, e * s.area / l);
        spring(3, 9, g * s.torsion / l);
        // Bending in x–y, about z; and in x–z about y, where a rotation tips the axis the other way.
        let planes = [(1, 5, s.second[1], s.shear[0], 1.0), (2, 4, s.second[0], s.shear[1], -1.0)];
        for (v, r, second, shear, way) in planes {
            let soft = 12.0 * e * second / (g * shear * l * l);
            let at = [v, r, v + 6, r + 6];
            let (x, near, far) = (way * 6.0 * l, (4.0 + soft) * l * l, (2.0 - soft) * l * l);
            let rows = [
                [12.0, x, -12.0, x],
                [x, near, -x, far],
                [-12.0, -x, 12.0, -x],
                [x, far, -x, near],
            ];
            let scale = e * second / (l.powi(3) * (1.0 + soft));
            for (row, values) in at.into_iter().zip(rows) {
                for (column, value) in at.into_iter().zip(values) {
                    k[(row, column)] += scale * value;
                }
            }
        }
        let mut load = Vector::zeros();
        let axes = self.axes();
        for (i, axis) in axes.into_iter().enumerate() {
            let half = 0.5 * l * along.force.dot(axis);
            load[i] += half;
            load[6 + i] += half;
        }
        let [q_y, q_z] = [axes[1], axes[2]].map(|axis| l * l / 12.0 * along.force.dot(axis));
        let stretch = e * s.area * along.strain[0];
        // Free curvature κ is a change of strain κ y: held back it is M_z = E I_z κ at both ends.
        let bend = e * s.second[1] * along.strain[1];
        for (i, value) in [(5, q_y), (11, -q_y), (4, -q_z), (10, q_z)] {
            load[i] += value;
        }
        for (i, value) in [(0, -stretch), (6, stretch), (5, bend), (11, -bend)] {
            load[i] += value;
        }
        self.let_go(&mut k, &mut load);
        (k, load)
    }

    /// What an end does not take along is condensed.
    fn let_go(&self, k: &mut Matrix, load: &mut Vector) {
        for i in (0..12).filter(|i| self.released[i / 6][i % 6]) {
            let pivot = k[(i, i)];
            // Let go at both ends, it turns freely: there is nothing left to condense.
            if pivot > 1e-12 * self.moduli[0] * self.section.second[0].min(self.section.torsion) {
                let (column, force) = (k.column(i).into_owned(), load[i] / pivot);
                *load -= force * column;
                *k -= column * column.transpose() / pivot;
            }
            k.fill_row(i, 0.0);
            k.fill_column(i, 0.0);
            load[i] = 0.0;
        }
    }

    /// What its nodes do to it at displacements `u` of its ends, in its own axes.
    pub(crate) fn held(&self, u: &Vector, along: &Along) -> Vector {
        let (stiffness, load) = self.own(along);
        stiffness * (self.turn() * u) - load
    }

    /// Forces of the section `x` metres from its beginning, where `held` is what its nodes do to
    /// it: equilibrium of the part before.
    pub(crate) fn forces(&self, held: &Vector, along: &Along, x: f64) -> Forces {
        let at = |i: usize| DVec3::new(held[i], held[i + 1], held[i + 2]);
        let load =
            DMat3::from_cols_array_2d(&self.axes().map(|a| a.to_array())).transpose() * along.force;
        let arm = x * DVec3::X;
        Forces {
            force: -at(0) - x * load,
            moment: -at(3) + arm.cross(at(0)) + 0.5 * x * arm.cross(load),
        }
    }
}
