//! Parametric members to meshes: closed concrete outlines, and bars, stirrups and tendons as
//! objects of their own inside.
//!
//! Everything is built in the member's own frame (x towards angle 0, y towards angle 90, z along
//! the axis) and placed by a transform, so that stirrups, hoops and segments of one shape share a
//! mesh.

mod fitted;
mod lines;
pub(crate) mod solid;
mod steel;
mod surface;

use std::{
    f32::consts::{PI, TAU},
    io,
    path::Path,
    sync::Arc,
};

use glam::{Mat4, Quat, Vec2, Vec3};
use intrados_stage::Job;

use crate::{
    Frame, LoadError, Material, Member, MemberKind, Mesh, Object, Part, Scene, Surface, file, gltf,
    structure::{
        ASSUMED_CONCRETE, Body, BoxSection, InnerLining, Reinforcement, Section, Segments, Tendon,
    },
};
use steel::{Cage, Outline, span};

pub(crate) use fitted::{Triangle, lines_in};
pub(crate) use lines::{lines_of, steel_lines};
pub(crate) use surface::surface_meter;

/// A scene file to start from, with comments: `column`, `beam` or `tunnel`.
#[must_use]
pub fn template(kind: &str) -> Option<&'static str> {
    Some(match kind {
        "column" => include_str!("templates/column.ron"),
        "beam" => include_str!("templates/beam.ron"),
        "tunnel" => include_str!("templates/tunnel.ron"),
        _ => return None,
    })
}

/// Evidence to go with a [`template`] that is written as the scene `name`: one example of every
/// kind as comments, so that nothing is said yet.
#[must_use]
pub fn evidence_template(kind: &str, name: &str) -> Option<String> {
    let id = match kind {
        "column" => "C1",
        "beam" => "B1",
        "tunnel" => "T1",
        _ => return None,
    };
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    Some(file::evidence::beside(&name.chars().map(plain).collect::<String>(), id))
}

/// Writes a scene as GLB, its members in `extras.intrados`: concrete, bars, stirrups and tendons
/// are nodes of their own.
///
/// # Errors
/// As [`gltf::write_glb`].
pub fn write_glb(path: &Path, scene: &Scene) -> io::Result<()> {
    gltf::write_glb(path, &gltf::Model::from(scene))
}

/// Bare steel, for bars, stirrups and tendons.
pub(crate) fn steel() -> Material {
    Material {
        name: "steel".into(),
        assumed: false,
        surface: Surface::Metallic { metallic: 1.0, roughness: 0.5, texture: None },
        base_colour: Vec3::new(0.42, 0.38, 0.35),
        ..Material::default()
    }
}

/// The frame of a parametric member.
pub(crate) fn frame(member: &file::Member) -> Frame {
    let (axis, zero) = match member.body {
        Body::Column { height_m, .. } => (Vec3::Y * height_m, Vec3::Z),
        Body::Beam { length_m, .. } | Body::BoxGirder { length_m, .. } => {
            (Vec3::X * length_m, Vec3::Y)
        }
        Body::Tunnel { length_m, .. } => (Vec3::Z * length_m, Vec3::X),
    };
    let turn = Quat::from_rotation_y(member.turn_deg.to_radians());
    Frame { start: member.at, axis: turn * axis, zero: turn * zero }
}

/// From a member's own coordinates (x towards angle 0, y towards 90, z along the axis) to the
/// world.
fn placement(frame: Frame) -> Mat4 {
    let along = frame.axis.normalize_or_zero();
    Mat4::from_cols(
        frame.zero.extend(0.0),
        frame.ninety().extend(0.0),
        along.extend(0.0),
        frame.start.extend(1.0),
    )
}

/// Adds a member, or a tunnel's lining and segments, with all their parts. `concrete` and `steel`
/// are materials of the scene.
pub(crate) fn add(
    scene: &mut Scene,
    member: &file::Member,
    concrete: usize,
    steel: usize,
    job: &Job,
) -> Result<(), LoadError> {
    let frame = frame(member);
    let mut builder =
        Builder { scene, member, frame, placement: placement(frame), concrete, steel, job };
    match &member.body {
        Body::Column { section, height_m, reinforcement } => {
            builder.bar_shaped(MemberKind::Column, section, *height_m, reinforcement.as_ref(), &[])
        }
        Body::Beam { section, length_m, reinforcement, tendons } => builder.bar_shaped(
            MemberKind::Beam,
            section,
            *length_m,
            reinforcement.as_ref(),
            tendons,
        ),
        Body::BoxGirder { section, length_m, reinforcement, tendons } => {
            let outline = Outline::girder(section);
            let (mesh, area) = girder(section, *length_m);
            builder.prism(
                MemberKind::Beam,
                mesh,
                area,
                outline,
                *length_m,
                reinforcement.as_ref(),
                tendons,
            )
        }
        Body::Tunnel { radius_m, length_m, segments, cushion_mm, inner_lining, .. } => {
            let mut radius = *radius_m;
            if let Some(lining) = inner_lining {
                builder.inner_lining(lining, radius, *length_m)?;
                radius += lining.thickness_m + cushion_mm / 1000.0;
            }
            match segments {
                Some(segments) => builder.segments(segments, radius, *length_m),
                None => Ok(()),
            }
        }
    }
}

/// A box girder's mesh, and the area of its section.
fn girder(s: &BoxSection, length: f32) -> (Mesh, f64) {
    let (half, cell) = (0.5 * s.depth_m, 0.5 * s.bottom_width_m - s.web_m);
    let xs = [-half, s.bottom_m - half, half - s.top_m, half];
    let mut ys = vec![
        -0.5 * s.top_width_m,
        -0.5 * s.bottom_width_m,
        -cell,
        cell,
        0.5 * s.bottom_width_m,
        0.5 * s.top_width_m,
    ];
    // A top slab as wide as the box has no flanges.
    ys.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    let filled = |i: usize, j: usize| {
        let y = 0.5 * (ys[j] + ys[j + 1]).abs();
        i == 2 || (y < 0.5 * s.bottom_width_m && (i == 0 || y > cell))
    };
    let mesh = solid::cells(&xs, &ys, filled, length);
    let [top, bottom, web] = [
        s.top_width_m * s.top_m,
        s.bottom_width_m * s.bottom_m,
        2.0 * s.web_m * (s.depth_m - s.top_m - s.bottom_m),
    ];
    (mesh, f64::from(top) + f64::from(bottom) + f64::from(web))
}

struct Builder<'a> {
    scene: &'a mut Scene,
    member: &'a file::Member,
    frame: Frame,
    placement: Mat4,
    concrete: usize,
    steel: usize,
    job: &'a Job,
}

impl Builder<'_> {
    fn mesh(&mut self, mesh: Mesh) -> usize {
        self.scene.meshes.push(Arc::new(mesh));
        self.scene.meshes.len() - 1
    }

    /// Enters a member; its bounds are measured when all is built.
    fn enter(
        &mut self,
        id: String,
        name: String,
        kind: MemberKind,
        frame: Frame,
        volume: f64,
        class: Option<&str>,
    ) -> usize {
        self.scene.members.push(Member {
            id,
            name,
            kind,
            concrete: class.unwrap_or(ASSUMED_CONCRETE).into(),
            concrete_assumed: class.is_none(),
            exposure: self.member.exposure.clone(),
            frame,
            bounds: [Vec3::ZERO; 2],
            volume,
            slices: Vec::new(),
            truth: Vec::new(),
        });
        self.scene.members.len() - 1
    }

    fn own(&mut self, kind: MemberKind, volume: f64) -> usize {
        let member = self.member;
        let name = if member.name.trim().is_empty() { &member.id } else { &member.name };
        self.enter(
            member.id.clone(),
            name.clone(),
            kind,
            self.frame,
            volume,
            member.concrete.as_deref(),
        )
    }

    fn place(&mut self, name: String, mesh: usize, local: Mat4, member: usize, part: Part) {
        let material = if part == Part::Concrete { self.concrete } else { self.steel };
        let transform = self.placement * local;
        self.scene.objects.push(Object {
            name,
            mesh,
            transform,
            material,
            member: Some(member),
            part,
        });
    }

    fn bar_shaped(
        &mut self,
        kind: MemberKind,
        section: &Section,
        length: f32,
        reinforcement: Option<&Reinforcement>,
        tendons: &[Tendon],
    ) -> Result<(), LoadError> {
        let (mesh, area, outline) = match *section {
            Section::Rectangle { width_m, depth_m } => {
                let half = Vec2::new(0.5 * depth_m, 0.5 * width_m);
                let mesh =
                    solid::cells(&[-half.x, half.x], &[-half.y, half.y], |_, _| true, length);
                (mesh, f64::from(width_m) * f64::from(depth_m), Outline::Rectangle(half))
            }
            Section::Round { diameter_m } => {
                let radius = 0.5 * diameter_m;
                (
                    solid::ring(0.0, radius, 0.0, TAU, length),
                    f64::from(PI * radius * radius),
                    Outline::Round(radius),
                )
            }
        };
        self.prism(kind, mesh, area, outline, length, reinforcement, tendons)
    }

    /// A member of one section from end to end, with its steel.
    fn prism(
        &mut self,
        kind: MemberKind,
        mesh: Mesh,
        area: f64,
        outline: Outline,
        length: f32,
        reinforcement: Option<&Reinforcement>,
        tendons: &[Tendon],
    ) -> Result<(), LoadError> {
        let member = self.own(kind, area * f64::from(length));
        let id = &self.member.id;
        let mesh = self.mesh(mesh);
        self.place(format!("{id} concrete"), mesh, Mat4::IDENTITY, member, Part::Concrete);
        if let Some(r) = reinforcement {
            self.job.step(0, 1)?;
            let cover = (r.cover_mm / 1000.0).min(0.4 * length);
            let mut last: Option<(f32, Vec<Vec3>, usize)> = None;
            for (i, bar) in steel::bars(outline, r, length).into_iter().enumerate() {
                let (diameter, shape) = (bar.diameter, bar.shape(length, cover));
                // Bars of one diameter and shape share a mesh.
                let mesh = match &last {
                    Some((d, s, mesh)) if *d == diameter && *s == shape => *mesh,
                    _ => self.mesh(solid::tube(&shape, diameter, false)),
                };
                last = Some((diameter, shape, mesh));
                let turn = Quat::from_rotation_z(bar.inward.to_angle());
                self.place(
                    format!("{id} bar {}", i + 1),
                    mesh,
                    Mat4::from_rotation_translation(turn, bar.at.extend(0.0)),
                    member,
                    Part::Bar,
                );
            }
            if let Some(s) = &r.stirrups {
                let line = steel::stirrup(outline, r.cover_mm / 1000.0, s.diameter_mm / 1000.0);
                let mesh = self.mesh(solid::tube(&line, s.diameter_mm / 1000.0, true));
                for (i, z) in steel::stirrup_places(s, length, cover).enumerate() {
                    self.place(
                        format!("{id} stirrup {}", i + 1),
                        mesh,
                        Mat4::from_translation(Vec3::Z * z),
                        member,
                        Part::Stirrup,
                    );
                }
            }
        }
        for tendon in tendons {
            let duct = tendon.duct_mm / 1000.0;
            let mesh = self.mesh(solid::tube(
                &steel::tendon_line(&tendon.line, length, 0.6 * duct),
                duct,
                false,
            ));
            self.place(
                format!("{id} tendon {}", tendon.name),
                mesh,
                Mat4::IDENTITY,
                member,
                Part::Tendon,
            );
        }
        Ok(())
    }

    fn inner_lining(&mut self, l: &InnerLining, radius: f32, length: f32) -> Result<(), LoadError> {
        let outer = radius + l.thickness_m;
        let member = self.own(MemberKind::Lining, annulus(radius, outer) * f64::from(length));
        let id = &self.member.id;
        let mesh = self.mesh(solid::ring(radius, outer, 0.0, TAU, length));
        self.place(format!("{id} concrete"), mesh, Mat4::IDENTITY, member, Part::Concrete);
        let (of, cage) = (format!("{id} "), Cage::of_lining(l, radius, length));
        let meshes = self.tubes(&cage);
        self.copies(&cage, &meshes, &of, Mat4::IDENTITY, member)?;
        if let Some(t) = &l.tendons {
            // One turn less the anchorage's recess.
            const RECESS: f32 = 0.02;
            let mesh = self.mesh(solid::tube(
                &steel::arc(radius + t.depth_m, RECESS, TAU - RECESS, 0.0),
                t.duct_mm / 1000.0,
                false,
            ));
            for (i, z) in
                steel::spaced(length, 0.5 * t.spacing_m.min(length), t.spacing_m).enumerate()
            {
                self.job.step(i, 0)?;
                let anchor =
                    t.anchors_deg.get(i % t.anchors_deg.len().max(1)).copied().unwrap_or(0.0);
                let local = Mat4::from_rotation_translation(
                    Quat::from_rotation_z(anchor.to_radians()),
                    Vec3::Z * z,
                );
                self.place(format!("{id} tendon {}", i + 1), mesh, local, member, Part::Tendon);
            }
        }
        Ok(())
    }

    /// The meshes of a cage's shapes.
    fn tubes(&mut self, cage: &Cage) -> Vec<usize> {
        let tube = |s: &steel::Shape| {
            solid::tube(
                s.line.get(usize::from(s.closed)..).unwrap_or_default(),
                s.diameter,
                s.closed,
            )
        };
        cage.shapes.iter().map(|shape| self.mesh(tube(shape))).collect()
    }

    /// Places the lines of a cage; their names begin with `of`.
    fn copies(
        &mut self,
        cage: &Cage,
        meshes: &[usize],
        of: &str,
        local: Mat4,
        member: usize,
    ) -> Result<(), LoadError> {
        for (i, (name, shape, at)) in cage.lines.iter().enumerate() {
            self.job.step(i, 0)?;
            let local = local * Mat4::from_translation(*at);
            let part = cage.shapes[*shape].part;
            self.place(format!("{of}{name}"), meshes[*shape], local, member, part);
        }
        Ok(())
    }

    fn segments(&mut self, s: &Segments, radius: f32, length: f32) -> Result<(), LoadError> {
        let outer = radius + s.thickness_m;
        let class = s.concrete.as_ref().or(self.member.concrete.as_ref()).cloned();
        let [from, to] = span(s, radius);
        // Rings of one length are alike.
        let mut last: Option<(f32, usize, Option<(Cage, Vec<usize>)>)> = None;
        for ring in steel::rings(s, length) {
            self.job.step(ring.number as usize, s.rings(length) as usize)?;
            let [begin, long] = ring.concrete;
            let alike = last.take().filter(|(l, ..)| (l - long).abs() < 1e-6);
            let (_, mesh, laid) = last.insert(match alike {
                Some(alike) => alike,
                None => {
                    let mesh = self.mesh(solid::ring(radius, outer, from, to, long));
                    let cage = s.reinforcement.as_ref();
                    let cage = cage.map(|steel| Cage::of_segment(s, steel, radius, &ring));
                    let laid = cage.map(|cage| {
                        let meshes = self.tubes(&cage);
                        (cage, meshes)
                    });
                    (long, mesh, laid)
                }
            });
            let volume = annulus(radius, outer) * f64::from((to - from) / TAU * long);
            let along = self.frame.axis.normalize_or_zero();
            let frame = Frame {
                start: self.frame.start + along * ring.along[0],
                axis: along * ring.along[1],
                zero: self.frame.zero,
            };
            for (k, turn) in ring.turns(s).enumerate() {
                let id = format!("{}/R{}/S{}", self.member.id, ring.number, k + 1);
                let member = self.enter(
                    id.clone(),
                    id.clone(),
                    MemberKind::Segment,
                    frame,
                    volume,
                    class.as_deref(),
                );
                let local =
                    Mat4::from_rotation_translation(Quat::from_rotation_z(turn), Vec3::Z * begin);
                self.place(format!("{id} concrete"), *mesh, local, member, Part::Concrete);
                if let Some((cage, meshes)) = laid {
                    self.copies(cage, meshes, &format!("{id} "), local, member)?;
                }
            }
        }
        Ok(())
    }
}

fn annulus(inner: f32, outer: f32) -> f64 {
    std::f64::consts::PI * (f64::from(outer).powi(2) - f64::from(inner).powi(2))
}

/// Sets the members' boxes from their concrete, or from all their parts where there is none (a bar
/// that is a member).
pub(crate) fn measure_bounds(scene: &mut Scene) {
    const NOTHING: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let mut bounds = vec![[NOTHING; 2]; scene.members.len()];
    for object in &scene.objects {
        let Some(bounds) = object.member.and_then(|m| bounds.get_mut(m)) else { continue };
        let own = &mut bounds[usize::from(object.part != Part::Concrete)];
        for p in scene.meshes.get(object.mesh).map_or(&[][..], |m| &m.positions) {
            let p = object.transform.transform_point3(*p);
            *own = [own[0].min(p), own[1].max(p)];
        }
    }
    for (member, [concrete, other]) in scene.members.iter_mut().zip(bounds) {
        let own = if concrete[0].x <= concrete[1].x { concrete } else { other };
        if own[0].x <= own[1].x {
            member.bounds = own;
        }
    }
}
