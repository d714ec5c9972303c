use std::sync::Arc;

use glam::{DVec2, DVec3};
use intrados_scene::{Part, Scene, structure::BarEnd};
use intrados_stage::{Job, random::Key};

use super::*;
use crate::{physics::Library, volume::Grid};

const VOXEL: f64 = 1e-3;

/// A core of 60 mm, 24 mm high.
fn core(seed: u64) -> Recipe {
    Recipe { largest: 0.012, ..Recipe::sound(Outline::Round(0.03), 0.024, VOXEL, seed) }
}

fn grow(recipe: &Recipe) -> Concrete {
    Concrete::grow(recipe, &Job::default()).unwrap()
}

fn paint(concrete: &Concrete, voxel: f64) -> Painted {
    let recipe = &concrete.recipe;
    let half = recipe.outline.half();
    let size = [2.0 * half.x, 2.0 * half.y, recipe.height].map(|s| (s / voxel).round() as usize);
    concrete.paint(&Grid::centred(size, [voxel; 3]), &Job::default()).unwrap()
}

fn air(porosity: f64) -> Air {
    Air { from: -1.0, to: 1.0, porosity, median: 2e-3, spread: 0.4, entrapped: 0.15 }
}

/// What was planted is what is there, in the bodies to rounding and in the voxels within 1 %.
#[test]
fn porosity_is_as_planted() {
    for (seed, porosity) in [(1, 0.01), (2, 0.05), (3, 0.1)] {
        let concrete = grow(&Recipe { air: vec![air(porosity)], ..core(seed) });
        let half = 0.5 * concrete.recipe.height;
        let placed = concrete.pores().map(|p| p.volume() * p.between(-half, half)).sum::<f64>()
            / concrete.recipe.volume();
        let painted = paint(&concrete, VOXEL);
        let counted = painted.voids[0] as f64 / painted.points as f64;
        println!(
            "porosity {porosity}: bodies {placed:.5}, voxels {counted:.5}, {} pores, too fine {:.1e}",
            concrete.pores().count(),
            concrete.fine_air
        );
        assert!(
            (placed + concrete.fine_air - porosity).abs() < 2e-3 * porosity,
            "{placed} + {} for {porosity}",
            concrete.fine_air
        );
        assert!(
            (counted + concrete.fine_air - porosity).abs() < 1e-2 * porosity,
            "{counted} for {porosity}"
        );
    }
    // So is honeycomb: threshold from 250 000 points, .4 % of standard error here.
    let concrete = grow(&Recipe {
        honeycombs: vec![Honeycomb { from: -1.0, to: 1.0, porosity: 0.2 }],
        ..core(4)
    });
    let painted = paint(&concrete, VOXEL);
    let counted = painted.voids[0] as f64 / painted.points as f64;
    println!("honeycomb: {counted}");
    assert!((counted - 0.2).abs() < 0.02 * 0.2, "{counted}");
}

/// No point in two bodies: the surface and the inside of each, 400 points, against all others.
#[test]
fn bodies_do_not_overlap() {
    let concrete = grow(&Recipe { air: vec![air(0.04)], ..core(5) });
    let bodies = &concrete.bodies;
    let rock = bodies.iter().filter(|b| b.kind == Kind::Rock).count();
    println!(
        "{rock} grains, {:.3} of the volume; {} pores",
        concrete.aggregate,
        bodies.len() - rock
    );
    assert!(rock > 100 && bodies.len() - rock > 30 && concrete.aggregate > 0.2);
    for (i, a) in bodies.iter().enumerate() {
        for p in a.surface(200).flat_map(|p| [p, 0.5 * (p + a.centre)]) {
            let other = bodies.iter().enumerate().position(|(j, b)| j != i && b.contains(p));
            assert_eq!(other, None, "body {i} at {p}");
            assert!(concrete.recipe.outline.within(p) > 0.0);
        }
    }
}

/// Volume of a body by the points of fine voxels, against the diameter it was given.
#[test]
fn bodies_have_their_volume() {
    for (cuts, kind) in [(0, Kind::Pore), (12, Kind::Rock)] {
        let body = Body::new(kind, 0.01, DVec3::new(1.0, 0.8, 0.6), cuts, Key::new(3, 1));
        let n = 120;
        let (side, mut inside) = (2.2 * body.reach() / f64::from(n), 0.0);
        for i in 0..n * n * n {
            let at = |k: i32| side * (f64::from(k) + 0.5 - 0.5 * f64::from(n));
            inside += f64::from(u8::from(body.contains(DVec3::new(
                at(i % n),
                at(i / n % n),
                at(i / (n * n)),
            ))));
        }
        let volume = inside * side.powi(3);
        assert!((volume / body.volume() - 1.0).abs() < 0.015, "{cuts}: {volume} {}", body.volume());
        let p = body.centre + DVec3::new(-0.05, 0.0004, 0.0003);
        let [from, to] = body.crossed(p, DVec3::X).unwrap();
        for (s, within) in
            [(from - 1e-6, false), (from + 1e-6, true), (to - 1e-6, true), (to + 1e-6, false)]
        {
            assert_eq!(body.contains(p + s * DVec3::X), within);
        }
    }
}

/// Opening = volume over the area of the surface, for cracks far thinner than a voxel and wider
/// than one; they stay out of the steel.
#[test]
fn cracks_are_as_wide_as_planted() {
    for (width, normal, inward, depth) in
        [(0.2e-3, DVec3::Y, DVec3::X, 0.06), (2.5e-3, DVec3::Z, DVec3::X, 0.03)]
    {
        let crack = Crack {
            mouth: DVec3::new(-0.03, 0.0, 0.0),
            normal,
            inward,
            depth,
            width,
            round: false,
            roughness: 1e-3,
        };
        let recipe = Recipe {
            outline: Outline::Rectangle([0.03; 2]),
            cracks: vec![crack],
            share: 0.0,
            ..core(6)
        };
        let concrete = grow(&recipe);
        let painted = paint(&concrete, VOXEL);
        let volume = painted.voids[1] as f64 / 64.0 * VOXEL.powi(3);
        // The last tenth closes linearly. The surface is longer than its plane by √(1 + slope²),
        // here from the relief itself.
        let side = if normal == DVec3::Y { recipe.height } else { 0.06 };
        let relief = &concrete.surfaces[0];
        let steep = relief.stretch();
        let expected = width * 0.95 * depth * side * steep;
        println!(
            "crack of {width}: volume {volume:.4e}, planted {expected:.4e}, stretch {steep:.3}"
        );
        assert!((volume / expected - 1.0).abs() < 0.03, "{width}: {volume} for {expected}");
    }
}

#[test]
fn a_crack_goes_round_grains_or_through() {
    let crack = |round| Crack {
        mouth: DVec3::new(-0.03, 0.0, 0.0),
        normal: DVec3::Y,
        inward: DVec3::X,
        depth: 0.05,
        width: 0.6e-3,
        round,
        roughness: 1e-3,
    };
    let cut = [true, false].map(|round| {
        let concrete = grow(&Recipe { cracks: vec![crack(round)], ..core(7) });
        let grains: Vec<&Body> = concrete.bodies.iter().filter(|b| b.kind == Kind::Rock).collect();
        let painted = paint(&concrete, 0.5e-3);
        let [nx, ny, _] = painted.grid.size;
        let cracked: Vec<usize> = (0..painted.labels.len())
            .filter(|&i| painted.labels[i] == Label::Crack as u8)
            .collect();
        let at = |i: usize| {
            DVec3::new(
                painted.grid.at(0, i % nx),
                painted.grid.at(1, i / nx % ny),
                painted.grid.at(2, i / (nx * ny)),
            )
        };
        // Deep within a grain: not its rim.
        let inside =
            cracked.iter().filter(|&&i| grains.iter().any(|g| g.depth(at(i)) < -0.3)).count();
        inside as f64 / cracked.len() as f64
    });
    println!("share of the crack deep in grains: round {:.3}, through {:.3}", cut[0], cut[1]);
    assert!(cut[0] < 0.3 * cut[1] && cut[1] > 0.05, "{cut:?}");
}

/// Heights of a relief differ by r^H: between 1 and 16 mm, over 3000 pairs each, the exponent
/// within .1 (its error over seeds is about .03).
#[test]
fn relief_is_self_affine() {
    let relief = Relief::new(0.2, 1e-4, 2e-3, Key::new(9, 0));
    let spread = |r: f64| {
        let square = |i: u64| {
            let u = |d| Key::new(10, i).unit64(d);
            let p = DVec2::new(u(0), u(1));
            (relief.height(p) - relief.height(p + r * DVec2::from_angle(6.3 * u(2)))).powi(2)
        };
        ((0..3000).map(square).sum::<f64>() / 3000.0).sqrt()
    };
    let [near, far] = [spread(1e-3), spread(16e-3)];
    let hurst = (far / near).ln() / 16_f64.ln();
    assert!((hurst - crack::HURST).abs() < 0.1, "{hurst}");
    assert!(
        (far / 2e-3 - 1.0).abs() < 0.1 && (relief.difference(16e-3) / 2e-3 - 1.0).abs() < 1e-9,
        "{far}"
    );
}

/// Area of steel in sections of a bar, sound and corroded.
#[test]
fn bars_lose_what_they_lose() {
    for loss in [0.0, 0.25] {
        let line = vec![DVec3::new(0.0, 0.0, -0.05), DVec3::new(0.0, 0.0, 0.05)];
        let bars = vec![Bar { line, radius: 8e-3, ribbed: true, loss }];
        let recipe =
            Recipe { bars, share: 0.0, height: 0.08, outline: Outline::Round(0.02), ..core(8) };
        let painted = paint(&grow(&recipe), VOXEL);
        let steel: f64 = painted.shares.iter().map(|s| f64::from(s[2])).sum::<f64>()
            / f64::from(FULL)
            * VOXEL.powi(3)
            / 0.08;
        let nominal = std::f64::consts::PI * 64e-6;
        println!("loss {loss}: {:.4}", 1.0 - steel / nominal);
        assert!((steel / nominal - (1.0 - loss)).abs() < 0.02, "{loss}: {}", steel / nominal);
        assert_eq!(painted.shares.iter().any(|s| s[3] > 0), loss > 0.0);
    }
}

/// Slabs of a grid are what the whole is, and one thread does what many do.
#[test]
fn painting_does_not_depend_on_who_does_it() {
    let crack = Crack {
        mouth: DVec3::new(-0.03, 0.0, 0.0),
        normal: DVec3::Z,
        inward: DVec3::X,
        depth: 0.03,
        width: 4e-4,
        round: true,
        roughness: 1e-3,
    };
    let recipe = Recipe { air: vec![air(0.03)], cracks: vec![crack], ..core(9) };
    let all = grow(&recipe);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| {
        let concrete = grow(&recipe);
        (paint(&concrete, VOXEL), concrete)
    });
    assert_eq!(all.bodies, one.1.bodies);
    let whole = paint(&all, VOXEL);
    assert!(whole.shares == one.0.shares && whole.labels == one.0.labels);
    let other = paint(&grow(&Recipe { seed: 10, ..recipe }), VOXEL);
    assert!(other.labels != whole.labels);
}

/// Voxels without pores weigh what concrete weighs: 0.7 aggregate, the rest paste, whatever part of
/// the grains is placed.
#[test]
fn concrete_has_its_weight() {
    let library = Library::builtin().unwrap();
    for finest in [VOXEL, 3e-3] {
        let concrete = grow(&Recipe { finest, ..core(11) });
        let painted = paint(&concrete, finest);
        let mu = substances(&concrete, &library).unwrap()(200.0);
        let sum: f64 = painted
            .shares
            .iter()
            .flat_map(|s| [0, 1].map(|k| f64::from(s[k]) / f64::from(FULL) * mu[k]))
            .sum();
        let mean = sum / (painted.points as f64 / 64.0);
        // Quartz and mortar differ by half a per cent in attenuation per mass at 200 keV.
        let expected = library.material("mortar").unwrap().attenuation(200.0).total()
            * (0.7 * 2650.0 + 0.3 * 1900.0);
        assert!((mean / expected - 1.0).abs() < 0.01, "{finest}: {mean} {expected}");
    }
}

/// A hook is where its bar ends; elsewhere the bar is as straight as any.
#[test]
fn hooks_are_seen_where_bars_end() {
    let mut scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let column = &mut Arc::make_mut(&mut scene.structure).assemblies[0];
    let (id, start) = (column.id.clone(), column.frame.start);
    for line in column.steel.iter_mut().filter(|l| l.part == Part::Bar) {
        line.ends[1] = BarEnd::Hooked;
        line.inward = start - line.line[0];
    }
    let points = |along: f32| -> Vec<usize> {
        let member = Subject::of(&scene, &id).unwrap();
        let (recipe, _) = of_member(member, along, 0.58, 0.09, 4e-3, 1).unwrap();
        recipe.bars.iter().filter(|b| b.ribbed).map(|b| b.line.len()).collect()
    };
    assert_eq!(points(0.5), [2; 12]);
    assert_eq!(points(0.985), [7; 12]);
}

#[test]
fn members_bring_their_damage() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let member = |id: &str| Subject::of(&scene, id).unwrap();
    let (sound, place) = of_member(member("C1"), 0.5, 0.58, 0.09, 4e-3, 1).unwrap();
    assert!(
        !place.core
            && sound.outline.half().distance(DVec2::splat(0.2)) < 1e-6
            && sound.cracks.is_empty()
            && sound.air.len() == 1
    );
    assert!(sound.bars.iter().filter(|b| b.ribbed).count() == 12);
    let (cracked, _) = of_member(member("C2"), 0.35, 0.58, 0.09, 4e-3, 1).unwrap();
    assert_eq!((cracked.cracks.len(), cracked.air[0].porosity as f32), (1, 0.02));
    let crack = cracked.cracks[0];
    assert!(
        (crack.depth - 0.16).abs() < 1e-6
            && crack.mouth.distance(DVec3::X * 0.2) < 1e-4
            && crack.inward.distance(-DVec3::X) < 1e-6
    );
    let (foot, _) = of_member(member("C4"), 0.12, 0.58, 0.09, 4e-3, 1).unwrap();
    assert!(foot.spalls.len() == 1 && foot.bars.iter().all(|b| (b.loss - 0.25).abs() < 1e-6));
    assert!((foot.spalls[0].centre.y - 0.2).abs() < 1e-4 && foot.spalls[0].outward.y > 0.99);
    // What does not fit is a core.
    let (core, place) = of_member(member("C1"), 0.5, 0.3, 0.05, 1e-3, 1).unwrap();
    assert!(place.core && matches!(core.outline, Outline::Round(r) if r <= 0.135));
    assert!(of_member(member("C1"), 1.5, 0.3, 0.05, 1e-3, 1).is_err());
}

#[test]
fn what_cannot_be_is_refused() {
    let bad = |change: fn(&mut Recipe)| {
        let mut recipe = core(1);
        change(&mut recipe);
        matches!(Concrete::grow(&recipe, &Job::default()), Err(GrowError::Bad(_)))
    };
    assert!(
        bad(|r| r.height = f64::NAN)
            && bad(|r| r.share = 2.0)
            && bad(|r| r.outline = Outline::Round(0.0))
    );
    // Pores too fine to be placed thin the mortar.
    assert!(bad(|r| r.air.push(Air {
        from: -1.0,
        to: 1.0,
        porosity: 0.9,
        median: 1e-3,
        spread: 0.4,
        entrapped: 0.0
    })));
    let job = Job::default();
    job.cancel();
    assert!(matches!(Concrete::grow(&core(1), &job), Err(GrowError::Cancelled(_))));
}
