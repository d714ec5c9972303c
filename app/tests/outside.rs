//! Nothing outside the folder that a command works in is ever written or removed: every command, with
//! links in its way that lead out, names with `..` in them and paths that begin at the root.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[expect(dead_code, reason = "commands run in a folder here")]
mod common;

use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Output,
};

use common::{program, text};

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    members: [(id: "C1", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37")],
    lamps: [Environment(name: "../../theirs/sky", radiance: (1, 1, 1))],
    cameras: [(name: "../../theirs/file", position: (2, 2, 5), target: (0, 1, 0), fov_deg: 40, width: 9, height: 9)],
    supports: [(member: "C1", place: Bottom, hold: Fixed)],
    loads: [(name: "self weight", action: SelfWeight, history: [(0, 0), (1, 1)])],
)"#;

/// Two folders side by side: ours, in which commands work, and theirs, which nothing may touch.
struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Self {
        let all = Self(tempfile::tempdir().unwrap());
        for folder in ["ours", "theirs/deep", "theirs/empty"] {
            fs::create_dir_all(all.at(folder)).unwrap();
        }
        for file in ["theirs/file", "theirs/deep/file", "theirs/a.csv", "theirs/a.png"] {
            fs::write(all.at(file), "theirs").unwrap();
        }
        fs::write(all.at("theirs/evidence.ron"), "(schema: \"intrados.evidence/1\")").unwrap();
        fs::write(all.at("ours/scene.ron"), SCENE).unwrap();
        fs::write(all.at("mv.csv"), "mV\n-100\n-200\n").unwrap();
        let grey = |x: u32, y: u32| {
            image::Luma([if (8..56).contains(&x) && (8..56).contains(&y) { 180_u8 } else { 0 }])
        };
        image::GrayImage::from_fn(64, 64, grey).save(all.at("slice.png")).unwrap();
        all
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn link(&self, to: &str, from: &str) {
        fs::create_dir_all(self.at(from).parent().unwrap()).unwrap();
        symlink(self.at(to), self.at(from)).unwrap();
    }

    /// Runs a command line in our folder.
    fn run(&self, line: &str) -> Output {
        let words = line.split(' ').filter(|word| !word.is_empty());
        program().args(words).current_dir(self.at("ours")).output().unwrap()
    }

    /// Runs it, and holds theirs against what they were. Gives the exit code and what is said.
    fn tried(&self, line: &str) -> (i32, String) {
        let before = state(&self.at("theirs"));
        let output = self.run(line);
        assert_eq!(state(&self.at("theirs")), before, "{line}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!said.contains("panicked"), "{line}: {said}");
        (output.status.code().unwrap(), said)
    }
}

/// Everything below a folder, links as links.
fn state(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        if kind.is_dir() {
            all.extend(state(&path));
            all.insert(path, b"folder".to_vec());
        } else if kind.is_symlink() {
            let to = fs::read_link(&path).unwrap();
            all.insert(path, to.into_os_string().into_encoded_bytes());
        } else {
            let bytes = fs::read(&path).unwrap();
            all.insert(path, bytes);
        }
    }
    all
}

/// Commands that write files into `out`.
const WRITERS: [&str; 9] = [
    "render scene.ron --spp 1 --out out",
    "measure room --spp 1 --width 9 --height 9 --out out",
    "analyze scene.ron --whole --out out",
    "detect ../slice.png --method classical --pixel-mm 1 --out out",
    "predict scene.ron --no-forecast --spp 0 --out out",
    "merge ../part.acc --out out",
    "new column out/new.ron --force",
    "new beam out/new.glb --force",
    "render room --spp 1 --width 9 --height 9 --checkpoint out/state.acc --out out",
];

/// Where the files of a command will lie there are links, to files that are there and to none: the
/// links are replaced, and nothing behind them changes.
#[test]
fn links_in_the_place_of_results_are_replaced() {
    for line in WRITERS {
        let all = Sandbox::new();
        if line.starts_with("merge") {
            let made =
                all.run("render room --spp 4 --width 9 --height 9 --shard 0/2 --out ../parts");
            assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
            let part = fs::read_dir(all.at("parts")).unwrap().flatten().next().unwrap().path();
            fs::rename(part, all.at("part.acc")).unwrap();
        }
        fs::create_dir(all.at("ours/out")).unwrap();
        let (code, said) = all.tried(line);
        assert_eq!(code, 0, "{line}: {said}");
        let made: Vec<PathBuf> = state(&all.at("ours/out")).into_keys().collect();
        assert!(!made.is_empty(), "{line}");
        for (k, path) in made.iter().enumerate() {
            fs::remove_file(path).unwrap();
            let to =
                if k % 2 == 0 { all.at("theirs/file") } else { all.at(&format!("theirs/{k}")) };
            symlink(to, path).unwrap();
        }
        let (code, said) = all.tried(line);
        assert_eq!(code, 0, "{line}: {said}");
        for path in &made {
            assert!(fs::symlink_metadata(path).unwrap().is_file(), "{line}: {}", path.display());
        }
    }
}

/// What would be written through a link to a folder is refused with its name.
#[test]
fn links_to_folders_are_refused() {
    const CAMPAIGN: &str =
        "campaign new c --command predict --over scene.ron -- --no-forecast --spp 0";
    const RUN: [&str; 2] = [CAMPAIGN, "campaign run c --quiet"];
    let table: [(&[&str], &str, &str, &str); 14] = [
        (&[], "deep", "out", "render scene.ron --spp 1"),
        (&[], "deep", "out", "predict scene.ron --no-forecast --spp 0"),
        (&[CAMPAIGN], "deep", "c/work", "campaign run c --quiet"),
        (&[CAMPAIGN], "deep", "c/units", "campaign run c --quiet"),
        (&[CAMPAIGN], "nowhere", "c/units", "campaign run c --quiet"),
        (&RUN, "deep", "c/collected", "campaign collect c"),
        (&RUN, "deep", "c/launch", "campaign launch c --slurm"),
        (&RUN, "nowhere", "c/launch/slurm", "campaign launch c --slurm"),
        (&[], "empty", "project", "import ../model.glb --out project"),
        (&[], "nowhere", "project", "import ../model.glb --out project"),
        (&[], "deep", "evidence", "attach . C1 ../mv.csv --name a"),
        (&[], "nowhere", "evidence", "attach . C1 ../mv.csv --name a"),
        (&[], "deep", "evidence/C1_a", "attach . C1 ../mv.csv --name a"),
        (&[], "evidence.ron", "evidence.ron", "attach . C1 --intact"),
    ];
    for (before, to, from, line) in table {
        let all = Sandbox::new();
        assert!(all.run("new column ../model.glb").status.success());
        for line in before {
            let output = all.run(line);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        // What a worker has made there is put away.
        let place = all.at("ours").join(from);
        if place.exists() {
            fs::rename(&place, all.at("put-away")).unwrap();
        }
        all.link(&format!("theirs/{to}"), &format!("ours/{from}"));
        let (code, said) = all.tried(line);
        assert!([2, 65, 66, 73].contains(&code), "{from}, {line}: {code} {said}");
        let last = from.rsplit('/').next().unwrap();
        // Of a campaign's units each is told, and the first again as the command's own.
        assert!(said.lines().count() <= 2 && said.contains(last), "{from}, {line}: {said}");
    }
}

/// A unit's own folder, its lock and its files are links or a pipe: nothing behind them changes, and
/// nothing is waited for.
#[test]
fn a_unit_is_worked_on_in_the_campaign_alone() {
    for (to, place) in [
        ("deep", ""),
        ("file", ".lock"),
        ("nowhere", ".lock"),
        ("deep", "files"),
        ("pipe", ".lock"),
    ] {
        let all = Sandbox::new();
        let made =
            all.run("campaign new c --command predict --over scene.ron -- --no-forecast --spp 0");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let plan = fs::read_to_string(all.at("ours/c/campaign.json")).unwrap();
        let plan: serde_json::Value = serde_json::from_str(&plan).unwrap();
        let work = format!("ours/c/work/{}", plan["units"][0]["id"].as_str().unwrap());
        let from = format!("{work}/{place}");
        let from = from.trim_end_matches('/');
        if to == "pipe" {
            fs::create_dir_all(all.at(&work)).unwrap();
            let made = std::process::Command::new("mkfifo").arg(all.at(from)).status().unwrap();
            assert!(made.success());
        } else {
            all.link(&format!("theirs/{to}"), from);
        }
        let (code, said) = all.tried("campaign status c");
        assert_eq!(code, 0, "{said}");
        let (code, said) = all.tried("campaign run c --quiet");
        assert!(code == 73 && said.lines().count() <= 2, "{to} {place}: {code} {said}");
    }
}

/// Evidence that names what lies elsewhere is taken away, and what it names stays.
#[test]
fn what_is_detached_lies_in_the_folder() {
    let table: [(&str, &[(&str, &str)]); 7] = [
        ("evidence/C1_a/a.csv", &[("theirs", "ours/evidence/C1_a")]),
        ("evidence/deep/a.csv", &[("theirs", "ours/evidence")]),
        ("evidence/C1_a/a.csv", &[("theirs/a.csv", "ours/evidence/C1_a/a.csv")]),
        ("evidence/C1_a/a.csv", &[("theirs/nowhere", "ours/evidence/C1_a/a.csv")]),
        ("evidence/../../theirs/a.csv", &[]),
        ("evidence/C1_a/../../../theirs/a.csv", &[]),
        ("/theirs/a.csv", &[]),
    ];
    for (file, links) in table {
        let all = Sandbox::new();
        links.iter().for_each(|(to, from)| all.link(to, from));
        let file = match file.strip_prefix('/') {
            Some(name) => text(&all.at(name)).to_owned(),
            None => file.to_owned(),
        };
        let evidence = format!(
            "(schema: \"intrados.evidence/1\", tables: [(file: \"{file}\", member: \"C1\", name: \"a\")])"
        );
        fs::write(all.at("ours/evidence.ron"), evidence).unwrap();
        let (code, said) = all.tried("detach . C1 a");
        assert_eq!(code, 0, "{file}: {said}");
        let left = fs::read_to_string(all.at("ours/evidence.ron")).unwrap();
        assert!(!left.contains("a.csv"), "{left}");
        // Of a link in a plain folder the link alone goes.
        for (_, from) in links.iter().filter(|(_, from)| from.ends_with(".csv")) {
            assert!(fs::symlink_metadata(all.at(from)).is_err(), "{file}");
        }
    }
}

/// Names with `..` in them lead nowhere.
#[test]
fn names_lead_nowhere() {
    let all = Sandbox::new();
    for line in [
        "attach . C1 ../mv.csv --name ../../theirs/file",
        "attach . C1 --rust 0.1 --name ../../theirs/file",
        "detach . C1 ../../theirs/file",
        "render scene.ron --spp 1 --out out",
        "predict scene.ron --no-forecast --spp 0 --out out",
        "attach . C1 ../mv.csv --name /theirs/file",
    ] {
        all.tried(line);
    }
    let outside: Vec<_> = fs::read_dir(all.0.path()).unwrap().flatten().collect();
    assert_eq!(outside.len(), 4, "ours, theirs, and what was brought: {outside:?}");
}

/// What a killed `attach` left is removed by the next one.
#[test]
fn what_a_killed_command_left_is_removed() {
    let all = Sandbox::new();
    fs::create_dir(all.at("ours/.attach-killed")).unwrap();
    fs::write(all.at("ours/.attach-killed/.lock"), "").unwrap();
    fs::write(all.at("ours/.attach-killed/mv.csv"), "half").unwrap();
    all.link("theirs/deep", "ours/.attach-link");
    let (code, said) = all.tried("attach . C1 ../mv.csv --name a");
    assert_eq!(code, 0, "{said}");
    assert!(!all.at("ours/.attach-killed").exists());
    let names = fs::read_dir(all.at("ours/evidence/C1_a")).unwrap().flatten();
    assert_eq!(names.map(|e| e.file_name()).collect::<Vec<_>>(), ["mv.csv"]);
}

/// The hidden folder of a run, its lock and what it kept are links that lead out, or name what lies
/// elsewhere.
#[test]
fn what_a_run_keeps_lies_in_its_folder() {
    use intrados_stage::file::Set;
    for trap in ["", ".lock", ".parts", "record"] {
        let all = Sandbox::new();
        let folder = all.at("ours/out");
        let mut set = Set::resume(&folder, "key").unwrap();
        let kept = set.part("one", |set| set.put("one.txt", b"1").map(|()| 1_u8));
        assert_eq!(kept.unwrap(), 1);
        drop(set);
        let name = fs::read_dir(&folder).unwrap().flatten().next().unwrap().file_name();
        let aside = format!("ours/out/{}", name.to_str().unwrap());
        let before = state(&all.at("theirs"));
        if trap == "record" {
            let records = fs::read_dir(all.at(&aside).join(".parts")).unwrap().flatten();
            for record in records.map(|entry| entry.path()) {
                let text = fs::read_to_string(&record).unwrap();
                fs::write(&record, text.replace("one.txt", "../../../theirs/file")).unwrap();
            }
        } else {
            let place = format!("{aside}/{trap}");
            fs::rename(all.at(place.trim_end_matches('/')), all.at("put-away")).unwrap();
            let to = if trap == ".lock" { "theirs/file" } else { "theirs/deep" };
            all.link(to, place.trim_end_matches('/'));
        }
        if let Ok(mut set) = Set::resume(&folder, "key") {
            let done = set.part("one", |set| set.put("one.txt", b"1").map(|()| 2_u8)).unwrap();
            assert_eq!(done, 2, "{trap}: it is done again");
            set.put("list.json", b"{}").unwrap();
            set.publish("list.json").unwrap();
            assert!(folder.join("one.txt").is_file());
        }
        assert_eq!(state(&all.at("theirs")), before, "{trap}");
    }
}
