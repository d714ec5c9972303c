//! Defects as an owner's list has them: what, where, how large, how much of it, told by whom.

use std::path::PathBuf;

use intrados_ct::Picture;
use intrados_damage::zone::zone_at;
use intrados_scene::{
    Scene,
    structure::{Course, Date, Observation, Shows},
};
use intrados_stage::Estimate;
use intrados_survey::{
    self as survey, SURVEY,
    photographed::{PHOTOGRAPHED, Shown},
};
use serde::Serialize;

use crate::{CT, SliceReading, section::widest};

/// One thing that is wrong with a member, as somebody found it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Defect {
    /// What it is, for people: `"crack across"`.
    pub kind: &'static str,
    /// From and to on the member's axis, 0 to 1; none: nobody knows where.
    pub along: Option<[f64; 2]>,
    /// Side, degrees about the axis.
    pub angle_deg: Option<f64>,
    /// Its size with its error, for people: `"0.30 ± 0.05 mm wide"`.
    pub size: String,
    /// Width of a crack, mm.
    pub width_mm: Option<f64>,
    /// Length of a crack, m.
    pub length_m: Option<f64>,
    /// Area, m².
    pub area_m2: Option<f64>,
    /// Which source tells of it.
    pub source: &'static str,
    /// Which item of that source.
    pub item: String,
    /// The day on which it was found last, where somebody said it.
    pub date: Option<String>,
    /// What was found at each inspection, from the earliest to the latest, whose size counts; empty
    /// of one inspection alone.
    pub course: Vec<Found>,
    /// What it looks like, small.
    #[serde(skip)]
    pub picture: Option<Picture>,
    /// Its photograph: read by whoever shows it, since a prediction is put together often.
    #[serde(skip)]
    pub photo: Option<PathBuf>,
}

/// What one inspection found of a defect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// When; none: nobody said, and it is taken for as of the day of the prediction.
    pub date: Option<Date>,
    /// Which item of its source.
    pub item: String,
    /// Width of a crack, mm, or its area, m².
    pub size: Option<f64>,
    /// Its standard error.
    pub std_error: Option<f64>,
    /// `"mm"` or `"m²"`.
    pub unit: &'static str,
}

impl Defect {
    /// How it has changed from inspection to inspection, for people: `"0.20 (2016), 0.35 (2021),
    /// 0.60 mm (2026): grew by 0.05 mm a year since 2021"`.
    #[must_use]
    pub fn change(&self) -> Option<String> {
        let known: Vec<(&Found, f64)> =
            self.course.iter().filter_map(|f| Some((f, f.size?))).collect();
        let [.., (before, was), (last, is)] = known[..] else { return None };
        let days: Vec<String> =
            known.iter().filter_map(|(f, _)| Some(f.date?.to_string())).collect();
        let are_years = days.windows(2).all(|w| w[0].get(..4) != w[1].get(..4));
        let day = |f: &Found| match f.date.map(|d| d.to_string()) {
            Some(day) if are_years => day.get(..4).unwrap_or(&day).to_owned(),
            Some(day) => day,
            None => "undated".into(),
        };
        let digits = if last.unit == "mm" { 2 } else { 3 };
        let sizes = known.iter().enumerate().map(|(k, (f, size))| {
            let unit = if k + 1 == known.len() { format!(" {}", f.unit) } else { String::new() };
            format!("{size:.digits$}{unit} ({})", day(f))
        });
        let sizes = sizes.collect::<Vec<_>>().join(", ");
        let since = day(before);
        let error = before.std_error.unwrap_or(0.0).hypot(last.std_error.unwrap_or(0.0));
        let told = if (is - was).abs() <= 1.96 * error {
            format!("no change since {since} beyond the error of reading")
        } else {
            let word = if is > was { "grew" } else { "shrank" };
            let years = before.date.zip(last.date).map(|(a, b)| a.days_until(b) as f64 / 365.25);
            let (by, rate) = match years.filter(|&years| years >= 0.5) {
                Some(years) => ((is - was).abs() / years, " a year"),
                None => ((is - was).abs(), ""),
            };
            format!("{word} by {by:.digits$} {}{rate} since {since}", last.unit)
        };
        Some(format!("{sizes}: {told}"))
    }

    /// How much of it there is, for a bill: metres of crack or square metres.
    #[must_use]
    pub fn quantity(&self) -> Option<String> {
        let length = self.length_m.map(|m| format!("{m:.2} m"));
        self.area_m2.map(|m2| format!("{m2:.3} m²")).or(length)
    }
}

/// All that was found on a member, by eyes and hammers first, then by photographs, then by CT.
/// What inspections found again is one.
#[must_use]
pub(crate) fn defects(
    scene: &Scene,
    member: &str,
    photographed: &Shown,
    slices: &[SliceReading],
) -> Vec<Defect> {
    let member_of = scene.members.iter().find(|m| m.id == member);
    let length = member_of.map_or(1.0, |m| f64::from(m.frame.axis.length()));
    let seen = survey::of_member(scene, member).map(|(_, o)| (SURVEY, o, None));
    let shown = photographed.observations.iter().zip(&photographed.pictures);
    let shown = shown.map(|(o, picture)| (PHOTOGRAPHED, o, picture.as_ref()));
    let told: Vec<(&'static str, &Observation, Option<&Picture>)> = seen.chain(shown).collect();
    let all: Vec<&Observation> = told.iter().map(|(_, o, _)| *o).collect();
    let one = |group: Vec<usize>| {
        let &(source, o, picture) = told.get(*group.last()?)?;
        let defect = Defect { picture: picture.cloned(), ..self::seen(source, o)? };
        let is_again = group.len() > 1;
        let course =
            if is_again { group.iter().map(|&k| Found::of(all[k])).collect() } else { Vec::new() };
        Some(Defect { course, ..defect })
    };
    let found = survey::found_again(&all, length).into_iter().filter_map(one);
    found.chain(grouped(slices).iter().flat_map(|group| sectioned(group))).collect()
}

/// Whether [`defects`] has any beside cracks no wider than `limit_mm`, without putting them
/// together.
#[must_use]
pub(crate) fn has_defects(
    scene: &Scene,
    member: &str,
    photographed: &Shown,
    slices: &[SliceReading],
    limit_mm: Option<f64>,
) -> bool {
    let member_of = scene.members.iter().find(|m| m.id == member);
    let length = member_of.map_or(1.0, |m| f64::from(m.frame.axis.length()));
    let surveyed = survey::of_member(scene, member).map(|(_, o)| o);
    let all: Vec<&Observation> = surveyed.chain(&photographed.observations).collect();
    let is_admitted = |width: f64| limit_mm.is_some_and(|limit| width <= limit);
    let counts = |shows: &Shows| match shows {
        Shows::Crack { width_mm, .. } => !is_admitted(*width_mm),
        other => is_defect(other),
    };
    let last = |group: &Vec<usize>| group.last().is_some_and(|&k| counts(&all[k].shows));
    let beyond = |lost: Option<Estimate>| lost.is_some_and(|lost| is_beyond(&lost));
    let shows = |s: &SliceReading| {
        s.cracks.iter().any(|c| !is_admitted(c.width_mm))
            || beyond(s.lost)
            || beyond(s.steel.map(|steel| steel.loss))
    };
    survey::found_again(&all, length).iter().any(last) || slices.iter().any(shows)
}

/// Whether an observation found something, and not nothing, nor is a reading of an instrument.
fn is_defect(shows: &Shows) -> bool {
    match shows {
        Shows::Crack { .. }
        | Shows::Spall { .. }
        | Shows::Rust { .. }
        | Shows::Efflorescence { .. }
        | Shows::WetSpot { .. } => true,
        Shows::Sounding { hollow_m2, .. } => *hollow_m2 > 0.0,
        _ => false,
    }
}

/// Whether a share is more than its error.
fn is_beyond(lost: &Estimate) -> bool {
    lost.value > 1.96 * lost.std_error && lost.value > 0.0
}

impl Found {
    fn of(o: &Observation) -> Self {
        let (size, std_error, unit) = match o.shows {
            Shows::Crack { width_mm, std_error_mm, .. } => {
                (Some(width_mm), Some(std_error_mm), "mm")
            }
            Shows::Spall { area_m2, .. }
            | Shows::Rust { area_m2 }
            | Shows::Efflorescence { area_m2 }
            | Shows::WetSpot { area_m2 } => (Some(area_m2), None, "m²"),
            Shows::Sounding { hollow_m2, .. } => (Some(hollow_m2), None, "m²"),
            _ => (None, None, ""),
        };
        Self { date: o.date, item: o.name.clone(), size, std_error, unit }
    }
}

/// What an observation found; none where it is a reading of an instrument, or where nothing was.
fn seen(source: &'static str, o: &Observation) -> Option<Defect> {
    if !is_defect(&o.shows) {
        return None;
    }
    let mut defect = Defect {
        kind: "",
        along: o.spot.is_placed().then(|| o.spot.along.map(f64::from)),
        angle_deg: o.spot.angle_deg.map(f64::from),
        size: String::new(),
        width_mm: None,
        length_m: None,
        area_m2: None,
        source,
        item: o.name.clone(),
        date: o.date.map(|d| d.to_string()),
        course: Vec::new(),
        picture: None,
        photo: o.picture.clone(),
    };
    match o.shows {
        Shows::Crack { width_mm, std_error_mm, course, length_m } => {
            defect.kind = match course {
                Course::Along => "crack along",
                Course::Across => "crack across",
                Course::Diagonal => "diagonal crack",
                Course::Map => "net of cracks",
            };
            defect.size = format!("{width_mm:.2} ± {std_error_mm:.2} mm wide");
            (defect.width_mm, defect.length_m) = (Some(width_mm), length_m);
        }
        Shows::Spall { area_m2, depth_mm, bars_bare } => {
            defect.kind = if bars_bare { "spall, bars bare" } else { "spall" };
            defect.size = depth_mm.map_or(String::new(), |mm| format!("{mm:.0} mm deep"));
            defect.area_m2 = Some(area_m2);
        }
        Shows::Sounding { hollow_m2, tapped_m2 } => {
            defect.kind = "hollow area";
            defect.size = format!("of {tapped_m2:.2} m² tapped");
            defect.area_m2 = Some(hollow_m2);
        }
        Shows::Rust { area_m2 } => {
            (defect.kind, defect.area_m2) = ("rust stain", Some(area_m2));
        }
        Shows::Efflorescence { area_m2 } => {
            (defect.kind, defect.area_m2) = ("efflorescence", Some(area_m2));
        }
        Shows::WetSpot { area_m2 } => (defect.kind, defect.area_m2) = ("wet spot", Some(area_m2)),
        _ => return None,
    }
    Some(defect)
}

/// What the sections of a core show in one zone, of which many may show the same: the widest crack,
/// what has fallen off, and what is gone of its bars, each where it is more than its error.
fn sectioned(sections: &[&SliceReading]) -> Vec<Defect> {
    let of = |slice: &SliceReading, kind, size, shown: usize| Defect {
        kind,
        along: slice.along.map(|along| [along; 2]),
        angle_deg: slice.drilled.and_then(|d| d.angle_deg).map(f64::from),
        size: match sections.len() {
            1 => size,
            all => format!("{size}, in {shown} of {all} sections"),
        },
        width_mm: None,
        length_m: None,
        area_m2: None,
        source: CT,
        item: format!("{}, {}", slice.core, slice.name),
        date: slice.drilled.and_then(|d| d.date).map(|d| d.to_string()),
        course: Vec::new(),
        picture: None,
        photo: None,
    };
    let cracked = || sections.iter().filter_map(|s| Some((*s, widest(&s.cracks)?)));
    let worst = cracked().max_by(|a, b| a.1.width_mm.total_cmp(&b.1.width_mm));
    let crack = worst.map(|(slice, crack)| Defect {
        picture: slice.widest.clone(),
        width_mm: Some(crack.width_mm),
        length_m: Some(1e-3 * slice.cracks.iter().map(|c| c.length_mm).sum::<f64>()),
        ..of(
            slice,
            "crack in the section",
            format!("{:.2} mm wide", crack.width_mm),
            cracked().count(),
        )
    });
    let share = |kind, lost: &dyn Fn(&SliceReading) -> Option<Estimate>| {
        let found = || sections.iter().filter_map(|s| Some((*s, lost(s).filter(is_beyond)?)));
        let (slice, worst) = found().max_by(|a, b| a.1.value.total_cmp(&b.1.value))?;
        let [value, error] = [worst.value, worst.std_error].map(|x| 100.0 * x);
        let size = format!("{value:.1} ± {error:.1} % of the section");
        Some(of(slice, kind, size, found().count()))
    };
    let off = share("fallen off", &|s| s.lost);
    let rust = share("bars rusted away", &|s| Some(s.steel?.loss));
    [crack, off, rust].into_iter().flatten().collect()
}

/// Sections by core and zone, in the order of the first of each.
fn grouped(slices: &[SliceReading]) -> Vec<Vec<&SliceReading>> {
    let place = |s: &SliceReading| (s.core_number, s.along.map(zone_at));
    let mut groups: Vec<Vec<&SliceReading>> = Vec::new();
    for slice in slices {
        match groups.iter_mut().find(|g| place(g[0]) == place(slice)) {
            Some(group) => group.push(slice),
            None => groups.push(vec![slice]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cracked(found: &[(Option<&str>, f64)]) -> Defect {
        let found = found.iter().map(|(date, width)| Found {
            date: date.map(|d| d.parse().unwrap()),
            item: String::new(),
            size: Some(*width),
            std_error: Some(0.05),
            unit: "mm",
        });
        Defect {
            kind: "crack across",
            along: None,
            angle_deg: None,
            size: String::new(),
            width_mm: None,
            length_m: None,
            area_m2: None,
            source: SURVEY,
            item: String::new(),
            date: None,
            course: found.collect(),
            picture: None,
            photo: None,
        }
    }

    #[test]
    fn a_defect_tells_its_course() {
        let all =
            [(Some("2016-05-03"), 0.2), (Some("2021-05-03"), 0.35), (Some("2026-05-03"), 0.6)];
        assert_eq!(
            cracked(&all).change().unwrap(),
            "0.20 (2016), 0.35 (2021), 0.60 mm (2026): grew by 0.05 mm a year since 2021"
        );
        let same = [(Some("2026-01-02"), 0.3), (Some("2026-05-03"), 0.35)];
        assert_eq!(
            cracked(&same).change().unwrap(),
            "0.30 (2026-01-02), 0.35 mm (2026-05-03): no change since 2026-01-02 beyond the error of reading"
        );
        assert_eq!(
            cracked(&[(Some("2021-05-01"), 0.5), (None, 0.3)]).change().unwrap(),
            "0.50 (2021), 0.30 mm (undated): shrank by 0.20 mm since 2021"
        );
        assert_eq!(cracked(&[]).change(), None);
    }
}
