//! glTF and OBJ as sources.

use std::path::Path;

use glam::{DMat3, DMat4, DVec3};
use intrados_stage::{Access, Job, access};

use super::{
    ImportError, Told, UpAxis,
    source::{Course, Element, Matter, Said, Source, Surface},
};
use crate::{
    LoadError, Material, Object, Part, file,
    gltf::{self, Model},
};

/// Longest OBJ file that is read, bytes.
const LONGEST_OBJ: u64 = 1 << 30;

/// A glTF file: the model, and its members and other objects as elements.
pub(super) fn gltf(
    path: &Path,
    told: &Told,
    access: &Access,
    job: &Job,
) -> Result<(Source, Model), ImportError> {
    let metres = told.metres.unwrap_or(1.0);
    let to_ours = to_ours(told);
    let (mut model, moved) = gltf::import_near(path, metres, access, &job.part(0.0, 0.5))
        .map_err(|e| ImportError::Load(LoadError::of_import(path, e)))?;
    turn(&mut model, to_ours, metres);
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
            .filter(|note| !note.contains(gltf::NO_CLASS) && !note.contains(gltf::NO_MEMBERS))
            .filter(|note| told.metres.is_none() || !note.contains(gltf::NO_UNIT))
            .collect(),
        elements,
        metres_per_unit: metres,
        moved: to_ours * moved,
        ..Source::default()
    };
    Ok((source, model))
}

/// From the file's coordinates to ours: m, y up.
fn to_ours(told: &Told) -> DMat3 {
    let turn = match told.up.unwrap_or_default() {
        UpAxis::Y => DMat3::IDENTITY,
        UpAxis::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    };
    told.metres.unwrap_or(1.0) * turn
}

/// In metres and with y up, where the file is not.
fn turn(model: &mut Model, to_ours: DMat3, metres: f64) {
    if to_ours == DMat3::IDENTITY {
        return;
    }
    let matrix = DMat4::from_mat3(to_ours).as_mat4();
    model.objects.iter_mut().for_each(|o| o.transform = matrix * o.transform);
    model.members.iter_mut().for_each(|m| {
        let [a, b] = m.bounds.map(|b| matrix.transform_point3(b));
        m.bounds = [a.min(b), a.max(b)];
        m.volume *= metres.powi(3);
        m.frame = crate::Frame::of_box(m.kind, m.bounds);
    });
    for (_, line) in &mut model.steel {
        line.diameter *= metres as f32;
        line.line.iter_mut().for_each(|p| *p = matrix.transform_point3(*p));
        line.inward = matrix.transform_vector3(line.inward);
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

/// An OBJ file: its objects and groups are elements.
pub(super) fn obj(path: &Path, told: &Told) -> Result<(Source, Model), ImportError> {
    let bytes = access::read(path, LONGEST_OBJ).map_err(|e| ImportError::denied(path, &e))?;
    let read =
        file::read_obj_parts(&path.display().to_string(), &bytes).map_err(ImportError::Load)?;
    let to_ours = to_ours(told);
    let element = |part: file::ObjPart| Element {
        id: part.name.clone(),
        name: part.name,
        words: part.words,
        materials: (part.materials.into_iter())
            .map(|name| Matter { name, ..Matter::default() })
            .collect(),
        surface: Surface {
            points: part.points.iter().map(|p| to_ours * *p).collect(),
            triangles: part.triangles,
        },
        ..Element::default()
    };
    let source = Source {
        format: "OBJ".into(),
        project: path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
        elements: read.parts.into_iter().map(element).collect(),
        metres_per_unit: told.metres.unwrap_or(1.0),
        // Of a unit that is given nothing is to be said.
        notes: (read.notes.into_iter())
            .filter(|note| told.metres.is_none() || !note.contains("give --unit"))
            .collect(),
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
