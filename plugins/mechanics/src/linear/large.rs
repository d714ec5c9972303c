//! Static steps whose equilibrium is where everything has gone to (`NLGEOM`): Green's strain of the
//! body as it was and the law as it is for small strains, pressures that turn with their faces
//! (Zienkiewicz and Taylor, vol. 2, ch. 10). What is out of balance at the beginning of a step, of
//! forces, warmth and supports, is taken away by and by; each part of it is settled by Newton's
//! method, and halved where that fails.

use std::collections::BTreeMap;

use glam::DVec3;
use intrados_stage::Job;

use super::{
    constraint::{Equation, Sum},
    element::Folded,
    model::{Deck, Spring, Step},
    plastic::Flow,
    solve::{LinearError, Loads, Past, Solved, System, sums, unknowns},
};
use crate::{
    sparse::{BlockMatrix, Constraints, Method, SolveError, solve as direct},
    tensor::Voigt,
};

/// Newton's steps.
const STEPS: usize = 30;
/// Change of a displacement that counts as none, over the largest before and after.
const SETTLED: f64 = 1e-9;
/// The same where no step is less than half the one before: rounding of what hardly strains.
const STALLED: f64 = 1e-6;
/// ‖f − K u‖ / ‖f‖ of every change.
const TOLERANCE: f64 = 1e-6;
/// The smallest part of a step.
const LEAST: f64 = 1.0 / 4096.0;

/// Displacements and true stresses at the end of a step.
pub(super) fn solve(
    deck: &Deck,
    step: &Step,
    past: &mut Past,
    job: &Job,
) -> Result<Solved, LinearError> {
    let (all, flow, solved) = moved(deck, step, past, job)?;
    (past.displacements, past.flow, past.large) = (all, flow, true);
    past.stresses.clone_from(&solved.stresses);
    Ok(solved)
}

fn moved(
    deck: &Deck,
    step: &Step,
    past: &Past,
    job: &Job,
) -> Result<(Vec<f64>, Vec<Vec<Flow>>, Solved), LinearError> {
    let way = Way::new(deck, step, past)?;
    let (mut all, mut share, mut part) = (way.start.clone(), 0.0, 1.0);
    let (mut stresses, mut flow) = (Vec::new(), past.flow.clone());
    let mut unstable = 0;
    while share < 1.0 {
        job.step((1e4 * share) as usize, 10_000)?;
        let next = f64::min(1.0, share + part);
        if let Some(found) = way.settled(next, &all, &flow, job)? {
            (stresses, flow) = ends(&way.still, &found.all, &flow)?;
            unstable = found.unstable;
            (all, share, part) = (found.all, next, 2.0 * part);
        } else if part > LEAST {
            part *= 0.5;
        } else {
            return Err(LinearError::unsettled(step, "large displacements"));
        }
    }
    if unstable > 0 {
        let name = &step.name;
        tracing::warn!("{name}: in {unstable} directions nothing holds it where it has come to");
    }
    let solved = way.system(1.0, &all)?.told(step.name.clone(), &all, stresses);
    Ok((all, flow, solved))
}

/// What a step of vibrations is about, and the stiffness where the step
/// before has left it.
pub(super) fn tangent<'a>(
    deck: &'a Deck,
    step: &'a Step,
    past: &Past,
    job: &Job,
) -> Result<(System<'a>, BlockMatrix<1>), LinearError> {
    let all = started(deck, past);
    let mut equations = deck.constraints(step, past);
    bend(deck, step, &mut equations, &all);
    let system = System::of(deck, step, past, sums(deck, step, &equations)?, true);
    let loads = system.distributed()?;
    let (matrix, _) = system.assembled(job, |e, k, f| {
        let flow = of_element(&past.flow, e);
        unbalanced(&system, &loads, flow, e, &own(deck, e, &all), k, f)
    })?;
    Ok((system, matrix))
}

/// A step from where the one before has left everything.
struct Way<'a> {
    deck: &'a Deck,
    step: &'a Step,
    past: &'a Past,
    loads: Loads<'a>,
    /// Displacements of every unknown at its beginning.
    start: Vec<f64>,
    /// What every equation says then of what it binds.
    said: Vec<f64>,
    /// Forces of every element and spring that are out of balance then.
    open: Vec<Vec<f64>>,
    /// Its elements, with nothing that is free.
    still: System<'a>,
}

impl<'a> Way<'a> {
    fn new(deck: &'a Deck, step: &'a Step, past: &'a Past) -> Result<Self, LinearError> {
        let start = started(deck, past);
        let still = System::of(deck, step, past, vec![Sum::default(); start.len()], true);
        let loads = still.distributed()?;
        let open = |e: usize| {
            let own = own(deck, e, &start);
            let (mut k, mut f) = (vec![0.0; own.len() * own.len()], vec![0.0; own.len()]);
            let flow = of_element(&past.flow, e);
            unbalanced(&still, &loads, flow, e, &own, &mut k, &mut f).map_err(|Folded| {
                LinearError::Folded(deck.cells.get(e).map_or(0, |cell| cell.label))
            })?;
            Ok(f)
        };
        let count = deck.cells.len() + deck.springs.len();
        let open = (0..count).map(open).collect::<Result<Vec<_>, LinearError>>()?;
        let said = deck.constraints(step, past).iter().map(|e| left(e, &start)).collect();
        Ok(Self { deck, step, past, loads, start, said, open, still })
    }

    /// The unknowns with what changes lead to where constraints of a share of the step hold.
    fn system(&self, share: f64, all: &[f64]) -> Result<System<'a>, LinearError> {
        let mut equations = self.deck.constraints(self.step, self.past);
        for (equation, said) in equations.iter_mut().zip(&self.said) {
            equation.value = share * equation.value + (1.0 - share) * said;
        }
        about(self.deck, self.step, self.past, equations, all)
    }

    /// Displacements at which that share of the step is in balance; none where they do not settle.
    fn settled(
        &self,
        share: f64,
        from: &[f64],
        flow: &[Vec<Flow>],
        job: &Job,
    ) -> Result<Option<Settled>, LinearError> {
        let forces = self.step.forces.iter().map(|(&at, force)| (at, share * force)).collect();
        let fill = |system: &System<'_>, all: &[f64], e: usize, k: &mut [f64], f: &mut [f64]| {
            let flow = of_element(flow, e);
            unbalanced(system, &self.loads, flow, e, &own(self.deck, e, all), k, f)?;
            f.iter_mut().zip(&self.open[e]).for_each(|(f, open)| *f -= (1.0 - share) * open);
            Ok::<_, Folded>(())
        };
        settled(from, |all| self.system(share, all), fill, &forces, job)
    }
}

/// Where Newton's method has come to.
pub(super) struct Settled {
    /// Displacements of every unknown.
    pub(super) all: Vec<f64>,
    /// In how many directions nothing holds it there: it buckles, or elements of reduced integration
    /// move without strain.
    unstable: usize,
}

/// Newton's method: displacements at which what `fill` says of elements is in balance with forces at
/// nodes; none where they do not settle. `about` gives the unknowns with what constraints ask for
/// beyond displacements.
pub(super) fn settled<'a>(
    from: &[f64],
    about: impl Fn(&[f64]) -> Result<System<'a>, LinearError>,
    fill: impl Fn(&System<'a>, &[f64], usize, &mut [f64], &mut [f64]) -> Result<(), Folded> + Sync,
    forces: &BTreeMap<(u32, u8), f64>,
    job: &Job,
) -> Result<Option<Settled>, LinearError> {
    let largest = |all: &[f64]| all.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let (mut all, mut before) = (from.to_vec(), f64::INFINITY);
    for _ in 0..STEPS {
        let system = about(&all)?;
        let (matrix, mut rhs) = match system.assembled(job, |e, k, f| fill(&system, &all, e, k, f))
        {
            Err(LinearError::Folded(_)) => return Ok(None),
            other => other?,
        };
        system.nodal(forces, &mut rhs)?;
        let none = Constraints::new(rhs.len());
        let (free, negative) = if rhs.is_empty() {
            (Vec::new(), 0)
        } else {
            match direct(&matrix, &rhs, &none, Method::Direct, TOLERANCE, job) {
                Ok(found) => (found.x, found.negative_eigenvalues),
                Err(
                    SolveError::Indefinite { .. }
                    | SolveError::NoStiffness { .. }
                    | SolveError::Singular { .. }
                    | SolveError::NotFinite { .. }
                    | SolveError::NotConverged { .. },
                ) => return Ok(None),
                Err(other) => return Err(other.into()),
            }
        };
        let change = system.free.expanded(&free);
        all.iter_mut().zip(&change).for_each(|(u, d)| *u += d);
        let moved = largest(&change);
        if !moved.is_finite() {
            return Ok(None);
        }
        let accuracy = if moved > 0.5 * before { STALLED } else { SETTLED };
        if moved <= accuracy * largest(from).max(largest(&all)) {
            return Ok(Some(Settled { all, unstable: negative }));
        }
        before = moved;
    }
    Ok(None)
}

/// The unknowns of a step with what its constraints ask for beyond displacements.
pub(super) fn about<'a>(
    deck: &'a Deck,
    step: &'a Step,
    past: &Past,
    mut equations: Vec<Equation>,
    all: &[f64],
) -> Result<System<'a>, LinearError> {
    bend(deck, step, &mut equations, all);
    let mut sums = sums(deck, step, &equations)?;
    for (sum, now) in sums.iter_mut().zip(all) {
        sum.constant += sum.terms.iter().map(|&(u, f)| f * all[u as usize]).sum::<f64>() - now;
    }
    Ok(System::of(deck, step, past, sums, step.large))
}

/// Makes the constraints of a step what they are about displacements.
fn bend(deck: &Deck, step: &Step, equations: &mut [Equation], all: &[f64]) {
    let held = step.held.len() + step.kept.len();
    for curved in &deck.curved {
        let about = curved.equations(&deck.nodes, |u| all[u as usize]);
        let own = equations.iter_mut().skip(held + curved.first);
        own.zip(about.into_iter().flatten()).for_each(|(old, new)| *old = new);
    }
}

/// Tangent of an element or a spring and what is out of balance in it, at displacements of its own
/// unknowns.
pub(super) fn unbalanced(
    system: &System<'_>,
    loads: &Loads<'_>,
    flow: &[Flow],
    e: usize,
    own: &[f64],
    k: &mut [f64],
    f: &mut [f64],
) -> Result<(), Folded> {
    let deck = system.deck;
    if let Some(spring) = e.checked_sub(deck.cells.len()) {
        return turned(deck, &deck.springs[spring], own, k, f);
    }
    let (element, warmth) = (system.element(e), system.warmth(e));
    let moved = element.moved(own);
    element.large(&moved, &warmth, system.initial(e), flow, k, f)?;
    let (pressures, pulls) = loads.of(e);
    for &(face, pressure) in pressures {
        moved.pressure(usize::from(face), pressure, f);
        moved.pressure_stiffness(usize::from(face), pressure, k);
    }
    loads.pull(pulls, &element, &moved, &warmth, f)
}

/// The same of a spring, which turns if it lies between two nodes.
fn turned(
    deck: &Deck,
    spring: &Spring,
    own: &[f64],
    k: &mut [f64],
    f: &mut [f64],
) -> Result<(), Folded> {
    let Some([a, b]) = spring.ends else {
        let longer = spring.terms.iter().zip(own).map(|((_, factor), u)| factor * u).sum();
        let [tension, stiffness] = spring.force(longer);
        spring.outer(stiffness, k);
        for (f, (_, factor)) in f.iter_mut().zip(&spring.terms) {
            *f -= factor * tension;
        }
        return Ok(());
    };
    let was = deck.nodes[b as usize] - deck.nodes[a as usize];
    let [from, to] = [0, 3].map(|i| DVec3::from_slice(&own[i..]));
    let now = was + to - from;
    let along = now.try_normalize().ok_or(Folded)?;
    let [tension, stiffness] = spring.force(now.length() - was.length());
    let across = tension / now.length();
    for i in 0..3 {
        (f[i], f[3 + i]) = (f[i] + tension * along[i], f[3 + i] - tension * along[i]);
        for j in 0..3 {
            let unit = if i == j { across } else { 0.0 };
            let own = (stiffness - across) * along[i] * along[j] + unit;
            for (row, column, sign) in
                [(i, j, 1.0), (3 + i, 3 + j, 1.0), (i, 3 + j, -1.0), (3 + i, j, -1.0)]
            {
                k[6 * row + column] += sign * own;
            }
        }
    }
    Ok(())
}

/// True stresses, and what has flowed at every point, of displacements that follow on others.
pub(super) fn ends(
    system: &System<'_>,
    all: &[f64],
    flow: &[Vec<Flow>],
) -> Result<(Vec<Vec<Voigt>>, Vec<Vec<Flow>>), LinearError> {
    let end = |e: usize| {
        let element = system.element(e);
        let moved = element.moved(&own(system.deck, e, all));
        let (warmth, flow) = (system.warmth(e), of_element(flow, e));
        let found = element.true_stresses(&moved, &warmth, system.initial(e), flow);
        let found = found.map_err(|Folded| LinearError::Folded(system.deck.cells[e].label))?;
        Ok::<(Vec<Voigt>, Vec<Flow>), LinearError>(found.into_iter().unzip())
    };
    (0..system.deck.cells.len()).map(end).collect()
}

/// What has flowed at the points of an element.
pub(super) fn of_element(flow: &[Vec<Flow>], e: usize) -> &[Flow] {
    flow.get(e).map_or(&[][..], Vec::as_slice)
}

/// Displacements of every unknown that the steps before have left.
pub(super) fn started(deck: &Deck, past: &Past) -> Vec<f64> {
    let mut all = past.displacements.clone();
    all.resize(3 * deck.nodes.len(), 0.0);
    all
}

/// Of those of an element or a spring.
fn own(deck: &Deck, e: usize, all: &[f64]) -> Vec<f64> {
    unknowns(deck, e, true).into_iter().map(|u| all[u as usize]).collect()
}

/// The left side of an equation.
fn left(equation: &Equation, all: &[f64]) -> f64 {
    equation.terms.iter().map(|&(u, f)| f * all[u as usize]).sum()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{linear::parse, read::Units};

    /// A crooked brick between its neighbours, warm, under its own weight, and a spring.
    const BRICK: &str = "*NODE,NSET=ALL\n1,0,0,0\n2,1,.1,0\n3,1.2,1,0\n4,0,1,.1\n5,0,0,1\n6,1,0,1\n7,1,1.1,1.2\n8,0,1,1\n9,2,2,2\n\
        *ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n*ELEMENT,TYPE=SPRINGA,ELSET=S\n2,7,9\n*SPRING,ELSET=S\n7.\n\
        *MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n*EXPANSION\n1e-3\n*DENSITY\n3.\n*SOLID SECTION,ELSET=E,MATERIAL=M\n\
        *STEP,NLGEOM\n*STATIC\n*TEMPERATURE\nALL,50.\n*DLOAD\nE,GRAV,1.,0.,0.,-1.\n*END STEP\n";

    /// The tangent is how forces change; that of a pressure is its symmetric part.
    #[test]
    fn tangents_are_differences_of_forces() {
        let pressed = BRICK.replace("*END STEP", "*DLOAD\nE,P2,9.\nE,P4,-5.\n*END STEP");
        let bubbles = BRICK.replace("C3D8", "C3D8I");
        for (text, both) in [(BRICK, false), (pressed.as_str(), true), (bubbles.as_str(), false)] {
            let deck = parse(text.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
            let (step, past) = (&deck.steps[0], Past::of(&deck));
            let sums = vec![Sum::default(); 3 * deck.nodes.len()];
            let system = System::of(&deck, step, &past, sums, true);
            let loads = system.distributed().unwrap();
            for e in 0..2 {
                let n = unknowns(&deck, e, true).len();
                let at: Vec<f64> = (0..n).map(|i| 0.1 * (1.7 * i as f64).sin()).collect();
                let forces = |own: &[f64]| {
                    let (mut k, mut f) = (vec![0.0; n * n], vec![0.0; n]);
                    unbalanced(&system, &loads, &[], e, own, &mut k, &mut f).unwrap();
                    (k, f)
                };
                let (tangent, _) = forces(&at);
                let change = |j: usize| {
                    let [up, down] = [1e-6, -1e-6].map(|d| {
                        let mut own = at.clone();
                        own[j] += d;
                        forces(&own).1
                    });
                    up.iter().zip(down).map(|(a, b)| (b - a) / 2e-6).collect::<Vec<f64>>()
                };
                let all: Vec<Vec<f64>> = (0..n).map(change).collect();
                for i in 0..n {
                    for j in 0..n {
                        let mean = if both { 0.5 * (all[j][i] + all[i][j]) } else { all[j][i] };
                        let found = tangent[i * n + j];
                        assert!(
                            (found - mean).abs() < 1e-5,
                            "{e}: {i}, {j}: {found} is not {mean}"
                        );
                    }
                }
            }
        }
    }
}
