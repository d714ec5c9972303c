//! What the parts of it are worth: ablations, and the corrections one by one.

use intrados_stage::{Job, cpu_seconds};
use intrados_xray::{recon::nrmse_in, scan::Corrections};
use serde::Serialize;

use super::{
    ExperimentError,
    case::{Case, Cases},
    correct::{Care, STEERED, corrected_by, plain, scattered},
    ours::{self, Choice},
    reference::{Marks, otsu, sauvola, strongest},
    scan::{Made, make},
    scatter::Effort,
    score::scored,
};
use crate::{
    crack,
    detect::{Settings, median},
    grid::{Grid, Mask},
    network::Network,
    slice::Slice,
};

/// Plain walks that take as long as learning and steered walks do.
const UNSTEERED: Effort = Effort { walks: 5 << 15, steered: false, ..STEERED };

/// Scores of ours with a part left out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ablations {
    /// No scatter is taken off.
    pub without_scatter: f64,
    /// Scatter by walks that nothing steers, in the same time.
    pub without_steering: f64,
    /// The strong reference's threshold, and the ridge filter for cracks.
    pub without_network: f64,
    /// Relative standard error of the scatter: steered, not steered.
    pub scatter_error: [f64; 2],
    /// User and system time of both.
    pub scatter_seconds: [f64; 2],
}

fn judged(slice: &Slice, made: &Made, seed: u64) -> Result<f64, ExperimentError> {
    let network = Network::of_members().ok_or(ExperimentError::NoNetwork)?;
    Ok(scored(&ours::found(slice, network, &Choice::default())?, &made.truth, seed).score)
}

/// Ablations of one case, `full` its corrected slice.
pub(super) fn ablations(case: &Case, made: &Made, full: &Slice, job: &Job) -> Result<Ablations, ExperimentError> {
    job.relabel(format!("{}: ablations", case.id));
    let timed = |effort: Effort| {
        let begin = cpu_seconds();
        scattered(&made.scan, effort, job).map(|s| (s, cpu_seconds() - begin))
    };
    let ((steered, a), (plainly, b)) = (timed(STEERED)?, timed(UNSTEERED)?);
    let bare = Care { corrections: Corrections { scatter: false, ..Corrections::ALL }, ..Care::FULL };
    let without = corrected_by(&made.scan, bare, None, job)?;
    let unsteered = corrected_by(&made.scan, Care::FULL, Some(&plainly), job)?;
    Ok(Ablations {
        without_scatter: judged(&without, made, case.seed)?,
        without_steering: judged(&unsteered, made, case.seed)?,
        without_network: scored(&ridges(full), &made.truth, case.seed).score,
        scatter_error: [steered.rel_error, plainly.rel_error],
        scatter_seconds: [a, b],
    })
}

/// The strong reference's pores, and cracks by its rule and by the ridge filter.
fn ridges(slice: &Slice) -> Marks {
    let mut marks = sauvola(slice, &strongest());
    let otsu = super::reference::otsu_threshold(&slice.grey);
    let body = super::reference::body(&slice.grey, otsu);
    let matrix = median(slice.grey.data.iter().zip(&body.data).filter(|(_, b)| **b).map(|(v, _)| *v)).unwrap_or(1.0);
    let value = |(v, b): (&f32, &bool)| if *b { (v / matrix).min(Settings::default().ceiling) } else { 1.0 };
    let grey = Grid { data: slice.grey.data.iter().zip(&body.data).map(value).collect(), ..slice.grey };
    marks.cracks.unite(&crack::find(&grey, &body, 1.0, slice.pixel_mm, &crack::Settings::default()).mask);
    marks.objects.retain(|pixels| 2 * pixels.iter().filter(|i| marks.cracks.data[**i]).count() <= pixels.len());
    marks.pores.data.fill(false);
    marks.objects.iter().flatten().for_each(|i| marks.pores.data[*i] = true);
    marks
}

/// What a slice is worth with some corrections.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worth {
    /// Which corrections.
    pub name: &'static str,
    /// Root mean square error of the concrete over its largest attenuation, mean of the cases. Steel and two pixels round it do not count.
    pub nrmse: f64,
    /// Score of ours.
    pub ours: f64,
    /// Score of Otsu's threshold on the same slices.
    pub otsu: f64,
}

/// Each correction left out, and none made, over some cases.
///
/// # Errors
/// Cancelled, or the program's tables are damaged.
pub fn corrections(chosen: &[Case], cases: &Cases, job: &Job) -> Result<Vec<Worth>, ExperimentError> {
    let all = Corrections::ALL;
    let named = [
        ("all", all),
        ("without scatter", Corrections { scatter: false, ..all }),
        ("without hardening", Corrections { hardening: false, ..all }),
        ("without rings", Corrections { rings: false, ..all }),
        ("without metal", Corrections { metal: false, ..all }),
        ("none, axis not found", Corrections::NONE),
    ];
    let mut sums = vec![[0.0; 3]; named.len()];
    for case in chosen {
        let made = make(case, cases, job)?;
        let scatter = scattered(&made.scan, STEERED, job)?;
        job.relabel(format!("{}: corrections", case.id));
        for (sum, (_, corrections)) in sums.iter_mut().zip(&named) {
            let care = Care { corrections: *corrections, ..Care::FULL };
            let slice = match *corrections {
                Corrections::NONE => plain(&made.scan, job)?,
                _ => corrected_by(&made.scan, care, Some(&scatter).filter(|_| corrections.scatter), job)?,
            };
            sum[0] += error(&slice, &made);
            sum[1] += judged(&slice, &made, case.seed)?;
            sum[2] += scored(&otsu(&slice), &made.truth, case.seed).score;
        }
    }
    let n = chosen.len().max(1) as f64;
    Ok(named.iter().zip(sums).map(|((name, _), [e, o, t])| Worth { name, nrmse: e / n, ours: o / n, otsu: t / n }).collect())
}

fn error(slice: &Slice, made: &Made) -> f64 {
    let far: Mask = made.truth.steel.map(|v| !v);
    let (from_steel, from_edge) = (far.distance_within(), made.truth.body.distance());
    let counts = |i: usize| made.truth.body.data[i] && from_steel.data[i] > 2.0 && from_edge.data[i] > 2.0;
    // In units of the concrete's largest attenuation, not the steel's.
    let truth: Vec<f32> = made.attenuation.data.iter().enumerate().map(|(i, v)| if counts(i) { *v } else { 0.0 }).collect();
    nrmse_in(&slice.grey.data, &truth, counts)
}
