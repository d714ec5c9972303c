//! `intrados photo`: where photographs were taken from, and the faces that they show, unrolled.

mod read;
mod relit;

use std::{collections::BTreeSet, path::Path};

use glam::DVec3;
use intrados_photo::{
    FaceMap, Located, Photograph, Pick, PoseError, Prior, Site,
    overlay::Overlay,
    picks::{self, Picks},
    picture::srgb,
    record::{FaceRecord, PoseRecord},
    relight::RelitRecord,
    series::{PlacedSeries, Series},
    taken::{Focal, Taken},
    unrolled,
};
use intrados_scene::{Lens, Scene};
use intrados_stage::file::{Set, file_name, file_names};
use serde::Serialize;

use super::walks;
use crate::{
    args,
    console::one_line,
    failure::{Failure, Outcome},
    output::{self, Files},
    picture::{Facts, png_of_colours},
    session::Session,
};
use read::FaceRead;
use relit::{Kept, MergedFace};

/// Standard error of k1 before anything is picked: barrels of zooms at their wide end reach some
/// −.1, and cameras that correct their pictures are near 0 (ours).
const K1_ERROR: f64 = 0.05;
const LIST: &str = "pose.json";

/// All photographs. Schema `intrados.photo/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    /// Standard error of a pick that was stated, pixels.
    picking_px: f64,
    photos: Vec<Placed>,
    /// Faces that several photographs show.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    merged: Vec<MergedFace>,
    unused: Vec<Unused>,
    files: Vec<String>,
}

/// A photograph that was placed.
#[derive(Debug, Serialize)]
struct Placed {
    file: String,
    file_hash: String,
    /// Pixels, upright.
    size: [u32; 2],
    taken: Taken,
    notes: Vec<String>,
    pose: PoseRecord,
    faces: Vec<FaceRecord>,
    /// What was fitted to take the light off.
    #[serde(skip_serializing_if = "Option::is_none")]
    relit: Option<RelitRecord>,
    /// Why the light stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_relit: Option<String>,
    /// What faces show once it is off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    read: Vec<FaceRead>,
}

/// A photograph that was not.
#[derive(Debug, Serialize)]
struct Unused {
    file: String,
    because: String,
}

/// Numbered corners of a member. Schema `intrados.corners/1`.
#[derive(Debug, Serialize)]
struct Corners {
    schema: &'static str,
    scene: String,
    member: String,
    /// m.
    corners: Vec<[f64; 3]>,
    /// Names of the faces that meet at each.
    faces: Vec<Vec<String>>,
}

/// What every photograph of a run is placed with.
struct Work<'a> {
    session: &'a Session,
    args: &'a args::Photo,
    scene: Scene,
    site: Site,
    picks: Picks,
    /// Of COLMAP, where there is one.
    series: Option<PlacedSeries>,
    /// Index of the one member that is unrolled.
    member: Option<usize>,
}

pub(crate) fn run(session: &Session, args: &args::Photo) -> Result<Outcome, Failure> {
    if read::is_photograph(&args.scene) {
        return read::bare(session, args);
    }
    let scene = walks::load(session, &args.scene)?;
    let site = Site::new(&scene, &session.job)?;
    if let Some(member) = &args.corners {
        return corners(session, &scene, &site, member);
    }
    if args.files.is_empty() {
        return Err(Failure::Usage("give photographs of the scene".into()));
    }
    if args.pose.is_none() {
        let line = "give --pose PICKS.csv: which places of the scene are where in the photographs";
        return Err(Failure::Usage(line.into()));
    }
    let picks = match &args.pose {
        Some(table) => picks::read(table, &scene, &site)?,
        None => Picks::default(),
    };
    let member = args.member.as_ref().map(|word| index_of(&scene, word)).transpose()?;
    let series = match &args.series {
        Some(folder) => Some(Series::read(folder)?.placed(&picks.picked)?),
        None => None,
    };
    let work = Work { session, args, scene, site, picks, series, member };
    let names: Vec<String> = args.files.iter().map(|file| name(file)).collect();
    if let Some(twice) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let line = format!("two photographs are called {}: give one another name", twice.1);
        return Err(Failure::Usage(line));
    }
    let known = |photo: &String| names.iter().any(|name| picks::is_same_photo(photo, name));
    if let Some(other) = work.picks.photos().find(|p| !known(p)) {
        tracing::warn!("picks in {other:?} are not used: no such photograph is given");
    }
    let mut files = output::begin(&args.out)?;
    let mut report = Report {
        schema: "intrados.photo/1",
        version: env!("CARGO_PKG_VERSION"),
        scene: work.scene.name.clone(),
        scene_hash: work.scene.hash.clone(),
        picking_px: args.picking_px,
        photos: Vec::new(),
        merged: Vec::new(),
        unused: Vec::new(),
        files: Vec::new(),
    };
    let mut first = None;
    let mut kept = Kept::default();
    for ((file, name), stem) in args.files.iter().zip(&names).zip(file_names(&names)) {
        let _progress = session.watch(format!("placing {name}"));
        match work.place(file, name, &stem, &mut files, &mut kept) {
            Ok(placed) => report.photos.push(placed),
            Err(failure @ (Failure::BadInput(_) | Failure::NoInput(_))) => {
                let because = one_line(&failure.to_string());
                report.unused.push(Unused { file: file.display().to_string(), because });
                first.get_or_insert(failure);
            }
            Err(failure) => return Err(failure),
        }
    }
    // Where none is used the first reason is the command's own.
    let told = usize::from(report.photos.is_empty());
    report.unused.iter().skip(told).for_each(|u| tracing::warn!("not used: {}", u.because));
    if let (true, Some(failure)) = (report.photos.is_empty(), first) {
        return Err(failure);
    }
    report.merged = work.merge(&kept, &mut files)?;
    report.files = files.listed(LIST);
    files.finish(LIST, &report)?;
    session.print(&report, || report.table())?;
    Ok(Outcome::Done)
}

fn name(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn index_of(scene: &Scene, word: &str) -> Result<usize, Failure> {
    let id = scene.id_of(word).map_err(|found| {
        let line = match found {
            0 => format!("{}: has no member {word:?}: `intrados info` lists them", scene.name),
            _ => format!("{}: {found} members are called {word:?}: give the id", scene.name),
        };
        Failure::BadInput(line)
    })?;
    let index = scene.members.iter().position(|m| m.id == id);
    index.ok_or_else(|| Failure::Internal(format!("member {id} is lost")))
}

fn corners(
    session: &Session,
    scene: &Scene,
    site: &Site,
    member: &str,
) -> Result<Outcome, Failure> {
    let index = index_of(scene, member)?;
    let outline = site.surface(index).map(intrados_photo::face::Surface::outline);
    let intrados_photo::corner::Outline { corners, names, .. } = outline.unwrap_or_default();
    let report = Corners {
        schema: "intrados.corners/1",
        scene: scene.name.clone(),
        member: scene.members[index].id.clone(),
        corners: corners.iter().map(DVec3::to_array).collect(),
        faces: names,
    };
    session.print(&report, || {
        let mut rows = vec![["corner", "x m", "y m", "z m", "faces"].map(String::from).to_vec()];
        for (number, (corner, faces)) in (1..).zip(report.corners.iter().zip(&report.faces)) {
            let numbers = corner.map(|x| format!("{:.4}", x + 0.0));
            let cells = [number.to_string()].into_iter().chain(numbers);
            rows.push(cells.chain([faces.join(", ")]).collect());
        }
        output::table(&rows)
    })?;
    Ok(Outcome::Done)
}

impl Work<'_> {
    fn place(
        &self,
        file: &Path,
        name: &str,
        stem: &str,
        files: &mut Set,
        kept: &mut Kept,
    ) -> Result<Placed, Failure> {
        let bad = |why: &dyn std::fmt::Display| format!("{}: {why}", file.display());
        let photograph = open(file)?;
        for note in &photograph.notes {
            tracing::info!("{name}: {note}");
        }
        for doubt in &photograph.doubts {
            tracing::warn!("{name}: {doubt}");
        }
        let picks = self.picks.of(name, self.args.files.len() == 1, &photograph);
        let located = self
            .locate(&photograph, name, &picks)
            .map_err(|error| Failure::BadInput(bad(&error)))?;
        let rolled: Vec<String> = photograph.on_its_side(&located.pose).into_iter().collect();
        for doubt in &rolled {
            tracing::warn!("{name}: {doubt}");
        }
        if located.other.is_some() {
            tracing::warn!(
                "{name}: another place of the camera fits nearly as well: pick a point out of the plane of the others"
            );
        }
        if let Some(wrong) = located.left_out {
            tracing::warn!("{name}: pick {} contradicts all others and was left out", wrong + 1);
        }
        let seen = self.site.seen_faces(&located.pose);
        let members: BTreeSet<usize> = seen.iter().map(|seen| seen.member).collect();
        let surfaces = members.into_iter().filter_map(|member| self.site.surface(member));
        let edges: Vec<[DVec3; 2]> = surfaces.flat_map(|s| s.outline().edges).collect();
        let overlay = Overlay::new(&photograph, &located.pose, &edges, &picks, &self.site);
        files.write(
            format!("{stem}_overlay.png"),
            &png_of_colours(overlay.size, overlay.rgb.as_chunks().0, &self.facts(name))?,
        )?;
        let shot = (&photograph, &located);
        let (relit, not_relit) = self.relight(name, shot)?;
        let read = self.read(name, stem, relit.as_ref(), shot, files)?;
        let mut faces = Vec::new();
        for seen in seen.iter().filter(|seen| self.member.is_none_or(|m| m == seen.member)) {
            let Some(surface) = self.site.surface(seen.member) else { continue };
            let id = &self.scene.members[seen.member].id;
            let map = unrolled(
                &self.site,
                surface,
                &seen.face,
                (&photograph, &located.pose),
                self.args.mm_per_px(),
                &self.session.job,
            )?;
            let error = self.site.error(&located, &seen.middle);
            let stem = format!("{stem}_{}_{}", file_name(id), seen.face.name);
            self.write(files, &map, &stem, name)?;
            let mut record = FaceRecord::new([id, &seen.face.name], &seen.middle, error, &map);
            if let Some(relit) = &relit {
                let job = &self.session.job;
                let map = relit.map(&self.site, seen, shot, self.args.mm_per_px(), job)?;
                self.write_relit(files, &map, &stem, name)?;
                record = record.relit(&map);
                kept.keep([id, &seen.face.name], name, map);
            }
            faces.push(record);
        }
        Ok(Placed {
            file: file.display().to_string(),
            file_hash: hash(file)?,
            size: photograph.size,
            taken: photograph.taken.clone(),
            notes: [&photograph.notes[..], &photograph.doubts, &rolled].concat(),
            pose: PoseRecord::new(&located, &picks),
            faces,
            relit: relit.as_ref().map(intrados_photo::relight::Relit::record),
            not_relit,
            read,
        })
    }

    fn locate(
        &self,
        photograph: &Photograph,
        name: &str,
        picks: &[Pick],
    ) -> Result<Located, PoseError> {
        let in_series = self.series.as_ref().and_then(|series| series.located(name, picks));
        match in_series {
            Some(located) if located.pose.size == photograph.size => return Ok(located),
            Some(_) => tracing::warn!(
                "{name}: COLMAP saw it in another size, or before it was turned upright: its own picks place it"
            ),
            None if self.series.is_some() => tracing::warn!(
                "{name}: COLMAP's images.txt does not name it, or names two of its name: its own picks place it"
            ),
            None => {}
        }
        let known = self.args.focal_px.map(|px| Focal { px, rel_error: 0.0 });
        let prior = Prior {
            size: photograph.size,
            focal: known.or_else(|| photograph.taken.focal(photograph.size)),
            lens: Lens::default(),
            k1_error: K1_ERROR,
            picking_px: self.args.picking_px,
        };
        self.site.locate(photograph, picks, &prior)
    }

    fn facts(&self, photo: &str) -> Facts {
        vec![
            ("intrados.version", env!("CARGO_PKG_VERSION").into()),
            ("intrados.scene", self.scene.name.clone()),
            ("intrados.sceneHash", self.scene.hash.clone()),
            ("intrados.photo", photo.into()),
        ]
    }

    /// A map, its world file, and where it is unknown.
    fn write(
        &self,
        files: &mut Set,
        map: &FaceMap,
        stem: &str,
        photo: &str,
    ) -> Result<(), Failure> {
        let mut facts = self.facts(photo);
        facts.push(("intrados.mmPerPixel", map.mm_px.to_string()));
        let size = map.size.map(|n| n as u32);
        let colour =
            |light: &Option<glam::Vec3>| light.map_or([0; 3], |light| light.to_array().map(srgb));
        let colours: Vec<[u8; 3]> = map.light.iter().map(colour).collect();
        files.write(format!("{stem}.png"), &png_of_colours(size, &colours, &facts)?)?;
        files.write(format!("{stem}.pgw"), map.world_file().as_bytes())?;
        let unknown: Vec<[u8; 3]> =
            map.light.iter().map(|light| [if light.is_some() { 0 } else { 255 }; 3]).collect();
        files.write(format!("{stem}_unknown.png"), &png_of_colours(size, &unknown, &facts)?)
    }
}

/// Opens a photograph.
fn open(file: &Path) -> Result<Photograph, Failure> {
    let bad = |why: &dyn std::fmt::Display| format!("{}: {why}", file.display());
    Photograph::open(file).map_err(|error| match error.is_missing() {
        true => Failure::NoInput(bad(&error)),
        false => Failure::BadInput(bad(&error)),
    })
}

/// BLAKE3 of a file.
fn hash(path: &Path) -> Result<String, Failure> {
    let (file, _) =
        intrados_stage::access::open(path).map_err(|error| Failure::denied(path, &error))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).map_err(|error| Failure::no_input(path, &error))?;
    Ok(hasher.finalize().to_hex().to_string())
}

impl Report {
    fn table(&self) -> String {
        let mut text = String::new();
        for photo in &self.photos {
            let pose = &photo.pose;
            let [x, y, z] = pose.position_m;
            let error = pose.position_error_m.iter().map(|e| e * e).sum::<f64>().sqrt();
            text += &format!(
                "{}: from ({x:.3}, {y:.3}, {z:.3}) ± {error:.3} m, focal length {:.0} ± {:.0} px, residual {:.1} px of {} picks\n",
                photo.file,
                pose.focal_px,
                pose.focal_px * pose.focal_rel_error,
                pose.rms_px,
                pose.picks.len(),
            );
            pose.edges.iter().for_each(|edges| text += &format!("{}\n", edges.line));
            text += &output::table(&rows(&photo.faces));
            photo.relit.iter().for_each(|relit| text += &relit::lines(relit));
            text += &read::lines(&photo.read);
        }
        self.merged.iter().for_each(|merged| text += &merged.line());
        self.unused.iter().for_each(|u| text += &format!("not used, because {}\n", u.because));
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}

fn rows(faces: &[FaceRecord]) -> Vec<Vec<String>> {
    let head =
        ["member", "face", "distance m", "oblique deg", "mm/px", "place ± mm", "map px", "known"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let is_relit = faces.iter().any(|face| face.relit_known.is_some());
    if is_relit {
        rows[0].extend(["relit", "reflectance ±"].map(String::from));
    }
    for face in faces {
        let [around, along] = face.photo_mm_px;
        rows.push(vec![
            face.member.clone(),
            face.face.clone(),
            format!("{:.2}", face.distance_m),
            format!("{:.0}", face.obliqueness_deg),
            format!("{around:.2} × {along:.2}"),
            face.place_error_mm.map_or("-".into(), |[a, b]| format!("{a:.1} × {b:.1}")),
            format!("{} × {}", face.map_size[0], face.map_size[1]),
            format!("{:.0} %", 100.0 * face.known),
        ]);
        if let (Some(row), Some(known)) = (rows.last_mut(), face.relit_known) {
            let error = face.relit_log_error.map_or("-".into(), |e| format!("{:.1} %", 100.0 * e));
            row.extend([format!("{:.0} %", 100.0 * known), error]);
        }
    }
    rows
}
