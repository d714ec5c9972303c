//! Our verdicts against those of Khronos's validator on its own 263 test files (`INTRADOS_DATA`).

use std::path::{Path, PathBuf};

use intrados_scene::gltf::{self, ImportError, Severity};
use intrados_stage::Job;
use serde_json::Value;

/// Every test file and the errors that Khronos's validator reports: pointers, or nothing for a byte
/// offset.
fn cases() -> Vec<(PathBuf, Vec<Option<String>>)> {
    let data =
        std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA must name the folder of test data");
    let mut cases = Vec::new();
    let mut open = vec![PathBuf::from(data).join("gltf-validator/base/data")];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(
                path.read_dir().expect("a folder").map(|entry| entry.expect("an entry").path()),
            );
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            let report = path.with_file_name(format!(
                "{}.report.json",
                path.file_name().expect("a name").to_string_lossy()
            ));
            let report: Value =
                serde_json::from_slice(&std::fs::read(report).expect("a report")).expect("JSON");
            let messages = report["issues"]["messages"].as_array().cloned().unwrap_or_default();
            let errors = messages.iter().filter(|m| m["severity"] == 0);
            cases.push((path, errors.map(|m| m["pointer"].as_str().map(str::to_owned)).collect()));
        }
    }
    cases.sort();
    assert_eq!(cases.len(), 263);
    cases
}

fn short(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    format!("{folder}/{}", path.file_name().unwrap_or_default().to_string_lossy())
}

/// Whether geometry cannot be trusted with an error at this place.
fn blocks(pointer: &Option<String>) -> bool {
    const COSTS_ITSELF: [&str; 9] = [
        "materials",
        "textures",
        "images",
        "samplers",
        "animations",
        "skins",
        "cameras",
        "extensions",
        "extensionsUsed",
    ];
    pointer.as_ref().is_none_or(|p| !COSTS_ITSELF.contains(&p.split('/').nth(1).unwrap_or("")))
}

/// Ignored, since nothing can be said without them:
/// `INTRADOS_DATA=… cargo test --release --workspace -- --ignored with_data`.
mod with_data {
    use super::*;

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn the_verdict_agrees_for_every_file() {
        let mut wrong = Vec::new();
        for (path, errors) in cases() {
            let problems = gltf::validate(&path, &Job::default()).expect("a readable file");
            let ours: Vec<_> = problems.iter().filter(|p| p.severity == Severity::Error).collect();
            if ours.is_empty() != errors.is_empty() {
                wrong.push(format!("{}: Khronos {errors:?}, we {ours:?}", short(&path)));
            }
            for problem in problems {
                assert!(
                    !problem.message.contains('\n')
                        && !problem.message.is_empty()
                        && !problem.remedy.is_empty(),
                    "{problem:?}"
                );
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn damaged_geometry_is_refused_and_everything_else_loads() {
        let mut wrong = Vec::new();
        for (path, errors) in cases() {
            let blocked = errors.iter().any(blocks);
            match gltf::import(&path, &Job::default()) {
                Ok(model) if !blocked => {
                    let indices_hold = model.meshes.iter().all(|m| {
                        m.triangles.iter().flatten().all(|&v| (v as usize) < m.positions.len())
                    });
                    assert!(
                        indices_hold
                            && model
                                .meshes
                                .iter()
                                .all(|m| m.positions.iter().all(|p| p.is_finite()))
                    );
                    if !errors.is_empty() && model.warnings.is_empty() {
                        wrong.push(format!("{}: loads without a warning", short(&path)));
                    }
                }
                Err(ImportError::Damaged { problem, .. }) if blocked => {
                    assert!(problem.blocks_geometry(), "{problem:?}")
                }
                Ok(_) => wrong.push(format!("{}: loads in spite of {errors:?}", short(&path))),
                Err(error) => {
                    wrong.push(format!("{}: refused, {error}; Khronos {errors:?}", short(&path)))
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
