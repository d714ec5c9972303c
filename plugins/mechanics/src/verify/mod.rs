//! The battery of closed forms: what the elements, laws and solvers of this crate answer, against
//! what is known exactly or by agreement. Every check runs through [`System`] and [`March`] on a
//! real mesh, unless it is about a formula alone.
//!
//! Nothing here is random: tolerances are errors of discretisation, chosen with the mesh before the
//! check, and orders of convergence are checked beside values.

mod crack;
mod dual;
mod heat;
mod nafems;
mod shells;
mod solids;
mod tendons;
mod time;
mod turning;

use std::time::Instant;

use glam::DVec3;
use intrados_stage::{Cancelled, Job};
use intrados_transport::Check;

use crate::{
    element::{ElementError, embed::EmbedError},
    material,
    mesh::{Host, Locator, Mesh, MeshError},
    model::{
        Body, Drive, Elastic, Failure, Gauge, History, March, MarchSettings, Matter, Model, System,
    },
    prestress::PrestressError,
    sparse::SolveError,
};

/// Why a part of the battery gave no numbers.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    #[error(transparent)]
    Failure(#[from] Failure),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Material(#[from] material::Error),
    #[error(transparent)]
    Prestress(#[from] PrestressError),
    #[error(transparent)]
    Element(#[from] ElementError),
    #[error(transparent)]
    Embed(#[from] EmbedError),
    #[error("no element holds the point ({}, {}, {})", .0.x, .0.y, .0.z)]
    Place(DVec3),
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Trouble {
    fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Cancelled(_)
                | Self::Failure(Failure::Cancelled(_))
                | Self::Failure(Failure::Solve(SolveError::Cancelled(_)))
        )
    }
}

type Checks = Result<Vec<Check>, Trouble>;
/// A part of the battery: its name in case that it fails, and its checks.
type Part = (&'static str, fn(&Job) -> Checks);

const PARTS: [Part; 29] = [
    ("patch test", solids::patch),
    ("cantilever", solids::cantilever),
    ("Lamé's cylinder", solids::lame),
    ("thermal cylinder", heat::cylinder),
    ("Kirsch's hole", solids::kirsch),
    ("ring in the ground", solids::ground),
    ("Scordelis-Lo roof", shells::scordelis_lo),
    ("pinched cylinder", shells::pinched),
    ("bars of the mesh", shells::truss),
    ("NAFEMS LE1", nafems::le1),
    ("NAFEMS LE10", nafems::le10),
    ("NAFEMS LE11", nafems::le11),
    ("NAFEMS T3", heat::t3),
    ("standard linear solid", time::standard_solid),
    ("column by the age-adjusted modulus", time::column),
    ("EC2 compliance", time::compliance),
    ("born bar", time::born),
    ("tendon's friction", tendons::friction),
    ("tendon's slip", tendons::slip),
    ("strand's relaxation", tendons::relaxation),
    ("ring prestress", tendons::ring),
    ("anchor plate", tendons::bursting),
    ("localisation in a bar", crack::localisation),
    ("Janssen's joint", crack::janssen),
    ("column of second order", turning::beam_column),
    ("column that creeps", turning::creeping),
    ("elastica", turning::elastica),
    ("buckled column", turning::buckled),
    ("dual", dual::softening),
];

/// Runs all checks.
///
/// # Errors
/// [`Cancelled`] if `job` was.
pub fn checks(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let mut all = Vec::new();
    for (i, (name, part)) in PARTS.into_iter().enumerate() {
        job.step(i, PARTS.len())?;
        let (begin, quiet) = (Instant::now(), Job::default());
        let found = part(&quiet);
        let seconds = begin.elapsed().as_secs_f64();
        match found {
            Ok(checks) => {
                let each = seconds / checks.len().max(1) as f64;
                all.extend(checks.into_iter().map(|check| Check { seconds: each, ..check }));
            }
            Err(trouble) if trouble.is_cancelled() => return Err(Cancelled),
            // No number is no agreement.
            Err(trouble) => {
                all.push(Check {
                    seconds,
                    ..Check::run("mechanics", format!("{name}: {trouble}"), 0.0, 0.0, || f64::NAN)
                });
            }
        }
    }
    Ok(all)
}

/// A check of a number that is known already.
fn check(
    kind: &'static str,
    name: impl Into<String>,
    value: f64,
    expected: f64,
    tolerance: f64,
) -> Check {
    Check::run(kind, name, expected, tolerance, || value)
}

/// A check to a share of what is expected.
fn within(
    kind: &'static str,
    name: impl Into<String>,
    value: f64,
    expected: f64,
    share: f64,
) -> Check {
    check(kind, name, value, expected, share * expected.abs())
}

/// Order of convergence by two errors, the second on a mesh twice as fine.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).abs().log2()
}

fn elastic(modulus: f64, poisson: f64) -> Elastic {
    Elastic { modulus, poisson, expansion: 0.0, density: 0.0 }
}

fn always(matter: Matter) -> Body {
    Body { matter, birth: f64::NEG_INFINITY }
}

/// A model of one material everywhere.
fn model(mesh: Mesh, matter: Matter) -> Model {
    let bodies = vec![always(matter); mesh.regions.len()];
    Model { mesh, bodies, ..Model::default() }
}

/// Holds a component of all nodes that fulfil `where_`.
fn hold(model: &mut Model, component: u8, at: impl Fn(DVec3) -> bool) {
    let held = (0..model.mesh.nodes.len() as u32).filter(|&n| at(model.mesh.nodes[n as usize]));
    model.holds.extend(held.map(|n| (n, component)).collect::<Vec<_>>());
}

/// Whether two lengths are one.
fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * (1.0 + b.abs())
}

/// The node at a place.
fn node(mesh: &Mesh, place: DVec3) -> Result<u32, Trouble> {
    let found = mesh.nodes.iter().position(|p| p.distance(place) < 1e-9 * (1.0 + place.length()));
    found.map(|n| n as u32).ok_or(Trouble::Place(place))
}

/// Where a point is in the mesh.
fn host(mesh: &Mesh, place: DVec3) -> Result<Host, Trouble> {
    Locator::new(mesh).locate(place).ok_or(Trouble::Place(place))
}

const STRICT: MarchSettings = MarchSettings {
    tolerance: 1e-9,
    iterations: 40,
    loose: 1.0,
    floor: 0.0,
    cuts: 4,
    jump: 0.25,
    method: crate::sparse::Method::Auto,
    linear: 1e-10,
    work: f64::INFINITY,
};

/// Equilibrium under the loads at a time.
fn solve(structure: &System, time: f64, job: &Job) -> Result<History, Trouble> {
    let mut march = March::new(structure, structure.rest(0.0), Drive::Loads, STRICT);
    march.advance(time, 0.0, job, |_, _| Ok(()))?;
    Ok(march.history)
}

/// Normal stress at a point, across a plane.
fn stress(
    structure: &System,
    history: &History,
    place: DVec3,
    normal: DVec3,
) -> Result<f64, Trouble> {
    let gauge = Gauge::Stress(host(&structure.model.mesh, place)?, normal);
    Ok(structure.read(&[gauge], history)?[0])
}

/// `n` equal steps from `from` to `to`.
fn steps(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| from + (to - from) * i as f64 / n as f64).collect()
}

/// `n` steps in geometric progression.
fn growing(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| from * (to / from).powf(i as f64 / n as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_battery_passes() {
        let checks = checks(&Job::new("verify")).unwrap();
        let failed: Vec<_> = checks.iter().filter(|c| !c.passed).collect();
        assert!(checks.len() > 40 && failed.is_empty(), "{failed:#?}");
    }

    /// The battery must be able to fail: a modulus that is half a per cent wrong is found.
    #[test]
    fn a_wrong_modulus_is_found() {
        let right = solids::lame_displacement(40, 30_000.0, &Job::default()).unwrap();
        let wrong = solids::lame_displacement(40, 30_150.0, &Job::default()).unwrap();
        assert!(within("", "", right, solids::LAME[0], solids::LAME_TOLERANCE).passed);
        assert!(!within("", "", wrong, solids::LAME[0], solids::LAME_TOLERANCE).passed);
    }

    #[test]
    fn a_part_that_fails_is_a_failed_check() {
        assert!(!check("", "", f64::NAN, 0.0, f64::INFINITY).passed);
    }
}
