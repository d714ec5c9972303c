use nalgebra::DVector;

use super::{MatrixProblem, Row};
use crate::{
    Side,
    field::{Field, FieldEvidence, shares},
};

/// A far field of the matrix problem, state by state: Φ̃ steers primal walks, Φ̃* dual ones.
#[derive(Debug, Clone)]
pub struct MatrixField {
    table: DVector<f64>,
    /// Of each place, a state or the start: K_ij F_j.
    rows: Vec<Row>,
}

/// What one walk has found at one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatrixSample {
    /// Number of the state.
    pub state: u32,
    /// Photon: weight of a visit over all walks, so that the sum over all visits is the field.
    /// Suffix: an unbiased estimate of it.
    pub value: f64,
    /// Which of the two.
    pub photon: bool,
}

impl MatrixField {
    /// The field with these values, for the walks of `side`.
    ///
    /// # Panics
    /// If there is not one value a state: a mistake of the caller, not of data.
    #[must_use]
    pub fn new(problem: &MatrixProblem, side: Side, table: DVector<f64>) -> Self {
        assert_eq!(problem.len(), table.len(), "a field has one value a state");
        let steered = |row: &Row| {
            Row::new(row.weights.iter().zip(table.iter()).map(|(k, f)| k * f).collect())
        };
        let rows = problem.rows[side as usize].iter().map(steered).collect();
        Self { table, rows }
    }

    /// A field that knows nothing.
    #[must_use]
    pub(crate) fn nothing(problem: &MatrixProblem, side: Side) -> Self {
        Self::new(problem, side, DVector::zeros(problem.len()))
    }

    /// F, one a state.
    #[must_use]
    pub fn table(&self) -> &DVector<f64> {
        &self.table
    }

    fn row(&self, place: u32) -> &Row {
        &self.rows[(place as usize).min(self.table.len())]
    }
}

impl Field for MatrixField {
    type Real = f64;
    /// A state; whatever is none is the start.
    type Place = u32;
    type Way = u32;
    type TrainingSample = MatrixSample;
    type Domain<'g> = (&'g MatrixProblem, Side);

    fn learn(&(problem, side): &Self::Domain<'_>, lessons: Vec<MatrixSample>) -> Self {
        let mut found = vec![[FieldEvidence::default(); 2]; problem.len()];
        for lesson in lessons {
            if let Some(found) = found.get_mut(lesson.state as usize) {
                found[usize::from(!lesson.photon)].add(lesson.value);
            }
        }
        let value = |[photons, suffixes]: &[FieldEvidence; 2]| {
            let [a, b] = shares(photons, suffixes);
            a * photons.sum + b * suffixes.sum / suffixes.n.max(1) as f64
        };
        Self::new(problem, side, DVector::from_iterator(found.len(), found.iter().map(value)))
    }

    fn is_empty(&self) -> bool {
        self.table.iter().all(|&f| f <= 0.0)
    }

    fn value(&self, &place: &u32) -> f64 {
        self.row(place).total()
    }

    fn sample(&self, &place: &u32, _: f64, u: [f64; 4]) -> Option<u32> {
        self.row(place).pick(u[0]).map(|j| j as u32)
    }

    fn density(&self, &place: &u32, value: f64, way: u32) -> f64 {
        self.row(place).weights[way as usize] / value
    }
}
