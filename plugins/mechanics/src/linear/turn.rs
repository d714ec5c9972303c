//! Small turns of nodes as equations: bodies that turn as a whole and may widen, and the mean turn of
//! nodes about an axis.

use glam::{DMat3, DVec3};

use super::constraint::Equation;

/// Nodes that move and turn with a reference, u = u₀ + (θ× + Σ sₖ Sₖ)(x − x₀): the node of u₀, the one
/// whose components are θ, the others, and in which ways Sₖ they widen, each with the unknown that sₖ
/// is.
pub(super) fn body(
    places: &[DVec3],
    [reference, turning]: [u32; 2],
    nodes: &[u32],
    widens: &[(u32, DMat3)],
) -> Vec<Equation> {
    let mut all = Vec::with_capacity(3 * nodes.len());
    for &node in nodes {
        let arm = places[node as usize] - places[reference as usize];
        let by_angle = (3 * turning..).zip(DVec3::AXES.map(|axis| axis.cross(arm)));
        let by_width = widens.iter().map(|&(u, way)| (u, way * arm));
        let changes: Vec<(u32, DVec3)> = by_angle.chain(by_width).collect();
        for i in 0..3 {
            let slopes = changes.iter().map(|&(u, change)| (u, -change[i as usize]));
            let own = [(3 * node + i, 1.0), (3 * reference + i, -1.0)];
            let terms = own.into_iter().chain(slopes.filter(|t| t.1 != 0.0)).collect();
            all.push(Equation { terms, value: 0.0, line: 0 });
        }
    }
    all
}

/// The unknown `angle` is the mean angle by which nodes turn about an axis through their middle: with
/// r the arm of a node across the axis, (1/n) Σ (axis × r) · u / r² (Dhondt, *The Finite Element
/// Method for Three-Dimensional Thermomechanical Applications*, sec. 3.6). Nodes on the axis say
/// nothing; `None` where all lie on it.
pub(super) fn turn(
    places: &[DVec3],
    nodes: &[u32],
    axis: DVec3,
    angle: u32,
    line: u32,
) -> Option<Equation> {
    let count = nodes.len() as f64;
    let place = |n: &u32| places[*n as usize];
    let middle = nodes.iter().map(place).sum::<DVec3>() / count;
    let arms = nodes.iter().map(|n| (place(n) - middle).reject_from_normalized(axis));
    let arms: Vec<DVec3> = arms.collect();
    let reach = arms.iter().map(|r| r.length()).fold(0.0, f64::max);
    if reach == 0.0 {
        return None;
    }
    let is_beside = |r: &DVec3| r.length() > 1e-6 * reach;
    let several = arms.iter().filter(|r| is_beside(r)).count() as f64;
    let slope = |r: &DVec3| {
        if is_beside(r) { axis.cross(*r) / (several * r.length_squared()) } else { DVec3::ZERO }
    };
    let slopes: Vec<DVec3> = arms.iter().map(slope).collect();
    let shared = slopes.iter().sum::<DVec3>() / count;
    let slopes: Vec<(u32, DVec3)> =
        nodes.iter().zip(slopes).map(|(&n, s)| (n, s - shared)).collect();
    let mut terms = terms(&slopes);
    terms.push((angle, -1.0));
    Some(Equation { terms, value: 0.0, line })
}

/// Components of nodes with their factors.
pub(super) fn terms(factors: &[(u32, DVec3)]) -> Vec<(u32, f64)> {
    let three = |&(n, f): &(u32, DVec3)| [(3 * n, f.x), (3 * n + 1, f.y), (3 * n + 2, f.z)];
    factors.iter().flat_map(three).filter(|t| t.1 != 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACES: [DVec3; 6] = [
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::new(1.0, 0.1, 0.0),
        DVec3::new(0.2, 1.0, 0.1),
        DVec3::new(0.7, 0.8, 0.05),
        DVec3::new(0.3, 0.2, 1.0),
        DVec3::new(9.0, 9.0, 9.0),
    ];

    /// What is left of an equation where every node goes where its place says, the last one is the
    /// angles, and one unknown more is how much all widens.
    fn left(equation: &Equation, moves: impl Fn(DVec3) -> DVec3, angles: DVec3, wide: f64) -> f64 {
        let mut moved: Vec<f64> = PLACES.iter().flat_map(|&p| moves(p).to_array()).collect();
        moved[15..].copy_from_slice(&angles.to_array());
        moved.push(wide);
        equation.terms.iter().map(|&(u, f)| f * moved[u as usize]).sum::<f64>() - equation.value
    }

    #[test]
    fn bodies_move_turn_and_widen_as_one() {
        let (angles, wide) = (DVec3::new(0.1, -0.2, 0.3), 0.4);
        let moves = |p: DVec3| DVec3::X + angles.cross(p) + wide * p;
        let all = body(&PLACES, [0, 5], &[1, 2, 3, 4], &[(18, DMat3::IDENTITY)]);
        assert_eq!(all.len(), 12);
        for equation in &all {
            let left = left(equation, moves, angles, wide);
            assert!(left.abs() < 1e-12, "{equation:?}: {left}");
        }
    }

    #[test]
    fn mean_turns_are_those_of_a_body() {
        for (i, axis) in (0..).zip(DVec3::AXES) {
            let angles = 0.3 * axis;
            let equation = turn(&PLACES, &[0, 1, 2, 3, 4], axis, 15 + i, 0).unwrap();
            let left = left(&equation, |p| DVec3::X + angles.cross(p), angles, 0.0);
            assert!(left.abs() < 1e-12, "{equation:?}: {left}");
        }
        assert!(turn(&PLACES, &[0], DVec3::Z, 15, 0).is_none());
    }
}
