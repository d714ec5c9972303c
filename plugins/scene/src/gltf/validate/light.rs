//! Lights of `KHR_lights_punctual`: what must hold between the properties of one.

use super::Check;
use crate::gltf::{json::Json, problem::remedy::EXPORT};

/// Spots have a cone, its inner angle below its outer one.
pub(super) fn check(check: &mut Check) {
    let lights =
        check.document.root.extension("KHR_lights_punctual").map_or(&[][..], |e| e.list("lights"));
    for (i, light) in
        lights.iter().enumerate().filter(|(_, light)| light.text("type") == Some("spot"))
    {
        let at = format!("/extensions/KHR_lights_punctual/lights/{i}");
        let Some(spot) = light.get("spot") else {
            check.error(
                at,
                "MISSING",
                "a light of type spot needs its object spot, if an empty one",
                EXPORT,
            );
            continue;
        };
        let inner = spot.number("innerConeAngle").unwrap_or(0.0);
        let outer = spot.number("outerConeAngle").unwrap_or(std::f64::consts::FRAC_PI_4);
        if inner >= outer {
            check.error(
                format!("{at}/spot"),
                "SPOT_ANGLES",
                format!("the inner angle, {inner}, is not below the outer one, {outer}"),
                EXPORT,
            );
        }
    }
}
