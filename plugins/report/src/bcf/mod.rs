//! Defects as topics of the BIM Collaboration Format, for programs that have the IFC model open:
//! what it is, how urgent, which member, a camera that looks at it, and its picture where there is
//! one.
//!
//! The camera stands in IFC's axes, z up, and in the coordinates of the model that was imported.

mod view;
mod xml;

use std::io::{self, Cursor, Write};

use glam::DVec3;
use intrados_ct::Picture;
use intrados_damage::zone::ZONES;
use intrados_predict::{Defect, MemberPrediction, Prediction};
use intrados_scene::{
    Scene,
    structure::{Date, Georeference},
};
use serde_json::json;
use view::{View, view};
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

use crate::{
    basis::Basis,
    surface::concrete,
    words::{
        NOTHING, bad_probability, defect, due, finding, level, matters, metres, word, worse_half,
    },
};

/// An edition of the format.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Version {
    /// What most programs read.
    #[default]
    V2_1,
    /// The newest.
    V3_0,
}

/// Kinds of topic: what somebody found; a state that nobody found a defect for.
const TYPES: [&str; 2] = ["Defect", "Issue"];
/// All of them are still to be dealt with.
const OPEN: [&str; 1] = ["Open"];
/// By the worst state that a member may be in, from the best.
const PRIORITIES: [&str; 4] = ["Low", "Medium", "High", "Critical"];
/// That of what is to be inspected, since nobody has looked at it enough.
const NORMAL: usize = 1;
/// Name of a topic's camera.
const VIEWPOINT: &str = "viewpoint.bcfv";
/// Name of what the defect looks like.
const SNAPSHOT: &str = "snapshot.png";
/// Its longer side, pixels.
const SNAPSHOT_SIDE: u32 = 480;
/// Width over height of the picture that a camera is for.
const ASPECT: f64 = 4.0 / 3.0;
/// Its angle from bottom to top, degrees.
const FIELD_OF_VIEW: f64 = 60.0;

/// A BCF file: a topic for every defect, and for every member without one that may be in the worse
/// half of the states. `created`: date and time of the report, as `2026-05-03 14:20 UTC`; all else
/// is the same bits for the same prediction.
///
/// # Errors
/// Memory has no room for it.
pub fn bcf(
    scene: &Scene,
    prediction: &Prediction,
    basis: &Basis,
    created: &str,
    version: Version,
) -> io::Result<Vec<u8>> {
    let place = &scene.structure.georeference;
    // By its file: a folder is called anew for the next inspection.
    let stem = scene.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let file = stem.unwrap_or_else(|| prediction.scene.clone());
    let teller = Teller { prediction, file, basis, place, created: stamp(created), version };
    let mut archive = Archive::new();
    archive.add("bcf.version", &version.edition())?;
    if version == Version::V3_0 {
        archive.add("extensions.xml", &extensions())?;
    }
    for member in &prediction.members {
        let mut found: Vec<Option<&Defect>> = member.defects.iter().map(Some).collect();
        if found.is_empty() && teller.may_be_bad(member) {
            found.push(None);
        }
        let index = scene.members.iter().position(|m| m.id == member.id);
        let surface = index.filter(|_| !found.is_empty()).map(|i| concrete(scene, i));
        for defect in found {
            let topic = Told { member, defect };
            let view = index.zip(surface.as_ref()).map(|(i, surface)| {
                view(&scene.members[i], surface, topic.along(), defect.and_then(|d| d.angle_deg))
            });
            let guid = teller.guid(&topic, "topic");
            let snapshot = defect.and_then(picture);
            let markup = teller.markup(&topic, snapshot.is_some().then_some(SNAPSHOT));
            archive.add(&format!("{guid}/markup.bcf"), &markup)?;
            if let Some(png) = snapshot {
                archive.add_bytes(&format!("{guid}/{SNAPSHOT}"), &png)?;
            }
            archive.add(&format!("{guid}/{VIEWPOINT}"), &teller.viewpoint(&topic, view))?;
        }
    }
    archive.finish()
}

impl Version {
    fn edition(self) -> xml::Edition {
        match self {
            Self::V2_1 => xml::Edition { id: "2.1", detailed_version: Some("2.1") },
            Self::V3_0 => xml::Edition { id: "3.0", detailed_version: None },
        }
    }
}

fn extensions() -> xml::Extensions {
    xml::Extensions {
        topic_types: xml::TopicTypes { topic_type: &TYPES },
        topic_statuses: xml::TopicStatuses { topic_status: &OPEN },
        priorities: xml::Priorities { priority: &PRIORITIES },
    }
}

/// What a topic is about: a defect of a member, or its state.
struct Told<'a> {
    member: &'a MemberPrediction,
    defect: Option<&'a Defect>,
}

impl Told<'_> {
    /// From and to on the axis, 0 to 1.
    fn along(&self) -> Option<[f64; 2]> {
        match self.defect {
            Some(defect) => defect.along,
            None => self.member.worst_zone.map(|z| [z, z + 1].map(|k| k as f64 / ZONES as f64)),
        }
    }
}

struct Teller<'a> {
    prediction: &'a Prediction,
    /// What the scene's file is called, without its ending.
    file: String,
    basis: &'a Basis,
    place: &'a Georeference,
    created: String,
    version: Version,
}

impl Teller<'_> {
    /// Whether the worst state that a member may be in is of the worse half, and more than a
    /// forecast of nothing leaves that open.
    fn may_be_bad(&self, m: &MemberPrediction) -> bool {
        let states = &self.prediction.profile.states;
        let good = states.len() - worse_half(&self.prediction.profile).len();
        matters(m) && m.state_run.is_some_and(|[_, worst]| worst >= good)
    }

    /// The same for the same item of the same scene, whatever else is found: a hash of what it is
    /// of (RFC 9562, version 8), so that other programs know it again after the next inspection.
    fn guid(&self, told: &Told, what: &str) -> String {
        let kind = TYPES[usize::from(told.defect.is_none())];
        // What was found again is still what was found first.
        let first =
            |d: &Defect| d.course.first().map_or_else(|| d.item.clone(), |f| f.item.clone());
        let item = told.defect.map(|d| (d.kind, first(d)));
        let key = json!([self.file, told.member.id, kind, item, what]).to_string();
        let mut bytes = [0; 16];
        bytes.copy_from_slice(&blake3::hash(key.as_bytes()).as_bytes()[..16]);
        uuid::Builder::from_custom_bytes(bytes).into_uuid().to_string()
    }

    fn markup(&self, told: &Told, snapshot: Option<&'static str>) -> xml::Markup {
        let m = told.member;
        let guid = self.guid(told, "viewpoint");
        let view = xml::ViewPoint { guid, viewpoint: VIEWPOINT, snapshot };
        let (beside, within) = match self.version {
            Version::V2_1 => (Some(view), None),
            Version::V3_0 => (None, Some(xml::Viewpoints { view_point: view })),
        };
        let states = self.prediction.profile.states.len();
        xml::Markup {
            topic: xml::Topic {
                guid: self.guid(told, "topic"),
                topic_type: TYPES[usize::from(told.defect.is_none())],
                status: OPEN[0],
                title: format!("{}: {}", m.name, told.defect.map_or_else(|| finding(m), defect)),
                priority: m.state_run.map(|[_, worst]| match m.to_inspect {
                    true => PRIORITIES[NORMAL],
                    false => PRIORITIES[level(worst, states)],
                }),
                creation_date: self.created.clone(),
                creation_author: format!("Intrados {}", self.prediction.version),
                due_date: m
                    .within_months
                    .and_then(|months| self.basis.until(months))
                    .map(|day| format!("{day}T00:00:00Z")),
                description: self.description(told),
                viewpoints: within,
            },
            viewpoints: beside,
        }
    }

    /// What a reader without the report should know, a line each.
    fn description(&self, told: &Told) -> String {
        let m = told.member;
        let length = self.basis.length_of(&m.id);
        let mut lines = vec![format!("Member: {} ({})", m.name, m.id)];
        let along = told.along().map_or_else(
            || "nobody said where".into(),
            |along| format!("{} m of {length:.2} m along the axis", metres(along, length)),
        );
        let place = if told.defect.is_some() { "Place" } else { "Worst at" };
        lines.push(format!("{place}: {along}"));
        if let Some(d) = told.defect {
            let side = d.angle_deg.map(|a| format!("Side: {a:.0}° about the axis"));
            let size = (!d.size.is_empty()).then(|| format!("Size: {}", d.size));
            let quantity = d.quantity().map(|q| format!("Quantity: {q}"));
            let change = d.change().map(|c| format!("Course: {c}"));
            lines.extend([side, size, quantity, change].into_iter().flatten());
            let date = d.date.as_ref().map_or_else(String::new, |date| format!(", {date}"));
            lines.push(format!("Source: {}, {}{date}", word(d.source), d.item));
        }
        let damage = m.damage.zip(m.damage_std_error);
        let damage = damage.map_or_else(|| NOTHING.into(), |(d, s)| format!("{d:.2} ± {s:.2}"));
        let likely = 100.0 * bad_probability(m, &self.prediction.profile);
        lines.push(format!("Damage: {damage} (0 sound, 1 lost)"));
        let bad: Vec<&str> =
            worse_half(&self.prediction.profile).iter().map(|s| s.name.as_str()).collect();
        lines.push(format!("State: {}; {likely:.0} % {}", m.state, bad.join(" or ")));
        lines.push(format!("To do: {}", m.advice));
        lines.push(format!("When: {}", due(m, self.basis)));
        lines.join("\n")
    }

    fn viewpoint(&self, told: &Told, view: Option<View>) -> xml::VisualizationInfo {
        let id = &told.member.id;
        let is_ifc = is_global_id(id);
        let component = xml::Component {
            ifc_guid: is_ifc.then(|| id.clone()),
            originating_system: (!is_ifc).then_some("Intrados"),
            authoring_tool_id: (!is_ifc).then(|| id.clone()),
        };
        xml::VisualizationInfo {
            guid: self.guid(told, "viewpoint"),
            components: xml::Components {
                selection: xml::Selection { component },
                visibility: xml::Visibility { default: true },
            },
            perspective_camera: view.map(|view| xml::PerspectiveCamera {
                camera_view_point: ifc(self.place.in_model(view.eye)),
                camera_direction: ifc(view.direction.as_dvec3()),
                camera_up_vector: ifc(view.up.as_dvec3()),
                field_of_view: FIELD_OF_VIEW,
                aspect_ratio: (self.version == Version::V3_0).then_some(ASPECT),
            }),
        }
    }
}

/// What a defect looks like, PNG: its photograph, or what was cut out of one or of a slice.
fn picture(defect: &Defect) -> Option<Vec<u8>> {
    let photo = defect.photo.as_ref().and_then(|photo| Picture::read(photo, SNAPSHOT_SIDE));
    photo.as_ref().or(defect.picture.as_ref())?.png()
}

/// We have y up, IFC has z.
fn ifc(v: DVec3) -> xml::Vector {
    // Six digits, and no −0.
    let [x, y, z] = [v.x, -v.z, v.y].map(|c| (1e6 * c).round() / 1e6 + 0.0);
    xml::Vector { x, y, z }
}

/// Whether an id is a GlobalId of IFC: 128 bits in 22 characters of its own base 64, of which the
/// first holds two bits (ISO 16739-1, IfcGloballyUniqueId).
fn is_global_id(id: &str) -> bool {
    let is_digit = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
    id.len() == 22 && id.chars().all(is_digit) && id.starts_with(['0', '1', '2', '3'])
}

/// A report's date as XML Schema has it; today where there is none.
fn stamp(date: &str) -> String {
    let day: Date = date.get(..10).and_then(|day| day.parse().ok()).unwrap_or_else(Date::today);
    let below =
        |text: &str, limit: u8| text.len() == 2 && text.parse().is_ok_and(|n: u8| n < limit);
    let is_time = |time: &&str| {
        time.split_once(':').is_some_and(|(hour, minute)| below(hour, 24) && below(minute, 60))
    };
    let time = date.get(11..16).filter(is_time).unwrap_or("00:00");
    format!("{day}T{time}:00Z")
}

/// A zip file in memory, of files that know no time.
struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Archive {
    fn new() -> Self {
        Self(ZipWriter::new(Cursor::default()))
    }

    fn add(&mut self, name: &str, content: &impl serde::Serialize) -> io::Result<()> {
        let text = xml::text(content).map_err(io::Error::other)?;
        self.add_bytes(name, text.as_bytes())
    }

    fn add_bytes(&mut self, name: &str, content: &[u8]) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default());
        self.0.start_file(name, options)?;
        self.0.write_all(content)
    }

    fn finish(self) -> io::Result<Vec<u8>> {
        Ok(self.0.finish()?.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_global_id_has_22_digits_and_no_more_than_128_bits() {
        assert!(is_global_id("2O2Fr$t4X7Zf8NOew3FLOH") && is_global_id("0000000000000000000000"));
        for id in
            ["4O2Fr$t4X7Zf8NOew3FLOH", "2O2Fr$t4X7Zf8NOew3FLO", "2O2Fr-t4X7Zf8NOew3FLOH", "C1"]
        {
            assert!(!is_global_id(id), "{id}");
        }
    }

    #[test]
    fn a_report_without_a_date_is_of_today() {
        assert_eq!(stamp("2026-05-03 14:20 UTC"), "2026-05-03T14:20:00Z");
        assert_eq!(stamp("2026-05-03 at noon"), "2026-05-03T00:00:00Z");
        assert_eq!(stamp("€uropean nonsense"), format!("{}T00:00:00Z", Date::today()));
    }
}
