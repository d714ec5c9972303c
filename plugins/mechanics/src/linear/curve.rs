//! Constraints that are linear only where displacements are small: bodies that turn as a whole and
//! may widen, mean angles, nodes that stay in a plane or on a line. Each gives its equations about any
//! displacements; those about none are the linear ones.

use glam::{DMat3, DVec3};

use super::constraint::Equation;

/// What binds nodes.
#[derive(Debug, Clone)]
pub(super) enum Curve {
    /// u = u₀ + (R(θ)(1 + Σ sₖ Sₖ) − 1)(x − x₀): the node of u₀, that of θ times a unit, the others,
    /// and in which ways Sₖ they widen, each with the unknown that sₖ is.
    Body { reference: u32, turning: u32, unit: f64, nodes: Vec<u32>, widens: Vec<(u32, DMat3)> },
    /// The mean angle about an axis through their middle is an unknown over a unit.
    Turn { nodes: Vec<u32>, axis: DVec3, angle: u32, unit: f64 },
}

/// One of a deck, and the place of its equations among those of the deck.
#[derive(Debug, Clone)]
pub(super) struct Curved {
    pub(super) curve: Curve,
    pub(super) first: usize,
    pub(super) line: u32,
}

/// Nodes as they were, and what every unknown is.
struct Now<'a, F: Fn(u32) -> f64> {
    places: &'a [DVec3],
    moved: F,
}

impl<F: Fn(u32) -> f64> Now<'_, F> {
    fn was(&self, node: u32) -> DVec3 {
        self.places[node as usize]
    }

    fn moved(&self, node: u32) -> DVec3 {
        DVec3::new((self.moved)(3 * node), (self.moved)(3 * node + 1), (self.moved)(3 * node + 2))
    }

    fn is(&self, node: u32) -> DVec3 {
        self.was(node) + self.moved(node)
    }

    /// g + Σ slope · δu = 0 for nodes of these slopes.
    fn equation(&self, slopes: &[(u32, DVec3)], g: f64) -> Equation {
        let value = slopes.iter().map(|&(n, s)| s.dot(self.moved(n))).sum::<f64>() - g;
        Equation { terms: terms(slopes), value, line: 0 }
    }
}

impl Curved {
    /// Its equations about displacements; none where its nodes are too few to say anything.
    pub(super) fn equations(
        &self,
        places: &[DVec3],
        moved: impl Fn(u32) -> f64,
    ) -> Option<Vec<Equation>> {
        let now = Now { places, moved };
        let mut all = match &self.curve {
            Curve::Body { reference, turning, unit, nodes, widens } => {
                body(&now, [*reference, *turning], *unit, nodes, widens)
            }
            Curve::Turn { nodes, axis, angle, unit } => {
                let (slopes, mean) = turn(&now, nodes, *axis)?;
                let mut equation = now.equation(&slopes, mean);
                equation.terms.push((*angle, -1.0 / unit));
                vec![equation]
            }
        };
        all.iter_mut().for_each(|e| e.line = self.line);
        Some(all)
    }
}

fn body<F: Fn(u32) -> f64>(
    now: &Now<'_, F>,
    [reference, turning]: [u32; 2],
    unit: f64,
    nodes: &[u32],
    widens: &[(u32, DMat3)],
) -> Vec<Equation> {
    let angles = now.moved(turning) / unit;
    let mut all = Vec::with_capacity(3 * nodes.len());
    for &node in nodes {
        let arm = now.was(node) - now.was(reference);
        let wide: DVec3 = widens.iter().map(|&(u, way)| (now.moved)(u) * (way * arm)).sum();
        let (turned, slopes) = rotated(angles, arm + wide);
        let by_angle = (3 * turning..).zip(slopes).map(|(u, slope)| (u, slope / unit));
        let by_width = widens.iter().map(|&(u, way)| (u, rotated(angles, way * arm).0));
        let changes: Vec<(u32, DVec3)> = by_angle.chain(by_width).collect();
        for i in 0..3 {
            let mut terms = vec![(3 * node + i, 1.0), (3 * reference + i, -1.0)];
            let mut value = turned[i as usize] - arm[i as usize];
            for &(unknown, change) in &changes {
                let slope = change[i as usize];
                value -= slope * (now.moved)(unknown);
                if slope != 0.0 {
                    terms.push((unknown, -slope));
                }
            }
            all.push(Equation { terms, value, line: 0 });
        }
    }
    all
}

/// An arm turned by a vector of angles, and its slopes by these (Rodrigues).
fn rotated(angles: DVec3, arm: DVec3) -> (DVec3, [DVec3; 3]) {
    let square = angles.length_squared();
    let size = square.sqrt();
    // sin φ/φ, (1 − cos φ)/φ², and their slopes over φ.
    let (a, b) = if size < 1e-4 {
        (1.0 - square / 6.0, 0.5 - square / 24.0)
    } else {
        (size.sin() / size, (1.0 - size.cos()) / square)
    };
    let (da, db) = if size < 1e-2 {
        (square / 30.0 - 1.0 / 3.0, square / 180.0 - 1.0 / 12.0)
    } else {
        ((size.cos() - a) / square, (a - 2.0 * b) / square)
    };
    let once = angles.cross(arm);
    let twice = angles.cross(once);
    let slope = |axis: DVec3| {
        let along = axis.dot(angles);
        let inner = axis.cross(arm);
        along * (da * once + db * twice) + a * inner + b * (axis.cross(once) + angles.cross(inner))
    };
    (arm + a * once + b * twice, DVec3::AXES.map(slope))
}

/// Slopes of the mean angle of nodes about an axis through their middle, and that angle: with r
/// where the arm of a node was and s where it is, both across the axis, (1/n) Σ ∠(r, s) (Dhondt,
/// *The Finite Element Method for Three-Dimensional Thermomechanical Applications*, sec. 3.6).
/// Nodes on the axis say nothing; none where all lie on it.
fn turn<F: Fn(u32) -> f64>(
    now: &Now<'_, F>,
    nodes: &[u32],
    axis: DVec3,
) -> Option<(Vec<(u32, DVec3)>, f64)> {
    let count = nodes.len() as f64;
    let arms = |place: &dyn Fn(u32) -> DVec3| -> Vec<DVec3> {
        let middle = nodes.iter().map(|&n| place(n)).sum::<DVec3>() / count;
        nodes.iter().map(|&n| (place(n) - middle).reject_from_normalized(axis)).collect()
    };
    let (were, are) = (arms(&|n| now.was(n)), arms(&|n| now.is(n)));
    let reach = were.iter().map(|r| r.length()).fold(0.0, f64::max);
    let beside = |r: &DVec3| r.length() > 1e-6 * reach;
    let several = were.iter().filter(|r| beside(r)).count() as f64;
    if reach == 0.0 || several < 1.0 {
        return None;
    }
    let mut mean = 0.0;
    let mut slopes = Vec::with_capacity(nodes.len());
    for (was, is) in were.iter().zip(&are) {
        let square = is.length_squared();
        if !beside(was) || square == 0.0 {
            slopes.push(DVec3::ZERO);
            continue;
        }
        mean += axis.dot(was.cross(*is)).atan2(was.dot(*is)) / several;
        slopes.push(axis.cross(*is) / (several * square));
    }
    let shared = slopes.iter().sum::<DVec3>() / count;
    Some((nodes.iter().zip(slopes).map(|(&n, s)| (n, s - shared)).collect(), mean))
}

/// Components of nodes with their factors.
pub(super) fn terms(factors: &[(u32, DVec3)]) -> Vec<(u32, f64)> {
    let three = |&(n, f): &(u32, DVec3)| [(3 * n, f.x), (3 * n + 1, f.y), (3 * n + 2, f.z)];
    factors.iter().flat_map(three).filter(|t| t.1 != 0.0).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const PLACES: [DVec3; 6] = [
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::new(1.0, 0.1, 0.0),
        DVec3::new(0.2, 1.0, 0.1),
        DVec3::new(0.7, 0.8, 0.05),
        DVec3::new(0.3, 0.2, 1.0),
        DVec3::new(9.0, 9.0, 9.0),
    ];

    fn residual(curve: &Curve, moved: &[f64]) -> Vec<f64> {
        let all = curved(curve).equations(&PLACES, |u| moved[u as usize]).unwrap();
        let left = |e: &Equation| {
            e.terms.iter().map(|&(u, f)| f * moved[u as usize]).sum::<f64>() - e.value
        };
        all.iter().map(left).collect()
    }

    fn curved(curve: &Curve) -> Curved {
        Curved { curve: curve.clone(), first: 0, line: 1 }
    }

    #[test]
    fn what_turns_as_a_whole_keeps_all_constraints() {
        let turned = |p: DVec3| DVec3::new(-p.y, p.x, p.z);
        let mut moved: Vec<f64> = PLACES.iter().flat_map(|&p| (turned(p) - p).to_array()).collect();
        // The last node is the angles.
        moved[15..].copy_from_slice(&[0.0, 0.0, FRAC_PI_2]);
        for curve in [
            Curve::Body {
                reference: 0,
                turning: 5,
                unit: 1.0,
                nodes: vec![1, 2, 3, 4],
                widens: vec![],
            },
            Curve::Turn { nodes: vec![0, 1, 2, 3, 4], axis: DVec3::Z, angle: 17, unit: 1.0 },
        ] {
            residual(&curve, &moved)
                .iter()
                .for_each(|r| assert!(r.abs() < 1e-12, "{curve:?}: {r}"));
        }
    }

    /// Terms are slopes of what is left of the constraint.
    #[test]
    fn terms_are_differences() {
        let moved: Vec<f64> = (0..18).map(|i| 0.3 * (1.3 * f64::from(i)).sin()).collect();
        for curve in [
            Curve::Body {
                reference: 0,
                turning: 5,
                unit: 2.0,
                nodes: vec![1, 2, 3],
                widens: vec![
                    (12, DMat3::IDENTITY),
                    (13, DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::ZERO)),
                ],
            },
            Curve::Turn { nodes: vec![0, 1, 2, 3], axis: DVec3::Z, angle: 17, unit: 2.0 },
        ] {
            let all = curved(&curve).equations(&PLACES, |u| moved[u as usize]).unwrap();
            for (k, equation) in all.iter().enumerate() {
                for u in 0..18 {
                    let [up, down] = [1e-6, -1e-6].map(|d| {
                        let mut other = moved.clone();
                        other[u as usize] += d;
                        residual(&curve, &other)[k]
                    });
                    let terms = equation.terms.iter().filter(|t| t.0 == u);
                    let slope: f64 = terms.map(|t| t.1).sum();
                    let found = (up - down) / 2e-6;
                    assert!((found - slope).abs() < 1e-7, "{curve:?}, {u}: {found} is not {slope}");
                }
            }
        }
    }
}
