//! `intrados info`: what is in a file.

use intrados_scene::{LampKind, MemberKind, Part, Scene, Slices};
use serde::Serialize;

use super::{render::MapRows, walks};
use crate::{
    args,
    console::{one_line, say},
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// All files. Schema `intrados.info/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    scenes: Vec<Summary>,
}

#[derive(Debug, Serialize)]
struct Summary {
    file: String,
    scene: String,
    title: String,
    scene_hash: String,
    unit: &'static str,
    /// Corners of the bounding box, m.
    bounds: [[f32; 3]; 2],
    size: [f32; 3],
    objects: usize,
    triangles: usize,
    materials: usize,
    materials_assumed: usize,
    textures: usize,
    lamps: Vec<LampSummary>,
    /// Objects that shine.
    emissive_objects: usize,
    cameras: Vec<CameraSummary>,
    meters: Vec<String>,
    members: Vec<MemberSummary>,
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct LampSummary {
    name: String,
    kind: &'static str,
}

#[derive(Debug, Serialize)]
struct CameraSummary {
    name: String,
    width: u32,
    height: u32,
    fov_deg: f32,
}

#[derive(Debug, Serialize)]
struct MemberSummary {
    id: String,
    name: String,
    kind: MemberKind,
    concrete: String,
    concrete_assumed: bool,
    /// Of the concrete's outline, m³; 0 where the mesh is open.
    volume_m3: f64,
    /// Corners of the bounding box, m.
    bounds: [[f32; 3]; 2],
    bars: usize,
    stirrups: usize,
    tendons: usize,
    slices: usize,
    /// Planted or known damage.
    truth: usize,
}

pub(crate) fn run(session: &Session, args: &args::Files) -> Result<Outcome, Failure> {
    let (mut scenes, mut failed) = (Vec::new(), None);
    for file in &args.files {
        match walks::load(session, file) {
            Ok(scene) => scenes.push(Summary::of(&file.display().to_string(), &scene)),
            Err(Failure::Interrupted) => return Err(Failure::Interrupted),
            // The others are still of interest; the first failure decides the exit code.
            Err(failure) if failed.is_none() => failed = Some(failure),
            Err(failure) => say(format_args!("intrados: {}", one_line(&failure.to_string()))),
        }
    }
    if !scenes.is_empty() {
        let report =
            Report { schema: "intrados.info/1", version: env!("CARGO_PKG_VERSION"), scenes };
        session.print(&report, || {
            report.scenes.iter().map(Summary::table).collect::<Vec<_>>().join("\n")
        })?;
    }
    failed.map_or(Ok(Outcome::Done), Err)
}

impl Summary {
    fn of(file: &str, scene: &Scene) -> Self {
        let bounds = scene.bounds();
        let emissive =
            |m: usize| scene.materials.get(m).is_some_and(|m| m.emission != glam::Vec3::ZERO);
        let lamp = |lamp: &intrados_scene::Lamp| LampSummary {
            name: lamp.name.clone(),
            kind: match lamp.kind {
                LampKind::Point { .. } => "point",
                LampKind::Spot { .. } => "spot",
                LampKind::Directional { .. } => "directional",
                LampKind::Environment { .. } => "environment",
            },
        };
        Self {
            file: file.into(),
            scene: scene.name.clone(),
            title: scene.title.clone(),
            scene_hash: scene.hash.clone(),
            unit: "m",
            bounds: bounds.map(|b| b.to_array()),
            size: (bounds[1] - bounds[0]).to_array(),
            objects: scene.objects.len(),
            triangles: scene.triangle_count(),
            materials: scene.materials.len(),
            materials_assumed: scene.materials.iter().filter(|m| m.assumed).count(),
            textures: scene.textures.len(),
            lamps: scene.lamps.iter().map(lamp).collect(),
            emissive_objects: scene.objects.iter().filter(|o| emissive(o.material)).count(),
            cameras: scene
                .cameras
                .iter()
                .map(|c| CameraSummary {
                    name: c.name.clone(),
                    width: c.width,
                    height: c.height,
                    fov_deg: c.fov_deg,
                })
                .collect(),
            meters: scene.meters.iter().map(|m| m.name.clone()).collect(),
            members: (0..scene.members.len()).filter_map(|i| MemberSummary::of(scene, i)).collect(),
            warnings: scene.warnings.clone(),
        }
    }

    fn table(&self) -> String {
        let [x, y, z] = self.size;
        let names =
            |list: Vec<&str>| if list.is_empty() { "none".to_owned() } else { list.join(", ") };
        let lamps =
            self.lamps.iter().map(|l| format!("{} ({})", l.name, l.kind)).collect::<Vec<_>>();
        let assumed = if self.materials_assumed > 0 {
            format!(" ({} assumed)", self.materials_assumed)
        } else {
            String::new()
        };
        let mut rows = vec![
            ["scene".into(), format!("{} ({})", self.scene, self.file)],
            ["title".into(), self.title.clone()],
            ["hash".into(), self.scene_hash.clone()],
            ["size".into(), format!("{x:.3} × {y:.3} × {z:.3} m")],
            ["objects".into(), format!("{}, {} triangles", self.objects, self.triangles)],
            [
                "materials".into(),
                format!("{}{assumed}, {} textures", self.materials, self.textures),
            ],
            [
                "lamps".into(),
                format!(
                    "{}; {} shining objects",
                    names(lamps.iter().map(String::as_str).collect()),
                    self.emissive_objects
                ),
            ],
            ["cameras".into(), names(self.cameras.iter().map(|c| c.name.as_str()).collect())],
            ["meters".into(), names(self.meters.iter().map(String::as_str).collect())],
            ["members".into(), self.members.len().to_string()],
        ];
        rows.retain(|[_, value]| !value.is_empty());
        let mut text = output::table(&rows.map_rows());
        if !self.members.is_empty() {
            let mut rows = vec![
                [
                    "  member",
                    "kind",
                    "name",
                    "concrete",
                    "volume m3",
                    "bars",
                    "stirrups",
                    "tendons",
                    "slices",
                    "truth",
                ]
                .map(String::from),
            ];
            rows.extend(self.members.iter().map(MemberSummary::row));
            text += &output::table(&rows.map_rows());
        }
        self.warnings.iter().for_each(|w| text += &format!("warning: {w}\n"));
        text
    }
}

impl MemberSummary {
    fn of(scene: &Scene, index: usize) -> Option<Self> {
        let member = scene.members.get(index)?;
        let parts = |part| {
            scene.objects.iter().filter(|o| o.member == Some(index) && o.part == part).count()
        };
        // Bars that are told by measures, assumed ones too, have no objects.
        let assembly = scene.structure.assembly(&member.id);
        let lines =
            |part| assembly.map_or(0, |a| a.steel.iter().filter(|line| line.part == part).count());
        let of_part = |part| match parts(part) {
            0 => lines(part),
            drawn => drawn,
        };
        let slices = |s: &Slices| match s {
            Slices::Files { images, .. } | Slices::Stack { images, .. } => images.len(),
            Slices::Drawn { count, .. } => *count as usize,
            Slices::Scanned { along, .. } => along.len(),
        };
        Some(Self {
            id: member.id.clone(),
            name: member.name.clone(),
            kind: member.kind,
            concrete: member.concrete.clone(),
            concrete_assumed: member.concrete_assumed,
            volume_m3: member.volume,
            bounds: member.bounds.map(|b| b.to_array()),
            bars: of_part(Part::Bar),
            stirrups: of_part(Part::Stirrup),
            tendons: of_part(Part::Tendon),
            slices: member.slices.iter().map(slices).sum(),
            truth: member.truth.len(),
        })
    }

    fn row(&self) -> [String; 10] {
        let assumed = if self.concrete_assumed { " (assumed)" } else { "" };
        [
            format!("  {}", self.id),
            kind_name(self.kind),
            self.name.clone(),
            format!("{}{assumed}", self.concrete),
            format!("{:.4}", self.volume_m3),
            self.bars.to_string(),
            self.stirrups.to_string(),
            self.tendons.to_string(),
            self.slices.to_string(),
            self.truth.to_string(),
        ]
    }
}

/// The word of a kind in JSON.
pub(crate) fn kind_name(kind: MemberKind) -> String {
    serde_json::to_value(kind).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
