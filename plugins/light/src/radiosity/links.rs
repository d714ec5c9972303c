//! Which patches see each other, and what comes of it in the end.

use glam::DVec3;

use super::{
    mesh::{Mesh, Patch, View, Walls},
    polygon::{Polygon, TINY},
};

/// Relative change of every patch at which the iteration stops, and the most sweeps. In a maze
/// patches differ by many decades.
const CONVERGED: (f64, usize) = (1e-10, 10_000);

/// Light from patch `from`: its form factor from each of the receiver's four points.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub(super) from: u32,
    pub(super) factors: [f32; 4],
}

/// All that a patch receives.
pub(super) fn links(walls: &Walls, mesh: &Mesh, to: &Patch) -> Vec<Link> {
    let n = walls.faces[to.quad].normal;
    let mut spare: [Polygon; 3] = Default::default();
    let mut links = Vec::new();
    for (quad, range) in &mesh.ranges {
        let Some(between) = &walls.between[to.quad][*quad] else { continue };
        let views: [Option<View>; 4] = to.points.map(|x| {
            let ahead = walls.faces[*quad].plane.height(x) > TINY;
            ahead
                .then(|| walls.view(x, *quad, between))
                .filter(|v| !matches!(v, View::Pieces(p) if p.is_empty()))
        });
        if views.iter().all(Option::is_none) {
            continue;
        }
        for from in range.clone() {
            let mut factor = |k: usize| match &views[k] {
                Some(view) => {
                    walls.factor(to.points[k], n, &mesh.patches[from], view, &mut spare) as f32
                }
                None => 0.0,
            };
            let factors = [factor(0), factor(1), factor(2), factor(3)];
            if factors != [0.0; 4] {
                links.push(Link { from: from as u32, factors });
            }
        }
    }
    links
}

/// x = source + after ∫ G V before x, by Gauss and Seidel's iteration.
pub(super) fn solve(
    links: &[Vec<Link>],
    source: &[DVec3],
    after: &[DVec3],
    before: &[DVec3],
) -> Vec<DVec3> {
    let mut x = source.to_vec();
    for _ in 0..CONVERGED.1 {
        let mut converged = true;
        for (i, row) in links.iter().enumerate() {
            let term = |link: &Link| {
                before[link.from as usize]
                    * x[link.from as usize]
                    * f64::from(link.factors.iter().sum::<f32>())
            };
            let new = source[i] + after[i] * row.iter().map(term).sum::<DVec3>() * 0.25;
            converged &= (new - x[i]).abs().cmple(CONVERGED.0 * new).all();
            x[i] = new;
        }
        if converged {
            break;
        }
    }
    x
}

/// ∫ G V f at a patch's four points.
pub(super) fn at_points(row: &[Link], f: impl Fn(usize) -> DVec3) -> [DVec3; 4] {
    let mut sum = [DVec3::ZERO; 4];
    for link in row {
        let f = f(link.from as usize);
        sum.iter_mut().zip(link.factors).for_each(|(s, factor)| *s += f * f64::from(factor));
    }
    sum
}
