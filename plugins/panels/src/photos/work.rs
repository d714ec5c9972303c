//! What takes a while: opening, placing, reading, writing. All of it runs off the frame.

use std::{io::Write, path::PathBuf, sync::Arc};

use egui::{Color32, ColorImage};
use glam::DVec3;
use intrados_photo::{
    Located, Photograph, Pick, Site,
    corner::Outline,
    face::Surface,
    map::FaceMap,
    overlay::Overlay,
    picture::srgb,
    reading::{Defect, ReadFace, UnreadShape},
};
use intrados_scene::{
    Scene,
    attach::{Attachment, What},
    structure::{Course, Photographed},
};
use intrados_stage::{Job, alone, file};
use intrados_survey::photographed::{self, PhotoError};

use crate::{lang::fixed, number::plus_minus};

/// Longer side of a face's picture, pixels; larger maps are thinned.
const SIDE: usize = 2048;
/// A pick so near to a corner of the member is of that corner, m.
const SAME: f64 = 1e-3;

/// A photograph and the member that it is of.
pub(super) struct Opened {
    pub(super) photo: Photographed,
    pub(super) photograph: Arc<Photograph>,
    pub(super) site: Arc<Site>,
    pub(super) outline: Outline,
    pub(super) picture: ColorImage,
    pub(super) picks: Vec<Picked>,
}

impl Opened {
    /// Picks, with the corners of the member that they are of.
    pub(super) fn picked(&self, picks: Vec<Pick>) -> Vec<Picked> {
        let corner =
            |place: DVec3| self.outline.corners.iter().position(|c| c.distance(place) < SAME);
        picks.into_iter().map(|pick| Picked { pick, corner: corner(pick.place) }).collect()
    }
}

/// A place that was picked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Picked {
    pub(super) pick: Pick,
    /// Index among the member's corners, if it is one.
    pub(super) corner: Option<usize>,
}

/// Where a photograph was taken from, and how the model lies over it.
pub(super) struct Placed {
    pub(super) located: Located,
    pub(super) picture: ColorImage,
}

/// A face that was read.
pub(super) struct Face {
    pub(super) name: String,
    pub(super) picture: ColorImage,
    /// Of the map, pixels.
    pub(super) size: [f32; 2],
    pub(super) mm_px: f64,
    /// Share of the map that is known.
    pub(super) known: f64,
    pub(super) narrowest_mm: Option<f64>,
    pub(super) unread: Vec<UnreadShape>,
    pub(super) finds: Vec<Find>,
}

/// One thing that was found.
pub(super) struct Find {
    defect: Defect,
    /// On the face's map, pixels.
    pub(super) on_map: Vec<[f64; 2]>,
    /// In the photograph, pixels.
    pub(super) in_photo: Vec<[f64; 2]>,
    /// Its middle, m, and the unit normal there.
    pub(super) at: Option<[DVec3; 2]>,
}

impl Find {
    /// What it is, in words.
    pub(super) fn what(&self) -> String {
        let cm2 = |area_m2: f64| fixed(1e4 * area_m2, 0);
        match &self.defect {
            Defect::Crack(crack) => {
                let width = plus_minus(crack.widest_mm, crack.widest_error_mm, "mm");
                tr!("crack {}, {} m long", width, fixed(crack.length_m, 2))
            }
            Defect::Spall { patch, bars_bare: true } => {
                tr!("spall {} cm², bars bare", cm2(patch.area_m2))
            }
            Defect::Spall { patch, bars_bare: false } => tr!("spall {} cm²", cm2(patch.area_m2)),
            Defect::Rust(patch) => tr!("rust {} cm²", cm2(patch.area_m2)),
            Defect::Efflorescence(patch) => tr!("efflorescence {} cm²", cm2(patch.area_m2)),
        }
    }

    /// Where along its member, and how it runs.
    pub(super) fn course(&self) -> String {
        let [low, high] = self.defect.reach_m().map(|x| fixed(x, 2));
        let Defect::Crack(crack) = &self.defect else {
            return tr!("{} to {} m along", low, high);
        };
        let course = match crack.course {
            Course::Along => tr!("along|course"),
            Course::Across => tr!("across|course"),
            Course::Diagonal => tr!("diagonal|course"),
            Course::Map => tr!("map|course"),
        };
        tr!("{}, {} to {} m along", course, low, high)
    }
}

pub(super) fn open(scene: &Scene, photo: Photographed, job: &Job) -> Result<Opened, String> {
    alone(|| {
        let photograph = Photograph::open(&photo.file)
            .map_err(|why| format!("{}: {why}", photo.file.display()))?;
        let site = Site::new(scene, job).map_err(|why| why.to_string())?;
        let member = scene.members.iter().position(|m| m.id == photo.member);
        let outline = member.and_then(|m| site.surface(m)).map(Surface::outline);
        let outline = outline.ok_or("this member has no surface of its own: choose another one")?;
        let picks = if photo.picks.exists() {
            photographed::picks(&photo, &photograph, scene, &site).map_err(|why| why.to_string())?
        } else {
            Vec::new()
        };
        let picture = image(Overlay::plain(&photograph));
        let (photograph, site) = (Arc::new(photograph), Arc::new(site));
        let none = Vec::new();
        let opened = Opened { photo, photograph, site, outline, picture, picks: none };
        Ok(Opened { picks: opened.picked(picks), ..opened })
    })
}

fn image(overlay: Overlay) -> ColorImage {
    ColorImage::from_rgb(overlay.size.map(|n| n as usize), &overlay.rgb)
}

pub(super) fn place(
    photo: &Photographed,
    photograph: &Photograph,
    site: &Site,
    edges: &[[DVec3; 2]],
    picks: &[Pick],
) -> Result<Placed, String> {
    alone(|| {
        let prior = photographed::prior(photo, photograph);
        let located = site.locate(photograph, picks, &prior).map_err(|why| why.to_string())?;
        let overlay = Overlay::new(photograph, &located.pose, edges, &[], site);
        Ok(Placed { located, picture: image(overlay) })
    })
}

pub(super) fn read(
    scene: &Scene,
    photo: &Photographed,
    site: &Site,
    shot: (&Photograph, &Located),
    job: &Job,
) -> Result<Vec<Face>, String> {
    alone(|| {
        let (surface, faces) = photographed::faces(scene, photo, site, shot, job)
            .map_err(|why: PhotoError| why.to_string())?;
        Ok(faces.iter().map(|face| shown(surface, face, shot.1)).collect())
    })
}

fn shown(surface: &Surface, face: &ReadFace, located: &Located) -> Face {
    let map = &face.map.face;
    let find = |defect: &Defect| {
        let on_face = course(defect);
        let places = surface.places(&face.seen.face, &on_face);
        let seen = places.iter().flatten();
        Find {
            defect: defect.clone(),
            on_map: on_face.iter().map(|at| map.pixel(*at)).collect(),
            in_photo: seen.filter_map(|[place, _]| located.pose.project(*place)).collect(),
            at: places.get(places.len() / 2).copied().flatten(),
        }
    };
    Face {
        name: face.seen.face.name.clone(),
        picture: reflectance(map),
        size: map.size.map(|n| n as f32),
        mm_px: map.mm_px,
        known: map.known(),
        narrowest_mm: face.reading.narrowest_mm,
        unread: face.reading.unread.clone(),
        finds: face.reading.defects.iter().map(find).collect(),
    }
}

/// The course of a crack; around a patch the square of its area. Across and along, m.
fn course(defect: &Defect) -> Vec<[f64; 2]> {
    match defect {
        Defect::Crack(crack) => crack.points.iter().map(|p| [p.across_m, p.along_m]).collect(),
        Defect::Spall { patch, .. } | Defect::Rust(patch) | Defect::Efflorescence(patch) => {
            let half = 0.5 * patch.area_m2.max(0.0).sqrt();
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
                .map(|[x, y]| [patch.across_m + x * half, patch.along_m + y * half])
                .to_vec()
        }
    }
}

/// A face without the light on it; what is unknown lets the ground through.
fn reflectance(map: &FaceMap) -> ColorImage {
    let step = map.size[0].max(map.size[1]).div_ceil(SIDE).max(1);
    let [width, height] = map.size.map(|n| n.div_ceil(step));
    let mut bright: Vec<f32> = map.light.iter().flatten().map(|c| c.max_element()).collect();
    bright.sort_by(f32::total_cmp);
    let white = bright.get(bright.len() * 95 / 100).copied().unwrap_or(1.0).max(1e-6);
    let pixel = |i: usize| {
        let light = map.light[i / width * step * map.size[0] + i % width * step];
        light.map_or(Color32::TRANSPARENT, |c| {
            let [r, g, b] = (c / white * 0.75).to_array().map(srgb);
            Color32::from_rgb(r, g, b)
        })
    };
    ColorImage::new([width, height], (0..width * height).map(pixel).collect())
}

/// Writes the table of picks of a photograph.
pub(super) fn save(photo: &Photographed, picks: &[Picked]) -> Result<(), String> {
    let of_corners = picks.iter().all(|p| p.corner.is_some());
    let mut table = String::from(if of_corners { "u,v,member,corner\n" } else { "u,v,x,y,z\n" });
    for Picked { pick, corner } in picks {
        let [u, v] = pick.pixel;
        let [x, y, z] = pick.place.to_array();
        table += &match corner.filter(|_| of_corners) {
            Some(corner) => format!("{u:.2},{v:.2},{},{}\n", photo.member, corner + 1),
            None => format!("{u:.2},{v:.2},{x},{y},{z}\n"),
        };
    }
    file::put(&photo.picks, |out| out.write_all(table.as_bytes()))
        .map_err(|why| format!("{}: {why}", photo.picks.display()))
}

/// A photograph with its picks, as evidence.
pub(super) fn attachment(photo: &Photographed) -> Attachment {
    Attachment {
        member: photo.member.clone(),
        name: None,
        date: None,
        along: None,
        face: None,
        angle_deg: None,
        height_m: None,
        instrument: None,
        picture: None,
        confirmed: false,
        what: What::Photograph {
            files: [photo.file.clone(), photo.picks.clone()],
            focal_px: photo.focal_px,
        },
    }
}

/// A photograph that is not attached yet; its picks lie beside it.
pub(super) fn own(file: PathBuf, member: &str) -> Photographed {
    Photographed {
        member: member.to_owned(),
        name: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        picks: file.with_extension("picks.csv"),
        file,
        date: None,
        focal_px: None,
        picking_px: Photographed::PICKING_PX,
        shadow_error_m: 1e-3 * Photographed::SHADOW_ERROR_MM,
    }
}
