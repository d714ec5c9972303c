//! glTF and OBJ as sources.

use std::path::Path;

use glam::{DMat4, DVec3};
use intrados_stage::{Access, Job, access};

use super::{
    ImportError,
    source::{Course, Element, Matter, Said, Source, Surface},
};
use crate::{
    LoadError, Material, Mesh, Object, Part, file,
    gltf::{self, Model},
};

/// Longest OBJ file that is read, bytes.
const LONGEST_OBJ: u64 = 1 << 30;

/// A glTF file: the model, and its members and other objects as elements.
pub(super) fn gltf(
    path: &Path,
    told: Option<f64>,
    access: &Access,
    job: &Job,
) -> Result<(Source, Model), ImportError> {
    let metres = told.unwrap_or(1.0);
    let mut model = gltf::import_within(path, access, &job.part(0.0, 0.5))
        .map_err(|e| ImportError::Load(LoadError::of_import(path, e)))?;
    scale(&mut model, metres);
    let mut elements: Vec<Element> = Vec::new();
    let mut known = std::collections::BTreeMap::new();
    for (i, object) in model.objects.iter().enumerate() {
        // All concrete of a member is one element, a bar is one of its own.
        let own = object.member.filter(|_| object.part == Part::Concrete);
        let at = match own.and_then(|member| known.get(&member).copied()) {
            Some(at) => at,
            None => {
                own.map(|member| known.insert(member, elements.len()));
                elements.push(element(&model, i));
                elements.len() - 1
            }
        };
        let Some(element) = elements.get_mut(at) else { continue };
        element.objects.push(i);
        append(&mut element.surface, &model, object);
    }
    for (object, line) in &model.steel {
        let of_it = |e: &&mut Element| e.objects.contains(object);
        if let Some(element) = elements.iter_mut().find(of_it) {
            let line_of = line.line.iter().map(|p| p.as_dvec3()).collect();
            element.courses.push(Course { diameter: f64::from(line.diameter), line: line_of });
        }
    }
    model.steel.clear();
    let source = Source {
        format: "glTF".into(),
        project: path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
        // Which classes are assumed, the scene says that is made of it; and of a size that was
        // doubted in metres nothing is left to say once the unit is told.
        notes: std::mem::take(&mut model.warnings)
            .into_iter()
            .filter(|note| !note.contains(gltf::NO_CLASS))
            .filter(|note| told.is_none() || !note.contains(gltf::NO_UNIT))
            .collect(),
        elements,
        metres_per_unit: metres,
        ..Source::default()
    };
    Ok((source, model))
}

/// In metres, where the file is not.
fn scale(model: &mut Model, metres: f64) {
    #[expect(clippy::float_cmp, reason = "1 is what is written where nothing is to be done")]
    if metres == 1.0 {
        return;
    }
    let matrix = glam::Mat4::from_scale(glam::Vec3::splat(metres as f32));
    model.objects.iter_mut().for_each(|o| o.transform = matrix * o.transform);
    model.members.iter_mut().for_each(|m| {
        m.bounds = m.bounds.map(|b| matrix.transform_point3(b));
        m.volume *= metres.powi(3);
        m.frame = crate::Frame::of_box(m.kind, m.bounds);
    });
    for (_, line) in &mut model.steel {
        line.diameter *= metres as f32;
        line.line.iter_mut().for_each(|p| *p *= metres as f32);
        line.inward *= metres as f32;
    }
    model.cameras.clear();
    model.lamps.clear();
}

/// An object, or the member that it is concrete of.
fn element(model: &Model, index: usize) -> Element {
    let Some(object) = model.objects.get(index) else { return Element::default() };
    let material = model.materials.get(object.material).filter(|m| !m.assumed);
    let materials =
        material.into_iter().map(|m| Matter { name: m.name.clone(), ..Matter::default() });
    let member = object.member.and_then(|m| model.members.get(m));
    let Some(member) = member else {
        return Element {
            id: object.name.clone(),
            name: object.name.clone(),
            materials: materials.collect(),
            ..Element::default()
        };
    };
    let kind = match object.part {
        Part::Bar | Part::Stirrup => crate::MemberKind::Bar,
        Part::Tendon => crate::MemberKind::Tendon,
        Part::Concrete | Part::Scenery => member.kind,
    };
    let stated = member.frame != crate::Frame::of_box(member.kind, member.bounds);
    Element {
        id: member.id.clone(),
        name: if object.part == Part::Concrete { member.name.clone() } else { object.name.clone() },
        materials: materials.collect(),
        said: Some(Said {
            kind,
            part: object.part,
            concrete: (!member.concrete_assumed).then(|| member.concrete.clone()),
            frame: stated.then_some(member.frame),
            member: member.id.clone(),
        }),
        ..Element::default()
    }
}

fn append(surface: &mut Surface, model: &Model, object: &Object) {
    let Some(mesh) = model.meshes.get(object.mesh) else { return };
    let matrix: DMat4 = object.transform.as_dmat4();
    let first = surface.points.len() as u32;
    surface.points.extend(mesh.positions.iter().map(|p| matrix.transform_point3(p.as_dvec3())));
    let mirrored = matrix.determinant() < 0.0;
    surface.triangles.extend(
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }.map(|i| i + first)),
    );
}

/// An OBJ file: its groups are elements.
pub(super) fn obj(path: &Path, metres: f64) -> Result<(Source, Model), ImportError> {
    let bytes = access::read(path, LONGEST_OBJ).map_err(|e| ImportError::denied(path, &e))?;
    let groups =
        file::obj_groups(&path.display().to_string(), &bytes).map_err(ImportError::Load)?;
    let of_group = |(name, mesh): (String, Mesh)| Element {
        id: name.clone(),
        name,
        surface: Surface {
            points: mesh.positions.iter().map(|p| p.as_dvec3() * metres).collect::<Vec<DVec3>>(),
            triangles: mesh.triangles,
        },
        ..Element::default()
    };
    let source = Source {
        format: "OBJ".into(),
        project: path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
        elements: groups.into_iter().map(of_group).collect(),
        metres_per_unit: metres,
        ..Source::default()
    };
    Ok((source, Model::default()))
}

/// Grey concrete, or the colour that the file gives.
pub(super) fn material(colour: Option<glam::Vec3>) -> Material {
    match colour {
        None => Material::default(),
        Some(colour) => Material {
            name: format!("colour {:.2} {:.2} {:.2}", colour.x, colour.y, colour.z),
            assumed: false,
            // Nothing reflects all light, and black paint some.
            base_colour: colour.clamp(glam::Vec3::splat(0.02), glam::Vec3::splat(0.9)),
            ..Material::default()
        },
    }
}
