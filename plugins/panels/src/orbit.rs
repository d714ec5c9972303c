//! How a camera moves: about its target, across its picture, along its axis. Plain functions.

use glam::{Quat, Vec3};
use intrados_scene::Camera;

/// Closest that the line of sight may come to `up`, radians.
const POLE: f32 = 0.02;

/// Turns the camera about its target, by angles in radians: to the right about `up`, and upwards.
pub(crate) fn orbit(camera: &Camera, right: f32, upwards: f32) -> Camera {
    let up = camera.up.normalize_or(Vec3::Y);
    let arm = camera.position - camera.target;
    let arm = Quat::from_axis_angle(up, -right) * arm;
    let axis = arm.cross(up).normalize_or(Vec3::X);
    let polar = arm.angle_between(up);
    // Over the pole the picture would turn over.
    let polar_after = (polar - upwards).clamp(POLE, std::f32::consts::PI - POLE);
    let arm = Quat::from_axis_angle(axis, polar - polar_after) * arm;
    Camera { position: camera.target + arm, ..camera.clone() }
}

/// Moves camera and target across the picture, so that what was at the target moves by the share
/// `(x, y)` of the picture's width, down being positive y.
pub(crate) fn pan(camera: &Camera, x: f32, y: f32) -> Camera {
    let [right, up, _] = camera.frame();
    let width = 2.0 * camera.half_extent()[0] * (camera.target - camera.position).length();
    let shift = width * (up * y - right * x);
    Camera { position: camera.position + shift, target: camera.target + shift, ..camera.clone() }
}

/// Takes the camera `factor` times as far from its target. Not nearer than a millimetre, not
/// farther than 100 km.
pub(crate) fn dolly(camera: &Camera, factor: f32) -> Camera {
    let arm = camera.position - camera.target;
    let length = arm.length();
    let wanted = (length * factor).clamp(1e-3, 1e5);
    Camera { position: camera.target + arm * (wanted / length.max(1e-6)), ..camera.clone() }
}

/// The same view of what is at the target, from farther away through a narrower angle (degrees), or
/// the other way round: from very far lines that are parallel look so.
pub(crate) fn narrowed(camera: &Camera, fov_deg: f32) -> Camera {
    let half = |degrees: f32| (0.5 * degrees.to_radians()).tan();
    let arm = (camera.position - camera.target) * (half(camera.fov_deg) / half(fov_deg));
    Camera { position: camera.target + arm, fov_deg, ..camera.clone() }
}

/// The same direction of view, from so far that all of the box is in the picture, with a little air
/// about it, below what covers the share `head` of the picture's height. [`Camera::framing`] where
/// nothing covers it.
pub(crate) fn framed(camera: &Camera, [low, high]: [Vec3; 2], head: f32) -> Camera {
    const AIR: f32 = 1.12;
    let middle = 0.5 * (low + high);
    let ([right, up, forward], [hx, hy]) = (camera.frame(), camera.half_extent());
    // At unit distance: how far below the picture's middle that of its free part lies, and half of
    // the free part's height.
    let (down, free) = (hy * head, hy * (1.0 - head));
    let corner = |k: usize| {
        let end = |i: usize| if k >> i & 1 == 1 { high[i] } else { low[i] };
        Vec3::from_array(std::array::from_fn(end)) - middle
    };
    let needs = |d: Vec3| {
        let ahead = d.dot(forward);
        (d.dot(right).abs() / hx).max((d.dot(up) + down * ahead).abs() / free) - ahead
    };
    let distance = AIR * (0..8).map(|k| needs(corner(k))).fold(1e-3, f32::max);
    let target = middle + down * distance * up;
    Camera { position: target - distance * forward, target, ..camera.clone() }
}

/// The same view with at most `pixels` pixels.
pub(crate) fn resized(camera: &Camera, pixels: u32) -> Camera {
    if camera.width as f32 * camera.height as f32 <= pixels as f32 {
        camera.clone()
    } else {
        scaled(camera, pixels)
    }
}

/// The same view with about `pixels` pixels, be they more or fewer.
pub(crate) fn scaled(camera: &Camera, pixels: u32) -> Camera {
    let scale = (pixels as f32 / (camera.width as f32 * camera.height as f32)).sqrt();
    let side = |n: u32| ((n as f32 * scale) as u32).max(1);
    Camera { width: side(camera.width), height: side(camera.height), ..camera.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            name: String::new(),
            position: Vec3::new(0.0, 1.0, 4.0),
            target: Vec3::new(0.0, 1.0, 0.0),
            up: Vec3::Y,
            fov_deg: 60.0,
            width: 400,
            height: 200,
            exposure: 0.0,
            lens: None,
        }
    }

    #[test]
    fn an_orbit_keeps_the_distance_and_stops_at_the_pole() {
        let quarter = orbit(&camera(), std::f32::consts::FRAC_PI_2, 0.0);
        assert!(
            quarter.position.distance(Vec3::new(-4.0, 1.0, 0.0)) < 1e-5,
            "{}",
            quarter.position
        );
        let above = orbit(&camera(), 0.0, 10.0);
        assert!(((above.position - above.target).length() - 4.0).abs() < 1e-4);
        assert!(above.position.y > 4.9 && above.position.z > 0.0, "{}", above.position);
    }

    #[test]
    fn what_is_at_the_target_stays_as_large_from_far_away() {
        let far = narrowed(&camera(), 1.0);
        let half = |c: &Camera| c.half_extent()[0] * (c.position - c.target).length();
        assert!((half(&far) / half(&camera()) - 1.0).abs() < 1e-4, "{far:?}");
        assert!((far.position - far.target).length() > 100.0);
        assert!(narrowed(&far, 60.0).position.distance(camera().position) < 1e-3);
    }

    #[test]
    fn a_pan_moves_the_target_by_its_share_of_the_picture() {
        let panned = pan(&camera(), 0.25, 0.0);
        // Half the picture's half width to the right of the axis.
        let to_old = camera().target - panned.position;
        let [right, _, forward] = panned.frame();
        assert!(
            (to_old.dot(right) / to_old.dot(forward) / panned.half_extent()[0] - 0.5).abs() < 1e-5
        );
    }

    #[test]
    fn what_is_framed_lies_below_what_covers_the_picture() {
        let [low, high] = [Vec3::new(-1.0, 0.0, -6.0), Vec3::new(1.0, 3.0, 2.0)];
        let from_above = orbit(&camera(), 0.7, 0.5);
        for (camera, head) in [(camera(), 0.1), (camera(), 0.3), (from_above, 0.2)] {
            let seen = framed(&camera, [low, high], head);
            for k in 0..8_usize {
                let end = |i: usize| if k >> i & 1 == 1 { high[i] } else { low[i] };
                let corner = Vec3::from_array(std::array::from_fn(end));
                let at = crate::surface::project(&seen, [400, 200], corner);
                assert!((0.0..400.0).contains(&at.x), "{at}");
                assert!((200.0 * head..200.0).contains(&at.y), "{head}: {at}");
            }
        }
        let (free, framing) = (framed(&camera(), [low, high], 0.0), camera().framing([low, high]));
        assert!(free.position.distance(framing.position) < 1e-4, "{free:?}");
    }

    #[test]
    fn a_small_picture_stays_as_it_is() {
        assert_eq!(resized(&camera(), 80_000), camera());
        let small = resized(&camera(), 20_000);
        assert_eq!((small.width, small.height), (200, 100));
    }
}
