use glam::{DMat3, DVec3};
use intrados_scene::Lens;
use intrados_stage::random::{Draw, Key};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::*;
use crate::taken::Focal;

const SIZE: [u32; 2] = [4000, 3000];
const PICKING: f64 = 2.0;

fn prior(focal: Option<Focal>) -> Prior {
    Prior { size: SIZE, focal, lens: Lens::default(), k1_error: 0.03, picking_px: PICKING }
}

/// A camera some metres from the origin that looks about at it, its focal length about 3000 px, its
/// lens as it is known to be.
fn planted(draw: &mut Draw) -> Pose {
    let mut any = |low: f64, high: f64| draw.between(low, high);
    let (angle, height, distance) = (any(-1.0, 1.0), any(-0.8, 0.8), any(2.5, 6.0));
    let position = distance * DVec3::new(angle.sin(), height, angle.cos()).normalize();
    let target = DVec3::new(any(-0.2, 0.2), any(-0.2, 0.2), 0.0);
    let forward = (target - position).normalize();
    let right = forward.cross(DVec3::new(any(-0.1, 0.1), 1.0, any(-0.1, 0.1))).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    let lens = Lens { k1: (0.03 * gauss(draw)) as f32, ..Lens::default() };
    Pose::new(position, rotation, 3000.0 * (0.03 * gauss(draw)).exp(), lens, SIZE)
}

/// N(0, 1) by Box and Muller.
fn gauss(draw: &mut Draw) -> f64 {
    (-2.0 * (1.0 - draw.unit()).ln()).sqrt() * (std::f64::consts::TAU * draw.unit()).cos()
}

/// Places as they are drawn, picked with an error; `None` where one is out of the picture.
fn picked(pose: &Pose, places: &[DVec3], noise: f64, draw: &mut Draw) -> Option<Vec<Pick>> {
    let pick = |place: &DVec3| {
        let [x, y] = pose.project(*place)?;
        let pixel = [x + noise * gauss(draw), y + noise * gauss(draw)];
        pose.holds(pixel).then_some(Pick { pixel, place: *place })
    };
    places.iter().map(pick).collect()
}

/// Corners of a face, and of a block behind it.
fn face() -> Vec<DVec3> {
    [[-0.5, -0.8], [0.5, -0.8], [0.5, 0.8], [-0.5, 0.8]].map(|[x, y]| DVec3::new(x, y, 0.0)).into()
}

fn block() -> Vec<DVec3> {
    face().into_iter().chain(face().into_iter().map(|p| p - 0.6 * DVec3::Z)).collect()
}

const KNOWN: Option<Focal> = Some(Focal { px: 3000.0, rel_error: 0.03 });

/// (found − planted) in what is unknown of a pose.
fn off(found: &Pose, planted: &Pose) -> [f64; UNKNOWNS] {
    let turn = found.rotation * planted.rotation.transpose();
    let turn = glam::DQuat::from_mat3(&turn).to_scaled_axis();
    let shift = found.position - planted.position;
    let focal = (found.focal_px / planted.focal_px).ln();
    let k1 = f64::from(found.lens.k1) - f64::from(planted.lens.k1);
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, focal, k1]
}

#[test]
fn slopes_are_those_of_differences() {
    for seed in 0..50 {
        let mut draw = Draw::new(Key::new(21, seed));
        let pose = planted(&mut draw);
        let place = DVec3::new(draw.between(-0.5, 0.5), draw.between(-0.5, 0.5), 0.2);
        let (_, slopes) = pose.slopes(place).unwrap();
        for k in 0..UNKNOWNS {
            let h = if k == 7 { 1e-3 } else { 1e-5 };
            let [to, from] = [h, -h].map(|h| {
                let mut step = [0.0; UNKNOWNS];
                step[k] = h;
                pose.moved(&step).project(place).unwrap()
            });
            for i in 0..2 {
                let slope = (to[i] - from[i]) / (2.0 * h);
                let scale = 1.0 + slopes.column(k).norm();
                assert!((slopes[(i, k)] - slope).abs() < 2e-4 * scale, "{k}: {slope}");
            }
        }
    }
}

#[test]
fn a_pose_is_a_camera_and_back() {
    let pose = planted(&mut Draw::new(Key::new(22, 0)));
    let again = Pose::of(&pose.camera("eye"));
    for place in block() {
        let [a, b] = [&pose, &again].map(|p| p.project(place).unwrap());
        let by_camera = pose.camera("eye").project(place).unwrap();
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.01, "{a:?} {b:?}");
        assert!((a[0] - by_camera[0]).hypot(a[1] - by_camera[1]) < 0.01, "{a:?} {by_camera:?}");
        let ray = pose.ray(a).unwrap();
        assert!(ray.cross((place - pose.position).normalize()).length() < 1e-9);
    }
}

/// Over hundreds of planted cameras the error of all that is unknown, weighed by the covariance, is
/// χ² of eight degrees of freedom: 95 % lie within its 95 % quantile, or some more, since residuals
/// that are large by chance widen the covariance and small ones do not narrow it.
#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let quantile = ChiSquared::new(8.0).unwrap().inverse_cdf(0.95);
    let six_of_block: Vec<DVec3> = block().into_iter().take(6).collect();
    let all: Vec<DVec3> = block();
    for (name, places, focal) in
        [("six", &six_of_block, KNOWN), ("eight", &all, KNOWN), ("eight, no focal", &all, None)]
    {
        let (mut within, mut far, mut count) = (0, 0, 0);
        for seed in 0..400 {
            let mut draw = Draw::new(Key::new(23, seed));
            let truth = planted(&mut draw);
            let Some(picks) = picked(&truth, places, PICKING, &mut draw) else { continue };
            // Picks of a far camera that leave the focal length open are refused, and say so.
            let found = match locate(&picks, &prior(focal), &|_| true) {
                Ok(found) => found,
                Err(PoseError::Open { .. }) if focal.is_none() => continue,
                Err(error) => panic!("{name} {seed}: {error}"),
            };
            let error = nalgebra::SVector::from(off(&found.pose, &truth));
            let chi2 = (error.transpose() * found.covariance.try_inverse().unwrap() * error)[0];
            count += 1;
            within += u32::from(chi2 < quantile);
            let sigma = found.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
            far += u32::from(found.pose.position.distance(truth.position) > 3.0 * sigma);
        }
        let share = f64::from(within) / f64::from(count);
        assert!(count >= 250, "{name}: {count}");
        assert!((0.92..=0.995).contains(&share), "{name}: {share} of {count} within 95 %");
        assert!(f64::from(far) < 0.015 * f64::from(count), "{name}: {far} beyond 3 σ");
    }
}

/// Four corners of a face: the planted pose is found, or is the other one that is told.
#[test]
fn four_corners_of_a_face_are_enough_with_a_focal_length() {
    let (mut first, mut second, mut count) = (0, 0, 0);
    for seed in 0..300 {
        let mut draw = Draw::new(Key::new(24, seed));
        let truth = planted(&mut draw);
        let Some(picks) = picked(&truth, &face(), PICKING, &mut draw) else { continue };
        let found = locate(&picks, &prior(KNOWN), &|_| true).unwrap();
        count += 1;
        let sigma = found.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        let near = |pose: &Pose| pose.position.distance(truth.position) < 4.0 * sigma;
        if near(&found.pose) {
            first += 1;
        } else if found.other.is_some_and(|other| near(&other)) {
            second += 1;
        }
    }
    assert!(count > 200 && first * 100 >= 95 * count, "{first} of {count}");
    assert!((first + second) * 100 >= 98 * count, "{first} and {second} of {count}");
}

/// A small face from far away is seen as well from its other side: both poses are told.
#[test]
fn a_small_face_from_far_away_has_two_poses() {
    let mut told = 0;
    for seed in 0..50 {
        let mut draw = Draw::new(Key::new(25, seed));
        let truth = planted(&mut draw);
        let small: Vec<DVec3> = face().into_iter().map(|p| 0.1 * p).collect();
        let Some(picks) = picked(&truth, &small, PICKING, &mut draw) else { continue };
        let found = locate(&picks, &prior(KNOWN), &|_| true);
        told += u32::from(found.is_ok_and(|found| found.other.is_some()));
    }
    assert!(told >= 25, "{told}");
}

#[test]
fn one_wrong_pick_of_seven_is_left_out() {
    let (mut found_out, mut count) = (0, 0);
    for seed in 0..100 {
        let mut draw = Draw::new(Key::new(26, seed));
        let truth = planted(&mut draw);
        let Some(mut picks) = picked(&truth, &block()[..7], PICKING, &mut draw) else { continue };
        let wrong = (draw.unit() * 7.0) as usize;
        picks[wrong].pixel[0] = (picks[wrong].pixel[0] + 700.0) % 4000.0;
        count += 1;
        if let Ok(found) = locate(&picks, &prior(KNOWN), &|_| true) {
            assert_eq!(found.left_out, Some(wrong), "{seed}");
            assert!(found.pose.position.distance(truth.position) < 0.1 * truth.position.length());
            found_out += 1;
        }
    }
    assert!(count > 60 && found_out * 10 >= 9 * count, "{found_out} of {count}");
}

/// Picks that have nothing to do with the places, and picks of mirrored corners that are no plane.
#[test]
fn what_no_camera_sees_is_refused_with_its_residual() {
    let (mut passed, mut mirrored) = (0, 0);
    for seed in 0..100 {
        let mut draw = Draw::new(Key::new(27, seed));
        let truth = planted(&mut draw);
        let mut pixel = || [draw.between(0.0, 4000.0), draw.between(0.0, 3000.0)];
        let any: Vec<Pick> =
            block()[..5].iter().map(|place| Pick { pixel: pixel(), place: *place }).collect();
        passed += u32::from(locate(&any, &prior(KNOWN), &|_| true).is_ok());
        let Some(mut picks) = picked(&truth, &block(), PICKING, &mut draw) else { continue };
        let turned: Vec<[f64; 2]> = [1, 0, 3, 2, 5, 4, 7, 6].map(|i: usize| picks[i].pixel).into();
        picks.iter_mut().zip(turned).for_each(|(pick, pixel)| pick.pixel = pixel);
        match locate(&picks, &prior(KNOWN), &|_| true) {
            Err(PoseError::NoFit { rms_px, .. }) => assert!(rms_px > 6.0),
            _ => mirrored += 1,
        }
    }
    assert!(passed <= 1 && mirrored == 0, "{passed} {mirrored}");
}

#[test]
fn picks_that_say_too_little_are_refused() {
    let truth = planted(&mut Draw::new(Key::new(28, 1)));
    let mut draw = Draw::new(Key::new(28, 2));
    let picks = picked(&truth, &block(), 0.0, &mut draw).unwrap();
    let refused = |picks: &[Pick], focal| locate(picks, &prior(focal), &|_| true).unwrap_err();
    assert!(matches!(refused(&picks[..3], KNOWN), PoseError::TooFew { needed: 4, .. }));
    assert!(matches!(refused(&picks[..5], None), PoseError::TooFew { needed: 6, .. }));
    let line: Vec<DVec3> = (0..6).map(|i| DVec3::X * f64::from(i) * 0.2).collect();
    let line = picked(&truth, &line, 0.0, &mut draw).unwrap();
    assert!(matches!(refused(&line, KNOWN), PoseError::Degenerate(_)));
    let mut twice = picks.clone();
    twice[3] = twice[1];
    assert!(matches!(refused(&twice, KNOWN), PoseError::Pick(4, _)));
    let mut outside = picks.clone();
    outside[2].pixel[0] = f64::NAN;
    assert!(matches!(refused(&outside, KNOWN), PoseError::Pick(3, _)));
    outside[2] = Pick { place: DVec3::new(0.0, f64::INFINITY, 0.0), ..picks[2] };
    assert!(matches!(refused(&outside, KNOWN), PoseError::Pick(3, _)));
    let many = vec![picks[0]; 101];
    assert_eq!(refused(&many, KNOWN), PoseError::TooMany(101));
    let nowhere = locate(&picks, &prior(KNOWN), &|_| false).unwrap_err();
    assert_eq!(nowhere, PoseError::Hidden);
}
