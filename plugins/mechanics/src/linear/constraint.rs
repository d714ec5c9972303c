//! Linear constraints between unknowns: every one that is bound becomes a sum over free ones and a
//! constant, u = T q + c, whatever the order in which supports, equations and ties come.

use std::collections::HashMap;

/// An unknown: three times the node, and the component.
pub(super) type Unknown = u32;

/// Σ factor · unknown + constant.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Sum {
    pub(super) terms: Vec<(Unknown, f64)>,
    pub(super) constant: f64,
}

/// Σ factor · unknown = value, and whence it comes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equation {
    pub(super) terms: Vec<(Unknown, f64)>,
    pub(super) value: f64,
    /// Line of the deck; 0: no line says so.
    pub(super) line: u32,
}

/// What of an equation is left counts as nothing, over its largest factor.
const NOTHING: f64 = 1e-12;

/// What is bound, in terms of what is free.
#[derive(Debug, Default)]
pub(super) struct Bound(HashMap<Unknown, Sum>);

impl Bound {
    /// Eliminates, in the order given.
    ///
    /// # Errors
    /// The equation that contradicts those before it.
    pub(super) fn new<'a>(
        equations: impl IntoIterator<Item = &'a Equation>,
    ) -> Result<Self, &'a Equation> {
        let mut bound = Self::default();
        for equation in equations {
            let scale = equation.terms.iter().map(|t| t.1.abs()).fold(0.0, f64::max);
            let mut left = Sum { terms: Vec::new(), constant: -equation.value };
            for &(unknown, factor) in &equation.terms {
                bound.add(&mut left, unknown, factor);
            }
            left.terms.retain(|t| t.1.abs() > NOTHING * scale);
            let Some(&(pivot, factor)) =
                left.terms.iter().reduce(|a, b| if b.1.abs() > a.1.abs() { b } else { a })
            else {
                // What cancels is known to its own digits.
                let part = |&(u, f): &(Unknown, f64)| (f * bound.of(u).constant).abs();
                let known = equation.terms.iter().map(part).fold(equation.value.abs(), f64::max);
                let size = known.max(scale * 1e-9);
                if left.constant.abs() > 1e-9 * size {
                    return Err(equation);
                }
                continue;
            };
            left.terms.retain(|t| t.0 != pivot);
            left.terms.iter_mut().for_each(|t| t.1 /= -factor);
            left.constant /= -factor;
            bound.0.insert(pivot, left);
        }
        bound.settle();
        Ok(bound)
    }

    /// Adds factor · unknown to a sum, by what is free.
    fn add(&self, to: &mut Sum, unknown: Unknown, factor: f64) {
        match self.0.get(&unknown) {
            None => match to.terms.iter_mut().find(|t| t.0 == unknown) {
                Some(term) => term.1 += factor,
                None => to.terms.push((unknown, factor)),
            },
            Some(sum) => {
                to.constant += factor * sum.constant;
                sum.terms.iter().for_each(|&(u, f)| self.add(to, u, factor * f));
            }
        }
    }

    /// Puts in what was bound after it was named, so that every sum is over free unknowns.
    fn settle(&mut self) {
        let open: Vec<Unknown> = self
            .0
            .iter()
            .filter(|(_, sum)| sum.terms.iter().any(|t| self.0.contains_key(&t.0)))
            .map(|(&unknown, _)| unknown)
            .collect();
        let closed: Vec<(Unknown, Sum)> = open.into_iter().map(|u| (u, self.of(u))).collect();
        self.0.extend(closed);
    }

    /// An unknown by what is free: itself where it is.
    pub(super) fn of(&self, unknown: Unknown) -> Sum {
        let mut sum = Sum::default();
        self.add(&mut sum, unknown, 1.0);
        sum.terms.sort_unstable_by_key(|t| t.0);
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn equation(terms: &[(Unknown, f64)], value: f64) -> Equation {
        Equation { terms: terms.to_vec(), value, line: 0 }
    }

    #[test]
    fn chains_end_at_what_is_free_in_any_order() {
        // a = 2 b, b + c = 3, c = d: a = 6 − 2 d.
        let mut all = [
            equation(&[(0, 1.0), (1, -2.0)], 0.0),
            equation(&[(1, 1.0), (2, 1.0)], 3.0),
            equation(&[(2, 1.0), (3, -1.0)], 0.0),
        ];
        for _ in 0..3 {
            let bound = Bound::new(&all).unwrap();
            // Whatever is left free, every equation holds for any value of it.
            for equation in &all {
                let mut left = Sum::default();
                equation.terms.iter().for_each(|&(u, f)| bound.add(&mut left, u, f));
                assert!((left.constant - equation.value).abs() < 1e-12);
                assert!(left.terms.iter().all(|t| t.1.abs() < 1e-12), "{left:?}");
            }
            all.rotate_left(1);
        }
    }

    #[test]
    fn what_is_said_twice_does_no_harm_and_what_contradicts_is_named() {
        let same = [equation(&[(0, 1.0)], 2.0), equation(&[(0, 3.0)], 6.0)];
        assert_eq!(Bound::new(&same).unwrap().of(0), Sum { terms: vec![], constant: 2.0 });
        let other = [same[0].clone(), equation(&[(0, 1.0)], 2.5)];
        assert_eq!(Bound::new(&other).unwrap_err(), &other[1]);
    }
}
