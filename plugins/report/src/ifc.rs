//! Results as property sets of the IFC model that a scene was imported from. They are called
//! `Intrados_…`: `Pset_…` is buildingSMART's own.

use std::{
    collections::HashSet,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
};

use intrados_predict::{MemberPrediction, Prediction};
use intrados_scene::{
    Scene,
    import::{ImportError, ifcopenshell},
};
use intrados_stage::{
    Job,
    access::{self, Denied},
};
use serde_json::{Map, Value, json};

use crate::words::word;

/// What puts them there, which is ours.
const SCRIPT: &str = include_str!("ifc.py");
/// Longest model that is taken back, bytes.
const LONGEST: u64 = 2 << 30;

/// A copy of a model with results.
#[derive(Debug)]
pub(crate) struct Model {
    /// Name of the file.
    pub(crate) name: String,
    /// The file.
    pub(crate) bytes: Vec<u8>,
}

/// Whether IfcOpenShell is there, asked by itself.
const PRESENT: &str = r#"
import json
try:
    import ifcopenshell
except ImportError as error:
    print(json.dumps({"fault": "absent", "message": str(error)}), flush=True)
else:
    print(json.dumps({"ready": True}), flush=True)
"#;

/// Refuses a model that has none of the scene's members or cannot be written to, before anything is
/// computed.
///
/// # Errors
/// That, it cannot be read, IfcOpenShell is not there, or the job was cancelled.
pub fn check_model(model: &Path, scene: &Scene, job: &Job) -> Result<(), ImportError> {
    has_members(model, scene)?;
    let folder = tempfile::tempdir().map_err(|e| ImportError::write(&std::env::temp_dir(), &e))?;
    ifcopenshell(model, PRESENT, folder.path(), &job.part(0.0, 0.0))
}

/// Refuses a model that has none of the scene's members.
fn has_members(model: &Path, scene: &Scene) -> Result<(), ImportError> {
    let (file, _) = access::open(model).map_err(|why| ImportError::denied(model, &why))?;
    let ids: HashSet<&[u8]> = scene.members.iter().map(|m| m.id.as_bytes()).collect();
    for line in BufReader::new(file).split(b'\n') {
        let line = line.map_err(|e| ImportError::denied(model, &Denied::System(e)))?;
        // #12= IFCBEAM('GlobalId', …
        let mut words = line.splitn(3, |&b| b == b'\'');
        if words.nth(1).is_some_and(|id| ids.contains(id)) {
            return Ok(());
        }
    }
    Err(ImportError::BadInput(format!(
        "{}: has none of the {} members of this scene: give the IFC model that it was imported from",
        model.display(),
        scene.members.len()
    )))
}

/// Puts results into a copy of the model that the scene was imported from.
///
/// # Errors
/// It is no IFC file, or of another structure; IfcOpenShell is not there; or the job was cancelled.
pub(crate) fn with_results(
    model: &Path,
    prediction: &Prediction,
    date: &str,
    job: &Job,
) -> Result<Model, ImportError> {
    let folder = tempfile::tempdir().map_err(|e| ImportError::write(&std::env::temp_dir(), &e))?;
    let place = folder.path().join("results.json");
    let results: Map<String, Value> = prediction
        .members
        .iter()
        .map(|m| (m.id.clone(), json!({ "Intrados_Damage": properties(m, prediction, date) })))
        .collect();
    std::fs::write(&place, Value::from(results).to_string())
        .map_err(|e| ImportError::write(&place, &e))?;
    ifcopenshell(model, SCRIPT, folder.path(), job)?;
    let written: PathBuf = folder.path().join("model.ifc");
    let bytes =
        access::read(&written, LONGEST).map_err(|why| ImportError::denied(&written, &why))?;
    let stem = model.file_stem().unwrap_or_default().to_string_lossy();
    Ok(Model { name: format!("{stem}_damage.ifc"), bytes })
}

/// What is said of a member. Numbers are without a unit, millimetres or months, as their names say.
fn properties(m: &MemberPrediction, prediction: &Prediction, date: &str) -> Value {
    let mut all = Map::new();
    let mut put = |name: &str, value: Value| {
        if !value.is_null() {
            all.insert(name.into(), value);
        }
    };
    put("State", json!(m.state));
    put("Damage", json!(m.damage));
    put("DamageStandardError", json!(m.damage_std_error));
    for (state, probability) in &m.state_probability {
        put(&format!("ProbabilityOf_{}", state.replace(' ', "_")), json!(probability));
    }
    put("Advice", json!(m.advice));
    put("WithinMonths", json!(m.within_months));
    put("WorstZoneFromStartInTenths", json!(m.worst_zone));
    put("CrackWidthInMillimetres", json!(m.crack_check.as_ref().map(|c| c.width_mm)));
    if let Some(capacity) = &m.capacity {
        put("LoadFactorToFailure", json!(capacity.load_factor.value));
        put("LoadFactorStandardError", json!(capacity.load_factor.std_error));
        put("FailsBy", json!(capacity.mode.words()));
    }
    let sources: Vec<&str> = m.evidence.keys().map(|source| word(source)).collect();
    put("Evidence", json!(if sources.is_empty() { "none".into() } else { sources.join(", ") }));
    put("EvidenceContradictsItself", json!(m.conflict));
    let defects = m.defects.iter().map(|d| format!("{} {}", d.kind, d.size).trim().to_owned());
    let defects = defects.collect::<Vec<_>>().join("; ");
    put("Defects", if defects.is_empty() { Value::Null } else { json!(defects) });
    put("Predicted", json!(date));
    put("Program", json!(format!("Intrados {}", prediction.version)));
    put("SceneHash", json!(prediction.scene_hash));
    Value::from(all)
}
