//! The veil of scattered photons over the projections: Monte Carlo in the specimen's outline and bars, at a few views, on a coarse grid of the panel.

use std::f64::consts::TAU;

use glam::DVec3;
use intrados_stage::Job;

use super::{Protocol, ScanError, Target};
use crate::{
    correct::{Estimate, Patch},
    physics::{Library, Matter, Model},
    primary::primary_at,
    scatter::image,
    specimen::{Shape, Solid, Specimen, Substance, concrete::Outline},
};

/// How far beyond the beam photons wander and come back, m.
const BEYOND: f64 = 0.15;
/// Most bars that scatter by themselves.
const BARS: usize = 40;

/// How scatter is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VeilSettings {
    /// Views of a turn.
    pub views: usize,
    /// Columns and rows of the coarse grid.
    pub pixels: [u32; 2],
    /// Walks from the tube in each view.
    pub walks: u64,
    /// Pixels that each collision is linked with.
    pub links: usize,
}

impl Default for VeilSettings {
    fn default() -> Self {
        Self { views: 12, pixels: [24, 3], walks: 1 << 15, links: 4 }
    }
}

/// Scatter of all views.
#[derive(Debug, Clone)]
pub struct Veil {
    /// Scatter over the open beam.
    pub estimate: Estimate,
    /// Scatter over primary in the middle of the panel: means over the views.
    pub to_primary: f64,
    /// Root mean square of the relative standard errors of the patches.
    pub rel_error: f64,
}

impl Veil {
    /// Walks.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn cast(target: &Target, protocol: &Protocol, settings: &VeilSettings, seed: u64, job: &Job) -> Result<Self, ScanError> {
        let specimen = solids(target, protocol)?;
        let pixels = [settings.pixels[0].min(protocol.orbit.bins() as u32), settings.pixels[1].min(protocol.orbit.rows() as u32)];
        let (mut patches, mut squares, mut count) = (Vec::new(), 0.0, 0.0);
        // In the middle of the panel, over all views: scatter over the open beam, primary, open beam.
        let (mut veiled, mut straight, mut all) = (0.0, 0.0, 0.0);
        for view in 0..settings.views {
            job.relabel(format!("scatter, view {} of {}", view + 1, settings.views));
            let angle = TAU * view as f64 / settings.views as f64;
            let scanner = protocol.scanner(pixels, angle);
            let scatter = image(&specimen, &scanner, None, settings.links, settings.walks, seed.wrapping_add(view as u64) ^ 0x5ca7, job)?;
            let mut patch = Patch { angle, value: Vec::new(), error: Vec::new() };
            for row in 0..pixels[1] {
                for column in 0..pixels[0] {
                    // Columns of the walks' panel run the other way.
                    let bin = row * pixels[0] + (pixels[0] - 1 - column);
                    let open = primary_at(&specimen, &scanner, scanner.panel.place(bin, [0.5; 2]))[1];
                    let reading = scatter.reading(bin as usize);
                    patch.value.push((reading.mean / open) as f32);
                    patch.error.push((reading.std_error / open) as f32);
                    if reading.mean > 0.0 {
                        squares += (reading.std_error / reading.mean).powi(2);
                        count += 1.0;
                    }
                }
            }
            // Over the middle patch, so that no single bar decides.
            let (row, column) = (pixels[1] / 2, pixels[0] / 2);
            for i in 0..9 {
                let p = scanner.panel.place(row * pixels[0] + column, [(f64::from(i) + 0.5) / 9.0, 0.5]);
                let [primary, open] = primary_at(&specimen, &scanner, p);
                (straight, all) = (straight + primary / 9.0, all + open / 9.0);
            }
            veiled += f64::from(patch.value[(row * pixels[0] + pixels[0] - 1 - column) as usize]);
            patches.push(patch);
        }
        let size = [pixels[1] as usize, pixels[0] as usize];
        let estimate = Estimate::new(size, patches).map_err(ScanError::Bad)?;
        let rel_error: f64 = if count > 0.0 { (squares / count).sqrt() } else { 1.0 };
        Ok(Self { estimate, to_primary: veiled / settings.views as f64 * all / straight, rel_error })
    }
}

/// Outline and bars as solids: mean concrete, taller than the beam.
fn solids(target: &Target, protocol: &Protocol) -> Result<Specimen, ScanError> {
    let library = Library::builtin()?;
    let recipe = &target.concrete.recipe;
    let materials = vec![Matter::new(&library, "concrete", Model::Bound)?, Matter::new(&library, "steel", Model::Bound)?];
    let (_, rock) = recipe.rock.material();
    let [void, _] = target.painted.voids;
    let air = void as f64 / (target.painted.points as f64).max(1.0) + target.concrete.fine_air;
    let density = (recipe.share * rock + (1.0 - recipe.share) * 1900.0) * (1.0 - air);
    let palette = vec![Substance { material: 0, density }, Substance { material: 1, density: 7850.0 }];
    // A core that is lower than the beam ends where it ends.
    let beam = protocol.height(2.0 * recipe.outline.reach());
    let half = if recipe.height < beam { 0.5 * recipe.height } else { 0.5 * beam + BEYOND };
    let (base, top) = (DVec3::Z * -half, DVec3::Z * half);
    let body = match recipe.outline {
        Outline::Round(radius) => Shape::Cylinder { base, top, radius },
        Outline::Rectangle([a, b]) => Shape::Box([DVec3::new(-a, -b, -half), DVec3::new(a, b, half)]),
    };
    let mut solids = vec![Solid { shape: body, label: 0 }];
    for bar in recipe.bars.iter().filter(|b| b.line.len() == 2).take(BARS) {
        let (a, b) = (bar.line[0], bar.line[1]);
        let within = |p: DVec3| p.z.abs() <= half && recipe.outline.within(p) > 0.0;
        let (low, high) = if a.z < b.z { (a, b) } else { (b, a) };
        let cut =
            |p: DVec3, q: DVec3, z: f64| if (q.z - p.z).abs() > 1e-9 { p + (q - p) * ((z - p.z) / (q.z - p.z)).clamp(0.0, 1.0) } else { p };
        let (base, top) = (cut(low, high, -half), cut(low, high, half));
        if within(base) && within(top) && top.z - base.z > 0.01 {
            let radius = bar.radius * (1.0 - bar.loss).max(0.01).sqrt();
            solids.push(Solid { shape: Shape::Cylinder { base, top, radius }, label: 1 });
        }
    }
    Ok(Specimen::solids(materials, palette, solids)?)
}
