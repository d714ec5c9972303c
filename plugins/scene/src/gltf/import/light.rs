//! Lamps and cameras, which hang on nodes.

use glam::{DMat4, DVec3, Vec3};
use serde_json::Value;

use super::{Notes, material::colour};
use crate::{
    Camera, Lamp, LampKind,
    gltf::{LUMENS_PER_WATT, json::Json},
};

/// Where a node looks from, and which way: lamps and cameras look along −z, and scale does not
/// matter to them.
struct Pose {
    position: Vec3,
    forward: Vec3,
    up: Vec3,
}

impl Pose {
    fn of(world: &DMat4) -> Self {
        let axis =
            |v: DVec3, otherwise| world.transform_vector3(v).normalize_or(otherwise).as_vec3();
        Self {
            position: world.w_axis.truncate().as_vec3(),
            forward: axis(DVec3::NEG_Z, DVec3::NEG_Z),
            up: axis(DVec3::Y, DVec3::Y),
        }
    }
}

/// A lamp of `KHR_lights_punctual`; `None` where it is damaged.
pub(super) fn lamp(json: &Value, world: &DMat4, node: &str) -> Option<Lamp> {
    let pose = Pose::of(world);
    let photometric = json.number("intensity").unwrap_or(1.0).max(0.0) as f32;
    let strength = (colour(json.field("color"), 1.0) * photometric / LUMENS_PER_WATT)
        .min(Vec3::splat(f32::MAX));
    let kind = match json.text("type")? {
        "point" => LampKind::Point { position: pose.position, intensity: strength },
        "directional" => LampKind::Directional { direction: pose.forward, irradiance: strength },
        "spot" => {
            let angle = |key, default| json.field("spot").number(key).unwrap_or(default) as f32;
            let outer = angle("outerConeAngle", std::f64::consts::FRAC_PI_4)
                .clamp(1e-4, std::f32::consts::FRAC_PI_2);
            let inner = angle("innerConeAngle", 0.0).clamp(0.0, outer * 0.9999);
            LampKind::Spot {
                position: pose.position,
                direction: pose.forward,
                intensity: strength,
                inner,
                outer,
            }
        }
        _ => return None,
    };
    Some(Lamp { name: json.text("name").unwrap_or(node).to_owned(), kind })
}

/// A perspective camera, its picture the largest within 1280 × 720; `None` (and a note) where there
/// is none to make.
pub(super) fn camera(json: &Value, world: &DMat4, node: &str, notes: &mut Notes) -> Option<Camera> {
    let name = json.text("name").unwrap_or(node).to_owned();
    if json.text("type") == Some("orthographic") {
        notes.push(format!("camera {name:?} is orthographic; only perspective cameras are read"));
        return None;
    }
    let perspective = json.field("perspective");
    let aspect = perspective.number("aspectRatio").unwrap_or(1280.0 / 720.0);
    let yfov = perspective.number("yfov").unwrap_or(0.0);
    if !(0.05..=20.0).contains(&aspect) || !(1e-3..std::f64::consts::PI - 1e-3).contains(&yfov) {
        notes.push(format!("camera {name:?} has no usable field of view or aspect; left out"));
        return None;
    }
    let pose = Pose::of(world);
    let (width, height) =
        if aspect > 1280.0 / 720.0 { (1280.0, 1280.0 / aspect) } else { (720.0 * aspect, 720.0) };
    Some(Camera {
        name,
        position: pose.position,
        target: pose.position + pose.forward,
        up: pose.up,
        fov_deg: (2.0 * ((0.5 * yfov).tan() * aspect).atan()).to_degrees() as f32,
        width: width.round() as u32,
        height: height.round() as u32,
        exposure: 0.0,
        lens: None,
    })
}
