//! The lamps of a scene, and the scene lit by each alone.

use std::sync::Arc;

use glam::Vec3;
use intrados_scene::{LampKind, Mesh, Object, Part, Scene};

/// Lamps that are surfaces are told apart up to so many; of more, those of one material are one.
const MOST_SINGLE: usize = 12;

/// A lamp that may burn alone.
#[derive(Debug, Clone)]
pub(super) struct Source {
    /// For people.
    pub(super) name: String,
    /// Objects that shine.
    objects: Vec<usize>,
    /// Index among the scene's lamps that are no surfaces.
    beam: Option<usize>,
}

/// All lamps of a scene: surfaces first.
pub(super) fn of(scene: &Scene) -> Vec<Source> {
    let shines = |o: &Object| scene.materials[o.material].emission.max_element() > 0.0;
    let shining = scene.objects.iter().enumerate().filter(|(_, o)| shines(o));
    let single =
        |(i, o): (usize, &Object)| Source { name: o.name.clone(), objects: vec![i], beam: None };
    let mut sources: Vec<Source> = shining.map(single).collect();
    if sources.len() > MOST_SINGLE {
        sources = by_material(scene, sources);
    }
    let beam = |(i, lamp): (usize, &intrados_scene::Lamp)| Source {
        name: lamp.name.clone(),
        objects: Vec::new(),
        beam: Some(i),
    };
    sources.extend(scene.lamps.iter().enumerate().map(beam));
    sources
}

fn by_material(scene: &Scene, sources: Vec<Source>) -> Vec<Source> {
    let mut merged: Vec<(usize, Source)> = Vec::new();
    for source in sources {
        let material = scene.objects[source.objects[0]].material;
        match merged.iter_mut().find(|(m, _)| *m == material) {
            Some((_, known)) => known.objects.extend(source.objects),
            None => merged.push((material, source)),
        }
    }
    merged
        .into_iter()
        .map(|(_, mut source)| {
            if source.objects.len() > 1 {
                source.name += &format!(" and {} like it", source.objects.len() - 1);
            }
            source
        })
        .collect()
}

/// A scene every object of which has a material of its own, its members evenly coloured: what is
/// drawn on them is what a photograph is asked for.
pub(super) fn evened(scene: &Scene) -> Scene {
    let mut even = scene.clone();
    even.materials = Vec::with_capacity(scene.objects.len());
    for (i, object) in scene.objects.iter().enumerate() {
        let mut material = scene.materials[object.material].clone();
        if object.part == Part::Concrete {
            let texture = material.base_texture.take();
            let texture = texture.and_then(|t| scene.textures.get(t.texture));
            material.base_colour *= texture.map_or(Vec3::ONE, |t| mean(&t.texels));
            material.normal_texture = None;
            material.finish = None;
            let mesh = &scene.meshes[object.mesh];
            if !mesh.colours.is_empty() {
                material.base_colour *= mean(&mesh.colours);
                even.objects[i].mesh = even.meshes.len();
                even.meshes.push(Arc::new(Mesh { colours: Vec::new(), ..(**mesh).clone() }));
            }
        }
        even.objects[i].material = i;
        even.materials.push(material);
    }
    even
}

fn mean(colours: &[Vec3]) -> Vec3 {
    colours.iter().sum::<Vec3>() / colours.len().max(1) as f32
}

/// An [evened] scene with one lamp burning, as brightly as the scene says.
pub(super) fn alone(even: &Scene, source: &Source) -> Scene {
    let mut dark = even.clone();
    for (i, object) in even.objects.iter().enumerate() {
        if !source.objects.contains(&i) {
            dark.materials[object.material].emission = Vec3::ZERO;
        }
    }
    let beam = source.beam.and_then(|i| even.lamps.get(i));
    dark.lamps = beam.cloned().into_iter().collect();
    dark
}

/// An [evened] scene whose lamps burn as brightly as was found, by source; those of which nothing
/// is known do not.
pub(super) fn burning(even: &Scene, sources: &[(Source, Vec3)]) -> Scene {
    let mut lit = even.clone();
    let of = |is_it: &dyn Fn(&Source) -> bool| {
        sources.iter().find(|(source, _)| is_it(source)).map_or(Vec3::ZERO, |(_, by)| *by)
    };
    for (i, object) in even.objects.iter().enumerate() {
        lit.materials[object.material].emission *= of(&|source| source.objects.contains(&i));
    }
    for (i, lamp) in lit.lamps.iter_mut().enumerate() {
        let by = of(&|source| source.beam == Some(i));
        match &mut lamp.kind {
            LampKind::Point { intensity, .. } | LampKind::Spot { intensity, .. } => {
                *intensity *= by
            }
            LampKind::Directional { irradiance, .. } => *irradiance *= by,
            LampKind::Environment { radiance, .. } => *radiance *= by,
        }
    }
    lit
}
