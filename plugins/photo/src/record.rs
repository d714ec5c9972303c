//! What is written of a photograph that was placed. Part of schema `intrados.photo/1`.

use serde::Serialize;

use crate::{
    Located, Pick, pose::UNKNOWNS, relight::ReflectanceMap, site::Sight, site::SightError,
};

/// A pose with its errors.
#[derive(Debug, Clone, Serialize)]
pub struct PoseRecord {
    /// Pinhole, m.
    pub position_m: [f64; 3],
    /// Standard errors of the position, m.
    pub position_error_m: [f64; 3],
    /// The camera's right, down and forward in the world.
    pub axes: [[f64; 3]; 3],
    /// Standard errors of turns about these, degrees.
    pub turn_error_deg: [f64; 3],
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Its standard error, as a share.
    pub focal_rel_error: f64,
    /// Field of view across, degrees.
    pub fov_deg: f64,
    /// Brown's k1, k2, p1, p2.
    pub lens: [f32; 4],
    /// Where the optical axis meets the picture, from its centre, in widths.
    pub lens_centre: [f32; 2],
    /// Standard error of k1.
    pub k1_error: f64,
    /// By rows: turns (rad), position (m), ln focal length, k1.
    pub covariance: [[f64; UNKNOWNS]; UNKNOWNS],
    /// Root mean square of the picks' distances, pixels.
    pub rms_px: f64,
    /// χ² over its degrees of freedom.
    pub reduced_chi2: f64,
    /// The picks.
    pub picks: Vec<PickRecord>,
    /// What the model's edges made of what the picks say; `None` where they were not asked.
    pub edges: Option<EdgesRecord>,
    /// Where else the camera may have stood, m.
    pub other_position_m: Option<[f64; 3]>,
}

/// A pick and how far off it is.
#[derive(Debug, Clone, Serialize)]
pub struct PickRecord {
    /// Where it was picked, pixels.
    pub pixel: [f64; 2],
    /// m.
    pub place_m: [f64; 3],
    /// Where it is drawn less where it was picked, pixels.
    pub residual_px: [f64; 2],
    /// Whether it contradicts all others and does not count.
    pub left_out: bool,
}

/// What the model's edges in the photograph made of a picked pose.
#[derive(Debug, Clone, Serialize)]
pub struct EdgesRecord {
    /// Straight edges of members that the camera sees at some length.
    pub seen: usize,
    /// How many of them the photograph shows where one pose draws them.
    pub answered: usize,
    /// Root mean square of what these are off in the end, pixels.
    pub off_px: f64,
    /// Root mean square of how far the picked places moved in the picture, pixels.
    pub moved_px: f64,
    /// Whether they improved the pose.
    pub improved: bool,
    /// The same in one sentence.
    pub line: String,
}

/// A face of a member in a photograph, about the middle of what is seen of it.
#[derive(Debug, Clone, Serialize)]
pub struct FaceRecord {
    /// Id of the member.
    pub member: String,
    /// Name of the face.
    pub face: String,
    /// From the camera, m.
    pub distance_m: f64,
    /// Between the ray and the normal, degrees.
    pub obliqueness_deg: f64,
    /// mm that a pixel of the photograph covers around the axis, and along it.
    pub photo_mm_px: [f64; 2],
    /// Standard errors of these, as shares.
    pub photo_mm_px_rel_error: Option<[f64; 2]>,
    /// Standard error of the place on the face, around and along, mm.
    pub place_error_mm: Option<[f64; 2]>,
    /// Of the map, mm a pixel.
    pub map_mm_px: f64,
    /// Pixels of the map.
    pub map_size: [usize; 2],
    /// Across and along, m, of the map's upper left corner.
    pub map_corner_m: [f64; 2],
    /// Share of the map that is known.
    pub known: f64,
    /// Share of the map of reflectance that is known; `None` where the light was not taken off.
    pub relit_known: Option<f64>,
    /// Median standard error of the logarithm of reflectance, green.
    pub relit_log_error: Option<f64>,
}

impl PoseRecord {
    /// What is written of a pose that was found from `picks`.
    #[must_use]
    pub fn new(located: &Located, picks: &[Pick]) -> Self {
        let Located { pose, covariance, .. } = located;
        let error = |k: usize| covariance[(k, k)].max(0.0).sqrt();
        let pick = |(i, (pick, residual)): (usize, (&Pick, &[f64; 2]))| PickRecord {
            pixel: pick.pixel,
            place_m: pick.place.to_array(),
            residual_px: *residual,
            left_out: located.left_out == Some(i),
        };
        Self {
            position_m: pose.position.to_array(),
            position_error_m: [3, 4, 5].map(error),
            axes: pose.axes().map(|axis| axis.to_array()),
            turn_error_deg: [0, 1, 2].map(|k| error(k).to_degrees()),
            focal_px: pose.focal_px,
            focal_rel_error: error(6),
            fov_deg: f64::from(pose.camera("").fov_deg),
            lens: [pose.lens.k1, pose.lens.k2, pose.lens.p1, pose.lens.p2],
            lens_centre: pose.lens.centre,
            k1_error: error(7),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
            rms_px: located.rms_px,
            reduced_chi2: located.reduced_chi2,
            picks: picks.iter().zip(&located.residuals).enumerate().map(pick).collect(),
            edges: located.edges.map(|edges| EdgesRecord {
                seen: edges.seen,
                answered: edges.answered,
                off_px: edges.off_px,
                moved_px: edges.moved_px,
                improved: edges.kept.is_none(),
                line: edges.line(),
            }),
            other_position_m: located.other.map(|other| other.position.to_array()),
        }
    }
}

impl FaceRecord {
    /// What is written of a face and of its map.
    #[must_use]
    pub fn new(
        [member, face]: [&str; 2],
        sight: &Sight,
        error: Option<SightError>,
        map: &crate::FaceMap,
    ) -> Self {
        Self {
            member: member.to_owned(),
            face: face.to_owned(),
            distance_m: sight.distance_m,
            obliqueness_deg: sight.cosine.clamp(-1.0, 1.0).acos().to_degrees(),
            photo_mm_px: sight.mm_px,
            photo_mm_px_rel_error: error.map(|e| e.rel_mm_px),
            place_error_mm: error.map(|e| e.place_mm),
            map_mm_px: map.mm_px,
            map_size: map.size,
            map_corner_m: map.corner,
            known: map.known(),
            relit_known: None,
            relit_log_error: None,
        }
    }

    /// The same with the map of reflectance.
    #[must_use]
    pub fn relit(self, map: &ReflectanceMap) -> Self {
        Self {
            relit_known: Some(map.face.known()),
            relit_log_error: map.median_log_error().map(f64::from),
            ..self
        }
    }
}
