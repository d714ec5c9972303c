//! Cameras.

use super::Check;
use crate::gltf::{json::Json, problem::remedy::EXPORT};

pub(super) fn check(check: &mut Check) {
    for (i, camera) in check.document.root.list("cameras").iter().enumerate() {
        let at = format!("/cameras/{i}");
        let both = camera.get("perspective").is_some() && camera.get("orthographic").is_some();
        let kind = camera.text("type").unwrap_or("perspective");
        if both {
            check.error(
                &*at,
                "CAMERA",
                "it is perspective and orthographic at once",
                "keep one of them",
            );
        } else if ["perspective", "orthographic"].contains(&kind)
            && camera.get("type").is_some()
            && camera.get(kind).is_none()
        {
            check.error(&*at, "MISSING", format!("{kind} is missing"), EXPORT);
        }
        for kind in ["perspective", "orthographic"] {
            let lens = camera.field(kind);
            if lens.number("zfar").zip(lens.number("znear")).is_some_and(|(far, near)| far <= near)
            {
                check.error(
                    format!("{at}/{kind}"),
                    "CAMERA",
                    "zfar must lie behind znear",
                    "correct the clipping planes",
                );
            }
        }
        for key in ["xmag", "ymag"] {
            match camera.field("orthographic").number(key) {
                Some(0.0) => check.error(
                    format!("{at}/orthographic/{key}"),
                    "CAMERA",
                    "the width of the picture is zero",
                    "give it a width",
                ),
                Some(x) if x < 0.0 => check.warn(
                    format!("{at}/orthographic/{key}"),
                    "CAMERA",
                    "the picture is mirrored",
                    "make it positive",
                ),
                _ => {}
            }
        }
        if camera
            .field("perspective")
            .number("yfov")
            .is_some_and(|yfov| yfov >= std::f64::consts::PI)
        {
            check.warn(
                format!("{at}/perspective/yfov"),
                "CAMERA",
                "the field of view is 180 degrees or more",
                "make it smaller",
            );
        }
    }
}
