//! The folder of a campaign: what is planned, at work, done and failed. It is all that workers
//! share.
//!
//! ```text
//! campaign.json            the plan
//! guides/K.guide           what steers the walks of structure K, learnt once
//! work/ID/                 a unit at work, or broken off; locked while somebody works
//! units/ID/unit.json …     a unit that is done: moved here by one rename
//! units/ID~DIGEST/         another result of the same unit, which should not be
//! failed/ID.json           why a unit failed
//! ```

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use intrados_stage::{
    access,
    file::{FileLock, LockState},
};
use serde::{Deserialize, Serialize};

use super::plan::{Plan, Unit};
use crate::{failure::Failure, output};

const PLAN: &str = "campaign.json";
const LOCK: &str = ".lock";
/// What says of a unit that it is done.
pub(super) const RECORD: &str = "unit.json";
/// Longest record that is read, bytes.
const LONGEST: u64 = 1 << 20;

/// Where a campaign lies.
#[derive(Debug, Clone)]
pub(crate) struct Folder(PathBuf);

/// What is kept of a unit that is done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    pub(crate) schema: String,
    pub(crate) id: String,
    /// BLAKE3 of what is the same in every run of it.
    pub(crate) digest: String,
    /// Wall-clock time of the last start; CPU-seconds of the process.
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
}

/// Why a unit failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Failed {
    pub(crate) code: u8,
    pub(crate) reason: String,
}

/// How far a unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum State {
    Waiting,
    /// Somebody works on it now.
    Running,
    /// Somebody did and was stopped or killed.
    BrokenOff,
    Failed,
    Done,
}

/// A unit's folder while this process has it.
pub(super) struct Held {
    pub(super) folder: PathBuf,
    _lock: FileLock,
}

impl Folder {
    pub(crate) fn new(dir: &Path) -> Self {
        Self(dir.to_owned())
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Whether the plan may be written here: the same one may be there, another one not.
    pub(crate) fn may_begin(&self, plan: &Plan) -> Result<(), Failure> {
        let place = self.0.join(PLAN);
        if !place.exists() || Plan::read(&place).is_ok_and(|there| there == *plan) {
            return Ok(());
        }
        Err(Failure::cannot_write(
            &place,
            "another campaign is there: name a new folder, or remove that one",
        ))
    }

    /// Writes the plan.
    pub(crate) fn begin(&self, plan: &Plan) -> Result<(), Failure> {
        self.may_begin(plan)?;
        output::folder(&self.0)?;
        output::put(&self.0.join(PLAN), output::json(plan)?.as_bytes())
    }

    /// The plan.
    pub(crate) fn plan(&self) -> Result<Plan, Failure> {
        Plan::read(&self.0.join(PLAN))
    }

    /// What steers the walks of a structure, where it was learnt.
    pub(super) fn guide(&self, structure: usize) -> PathBuf {
        self.0.join("guides").join(format!("{structure}.guide"))
    }

    pub(super) fn done(&self, id: &str) -> PathBuf {
        self.0.join("units").join(id)
    }

    fn failure(&self, id: &str) -> PathBuf {
        self.0.join("failed").join(format!("{id}.json"))
    }

    pub(super) fn is_done(&self, id: &str) -> bool {
        self.done(id).join(RECORD).is_file()
    }

    /// Takes a unit for this process; `None`: another one has it.
    pub(super) fn hold(&self, id: &str) -> Result<Option<Held>, Failure> {
        let folder = output::inner(&self.0, Path::new("work").join(id))?;
        output::folder(&folder)?;
        // Some network disks have no locks: then two may do the same, and the second rename finds
        // that it is done.
        match FileLock::take(&folder.join(LOCK)) {
            Ok(LockState::Held(lock)) => Ok(Some(Held { folder, _lock: lock })),
            Ok(LockState::Elsewhere) => Ok(None),
            Err(why) => Err(Failure::cannot_write(&folder, why)),
        }
    }

    /// Gives a unit's folder its place. Where another result of it has come first, the same one is
    /// dropped and a different one kept beside it and refused.
    pub(super) fn publish(&self, held: &Held, record: &Record) -> Result<(), Failure> {
        let place = self.done(&record.id);
        output::folder(&output::inner(&self.0, "units")?)?;
        output::put(&held.folder.join(RECORD), output::json(record)?.as_bytes())?;
        if let Err(why) = fs::rename(&held.folder, &place) {
            let Ok(there) = read_record(&place) else {
                return Err(Failure::cannot_write(&place, why));
            };
            if there.digest == record.digest {
                _ = fs::remove_dir_all(&held.folder);
                return Ok(());
            }
            let digest: String = record.digest.chars().take(16).collect();
            let beside = self.0.join("units").join(format!("{}~{digest}", record.id));
            fs::rename(&held.folder, &beside).map_err(|e| Failure::cannot_write(&beside, e))?;
            return Err(Failure::BadInput(format!(
                "{}: differs from {}, which was there: the same unit gave two results; \
                 find out which machine is wrong and remove its one",
                beside.display(),
                place.display()
            )));
        }
        _ = fs::remove_file(place.join(LOCK));
        _ = fs::remove_file(self.failure(&record.id));
        Ok(())
    }

    /// Leaves nothing of a unit that another worker has finished meanwhile.
    pub(super) fn drop_work(&self, held: &Held) {
        _ = fs::remove_dir_all(&held.folder);
    }

    /// Notes why a unit failed. That it cannot be noted does not change what failed.
    pub(super) fn fail(&self, id: &str, failure: &Failure) {
        let failed =
            Failed { code: failure.code(), reason: crate::console::one_line(&failure.to_string()) };
        let place = self.failure(id);
        let noted = output::inner(&self.0, "failed")
            .and_then(|folder| output::folder(&folder))
            .and_then(|()| output::json(&failed))
            .and_then(|text| output::put(&place, text.as_bytes()));
        if let Err(why) = noted {
            tracing::warn!("{why}");
        }
    }

    /// Why a unit failed.
    pub(crate) fn failed(&self, id: &str) -> Option<Failed> {
        let bytes = access::read(&self.failure(id), LONGEST).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Other results of a unit than the one that counts.
    pub(super) fn others(&self) -> BTreeSet<String> {
        let names = fs::read_dir(self.0.join("units")).into_iter().flatten().flatten();
        names
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| name.contains('~'))
            .collect()
    }

    /// How far a unit is.
    pub(crate) fn state(&self, unit: &Unit) -> State {
        if self.is_done(&unit.id) {
            return State::Done;
        }
        let work = self.0.join("work").join(&unit.id);
        match FileLock::take_existing(&work.join(LOCK)) {
            Ok(LockState::Elsewhere) => State::Running,
            _ if self.failure(&unit.id).is_file() => State::Failed,
            Err(why) if why.kind() == io::ErrorKind::NotFound => State::Waiting,
            // What is no lock is told by the one that wants to take it.
            Ok(LockState::Held(_)) | Err(_) => State::BrokenOff,
        }
    }

    /// The record of a unit that is done.
    pub(crate) fn record(&self, id: &str) -> Result<Record, Failure> {
        read_record(&self.done(id))
    }
}

/// The record in the folder of a result.
pub(super) fn read_record(folder: &Path) -> Result<Record, Failure> {
    let path = folder.join(RECORD);
    let bytes = access::read(&path, LONGEST).map_err(|why| Failure::denied(&path, &why))?;
    serde_json::from_slice(&bytes).map_err(|e| {
        Failure::BadInput(format!(
            "{}: is damaged ({e}): remove its folder and run the unit again",
            path.display()
        ))
    })
}
