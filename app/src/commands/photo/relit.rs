//! `intrados photo --relight`: the light taken off.

use std::collections::BTreeMap;

use glam::Vec3;
use intrados_photo::{
    Located, Photograph,
    relight::{
        Light, ReflectanceMap, RelightError, RelightSettings, Relit, RelitRecord, merged, relight,
    },
};
use intrados_stage::file::{Set, file_name};
use serde::Serialize;

use super::Work;
use crate::{args::TakenOff, failure::Failure, output::Files, picture::png_of_deep_colours};

/// Most pixels of all maps together that are kept to be merged: 2 GB.
const MOST_KEPT: usize = 1 << 26;
/// What of the error's map is white: an error of 100 %.
const WHITE: f32 = 65535.0;

/// Maps that wait to be merged, by member and face, with their photographs.
#[derive(Debug, Default)]
pub(super) struct Kept {
    maps: BTreeMap<[String; 2], (Vec<String>, Vec<ReflectanceMap>)>,
    pixels: usize,
}

impl Kept {
    pub(super) fn keep(&mut self, face: [&str; 2], photo: &str, map: ReflectanceMap) {
        self.pixels += map.log_error.len();
        if self.pixels > MOST_KEPT {
            tracing::warn!(
                "{photo}: its map of {} {} is not merged with others, they are too large together: choose more mm a pixel",
                face[0],
                face[1]
            );
            self.pixels -= map.log_error.len();
            return;
        }
        let (photos, maps) = self.maps.entry(face.map(String::from)).or_default();
        photos.push(photo.to_owned());
        maps.push(map);
    }
}

/// A face of which the maps of several photographs were merged.
#[derive(Debug, Serialize)]
pub(super) struct MergedFace {
    member: String,
    face: String,
    photos: Vec<String>,
    /// By what the map of each photograph was multiplied; `None`: it shares too little with the
    /// others and is left out.
    scales: Vec<Option<[f64; 3]>>,
    /// Of what overlaps: χ² a degree of freedom.
    reduced_chi2: f64,
    map_size: [usize; 2],
    /// Across and along, m, of the map's upper left corner.
    map_corner_m: [f64; 2],
    known: f64,
    /// Median standard error of the logarithm of reflectance, green.
    log_error: Option<f64>,
}

impl MergedFace {
    pub(super) fn line(&self) -> String {
        let used = self.scales.iter().flatten().count();
        format!(
            "{} {}: {used} of {} maps merged, {:.0} % known, reflectance ± {:.1} %, χ² {:.2}\n",
            self.member,
            self.face,
            self.photos.len(),
            100.0 * self.known,
            100.0 * self.log_error.unwrap_or(f64::NAN),
            self.reduced_chi2,
        )
    }
}

impl Work<'_> {
    /// Takes the light off, if somebody asks; or why it stays.
    pub(super) fn relight(
        &self,
        name: &str,
        shot: (&Photograph, &Located),
    ) -> Result<(Option<Relit>, Option<String>), Failure> {
        let asked = self.args.relight || self.args.read;
        let light = match self.args.light {
            TakenOff::All => Light::All,
            TakenOff::Direct => Light::Direct,
            TakenOff::None => return Ok((None, None)),
        };
        if !asked {
            return Ok((None, None));
        }
        let settings = RelightSettings {
            samples: self.args.spp,
            seed: self.args.seed,
            shadow_error_m: 1e-3 * self.args.shadow_error_mm,
            light,
            ..RelightSettings::default()
        };
        let _progress = self.session.watch(format!("taking the light off {name}"));
        match relight(&self.site, &self.scene, shot, &settings, &self.session.job) {
            Ok(relit) => Ok((Some(relit), None)),
            Err(RelightError::Cancelled(_)) => Err(Failure::Interrupted),
            Err(error) => {
                tracing::warn!("{name}: its light is not taken off: {error}");
                Ok((None, Some(error.to_string())))
            }
        }
    }

    /// A map of reflectance, in sRGB with sixteen bits, black where it is unknown; its world file;
    /// and its standard error: white is 100 % or unknown.
    pub(super) fn write_relit(
        &self,
        files: &mut Set,
        map: &ReflectanceMap,
        stem: &str,
        photo: &str,
    ) -> Result<(), Failure> {
        let mut facts = self.facts(photo);
        facts.push(("intrados.mmPerPixel", map.face.mm_px.to_string()));
        let size = map.face.size.map(|n| n as u32);
        let colours: Vec<[u16; 3]> =
            map.face.light.iter().map(|rho| rho.map_or([0; 3], deep_srgb)).collect();
        let mut about = facts.clone();
        about.push(("intrados.unit", "relative reflectance, sRGB".into()));
        let name = format!("{stem}_relit.png");
        files.write(name, &png_of_deep_colours(size, &colours, &about)?)?;
        files.write(format!("{stem}_relit.pgw"), map.face.world_file().as_bytes())?;
        let share = |e: f32| (WHITE * e.clamp(0.0, 1.0)).round() as u16;
        let errors: Vec<[u16; 3]> = map.log_error.iter().map(|e| e.to_array().map(share)).collect();
        facts.push(("intrados.unit", "standard error of ln reflectance, 65535 is 1".into()));
        let name = format!("{stem}_relit_error.png");
        files.write(name, &png_of_deep_colours(size, &errors, &facts)?)
    }

    /// Merges the maps of faces that several photographs show.
    pub(super) fn merge(&self, kept: &Kept, files: &mut Set) -> Result<Vec<MergedFace>, Failure> {
        let mut all = Vec::new();
        for ([member, face], (photos, maps)) in kept.maps.iter().filter(|(_, of)| of.1.len() > 1) {
            let Some(one) = merged(maps) else { continue };
            let stem = format!("{}_{face}_merged", file_name(member));
            self.write_relit(files, &one.map, &stem, &photos.join(" "))?;
            for (photo, _) in photos.iter().zip(&one.scales).filter(|(_, s)| s.is_none()) {
                tracing::warn!(
                    "{photo}: its map of {member} {face} shares too little with the others and is not merged"
                );
            }
            all.push(MergedFace {
                member: member.clone(),
                face: face.clone(),
                photos: photos.clone(),
                scales: one.scales.clone(),
                reduced_chi2: one.reduced_chi2,
                map_size: one.map.face.size,
                map_corner_m: one.map.face.corner,
                known: one.map.face.known(),
                log_error: one.map.median_log_error().map(f64::from),
            });
        }
        Ok(all)
    }
}

fn deep_srgb(rho: Vec3) -> [u16; 3] {
    rho.to_array().map(|linear| {
        let c = linear.clamp(0.0, 1.0);
        let s = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (WHITE * s).round() as u16
    })
}

/// What was fitted, for people.
pub(super) fn lines(relit: &RelitRecord) -> String {
    let mut text = String::new();
    for lamp in &relit.lamps {
        let value = |c: usize| format!("{:.3} ± {:.3}", lamp.strength[c], lamp.strength_error[c]);
        let names = lamp.lamps.join(" + ");
        text +=
            &format!("light of {names}: red {}, green {}, blue {}\n", value(0), value(1), value(2));
        if lamp.lamps.len() > 1 {
            text += "  (the photograph cannot tell these apart)\n";
        }
    }
    for name in &relit.unseen {
        text += &format!("light of {name}: none reaches what is seen, nothing is known of it\n");
    }
    let [v1, v2] = relit.vignetting;
    let [e1, e2] = relit.vignetting_error;
    text += &format!(
        "vignetting 1 + ({v1:.3} ± {e1:.3}) r² + ({v2:.3} ± {e2:.3}) r⁴; {:.0} % of light on members is reflected; {:.0} % of their pixels unknown; scatter of what was expected {:.1} %\n",
        100.0 * relit.reflected_share,
        100.0 * relit.unknown,
        100.0 * relit.residual_scatter[1],
    );
    text
}
