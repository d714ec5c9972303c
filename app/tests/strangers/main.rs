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
