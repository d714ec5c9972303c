//! `intrados photo --read`: damage in photographs; and photographs that no scene is given for.

use std::path::Path;

use glam::Vec3;
use intrados_photo::{
    Located, Photograph,
    marks::{Mark, marks},
    reading::{Defect, FaceReading, ReadFace, UnreadShape, read_all},
    relight::Relit,
};
use intrados_raster::{Grid, Mask};
use intrados_stage::file::{Set, file_name, file_names};
use serde::Serialize;

use super::Work;
use crate::{
    args::{self, TakenOff},
    failure::{Failure, Outcome},
    output::{self, Files},
    picture::png_of_colours,
    session::Session,
};

/// What is drawn over a picture: crack, spall, bare steel, rust, efflorescence.
const COLOURS: [(Mark, [u8; 3]); 5] = [
    (Mark::Spall, [255, 160, 0]),
    (Mark::Rust, [200, 60, 0]),
    (Mark::Efflorescence, [80, 160, 255]),
    (Mark::Steel, [160, 0, 160]),
    (Mark::Crack, [255, 0, 60]),
];

/// A face that was read.
#[derive(Debug, Serialize)]
pub(super) struct FaceRead {
    member: String,
    face: String,
    #[serde(flatten)]
    reading: FaceReading,
}

impl Work<'_> {
    /// Reads what a photograph shows once its light is taken off, and draws it.
    pub(super) fn read(
        &self,
        name: &str,
        stem: &str,
        relit: Option<&Relit>,
        shot: (&Photograph, &Located),
        files: &mut Set,
    ) -> Result<Vec<FaceRead>, Failure> {
        // Where light cannot be taken off, nothing is read as if it were.
        let as_it_looks = self.args.light == TakenOff::None;
        if !self.args.read || relit.is_none() && !as_it_looks {
            return Ok(Vec::new());
        }
        let progress = self.session.watch(format!("reading {name}"));
        let faces = read_all(
            &self.site,
            &self.scene,
            (relit, self.member),
            shot,
            self.args.seed,
            &self.session.job,
        )?;
        drop(progress);
        let mut read = Vec::new();
        for face in faces {
            let id = &self.scene.members[face.seen.member].id;
            let stem = format!("{stem}_{}_{}_damage", file_name(id), face.seen.face.name);
            let size = face.map.face.size.map(|n| n as u32);
            let drawn = drawn(&face);
            let mut facts = self.facts(name);
            facts.push(("intrados.mmPerPixel", face.map.face.mm_px.to_string()));
            files.write(format!("{stem}.png"), &png_of_colours(size, &drawn, &facts)?)?;
            files.write(format!("{stem}.pgw"), face.map.face.world_file().as_bytes())?;
            let face_name = face.seen.face.name;
            read.push(FaceRead { member: id.clone(), face: face_name, reading: face.reading });
        }
        Ok(read)
    }
}

/// The reflectance of a face, grey where it is unknown, with what was found on it.
fn drawn(face: &ReadFace) -> Vec<[u8; 3]> {
    let map = &face.map.face;
    let mut colours = shown(&map.light);
    let mut dot = |at: [f64; 2], colour: [u8; 3]| {
        let [x, y] = at.map(|c| c.max(0.0) as usize);
        if x < map.size[0] && y < map.size[1] {
            colours[y * map.size[0] + x] = colour;
        }
    };
    for defect in &face.reading.defects {
        match defect {
            Defect::Crack(crack) => {
                for pair in crack.points.windows(2) {
                    let [a, b] = [0, 1].map(|k| map.pixel([pair[k].across_m, pair[k].along_m]));
                    let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil().max(1.0);
                    for k in 0..=steps as u32 {
                        let t = f64::from(k) / steps;
                        dot([0, 1].map(|c| a[c] + t * (b[c] - a[c])), COLOURS[4].1);
                    }
                }
            }
            Defect::Spall { patch, .. } | Defect::Rust(patch) | Defect::Efflorescence(patch) => {
                let colour = match defect {
                    Defect::Spall { .. } => COLOURS[0].1,
                    Defect::Rust(_) => COLOURS[1].1,
                    _ => COLOURS[2].1,
                };
                // A ring as large as the patch.
                let radius = (patch.area_m2 / std::f64::consts::PI).sqrt() * 1e3 / map.mm_px;
                let [x, y] = map.pixel([patch.across_m, patch.along_m]);
                for k in 0..360 {
                    let (sin, cos) = f64::from(k).to_radians().sin_cos();
                    dot([x + radius * cos, y + radius * sin], colour);
                }
            }
        }
    }
    colours
}

/// As bright as pictures are, by the brightest twentieth; grey where nothing is known.
fn shown(light: &[Option<Vec3>]) -> Vec<[u8; 3]> {
    let mut all: Vec<f32> = light.iter().flatten().map(|c| c.max_element()).collect();
    all.sort_by(f32::total_cmp);
    let white = all.get(all.len() * 19 / 20).copied().filter(|w| *w > 0.0).unwrap_or(1.0);
    let colour = |c: Vec3| (c / white * 0.8).to_array().map(intrados_photo::picture::srgb);
    light.iter().map(|c| c.map_or([90; 3], colour)).collect()
}

/// A photograph read as it is. Part of schema `intrados.marks/1`.
#[derive(Debug, Serialize)]
struct Marked {
    file: String,
    size: [u32; 2],
    /// Shares of the pixels: cracks, missing cover, bare steel, rust, efflorescence.
    crack: f64,
    spall: f64,
    steel: f64,
    rust: f64,
    efflorescence: f64,
}

/// Photographs without a scene. Schema `intrados.marks/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    photos: Vec<Marked>,
    files: Vec<String>,
}

/// Whether that is a photograph, and no scene, by its name.
pub(super) fn is_photograph(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let known = ["jpg", "jpeg", "png", "tif", "tiff", "heic", "heif"];
    ending.is_some_and(|e| known.contains(&e.as_str()))
}

/// Photographs of which nobody knows what they show: where cracks and other damage are in them, in
/// pixels. `X.png` is white where there are cracks, `X_damage.png` shows all over the photograph.
pub(super) fn bare(session: &Session, args: &args::Photo) -> Result<Outcome, Failure> {
    let all: Vec<&Path> = std::iter::once(args.scene.as_path())
        .chain(args.files.iter().map(|f| f.as_path()))
        .collect();
    if let Some(path) = all.iter().find(|path| !is_photograph(path)) {
        let line = format!(
            "{}: is no photograph: give the scene first, or photographs alone",
            path.display()
        );
        return Err(Failure::Usage(line));
    }
    if args.mm_per_px.is_some() {
        let line =
            "--mm-per-px goes with a scene: without one, photographs are read in their own pixels";
        return Err(Failure::Usage(line.into()));
    }
    let names: Vec<String> = all.iter().map(|p| stem(p)).collect();
    let mut files = output::begin(&args.out)?;
    let mut photos = Vec::new();
    for (path, stem) in all.iter().zip(file_names(&names)) {
        let _progress = session.watch(format!("reading {}", path.display()));
        photos.push(one(session, path, &stem, &mut files)?);
    }
    const LIST: &str = "marks.json";
    let report = Report {
        schema: "intrados.marks/1",
        version: env!("CARGO_PKG_VERSION"),
        photos,
        files: files.listed(LIST),
    };
    files.finish(LIST, &report)?;
    session.print(&report, || report.table())?;
    Ok(Outcome::Done)
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn one(session: &Session, path: &Path, stem: &str, files: &mut Set) -> Result<Marked, Failure> {
    let photograph = super::open(path)?;
    let name = path.display();
    photograph.doubts.iter().for_each(|doubt| tracing::warn!("{name}: {doubt}"));
    let [w, h] = photograph.size;
    let at = |i: u32| photograph.light(i % w, i / w).unwrap_or(Vec3::ZERO);
    let data: Vec<Vec3> = (0..w * h).map(at).collect();
    let light = Grid { width: w as usize, height: h as usize, data };
    let known = Mask::new(light.width, light.height, true);
    let marks = marks(&light, &known, &session.job)?;
    let masks = COLOURS.map(|(mark, colour)| match mark {
        Mark::Crack => (marks.cracks(), colour),
        _ => (marks.areas(mark), colour),
    });
    let facts = vec![("intrados.version", env!("CARGO_PKG_VERSION").to_owned())];
    let black_white = |mask: &Mask| -> Vec<[u8; 3]> {
        mask.data.iter().map(|is| [if *is { 255 } else { 0 }; 3]).collect()
    };
    let white = black_white(&masks[4].0);
    files.write(format!("{stem}.png"), &png_of_colours([w, h], &white, &facts)?)?;
    let lit: Vec<Option<Vec3>> = light.data.iter().map(|c| Some(*c)).collect();
    let mut colours = shown(&lit);
    for (mask, colour) in &masks {
        mask.pixels().into_iter().for_each(|i| colours[i] = *colour);
    }
    files.write(format!("{stem}_damage.png"), &png_of_colours([w, h], &colours, &facts)?)?;
    let share = |k: usize| masks[k].0.count() as f64 / f64::from((w * h).max(1));
    Ok(Marked {
        file: path.display().to_string(),
        size: [w, h],
        crack: share(4),
        spall: share(0),
        steel: share(3),
        rust: share(1),
        efflorescence: share(2),
    })
}

impl Report {
    fn table(&self) -> String {
        let head =
            ["photograph", "pixels", "crack", "spall", "bare steel", "rust", "efflorescence"];
        let mut rows = vec![head.map(String::from).to_vec()];
        for photo in &self.photos {
            let percent = |x: f64| format!("{:.2} %", 100.0 * x);
            let size = format!("{} × {}", photo.size[0], photo.size[1]);
            let shares = [photo.crack, photo.spall, photo.steel, photo.rust, photo.efflorescence];
            rows.push([photo.file.clone(), size].into_iter().chain(shares.map(percent)).collect());
        }
        output::table(&rows)
    }
}

/// Rows of what was found on faces, for people.
pub(super) fn lines(faces: &[FaceRead]) -> String {
    let mut text = String::new();
    for face in faces {
        let FaceReading { defects, seen_m2, narrowest_mm, unread, .. } = &face.reading;
        let narrowest = narrowest_mm.map_or("unknown width".into(), |mm| format!("{mm:.2} mm"));
        text += &format!(
            "{} {}: {:.2} m² read, cracks show from {narrowest}\n",
            face.member,
            face.face,
            seen_m2.iter().sum::<f64>(),
        );
        for UnreadShape { patch, width_mm, .. } in unread {
            let [low, high] = patch.reach_m;
            text += &format!(
                "  not read: something dark, {width_mm:.1} mm wide, {low:.2} to {high:.2} m along: \
                 look whether it is a crack\n"
            );
        }
        for defect in defects {
            let [low, high] = defect.reach_m();
            let what = match defect {
                Defect::Crack(c) => format!(
                    "crack {}, {:.2} ± {:.2} mm wide (widest {:.2} ± {:.2}), {:.2} m long",
                    c.course.name(),
                    c.width_mm,
                    c.width_error_mm,
                    c.widest_mm,
                    c.widest_error_mm,
                    c.length_m
                ),
                Defect::Spall { patch, bars_bare } => {
                    let bars = if *bars_bare { ", bars bare" } else { "" };
                    format!("spall, {:.4} m²{bars}", patch.area_m2)
                }
                Defect::Rust(patch) => format!("rust, {:.4} m²", patch.area_m2),
                Defect::Efflorescence(patch) => format!("efflorescence, {:.4} m²", patch.area_m2),
            };
            text += &format!("  {what}, {low:.2} to {high:.2} m along\n");
        }
    }
    text
}
