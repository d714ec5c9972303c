//! All pictures that the window can make of a scene, into one folder: each with its legend, and with
//! a name that says what it shows.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use bevy_ecs::prelude::*;
use egui::Ui;
use intrados_light::Render;
use intrados_mechanics::plugin::Analyses;
use intrados_scene::plugin::CurrentScene;
use intrados_stage::{Job, Jobs, Task, alone, file::file_names};

use crate::{
    Look,
    ct::Ct,
    export::{self, write_png},
    fields::Fields,
    leaf::Leaf,
    legend::put_under,
    photos::Photos,
    saving::Written,
    scale::Ranges,
    stress::Stress,
    structure::Structure,
};

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

#[cfg(test)]
mod tests {
    use egui::{Color32, ColorImage};

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
}
