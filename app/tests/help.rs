//! What the program says of itself is listed in `help.txt`, so that a change of it is seen and
//! meant.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{fmt::Write, fs, path::Path};

use common::{run, text};

/// The help of every command, one after the other.
fn all() -> String {
    let commands = [
        "",
        "view",
        "screenshot",
        "info",
        "validate",
        "new",
        "import",
        "attach",
        "detach",
        "schema",
        "render",
        "measure",
        "analyze",
        "scan",
        "detect",
        "photo",
        "predict",
        "experiment",
        "verify",
        "merge",
        "campaign",
        "campaign new",
        "campaign run",
        "campaign status",
        "campaign collect",
        "campaign launch",
    ];
    let mut all = String::new();
    for command in commands {
        let args: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        let said = run(&args);
        assert!(said.status.success(), "{command}");
        let lines: Vec<String> = String::from_utf8(said.stdout)
            .unwrap()
            .lines()
            .map(|line| line.trim_end().to_owned())
            .collect();
        writeln!(all, "$ intrados {}\n{}\n", args.join(" "), lines.join("\n")).unwrap();
    }
    all
}

/// `INTRADOS_WRITE_HELP=1 cargo test -p intrados --test help` writes the list anew.
#[test]
fn help_is_as_listed() {
    let list = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/help.txt");
    let now = all();
    if std::env::var_os("INTRADOS_WRITE_HELP").is_some() {
        fs::write(&list, &now).unwrap();
    }
    let listed = fs::read_to_string(&list).unwrap();
    // Where lines are broken is the terminal's business, and that of features which other crates
    // ask for.
    let [words, known] = [&now, &listed].map(|text| text.split_whitespace().collect::<Vec<_>>());
    let differs = words
        .iter()
        .zip(&known)
        .position(|(now, known)| now != known)
        .unwrap_or(words.len().min(known.len()));
    let near = |words: &[&str]| {
        words.iter().skip(differs.saturating_sub(4)).take(9).copied().collect::<Vec<_>>().join(" ")
    };
    let why =
        format!("\"{}\", listed: \"{}\"; see this test's first line", near(&words), near(&known));
    assert!(words == known, "{}: {why}", text(&list));
    // Every command that the overview names is listed.
    let overview = now.split("\n$ intrados ").next().unwrap();
    let named = overview
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty());
    // Names are indented by two, what goes on from the line before by more.
    let names = named.filter_map(|line| {
        line.strip_prefix("  ").filter(|rest| !rest.starts_with(' '))?.split_whitespace().next()
    });
    for command in names.filter(|command| *command != "help") {
        assert!(listed.contains(&format!("$ intrados {command} --help")), "{command}");
    }
}

/// The page in the documentation is what the program prints: `intrados schema --page >
/// docs/scene.md` writes it anew.
#[test]
fn the_reference_of_scenes_is_the_program_s() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/scene.md");
    let said = run(&["schema", "--page"]);
    assert!(said.status.success());
    let [said, kept] = [String::from_utf8(said.stdout).unwrap(), fs::read_to_string(page).unwrap()];
    let first = said.lines().zip(kept.lines()).find(|(a, b)| a != b);
    assert!(said == kept, "docs/scene.md is of another version: {first:?}");
}

/// Editors read it: fields are named, and others refused.
#[test]
fn the_schema_is_json() {
    let said = run(&["schema"]);
    let schema: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(schema["additionalProperties"], false);
    assert!(schema["$defs"]["Gauge"]["properties"]["member"].is_object(), "{schema}");
}
