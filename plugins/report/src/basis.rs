//! What a report rests on: the structure's name and owner, and of every member its measures,
//! materials, bars, exposure and loads, as the scene has them or as they were assumed.

use std::collections::BTreeMap;

use glam::Vec3;
use intrados_scene::{
    Assembly, Frame, Member, Part, Scene,
    structure::{Date, Project},
};
use serde::Serialize;

use crate::surface::concrete;

/// The basis of a report.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Basis {
    /// Whose structure it is.
    pub project: Project,
    /// Where on earth its model says that it stands, for people; empty where it does not.
    pub on_earth: String,
    /// Its members, in the order of the scene.
    pub members: Vec<MemberBasis>,
}

/// What is known of a member before anything was measured on it, for people.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemberBasis {
    /// Its id.
    pub id: String,
    /// m.
    pub length_m: f64,
    /// Length, how wide it is across, and volume.
    pub size: String,
    /// How wide it is across its axis, along the direction where angles begin and along that of
    /// 90 degrees, m; none of a member without a surface.
    pub across_m: Option<[f64; 2]>,
    /// Class.
    pub concrete: String,
    /// Bars, stirrups and tendons.
    pub steel: String,
    /// Exposure classes and age.
    pub exposure: String,
    /// Names of what acts on it.
    pub loads: String,
    /// What of all that nobody has stated.
    pub assumed: Vec<&'static str>,
}

impl Basis {
    /// Of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let member = |(index, m): (usize, &Member)| member(scene, index, m);
        let mut project = scene.structure.project.clone();
        if project.structure.is_empty() {
            project.structure = scene.name.clone();
        }
        project.inspected = scene.structure.today();
        let on_earth = on_earth(scene);
        Self { project, on_earth, members: scene.members.iter().enumerate().map(member).collect() }
    }

    /// The day so many months after the inspection; none where nobody said when that was.
    #[must_use]
    pub fn until(&self, months: u32) -> Option<Date> {
        // The mean month of the Gregorian calendar.
        self.project.inspected.map(|day| day.plus_days((f64::from(months) * 30.44) as i64))
    }

    /// Length of the member of that id, m; 1 where it is of none.
    #[must_use]
    pub(crate) fn length_of(&self, id: &str) -> f64 {
        self.members.iter().find(|b| b.id == id).map_or(1.0, |b| b.length_m)
    }
}

impl MemberBasis {
    /// Whether all that is said of two members is the same.
    pub(crate) fn is_built_like(&self, other: &Self) -> bool {
        fn said(b: &MemberBasis) -> [&str; 5] {
            [&b.size, &b.concrete, &b.steel, &b.exposure, &b.loads]
        }
        said(self) == said(other) && self.assumed == other.assumed
    }
}

/// The middle of the scene on the map of its model, or what the model says of its site.
fn on_earth(scene: &Scene) -> String {
    let place = &scene.structure.georeference;
    let [low, high] = scene.bounds();
    if let (Some([east, north, height]), Some(map)) = (place.on_map(0.5 * (low + high)), &place.map)
    {
        let crs = if map.crs.is_empty() { "unnamed reference system" } else { &map.crs };
        return format!("middle at {east:.1} m E, {north:.1} m N, {height:.1} m ({crs})");
    }
    match (place.latitude_deg, place.longitude_deg) {
        (Some(latitude), Some(longitude)) => format!("{latitude:.5}° N, {longitude:.5}° E"),
        _ => String::new(),
    }
}

/// How wide points are across the axis of a frame, towards its zero and its 90 degrees, m. The box
/// of a member in the world's axes says nothing of that, where the member does not lie along them.
fn across(frame: Frame, points: impl Iterator<Item = Vec3>) -> Option<[f64; 2]> {
    let ways = [frame.zero, frame.ninety()];
    let mut reach = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    for point in points {
        for (way, [low, high]) in ways.iter().zip(&mut reach) {
            let at = (point - frame.start).dot(*way);
            (*low, *high) = (low.min(at), high.max(at));
        }
    }
    let widths = reach.map(|[low, high]| f64::from(high - low));
    widths.iter().all(|w| w.is_finite()).then_some(widths)
}

fn member(scene: &Scene, index: usize, m: &Member) -> MemberBasis {
    let structure = &scene.structure;
    let assembly = structure.assembly_of(&m.id);
    let length_m = f64::from(m.frame.axis.length());
    let across_m = across(m.frame, concrete(scene, index).into_iter().flatten());
    let is_upright = f64::from(m.frame.axis.y.abs()) > 0.9 * length_m;
    let long = if is_upright { "high" } else { "long" };
    let wide = across_m
        .map_or_else(String::new, |[a, b]| format!(", {:.2} × {:.2} m across", a.max(b), a.min(b)));
    let volume = if m.volume > 0.0 { format!(", {:.2} m³", m.volume) } else { String::new() };
    let mut assumed = Vec::new();
    if m.concrete_assumed {
        assumed.push("concrete");
    }
    if assembly.is_some_and(|a| a.steel_assumed) {
        assumed.push("reinforcement");
    }
    let acts = structure.loads.iter().filter(|load| {
        load.members.is_empty()
            || assembly.is_some_and(|a| load.members.contains(&a.id))
            || load.members.contains(&m.id)
    });
    MemberBasis {
        id: m.id.clone(),
        length_m,
        size: format!("{length_m:.2} m {long}{wide}{volume}"),
        across_m,
        concrete: assembly
            .and_then(|a| a.matter.as_ref())
            .map_or_else(|| m.concrete.clone(), |matter| matter.computed_as(&m.concrete)),
        steel: assembly.map_or_else(|| "none known".into(), steel),
        exposure: m
            .exposure
            .as_ref()
            .map_or_else(|| "not stated".into(), |e| format!("{}, {:.0} years", e.class, e.years)),
        loads: listed(acts.map(|load| load.name.as_str()), "none"),
        assumed,
    }
}

/// How many bars of which diameter, stirrups and tendons.
fn steel(assembly: &Assembly) -> String {
    let mut counts: BTreeMap<(u8, u32), usize> = BTreeMap::new();
    for line in &assembly.steel {
        let kind = match line.part {
            Part::Bar => 0,
            Part::Stirrup => 1,
            _ => 2,
        };
        *counts.entry((kind, (1e3 * line.diameter).round() as u32)).or_default() += 1;
    }
    let word = |((kind, mm), n): (&(u8, u32), &usize)| {
        let what = ["bars", "stirrups", "tendons"][usize::from(*kind)];
        format!("{n} {what} of {mm} mm")
    };
    let words: Vec<String> = counts.iter().map(word).collect();
    listed(words.iter().map(String::as_str), "none known")
}

fn listed<'a>(words: impl Iterator<Item = &'a str>, nothing: &str) -> String {
    let all: Vec<&str> = words.collect();
    if all.is_empty() { nothing.to_owned() } else { all.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A girder of .3 by .25 m that lies at 31° to the world's axes had a box of 5.16 m.
    #[test]
    fn a_skewed_member_is_measured_along_its_own_axes() {
        let (sin, cos) = 31_f32.to_radians().sin_cos();
        let axis = 10.0 * Vec3::new(cos, 0.0, sin);
        let frame = Frame { start: Vec3::new(3.0, 1.0, -7.0), axis, zero: Vec3::Y };
        let corners = (0..8).map(|k| {
            let sign = |bit: i32| if k >> bit & 1 == 0 { -0.5 } else { 0.5 };
            frame.point(sign(0) + 0.5)
                + sign(1) * 0.25 * frame.zero
                + sign(2) * 0.3 * frame.ninety()
        });
        let [up, aside] = across(frame, corners).unwrap();
        assert!((up - 0.25).abs() < 1e-5 && (aside - 0.3).abs() < 1e-5, "{up} {aside}");
        assert_eq!(across(frame, std::iter::empty()), None);
    }
}
