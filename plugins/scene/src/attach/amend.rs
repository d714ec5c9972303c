//! Changes of the scene's own file by a form: written over as text, checked as the file is.

use std::fmt::Write;

use intrados_stage::Job;

use super::{
    AttachError, Change, Project, fields, text_of,
    tree::{self, Step},
    write,
};
use crate::{
    Scene,
    file::{self, SceneFile},
};

/// A value, and where in the file it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub(super) path: Vec<Step>,
    /// As RON; none: it is taken out.
    pub(super) value: Option<String>,
}

impl Setting {
    /// The number of an entry that it takes out of a list, where those behind it move up.
    fn entry_gone(&self) -> Option<usize> {
        match self.path.last() {
            Some(Step::Entry(number)) if self.value.is_none() => Some(*number),
            _ => None,
        }
    }
}

impl Project {
    /// Writes values into the scene's file, where everything else stays as it is: comments, order,
    /// other numbers. `shown` is the scene that they were read from.
    ///
    /// # Errors
    /// The scene would not load with them (the first line of what is wrong), its file has been
    /// changed since `shown` was opened, or cannot be written; then nothing has changed.
    pub fn amend(
        &self,
        shown: &Scene,
        settings: &[Setting],
        job: &Job,
    ) -> Result<Change, AttachError> {
        let place = self.scene.display().to_string();
        let text = text_of(&self.scene)?.unwrap_or_default();
        let parse = |text: &str| {
            file::parse(&place, text).map_err(|why| AttachError::BadInput(why.to_string()))
        };
        let before = parse(&text)?;
        if fields::said(shown).as_ref() != Some(&before) {
            let why = "has been changed since it was opened: reload the scene first";
            return Err(AttachError::CannotWrite(format!("{place}: {why}")));
        }
        let edited = written(&text, settings);
        let cannot = || {
            let why = "is written in a way that cannot be edited by a form: change it by hand";
            AttachError::BadInput(format!("{place}: {why}"))
        };
        let edited = edited.ok_or_else(cannot)?;
        let after = parse(&edited)?;
        if !only_there(&before, &after, settings) {
            return Err(cannot());
        }
        Scene::load_amended(&self.scene, &edited, &self.access, job)?;
        if text_of(&self.scene)?.as_ref() != Some(&text) {
            let why = "has been changed meanwhile: try again";
            return Err(AttachError::CannotWrite(format!("{place}: {why}")));
        }
        write(&self.scene, &edited)?;
        Change::written(self, [text, edited])
    }
}

/// A text with other values: each is written once, though several need the same before them, and
/// entries are taken out last, from the back, so that numbers stay true. None: it has no such place.
pub(super) fn written(text: &str, settings: &[Setting]) -> Option<String> {
    let mut once: Vec<&Setting> = Vec::new();
    for setting in settings {
        if !once.contains(&setting) {
            once.push(setting);
        }
    }
    once.sort_by_key(|s| s.entry_gone().map(std::cmp::Reverse));
    once.into_iter().try_fold(text.to_owned(), |text, setting| {
        match (tree::set(&text, &setting.path, setting.value.as_deref()), &setting.value) {
            (Some(text), _) => Some(text),
            // What is not there need not be taken out.
            (None, None) => Some(text),
            (None, Some(_)) => None,
        }
    })
}

/// Whether two files differ in these places alone.
fn only_there(before: &SceneFile, after: &SceneFile, settings: &[Setting]) -> bool {
    let [Ok(before), Ok(after)] = [before, after].map(serde_json::to_value) else { return false };
    let place = |s: &Setting| {
        let gone = usize::from(s.entry_gone().is_some());
        pointer(&s.path[..s.path.len() - gone])
    };
    let places: Vec<String> = settings.iter().map(place).collect();
    let mut differing = Vec::new();
    differences(&before, &after, &mut String::new(), &mut differing);
    differing.iter().all(|at| places.iter().any(|p| is_within(at, p) || is_within(p, at)))
}

/// Whether a place is another, or lies in it.
fn is_within(place: &str, of: &str) -> bool {
    place.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

fn pointer(path: &[Step]) -> String {
    let mut text = String::new();
    for step in path {
        let _ = match step {
            Step::Field(name) => write!(text, "/{name}"),
            Step::Entry(number) => write!(text, "/{number}"),
            Step::Variant(_) => Ok(()),
        };
    }
    text
}

/// Where two values differ. Names of variants are left out of places, as they are in a path.
fn differences(
    a: &serde_json::Value,
    b: &serde_json::Value,
    place: &mut String,
    found: &mut Vec<String>,
) {
    use serde_json::Value::{Array, Null, Object};
    let length = place.len();
    match (a, b) {
        (Object(a), Object(b)) => {
            let names: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for name in names {
                if !name.starts_with(|c: char| c.is_ascii_uppercase()) {
                    let _ = write!(place, "/{name}");
                }
                let [a, b] = [a, b].map(|map| map.get(name).unwrap_or(&Null));
                differences(a, b, place, found);
                place.truncate(length);
            }
        }
        (Array(a), Array(b)) => {
            for number in 0..a.len().max(b.len()) {
                let _ = write!(place, "/{number}");
                let [a, b] = [a, b].map(|list| list.get(number).unwrap_or(&Null));
                differences(a, b, place, found);
                place.truncate(length);
            }
        }
        _ if a == b => {}
        _ => found.push(place.clone()),
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf};

    use intrados_stage::Access;

    use super::*;
    use crate::attach::{Field, fields};

    const SCENE: &str = r#"// Mine.
(
    schema: "intrados.scene/1",
    members: [(
        id: "C1", body: Column(
            section: Rectangle(width_m: 0.4, depth_m: 0.4), // as measured in 1998
            height_m: 3,
        ),
        concrete: "C30/37",
    ), (
        id: "T", body: Tunnel(
            radius_m: 2, length_m: 2, segments: (count: 4, ring_m: 1, thickness_m: 0.3),
        ), at: (9, 3, 0),
    )],
    details: [(member: "T/R1/S1", concrete: "C40/50", assumed: [Concrete, Age])],
    loads: [(name: "deck", members: ["C1"], action: Force(place: End, force_kn: (0, -900, 0)))],
)
"#;

    fn written() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.ron");
        fs::write(&path, SCENE).unwrap();
        (folder, path)
    }

    fn load(path: &std::path::Path) -> Scene {
        Scene::load(path, &Job::default()).unwrap()
    }

    /// Sets fields of a member by their groups and names.
    fn amend(
        path: &std::path::Path,
        scene: &Scene,
        member: Option<&str>,
        values: &[(&str, &str, &str)],
    ) -> Result<Change, AttachError> {
        let member = member.map(|id| scene.members.iter().find(|m| m.id == id).unwrap());
        let all = fields(scene, member);
        let mut settings = Vec::new();
        for (group, name, value) in values {
            let field = all.iter().find(|f| f.group == *group && f.name == *name);
            settings.extend(field.unwrap_or_else(|| panic!("{group}: {name}")).set(value).unwrap());
        }
        let (access, job) = (Access::default(), Job::default());
        Project::edit(path, &access, &job)?.amend(scene, &settings, &job)
    }

    #[test]
    fn a_form_writes_its_values_and_leaves_the_rest() {
        let (_folder, path) = written();
        let scene = load(&path);
        let values = [
            ("Size", "width", "0,5"),
            ("Exposure", "exposure class", "XC4"),
            ("Exposure", "exposed for", "30"),
            ("Load “deck”", "force y, upwards", "-1100"),
            ("Bars", "cover", "35"),
            ("Bars", "bars around the section", "8"),
            ("Bars", "their diameter", "16"),
        ];
        let mut change = amend(&path, &scene, Some("C1"), &values).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let expected = SCENE
            .replace("width_m: 0.4,", "width_m: 0.5,")
            .replace("-900", "-1100")
            .replace(
                "            height_m: 3,\n",
                "            height_m: 3,\n            reinforcement: (cover_mm: 35, bars: [Around(count: 8, diameter_mm: 16)]),\n",
            )
            .replace(
                "        concrete: \"C30/37\",\n",
                "        concrete: \"C30/37\",\n        exposure: (class: \"XC4\", years: 30),\n",
            );
        assert_eq!(text, expected);
        let now = load(&path);
        assert_eq!(now.members[0].exposure.as_ref().unwrap().class, "XC4");
        change.turn(&Job::default()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), SCENE);
        change.turn(&Job::default()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), expected);
        // What it was read from is not there any more.
        let why = amend(&path, &scene, None, &[("Structure", "owner", "me")]).unwrap_err();
        assert!(why.to_string().contains("reload the scene first"), "{why}");
    }

    #[test]
    fn strength_of_its_own_is_a_concrete_that_the_member_names() {
        let (_folder, path) = written();
        let own = ("Concrete", "strength of its own, f_ck", "23.5");
        amend(&path, &load(&path), Some("C1"), &[own]).unwrap();
        let scene = load(&path);
        assert_eq!(scene.members[0].concrete, "concrete of C1");
        assert!((scene.structure.concretes[0].fck_mpa - 23.5).abs() < 1e-6);
        let mean = ("Concrete", "mean strength f_cm", "29");
        amend(&path, &scene, Some("C1"), &[mean]).unwrap();
        assert_eq!(load(&path).structure.concretes[0].fcm_mpa, Some(29.0));
        amend(&path, &load(&path), Some("C1"), &[("Concrete", "mean strength f_cm", "")]).unwrap();
        assert_eq!(load(&path).structure.concretes[0].fcm_mpa, None);
    }

    /// The scene, its first column with bars around.
    fn with_bars() -> (tempfile::TempDir, PathBuf) {
        let (folder, path) = written();
        let bars = [
            ("Bars", "cover", "35"),
            ("Bars", "bars around the section", "8"),
            ("Bars", "their diameter", "16"),
        ];
        amend(&path, &load(&path), Some("C1"), &bars).unwrap();
        (folder, path)
    }

    #[test]
    fn ends_and_laps_of_bars_are_written_as_places_along_the_member() {
        let (_folder, path) = with_bars();
        let said = |path: &std::path::Path| {
            let text = fs::read_to_string(path).unwrap();
            let (_, bars) = text.split_once("Around(").unwrap();
            bars.split_once(")]),\n").unwrap().0.to_owned()
        };
        let values = [
            ("Bars around", "begin at", "0.3"),
            ("Bars around", "first end", "Straight"),
            ("Bars around", "last end", "Hooked"),
            ("Bars around", "middle of lap 1", "1.5"),
            ("Bars around", "length of lap 1", "900"),
        ];
        amend(&path, &load(&path), Some("C1"), &values).unwrap();
        let once = "count: 8, diameter_mm: 16, from: 0.1, ends: (Straight, Hooked), laps: [";
        assert_eq!(said(&path), format!("{once}(at: 0.5, length_mm: 900)]"));
        let second =
            [("Bars around", "middle of lap 2", "2,55"), ("Bars around", "length of lap 2", "600")];
        amend(&path, &load(&path), Some("C1"), &second).unwrap();
        let both = format!("{once}(at: 0.5, length_mm: 900), (at: 0.85, length_mm: 600)]");
        assert_eq!(said(&path), both);
        // What the form then shows is what was written.
        let scene = load(&path);
        let all = fields(&scene, scene.members.first());
        for (group, name, value) in values {
            let field = all.iter().find(|f| f.group == group && f.name == name).unwrap();
            assert_eq!(field.value, value, "{name}");
        }
        let end = all.iter().find(|f| f.name == "first end").unwrap();
        let why = end.set("Bent").unwrap_err();
        assert_eq!(why, "first end: “Bent” is none of Anchored, Hooked, Straight");
        let gone = [
            ("Bars around", "middle of lap 1", ""),
            ("Bars around", "length of lap 1", ""),
            ("Bars around", "last end", "Anchored"),
        ];
        let mut change = amend(&path, &load(&path), Some("C1"), &gone).unwrap();
        let left = once.replace("Hooked", "Anchored") + "(at: 0.85, length_mm: 600)]";
        assert_eq!(said(&path), left);
        change.turn(&Job::default()).unwrap();
        assert_eq!(said(&path), both);
        // All laps at once, those behind first.
        let gone = [("Bars around", "length of lap 1", ""), ("Bars around", "length of lap 2", "")];
        amend(&path, &load(&path), Some("C1"), &gone).unwrap();
        assert_eq!(said(&path), format!("{once}]"));
    }

    #[test]
    fn places_are_shares_of_the_axis_as_it_becomes() {
        let (_folder, path) = with_bars();
        let scene = load(&path);
        let all = fields(&scene, scene.members.first());
        let values = [
            ("begin at", "0.45"),
            ("middle of lap 1", "2,25"),
            ("length of lap 1", "900"),
            ("height", "4,5"),
        ];
        let field = |name: &str| all.iter().find(|f| f.name == name).unwrap();
        let changes = values.map(|(name, text)| (field(name), text));
        let settings = Field::set_all(&changes).unwrap();
        let (access, job) = (Access::default(), Job::default());
        Project::edit(&path, &access, &job).unwrap().amend(&scene, &settings, &job).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("height_m: 4.5"), "{text}");
        assert!(text.contains("from: 0.1, laps: [(at: 0.5, length_mm: 900)]"), "{text}");
        // A height that is none is refused by itself.
        let why = Field::set_all(&[(field("begin at"), "1"), (field("height"), "high")]);
        assert_eq!(why.unwrap_err(), "height: “high” is no number");
    }

    #[test]
    fn what_is_stated_of_a_segment_is_assumed_no_more() {
        let (_folder, path) = written();
        let scene = load(&path);
        let is = |s: &Scene, id: &str| {
            let member = s.members.iter().find(|m| m.id == id).unwrap();
            (member.concrete.clone(), member.concrete_assumed)
        };
        assert_eq!(is(&scene, "T/R1/S1"), ("C40/50".into(), true));
        amend(&path, &scene, Some("T/R1/S1"), &[("Concrete", "concrete class", "C50/60")]).unwrap();
        assert_eq!(is(&load(&path), "T/R1/S1"), ("C50/60".into(), false));
        assert!(fs::read_to_string(&path).unwrap().contains("assumed: [Age]"));
        // One of which nothing is said yet gets a detail of its own.
        let values =
            [("Concrete", "concrete class", "C35/45"), ("Exposure", "exposure class", "XC2")];
        amend(&path, &load(&path), Some("T/R1/S2"), &values).unwrap();
        let now = load(&path);
        assert_eq!(is(&now, "T/R1/S2"), ("C35/45".into(), false));
        assert_eq!(is(&now, "T/R1/S1"), ("C50/60".into(), false));
        // Its measures are its tunnel's.
        let thickness = ("Size of the tunnel", "thickness of segments", "0.25");
        amend(&path, &now, Some("T/R1/S2"), &[thickness]).unwrap();
        assert!(fs::read_to_string(&path).unwrap().contains("thickness_m: 0.25"));
    }

    #[test]
    fn what_the_file_would_be_refused_for_is_refused_with_the_same_line() {
        let (folder, path) = written();
        let scene = load(&path);
        for (group, name, value) in
            [("Size", "width", "-1"), ("Exposure", "exposure class", "XC9"), ("Size", "height", "")]
        {
            let why = amend(&path, &scene, Some("C1"), &[(group, name, value)]).unwrap_err();
            assert_eq!(fs::read_to_string(&path).unwrap(), SCENE);
            // Written by hand, it is refused so.
            let all = fields(&scene, scene.members.first());
            let field = all.iter().find(|f| f.group == group && f.name == name).unwrap();
            let text = field.set(value).unwrap().iter().fold(SCENE.to_owned(), |text, s| {
                tree::set(&text, &s.path, s.value.as_deref()).unwrap()
            });
            let other = folder.path().join("other");
            fs::create_dir_all(&other).unwrap();
            fs::write(other.join("scene.ron"), text).unwrap();
            let by_hand = Scene::load(&other.join("scene.ron"), &Job::default()).unwrap_err();
            assert_eq!(why.to_string(), by_hand.to_string().replace("other/", ""));
        }
        // A number that is none never reaches the file.
        let all = fields(&scene, scene.members.first());
        let width = all.iter().find(|f| f.name == "width").unwrap();
        assert_eq!(width.set("wide").unwrap_err(), "width: “wide” is no number");
        assert!(width.set("inf").is_err());
    }

    #[test]
    fn the_cover_of_a_report_is_filled_in() {
        let (_folder, path) = written();
        let values = [
            ("Structure", "owner", "The \"county\""),
            ("Inspection", "inspected on", "2026-05-03"),
            ("Air", "humidity", "80"),
        ];
        amend(&path, &load(&path), None, &values).unwrap();
        let now = load(&path);
        assert_eq!(now.structure.project.owner, "The \"county\"");
        assert_eq!(now.structure.project.inspected.unwrap().to_string(), "2026-05-03");
        assert!((now.structure.climate.humidity_percent - 80.0).abs() < 1e-6);
    }
}
