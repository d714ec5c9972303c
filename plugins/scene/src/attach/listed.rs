//! What is attached to members, for people and for scripts.

use serde::Serialize;

use crate::{
    Drilled, Scene, Slices,
    file::evidence::Face,
    structure::{Action, Date, Measures, Photographed, Place, Test},
};

/// One thing that is known of a member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Listed {
    /// Id of the member.
    pub member: String,
    /// What people call it.
    pub member_name: String,
    /// Name of the observation, the core, the load test or the gauge.
    pub name: String,
    /// What it is: `cover`, `crack`, `ct`, `load test`, `gauge` …
    pub kind: &'static str,
    /// When.
    pub date: Option<Date>,
    /// From and to on the axis, 0 to 1; none: nobody said.
    pub along: Option<[f32; 2]>,
    /// Side, degrees about the axis.
    pub angle_deg: Option<f32>,
    /// The face that has this angle, as `attach` takes it.
    pub face: Option<String>,
    /// Above the member's lowest point, m.
    pub height_m: Option<f32>,
    /// The value with its unit and its standard error.
    pub value: String,
    /// What it was measured with.
    pub instrument: Option<String>,
}

/// All observations, slices of files, load tests and readings of a scene, by member.
#[must_use]
pub fn listed(scene: &Scene) -> Vec<Listed> {
    let observed = scene.structure.observations.iter().map(|o| Listed {
        member: o.member.clone(),
        name: o.name.clone(),
        kind: o.shows.kind(),
        date: o.date,
        along: o.spot.is_placed().then_some(o.spot.along),
        angle_deg: o.spot.angle_deg,
        face: None,
        member_name: String::new(),
        height_m: o.spot.height_m,
        value: o.shows.to_string(),
        instrument: o.instrument.clone(),
    });
    let slices = scene.members.iter().flat_map(|m| m.slices.iter().map(|s| (m.id.as_str(), s)));
    let mut all: Vec<Listed> = observed
        .chain(slices.filter_map(|(member, slices)| of_slices(member, slices)))
        .chain(scene.structure.photographs.iter().map(of_photograph))
        .chain(scene.structure.tests.iter().map(of_test))
        .chain(readings(scene))
        .chain(series(scene))
        .collect();
    for one in &mut all {
        one.member_name = scene.name_of(&one.member).to_owned();
        let member = scene.members.iter().find(|m| m.id == one.member);
        let face = member.zip(one.angle_deg).and_then(|(m, a)| Face::at(a, m.kind, m.frame));
        one.face = face.map(|face| face.name().to_lowercase());
    }
    let place = |id: &str| scene.members.iter().position(|m| m.id == id);
    all.sort_by_cached_key(|one| place(&one.member));
    all
}

fn of_slices(member: &str, slices: &Slices) -> Option<Listed> {
    let (name, drilled, value) = match slices {
        Slices::Files { name, images, pixel_mm, drilled, .. } => {
            let pixel = pixel_mm.map_or(String::new(), |mm| format!(", {mm} mm a pixel"));
            (name, drilled, format!("{} slices{pixel}", images.len()))
        }
        Slices::Stack { name, images, voxel_mm, drilled } => {
            let edges = voxel_mm.map_or(String::new(), |[x, y, z]| format!(", {x} × {y} × {z} mm"));
            let files = match images.len() {
                1 => "volume".to_owned(),
                n => format!("volume of {n} files"),
            };
            (name, drilled, files + &edges)
        }
        Slices::Drawn { .. } | Slices::Scanned { .. } => return None,
    };
    let Drilled { along, angle_deg, date, .. } = *drilled;
    Some(Listed {
        member: member.to_owned(),
        name: name.clone(),
        kind: "ct",
        date,
        along: along.map(|at| [at; 2]),
        angle_deg,
        face: None,
        member_name: String::new(),
        height_m: None,
        value,
        instrument: None,
    })
}

fn of_photograph(photo: &Photographed) -> Listed {
    let file = photo.file.file_name().unwrap_or_default().to_string_lossy();
    Listed {
        member: photo.member.clone(),
        name: photo.name.clone(),
        kind: "photograph",
        date: photo.date,
        along: None,
        angle_deg: None,
        face: None,
        member_name: String::new(),
        height_m: None,
        value: file.into_owned(),
        instrument: None,
    }
}

fn of_test(test: &Test) -> Listed {
    let stretches = test.actions.iter().filter_map(|action| match *action {
        Action::Force { place: Place::Surface { from, to, .. }, .. }
        | Action::Line { from, to, .. } => Some([from, to]),
        _ => None,
    });
    let weights = test.actions.iter().map(|action| match action {
        Action::Force { force_kn, .. } => format!("{} kN", force_kn.length()),
        Action::Line { force_kn_m, .. } => format!("{} kN/m", force_kn_m.length()),
        _ => "another action".into(),
    });
    Listed {
        member: test.member.clone(),
        name: test.name.clone(),
        kind: "load test",
        date: None,
        along: stretches.reduce(|[a, b], [from, to]| [a.min(from), b.max(to)]),
        angle_deg: None,
        face: None,
        member_name: String::new(),
        height_m: None,
        value: weights.collect::<Vec<_>>().join(" + "),
        instrument: None,
    }
}

fn series(scene: &Scene) -> impl Iterator<Item = Listed> {
    let structure = &scene.structure;
    structure.series.iter().filter_map(|series| {
        let gauge = structure.gauges.iter().find(|g| g.name == series.gauge)?;
        Some(Listed {
            member: gauge.member.clone(),
            name: gauge.name.clone(),
            kind: "monitoring",
            date: series.samples.last().map(|s| s.date),
            along: Some([gauge.along; 2]),
            angle_deg: Some(gauge.angle_deg),
            face: None,
            member_name: String::new(),
            height_m: None,
            value: format!("{} readings", series.samples.len()),
            instrument: None,
        })
    })
}

fn readings(scene: &Scene) -> impl Iterator<Item = Listed> {
    let structure = &scene.structure;
    structure.readings.iter().filter_map(|reading| {
        let gauge = structure.gauges.iter().find(|g| g.name == reading.of)?;
        let (factor, unit) = match gauge.measures {
            Measures::Strain(_) => (1e6, "µε"),
            Measures::Stress(_) => (1e-6, "MPa"),
            Measures::Displacement(_) => (1e3, "mm"),
        };
        let short = |x: f64| (x * factor * 1e4).round() / 1e4;
        let test = reading.test.as_ref().map_or(String::new(), |t| format!(", test {t}"));
        Some(Listed {
            member: gauge.member.clone(),
            name: gauge.name.clone(),
            kind: "gauge",
            date: None,
            along: Some([gauge.along; 2]),
            angle_deg: Some(gauge.angle_deg),
            face: None,
            member_name: String::new(),
            height_m: None,
            value: format!("{} ± {} {unit}{test}", short(reading.value), short(reading.std_error)),
            instrument: None,
        })
    })
}
