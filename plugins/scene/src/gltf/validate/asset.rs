//! The version.

use super::Check;
use crate::gltf::{json::Json, problem::remedy::EXPORT};

/// Major, minor.
fn version(text: &str) -> Option<(u32, u32)> {
    let digits = |part: &str| {
        if part.bytes().all(|b| b.is_ascii_digit()) { part.parse().ok() } else { None }
    };
    let (major, minor) = text.split_once('.')?;
    Some((digits(major)?, digits(minor)?))
}

/// We read 2.x.
pub(super) fn check(check: &mut Check) {
    let asset = check.document.root.field("asset");
    let mut read = |key: &str| {
        let text = asset.text(key)?;
        let known = version(text);
        if known.is_none() {
            check.error(
                format!("/asset/{key}"),
                "VERSION",
                format!("{text:?} is no version such as 2.0"),
                EXPORT,
            );
        }
        known
    };
    let (written, least) = (read("version"), read("minVersion"));
    match written {
        Some((2, 0)) | None => {}
        Some((2, minor)) => check.warn(
            "/asset/version",
            "VERSION",
            format!("version 2.{minor} is read as 2.0"),
            "look over what is shown",
        ),
        Some((major, minor)) => {
            let message = format!("glTF {major}.{minor} is not supported, only 2.0");
            check.error("/asset/version", "VERSION", message, "export the model as glTF 2.0");
        }
    }
    if least.zip(written).is_some_and(|(least, written)| least > written) {
        check.error(
            "/asset/minVersion",
            "VERSION",
            "the least version is above the file's own",
            EXPORT,
        );
    }
}
