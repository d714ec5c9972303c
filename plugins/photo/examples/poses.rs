//! How far off the poses of photographs of planted members are, by picks alone and by the model's
//! edges: `cargo run --release -p intrados-photo --example poses -- OUT`, OUT being a folder that
//! `plugins/experiments/peers/members.py` wrote.

use std::{error::Error, fs, path::PathBuf};

use glam::DVec3;
use intrados_photo::{Located, Photograph, Prior, Site, by_edges, locate, picks};
use intrados_scene::{Lens, Scene};
use intrados_stage::Job;
use serde::Deserialize;

/// From the camera to the front, m.
const DISTANCE_M: f64 = 0.9;

#[derive(Deserialize)]
struct Truth {
    light: String,
    position: [f64; 3],
}

/// How far off a pose is, as a share of the distance and in its own standard errors (χ² of three).
fn wrong(located: &Located, truth: &Truth) -> Option<(f64, f64)> {
    let off = located.pose.position - DVec3::from_array(truth.position);
    let known = located.covariance.fixed_view::<3, 3>(3, 3).try_inverse()?;
    let off_by = nalgebra::Vector3::from(off.to_array());
    Some((off.length() / DISTANCE_M, (off_by.transpose() * known * off_by)[0]))
}

#[allow(clippy::print_stdout, reason = "its only output")]
fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(std::env::args().nth(1).ok_or("name the folder of members.py")?);
    let mut folders: Vec<PathBuf> =
        fs::read_dir(out)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    folders.retain(|folder| folder.join("truth.json").exists());
    folders.sort_by_key(|f| f.file_name().and_then(|n| n.to_str()?.parse::<u32>().ok()));
    let mut all = [Vec::new(), Vec::new()];
    for folder in folders {
        let truth: Truth = serde_json::from_slice(&fs::read(folder.join("truth.json"))?)?;
        let job = Job::default();
        let scene = Scene::open(&folder.join("scene.ron"), &job)?;
        let site = Site::new(&scene, &job)?;
        let photograph = Photograph::open(&folder.join("photo.jpg"))?;
        let table = picks::read(&folder.join("picks.csv"), &scene, &site)?;
        let picks = table.of("photo.jpg", true, &photograph);
        let focal = photograph.taken.focal(photograph.size);
        let lens = Lens::default();
        let prior = Prior { size: photograph.size, focal, lens, k1_error: 0.05, picking_px: 2.0 };
        let picked = locate(&picks, &prior, &|pose| site.admits(pose, &picks))?;
        let better = by_edges(picked.clone(), &photograph, &site, &picks);
        let said = [&picked, &better].map(|located| wrong(located, &truth).unwrap_or_default());
        for (list, said) in all.iter_mut().zip(said) {
            list.push(said);
        }
        let [(a, x), (b, y)] = said;
        println!(
            "{} {}: {:.2} % (χ² {x:.1}) by picks, {:.2} % (χ² {y:.1}) by edges; {:?}",
            folder.display(),
            truth.light,
            100.0 * a,
            100.0 * b,
            better.edges
        );
    }
    for (name, mut list) in ["picks", "edges"].into_iter().zip(all) {
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        let within = list.iter().filter(|(share, _)| *share <= 0.01).count();
        // 95 % of χ² of three.
        let held = list.iter().filter(|(_, chi2)| *chi2 < 7.81).count();
        println!(
            "{name}: median {:.2} %, within 1 % in {within} of {}, worst {:.2} %; within the 95 % region in {held}",
            100.0 * list[list.len() / 2].0,
            list.len(),
            100.0 * list[list.len() - 1].0,
        );
    }
    Ok(())
}
