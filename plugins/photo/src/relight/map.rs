//! A face's reflectance, unrolled.

use glam::Vec3;
use intrados_stage::Job;

use super::{Relit, noise::is_exposed};
use crate::{
    FaceMap, Located, Photograph, Site,
    map::{Look, MapError, resampled, sample},
    site::SeenFace,
};

/// Light that stands out from the sensor's scatter by less than so many times is black.
const BLACK: f64 = 3.0;

/// A face's reflectance with its errors. Where it is unknown is what nobody saw, saw flatter than
/// 10°, burnt out, black, in the shadow, or at the rim of what hides it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflectanceMap {
    /// Relative reflectance, in place of light.
    pub face: FaceMap,
    /// Standard error of its logarithm, by channel; infinite where it is unknown.
    pub log_error: Vec<Vec3>,
    /// Of what goes around: how far it is around, m.
    pub(super) turn: Option<f64>,
}

impl ReflectanceMap {
    /// Light in place of reflectance, of no known error.
    pub(crate) fn plain(face: Option<FaceMap>) -> Self {
        let none = FaceMap { size: [0, 0], mm_px: 1.0, corner: [0.0; 2], light: Vec::new() };
        let face = face.unwrap_or(none);
        let log_error = vec![Vec3::INFINITY; face.light.len()];
        Self { face, log_error, turn: None }
    }

    /// Of green, over what is known.
    #[must_use]
    pub fn median_log_error(&self) -> Option<f32> {
        let known = self.log_error.iter().map(|e| e.y).filter(|e| e.is_finite());
        let mut all: Vec<f32> = known.collect();
        let middle = all.len() / 2;
        (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f32::total_cmp).1)
    }
}

impl Relit {
    /// The reflectance of a face in the photograph that this was found from, at `mm_px` millimetres
    /// a pixel; maps of one face at one scale lie on one grid.
    ///
    /// # Errors
    /// [`MapError`]: too many pixels, or cancelled.
    pub fn map(
        &self,
        site: &Site,
        seen: &SeenFace,
        (photograph, located): (&Photograph, &Located),
        mm_px: f64,
        job: &Job,
    ) -> Result<ReflectanceMap, MapError> {
        let m = 1e-3 * mm_px;
        let mut face = seen.face.clone();
        for [from, to] in [&mut face.across, &mut face.along] {
            (*from, *to) = ((*from / m).floor() * m, (*to / m).ceil() * m);
        }
        let corner = [face.across[0], face.along[1]];
        let Some(surface) = site.surface(seen.member) else {
            let face = FaceMap { size: [0, 0], mm_px, corner, light: Vec::new() };
            return Ok(ReflectanceMap { face, log_error: Vec::new(), turn: None });
        };
        let index = surface.faces.iter().position(|f| f.name == face.name);
        let of = |look: &Look| self.reflectance(photograph, look, [Some(seen.member), index]);
        let (size, found) = resampled(site, surface, &face, &located.pose, mm_px, job, of)?;
        let light = found.iter().map(|f| f.map(|(rho, _)| rho)).collect();
        let log_error = found.iter().map(|f| f.map_or(Vec3::INFINITY, |(_, e)| e)).collect();
        let turn = face.half_turn().map(|half| 2.0 * half);
        Ok(ReflectanceMap { face: FaceMap { size, mm_px, corner, light }, log_error, turn })
    }

    /// Reflectance at a pixel of a map, and the standard error of its logarithm: Var log ρ = Var
    /// log y + Var log ŷ, the latter by walks, fit and place.
    fn reflectance(
        &self,
        photograph: &Photograph,
        look: &Look,
        [member, face]: [Option<usize>; 2],
    ) -> Option<(Vec3, Vec3)> {
        let found = self.frame.between(&self.expected, look.at, |piece| {
            (piece.member, piece.face) == (member, face)
        })?;
        if found.iter().any(|f| !f.is_finite()) {
            return None;
        }
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
        for at in corners
            .map(|(s, t)| [0, 1].map(|k| look.at[k] + s * look.sides[0][k] + t * look.sides[1][k]))
        {
            let [x, y] = at.map(|c| c.max(0.0) as u32);
            photograph.light(x, y).filter(|light| is_exposed(*light))?;
        }
        let y = sample(photograph, look)?;
        // Photograph's pixels that a pixel of the map is the mean of.
        let [[a, b], [c, d]] = look.sides;
        let count = (a * d - b * c).abs().max(1.0);
        let (mut rho, mut error) = (Vec3::ZERO, Vec3::ZERO);
        for k in 0..3 {
            let light = f64::from(y[k]);
            let scatter2 = self.noise.variance(k, light) / count;
            if light * light <= BLACK * BLACK * scatter2 {
                return None;
            }
            rho[k] = (light / found[k]) as f32;
            error[k] = (scatter2 / (light * light) + found[3 + k]).sqrt() as f32;
        }
        Some((rho, error))
    }
}
