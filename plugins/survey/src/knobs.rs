//! One knob at a time: worse readings never say less damage, at the ends, too.

use std::collections::BTreeMap;

use intrados_damage::{
    grading::Profile,
    zone::{ZONES, Zones},
};
use intrados_mechanics::material::durability::{Bars, Corrosion};
use intrados_scene::structure::{Course, Electrode, Shows};
use intrados_stage::{Estimate, Job, random::Key, time::YEAR};

use crate::{
    findings, rust,
    site::{Placed, Site},
    strength,
    weighed::{Said, shrunk},
};

/// What falls by less is alike.
const ROUNDING: f64 = 1e-6;

fn site(class: &str, cover: f64, is_steel_assumed: bool) -> Site {
    let bars = Bars { weight: 1.0, cover: cover + 0.008, diameter: 0.016 };
    Site {
        corrosion: Ok(Corrosion::of_class(class, 30e6, 283.15).unwrap()),
        // Of two zones: each costs as much.
        bars: std::array::from_fn(|zone| if zone / 2 == 2 { vec![bars] } else { Vec::new() }),
        outer: [Some(cover); ZONES],
        age: 50.0 * YEAR,
        is_steel_assumed,
        length: 6.0,
        sides: [0.4, 0.6],
    }
}

fn placed<'a>(all: &'a [Shows], spread: bool) -> Vec<Placed<'a>> {
    let zone = |k: usize| if spread { 4 + k % 2 } else { 4 };
    let one = |(k, shows): (usize, &'a Shows)| Placed {
        number: k,
        shows,
        zones: [zone(k); 2],
        before: 0.0,
        face: None,
    };
    all.iter().enumerate().map(one).collect()
}

/// The largest probability of rust, and the largest share of steel that is gone.
fn weighed(site: &Site, readings: &[Placed]) -> (f64, f64) {
    let profile = Profile::default();
    let mut unused = BTreeMap::new();
    let said = rust::Weighed::new(site, readings, &profile, &mut unused, &Job::default()).unwrap();
    assert!(unused.is_empty(), "{unused:?}");
    let lost = said.zones().and_then(|(_, zones)| zones.worst()).unwrap().1.value;
    (said.worst().unwrap().1, lost)
}

fn never_falls(name: &str, knob: &[f64], found: &[(f64, f64)]) {
    println!("{name}: {knob:?} -> {found:.3?}");
    for (k, pair) in found.windows(2).enumerate() {
        let place = format!("{name} from {} to {}: {pair:?}", knob[k], knob[k + 1]);
        assert!(pair[1].0 >= pair[0].0 - ROUNDING, "{place}");
        assert!(pair[1].1 >= pair[0].1 - ROUNDING, "{place}");
    }
}

/// From the least to the most harmful.
type Knob<'a> = (&'a str, &'a [f64], &'a dyn Fn(f64) -> Shows);

const COVERS: [f64; 10] = [90.0, 70.0, 55.0, 45.0, 35.0, 25.0, 15.0, 10.0, 6.0, 2.0];

#[test]
fn worse_readings_never_say_less_rust() {
    let salty = |scale: f64| Shows::Chloride {
        depths_mm: vec![15.0, 30.0, 45.0, 60.0],
        percent_of_cement: [1.2, 0.7, 0.35, 0.15].map(|c| c * scale).to_vec(),
        std_error_percent: 0.05,
    };
    let one_depth = |percent: f64| Shows::Chloride {
        depths_mm: vec![40.0],
        percent_of_cement: vec![percent],
        std_error_percent: 0.05,
    };
    let front = |error: f64| move |mm| Shows::Carbonation { mm, std_error_mm: error };
    let cover = |error: f64| move |mm| Shows::Cover { mm, std_error_mm: error };
    let potential =
        |mv: f64| Shows::HalfCell { mv, std_error_mv: 10.0, electrode: Electrode::CopperSulphate };
    let fronts = [0.0, 0.5, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 90.0, 200.0];
    let salts = [0.0, 0.05, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 50.0];
    let potentials =
        [200.0, 0.0, -100.0, -200.0, -250.0, -300.0, -350.0, -450.0, -600.0, -900.0, -2000.0];
    let [usual, poor] = [2.0, 10.0];
    let knobs: [Knob; 7] = [
        ("cover, usual error", &COVERS, &cover(usual)),
        ("cover, poor instrument", &COVERS, &cover(poor)),
        ("carbonation, usual error", &fronts, &front(usual)),
        ("carbonation, poor", &fronts, &front(poor)),
        ("chloride", &salts, &salty),
        ("chloride at one depth", &salts, &one_depth),
        ("half-cell", &potentials, &potential),
    ];
    for class in ["XC4", "XD3", "XC4, XD3"] {
        for (name, knob, shows) in &knobs {
            let is_salt = class.contains("XD");
            if name.starts_with("chloride") && !is_salt
                || name.starts_with("carbonation") && !class.contains("XC")
            {
                continue;
            }
            for (count, spread, assumed) in [(1, false, true), (28, true, false)] {
                let site = site(class, if is_salt { 0.055 } else { 0.03 }, assumed);
                let found: Vec<(f64, f64)> = knob
                    .iter()
                    .map(|&x| {
                        let all: Vec<Shows> = (0..count).map(|_| shows(x)).collect();
                        weighed(&site, &placed(&all, spread))
                    })
                    .collect();
                never_falls(&format!("{class}, {count} × {name}"), knob, &found);
            }
        }
    }
}

/// The same beside other readings that stay as they are.
#[test]
fn worse_readings_never_say_less_rust_beside_others() {
    let other = [
        Shows::HalfCell { mv: -280.0, std_error_mv: 10.0, electrode: Electrode::CopperSulphate },
        Shows::Sounding { hollow_m2: 0.0, tapped_m2: 1.0 },
    ];
    let site = site("XC4, XD3", 0.055, true);
    let found = |shows: &dyn Fn(f64) -> Shows, knob: &[f64]| -> Vec<(f64, f64)> {
        knob.iter()
            .map(|&x| {
                let mut all = other.to_vec();
                all.push(shows(x));
                let readings = placed(&all, false);
                (weighed(&site, &readings).0, 0.0)
            })
            .collect()
    };
    let cover = found(&|mm| Shows::Cover { mm, std_error_mm: 2.0 }, &COVERS[..7]);
    never_falls("cover beside half-cell", &COVERS[..7], &cover);
    let fronts = [2.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0];
    let front = found(&|mm| Shows::Carbonation { mm, std_error_mm: 2.0 }, &fronts);
    never_falls("carbonation beside half-cell", &fronts, &front);
}

/// A measured cover of 10 mm in salt is rust, however thick it was assumed (of some states salt at
/// the surface stays below what steel bears, whatever the cover).
#[test]
fn an_instrument_is_believed() {
    for (count, least) in [(1, 0.7), (28, 0.7)] {
        let all = vec![Shows::Cover { mm: 10.0, std_error_mm: 2.0 }; count];
        let (active, _) = weighed(&site("XD3", 0.055, true), &placed(&all, false));
        assert!(active > least, "{count}: {active}");
    }
    let deep = [Shows::Carbonation { mm: 60.0, std_error_mm: 2.0 }];
    let (active, _) = weighed(&site("XC4", 0.04, true), &placed(&deep, false));
    assert!(active > 0.8, "{active}");
    let shallow = [Shows::Carbonation { mm: 5.0, std_error_mm: 2.0 }];
    let (active, _) = weighed(&site("XC4", 0.04, true), &placed(&shallow, false));
    assert!(active < 0.15, "{active}");
    let salt = [Shows::Chloride {
        depths_mm: vec![50.0, 63.0],
        percent_of_cement: vec![2.5, 2.0],
        std_error_percent: 0.05,
    }];
    let (active, _) = weighed(&site("XD3", 0.055, true), &placed(&salt, false));
    assert!(active > 0.95, "{active}");
}

const WIDTHS: [f64; 14] =
    [0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0, 1.5, 3.0, 5.0, 10.0, 50.0, 100.0];

/// Alone, or beside a forecast that expects nothing.
fn damage(site: &Site, all: &[Shows], has_forecast: bool) -> f64 {
    let profile = Profile::default();
    let placed = placed(all, false);
    let mut said = Said::default();
    let lost = findings::lost(site, &placed, &profile.rule);
    said.put(intrados_damage::Cause::Concrete, &lost, &profile, site);
    let concrete = strength::Concrete::named("C30/37");
    let stiffness = strength::stiffness(&concrete, &placed);
    let stiffness = shrunk(&stiffness, intrados_damage::Cause::Stiffness, &profile);
    said.put(intrados_damage::Cause::Stiffness, &stiffness, &profile, site);
    let evidence = said.evidence("survey", String::new()).unwrap();
    let nothing = Zones::all(Estimate { value: 0.0, std_error: 0.0 });
    let zones = [(intrados_damage::Cause::Concrete, nothing)];
    let forecast = intrados_damage::Evidence::new("forecast", false, zones.into(), String::new());
    let mut said = vec![&evidence];
    said.extend(forecast.iter().filter(|_| has_forecast));
    profile.fusion.whole(&said).damage().unwrap().value
}

#[test]
fn wider_cracks_never_do_less_damage() {
    let site = site("XC4", 0.03, true);
    for course in [Course::Across, Course::Diagonal, Course::Map, Course::Along] {
        for error in [0.0, 0.05, 0.3, 1.0, 5.0, -0.25] {
            for (count, length_m, has_forecast) in
                [(1, None, false), (1, Some(0.2), false), (3, None, false), (1, None, true)]
            {
                let found: Vec<f64> = WIDTHS
                    .iter()
                    .map(|&width_mm| {
                        let std_error_mm = if error < 0.0 { -error * width_mm } else { error };
                        let crack =
                            |width_mm| Shows::Crack { width_mm, std_error_mm, course, length_m };
                        let mut all = vec![crack(0.15); count - 1];
                        all.push(crack(width_mm));
                        damage(&site, &all, has_forecast)
                    })
                    .collect();
                println!("{course:?} ± {error}, {count}: {found:.3?}");
                let falls = found.windows(2).any(|w| w[1] < w[0] - ROUNDING);
                assert!(!falls, "{course:?} ± {error}, {count}: {found:?}");
                let is_across = course != Course::Along && length_m.is_none() && !has_forecast;
                assert!(!is_across || found[13] >= 0.5, "{found:?}");
            }
        }
    }
}

/// More that has come off, or sounds hollow, neither.
#[test]
fn larger_spalls_never_do_less_damage() {
    let site = site("XC4", 0.03, true);
    let areas = [0.001, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0, 2.0, 5.0];
    let spall = |area_m2: f64, depth_mm| Shows::Spall { area_m2, depth_mm, bars_bare: true };
    let hollow = |area: f64| Shows::Sounding { hollow_m2: area, tapped_m2: 6.0 };
    let unmeasured = |area: f64| spall(area, None);
    let measured = |area: f64| spall(area, Some(60.0));
    let all: [&dyn Fn(f64) -> Shows; 3] = [&unmeasured, &measured, &hollow];
    for of in all {
        let found: Vec<f64> = areas.iter().map(|&area| damage(&site, &[of(area)], false)).collect();
        assert!(found.windows(2).all(|w| w[1] >= w[0] - ROUNDING), "{found:?}");
    }
}

#[test]
fn wider_cracks_along_never_say_less_rust() {
    for class in ["XC1", "XC4", "XD3"] {
        for error in [0.02, 0.1, 0.5, 2.0, -0.25] {
            let site = site(class, 0.03, true);
            let found: Vec<(f64, f64)> = WIDTHS
                .iter()
                .map(|&width_mm| {
                    let std_error_mm = if error < 0.0 { -error * width_mm } else { error };
                    let crack = Shows::Crack {
                        width_mm,
                        std_error_mm,
                        course: Course::Along,
                        length_m: None,
                    };
                    weighed(&site, &placed(&[crack], false))
                })
                .collect();
            never_falls(&format!("{class}, crack along ± {error}"), &WIDTHS, &found);
        }
    }
}

/// The sums that readings of one place are gathered into say what each reading says by itself.
#[test]
fn gathered_readings_say_what_single_ones_say() {
    let key = Key::new(3, 1);
    let mut site = site("XD3", 0.04, false);
    // Zones beside it hear less.
    site.bars =
        std::array::from_fn(|zone| if zone == 4 { site.bars[4].clone() } else { Vec::new() });
    let corrosion = site.corrosion.as_ref().unwrap();
    let draws = rust::possible(corrosion, rust::DRAWS, site.age);
    let all: Vec<Shows> = (0..200)
        .map(|k| Shows::HalfCell {
            mv: -400.0 + 300.0 * key.unit64(k),
            std_error_mv: 10.0,
            electrode: Electrode::CopperSulphate,
        })
        .collect();
    let mut readings = placed(&all, false);
    for (k, p) in readings.iter_mut().enumerate() {
        p.before = (k % 7) as f64 * 3.0 * YEAR;
    }
    let (active, _) = weighed(&site, &readings);
    let cover = site.bars[4][0].cover;
    let (mut whole, mut rusting) = (0.0, 0.0);
    for draw in &draws {
        let log = |p: &Placed| {
            let Shows::HalfCell { mv, std_error_mv, .. } = *p.shows else { panic!() };
            let share = rust::rusts(mv, std_error_mv);
            let is_active = draw.other.is_active(cover, site.age - p.before);
            (if is_active { share } else { 1.0 - share }).ln() / readings.len() as f64
        };
        let weight = (draw.prior + readings.iter().map(log).sum::<f64>()).exp();
        whole += weight;
        rusting += if draw.other.is_active(cover, site.age) { weight } else { 0.0 };
    }
    assert!((active - rusting / whole).abs() < 1e-9, "{active} {}", rusting / whole);
}

/// Ten times the readings are no more than ten times the work: counted by what the job is asked.
#[test]
fn many_readings_of_one_member_are_gathered() {
    let potential = |k: u32| Shows::HalfCell {
        mv: -100.0 - f64::from(k % 5000) / 10.0,
        std_error_mv: 10.0,
        electrode: Electrode::CopperSulphate,
    };
    let cover = |k: u32| Shows::Cover { mm: 30.0 + f64::from(k % 997) / 50.0, std_error_mm: 2.0 };
    let all: Vec<Shows> =
        (0..120_000).map(|k| if k % 2 == 0 { potential(k) } else { cover(k) }).collect();
    let readings = placed(&all, true);
    let (active, _) = weighed(&site("XD3", 0.055, true), &readings);
    assert!((0.0..=1.0).contains(&active));
    // Somebody who asks it to stop is heard.
    let job = Job::default();
    job.cancel();
    let profile = Profile::default();
    let site = site("XD3", 0.055, true);
    let stopped = rust::Weighed::new(&site, &readings, &profile, &mut BTreeMap::new(), &job);
    assert!(stopped.is_err());
}

#[test]
fn nothing_lost_stays_nothing() {
    let intact = Shows::Intact { seen: 1.0, limit_mm: 0.15 };
    let zones = Zones(findings::lost(
        &site("XC4", 0.03, true),
        &placed(&[intact], false),
        &Profile::default().rule,
    ));
    assert_eq!(zones.worst().map(|(_, e): (usize, Estimate)| e.value), Some(0.0));
}
