//! The part of the battery (theory §7) that needs no physics but the arithmetic of evidence:
//! fusion, causes, and what is counted in a slice whose pores are known.
//!
//! What is checked comes in as a function, so that a test can hand in one that is wrong: the
//! battery must notice.

use intrados_stage::{Cancelled, Estimate, Job, random::Key};
use intrados_transport::Check;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    evidence::{Cause, Stands},
    fusion::{FusionRule, Piece},
    zone::together,
};
use intrados_ct::{
    detect::{DetectSettings, detect},
    slice::Slice,
};
use intrados_raster::grid::Grid;

/// Runs all checks on damage.
///
/// # Errors
/// [`Cancelled`] if `job` was.
pub fn checks(job: &Job) -> Result<Vec<Check>, Cancelled> {
    job.step(0, 2)?;
    let mut all = fusion(|rule, pieces| rule.fuse(pieces).map(|f| f.damage));
    all.extend(conflicts(|rule, pieces| rule.fuse(pieces).map(|f| f.conflict)));
    all.extend(causes(|d| together(d.iter().copied())));
    job.step(1, 2)?;
    all.extend(pores(|slice| {
        detect(slice, &DetectSettings::default(), job)
            .ok()
            .map(|d| (d.pores.len() as f64, d.porosity))
    }));
    Ok(all)
}

fn says(source: &str, value: f64, std_error: f64) -> Piece<'_> {
    Piece {
        source,
        cause: Cause::Concrete,
        reading: Estimate { value, std_error },
        measured: true,
        stands: Stands::default(),
    }
}

/// Two pieces a and b with correlation r: weights (σ_b² − rσ_aσ_b) and (σ_a² − rσ_aσ_b) over their
/// sum, variance σ_a²σ_b²(1 − r²)/(σ_a² + σ_b² − 2rσ_aσ_b).
fn fusion(fuse: impl Fn(&FusionRule, &[Piece]) -> Option<Estimate>) -> Vec<Check> {
    let mut checks = Vec::new();
    for r in [0.0, 0.5, -0.4] {
        let rule =
            FusionRule { correlation: vec![("a".into(), "b".into(), r)], ..FusionRule::default() };
        let ([va, sa], [vb, sb]) = ([0.3, 0.05], [0.38, 0.1]);
        let (aa, bb, ab) = (sa * sa, sb * sb, r * sa * sb);
        let value = ((bb - ab) * va + (aa - ab) * vb) / (aa + bb - 2.0 * ab);
        let error = (aa * bb * (1.0 - r * r) / (aa + bb - 2.0 * ab)).sqrt();
        let found = fuse(&rule, &[says("a", va, sa), says("b", vb, sb)])
            .unwrap_or(Estimate { value: f64::NAN, std_error: f64::NAN });
        let name = format!("two readings of correlation {r}");
        checks.push(Check::run("fusion", format!("{name}: damage"), value, 1e-12, || found.value));
        checks.push(Check::run("fusion", format!("{name}: standard error"), error, 1e-12, || {
            found.std_error
        }));
    }
    // Sixteen alike: a quarter of the error of one.
    let many: Vec<Piece> = (0..16).map(|_| says("a", 0.2, 0.08)).collect();
    let error = || fuse(&FusionRule::default(), &many).map_or(f64::NAN, |r| r.std_error);
    checks.push(Check::run(
        "fusion",
        "sixteen readings that agree: standard error over that of one",
        0.25,
        1e-12,
        || error() / 0.08,
    ));
    checks
}

/// How far two readings of one error may be apart before they contradict each other: χ² of one
/// degree of freedom at 1 %, found by bisection.
fn conflicts(conflicts: impl Fn(&FusionRule, &[Piece]) -> Option<bool>) -> Vec<Check> {
    let mut checks = Vec::new();
    for n in [2_usize, 5] {
        let pieces = |x: f64| -> Vec<Piece> {
            (0..n).map(|i| says("a", if i == 0 { 0.5 + x } else { 0.5 }, 0.05)).collect()
        };
        // One of n that is off by x makes χ² = x²(1 − 1/n)/σ².
        let chi2 = |x: f64| x * x * (1.0 - 1.0 / n as f64) / 0.0025;
        let expected =
            ChiSquared::new(n as f64 - 1.0).map_or(f64::NAN, |chi| chi.inverse_cdf(0.99));
        let found = || {
            let (mut low, mut high) = (0.0, 0.49);
            for _ in 0..40 {
                let x = 0.5 * (low + high);
                if conflicts(&FusionRule::default(), &pieces(x)).unwrap_or(true) {
                    high = x
                } else {
                    low = x
                }
            }
            chi2(low)
        };
        // Wilson and Hilferty's point is within 2.2 % of the exact one.
        checks.push(Check::run(
            "fusion",
            format!("χ² from which {n} readings contradict each other: the 99 % point"),
            expected,
            0.022 * expected,
            found,
        ));
    }
    checks
}

/// 1 − Π(1 − d) of causes, against the sum by inclusion and exclusion.
fn causes(together: impl Fn(&[f64]) -> f64) -> Vec<Check> {
    [vec![0.3], vec![0.5, 0.5], vec![0.2, 0.3, 0.4], vec![1.0, 0.1], vec![0.0, 0.0]]
        .into_iter()
        .map(|d| {
            // Over sets of causes: the product of each, those of an even number taken off.
            let sets = 1_u32..1 << d.len();
            let of = |set: u32| {
                (0..d.len()).filter(|i| set >> i & 1 == 1).map(|i| d[i]).product::<f64>()
            };
            let expected: f64 =
                sets.map(|set| if set.count_ones() % 2 == 1 { of(set) } else { -of(set) }).sum();
            Check::run("causes", format!("causes {d:?} taken together"), expected, 1e-12, || {
                together(&d)
            })
        })
        .collect()
}

/// Side of the drawn slice, pixels, and radius of its disc.
const SIDE: usize = 512;
const RADIUS: f64 = 230.0;

/// A disc of grey 1 with 16 round pores of 5 to 12 pixels in radius and a little noise: their
/// number, and Σ r²/(R − 3)². Pixels are inside or outside, so that no threshold decides.
fn pores(read: impl Fn(&Slice) -> Option<(f64, Estimate)>) -> Vec<Check> {
    let holes: Vec<[f64; 3]> = (0..16)
        .map(|i| {
            let (ring, turn) = (
                if i % 2 == 0 { 80.0 } else { 165.0 },
                std::f64::consts::TAU * f64::from(i) / 16.0,
            );
            let middle = 0.5 * SIDE as f64;
            [
                middle + ring * turn.cos(),
                middle + ring * turn.sin(),
                5.0 + 7.0 * f64::from(i) / 15.0,
            ]
        })
        .collect();
    let grey = |i: usize| {
        let (x, y) = ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
        let body = (x - 0.5 * SIDE as f64).hypot(y - 0.5 * SIDE as f64) < RADIUS
            && !holes.iter().any(|[a, b, r]| (x - a).hypot(y - b) < *r);
        (f64::from(u8::from(body)) + 0.02 * (Key::new(9, i as u64).unit64(0) - 0.5)) as f32
    };
    let slice = Slice {
        name: "drawn".into(),
        grey: Grid { width: SIDE, height: SIDE, data: (0..SIDE * SIDE).map(grey).collect() },
        pixel_mm: 0.1,
    };
    let (count, porosity) =
        read(&slice).unwrap_or((f64::NAN, Estimate { value: f64::NAN, std_error: f64::NAN }));
    // Of the whole section: its outermost three pixels, which are not read, have no pore.
    let truth = holes.iter().map(|h| h[2] * h[2]).sum::<f64>() / RADIUS.powi(2);
    vec![
        Check::run("pores", "disc with 16 pores: how many are found", 16.0, 0.0, || count),
        // Circles of pixels have their area within a per cent, all sixteen together.
        Check::run("pores", "disc with 16 pores: porosity", truth, 0.01 * truth, || porosity.value),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_battery_passes() {
        let checks = checks(&Job::new("verify")).unwrap();
        let failed: Vec<_> = checks.iter().filter(|c| !c.passed).collect();
        assert!(checks.len() >= 16 && failed.is_empty(), "{failed:#?}");
    }

    /// A plain mean instead of the best one, χ² at 5 % instead of 1, a sum of causes, one pore that
    /// is not seen, pores of a per cent more radius: each is found.
    #[test]
    fn whatever_is_wrong_is_found() {
        let plain = |_: &FusionRule, pieces: &[Piece]| {
            let n = pieces.len() as f64;
            let variance =
                pieces.iter().map(|p| p.reading.std_error.powi(2)).sum::<f64>() / (n * n);
            Some(Estimate {
                value: pieces.iter().map(|p| p.reading.value).sum::<f64>() / n,
                std_error: variance.sqrt(),
            })
        };
        assert!(fusion(plain).iter().take(6).all(|c| !c.passed));
        let strict = |_: &FusionRule, pieces: &[Piece]| {
            let apart = pieces[0].reading.value - 0.5;
            let point = ChiSquared::new(pieces.len() as f64 - 1.0).unwrap().inverse_cdf(0.95);
            Some(apart * apart * (1.0 - 1.0 / pieces.len() as f64) / 0.0025 > point)
        };
        assert!(conflicts(strict).iter().all(|c| !c.passed));
        assert!(causes(|d| d.iter().sum::<f64>().min(1.0)).iter().any(|c| !c.passed));
        assert!(causes(|d| d.iter().copied().fold(0.0, f64::max)).iter().any(|c| !c.passed));
        let read = |missed: f64, factor: f64| {
            pores(move |slice| {
                let found = detect(slice, &DetectSettings::default(), &Job::default()).ok()?;
                Some((
                    found.pores.len() as f64 - missed,
                    Estimate { value: factor * found.porosity.value, ..found.porosity },
                ))
            })
        };
        assert!(!read(1.0, 1.0)[0].passed && !read(0.0, 1.02)[1].passed);
    }
}
