//! What the parts of it are worth: ablations, and the corrections one by one.

use intrados_raster::grid::median;
use intrados_stage::{Job, cpu_seconds};
use intrados_xray::{recon::nrmse_in, scan::Corrections};
use serde::{Deserialize, Serialize};

use super::{
    ExperimentError,
    case::{CaseSet, ExperimentCase},
    correct::{Care, STEERED, corrected_by, plain, scattered},
    ours::{self, Choice},
    reference::{MethodMarks, otsu, sauvola, strongest},
    scan::{Made, make},
    scatter::ScatterEffort,
    score::scored,
};
use intrados_ct::{crack, detect::DetectSettings, network::Network, slice::Slice};
use intrados_raster::grid::{Grid, Mask};

/// Plain walks that take as long as learning and steered walks do.
const UNSTEERED: ScatterEffort = ScatterEffort { walks: 5 << 15, steered: false, ..STEERED };

/// Scores of ours with a part left out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

fn judged(slice: &Slice, made: &Made, seed: u64, job: &Job) -> Result<f64, ExperimentError> {
    let network = Network::of_members().ok_or(ExperimentError::NoNetwork)?;
    Ok(scored(
        &ours::found(slice, network, &Choice::default(), &job.part(0.0, 0.0))?,
        &made.truth,
        seed,
    )
    .score)
}

/// Ablations of one case, `full` its corrected slice.
pub(super) fn ablations(
    case: &ExperimentCase,
    made: &Made,
    full: &Slice,
    job: &Job,
) -> Result<Ablations, ExperimentError> {
    job.relabel(format!("{}: ablations", case.id));
    let timed = |effort: ScatterEffort| {
        let begin = cpu_seconds();
        scattered(&made.scan, effort, job).map(|s| (s, cpu_seconds() - begin))
    };
    let ((steered, a), (plainly, b)) = (timed(STEERED)?, timed(UNSTEERED)?);
    let bare =
        Care { corrections: Corrections { scatter: false, ..Corrections::ALL }, ..Care::FULL };
    let without = corrected_by(&made.scan, bare, None, job)?;
    let unsteered = corrected_by(&made.scan, Care::FULL, Some(&plainly), job)?;
    Ok(Ablations {
        without_scatter: judged(&without, made, case.seed, job)?,
        without_steering: judged(&unsteered, made, case.seed, job)?,
        without_network: scored(&ridges(full), &made.truth, case.seed).score,
        scatter_error: [steered.rel_error, plainly.rel_error],
        scatter_seconds: [a, b],
    })
}

/// The strong reference's pores, and cracks by its rule and by the ridge filter.
fn ridges(slice: &Slice) -> MethodMarks {
    let mut marks = sauvola(slice, &strongest());
    let otsu = super::reference::otsu_threshold(&slice.grey);
    let body = super::reference::body(&slice.grey, otsu);
    let matrix =
        median(slice.grey.data.iter().zip(&body.data).filter(|(_, b)| **b).map(|(v, _)| *v))
            .unwrap_or(1.0);
    let value = |(v, b): (&f32, &bool)| {
        if *b { (v / matrix).min(DetectSettings::default().ceiling) } else { 1.0 }
    };
    let grey =
        Grid { data: slice.grey.data.iter().zip(&body.data).map(value).collect(), ..slice.grey };
    marks.cracks.unite(
        &crack::find(
            &grey,
            &body,
            1.0,
            slice.pixel_mm,
            &crack::CrackSettings::default(),
            &Job::default(),
        )
        .mask,
    );
    marks.objects.retain(|pixels| {
        2 * pixels.iter().filter(|i| marks.cracks.data[**i]).count() <= pixels.len()
    });
    marks.pores.data.fill(false);
    marks.objects.iter().flatten().for_each(|i| marks.pores.data[*i] = true);
    marks
}

/// What slices are worth with some corrections.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worth {
    /// Which corrections.
    pub name: &'static str,
    /// Root mean square error of the concrete over its largest attenuation. Steel and two pixels
    /// round it do not count.
    pub nrmse: Paired,
    /// Score of ours.
    pub ours: Paired,
    /// Score of Otsu's threshold on the same slices.
    pub otsu: Paired,
}

/// One number of every case beside the same number with all corrections.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Paired {
    /// By case.
    pub values: Vec<f64>,
    /// Their mean.
    pub mean: f64,
    /// Mean of what it is more than with all corrections, and the standard error of that mean over
    /// the cases (0 of a single one).
    pub more: [f64; 2],
}

impl Paired {
    fn new(values: Vec<f64>, all: &[f64]) -> Self {
        let n = values.len().max(1) as f64;
        let differences: Vec<f64> = values.iter().zip(all).map(|(v, a)| v - a).collect();
        let more = differences.iter().sum::<f64>() / n;
        let squares: f64 = differences.iter().map(|d| (d - more).powi(2)).sum();
        Self {
            mean: values.iter().sum::<f64>() / n,
            more: [more, (squares / (n * (n - 1.0).max(1.0))).sqrt()],
            values,
        }
    }
}

/// Each correction left out, and none made, over some cases.
///
/// # Errors
/// Cancelled, or the program's tables are damaged.
pub fn corrections(
    chosen: &[ExperimentCase],
    cases: &CaseSet,
    job: &Job,
) -> Result<Vec<Worth>, ExperimentError> {
    let all = Corrections::ALL;
    let named = [
        ("all", all),
        ("without scatter", Corrections { scatter: false, ..all }),
        ("without hardening", Corrections { hardening: false, ..all }),
        ("without rings", Corrections { rings: false, ..all }),
        ("without metal", Corrections { metal: false, ..all }),
        ("none, axis not found", Corrections::NONE),
    ];
    let mut found: Vec<[Vec<f64>; 3]> = vec![Default::default(); named.len()];
    for case in chosen {
        let made = make(case, cases, job)?;
        let scatter = scattered(&made.scan, STEERED, job)?;
        job.relabel(format!("{}: corrections", case.id));
        for ([errors, ours, thresholds], (_, corrections)) in found.iter_mut().zip(&named) {
            let care = Care { corrections: *corrections, ..Care::FULL };
            let slice = match *corrections {
                Corrections::NONE => plain(&made.scan, job)?,
                _ => corrected_by(
                    &made.scan,
                    care,
                    Some(&scatter).filter(|_| corrections.scatter),
                    job,
                )?,
            };
            errors.push(error(&slice, &made));
            ours.push(judged(&slice, &made, case.seed, job)?);
            thresholds.push(scored(&otsu(&slice), &made.truth, case.seed).score);
        }
    }
    // The first has all.
    let all = found.first().cloned().unwrap_or_default();
    let worth = |(name, [errors, ours, thresholds]): (&'static str, [Vec<f64>; 3])| Worth {
        name,
        nrmse: Paired::new(errors, &all[0]),
        ours: Paired::new(ours, &all[1]),
        otsu: Paired::new(thresholds, &all[2]),
    };
    Ok(named.iter().map(|n| n.0).zip(found).map(worth).collect())
}

fn error(slice: &Slice, made: &Made) -> f64 {
    let far: Mask = made.truth.steel.map(|v| !v);
    let (from_steel, from_edge) = (far.distance_within(), made.truth.body.distance());
    let counts =
        |i: usize| made.truth.body.data[i] && from_steel.data[i] > 2.0 && from_edge.data[i] > 2.0;
    // In units of the concrete's largest attenuation, not the steel's.
    let truth: Vec<f32> = made
        .attenuation
        .data
        .iter()
        .enumerate()
        .map(|(i, v)| if counts(i) { *v } else { 0.0 })
        .collect();
    nrmse_in(&slice.grey.data, &truth, counts)
}
