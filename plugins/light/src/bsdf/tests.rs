//! Exact properties of every material: consistency of eval, pdf and sample; reciprocity; energy;
//! refraction.

use std::f32::consts::PI;

use glam::Vec3;
use intrados_stage::random::Key;

use super::*;
use crate::battery::materials;

const SIDES: [Side; 2] = [Side::Primal, Side::Dual];

/// Uniform directions over the whole sphere, none within 1e-3 of the horizon.
fn pairs() -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..20_000)
        .map(|i| (warp::sphere(Key::new(11, i).pair(0)), warp::sphere(Key::new(11, i).pair(2))))
        .filter(|(a, b)| a.z.abs() > 1e-3 && b.z.abs() > 1e-3)
}

fn close(a: Vec3, b: Vec3, tolerance: f32) -> bool {
    (a - b).abs().max_element()
        <= tolerance * (1e-3 + a.abs().max_element().max(b.abs().max_element()))
}

#[test]
fn sample_agrees_with_eval_and_pdf() {
    for (name, bsdf) in materials() {
        for side in SIDES {
            let mut drawn = 0;
            for i in 0..20_000 {
                let k = Key::new(12, i);
                let wo = warp::sphere(k.pair(0));
                let Some(s) = bsdf.sample(wo, [k.unit(2), k.unit(3), k.unit(4)], side) else {
                    continue;
                };
                drawn += 1;
                assert!(
                    (s.wi.length() - 1.0).abs() < 1e-5 && s.weight.min_element() >= 0.0,
                    "{name}: {s:?}"
                );
                if s.delta {
                    assert!(
                        bsdf.is_delta()
                            && bsdf.eval_pdf(wo, s.wi, side) == (Vec3::ZERO, 0.0)
                            && bsdf.pdf(wo, s.wi) == 0.0
                    );
                    continue;
                }
                let (f, pdf) = bsdf.eval_pdf(wo, s.wi, side);
                assert_eq!(pdf, bsdf.pdf(wo, s.wi));
                assert!(
                    (pdf / s.pdf - 1.0).abs() < 1e-4,
                    "{name}: pdf {pdf} sampled with {}",
                    s.pdf
                );
                assert!(
                    close(f / pdf, s.weight, 1e-4),
                    "{name}: {} sampled with {}",
                    f / pdf,
                    s.weight
                );
            }
            assert!(drawn > 15_000, "{name}: {drawn}");
        }
    }
}

/// f(a → b) = f(b → a) where nothing is refracted, and f/η² is the same both ways where something
/// is (Veach 1997, eq. 5.14).
#[test]
fn reciprocity() {
    for (name, bsdf) in materials() {
        for (a, b) in pairs() {
            let there = bsdf.eval_pdf(a, b, Side::Primal).0 / b.z.abs();
            let back = bsdf.eval_pdf(b, a, Side::Primal).0 / a.z.abs();
            // Light along b leaves along a: `there` belongs to the index on a's side.
            let index2 = |w: Vec3| match bsdf {
                Bsdf::Dielectric { ior, .. } if w.z < 0.0 => ior * ior,
                _ => 1.0,
            };
            assert!(
                close(there / index2(a), back / index2(b), 2e-3),
                "{name}: {there} and {back} for {a} {b}"
            );
        }
    }
}

/// The dual's BSDF is the primal's with its directions exchanged.
#[test]
fn primal_and_dual_are_adjoint() {
    for (name, bsdf) in materials() {
        for (a, b) in pairs() {
            let primal = bsdf.eval_pdf(a, b, Side::Primal).0 / b.z.abs();
            let dual = bsdf.eval_pdf(b, a, Side::Dual).0 / a.z.abs();
            assert!(close(primal, dual, 2e-3), "{name}: {primal} and {dual} for {a} {b}");
        }
    }
    // The delta: through the interface and back, radiance regains what refraction took.
    let glass = Bsdf::SmoothDielectric { ior: 1.5 };
    for (wo, _) in pairs() {
        let Some(s) =
            glass.sample(wo, [0.0, 0.0, 0.999_999], Side::Primal).filter(|s| s.wi.z * wo.z < 0.0)
        else {
            continue;
        };
        let dual = glass.sample(wo, [0.0, 0.0, 0.999_999], Side::Dual).unwrap();
        let scale = if wo.z > 0.0 { 1.0 / 2.25 } else { 2.25 };
        assert!((s.weight.x / scale - 1.0).abs() < 1e-5 && dual.weight == Vec3::ONE);
    }
}

/// Mean weight = ∫ f cosθ dω, over the R₃ sequence (Roberts 2018: multiples of powers of the root
/// of x⁴ = x + 1), whose error falls nearly as 1/n.
fn furnace(bsdf: Bsdf, wo: Vec3, side: Side) -> Vec3 {
    let n = 200_000;
    let root: f64 = 1.220_744_084_605_759_5;
    let mut sum = glam::DVec3::ZERO;
    for i in 0..n {
        let u = [1, 2, 3]
            .map(|k| ((0.5 + f64::from(i) / root.powi(k)).fract() as f32).min(1.0 - f32::EPSILON));
        sum += bsdf.sample(wo, u, side).map_or(Vec3::ZERO, |s| s.weight).as_dvec3();
    }
    (sum / f64::from(n)).as_vec3()
}

/// ∫ f cosθ dω with nothing but `eval`: midpoint rule over the azimuth and cosθ = 1 − (1 − t)³,
/// fine near the horizon.
fn quadrature(bsdf: Bsdf, wo: Vec3, side: Side) -> Vec3 {
    let n = 600;
    let mut sum = glam::DVec3::ZERO;
    for i in 0..n {
        let t = (i as f32 + 0.5) / n as f32;
        let (z, dz) = (t * t * t, 3.0 * t * t);
        for j in 0..n {
            let u = (j as f32 + 0.5) / n as f32;
            for z in [z, -z] {
                let (sin, cos) = (2.0 * PI * u).sin_cos();
                let r = (1.0 - z * z).sqrt();
                sum += (bsdf.eval_pdf(wo, Vec3::new(r * cos, r * sin, z), side).0 * dz).as_dvec3();
            }
        }
    }
    (sum * f64::from(2.0 * PI) / f64::from(n * n)).as_vec3()
}

fn from(mu: f32) -> Vec3 {
    Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu)
}

/// A white surface under white light stays white: neither gains nor loses more than 1.5e-3, for any
/// mix, roughness and angle.
#[test]
fn white_metallic_surfaces_conserve_energy() {
    for metallic in [0.0, 0.5, 1.0] {
        for alpha in [0.05, 0.17, 0.4, 0.7, 1.0] {
            for mu in [0.05, 0.2, 0.45, 0.8, 1.0] {
                let bsdf = Bsdf::Metallic { base: Vec3::ONE, metallic, alpha };
                let white = furnace(bsdf, from(mu), Side::Primal);
                assert!(
                    (white - 1.0).abs().max_element() < 2e-3,
                    "metallic {metallic} alpha {alpha} mu {mu}: {white}"
                );
                assert!(
                    (bsdf.albedo(from(mu)) - 1.0).abs().max_element() < 1e-3,
                    "{}",
                    bsdf.albedo(from(mu))
                );
            }
        }
    }
}

/// Light through rough glass of index 1.5, in the dual (whose weights have no η² in them): the
/// numbers in the docs of the variant, at normal incidence and at the worst of these angles
/// (negative: from inside).
#[test]
fn rough_glass_loses_what_it_says() {
    for (alpha, normal, worst) in
        [(0.1, 0.001, 0.12), (0.3, 0.012, 0.24), (0.5, 0.032, 0.35), (1.0, 0.11, 0.61)]
    {
        let bsdf = Bsdf::Dielectric { ior: 1.5, alpha };
        let loss = |mu| 1.0 - furnace(bsdf, from(mu), Side::Dual).x;
        let all = [-1.0, -0.8, -0.5, -0.2, -0.05, 0.05, 0.2, 0.5, 0.8, 1.0].map(loss);
        assert!(all.iter().all(|&l| l > -1e-3), "{all:?}");
        assert!(
            (loss(1.0) - normal).abs() < 0.006
                && (all.into_iter().fold(0.0, f32::max) - worst).abs() < 0.006,
            "{alpha}: {all:?}"
        );
    }
}

/// `eval` integrates to what `sample` brings: no lobe is sampled and not evaluated, or the other
/// way round.
#[test]
fn eval_integrates_to_the_mean_weight() {
    for (name, bsdf) in materials() {
        if bsdf.is_delta() || name.contains("alpha 0.0") {
            continue; // too sharp for this quadrature; `sample_agrees_with_eval_and_pdf` has them
        }
        for (side, mu) in [(Side::Primal, 0.7), (Side::Dual, -0.4)] {
            let (a, b) = (quadrature(bsdf, from(mu), side), furnace(bsdf, from(mu), side));
            assert!(close(a, b, 3e-3), "{name} {side:?}: {a} {b}");
            assert!(side == Side::Primal || b.max_element() < 1.002, "{name}: {b}");
            assert!(
                (bsdf.albedo(from(mu)) + 2e-3).cmpge(b).all() || side == Side::Primal,
                "{name}: {b}"
            );
        }
    }
}

/// A refracted ray sent back comes out along the old direction, with the same transmittance, and
/// regains its η².
#[test]
fn refraction_goes_there_and_back() {
    let glass = Bsdf::SmoothDielectric { ior: 1.5 };
    for (wo, _) in pairs() {
        let through = |wo: Vec3| glass.sample(wo, [0.0, 0.0, 0.999_999], Side::Primal);
        let Some(first) = through(wo).filter(|s| s.wi.z * wo.z < 0.0) else {
            assert!(
                wo.z < 0.0 && wo.z * wo.z < 1.0 - 1.0 / 2.25 + 1e-4,
                "only total reflection leaves no refraction: {wo}"
            );
            continue;
        };
        let back = through(first.wi).unwrap();
        assert!((back.wi - wo).length() < 1e-3, "{wo} {back:?}");
        assert!(
            (back.weight.x * first.weight.x - 1.0).abs() < 1e-5
                && (back.pdf - first.pdf).abs() < 1e-3
        );
    }
}

/// Fresnel's equations at a few angles, index 1.5: .04 at 0°, 0 in parallel polarisation at
/// Brewster's 56.31° (half of the other), 1 beyond 41.81° from inside.
#[test]
fn fresnel_equations() {
    assert!((fresnel(1.0, 1.5).0 - 0.04).abs() < 1e-6);
    let brewster = (1.5_f32).atan();
    let across = (1.0 - 1.5 * 1.5) / (1.0 + 1.5 * 1.5);
    assert!((fresnel(brewster.cos(), 1.5).0 - 0.5 * across * across).abs() < 1e-6);
    assert_eq!(fresnel(42.0_f32.to_radians().cos(), 1.0 / 1.5), (1.0, 0.0));
    assert!(fresnel(41.0_f32.to_radians().cos(), 1.0 / 1.5).0 < 1.0);
}

/// Both sides of a Lambert wall reflect, none transmits; the correction is 1 without a shading
/// normal and undoes itself backward.
#[test]
fn two_sides_and_the_shading_normal() {
    let wall = Bsdf::Lambert { albedo: Vec3::splat(0.5) };
    for (a, b) in pairs() {
        let f = wall.eval_pdf(a, b, Side::Primal).0;
        assert_eq!(f.x > 0.0, a.z * b.z > 0.0);
        assert!(
            (shading_correction(a, b, Vec3::Z, Vec3::Z) - f32::from(a.z != 0.0 && b.z != 0.0))
                .abs()
                < 1e-6
        );
        let tilted = Vec3::new(0.3, 0.1, 1.0).normalize();
        let (there, back) =
            (shading_correction(a, b, tilted, Vec3::Z), shading_correction(b, a, tilted, Vec3::Z));
        assert!(there == 0.0 || (there * back - 1.0).abs() < 1e-3);
    }
}
