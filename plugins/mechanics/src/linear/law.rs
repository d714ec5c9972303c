//! Constants of materials that may change with temperature: linear between the temperatures of the
//! deck, constant beyond them.

use crate::tensor::{self, Tangent};

/// Abaqus' order 11, 22, 33, 12, 13, 23 in ours.
pub(super) const ORDER: [usize; 6] = [0, 1, 2, 3, 5, 4];

/// N constants by temperature, which ascends.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table<const N: usize>(Vec<(f64, [f64; N])>);

impl<const N: usize> Table<N> {
    /// The same at every temperature.
    pub(super) fn constant(values: [f64; N]) -> Self {
        Self(vec![(0.0, values)])
    }

    /// Rows of N constants, each followed by its temperature; a single row may leave that out.
    pub(super) fn of(numbers: &[f64]) -> Option<Self> {
        if let Ok(values) = numbers.try_into() {
            return Some(Self::constant(values));
        }
        let row = |c: &[f64]| Some((c[N], c[..N].try_into().ok()?));
        let rows: Option<Vec<(f64, [f64; N])>> = numbers.chunks_exact(N + 1).map(row).collect();
        let whole = !numbers.is_empty() && numbers.len().is_multiple_of(N + 1);
        rows.filter(|r| whole && r.is_sorted_by(|a, b| a.0 < b.0)).map(Self)
    }

    /// Every row by what makes it another.
    pub(super) fn map<const M: usize, E>(
        &self,
        make: impl Fn(&[f64; N]) -> Result<[f64; M], E>,
    ) -> Result<Table<M>, E> {
        let rows = self.0.iter().map(|(t, row)| Ok((*t, make(row)?)));
        rows.collect::<Result<_, _>>().map(Table)
    }

    /// Whether it is the same at every temperature.
    pub(super) fn is_constant(&self) -> bool {
        self.0.len() == 1
    }

    /// So many times as much at every temperature.
    pub(super) fn scaled(&self, by: f64) -> Self {
        Self(self.0.iter().map(|(t, row)| (*t, row.map(|v| v * by))).collect())
    }

    /// The rows themselves.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[f64; N]> {
        self.0.iter().map(|r| &r.1)
    }

    /// The constants at a temperature.
    pub(super) fn at(&self, temperature: f64) -> [f64; N] {
        let i = self.0.partition_point(|r| r.0 <= temperature);
        let last = self.0.len() - 1;
        let (low, high) = (&self.0[i.saturating_sub(1)], &self.0[i.min(last)]);
        if high.0 <= low.0 {
            return low.1;
        }
        let share = ((temperature - low.0) / (high.0 - low.0)).clamp(0.0, 1.0);
        std::array::from_fn(|k| low.1[k] + share * (high.1[k] - low.1[k]))
    }
}

/// Hooke's law along the axes of a material, Pa.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Elastic {
    /// Young's modulus and Poisson's ratio.
    Isotropic(Table<2>),
    /// 1111, 1122, 2222, 1133, 2233, 3333, 1212, 1313, 2323.
    Orthotropic(Table<9>),
    /// The upper triangle, column by column, in Abaqus' order.
    Anisotropic(Table<21>),
}

impl Elastic {
    pub(super) fn stiffness(&self, temperature: f64) -> Tangent {
        match self {
            Self::Isotropic(table) => {
                let [young, poisson] = table.at(temperature);
                tensor::stiffness(young, poisson)
            }
            Self::Orthotropic(table) => orthotropic(&table.at(temperature)),
            Self::Anisotropic(table) => anisotropic(&table.at(temperature)),
        }
    }

    /// The law of every row of the table.
    pub(super) fn all(&self) -> Vec<Tangent> {
        match self {
            Self::Isotropic(t) => t.rows().map(|r| tensor::stiffness(r[0], r[1])).collect(),
            Self::Orthotropic(t) => t.rows().map(orthotropic).collect(),
            Self::Anisotropic(t) => t.rows().map(anisotropic).collect(),
        }
    }
}

/// Strains of free swelling: α(T)(T − Z) − α(T₀)(T₀ − Z), none at the temperature T₀ of the
/// beginning; Z is that at which the table counts from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expansion {
    /// 1/K along the axes of the material.
    pub(super) table: Table<3>,
    pub(super) zero: f64,
}

impl Expansion {
    pub(super) fn strain(&self, now: f64, cold: f64) -> [f64; 3] {
        let (a, b) = (self.table.at(now), self.table.at(cold));
        std::array::from_fn(|i| a[i] * (now - self.zero) - b[i] * (cold - self.zero))
    }
}

fn orthotropic(n: &[f64; 9]) -> Tangent {
    let mut law = [[0.0; 6]; 6];
    for (value, (i, j)) in n.iter().zip([(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]) {
        (law[i][j], law[j][i]) = (*value, *value);
    }
    (law[3][3], law[5][5], law[4][4]) = (n[6], n[7], n[8]);
    law
}

fn anisotropic(n: &[f64; 21]) -> Tangent {
    let mut law = [[0.0; 6]; 6];
    let mut values = n.iter();
    for (column, &b) in ORDER.iter().enumerate() {
        for &a in &ORDER[..=column] {
            let value = values.next().copied().unwrap_or(0.0);
            (law[a][b], law[b][a]) = (value, value);
        }
    }
    law
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_linear_between_their_rows_and_constant_beyond() {
        let table = Table::<2>::of(&[200.0, 0.3, 0.0, 100.0, 0.2, 100.0]).unwrap();
        assert_eq!(table.at(-5.0), [200.0, 0.3]);
        assert_eq!(table.at(25.0), [175.0, 0.275]);
        assert_eq!(table.at(1e4), [100.0, 0.2]);
        assert_eq!(Table::<2>::of(&[200.0, 0.3]).unwrap().at(7.0), [200.0, 0.3]);
        assert_eq!(Table::<2>::of(&[200.0, 0.3, 9.0, 1.0]), None);
        assert_eq!(Table::<1>::of(&[1.0, 5.0, 2.0, 5.0]), None);
    }

    #[test]
    fn swelling_counts_from_its_zero_and_is_none_at_the_beginning() {
        let table = Table::<1>::of(&[1e-3, 0.0, 2e-3, 100.0]).unwrap();
        let table = table.map(|&[a]| Ok::<_, ()>([a; 3])).unwrap();
        let law = Expansion { table, zero: -10.0 };
        assert_eq!(law.strain(20.0, 20.0), [0.0; 3]);
        // 2e-3 · 110 − 1.2e-3 · 30.
        assert!((law.strain(100.0, 20.0)[0] - 0.184).abs() < 1e-15);
    }
}
