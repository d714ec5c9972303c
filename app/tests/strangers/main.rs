//! Files of strangers, as `INTRADOS_DATA/hostile` holds them, read by the program as its user runs
//! it: each ends in its right value, in a doubt that is said, or in one line that refuses it. One
//! module a folder; beside each file of the folder stand relatives of our own making, which need no
//! data.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod campaign;
#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "paths are of other shapes here")]
mod common;
mod csv;
mod decoders;
mod gltf;
mod harm;
mod ifc_matter;
mod ifc_shape;
mod img;
mod obj;
mod photo;
mod sino;

use std::{
    path::{Path, PathBuf},
    process::Output,
};

use common::{program, run};

/// A file or folder of `INTRADOS_DATA/hostile`.
fn hostile(name: &str) -> PathBuf {
    let data =
        std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA must name the folder of test data");
    Path::new(&data).join("hostile").join(name)
}

/// What it says on standard error and whether it succeeded, for messages of failing tests.
fn said(output: &Output) -> String {
    format!("{} {}", output.status, String::from_utf8_lossy(&output.stderr))
}

/// Of each folder of `hostile/public`: the tables that say what has to come of its files.
const TABLES: [(&str, &[&str]); 8] = [
    ("campaign", &[include_str!("campaign.rs")]),
    ("csv", &[include_str!("csv.rs")]),
    ("gltf", &[include_str!("gltf.rs")]),
    ("ifc", &[include_str!("ifc_matter.rs"), include_str!("ifc_shape.rs")]),
    ("img", &[include_str!("img.rs")]),
    ("obj", &[include_str!("obj.rs")]),
    ("photo", &[include_str!("photo.rs")]),
    ("sino", &[include_str!("sino.rs")]),
];

/// What only goes with another file, as a model's buffers.
const PARTS: [&str; 2] = ["bin", "mtl"];

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn every_file_of_strangers_stands_in_a_table_with_data() {
    let names = |folder: &str| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(hostile("public").join(folder)).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    };
    let folders = names("").len();
    assert_eq!(folders, TABLES.len(), "a folder of hostile/public has no table");
    for (folder, tables) in TABLES {
        for file in names(folder) {
            let is_part = file.extension().is_some_and(|e| PARTS.iter().any(|part| e == *part));
            let name = file.file_stem().unwrap().to_str().unwrap();
            let is_told = tables.iter().any(|table| {
                table.match_indices(name).any(|(at, _)| {
                    let (before, after) = (&table[..at], &table[at + name.len()..]);
                    before.ends_with(['"', '/']) && after.starts_with(['"', '/', '.'])
                })
            });
            assert!(is_part || is_told, "{folder}: nothing says what has to come of {name}");
        }
    }
}
