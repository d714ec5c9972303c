//! Names in any script, signals, disks and streams that fail: the real program loses nothing and
//! overwrites nothing of others'.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{
    fs::{self, File},
    os::unix::ffi::OsStringExt,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;

use common::{program, run, text};

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs to a good end.
fn json(args: &[&str]) -> Value {
    let output = run(&[args, &["--format", "json"]].concat());
    assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
        .unwrap()
}

/// What a report names, each of which must be there.
fn files(report: &Value) -> Vec<PathBuf> {
    let files: Vec<PathBuf> = report["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| PathBuf::from(f.as_str().unwrap()))
        .collect();
    assert!(!files.is_empty() && files.iter().all(|f| f.is_file()), "{files:?}");
    files
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

/// A member, a camera, a meter, a scanner and more, with `name` wherever a scene has a name, and
/// `ids` as members.
fn scene(name: &str, ids: &[&str]) -> String {
    let (gauge, name) = (format!("{:?}", format!("{name} ε")), format!("{name:?}"));
    let member = |(i, id): (usize, &&str)| {
        format!(
            "(id: {id:?}, name: {name}, at: ({i}, 0, 0), concrete: \"C30/37\", material: {name},
            body: Column(section: Rectangle(width_m: 0.1, depth_m: 0.1), height_m: 0.5, reinforcement: (
                cover_mm: 15, bars: [Around(count: 4, diameter_mm: 8)], stirrups: (diameter_mm: 6, spacing_mm: 100))),
            slices: [Drawn(name: {name}, count: 1, size: 48, pixel_mm: 3, seed: 1)], truth: [Voids(from: 0, to: 1, porosity: 0.02, median_mm: 3)])"
        )
    };
    let members: Vec<String> = ids.iter().enumerate().map(member).collect();
    let scanned: Vec<String> = ids.iter().map(|id| format!("{id:?}")).collect();
    let id = format!("{:?}", ids[0]);
    format!(
        "(schema: \"intrados.scene/1\", title: {name}, materials: [(name: {name}, colour: (0.5, 0.5, 0.5))],
        shapes: [Quad(name: {name}, corner: (-0.5, 2.2, -0.3), u: (1, 0, 0), v: (0, 0, 0.8), emission: (22, 21, 19))],
        members: [{}],
        cameras: [(name: {name}, position: (1.1, 1.3, 2.6), target: (0, 0.5, 0), fov_deg: 40, width: 8, height: 6)],
        meters: [Patch(name: {name}, corner: (-0.4, 0.002, 0.5), u: (0, 0, 0.2), v: (0.2, 0, 0))],
        supports: [{}],
        loads: [(name: {name}, action: SelfWeight, history: [(0, 0), (1, 1)])],
        gauges: [(name: {gauge}, member: {id}, along: 0.25, angle_deg: 0, measures: Strain(Axial))],
        scanners: [(name: {name}, members: [{}], tube: (voltage_kv: 300, filters: [(\"Cu\", 3)], charge_mas: 20, focus_mm: 0.4),
            detector: (width: 32, height: 4, pixel_mm: 6.4), orbit: (projections: 24, source_m: 0.9, detector_m: 0.4, along: [0.3, 0.6]))])",
        members.join(", "),
        scanned.iter().map(|id| format!("(member: {id}, place: Start, hold: Fixed)")).collect::<Vec<_>>().join(", "),
        scanned.join(", ")
    )
}

/// Every command takes every name, in its files and in their names too, and stays in its folder.
#[test]
fn names_may_be_of_any_script() {
    let long = "桥".repeat(300);
    for name in ["Стойка 1", "桥墩", "🌉", "it's \"so\" & <b>", "../../x", "-rf", "Stütze/1", &long]
    {
        let folder = tempfile::tempdir().unwrap();
        let path = folder
            .path()
            .join(if name.contains('/') || name.len() > 200 { "scene.ron" } else { name })
            .with_extension("ron");
        fs::write(&path, scene(name, &[name])).unwrap();
        let path =
            format!("{}/./{}", text(folder.path()), path.file_name().unwrap().to_str().unwrap());
        let before = entries(folder.path());
        let out = |what: &str| folder.path().join("out").join(what);
        json(&["info", &path]);
        assert!(run(&["validate", &path]).status.success(), "{name}");
        let render = json(&[
            "render",
            &path,
            &format!("--camera={name}"),
            "--spp",
            "1",
            "--out",
            text(&out("render")),
        ]);
        assert_eq!((files(&render).len(), &render["camera"]), (3, &name.into()));
        for shard in ["0/2", "1/2"] {
            json(&["render", &path, "--spp", "2", "--shard", shard, "--out", text(&out("parts"))]);
        }
        let parts: Vec<PathBuf> =
            fs::read_dir(out("parts")).unwrap().map(|e| e.unwrap().path()).collect();
        assert_eq!(
            files(&json(&[
                "merge",
                text(&parts[0]),
                text(&parts[1]),
                "--out",
                text(&out("merged"))
            ]))
            .len(),
            3
        );
        let measured = json(&["measure", &path, "--spp", "1", "--out", text(&out("measure"))]);
        assert_eq!(measured["meters"][1]["name"], name);
        // Seconds each: those that are most unlike a file's name.
        if ["🌉", "../../x", &long].contains(&name) {
            let out = out("scan");
            let scan = ["scan", &path, "--along", "0.3", "--slices", "1", "--out", text(&out)];
            assert_eq!(files(&json(&scan)).len(), 7);
        }
        assert!(files(&json(&["analyze", &path, "--out", text(&out("analyze"))])).len() > 3);
        let predicted = json(&[
            "predict",
            &path,
            "--spp",
            "1",
            "--no-forecast",
            "--out",
            text(&out("predict")),
        ]);
        assert!(files(&predicted).len() >= 6 && predicted["members"][0]["name"] == name);
        assert_eq!(entries(folder.path()), before + 1, "{name}: something lies outside");
    }
}

/// Names that cannot be are refused in one line before any work.
#[test]
fn impossible_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    for name in ["two\nlines", "a\u{0}b", "", &"x".repeat(10_000)] {
        fs::write(&path, scene("fine", &[name])).unwrap();
        let output = run(&["render", text(&path), "--out", text(&folder.path().join("out"))]);
        assert_eq!(output.status.code(), Some(65));
        assert!(
            stderr(&output).trim().lines().count() == 1 && stderr(&output).len() < 2000,
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn ids_that_look_alike_have_files_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    fs::write(&path, scene("alike", &["P_1", "P/1", "p_1"])).unwrap();
    // Of its place a stack, four files of a slice and a table, and one list; of a life a series, a
    // table and at least one step.
    for (command, more, least) in
        [("scan", &["--along", "0.3", "--slices", "1"][..], 3 * 6 + 1), ("analyze", &[], 3 * 3 + 2)]
    {
        let out = folder.path().join(command);
        let mut named =
            files(&json(&[&[command, text(&path), "--out", text(&out)], more].concat()));
        let n = named.len();
        named.sort();
        named.dedup();
        assert!(named.len() == n && n >= least && entries(&out) == n, "{command}: {named:?}");
    }
}

/// A word of the command line that is no text ends nothing.
#[test]
fn arguments_need_not_be_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    fs::write(&path, scene("fine", &["P1"])).unwrap();
    let out = folder.path().join(std::ffi::OsString::from_vec(b"out\xff".to_vec()));
    let output = program()
        .args(["predict", text(&path), "--spp", "0", "--no-forecast", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(out.join("report.html").is_file());
}

fn interrupt(child: &mut Child, signal: &str) -> Option<i32> {
    assert!(
        Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success()
    );
    child.wait().unwrap().code()
}

/// Waits for what `is` says of a child that must not end before.
fn wait_for(child: &mut Child, is: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is() {
        assert!(
            child.try_wait().unwrap().is_none() && begin.elapsed() < Duration::from_secs(120),
            "it ended, or nothing came"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// What was reached by a signal is there, and says that it is not all.
#[test]
fn an_interrupted_picture_and_reading_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let commands: [(&str, &[&str], &str, &str); 2] = [
        ("render", &["--width", "48", "--height", "32", "--side", "both"], "result.json", "-INT"),
        ("measure", &["--guide", "off"], "measure.json", "-TERM"),
    ];
    for (command, more, list, signal) in commands {
        let (out, checkpoint) = (at(command), at(&format!("{command}.acc")));
        let keep = [
            "--spp",
            "1000000",
            "--out",
            text(&out),
            "--checkpoint",
            text(&checkpoint),
            "--checkpoint-every",
            "0s",
            "--format",
            "json",
        ];
        let mut child = program()
            .args([command, "room"])
            .args(more)
            .args(keep)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_for(&mut child, || checkpoint.exists());
        assert!(
            Command::new("kill")
                .args([signal, &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert!(stderr(&output).contains("interrupted: what was reached"), "{}", stderr(&output));
        let report = read(&out.join(list));
        assert_eq!(report["stop"], "interrupted");
        assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), report);
        files(&report);
    }
    let reader =
        png::Decoder::new(std::io::BufReader::new(File::open(at("render/room.png")).unwrap()))
            .read_info()
            .unwrap();
    assert!(
        reader
            .info()
            .utf8_text
            .iter()
            .any(|t| t.keyword == "intrados.stop" && t.get_text().unwrap() == "interrupted")
    );
}

/// The steps of a life that was interrupted are there, apart and named as what they are, with those
/// that were whole; and the same command goes on to the result.
#[test]
fn an_interrupted_life_is_kept_until_then() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let args = ["analyze", "column", "--member", "C1", "--element", "0.2", "--out", text(&out)];
    let mut child =
        program().args(args).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let drawn = || {
        let entries =
            |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        entries(&out).flat_map(|aside| entries(&aside)).any(|p| p.ends_with("C1_0002.vtu"))
    };
    wait_for(&mut child, drawn);
    assert!(
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains("interrupted: what was reached is in"), "{}", stderr(&output));
    assert!(!out.join("analyze.json").exists() && entries(&out) == 1);
    let report = read(&out.join("stopped/analyze.json"));
    let life = &report["models"][0];
    assert!(report["stopped"] == true && life["stopped"] == true, "{life}");
    let complaint = life["complaint"].as_str().unwrap();
    assert!(complaint.starts_with("it was stopped on day "), "{complaint}");
    let steps = life["steps"].as_array().unwrap().len();
    let pictures = files(&report).iter().filter(|f| f.extension().unwrap() == "vtu").count();
    assert!(steps >= 3 && pictures == steps, "{pictures} pictures of {steps} steps");
    let table = fs::read_to_string(out.join("stopped/C1.csv")).unwrap();
    assert!(table.ends_with(&format!("\n# {complaint}\n")), "{table}");
    let whole = json(&args);
    assert!(whole["stopped"].is_null() && files(&whole).len() > files(&report).len());
}

/// The finished places of a scan that was broken off, by a signal or without a word, are taken up
/// by the same command: the result has the bits of one that ran through.
#[test]
fn a_broken_off_scan_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    fs::write(&path, scene("fine", &["P1"])).unwrap();
    let places = ["--along", "0.3", "--along", "0.4", "--slices", "1", "--threads", "1"];
    let slice = "P1_0.400_slice-001.tif";
    let whole = folder.path().join("whole");
    json(&[&["scan", text(&path), "--out", text(&whole)], &places[..]].concat());
    for signal in ["-INT", "-KILL"] {
        let out = folder.path().join(signal);
        let mut child = program()
            .args(["scan", text(&path), "-q", "--out", text(&out)])
            .args(places)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let parts = || {
            let hidden = fs::read_dir(&out)
                .ok()
                .and_then(|mut all| all.next())
                .map(|e| e.unwrap().path().join(".parts"));
            hidden.and_then(|parts| fs::read_dir(parts).ok()).map_or(0, |all| {
                all.flatten().filter(|e| e.path().extension().is_some_and(|e| e == "ron")).count()
            })
        };
        wait_for(&mut child, || parts() > 0);
        assert_eq!(interrupt(&mut child, signal), (signal == "-INT").then_some(130));
        assert!(!out.join("scan.json").exists() && !out.join(slice).exists());
        let output =
            run(&[&["scan", text(&path), "--out", text(&out), "--format", "json"], &places[..]]
                .concat());
        assert!(
            output.status.success() && stderr(&output).contains("goes on from"),
            "{}",
            stderr(&output)
        );
        assert_eq!(files(&read(&out.join("scan.json"))).len(), entries(&out));
        assert!(fs::read(out.join(slice)).unwrap() == fs::read(whole.join(slice)).unwrap());
    }
}

/// A run that is killed at any moment over an older result leaves one list of files that belong
/// together, or none; what else is there stays.
#[test]
fn a_killed_run_leaves_no_mixed_set() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let render = |seed: &str| {
        let args = [
            "render",
            "room",
            "--width",
            "16",
            "--height",
            "12",
            "--spp",
            "1",
            "--seed",
            seed,
            "--out",
            text(&out),
            "-q",
        ]
        .map(str::to_owned);
        program().args(args).stdout(Stdio::null()).spawn().unwrap()
    };
    let took = {
        let begin = Instant::now();
        assert!(render("0").wait().unwrap().success());
        begin.elapsed()
    };
    fs::write(out.join("mine.txt"), "mine").unwrap();
    for kill in 1..=30_u32 {
        let mut child = render(&kill.to_string());
        std::thread::sleep(took.mul_f64(0.7 + 0.02 * f64::from(kill)));
        let _ = child.kill();
        child.wait().unwrap();
        if out.join("result.json").exists() {
            let seed = read(&out.join("result.json"))["seed"].to_string();
            let reader = png::Decoder::new(std::io::BufReader::new(
                File::open(out.join("room.png")).unwrap(),
            ))
            .read_info()
            .unwrap();
            let png = reader
                .info()
                .utf8_text
                .iter()
                .find(|t| t.keyword == "intrados.seed")
                .unwrap()
                .get_text()
                .unwrap();
            assert_eq!(png, seed, "after kill {kill}");
        }
        assert_eq!(fs::read_to_string(out.join("mine.txt")).unwrap(), "mine");
    }
    assert!(render("99").wait().unwrap().success());
    assert_eq!(entries(&out), 4, "what killed runs left is swept up");
}

/// Shards that are not there, or not done, are named.
#[test]
fn missing_shards_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path());
    for shard in ["0/3", "2/3"] {
        json(&["measure", "room", "--spp", "16", "--guide", "off", "--shard", shard, "--out", out]);
        json(&[
            "render",
            "room",
            "--width",
            "8",
            "--height",
            "8",
            "--spp",
            "4096",
            "--shard",
            shard,
            "--out",
            &format!("{out}/p"),
        ]);
    }
    for (parts, list) in [(out.to_owned(), "measure.json"), (format!("{out}/p"), "result.json")] {
        let [a, c] = [0, 2].map(|i| format!("{parts}/room.{i}of3.acc"));
        let output = run(&["merge", &a, &c, "--out", &parts]);
        assert!(
            output.status.success() && stderr(&output).contains("2 of 3 given, 1/3 missing"),
            "{}",
            stderr(&output)
        );
        assert!(String::from_utf8_lossy(&output.stdout).contains("1/3 missing"));
        let shards = &read(&Path::new(&parts).join(list))["shards"];
        assert_eq!(
            (&shards["given"], &shards["of"], &shards["missing"]),
            (&2.into(), &3.into(), &serde_json::json!([1]))
        );
    }
}

/// Streams that take nothing: no panic, no lost result.
#[cfg(target_os = "linux")]
#[test]
fn nobody_need_listen() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.ron");
    fs::write(&broken, "(schema").unwrap();
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let small = ["render", "room", "--width", "8", "--height", "8", "--spp", "1", "-vv", "--out"];
    let out = |name: &str| folder.path().join(name);
    // stderr is full: warnings and errors are lost, results and codes are not.
    let status =
        program().args(small).arg(out("a")).stdout(Stdio::null()).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(0));
    files(&read(&out("a/result.json")));
    for (args, code) in [
        (&["info", text(&broken), text(&broken)][..], 65),
        (&["render", "nobody"], 66),
        (&["frobnicate"], 2),
        (&["view"], 2),
    ] {
        assert_eq!(
            program().args(args).stdout(Stdio::null()).stderr(full()).status().unwrap().code(),
            Some(code),
            "{args:?}"
        );
    }
    // stdout is full: the files are there, and the code says that something could not be written.
    assert_eq!(
        program()
            .args(small)
            .arg(out("b"))
            .stdout(full())
            .stderr(Stdio::null())
            .status()
            .unwrap()
            .code(),
        Some(73)
    );
    files(&read(&out("b/result.json")));
    // Both closed.
    let shell = format!("exec \"$0\" {} '{}' >&- 2>&-", small.join(" "), text(&out("c")));
    assert_eq!(
        Command::new("sh")
            .args(["-c", &shell, env!("CARGO_BIN_EXE_intrados")])
            .status()
            .unwrap()
            .code(),
        Some(0)
    );
    files(&read(&out("c/result.json")));
}

/// A checkpoint that can no longer be written does not end the work.
#[test]
fn a_lost_checkpoint_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (kept, out) = (folder.path().join("kept"), folder.path().join("out"));
    fs::create_dir(&kept).unwrap();
    let checkpoint = kept.join("a.acc");
    let args = [
        "render",
        "room",
        "--width",
        "48",
        "--height",
        "32",
        "--spp",
        "800",
        "--threads",
        "1",
        "--checkpoint-every",
        "0s",
        "--format",
        "json",
    ];
    let mut child = program()
        .args(args)
        .args(["--checkpoint", text(&checkpoint), "--out", text(&out)])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for(&mut child, || checkpoint.exists());
    fs::rename(&kept, folder.path().join("gone")).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("the work goes on"), "{}", stderr(&output));
    assert_eq!(files(&read(&out.join("result.json"))).len(), 3);
}
