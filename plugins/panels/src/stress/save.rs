//! What the Stress tab shows, as files.

use std::path::Path;

use egui::ColorImage;
use intrados_mechanics::{
    analysis::Outcome,
    skin::{Skin, Snapshot},
    write::csv,
};

use crate::{export::write_png, lang::fixed, leaf::on_ground, legend::put_under};

/// What is written, by the ending of the file's name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The picture, as it is, with its legend.
    Picture,
    /// Every point of the surface at this moment.
    Table,
}

impl Kind {
    pub(super) fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "png" => Some(Self::Picture),
            "csv" => Some(Self::Table),
            _ => None,
        }
    }
}

/// Writes the picture on the window's background, its legend under it; `what` says what it shows.
pub(super) fn picture(
    image: ColorImage,
    background: egui::Color32,
    legend: &ColorImage,
    path: &Path,
    what: &str,
) -> Result<String, String> {
    let image = on_ground(image, background);
    write_png(&put_under(&image, legend), path, what).map_err(|e| e.to_string())?;
    Ok(format!("{}: {what}", path.display()))
}

/// How many points of the surface there are.
pub(super) fn points(skin: &Skin, shot: &Snapshot) -> usize {
    skin.rest.len().min(shot.displacement.len())
}

/// Writes position, displacement, stress, damage and crack width of all points of the surface;
/// `what` says how many and when.
pub(super) fn table(
    skin: &Skin,
    shot: &Snapshot,
    path: &Path,
    what: &str,
) -> Result<String, String> {
    let columns = [
        "x_m",
        "y_m",
        "z_m",
        "ux_m",
        "uy_m",
        "uz_m",
        "sxx_pa",
        "syy_pa",
        "szz_pa",
        "sxy_pa",
        "syz_pa",
        "szx_pa",
        "damage",
        "crack_width_m",
    ];
    let rows: Vec<Vec<f64>> = (0..points(skin, shot))
        .map(|v| {
            let place = skin.rest[v].to_array().into_iter().chain(shot.displacement[v].to_array());
            place
                .chain(shot.stress[v])
                .chain([shot.damage[v], shot.crack[v]])
                .map(f64::from)
                .collect()
        })
        .collect();
    csv(path, &columns, &rows).map_err(|e| e.to_string())?;
    Ok(format!("{}: {what}", path.display()))
}

/// One line on the whole life.
pub(super) fn summary(outcome: &Outcome, part: &str) -> Option<String> {
    let m = outcome.members.iter().find(|m| m.name == part)?;
    Some(tr!(
        "whole life: tension up to {} MPa, compression {} MPa, bars {} MPa, \
         damage {} ({} % of the volume above {}), cracks up to {} mm",
        fixed(m.peak_tension_pa / 1e6, 2),
        fixed(m.peak_compression_pa / 1e6, 1),
        fixed(m.peak_bar_stress_pa / 1e6, 0),
        fixed(m.max_damage, 2),
        fixed(100.0 * m.damaged_volume_fraction, 1),
        fixed(0.5, 1),
        fixed(1e3 * m.max_crack_width_m, 2)
    ))
}
