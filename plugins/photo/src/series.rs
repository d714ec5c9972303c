//! Series of photographs that COLMAP has aligned: its text files, brought into the scene's frame.

use std::{
    collections::{BTreeMap, HashMap},
    path::{Path, PathBuf},
};

use glam::{DMat3, DQuat, DVec3};
use intrados_scene::Lens;
use intrados_stage::access::{self, Denied};
use nalgebra::{Matrix3, Vector3};

use crate::{
    Located, Pick, Pose,
    picks::{PickedIn, is_same_photo},
    pose::Covariance,
    similarity::Similarity,
};

/// Longest of COLMAP's files, bytes.
const LONGEST: u64 = 1 << 28;
/// Focal lengths across and down may differ by this share.
const SQUARE: f64 = 2e-3;

/// Why a series is not read or placed.
#[derive(Debug, thiserror::Error)]
pub enum SeriesError {
    /// A file is not there, or none.
    #[error("{}: {source}", path.display())]
    Denied {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Denied,
    },
    /// What is wrong in a file.
    #[error("{}:{line}: {what}", path.display())]
    Bad {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong, and what to do.
        what: String,
    },
    /// Too few places that are picked in two photographs.
    #[error(
        "{0} places are picked in two or more photographs of the series: pick 3 that lie on no line"
    )]
    TooFew(usize),
}

/// Cameras of a series, in COLMAP's own frame and unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// By the name of the photograph's file.
    pub poses: BTreeMap<String, Pose>,
}

/// A series in the scene's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedSeries {
    /// By the name of the photograph's file.
    pub poses: BTreeMap<String, Pose>,
    /// Root mean square of what the places are off, m.
    pub rms_m: f64,
    /// Middle of the places, m, and Σ (|d|² − d dᵀ), Σ |d|² of what they are from it, m².
    middle: DVec3,
    inertia: Matrix3<f64>,
    spread: f64,
    /// Variance of each coordinate of a place, m², and how many places there are.
    variance: f64,
    count: usize,
}

impl Series {
    /// Reads `cameras.txt` and `images.txt` of a folder (`colmap model_converter --output_type
    /// TXT`). Models `SIMPLE_PINHOLE`, `PINHOLE`, `SIMPLE_RADIAL`, `RADIAL` and `OPENCV`.
    ///
    /// # Errors
    /// [`SeriesError`]: file, line and remedy.
    pub fn read(folder: &Path) -> Result<Self, SeriesError> {
        let cameras = lines(&folder.join("cameras.txt"), cameras)?;
        let poses = lines(&folder.join("images.txt"), |text| images(text, &cameras))?;
        Ok(Self { poses })
    }

    /// Brings the series into the scene's frame: places that are picked in two or more of its
    /// photographs are where their rays meet, and these are matched.
    ///
    /// # Errors
    /// [`SeriesError::TooFew`].
    pub fn placed(&self, picks: &[PickedIn]) -> Result<PlacedSeries, SeriesError> {
        let mut by_place: Vec<(DVec3, Vec<(&Pose, &Pick)>)> = Vec::new();
        for picked in picks {
            let pose = picked.photo.as_ref().and_then(|photo| found(&self.poses, photo));
            let Some(pose) = pose else { continue };
            let place = picked.pick.place;
            match by_place.iter_mut().find(|(known, _)| *known == place) {
                Some((_, rays)) => rays.push((pose, &picked.pick)),
                None => by_place.push((place, vec![(pose, &picked.pick)])),
            }
        }
        let met = |(place, rays): &(DVec3, Vec<(&Pose, &Pick)>)| Some([meet(rays)?, *place]);
        let pairs: Vec<[DVec3; 2]> = by_place.iter().filter_map(met).collect();
        let similarity = Similarity::between(&pairs).ok_or(SeriesError::TooFew(pairs.len()))?;
        let turned = |pose: &Pose| {
            let rotation = pose.rotation * similarity.rotation.transpose();
            let position = similarity.apply(pose.position);
            Pose::new(position, rotation, pose.focal_px, pose.lens, pose.size)
        };
        let poses = self.poses.iter().map(|(name, pose)| (name.clone(), turned(pose))).collect();
        let count = pairs.len();
        let middle = pairs.iter().map(|[_, q]| *q).sum::<DVec3>() / count as f64;
        let (mut inertia, mut spread, mut off) = (Matrix3::zeros(), 0.0, 0.0);
        for [p, q] in &pairs {
            let d = Vector3::from((*q - middle).to_array());
            inertia += Matrix3::identity() * d.norm_squared() - d * d.transpose();
            spread += d.norm_squared();
            off += similarity.apply(*p).distance_squared(*q);
        }
        // Three coordinates of each place, less the seven that the similarity takes.
        let variance = off / (3.0 * count as f64 - 7.0).max(1.0);
        let rms_m = (off / count as f64).sqrt();
        Ok(PlacedSeries { poses, rms_m, middle, inertia, spread, variance, count })
    }
}

impl PlacedSeries {
    /// Where a photograph of the series stood, with the error of the frame: what the places are off
    /// leaves its shift, its turn θ and its scale s open, and moves a camera at d from the places'
    /// middle by δt + θ × d + δs d. Within the series COLMAP's errors are far smaller, and left
    /// out. `None` of a photograph that is not in it.
    #[must_use]
    pub fn located(&self, photo: &str, picks: &[Pick]) -> Option<Located> {
        let pose = *found(&self.poses, photo)?;
        let d = Vector3::from((pose.position - self.middle).to_array());
        let turn = self.inertia.try_inverse()? * self.variance;
        // θ × d = −[d]× θ; a turn of the world by θ turns the camera's axes by −R θ.
        let shift = -d.cross_matrix();
        let axes = -Matrix3::from_column_slice(&pose.rotation.to_cols_array());
        let place = shift * turn * shift.transpose()
            + Matrix3::identity() * (self.variance / self.count as f64)
            + d * d.transpose() * (self.variance / self.spread);
        let mut covariance = Covariance::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&(axes * turn * axes.transpose()));
        covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&(axes * turn * shift.transpose()));
        covariance.fixed_view_mut::<3, 3>(3, 0).copy_from(&(shift * turn * axes.transpose()));
        covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&place);
        let off = |pick: &Pick| {
            let at = pose.project(pick.place);
            at.map_or([f64::NAN; 2], |[x, y]| [x - pick.pixel[0], y - pick.pixel[1]])
        };
        let residuals: Vec<[f64; 2]> = picks.iter().map(off).collect();
        let squares: f64 = residuals.iter().map(|[x, y]| x * x + y * y).sum();
        let rms_px = if picks.is_empty() { 0.0 } else { (squares / picks.len() as f64).sqrt() };
        Some(Located {
            pose,
            covariance,
            residuals,
            rms_px,
            reduced_chi2: 1.0,
            left_out: None,
            other: None,
            edges: None,
        })
    }
}

/// The pose of a photograph by its name; COLMAP's may begin with folders, as long as no other one
/// is called the same.
fn found<'a>(poses: &'a BTreeMap<String, Pose>, photo: &str) -> Option<&'a Pose> {
    if let Some(pose) = poses.get(photo) {
        return Some(pose);
    }
    let mut all = poses.iter().filter(|(name, _)| is_same_photo(name, photo));
    let (_, pose) = all.next()?;
    all.next().is_none().then_some(pose)
}

/// The point nearest to all rays; `None` of one, or of parallel ones.
fn meet(rays: &[(&Pose, &Pick)]) -> Option<DVec3> {
    let (mut across, mut side) = (Matrix3::zeros(), Vector3::zeros());
    for (pose, pick) in rays {
        let way = Vector3::from(pose.ray(pick.pixel)?.to_array());
        let out = Matrix3::identity() - way * way.transpose();
        across += out;
        side += out * Vector3::from(pose.position.to_array());
    }
    // Two rays that differ by an angle φ leave a least eigenvalue of about φ²/2.
    let least = across.symmetric_eigenvalues().min();
    let point = across.try_inverse()? * side;
    (rays.len() > 1 && least > 1e-6).then(|| DVec3::from_array(point.into()))
}

type Fault = (usize, String);

fn lines<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, Fault>) -> Result<T, SeriesError> {
    let denied = |source| SeriesError::Denied { path: path.to_owned(), source };
    let bytes = access::read(path, LONGEST).map_err(denied)?;
    parse(&String::from_utf8_lossy(&bytes)).map_err(|(line, what)| SeriesError::Bad {
        path: path.to_owned(),
        line,
        what,
    })
}

/// Numbered lines without comments.
fn numbered(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.starts_with('#'))
}

fn numbers<const N: usize>(words: &[&str], line: usize) -> Result<[f64; N], Fault> {
    let mut all = [0.0; N];
    for (k, value) in all.iter_mut().enumerate() {
        let number = words.get(k).and_then(|w| w.parse::<f64>().ok()).filter(|x| x.is_finite());
        *value = number.ok_or_else(|| {
            (line, format!("number {} is missing or none: export the model again", k + 1))
        })?;
    }
    Ok(all)
}

/// What a camera is but for its place.
#[derive(Debug, Clone, Copy)]
struct Optics {
    focal_px: f64,
    lens: Lens,
    size: [u32; 2],
}

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS…` a line.
fn cameras(text: &str) -> Result<HashMap<String, Optics>, Fault> {
    let mut cameras = HashMap::new();
    for (line, text) in numbered(text) {
        let words: Vec<&str> = text.split_whitespace().collect();
        let [id, model, _, _, params @ ..] = &words[..] else {
            if words.is_empty() {
                continue;
            }
            return Err((line, "is no camera: export the model again".into()));
        };
        let [width, height] = numbers::<2>(&words[2..], line)?;
        let sides = 1.0..=65_536.0;
        if !(sides.contains(&width) && sides.contains(&height)) {
            return Err((line, format!("a picture of {width} × {height} pixels is none")));
        }
        let one = |[f, x, y]: [f64; 3]| [f, f, x, y];
        let ([fx, fy, cx, cy], [k1, k2, p1, p2]) = match *model {
            "SIMPLE_PINHOLE" => (one(numbers(params, line)?), [0.0; 4]),
            "PINHOLE" => (numbers(params, line)?, [0.0; 4]),
            "SIMPLE_RADIAL" => {
                let [f, x, y, k1] = numbers(params, line)?;
                ([f, f, x, y], [k1, 0.0, 0.0, 0.0])
            }
            "RADIAL" => {
                let [f, x, y, k1, k2] = numbers(params, line)?;
                ([f, f, x, y], [k1, k2, 0.0, 0.0])
            }
            "OPENCV" => {
                let [fx, fy, x, y, k1, k2, p1, p2] = numbers(params, line)?;
                ([fx, fy, x, y], [k1, k2, p1, p2])
            }
            other => {
                return Err((
                    line,
                    format!(
                        "camera model {other} is not read: align the photographs with --ImageReader.camera_model OPENCV, or one of PINHOLE, SIMPLE_RADIAL and RADIAL"
                    ),
                ));
            }
        };
        if !(fx > 0.0 && fy > 0.0 && (fx / fy - 1.0).abs() <= SQUARE) {
            return Err((
                line,
                format!(
                    "focal lengths {fx} and {fy} px are not of square pixels: align the photographs with --ImageReader.camera_model RADIAL"
                ),
            ));
        }
        let centre = [(cx - 0.5 * width) / width, (cy - 0.5 * height) / width];
        let [k1, k2, p1, p2] = [k1, k2, p1, p2].map(|k| k as f32);
        let lens = Lens { k1, k2, p1, p2, centre: centre.map(|c| c as f32) };
        let optics =
            Optics { focal_px: 0.5 * (fx + fy), lens, size: [width as u32, height as u32] };
        cameras.insert((*id).to_owned(), optics);
    }
    Ok(cameras)
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and a line of points that is left out.
fn images(text: &str, cameras: &HashMap<String, Optics>) -> Result<BTreeMap<String, Pose>, Fault> {
    let mut poses = BTreeMap::new();
    let mut rest = numbered(text);
    while let Some((line, text)) = rest.next() {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let _points = rest.next();
        let [w, x, y, z, tx, ty, tz] = numbers::<7>(words.get(1..).unwrap_or_default(), line)?;
        let optics = words.get(8).and_then(|id| cameras.get(*id));
        let (Some(optics), Some(_)) = (optics, words.get(9)) else {
            return Err((line, "its camera is not in cameras.txt, or it has no name".into()));
        };
        let turn = DQuat::from_xyzw(x, y, z, w);
        if !(0.5..=2.0).contains(&turn.length()) {
            return Err((line, "its quaternion is no rotation: export the model again".into()));
        }
        let rotation = DMat3::from_quat(turn.normalize());
        let position = -(rotation.transpose() * DVec3::new(tx, ty, tz));
        let name = words[9..].join(" ");
        let Optics { focal_px, lens, size } = *optics;
        poses.insert(name, Pose::new(position, rotation, focal_px, lens, size));
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    /// Three cameras that look at the origin from 4 m.
    fn planted() -> [Pose; 3] {
        let lens = Lens { k1: -0.05, k2: 0.01, p1: 0.001, p2: -0.002, centre: [0.01, -0.005] };
        [[0.0, 0.0], [1.5, 0.5], [-1.0, -0.7]].map(|[x, y]| {
            let forward = -DVec3::new(x, y, 4.0).normalize();
            let right = forward.cross(DVec3::Y).normalize();
            let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
            Pose::new(DVec3::new(x, y, 4.0), rotation, 1800.0, lens, [2000, 1500])
        })
    }

    fn frame() -> Similarity {
        Similarity {
            scale: 0.3,
            rotation: DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.8),
            shift: DVec3::new(3.0, -1.0, 2.0),
        }
    }

    fn name(i: usize) -> String {
        format!("wall {i}.jpg")
    }

    const PLACES: [[f64; 3]; 6] = [
        [0.3, 0.1, 0.0],
        [-0.4, 0.2, 0.1],
        [0.1, -0.5, -0.2],
        [0.0, 0.4, 0.3],
        [-0.5, -0.4, -0.3],
        [0.5, 0.5, -0.1],
    ];

    /// Places as the planted cameras draw them, each wrong by so many metres in each direction.
    fn picks(wrong_m: f64, seed: u64) -> Vec<PickedIn> {
        let noise = |k: u64| wrong_m * Key::new(seed, k).normal(0);
        let of = |(k, place): (u64, &[f64; 3])| {
            let seen = DVec3::from_array(*place);
            let off = DVec3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
            planted().into_iter().enumerate().map(move |(i, pose)| {
                let pixel = pose.project(seen).unwrap();
                PickedIn { photo: Some(name(i)), pick: Pick { pixel, place: seen + off } }
            })
        };
        (0..).zip(&PLACES).flat_map(of).collect()
    }

    /// Cameras written as COLMAP would in a frame of its own, turned, scaled and shifted: reading
    /// and matching brings them back.
    #[test]
    fn a_series_comes_back_into_the_scenes_frame() {
        let (cx, cy, mut images_text) = (1020, 740, String::from("# images\n"));
        let cameras_text =
            format!("# cameras\n1 OPENCV 2000 1500 1800 1800 {cx} {cy} -0.05 0.01 0.001 -0.002\n");
        for (i, pose) in planted().into_iter().enumerate() {
            let rotation = pose.rotation * frame().rotation.transpose();
            let t = -(rotation * frame().apply(pose.position));
            let [x, y, z, w] = DQuat::from_mat3(&rotation).to_array();
            let line = format!("{i} {w} {x} {y} {z} {} {} {} 1 {}", t.x, t.y, t.z, name(i));
            images_text += &format!("{line}\n1 2 3\n");
        }
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("cameras.txt"), cameras_text).unwrap();
        std::fs::write(folder.path().join("images.txt"), images_text).unwrap();
        let series = Series::read(folder.path()).unwrap();
        let placed = series.placed(&picks(0.0, 0)).unwrap();
        assert!(placed.rms_m < 1e-5, "{}", placed.rms_m);
        for (i, pose) in planted().into_iter().enumerate() {
            let found = &placed.poses[&name(i)];
            assert!(found.position.distance(pose.position) < 1e-4);
            assert!(found.rotation.abs_diff_eq(pose.rotation, 1e-5));
        }
        let two = &picks(0.0, 0)[..6];
        assert!(matches!(series.placed(two), Err(SeriesError::TooFew(2))));
    }

    /// Places of the model that are wrong by 5 mm: the cameras' errors scatter as stated, by the
    /// mean of their χ² with six degrees of freedom (F: 6 · 11/9 for eleven of the residuals).
    #[test]
    fn a_series_is_as_wrong_as_it_says() {
        let poses = planted().into_iter().enumerate().map(|(i, pose)| (name(i), pose)).collect();
        let series = Series { poses };
        let (mut sum, mut count) = (0.0, 0.0);
        for seed in 0..300 {
            let placed = series.placed(&picks(0.005, 1 + seed)).unwrap();
            for (i, planted) in planted().into_iter().enumerate() {
                let found = placed.located(&name(i), &[]).unwrap();
                let turn = found.pose.rotation * planted.rotation.transpose();
                let turn = DQuat::from_mat3(&turn).to_scaled_axis();
                let shift = found.pose.position - planted.position;
                let off = nalgebra::Vector6::from_column_slice(
                    &[turn.to_array(), shift.to_array()].concat(),
                );
                let known = found.covariance.fixed_view::<6, 6>(0, 0).into_owned();
                sum += (off.transpose() * known.try_inverse().unwrap() * off)[0];
                count += 1.0;
            }
        }
        let (mean, expected) = (sum / count, 6.0 * 11.0 / 9.0);
        assert!((mean / expected - 1.0).abs() < 0.15, "{mean} {expected}");
        assert!(series.placed(&picks(0.0, 0)).unwrap().located("other.jpg", &[]).is_none());
    }

    #[test]
    fn what_cannot_be_read_says_where() {
        for (text, word) in [
            ("1 FISHEYE 10 10 1 2 3", "OPENCV"),
            ("\n1 PINHOLE 10 10 100 150 5 5", "square"),
            ("1 PINHOLE 10 10 100", "number 2"),
            ("1 PINHOLE 1e9 10 100 100 5 5", "pixels"),
        ] {
            let (_, what) = cameras(text).unwrap_err();
            assert!(what.contains(word), "{what}");
        }
        assert!(images("1 0 0 0 0 0 0 0 7 a.jpg", &HashMap::new()).is_err());
    }
}
