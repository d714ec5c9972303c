//! Earlier predictions of the structure, to look at beside the newest: those of before its changes,
//! and those that `intrados predict` has written.

use std::{path::Path, sync::Arc};

use bevy_ecs::prelude::*;
use intrados_damage::zone::{ZONES, Zones};
use intrados_predict::{MemberPrediction, Prediction};
use intrados_scene::{Scene, plugin::CurrentScene};
use intrados_stage::{Estimate, access};
use serde::Deserialize;

use crate::{Latest, moment::Seen};

/// Most that are kept of a session.
const MOST: usize = 12;
/// Longest file, bytes.
const LONGEST: u64 = 256 << 20;
const SCHEMA: &str = "intrados.predict/";

/// What is kept, and which of it is looked at.
#[derive(Resource, Default)]
pub(crate) struct History {
    earlier: Vec<Earlier>,
    beside: Option<usize>,
    /// The newest, which is kept once it has a successor.
    newest: Option<Arc<Prediction>>,
    /// How many of this structure were made.
    made: usize,
}

/// An earlier prediction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Earlier {
    /// What people call it.
    pub(crate) title: String,
    members: Vec<Was>,
}

/// What was said of a member.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Was {
    id: String,
    damage: Option<f64>,
    damage_std_error: Option<f64>,
    pub(crate) state: String,
    pub(crate) zones: Zones,
}

/// A prediction as it is written, as far as it is compared.
#[derive(Deserialize)]
struct Written {
    schema: String,
    scene: String,
    members: Vec<Was>,
}

impl Was {
    fn of(member: &MemberPrediction) -> Self {
        Self {
            id: member.id.clone(),
            damage: member.damage,
            damage_std_error: member.damage_std_error,
            state: member.state.clone(),
            zones: member.zones,
        }
    }

    /// Its damage; none: nothing was known.
    pub(crate) fn damage(&self) -> Option<Estimate> {
        Some(Estimate { value: self.damage?, std_error: self.damage_std_error? })
    }
}

impl Earlier {
    fn of(prediction: &Prediction, number: usize) -> Self {
        let used = prediction.items.iter().filter(|item| item.used).count();
        let all = prediction.items.len();
        let title = tr!("Prediction {}, {} of {} pieces of evidence used", number, used, all);
        Self { title, members: prediction.members.iter().map(Was::of).collect() }
    }

    /// Reads what `intrados predict --out` has written.
    fn read(path: &Path) -> Result<Self, String> {
        let bad = |why: String| format!("{}: {why}", path.display());
        let bytes = access::read(path, LONGEST).map_err(|why| bad(why.to_string()))?;
        let written: Written = serde_json::from_slice(&bytes).map_err(|why| {
            bad(tr!(
                "is no prediction ({}): give the predict.json of a folder of `intrados predict \
                 --out`",
                why
            ))
        })?;
        if !written.schema.starts_with(SCHEMA) {
            return Err(bad(tr!(
                "is of “{}”: give the predict.json of `intrados predict`",
                written.schema
            )));
        }
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let title = format!("{}, {folder}/{file}", written.scene);
        Ok(Self { title, members: written.members })
    }

    /// What was said of a member of the scene, by its id.
    pub(crate) fn member(&self, id: &str) -> Option<&Was> {
        self.members.iter().find(|was| was.id == id)
    }

    /// What is shown of every member of the scene.
    pub(crate) fn seen(&self, scene: &Scene) -> Vec<Seen> {
        let one = |id: &str| {
            let zones = self
                .member(id)
                .map_or([None; ZONES], |was| was.zones.0.map(|z| z.map(|z| z.value)));
            Seen { zones, foretold: [false; ZONES] }
        };
        scene.members.iter().map(|member| one(&member.id)).collect()
    }
}

impl History {
    /// The one that is looked at beside the newest.
    pub(crate) fn beside(&self) -> Option<&Earlier> {
        self.earlier.get(self.beside?)
    }

    /// Titles of all of them, the newest last.
    pub(crate) fn titles(&self) -> impl Iterator<Item = &str> {
        self.earlier.iter().map(|earlier| earlier.title.as_str())
    }

    pub(crate) fn choose(&mut self, index: Option<usize>) {
        self.beside = index.filter(|index| *index < self.earlier.len());
    }

    /// Which one is looked at.
    pub(crate) fn chosen(&self) -> Option<usize> {
        self.beside
    }

    /// Opens a written one, to be looked at.
    ///
    /// # Errors
    /// File, what is wrong, and what to do, in a line.
    pub(crate) fn open(&mut self, path: &Path, scene: &Scene) -> Result<(), String> {
        let read = Earlier::read(path)?;
        let common = scene.members.iter().filter(|m| read.member(&m.id).is_some()).count();
        if common == 0 {
            return Err(tr!(
                "{}: none of its members is in {}: it is of another structure",
                path.display(),
                scene.name
            ));
        }
        self.put(read);
        self.beside = Some(self.earlier.len() - 1);
        Ok(())
    }

    fn put(&mut self, earlier: Earlier) {
        if self.earlier.len() == MOST {
            self.earlier.remove(0);
            self.beside = self.beside.and_then(|index| index.checked_sub(1));
        }
        self.earlier.push(earlier);
    }

    /// A prediction is there: the one before is an earlier one, where it said anything else.
    fn follow(&mut self, newest: &Arc<Prediction>) {
        let before = self.newest.replace(newest.clone());
        let Some(before) = before else {
            self.made = 1;
            return;
        };
        let said = |all: &Prediction| -> Vec<Was> { all.members.iter().map(Was::of).collect() };
        if said(&before) != said(newest) {
            self.put(Earlier::of(&before, self.made));
            self.made += 1;
        }
    }
}

/// Keeps what has a successor. Another structure has a history of its own.
pub(crate) fn keep(
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    mut history: ResMut<History>,
    mut of: Local<std::path::PathBuf>,
) {
    let Some(scene) = scene else { return };
    if *of != scene.0.path {
        of.clone_from(&scene.0.path);
        *history = History::default();
    }
    let Some(newest) = latest.result_for(&scene.0) else { return };
    let is_known = history.newest.as_ref().is_some_and(|known| Arc::ptr_eq(known, newest));
    if !is_known {
        history.follow(newest);
    }
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;

    const WRITTEN: &str = r#"{"schema": "intrados.predict/2", "scene": "column", "members": [
        {"id": "C2", "name": "C2", "damage": 0.25, "damage_std_error": 0.1, "state": "fair",
         "zones": [null, {"value": 0.25, "std_error": 0.1}, null, null, null, null, null, null, null, null]}]}"#;

    #[test]
    fn a_written_prediction_is_looked_at_beside_the_newest() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let mut history = History::default();
        history.open(&write("predict.json", WRITTEN), &scene).unwrap();
        let beside = history.beside().unwrap();
        assert!(beside.title.starts_with("column, "), "{}", beside.title);
        let was = beside.member("C2").unwrap();
        assert_eq!(was.damage(), Some(Estimate { value: 0.25, std_error: 0.1 }));
        let c2 = scene.members.iter().position(|m| m.id == "C2").unwrap();
        let seen = beside.seen(&scene);
        assert_eq!(seen[c2].most(), Some(0.25));
        assert!(seen.iter().enumerate().all(|(i, s)| i == c2 || s.most().is_none()));

        for (name, text, word) in [
            ("a.json", "{}", "predict.json"),
            ("b.json", &WRITTEN.replace("predict/2", "scan/1"), "scan/1"),
            ("c.json", &WRITTEN.replace("\"C2\"", "\"Q7\""), "another structure"),
        ] {
            let error = history.open(&write(name, text), &scene).unwrap_err();
            assert!(error.contains(name) && error.contains(word), "{error}");
        }
        assert_eq!((history.titles().count(), history.chosen()), (1, Some(0)));
        for _ in 0..2 * MOST {
            history.open(&folder.path().join("predict.json"), &scene).unwrap();
        }
        assert_eq!((history.titles().count(), history.chosen()), (MOST, Some(MOST - 1)));
    }
}
