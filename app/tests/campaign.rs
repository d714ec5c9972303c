//! Campaigns as schedulers meet them: the real program, many times, in any order, stopped and
//! killed.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use common::{program, run, text};
use intrados_stage::random::Key;
use serde_json::Value;

/// Walks of the bundled room, a quarter of a second in all.
const WALKS: [&str; 8] = ["--", "--spp", "200", "--width", "32", "--height", "24", "--guide=off"];
/// The same, so many that a unit of eight takes some tenths of a second.
const MORE: [&str; 8] = ["--", "--spp", "1000", "--width", "32", "--height", "24", "--guide=off"];

fn new(dir: &Path, command: &str, over: &str, split: usize, words: &[&str]) {
    let split = split.to_string();
    let args = ["campaign", "new", text(dir), "--command", command, "--over", over];
    let output = run(&[&args[..], &["--split", &split], words].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn code(args: &[&str]) -> i32 {
    run(args).status.code().unwrap()
}

/// Runs one unit, alone in its process.
fn unit(dir: &Path, k: usize) -> i32 {
    code(&["campaign", "run", text(dir), "--unit", &k.to_string(), "--threads", "1", "--quiet"])
}

/// What is collected, but for where its files are.
fn collected(dir: &Path) -> [Vec<u8>; 2] {
    let output = run(&["campaign", "collect", text(dir), "--quiet"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    ["results.csv", "results.json"].map(|name| fs::read(dir.join("collected").join(name)).unwrap())
}

fn status(dir: &Path) -> Value {
    let output = run(&["campaign", "status", text(dir), "--format", "json"]);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Folders of results.
fn results(dir: &Path) -> Vec<PathBuf> {
    let mut all: Vec<_> =
        fs::read_dir(dir.join("units")).unwrap().map(|e| e.unwrap().path()).collect();
    all.sort();
    all
}

/// One, two and eight units, done forwards, backwards and by parts, give the bits of one another,
/// from measure and render.
#[test]
fn units_give_the_same_bits_in_any_number_and_order() {
    for command in ["measure", "render"] {
        let folder = tempfile::tempdir().unwrap();
        let campaign = |split: usize| {
            let dir = folder.path().join(split.to_string());
            new(&dir, command, "room", split, &WALKS);
            dir
        };
        let one = campaign(1);
        assert_eq!(unit(&one, 0), 0);
        let two = campaign(2);
        assert_eq!([1, 0].map(|k| unit(&two, k)), [0, 0]);
        let eight = campaign(8);
        for part in ["2/3", "0/3", "1/3"] {
            assert_eq!(code(&["campaign", "run", text(&eight), "--part", part, "--quiet"]), 0);
        }
        let of_one = collected(&one);
        assert_eq!(of_one, collected(&two), "{command}");
        assert_eq!(of_one, collected(&eight), "{command}");
        assert_eq!(status(&eight)["done"], 8);
        // Whoever comes late does nothing again.
        let before: Vec<_> =
            results(&eight).iter().map(|r| fs::metadata(r).unwrap().modified().unwrap()).collect();
        assert_eq!(unit(&eight, 3), 0);
        let after: Vec<_> =
            results(&eight).iter().map(|r| fs::metadata(r).unwrap().modified().unwrap()).collect();
        assert_eq!(before, after);
    }
}

/// What steers walks is learnt once, before the units, and brings the bits that every shard would
/// have that learns it for itself.
#[test]
fn units_share_what_steers_them() {
    let words = ["--spp", "150", "--width", "16", "--height", "12", "--guide=on"];
    let folder = tempfile::tempdir().unwrap();
    let [one, three] = [1, 3].map(|split| {
        let dir = folder.path().join(split.to_string());
        new(&dir, "measure", "slit", split, &[&["--"], &words[..]].concat());
        assert!(dir.join("guides/0.guide").is_file());
        assert_eq!(code(&["campaign", "run", text(&dir), "--quiet"]), 0);
        dir
    });
    assert_eq!(collected(&one), collected(&three));
    let alone = folder.path().join("alone");
    let mut parts = Vec::new();
    for shard in ["0/2", "1/2"] {
        let args = ["measure", "slit", "--shard", shard, "--out", text(&alone), "--quiet"];
        assert_eq!(code(&[&args[..], &words].concat()), 0);
        parts.push(alone.join(format!("slit.{}.acc", shard.replace('/', "of"))));
    }
    let merge = ["merge", text(&parts[0]), text(&parts[1]), "--out", text(&alone)];
    let merged = run(&[&merge[..], &["--format", "json"]].concat());
    let merged: Value = serde_json::from_slice(&merged.stdout).unwrap();
    let results = fs::read(one.join("collected/results.json")).unwrap();
    let rows = &serde_json::from_slice::<Value>(&results).unwrap()["rows"];
    for (row, side) in [(0, "primal"), (1, "dual")] {
        assert_eq!(rows[row]["side"], side);
        assert_eq!(rows[row]["mean"], merged["meters"][0][side]["mean"], "{side}");
    }

    // A guide of other walks is refused.
    let guide = one.join("guides/0.guide");
    let other = ["measure", "slit", "--spp", "151", "--guide", "on", "--guide-from", text(&guide)];
    let refused = run(&other);
    assert_eq!(refused.status.code(), Some(65));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("learnt for another scene"));
}

/// A signal ends a unit with 75 and a checkpoint; started again it goes on and has the bits of one
/// that was never stopped.
#[cfg(unix)]
#[test]
fn a_stopped_unit_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let [stopped, whole] = ["stopped", "whole"].map(|name| {
        let dir = folder.path().join(name);
        new(&dir, "measure", "room", 1, &MORE);
        dir
    });
    assert_eq!(unit(&whole, 0), 0);
    let mut child = program()
        .args(["campaign", "run", text(&stopped), "--unit", "0", "--threads", "1", "--quiet"])
        .spawn()
        .unwrap();
    // Once it has begun; a signal before that ends it as one after it does.
    while !stopped.join("work").exists() {
        std::thread::yield_now();
    }
    signal(child.id(), "TERM");
    let code = child.wait().unwrap().code().unwrap();
    // It may have been done by then: both are right, and the bits are the same.
    assert!(code == 75 || code == 0, "{code}");
    assert_eq!(status(&stopped)["done"], i32::from(code == 0));
    assert_eq!(unit(&stopped, 0), 0);
    assert_eq!(collected(&stopped), collected(&whole));
}

#[cfg(unix)]
fn signal(id: u32, signal: &str) {
    let sent = Command::new("kill").args([&format!("-{signal}"), &id.to_string()]).status();
    assert!(sent.is_ok());
}

/// Workers are killed without warning at a hundred moments: nothing is lost, nothing counted
/// twice.
#[cfg(unix)]
#[test]
fn a_hundred_kills_lose_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [killed, whole] = ["killed", "whole"].map(|name| {
        let dir = folder.path().join(name);
        new(&dir, "measure", "room", 8, &MORE);
        dir
    });
    assert_eq!(code(&["campaign", "run", text(&whole), "--quiet"]), 0);
    let start = || {
        program()
            .args(["campaign", "run", text(&killed), "--threads", "1", "--quiet"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let (mut kills, mut turns) = (0, 0);
    while kills < 100 {
        let mut workers = [start(), start()];
        // From the very start on to where a unit is nearly done.
        let wait = 400.0 * Key::new(7, turns).unit64(0).powi(2);
        std::thread::sleep(std::time::Duration::from_secs_f64(1e-3 * wait));
        for worker in &mut workers {
            kills += usize::from(worker.try_wait().unwrap().is_none());
            _ = worker.kill();
            worker.wait().unwrap();
        }
        turns += 1;
        // What is done is done: it begins anew, so that there are a hundred.
        if status(&killed)["done"] == 8 {
            assert_eq!(results(&killed).len(), 8);
            assert_eq!(collected(&killed), collected(&whole));
            fs::remove_dir_all(killed.join("units")).unwrap();
        }
    }
    assert_eq!(code(&["campaign", "run", text(&killed), "--quiet"]), 0);
    assert_eq!(results(&killed).len(), 8);
    assert_eq!(collected(&killed), collected(&whole));
}

/// What is missing is named; what is damaged or there twice is refused; a failure has its reason.
#[test]
fn what_is_wrong_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("campaign");
    new(&dir, "measure", "room", 4, &WALKS);
    assert_eq!([0, 2].map(|k| unit(&dir, k)), [0, 0]);
    let said = |args: &[&str]| String::from_utf8_lossy(&run(args).stderr).into_owned();
    let collect = ["campaign", "collect", text(&dir), "--quiet"];
    assert_eq!(code(&collect), 65);
    assert!(said(&collect).contains("2 of 4 units are missing (1, 3)"), "{}", said(&collect));
    assert_eq!(code(&[&collect[..], &["--partial"]].concat()), 0);
    assert_eq!([1, 3].map(|k| unit(&dir, k)), [0, 0]);
    assert_eq!(code(&collect), 0);

    // The same result twice does not matter, another one does.
    let first = results(&dir).remove(0);
    let name = first.file_name().unwrap().to_str().unwrap().to_owned();
    let twin = dir.join("units").join(format!("{name}~0"));
    fs::create_dir(&twin).unwrap();
    for file in ["unit.json", "walks.acc"] {
        fs::copy(first.join(file), twin.join(file)).unwrap();
    }
    assert_eq!(code(&collect), 0);
    let record = fs::read_to_string(first.join("unit.json")).unwrap();
    let digest = serde_json::from_str::<Value>(&record).unwrap()["digest"].clone();
    let other = record.replace(digest.as_str().unwrap(), &"0".repeat(64));
    fs::write(twin.join("unit.json"), &other).unwrap();
    assert_eq!(code(&collect), 65);
    assert!(said(&collect).contains("is another result of the unit"), "{}", said(&collect));
    fs::remove_dir_all(&twin).unwrap();

    // A result that is not what its record says.
    fs::write(first.join("unit.json"), other).unwrap();
    assert_eq!(code(&collect), 65);
    assert!(said(&collect).contains("run it again"), "{}", said(&collect));
    fs::write(first.join("unit.json"), record).unwrap();

    // A plan that somebody has changed.
    let plan = dir.join("campaign.json");
    let text_of_it = fs::read_to_string(&plan).unwrap();
    fs::write(&plan, text_of_it.replace("\"200\"", "\"400\"")).unwrap();
    assert_eq!(code(&collect), 65);
    assert!(said(&collect).contains("plan it again"), "{}", said(&collect));
}

/// A scene that has changed since it was planned is refused by the unit, and `status` says why.
#[test]
fn a_changed_scene_fails_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("s.ron");
    let write = |value: f32| {
        let text = format!(
            "(schema: \"intrados.scene/1\", shapes: [Quad(name: \"floor\", corner: (0,0,0), u: (0,0,{value}), v: (1,0,0))], \
             lamps: [Environment(name: \"sky\", radiance: (1,1,1))], \
             cameras: [(name: \"c\", position: (0.5,2,0.5), target: (0.5,0,0.6), fov_deg: 40, width: 8, height: 8)])"
        );
        fs::write(&scene, text).unwrap();
    };
    write(1.0);
    let dir = folder.path().join("campaign");
    new(&dir, "measure", text(&scene), 1, &["--", "--spp", "10", "--guide=off"]);
    write(2.0);
    assert_eq!(unit(&dir, 0), 65);
    let failed = &status(&dir)["failed"][0];
    assert_eq!(failed["code"], 65);
    assert!(failed["reason"].as_str().unwrap().contains("has changed"), "{failed}");
    // Brought back, the unit can be done, and its failure is forgotten.
    write(1.0);
    fs::remove_dir_all(dir.join("work")).unwrap();
    assert_eq!(unit(&dir, 0), 0);
    assert_eq!(status(&dir)["failed"], serde_json::json!([]));
}

/// What would make results depend on a clock, or what a campaign says itself, is refused before
/// anything is written.
#[test]
fn a_plan_depends_on_no_clock() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("campaign");
    for words in [
        &["--", "--time-limit", "1s"][..],
        &["--", "--spp", "10", "--out", "x"],
        &["--", "--spp=10", "--shard=0/2"],
        &["--", "--spp", "ten"],
        &["--"],
        &["--each-member", "--", "--spp", "10"],
    ] {
        let args = ["campaign", "new", text(&dir), "--command", "measure", "--over", "room"];
        assert_eq!(code(&[&args[..], words].concat()), 2, "{words:?}");
        assert!(!dir.exists(), "{words:?}");
    }
}

/// Cases of an experiment are dealt out whole, each once. What would not be the same bits in every
/// run, or is found of all cases together, is refused.
#[test]
fn cases_of_an_experiment_are_dealt_out() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("cases");
    let refused: [(&str, &[&str]); 5] = [
        ("calibration", &[]),
        ("column", &[]),
        ("table-3-1", &["--", "--ablations"]),
        ("table-3-1", &["--", "--cases", "3"]),
        ("table-3-1", &["--each-member"]),
    ];
    for (over, words) in refused {
        let args = ["campaign", "new", text(&dir), "--command", "experiment", "--over", over];
        assert_eq!(code(&[&args[..], words].concat()), 2, "{over} {words:?}");
        assert!(!dir.exists(), "{over} {words:?}");
    }
    new(&dir, "experiment", "table-3-1", 64, &["--", "--rehearsal", "1"]);
    assert_eq!(status(&dir)["units"], 20);
}

/// A small network: forecast in one unit and in three, the page shows what is known and says what
/// is not.
#[test]
fn a_network_is_forecast_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("bridges.csv");
    fs::write(
        &table,
        "ID,STRUCTURE,LATITUDE,LONGITUDE,YEAR BUILT,SPAN DETAILS\n\
         A,<Old> creek,43.1,-80.2,1955,9\n\
         B,New creek,44.1,-79.2,2015,Total=40 (1)=20;(2)=20;\n\
         C,No year,45.1,-78.2,,12\n\
         D,Long,46.1,-81.2,1970,60\n",
    )
    .unwrap();
    let [one, three] = [1, 3].map(|split| {
        let dir = folder.path().join(split.to_string());
        new(&dir, "predict", text(&table), split, &[]);
        assert_eq!(code(&["campaign", "run", text(&dir), "--quiet"]), 0);
        dir
    });
    let bits = collected(&one);
    assert_eq!(bits, collected(&three));
    let [csv, json] = bits;
    assert_eq!(String::from_utf8(csv).unwrap().lines().count(), 6);
    let rows = serde_json::from_slice::<Value>(&json).unwrap()["rows"].as_array().unwrap().clone();
    let ids: BTreeSet<&str> = rows.iter().map(|r| r["bridge_id"].as_str().unwrap()).collect();
    assert_eq!(ids, BTreeSet::from(["A", "B", "C", "D"]));
    assert!(rows[0]["damage [1]"].as_f64().unwrap() > rows[1]["damage [1]"].as_f64().unwrap());
    assert_eq!(rows[3]["damage [1]"], Value::Null);
    assert!(rows[3]["not_forecast"].as_str().unwrap().contains("year"));
    let page = fs::read_to_string(one.join("collected/network.html")).unwrap();
    for word in
        ["Nothing here was measured", "&#60;Old&#62; creek", "<circle", "no year of building"]
    {
        assert!(page.contains(word), "{word}");
    }
    assert!(!page.contains("<Old>"));
}

/// The job files name the program, the folder and every task once; on one machine they run.
#[test]
fn job_files_are_written_and_run() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("with space");
    new(&dir, "measure", "room", 3, &WALKS);
    let launch = |engine: &[&str]| {
        let output = run(&[&["campaign", "launch", text(&dir)], engine].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(launch(&["--slurm"]).contains("#SBATCH --array=0-2"));
    assert!(launch(&["--kubernetes", "--image", "r/i:1"]).contains("completions: 3"));
    let tasks = launch(&["--hyperqueue"]);
    assert_eq!(tasks.matches("[[task]]").count(), 4);
    assert!(tasks.contains("deps = [0, 1, 2]"), "{tasks}");
    assert_eq!(code(&["campaign", "launch", text(&dir), "--slurm", "--local", "2"]), 2);
    launch(&["--local", "2", "--submit"]);
    assert!(dir.join("collected/results.csv").is_file());
    assert_eq!(status(&dir)["done"], 3);
}
