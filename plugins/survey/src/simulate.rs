//! Readings made from planted truth, with the error of their instrument, and whether what is read
//! from them holds that truth. The maker knows the truth and draws from distributions; the reader
//! knows neither, and nothing here is used by it.

use std::collections::BTreeMap;

use intrados_damage::{
    evidence::{Cause, Evidence, all_causes},
    grading::Profile,
    zone::{ZONES, Zones},
};
use intrados_mechanics::material::durability::{Attack, Bars, Corrosion};
use intrados_scene::structure::{Course, Electrode, Shows, usual};
use intrados_stage::{Estimate, Job, random::Key, time::YEAR};
use statrs::distribution::{Beta, ContinuousCDF, Normal};

use crate::{
    findings,
    rust::{self, Possible},
    site::{Placed, Site},
    strength::{self, Concrete},
    weighed::{SURVEY, Said, shrunk},
};

/// Plantings a kind.
const PLANTINGS: u64 = 200;
/// Where readings are made.
const ZONE: usize = 4;
const AGE: f64 = 40.0 * YEAR;

/// Random numbers of one planting.
struct Dice(Key, std::cell::Cell<u32>);

impl Dice {
    fn new(seed: u64, planting: u64) -> Self {
        Self(Key::new(seed, planting), std::cell::Cell::new(0))
    }

    fn share(&self) -> f64 {
        self.1.set(self.1.get() + 1);
        self.0.unit64(self.1.get()).clamp(1e-9, 1.0 - 1e-9)
    }

    fn normal(&self, deviation: f64) -> f64 {
        deviation * Normal::standard().inverse_cdf(self.share())
    }

    fn happens(&self, probability: f64) -> bool {
        self.share() < probability
    }
}

/// Bars of 16 mm with stirrups of 8 mm over them: under 40 mm, or under 15 mm where air attacks,
/// which would take nothing of deeper ones.
fn site(corrosion: Corrosion) -> Site {
    let cover = if corrosion.carbonates() { 0.015 } else { 0.040 };
    let bars = Bars { weight: 1.0, cover, diameter: 0.016 };
    Site {
        corrosion: Ok(corrosion),
        bars: std::array::from_fn(|zone| if zone == ZONE { vec![bars] } else { Vec::new() }),
        outer: [Some(cover - 0.008); ZONES],
        age: AGE,
        is_steel_assumed: false,
        length: 10.0,
        sides: [0.4, 0.6],
    }
}

fn placed(shows: &Shows) -> Vec<Placed<'_>> {
    vec![Placed { number: 0, shows, zones: [ZONE; 2], before: 0.0, face: None }]
}

fn holds(found: Estimate, truth: f64) -> bool {
    (found.value - truth).abs() <= 1.96 * found.std_error.max(0.005)
}

/// What a kind of reading shows of steel that rusts as `truth` does; none where there is nothing to
/// be seen.
type Rusting = fn(&Possible, &Bars, &Dice) -> Option<Shows>;

const RUSTING: [(&str, &str, Rusting); 11] = [
    ("cover", "XD3", |truth, _, dice| {
        let mm = 32.0 + 1e3 * truth.other.cover + dice.normal(5.0) + dice.normal(3.0);
        Some(Shows::Cover { mm: mm.max(1.0), std_error_mm: 3.0 })
    }),
    ("carbonation", "XC4", carbonation),
    ("carbonation beside salt", "XC4, XD1", carbonation),
    ("chloride", "XD3", |truth, _, dice| {
        let Attack::Chloride { ingress, convection, .. } = &truth.other.attack else { panic!() };
        let model = 1.0 + dice.normal(0.15);
        let depths_mm = vec![10.0, 20.0, 30.0, 45.0];
        let content = |mm: &f64| {
            let depth = (1e-3 * mm - convection).max(0.0);
            (model * ingress.content(depth, AGE) + dice.normal(0.05)).max(0.0)
        };
        let percent_of_cement = depths_mm.iter().map(content).collect();
        Some(Shows::Chloride { depths_mm, percent_of_cement, std_error_percent: 0.05 })
    }),
    ("half-cell", "XD3", |truth, bars, dice| {
        // Two normals whose odds are those of ASTM C876: 10 % at −200, 90 % at −350 mV.
        let mean = if truth.other.is_active(bars.cover, AGE) { -375.0 } else { -175.0 };
        let mv = mean + dice.normal(82.6) + dice.normal(10.0);
        Some(Shows::HalfCell { mv, std_error_mv: 10.0, electrode: Electrode::CopperSulphate })
    }),
    ("crack along", "XD3", |truth, bars, dice| {
        let rust = rust::crack_mm(truth, bars, AGE);
        if dice.happens(rust::half_at(rust, 0.15, 0.4)) {
            return Some(crack((rust * dice.normal(0.5).exp() + dice.normal(0.05)).max(0.05)));
        }
        dice.happens(0.1).then(|| crack((-0.2 * dice.share().ln()).max(0.05)))
    }),
    ("intact", "XD3", |truth, bars, dice| {
        let rust = rust::crack_mm(truth, bars, AGE);
        let is_cracked = dice.happens(rust::half_at(rust, 0.15, 0.4)) || dice.happens(0.1);
        (!is_cracked).then_some(Shows::Intact { seen: 1.0, limit_mm: usual::FOUND_MM })
    }),
    ("sounding", "XD3", |truth, bars, dice| {
        let rust = rust::crack_mm(truth, bars, AGE);
        let is_hollow = dice.happens(0.03 + 0.94 * rust::half_at(rust, 0.4, 0.5));
        Some(Shows::Sounding { hollow_m2: if is_hollow { 0.3 } else { 0.0 }, tapped_m2: 1.0 })
    }),
    ("spall", "XD3", |truth, bars, dice| {
        let rust = rust::crack_mm(truth, bars, AGE);
        let has_come_off = dice.happens(0.03 + 0.9 * rust::half_at(rust, 1.0, 0.4));
        let spall = Shows::Spall { area_m2: 0.1, depth_mm: None, bars_bare: false };
        has_come_off.then_some(spall)
    }),
    ("rust", "XD3", |truth, bars, dice| {
        let rust = rust::crack_mm(truth, bars, AGE);
        let active = f64::from(u8::from(truth.other.is_active(bars.cover, AGE)));
        let stains = dice.happens(0.03 + 0.15 * active + 0.6 * rust::half_at(rust, 0.2, 0.5));
        stains.then_some(Shows::Rust { area_m2: 0.1 })
    }),
    ("wet spot", "XD3", |truth, bars, dice| {
        let often = if truth.other.is_active(bars.cover, AGE) { 0.3 } else { 0.2 };
        dice.happens(often).then_some(Shows::WetSpot { area_m2: 0.5 })
    }),
];

fn carbonation(truth: &Possible, _: &Bars, dice: &Dice) -> Option<Shows> {
    let front = truth.other.front()?;
    let depth = 1e3 * front.depth(AGE) * (1.0 + dice.normal(0.15)) + dice.normal(2.0);
    Some(Shows::Carbonation { mm: depth.max(0.0), std_error_mm: 2.0 })
}

fn crack(width_mm: f64) -> Shows {
    Shows::Crack { width_mm, std_error_mm: 0.05, course: Course::Along, length_m: None }
}

/// Of 200 plantings a kind, how often ± 1.96 standard errors hold the share of steel that is gone,
/// and how wide they are beside those of the class alone.
#[test]
fn intervals_of_rust_hold_the_planted_share() {
    let profile = Profile::default();
    for (name, class, read) in RUSTING {
        let corrosion = Corrosion::of_class(class, 30e6, 283.15).unwrap();
        // What is seen rarely needs many truths.
        let truths = rust::possible(&corrosion, rust::DRAWS + 40 * PLANTINGS as usize, AGE);
        let site = site(corrosion);
        let bars = site.bars[ZONE][0];
        let prior = site.corrosion.as_ref().unwrap().lost(&[bars], AGE).std_error;
        // A quarter of all is drawn of what no class foresees, where it is a twentieth of what may
        // be.
        let seen = truths[rust::DRAWS..].iter().enumerate().filter_map(|(k, truth)| {
            let dice = Dice::new(7, k as u64);
            let is_one = !truth.is_unforeseen() || dice.happens(0.05 / 0.95 * 3.0);
            Some((truth, read(truth, &bars, &dice).filter(|_| is_one)?))
        });
        let (mut held, mut error, mut count) = (0.0, 0.0, 0.0);
        for (truth, shows) in seen.take(PLANTINGS as usize) {
            let said = rust::Weighed::new(
                &site,
                &placed(&shows),
                &profile,
                &mut BTreeMap::new(),
                &Job::default(),
            )
            .unwrap();
            let (Cause::Steel, Zones(zones)) = said.zones().unwrap() else { panic!() };
            let found = zones[ZONE].unwrap();
            held += f64::from(u8::from(holds(found, truth.other.lost(&[bars], AGE).0)));
            (error, count) = (error + found.std_error, count + 1.0);
        }
        let (share, error) = (held / count, error / count / prior);
        println!("{name}: {:.1} % of {count} held, {error:.2} of the class's error", 100.0 * share);
        assert!(count > 150.0 && (0.90..=0.99).contains(&share), "{name}: {share}");
    }
}

/// What a kind of reading shows of concrete that has lost a share.
type Losing = fn(&Concrete, f64, &Dice) -> Shows;

const LOSING: [(&str, Losing); 3] = [
    ("core", |concrete, lost, dice| {
        let place =
            0.85 * concrete.mean_mpa * (1.0 + dice.normal(0.15)) * (1.0 + dice.normal(0.08));
        let mpa = ((1.0 - lost) * place / 0.82 * (1.0 + dice.normal(0.05))).max(1.0);
        Shows::CoreStrength { mpa, std_error_mpa: 0.05 * mpa, diameter_mm: 100.0, length_mm: 100.0 }
    }),
    ("rebound", |concrete, lost, dice| {
        let place =
            0.85 * concrete.mean_mpa * (1.0 + dice.normal(0.15)) * (1.0 + dice.normal(0.08));
        let cube = (1.0 - lost) * place * (1.0 + dice.normal(0.25)) / 0.8 / 1.05 + 12.91;
        // .01078 R² + .904 R = cube.
        let number = (-0.904 + (0.904_f64.powi(2) + 4.0 * 0.01078 * cube).sqrt()) / 0.02156;
        Shows::Rebound { number: number + dice.normal(2.0), std_error: 2.0 }
    }),
    ("velocity", |concrete, lost, dice| {
        let sound = concrete.velocity * (1.0 + dice.normal(0.04));
        let m_s = sound * (1.0 - lost).sqrt() * (1.0 + dice.normal(0.02));
        Shows::Velocity { m_s, std_error_m_s: 0.02 * m_s }
    }),
];

/// The same of strength and stiffness, of which up to half was planted as lost.
#[test]
fn intervals_of_strength_hold_the_planted_loss() {
    let concrete = Concrete::named("C30/37");
    for (name, read) in LOSING {
        let (mut held, mut error) = (0, 0.0);
        for k in 0..PLANTINGS {
            let dice = Dice::new(11, k);
            let lost = 0.5 * dice.share();
            let shows = read(&concrete, lost, &dice);
            let placed = placed(&shows);
            let zones = match shows {
                Shows::Velocity { .. } => strength::stiffness(&concrete, &placed),
                _ => strength::strength(&concrete, &placed),
            };
            let found = zones[ZONE].unwrap();
            held += u32::from(holds(found, lost));
            error += found.std_error / PLANTINGS as f64;
        }
        let share = f64::from(held) / PLANTINGS as f64;
        println!("{name}: {:.1} % held, ± {error:.2}", 100.0 * share);
        assert!((0.90..=0.99).contains(&share), "{name}: {share}");
    }
}

/// The same of what an eye finds: cracks across to a depth of Beta(2, 2), and what has come off to
/// a depth that was measured within a quarter, or as deep as the cover within half of it.
#[test]
fn intervals_of_findings_hold_the_planted_loss() {
    let site = site(Corrosion::of_class("XD3", 30e6, 283.15).unwrap());
    let profile = Profile::default();
    let depth = Beta::new(2.0, 2.0).unwrap();
    let crack = |dice: &Dice| {
        let width = 0.1 + 0.8 * dice.share();
        let seen = (width + dice.normal(0.05)).max(0.05);
        let shows = Shows::Crack {
            width_mm: seen,
            std_error_mm: 0.05,
            course: Course::Across,
            length_m: None,
        };
        (shows, width * depth.inverse_cdf(dice.share()))
    };
    let off = |depth: f64, area: f64| depth * area.sqrt() / (0.4 * 0.6);
    let spall = |dice: &Dice| {
        let (area, mm) = (0.05 + 0.2 * dice.share(), 20.0 + 40.0 * dice.share());
        let shows = Shows::Spall { area_m2: area, depth_mm: Some(mm), bars_bare: false };
        (shows, off(1e-3 * mm * (1.0 + dice.normal(0.25)), area))
    };
    let hollow = |dice: &Dice| {
        let area = 0.05 + 0.2 * dice.share();
        let shows = Shows::Sounding { hollow_m2: area, tapped_m2: 1.0 };
        (shows, off(0.032 * (1.0 + dice.normal(0.5)).max(0.0), area))
    };
    let kinds: [(&str, &dyn Fn(&Dice) -> (Shows, f64)); 3] =
        [("crack across", &crack), ("spall", &spall), ("hollow", &hollow)];
    for (name, plant) in kinds {
        let mut held = 0;
        for k in 0..PLANTINGS {
            let dice = Dice::new(13, k);
            let (shows, lost) = plant(&dice);
            // What an eye does not see of the section it looks at.
            let lost = (lost + dice.normal(0.05)).clamp(0.0, 1.0);
            let found = findings::lost(&site, &placed(&shows), &profile.rule)[ZONE].unwrap();
            held += u32::from(holds(found, lost));
        }
        let share = f64::from(held) / PLANTINGS as f64;
        println!("{name}: {:.1} % held", 100.0 * share);
        assert!((0.90..=0.995).contains(&share), "{name}: {share}");
    }
}

/// A share of damage in the zone where readings are made, and what is said of it.
struct Honeycomb {
    concrete: f64,
    stiffness: f64,
    slices: Evidence,
    pulse: Evidence,
}

impl Honeycomb {
    /// Pores that take up to six tenths of the strength, and .3 to all of that share of the
    /// stiffness, of which in one of ten places up to .55 is lost besides. Slices err as they say,
    /// and by what the profile says that they are blind to.
    fn plant(dice: &Dice, profile: &Profile) -> Self {
        let share = 0.3 + 0.7 * dice.share();
        let concrete = 0.6 * dice.share();
        let stiffness = if dice.happens(0.1) { 0.55 * dice.share() } else { 0.0 };
        let read = (concrete + dice.normal(0.05_f64.hypot(0.06))).clamp(0.0, 1.0);
        let mut zones = Zones::default();
        zones.0[ZONE] = Some(Estimate { value: read, std_error: 0.05 });
        let slices = Evidence::new("ct", true, [(Cause::Concrete, zones)].into(), String::new());
        let sound = Concrete::named("C30/37");
        let lost = 1.0 - (1.0 - share * concrete) * (1.0 - stiffness);
        let (_, velocity) = LOSING[2];
        let shows = velocity(&sound, lost, dice);
        let mut said = Said::default();
        let site = site(Corrosion::of_class("XD3", 30e6, 283.15).unwrap());
        let read = strength::stiffness(&sound, &placed(&shows));
        said.put(Cause::Stiffness, &shrunk(&read, Cause::Stiffness, profile), profile, &site);
        let pulse = said.evidence(SURVEY, String::new()).unwrap();
        Self { concrete, stiffness, slices: slices.unwrap(), pulse }
    }
}

/// Honeycomb that slices show and a pulse is slow in is not lost twice: of 200 the intervals of all
/// causes together hold. Counted as two causes that know nothing of each other, they do not.
#[test]
fn what_slices_and_a_pulse_both_speak_of_counts_once() {
    let profile = Profile::default();
    let (mut once_held, mut twice_held, mut error) = (0, 0, 0.0);
    for k in 0..PLANTINGS {
        let planted = Honeycomb::plant(&Dice::new(17, k), &profile);
        let truth = 1.0 - (1.0 - planted.concrete) * (1.0 - planted.stiffness);
        let together = |pulse: &Evidence| {
            let whole = profile.fusion.whole(&[&planted.slices, pulse]);
            let causes = [Cause::Concrete, Cause::Stiffness].map(|c| whole.causes[&c].0[ZONE]);
            all_causes(causes.into_iter().flatten()).unwrap()
        };
        let found = together(&planted.pulse);
        let apart = Evidence { mixed: Vec::new(), ..planted.pulse.clone() };
        once_held += u32::from(holds(found, truth));
        twice_held += u32::from(holds(together(&apart), truth));
        error += found.std_error / PLANTINGS as f64;
        // Each alone says what it said.
        for one in [&planted.slices, &planted.pulse] {
            let plain = Evidence { mixed: Vec::new(), ..one.clone() };
            assert_eq!(profile.fusion.whole(&[one]), profile.fusion.whole(&[&plain]));
        }
    }
    let [once_held, twice_held] = [once_held, twice_held].map(|n| f64::from(n) / PLANTINGS as f64);
    println!(
        "pores and pulse: {:.1} % held, ± {error:.2}; counted twice {:.1} %",
        100.0 * once_held,
        100.0 * twice_held
    );
    assert!((0.90..=0.99).contains(&once_held) && twice_held < 0.9, "{once_held} {twice_held}");
}
