//! The part of the battery (theory §7) that X-rays make possible: cross sections, sampling, line
//! integrals, reconstruction, each against a closed form or an integral that nothing here shares.
//!
//! What is checked comes in as a function, so that a test can hand in one that is wrong: the
//! battery must notice.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use intrados_stage::{
    Cancelled, Job,
    random::{Draw, Key},
};
use intrados_transport::{
    Check,
    chi2::{Grid as Cells, rectangle, sidak},
    verify::sidak_z,
};
use rayon::prelude::*;

use crate::{
    physics::{self as kn, Library, Matter, Model, PhysicsError, Spectrum},
    primary::primary_at,
    recon::{Window, fbp},
    scanner::{Beam, Scanner},
    specimen::{Shape, Solid, Specimen, SpecimenError, Substance},
    volume::{self, Grid, Orbit, Sinogram},
};

/// Samples of each χ².
const SAMPLES: u64 = 400_000;

/// Why a part of the battery gave no numbers.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    #[error(transparent)]
    Specimen(#[from] SpecimenError),
}

/// Runs all checks on X-rays. False-alarm rate: 1 % for the family of χ² and for that of z; the
/// seeds are fixed.
///
/// # Errors
/// [`Cancelled`] if `job` was.
pub fn checks(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let parts: [fn() -> Result<Vec<Check>, Trouble>; 4] =
        [cross_sections, sampling, lines, reconstruction];
    let mut all = Vec::new();
    for (i, part) in parts.into_iter().enumerate() {
        job.step(i, parts.len())?;
        // No number is no agreement.
        all.extend(part().unwrap_or_else(|why| {
            vec![Check::run("xray", why.to_string(), 0.0, 0.0, || f64::NAN)]
        }));
    }
    Ok(all)
}

fn cross_sections() -> Result<Vec<Check>, Trouble> {
    let mut checks =
        [10.0, 100.0, 450.0].map(|kev| klein_nishina(kev, kn::klein_nishina_total)).to_vec();
    // α = 1: ¾ {2 [4/3 − ln 3] + ½ ln 3 − 4/9} of Thomson's.
    let expected = 0.75 * (2.0 * (4.0 / 3.0 - 3_f64.ln()) + 0.5 * 3_f64.ln() - 4.0 / 9.0);
    checks.push(Check::run(
        "cross section",
        "Klein and Nishina at m_e c², over Thomson's",
        expected,
        1e-9,
        || kn::klein_nishina_total(kn::ELECTRON) / (16.0 * PI / 3.0),
    ));
    Ok(checks)
}

/// A total cross section, over r_e²/2, against the mean of the differential one over the sphere, by
/// Gauss and Legendre's rule in 64 pieces of three points.
fn klein_nishina(kev: f64, total: impl Fn(f64) -> f64) -> Check {
    let differential = |c: f64| {
        let p = 1.0 / (1.0 + kev / 510.998_95 * (1.0 - c));
        p.powi(3) + p - p.powi(2) * (1.0 - c * c)
    };
    let expected = TAU * integral(-1.0, 1.0, differential);
    Check::run(
        "cross section",
        format!("Klein and Nishina at {kev} keV: total over the integral of the differential"),
        1.0,
        1e-9,
        || total(kev) / expected,
    )
}

/// ∫ f from a to b.
fn integral(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (pieces, node) = (64, 0.6_f64.sqrt());
    let half = 0.5 * (b - a) / f64::from(pieces);
    let piece = |i: i32| {
        let middle = a + (2.0 * f64::from(i) + 1.0) * half;
        half / 9.0
            * (5.0 * f(middle - node * half) + 8.0 * f(middle) + 5.0 * f(middle + node * half))
    };
    (0..pieces).map(piece).sum()
}

/// χ² of every routine that draws an angle, against a density that is normalised here, and of free
/// flights.
fn sampling() -> Result<Vec<Check>, Trouble> {
    let library = Library::builtin()?;
    let concrete = Matter::new(&library, "concrete", Model::Bound)?;
    let mut checks = Vec::new();
    for kev in [10.0, 100.0, 450.0] {
        let forward = kn::Forward::new(kev);
        checks.push(angles(
            &format!("Compton, free electrons, {kev} keV"),
            |draw| forward.sample(draw),
            |c| kn::shape(kev, c),
            -1.0,
        ));
        let backward = kn::Backward::new(kev, 460.0);
        // Of at most 460 keV: no cosine below that with which E′ = 460 keV comes to be E.
        let least = f64::max(-1.0, 1.0 - (1.0 - kev / 460.0) * kn::ELECTRON / kev);
        let back = |c: f64| {
            let k = 1.0 - kev / kn::ELECTRON * (1.0 - c);
            if c >= least { k + 1.0 / k } else { 0.0 }
        };
        checks.push(angles(
            &format!("Compton backwards, left with {kev} keV"),
            |draw| backward.sample(draw),
            back,
            least,
        ));
    }
    for kev in [20.3, 150.0] {
        let photons = kn::Forward::new(kev);
        checks.push(angles(
            &format!("Compton, bound in concrete, {kev} keV"),
            |draw| concrete.compton_sample(&photons, draw),
            |c| concrete.compton_pdf(kev, c),
            -1.0,
        ));
        checks.push(angles(
            &format!("Rayleigh in concrete, {kev} keV"),
            |draw| concrete.rayleigh_sample(kev, draw),
            |c| concrete.rayleigh_pdf(kev, c),
            -1.0,
        ));
    }
    let level = sidak(0.01, checks.len());
    for check in &mut checks {
        (check.expected, check.tolerance) = (0.5 * (1.0 + level), 0.5 * (1.0 - level));
        check.passed = check.value >= level;
    }
    checks.extend(flights(&library)?);
    Ok(checks)
}

/// p-value of cosines above `least` against a density in any unit.
fn angles(
    name: &str,
    sample: impl Fn(&mut Draw) -> f64 + Sync,
    density: impl Fn(f64) -> f64 + Sync,
    least: f64,
) -> Check {
    let seed =
        name.bytes().fold(0, |seed: u64, b| seed.wrapping_mul(31).wrapping_add(u64::from(b)));
    let draw = |i| {
        let mut draw = Draw::new(Key::new(seed, i));
        Some([sample(&mut draw), draw.unit()])
    };
    // Densities may be peaked at 1: in √(1 − c) they are smooth.
    let all = integral(0.0, (1.0 - least).sqrt(), |s| 2.0 * s * density(1.0 - s * s));
    let cells = Cells { bounds: [[-1.0, 1.0], [0.0, 1.0]], cells: [100, 1] };
    Check::run("sampling", format!("p-value of χ², {name}"), 0.5, 0.5, || {
        rectangle(cells, SAMPLES, draw, |[c, _]| density(c) / all).p_value
    })
}

/// Optical depths of the two slabs.
const MU: [f64; 2] = [1.5, 2.2];

/// Two slabs of .1 m of concrete, the second denser, at 100 keV.
fn slabs(library: &Library) -> Result<Specimen, Trouble> {
    let concrete = Matter::new(library, "concrete", Model::Bound)?;
    let per_kg = concrete.total(100.0);
    let slab = |from: f64, label| Solid {
        shape: Shape::Box([DVec3::new(from, -1.0, -1.0), DVec3::new(from + 0.1, 1.0, 1.0)]),
        label,
    };
    let palette = MU.map(|depth| Substance { material: 0, density: depth / 0.1 / per_kg }).to_vec();
    Ok(Specimen::solids(vec![concrete], palette, vec![slab(0.0, 0), slab(0.1, 1)])?)
}

/// Photons that fly through two slabs of optical depth 1.5 and 2.2: e^(−1.5) reach the second,
/// e^(−3.7) leave it.
fn flights(library: &Library) -> Result<Vec<Check>, Trouble> {
    let specimen = slabs(library)?;
    let local = specimen.local(100.0);
    let fly = |key: Key| {
        let mut draw = Draw::new(key);
        specimen
            .fly(&local, DVec3::new(-0.2, 0.0, 0.0), DVec3::X, || draw.unit())
            .map_or(f64::INFINITY, |(distance, _)| distance)
    };
    Ok(passing(fly))
}

fn passing(fly: impl Fn(Key) -> f64 + Sync) -> Vec<Check> {
    let n = 1_000_000_u64;
    let beyond =
        |far: f64| (0..n).into_par_iter().filter(|&i| fly(Key::new(77, i)) > far).count() as f64;
    [(0.3, MU[0], "reach the second"), (0.4, MU[0] + MU[1], "leave it")]
        .map(|(far, depth, what)| {
            let p = (-depth).exp();
            Check::run(
                "sampling",
                format!("z of the share of flights that {what} of two slabs, e^−{depth:.1}"),
                0.0,
                sidak_z(2),
                || (beyond(far) - n as f64 * p) / (n as f64 * p * (1.0 - p)).sqrt(),
            )
        })
        .into()
}

/// What comes straight through, by the scanner's own way, against Beer's law on chords by hand.
fn lines() -> Result<Vec<Check>, Trouble> {
    let library = Library::builtin()?;
    let concrete = Matter::new(&library, "concrete", Model::Bound)?;
    // Two lines, so that what is summed over energies shows.
    let spectrum = Spectrum::new(&[(60.0, 0.25), (120.0, 0.75)])?;
    let share: Vec<(f64, f64)> = spectrum.bins().filter(|(_, share)| *share > 0.0).collect();
    let mu = |kev: f64, density: f64| density * concrete.total(kev);
    let radius = 0.05;
    let scanner = Scanner::new(1.0, 0.5, [3, 3], [1e-3, 1e-3], spectrum, Beam::symmetric(0.2, 0.2));
    let core = Solid {
        shape: Shape::Cylinder { base: -0.1 * DVec3::Z, top: 0.1 * DVec3::Z, radius },
        label: 0,
    };
    let pore = Solid {
        shape: Shape::Cylinder { base: -0.1 * DVec3::Z, top: 0.1 * DVec3::Z, radius: 0.2 * radius },
        label: 1,
    };
    let palette = [2400.0, 0.0].map(|density| Substance { material: 0, density }).to_vec();
    let specimen = Specimen::solids(vec![concrete.clone()], palette, vec![core, pore])?;
    let chord = |r: f64, off: f64| 2.0 * (r * r - off * off).max(0.0).sqrt();
    let mut checks = Vec::new();
    for y in [0.0_f64, 0.006, 0.03, 0.06] {
        // The ray from (−1, 0, 0) to (.5, y, 0) passes the axis at this distance.
        let off = y / (1.5 * 1.5 + y * y).sqrt();
        let length = chord(radius, off) - chord(0.2 * radius, off);
        let [sum, open] = share.iter().fold([0.0; 2], |[sum, open], (kev, w)| {
            [sum + w * kev * (-mu(*kev, 2400.0) * length).exp(), open + w * kev]
        });
        checks.push(Check::run(
            "line",
            format!("core with a hole, ray {:.0} mm from its axis: behind/open", 1e3 * off),
            sum / open,
            1e-9,
            || {
                let [behind, open] = primary_at(&specimen, &scanner, DVec3::new(0.5, y, 0.0));
                behind / open
            },
        ));
    }
    Ok(checks)
}

/// A disc of 20 mm of μ = 30/m about a point off the axis, with a hole: exact line integrals, each
/// a mean over the bin.
fn reconstruction() -> Result<Vec<Check>, Trouble> {
    Ok([
        ("parallel, half a turn", volume::Beam::Parallel, PI),
        (
            "fan, a turn",
            volume::Beam::Fan { source_axis: 0.2, axis_detector: 0.1, curved: false },
            TAU,
        ),
    ]
    .into_iter()
    .flat_map(|(name, beam, arc)| {
        disc(name, beam, arc, |sinogram, grid| {
            fbp(sinogram, grid, Window::Ramp, &Job::default()).ok().map(|v| v.data)
        })
    })
    .collect())
}

/// Middle (m), radius (m) and attenuation (1/m) of disc and hole.
const DISC: [(f64, f64, f64, f64); 2] = [(0.004, -0.003, 0.02, 30.0), (0.008, 0.002, 0.005, -30.0)];

fn disc(
    name: &str,
    beam: volume::Beam,
    arc: f64,
    reconstruct: impl Fn(&Sinogram, &Grid) -> Option<Vec<f32>>,
) -> Vec<Check> {
    let pitch = if beam == volume::Beam::Parallel { 3e-4 } else { 4.5e-4 };
    let orbit = Orbit::circle(beam, 360, arc, [1, 256], [pitch, 1e-3]);
    let grid = Grid::centred([160, 160, 1], [4e-4, 4e-4, 1e-3]);
    let mut sinogram = Sinogram::zeros(orbit.clone());
    for (i, out) in sinogram.data.iter_mut().enumerate() {
        let (bin, (sin, cos)) = (i % 256, orbit.angles[i / 256].sin_cos());
        let along = |part: f64| {
            let u = (bin as f64 + part - orbit.centre[0]) * pitch;
            let (from, to) = match beam {
                volume::Beam::Fan { source_axis: s, axis_detector: d, .. } => {
                    ([s * sin, -s * cos], [u * cos - (s + d) * sin, u * sin + (s + d) * cos])
                }
                _ => ([u * cos, u * sin], [-sin, cos]),
            };
            let chord = |&(x, y, r, mu): &(f64, f64, f64, f64)| {
                let off = ((x - from[0]) * to[1] - (y - from[1]) * to[0]) / to[0].hypot(to[1]);
                2.0 * mu * (r * r - off * off).max(0.0).sqrt()
            };
            DISC.iter().map(chord).sum::<f64>()
        };
        *out = ([-1.0 / 3.0, 0.0, 1.0 / 3.0].map(along).iter().sum::<f64>() / 3.0) as f32;
    }
    let image = reconstruct(&sinogram, &grid);
    let mean = |inside: &dyn Fn(f64, f64) -> bool| {
        let Some(image) = &image else { return f64::NAN };
        let at = |i: usize| [grid.at(0, i % 160), grid.at(1, i / 160)];
        let values = image
            .iter()
            .enumerate()
            .filter(|(i, _)| inside(at(*i)[0], at(*i)[1]))
            .map(|(_, v)| f64::from(*v));
        let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
        sum / n
    };
    let [(x0, y0, r, mu), (x1, y1, hole, _)] = DISC;
    let body =
        mean(&|x, y| (x - x0).hypot(y - y0) < 0.9 * r && (x - x1).hypot(y - y1) > 1.3 * hole);
    let void = mean(&|x, y| (x - x1).hypot(y - y1) < 0.7 * hole);
    vec![
        Check::run(
            "reconstruction",
            format!("disc with a hole, {name}: μ of the disc, 1/m"),
            mu,
            0.003 * mu,
            || body,
        ),
        Check::run(
            "reconstruction",
            format!("disc with a hole, {name}: μ in the hole, 1/m"),
            0.0,
            0.005 * mu,
            || void,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_battery_passes() {
        let checks = checks(&Job::new("verify")).unwrap();
        let failed: Vec<_> = checks.iter().filter(|c| !c.passed).collect();
        assert!(checks.len() >= 24 && failed.is_empty(), "{failed:#?}");
    }

    /// What is wrong by little is found: a cross section by a millionth, angles by a twentieth of
    /// their samples, flights and filters by a per cent.
    #[test]
    fn whatever_is_wrong_is_found() {
        assert!(
            klein_nishina(100.0, kn::klein_nishina_total).passed
                && !klein_nishina(100.0, |kev| 1.000_001 * kn::klein_nishina_total(kev)).passed
        );
        let forward = kn::Forward::new(100.0);
        let biased = |draw: &mut Draw| {
            let c = forward.sample(draw);
            if draw.unit() < 0.05 { -c } else { c }
        };
        assert!(
            angles("right", |draw| forward.sample(draw), |c| kn::shape(100.0, c), -1.0).value
                > 1e-4
        );
        assert!(angles("biased", biased, |c| kn::shape(100.0, c), -1.0).value < 1e-6);
        assert!(
            angles("of another energy", |draw| forward.sample(draw), |c| kn::shape(130.0, c), -1.0)
                .value
                < 1e-6
        );
        let flights = |factor: f64| {
            passing(move |key| {
                let depth = -(1.0 - Draw::new(key).unit()).ln() * factor;
                0.2 + if depth < MU[0] {
                    0.1 * depth / MU[0]
                } else {
                    0.1 + 0.1 * (depth - MU[0]) / MU[1]
                }
            })
        };
        assert!(flights(1.0).iter().all(|c| c.passed) && flights(1.01).iter().all(|c| !c.passed));
        let scaled = |factor: f32| {
            disc("parallel", volume::Beam::Parallel, PI, move |sinogram, grid| {
                fbp(sinogram, grid, Window::Ramp, &Job::default())
                    .ok()
                    .map(|v| v.data.into_iter().map(|x| factor * x).collect())
            })
        };
        assert!(scaled(1.0).iter().all(|c| c.passed) && !scaled(1.01)[0].passed);
        assert!(!disc("nothing", volume::Beam::Parallel, PI, |_, _| None).iter().any(|c| c.passed));
    }
}
