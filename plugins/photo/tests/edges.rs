//! Poses by the model's edges, of a picture drawn from a known pose.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec3, Vec3};
use image::{Rgb, RgbImage};
use intrados_photo::{
    Located, Photograph, Pick, Pose, Prior, Site, by_edges, locate, taken::Focal,
};
use intrados_scene::{Camera, Lens, Scene};
use intrados_stage::{Job, random::Key};

const SIZE: [u32; 2] = [900, 700];
/// Rays of a pixel each way.
const FINE: u32 = 3;
const PICKING_PX: f64 = 1.5;

fn camera() -> Pose {
    Pose::of(&Camera {
        name: "eye".into(),
        position: Vec3::new(3.4, 1.7, 4.4),
        target: Vec3::new(1.2, 1.5, 0.6),
        up: Vec3::Y,
        fov_deg: 60.0,
        width: SIZE[0],
        height: SIZE[1],
        exposure: 0.0,
        lens: Some(Lens { k1: -0.06, ..Lens::default() }),
    })
}

/// The bundled columns from there: each face as bright as it looks to the light, all else dark,
/// with noise of two levels of 255.
fn photograph(site: &Site, pose: &Pose) -> Photograph {
    let fine = |x: u32, y: u32| (0..FINE * FINE).map(move |k| [x, y, k % FINE, k / FINE]);
    let pixels: Vec<[f64; 2]> = (0..SIZE[1])
        .flat_map(|y| (0..SIZE[0]).flat_map(move |x| fine(x, y)))
        .map(|[x, y, i, j]| {
            let at = |n: u32, k: u32| f64::from(n) + (f64::from(k) + 0.5) / f64::from(FINE);
            [at(x, i), at(y, j)]
        })
        .collect();
    let to_light = DVec3::new(0.3, 0.5, 0.8);
    let light: Vec<f64> = site
        .sights(pose, &pixels)
        .iter()
        .map(|s| s.map_or(0.08, |s| 0.2 + 0.4 * s.normal.dot(to_light).max(0.0)))
        .collect();
    let picture = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let n = (FINE * FINE) as usize;
        let first = n * (y * SIZE[0] + x) as usize;
        let mean = light[first..first + n].iter().sum::<f64>() / n as f64;
        let level = f64::from(intrados_photo::picture::srgb(mean as f32));
        let noise = 2.0 * Key::new(31, first as u64).normal(0);
        Rgb([(level + noise).clamp(0.0, 255.0).round() as u8; 3])
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("photo.png");
    picture.save(&path).unwrap();
    Photograph::open(&path).unwrap()
}

/// Corners that the camera sees, picked with an error.
fn picks(scene: &Scene, site: &Site, pose: &Pose, seed: u64) -> Vec<Pick> {
    let corners = (0..scene.members.len())
        .filter(|&m| scene.members[m].id != "C3")
        .flat_map(|m| site.surface(m).unwrap().outline().corners);
    let pick = |(i, place): (usize, DVec3)| {
        let [x, y] = pose.project(place).filter(|at| pose.holds(*at))?;
        let exact = Pick { pixel: [x, y], place };
        let noise = |k: u32| PICKING_PX * Key::new(seed, i as u64).normal(2 * k);
        let pixel = [x + noise(0), y + noise(1)];
        (site.admits(pose, &[exact]) && pose.holds(pixel)).then_some(Pick { pixel, place })
    };
    corners.enumerate().filter_map(pick).collect()
}

fn picked(site: &Site, pose: &Pose, picks: &[Pick]) -> Located {
    let focal = Some(Focal { px: 1.02 * pose.focal_px, rel_error: 0.03 });
    let lens = Lens { k1: -0.04, ..Lens::default() };
    let prior = Prior { size: SIZE, focal, lens, k1_error: 0.03, picking_px: PICKING_PX };
    locate(picks, &prior, &|pose| site.admits(pose, picks)).unwrap()
}

/// Squared error of the place in its own standard errors.
fn chi2(located: &Located, truth: &Pose) -> f64 {
    let off = nalgebra::Vector3::from((located.pose.position - truth.position).to_array());
    let known = located.covariance.fixed_view::<3, 3>(3, 3).try_inverse().unwrap();
    (off.transpose() * known * off)[0]
}

/// Over twenty sets of picks edges leave less than half of the error, and it is as large as it says.
#[test]
fn edges_bring_a_picked_pose_nearer_to_the_truth() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let truth = camera();
    let photograph = photograph(&site, &truth);
    let (mut before, mut after, mut held) = (Vec::new(), Vec::new(), 0);
    for seed in 0..20 {
        let picks = picks(&scene, &site, &truth, 100 + seed);
        let by_picks = picked(&site, &truth, &picks);
        let by_edges = by_edges(by_picks.clone(), &photograph, &site, &picks);
        let by = by_edges.edges.unwrap();
        assert!(by.kept.is_none() && by.answered >= 6 && by.off_px < 0.3, "{seed}: {by:?}");
        before.push(by_picks.pose.position.distance(truth.position));
        after.push(by_edges.pose.position.distance(truth.position));
        // 95 % of χ² of three.
        held += u32::from(chi2(&by_edges, &truth) < 7.81);
    }
    let [before, after] = [before, after].map(|mut list| {
        list.sort_by(f64::total_cmp);
        list[list.len() / 2]
    });
    assert!(after < before / 2.0, "{before} m by picks, {after} m by edges");
    assert!(held >= 18, "{held} of 20");
}

/// Where nothing is to be seen, or another picture than the picks are of, their pose stays.
#[test]
fn a_picked_pose_is_kept_where_edges_do_not_answer() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let truth = camera();
    let picks = picks(&scene, &site, &truth, 7);
    let by_picks = picked(&site, &truth, &picks);
    let elsewhere = truth.camera("eye");
    let elsewhere = Pose::of(&Camera { fov_deg: elsewhere.fov_deg + 12.0, ..elsewhere });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grey.png");
    let grey = |x: u32, y: u32| {
        let level = 120.0 + 6.0 * Key::new(32, u64::from(y * SIZE[0] + x)).normal(0);
        Rgb([level.round() as u8; 3])
    };
    RgbImage::from_fn(SIZE[0], SIZE[1], grey).save(&path).unwrap();
    for photograph in [Photograph::open(&path).unwrap(), photograph(&site, &elsewhere)] {
        let kept = by_edges(by_picks.clone(), &photograph, &site, &picks);
        assert!(kept.edges.unwrap().kept.is_some(), "{:?}", kept.edges);
        assert_eq!(Located { edges: None, ..kept }, by_picks);
    }
}
