//! Photographs as evidence: each is placed, its light is taken off, and what its member's faces
//! show becomes observations like those of an inspector, with the same likelihoods ([`survey`]). So
//! that a crack seen twice, by an eye and in a photograph, is not two opinions of rust, both are
//! weighed together.
//!
//! Of what a photograph does not show it says nothing: in a zone where nothing was found it speaks
//! for the share of the surface that it shows, and of cracks that are wide enough to be seen.
//!
//! [`survey`]:

use intrados_ct::{Picture, picture::CRACK};
use intrados_damage::zone::{ZONES, zone_at};
use intrados_photo::{
    Located, Photograph, Pick, Prior, Site,
    face::{Chart, Face, Surface},
    map::{FaceMap, MapError},
    picture::srgb,
    reading::{Defect, FaceReading, ReadFace, read_all},
    relight::{RelightError, RelightSettings, relight},
    taken::Focal,
};
use intrados_scene::{
    Lens, Scene,
    structure::{Observation, Photographed, Shows, Spot},
};
use intrados_stage::{Cancelled, Job};
use serde::Serialize;

/// The source name of what photographs show, where nobody else looked at the member.
pub const PHOTOGRAPHED: &str = "photographed";

/// Standard error of k1 before anything is picked, as the command `photo` has it.
const K1_ERROR: f64 = 0.05;
/// A zone of which less than this share is seen was not looked at.
const GLIMPSE: f64 = 0.02;
/// What a photograph vouches for where it finds nothing, of what an inspector would: its network
/// finds cracks, and hardly ever missing cover (ours).
const VOUCHED: f64 = 0.5;
/// What photographs cannot have shown where no scatter is known, mm.
const UNKNOWN_MM: f64 = 1.0;

/// Why a photograph says nothing.
#[derive(Debug, thiserror::Error)]
pub enum PhotoError {
    /// A reason, one line.
    #[error("{0}")]
    Because(String),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What a photograph is called in the ledger, unique within its member.
#[must_use]
pub fn name(photo: &Photographed) -> String {
    let file = photo.file.file_name().unwrap_or_default().to_string_lossy();
    format!("{} (photograph {file})", photo.name)
}

fn because(why: impl std::fmt::Display) -> PhotoError {
    PhotoError::Because(why.to_string())
}

/// What is known of a photograph before anything is picked in it.
#[must_use]
pub fn prior(photo: &Photographed, photograph: &Photograph) -> Prior {
    let known = photo.focal_px.map(|px| Focal { px, rel_error: 0.0 });
    Prior {
        size: photograph.size,
        focal: known.or_else(|| photograph.taken.focal(photograph.size)),
        lens: Lens::default(),
        k1_error: K1_ERROR,
        picking_px: photo.picking_px,
    }
}

/// The picks that its table has of a photograph, and those of its tags.
///
/// # Errors
/// File, line and remedy.
pub fn picks(
    photo: &Photographed,
    photograph: &Photograph,
    scene: &Scene,
    site: &Site,
) -> Result<Vec<Pick>, PhotoError> {
    let name = photo.file.file_name().unwrap_or_default().to_string_lossy();
    let table = intrados_photo::picks::read(&photo.picks, scene, site).map_err(because)?;
    Ok(table.of(&name, true, photograph))
}

/// Opens a photograph and finds out where it was taken from.
///
/// # Errors
/// It cannot be read, its picks cannot or do not fit, or the job was cancelled.
pub fn placed(
    scene: &Scene,
    photo: &Photographed,
    job: &Job,
) -> Result<(Photograph, Site, Located), PhotoError> {
    let photograph = Photograph::open(&photo.file).map_err(because)?;
    let site = Site::new(scene, job)?;
    let picks = picks(photo, &photograph, scene, &site)?;
    let prior = prior(photo, &photograph);
    let located = site.locate(&photograph, &picks, &prior).map_err(because)?;
    // What EXIF has turned upright no upright camera shows on its side.
    match photograph.on_its_side(&located.pose).filter(|_| photograph.orientation != 1) {
        Some(why) => Err(because(why)),
        None => Ok((photograph, site, located)),
    }
}

/// What photographs show of a member.
#[derive(Debug, Clone, Default)]
pub struct Shown {
    /// What was found, and where nothing was.
    pub observations: Vec<Observation>,
    /// What each looks like.
    pub pictures: Vec<Option<Picture>>,
    /// How much of each face is seen, also of those that are not.
    pub faces: Vec<FaceSeen>,
    /// What speaks against the photographs themselves, each with its name.
    pub doubts: Vec<String>,
}

/// How much of a face photographs show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaceSeen {
    /// Front, Right …; Around, Inside.
    pub face: String,
    /// Share of which the reflectance is known, 0 to 1; of the rest nothing is said.
    pub seen: f64,
    /// The narrowest crack that would have been found, mm.
    pub narrowest_mm: Option<f64>,
    /// Width of the widest long dark shape that was read as nothing, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unread_mm: Option<f64>,
}

impl FaceSeen {
    /// Whether enough of it is seen to say anything.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.seen >= GLIMPSE
    }

    /// What is seen of all faces and what is not, one sentence.
    ///
    /// ```
    /// use intrados_survey::photographed::FaceSeen;
    ///
    /// let of = |face: &str, seen, narrowest_mm| {
    ///     FaceSeen { face: face.into(), seen, narrowest_mm, unread_mm: None }
    /// };
    /// let [front, back] = [of("Front", 0.93, Some(0.24)), of("Back", 0.0, None)];
    /// assert_eq!(FaceSeen::told(&[front, back]), "Photographs show 93 % of Front (cracks from 0.24 mm), nothing of Back: what is there is unknown.");
    /// ```
    #[must_use]
    pub fn told(faces: &[Self]) -> String {
        let seen = faces.iter().filter(|f| f.is_seen()).map(|f| {
            let limit =
                f.narrowest_mm.map_or(String::new(), |mm| format!(" (cracks from {mm:.2} mm)"));
            format!("{:.0} % of {}{limit}", 100.0 * f.seen, f.face)
        });
        let hidden: Vec<&str> =
            faces.iter().filter(|f| !f.is_seen()).map(|f| f.face.as_str()).collect();
        let mut told: Vec<String> = seen.collect();
        told.extend(faces.iter().filter_map(|f| {
            let mm = f.unread_mm?;
            Some(format!("something dark on {}, {mm:.1} mm wide, that was not read", f.face))
        }));
        if !hidden.is_empty() {
            told.push(format!("nothing of {}: what is there is unknown", hidden.join(", ")));
        }
        format!("Photographs show {}.", told.join(", "))
    }
}

impl Shown {
    /// Takes what another photograph shows.
    pub fn extend(&mut self, more: Self) {
        self.observations.extend(more.observations);
        self.pictures.extend(more.pictures);
        self.doubts.extend(more.doubts);
        // Two photographs of a face may show the same of it: it counts what the better one shows.
        for face in more.faces {
            match self.faces.iter_mut().find(|known| known.face == face.face) {
                Some(known) => {
                    let unread_mm =
                        known.unread_mm.into_iter().chain(face.unread_mm).reduce(f64::max);
                    if known.seen < face.seen {
                        *known = face;
                    }
                    known.unread_mm = unread_mm;
                }
                None => self.faces.push(face),
            }
        }
    }
}

/// What a photograph shows of its member.
///
/// # Errors
/// It cannot be read, placed or relit, it shows nothing of the member, or the job was cancelled.
pub fn observed(scene: &Scene, photo: &Photographed, job: &Job) -> Result<Shown, PhotoError> {
    let (photograph, site, located) = placed(scene, photo, job)?;
    let (surface, faces) = faces(scene, photo, &site, (&photograph, &located), job)?;
    let doubts = photograph.doubts.iter().map(|doubt| format!("{}: {doubt}", name(photo)));
    Ok(Shown { doubts: doubts.collect(), ..observations(photo, surface, &faces) })
}

/// The faces of its member that a placed photograph shows, without the light on them, read.
///
/// # Errors
/// It cannot be relit, it shows nothing of the member, or the job was cancelled.
pub fn faces<'a>(
    scene: &Scene,
    photo: &Photographed,
    site: &'a Site,
    shot: (&Photograph, &Located),
    job: &Job,
) -> Result<(&'a Surface, Vec<ReadFace>), PhotoError> {
    let member = scene.members.iter().position(|m| m.id == photo.member);
    let member = member.ok_or_else(|| because("its member is lost"))?;
    let settings =
        RelightSettings { shadow_error_m: photo.shadow_error_m, ..RelightSettings::default() };
    let relit = match relight(site, scene, shot, &settings, &job.part(0.0, 0.7)) {
        Ok(relit) => relit,
        Err(RelightError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(why) => return Err(because(why)),
    };
    let faces = match read_all(
        site,
        scene,
        (Some(&relit), Some(member)),
        shot,
        settings.seed,
        &job.part(0.7, 1.0),
    ) {
        Ok(faces) => faces,
        Err(MapError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(why) => return Err(because(why)),
    };
    let Some(surface) = site.surface(member).filter(|_| !faces.is_empty()) else {
        return Err(because("it shows nothing of the member: give it to one that it shows"));
    };
    let seen: f64 = faces.iter().flat_map(|f| &f.reading.seen_m2).sum();
    if seen <= 0.0 {
        let why = "of what it shows of the member no reflectance is known: shadow, glare, or a view that is too flat";
        return Err(because(why));
    }
    Ok((surface, faces))
}

/// What was found and what was not, face by face and zone by zone.
fn observations(photo: &Photographed, surface: &Surface, faces: &[ReadFace]) -> Shown {
    let length = surface.length();
    let observation = |name: String, spot: Spot, shows: Shows| Observation {
        member: photo.member.clone(),
        name,
        date: photo.date,
        spot,
        instrument: Some("photograph".into()),
        picture: None,
        shows,
    };
    let (mut found, mut pictures) = (Vec::new(), Vec::new());
    let mut is_marred = [false; ZONES];
    for face in faces {
        for defect in &face.reading.defects {
            let [low, high] = defect.reach_m().map(|m| (m / length).clamp(0.0, 1.0));
            let shows = shows(defect);
            if !matches!(shows, Shows::Rust { .. } | Shows::Efflorescence { .. }) {
                is_marred[zone_at(low)..=zone_at(high)].fill(true);
            }
            let spot = Spot {
                along: [low as f32, high as f32],
                angle_deg: Some(angle_deg(face, defect) as f32),
                height_m: None,
            };
            let number = found.len() + 1;
            pictures.push(crop(&face.map.face, defect, &photo.name));
            found.push(observation(
                format!("{}, {} {number}", photo.name, defect.kind()),
                spot,
                shows,
            ));
        }
    }
    let whole = surface.area_m2() / ZONES as f64;
    let readings: Vec<&FaceReading> = faces.iter().map(|f| &f.reading).collect();
    for zone in (0..ZONES).filter(|zone| !is_marred[*zone]) {
        let seen: f64 = readings.iter().map(|r| r.seen_m2[zone]).sum::<f64>() / whole.max(1e-9);
        if seen < GLIMPSE {
            continue;
        }
        // The widest of what faces may have kept to themselves.
        let hidden = readings.iter().filter(|r| r.seen_m2[zone] > 0.0);
        let limit_mm = hidden.map(|r| r.narrowest_mm.unwrap_or(UNKNOWN_MM)).fold(0.0, f64::max);
        let at = |k: usize| k as f32 / ZONES as f32;
        let middle = 0.5 * (at(zone) + at(zone + 1));
        let spot = Spot { along: [middle; 2], ..Spot::default() };
        let shows = Shows::Intact { seen: VOUCHED * seen.min(1.0), limit_mm };
        found.push(observation(format!("{}, zone {}", photo.name, zone + 1), spot, shows));
    }
    pictures.resize(found.len(), None);
    let faces = surface.faces.iter().map(|face| seen_of(face, faces)).collect();
    Shown { observations: found, pictures, faces, doubts: Vec::new() }
}

fn seen_of(face: &Face, read: &[ReadFace]) -> FaceSeen {
    let [width, height] = [face.across, face.along].map(|[from, to]| to - from);
    let of_it = || read.iter().filter(|r| r.seen.face.name == face.name);
    // The sum of nothing is -0.
    let seen = 0.0 + of_it().flat_map(|r| r.reading.seen_m2).sum::<f64>();
    FaceSeen {
        face: face.name.clone(),
        seen: (seen / (width * height).max(1e-9)).clamp(0.0, 1.0),
        narrowest_mm: of_it().filter_map(|r| r.reading.narrowest_mm).reduce(f64::max),
        unread_mm: of_it().flat_map(|r| &r.reading.unread).map(|u| u.width_mm).reduce(f64::max),
    }
}

/// Longest side of a defect's picture, pixels of the face's map.
const LONGEST: usize = 400;

/// A defect on the unrolled face without the light, and the same with the course of a crack.
fn crop(map: &FaceMap, defect: &Defect, name: &str) -> Option<Picture> {
    let metres = 1e-3 * map.mm_px;
    let place = |across: f64, along: f64| {
        [(across - map.corner[0]) / metres, (map.corner[1] - along) / metres].map(|p| p as isize)
    };
    let points: Vec<[isize; 2]> = match defect {
        Defect::Crack(crack) => crack.points.iter().map(|p| place(p.across_m, p.along_m)).collect(),
        Defect::Spall { patch, .. } | Defect::Rust(patch) | Defect::Efflorescence(patch) => {
            let half = 0.5 * patch.area_m2.max(0.0).sqrt();
            patch
                .reach_m
                .map(|along| place(patch.across_m, along))
                .into_iter()
                .chain([-half, half].map(|by| place(patch.across_m + by, patch.along_m)))
                .collect()
        }
    };
    // Of a long crack its middle.
    let [low, high] = [0, 1].map(|side| {
        [0, 1].map(|k| {
            let reach = points.iter().map(|p| p[k]);
            let ends = [reach.clone().min().unwrap_or(0) - 20, reach.max().unwrap_or(0) + 20];
            let (middle, half) =
                ((ends[0] + ends[1]) / 2, ((ends[1] - ends[0]) / 2).min(LONGEST as isize / 2));
            (middle + if side == 0 { -half } else { half }).clamp(0, map.size[k] as isize) as usize
        })
    });
    let size = [high[0].checked_sub(low[0])?, high[1].checked_sub(low[1])?];
    if size[0] == 0 || size[1] == 0 {
        return None;
    }
    let at = |x: usize, y: usize| map.light[(low[1] + y) * map.size[0] + low[0] + x];
    let all = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let mut bright: Vec<f32> =
        all.clone().filter_map(|(x, y)| Some(at(x, y)?.max_element())).collect();
    bright.sort_by(f32::total_cmp);
    let white = bright.get(bright.len() * 95 / 100)?.max(1e-6);
    let grey = |x, y| at(x, y).map_or([255; 3], |c| (c / white * 0.75).to_array().map(srgb));
    let plain: Vec<[u8; 3]> = all.map(|(x, y)| grey(x, y)).collect();
    let mut drawn = plain.clone();
    for [x, y] in points.iter().filter(|_| matches!(defect, Defect::Crack(_))) {
        let inside = |v: isize, k: usize| {
            usize::try_from(v).ok()?.checked_sub(low[k]).filter(|&v| v < size[k])
        };
        if let (Some(x), Some(y)) = (inside(*x, 0), inside(*y, 1)) {
            drawn[y * size[0] + x] = CRACK;
        }
    }
    let rows = plain.chunks(size[0]).zip(drawn.chunks(size[0]));
    Some(Picture {
        width: 2 * size[0],
        height: size[1],
        rgb: rows.flat_map(|(a, b)| a.iter().chain(b)).flatten().copied().collect(),
        caption: format!("{name}, its light taken off, {:.2} mm a pixel", map.mm_px),
    })
}

fn shows(defect: &Defect) -> Shows {
    match defect {
        Defect::Crack(crack) => Shows::Crack {
            width_mm: crack.widest_mm,
            std_error_mm: crack.widest_error_mm,
            course: crack.course,
            length_m: Some(crack.length_m),
        },
        Defect::Spall { patch, bars_bare } => {
            Shows::Spall { area_m2: patch.area_m2, depth_mm: None, bars_bare: *bars_bare }
        }
        Defect::Rust(patch) => Shows::Rust { area_m2: patch.area_m2 },
        Defect::Efflorescence(patch) => Shows::Efflorescence { area_m2: patch.area_m2 },
    }
}

/// The side of the member that a defect is on, degrees about the axis.
fn angle_deg(face: &ReadFace, defect: &Defect) -> f64 {
    match face.seen.face.chart {
        Chart::Flat(_) => face.seen.middle.angle_deg,
        Chart::Around(radius) | Chart::Inside(radius) => {
            (defect.across_m() / radius).to_degrees().rem_euclid(360.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use intrados_photo::reading::{Crack, CrackPoint};
    use intrados_scene::structure::Course;

    use super::*;

    /// Ten centimetres of a crack along in a face of 100 × 400 pixels, of which a corner is unknown.
    #[test]
    fn a_crack_has_its_picture() {
        let mut light = vec![Some(Vec3::splat(0.4)); 100 * 400];
        light[150 * 100 + 35] = None;
        let map = FaceMap { size: [100, 400], mm_px: 1.0, corner: [-0.05, 0.4], light };
        let point = |along_m| CrackPoint { across_m: 0.0, along_m, width_mm: None, error_mm: None };
        let crack = Crack {
            points: (0..=10).map(|k| point(0.15 + 0.01 * f64::from(k))).collect(),
            length_m: 0.1,
            width_mm: 0.3,
            width_error_mm: 0.1,
            widest_mm: 0.3,
            widest_error_mm: 0.1,
            course: Course::Along,
            to_axis_deg: 0.0,
            returned: [0.1, 0.1],
        };
        let picture = crop(&map, &Defect::Crack(crack), "front").unwrap();
        assert_eq!((picture.width, picture.height), (80, 140));
        let pixels = picture.rgb.as_chunks::<3>().0;
        let red = pixels.iter().enumerate().filter(|(_, p)| **p == CRACK).map(|(i, _)| i % 80);
        assert_eq!(red.collect::<Vec<_>>(), [60; 11], "in the middle of the right half");
        assert_eq!(pixels.iter().filter(|p| **p == [255; 3]).count(), 2, "unknown, on either side");
    }
}
