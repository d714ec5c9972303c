//! All pictures that the window can make of a scene, into one folder: each with its legend, and with
//! a name that says what it shows.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use bevy_ecs::prelude::*;
use egui::{Color32, ColorImage, Ui};
use intrados_light::Render;
use intrados_mechanics::plugin::Analyses;
use intrados_scene::{Scene, plugin::CurrentScene};
use intrados_stage::{Job, Jobs, Task, alone, file::file_names};

use crate::{
    Look,
    ct::Ct,
    export::{self, write_png},
    fields::Fields,
    legend::put_under,
    photos::Photos,
    saving::Written,
    scale::Ranges,
    stress::Stress,
    structure::Structure,
};

/// Makes a picture off the frame.
pub(crate) type Drawing = Box<dyn FnOnce() -> ColorImage + Send>;

/// A picture that is to be written.
pub(crate) struct Leaf {
    /// What its file is called, without an ending; English, as all files are.
    pub(crate) name: String,
    /// What it shows, for whoever is sent it.
    pub(crate) what: String,
    /// What its colours mean, where they are no colours of things.
    pub(crate) legend: Option<ColorImage>,
    pub(crate) draw: Drawing,
}

/// Begins to write all of them into a folder; none: there is nothing to be seen yet.
pub(crate) fn begin(
    ui: &Ui,
    world: &mut World,
    folder: PathBuf,
) -> Option<Task<Result<Option<Written>, String>>> {
    let leaves = leaves(ui, world);
    if leaves.is_empty() {
        return None;
    }
    let mut jobs = world.resource_mut::<Jobs>();
    let label = tr!("writing {}", folder.display());
    Some(Task::spawn(jobs.bypass_change_detection(), label, move |job| write(leaves, &folder, job)))
}

/// What each panel has to show of the scene that is open.
fn leaves(ui: &Ui, world: &mut World) -> Vec<Leaf> {
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let Some(scene) = scene else { return Vec::new() };
    let mut leaves = world.resource_scope(|world, mut structure: Mut<Structure>| {
        structure.bypass_change_detection().leaves(ui, world, &scene)
    });
    let look = world.resource::<Look>();
    if let Some(render) = world.get_resource::<Render>() {
        leaves.extend(export::leaves(ui, render, look, world.resource::<Fields>()));
    }
    if let Some(analyses) = world.get_resource::<Analyses>() {
        let (stress, ranges) = (world.resource::<Stress>(), world.resource::<Ranges>());
        leaves.extend(stress.leaf(ui, &scene, analyses, look.colours, ranges));
    }
    leaves.extend(world.resource::<Ct>().leaf(ui, &scene));
    leaves.extend(world.resource::<Photos>().leaves(ui, &scene));
    leaves
}

/// Draws and writes them one after another; none: somebody cancelled it, and those that were
/// written stay.
fn write(leaves: Vec<Leaf>, folder: &Path, job: &Job) -> Result<Option<Written>, String> {
    fs::create_dir_all(folder).map_err(|why| format!("{}: {why}", folder.display()))?;
    let (names, count) = (names(&leaves), leaves.len());
    for (done, (leaf, name)) in leaves.into_iter().zip(names).enumerate() {
        if job.step(done, count).is_err() {
            return Ok(None);
        }
        let path = folder.join(format!("{name}.png"));
        let image = alone(leaf.draw);
        let image = match &leaf.legend {
            Some(legend) => put_under(&image, legend),
            None => image,
        };
        write_png(&image, &path, &leaf.what).map_err(|why| format!("{}: {why}", path.display()))?;
    }
    Ok(Some(Written { files: Some(count), path: folder.to_owned() }))
}

/// What files are called, no two alike.
fn names(leaves: &[Leaf]) -> Vec<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut all = Vec::with_capacity(leaves.len());
    for Leaf { name, .. } in leaves {
        let count = counts.entry(name).or_default();
        *count += 1;
        all.push(if *count == 1 { name.clone() } else { format!("{name} {count}") });
    }
    file_names(&all)
}

/// What a picture of a scene shows, with what it was made of and by what.
pub(crate) fn said(scene: &Scene, what: &str) -> String {
    let what = format!("{}: {what}", scene.name);
    tr!("{}; scene hash {}; Intrados {}", what, scene.hash, env!("CARGO_PKG_VERSION"))
}

/// A picture before a ground: a file has none of its own.
pub(crate) fn on_ground(mut image: ColorImage, ground: Color32) -> ColorImage {
    image.pixels.iter_mut().for_each(|pixel| *pixel = ground.blend(*pixel));
    image
}

/// Draws a line through places (pixels) over a picture, three pixels wide.
pub(crate) fn mark(image: &mut ColorImage, line: &[[f64; 2]], ink: Color32) {
    let [width, height] = image.size;
    for pair in line.windows(2) {
        let [a, b] = pair else { continue };
        let span = [0, 1].map(|k| b[k] - a[k]);
        let steps = span[0].abs().max(span[1].abs()).ceil().clamp(1.0, 1e5);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let [x, y] = [0, 1].map(|k| (a[k] + share * span[k]).round() as i64);
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                let place = |at: i64, most: usize| usize::try_from(at).ok().filter(|at| *at < most);
                if let (Some(x), Some(y)) = (place(x + dx, width), place(y + dy, height)) {
                    image.pixels[y * width + x] = ink;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(name: &str, side: usize) -> Leaf {
        let draw = Box::new(move || ColorImage::filled([side, 2], Color32::RED));
        Leaf { name: name.into(), what: format!("what {name} shows"), legend: None, draw }
    }

    #[test]
    fn all_are_written_under_names_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("deep/views");
        let leaves = vec![leaf("light", 3), leaf("view a/b", 4), leaf("view a/b", 5)];
        let written = write(leaves, &out, &Job::default()).unwrap().unwrap();
        assert_eq!((written.files, written.path.as_path()), (Some(3), out.as_path()));
        let mut widths: Vec<u32> = fs::read_dir(&out)
            .unwrap()
            .map(|entry| image::open(entry.unwrap().path()).unwrap().width())
            .collect();
        widths.sort_unstable();
        assert_eq!(widths, [3, 4, 5]);
        assert!(out.join("light.png").exists());
    }

    #[test]
    fn what_is_cancelled_writes_nothing_more() {
        let folder = tempfile::tempdir().unwrap();
        let job = Job::default();
        job.cancel();
        assert!(write(vec![leaf("light", 3)], folder.path(), &job).unwrap().is_none());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_mark_goes_from_place_to_place_and_never_over_the_rim() {
        let mut image = ColorImage::filled([10, 6], Color32::BLACK);
        mark(&mut image, &[[-5.0, 2.0], [5.0, 2.0], [f64::NAN, 2.0]], Color32::RED);
        let red: Vec<usize> =
            (0..60).filter(|at| image.pixels[*at] == Color32::RED).map(|at| at / 10).collect();
        assert!(red.contains(&1) && red.contains(&3) && !red.contains(&5));
        assert_eq!(image[(5, 2)], Color32::RED);
        assert_eq!(image[(8, 2)], Color32::BLACK);
    }
}
