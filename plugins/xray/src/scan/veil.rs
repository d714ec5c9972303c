//! The veil of scattered photons over the projections: Monte Carlo in the specimen's outline and bars, at a few views, on a coarse grid of the panel.

use std::f64::consts::TAU;

use glam::DVec3;
use intrados_stage::{Job, random::Key};
use intrados_transport::{Schedule, Steering};

use super::{Protocol, ScanError, Target};
use crate::{
    correct::{Estimate, Patch},
    physics::{Library, Matter, Model},
    primary::primary_at,
    scanner::Scanner,
    scatter::{ScatterImage, image},
    specimen::{Shape, Solid, Specimen, Substance, concrete::Outline},
    steer::{Guide, learn},
};

/// How far beyond the beam photons wander and come back, m.
const BEYOND: f64 = 0.15;
/// Most bars that scatter by themselves.
const BARS: usize = 40;

/// Largest relative error of plain walks that is not worth steering, and what a slice does not show: so much of the primary.
const PLAIN: f64 = 0.04;
const UNSEEN: f64 = 3e-3;
/// One in so many walks is a pilot's.
const PILOT: u64 = 8;
/// Walks come in batches.
const BATCH: u64 = 4096;
/// How long is learnt in each view.
const LESSONS: Schedule = Schedule { first: 4096, rounds: 3 };

/// How scatter is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VeilSettings {
    /// Views of a turn.
    pub views: usize,
    /// Columns of the coarse grid; its pixels are as square as the panel allows.
    pub columns: u32,
    /// Walks from the tube in each view.
    pub walks: u64,
    /// Pixels that each collision is linked with.
    pub links: usize,
}

impl Default for VeilSettings {
    fn default() -> Self {
        Self { views: 8, columns: 24, walks: 1 << 17, links: 12 }
    }
}

impl VeilSettings {
    /// As fine as a scan has use for: of few views and pixels, fewer.
    #[must_use]
    pub fn of(protocol: &Protocol) -> Self {
        let usual = Self::default();
        let views = (protocol.orbit.views() / 45).clamp(3, usual.views);
        let columns = (protocol.orbit.bins() as u32 / 8).clamp(6, usual.columns);
        // The finer, the more walks for the same error of a patch.
        let walks = usual.walks * u64::from(columns) / u64::from(usual.columns);
        Self { views, columns, walks, ..usual }
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
    /// Independent walks for every seed. A pilot tells how many plain walks would do; where that is more than are to be had, as behind members and open panels, walks are steered by
    /// what the panel and the tube have learnt of each other.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn cast<const N: usize>(
        target: &Target,
        protocol: &Protocol,
        settings: &VeilSettings,
        seeds: [u64; N],
        job: &Job,
    ) -> Result<[Self; N], ScanError> {
        let specimen = solids(target, protocol)?;
        let (columns, rows) = (settings.columns.min(protocol.orbit.bins() as u32).max(1), protocol.orbit.rows() as u32);
        let pixels = [columns, (rows * columns).div_ceil(protocol.orbit.bins() as u32).clamp(1, rows)];
        let mut views: [Vec<View>; N] = std::array::from_fn(|_| Vec::new());
        let (mut steered, mut walks) = (false, (settings.walks / PILOT).max(1));
        for number in 0..settings.views {
            job.relabel(format!("scatter, view {} of {}", number + 1, settings.views));
            let angle = TAU * number as f64 / settings.views as f64;
            let scanner = protocol.scanner(pixels, angle);
            let walk = |guide: Option<&Guide>, walks: u64, seed: u64| {
                let seed = Key::new(seed, number as u64).bits(0).into();
                image(&specimen, &scanner, guide, settings.links, walks, seed, job)
            };
            if number == 0 {
                let pilot = View::new(&specimen, &scanner, angle, &walk(None, walks, seeds[0])?);
                let wanted = (UNSEEN * pilot.middle[1] / pilot.middle[0]).max(PLAIN);
                let enough = walks as f64 * (pilot.rel_error / wanted).powi(2);
                // No number: the pilot has seen nothing.
                steered = enough.is_nan() || enough > settings.walks as f64;
                walks = if steered { settings.walks } else { (enough as u64).next_multiple_of(BATCH).min(settings.walks) };
            }
            let guide = match steered {
                true => Some(learn(&specimen, &scanner, settings.links, number as u64, LESSONS, Steering::On, job)?),
                false => None,
            };
            for (views, seed) in views.iter_mut().zip(seeds) {
                views.push(View::new(&specimen, &scanner, angle, &walk(guide.as_ref(), walks, seed)?));
            }
        }
        let mut veils = Vec::with_capacity(N);
        for views in views {
            veils.push(Self::of(views, [pixels[1] as usize, pixels[0] as usize])?);
        }
        veils.try_into().map_err(|_| ScanError::Bad("no scatter".to_owned()))
    }

    fn of(views: Vec<View>, size: [usize; 2]) -> Result<Self, ScanError> {
        let mean = |of: &dyn Fn(&View) -> f64| views.iter().map(of).sum::<f64>() / views.len().max(1) as f64;
        let to_primary = mean(&|v| v.middle[0]) / mean(&|v| v.middle[1]);
        let rel_error = mean(&|v| v.rel_error * v.rel_error).sqrt();
        let estimate = Estimate::new(size, views.into_iter().map(|v| v.patch).collect()).map_err(ScanError::Bad)?;
        Ok(Self { estimate, to_primary, rel_error })
    }
}

/// Scatter of one view.
struct View {
    patch: Patch,
    /// Scatter and primary of the middle patch.
    middle: [f64; 2],
    rel_error: f64,
}

impl View {
    fn new(specimen: &Specimen, scanner: &Scanner, angle: f64, scatter: &ScatterImage) -> Self {
        let [columns, rows] = scanner.panel.pixels;
        let mut patch = Patch { angle, value: Vec::new(), error: Vec::new() };
        for row in 0..rows {
            // Columns of the walks' panel run the other way.
            for bin in (0..columns).rev().map(|column| row * columns + column) {
                let open = primary_at(specimen, scanner, scanner.panel.place(bin, [0.5; 2]))[1];
                let reading = scatter.reading(bin as usize);
                patch.value.push((reading.mean / open) as f32);
                patch.error.push((reading.std_error / open) as f32);
            }
        }
        // The primary over all of the middle patch, so that no single bar decides.
        let middle = rows / 2 * columns + columns / 2;
        let at = |i: u32| primary_at(specimen, scanner, scanner.panel.place(middle, [(f64::from(i) + 0.5) / 9.0, 0.5]))[0];
        let primary = (0..9).map(at).sum::<f64>() / 9.0;
        Self { patch, middle: [scatter.reading(middle as usize).mean, primary], rel_error: scatter.rel_error() }
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
