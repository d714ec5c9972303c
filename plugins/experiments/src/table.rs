//! The table: every case by every method.

use intrados_raster::grid::median;
use intrados_stage::{Job, cpu_seconds};
use serde::{Deserialize, Serialize};

use super::{
    ExperimentError,
    apart::{Ablations, ablations},
    case::{CaseSet, ExperimentCase, Kind},
    correct::{Care, corrected, plain},
    ours::{self, Choice},
    paired::wilcoxon,
    reference::{MethodMarks, otsu, sauvola, strongest},
    scan::{Made, make},
    score::{IntervalScore, Terms, scored},
};
use intrados_ct::{Picture, network::Network, slice::Slice};

/// Schema of the JSON.
pub(crate) const SCHEMA: &str = "intrados.experiment/1";

/// One case by all methods, on the same projections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseRow {
    /// Its name.
    pub id: String,
    /// Column or beam.
    pub kind: Kind,
    /// Score of ours.
    pub ours: f64,
    /// Plain filtered backprojection, Otsu's threshold, components.
    pub reference: f64,
    /// Corrected reconstruction, Sauvola's threshold, watershed.
    pub strong_reference: f64,
    /// Corrected reconstruction, Otsu's threshold, components: thought of after the two references
    /// were frozen.
    pub otsu_corrected: f64,
    /// 95 % interval over blocks of the slice.
    pub ours_ci95: [f64; 2],
    /// 95 % interval over blocks of the slice.
    pub reference_ci95: [f64; 2],
    /// 95 % interval over blocks of the slice.
    pub strong_reference_ci95: [f64; 2],
    /// What the scores are means of: ours, reference, strong reference.
    pub terms: [Terms; 3],
    /// Voltage, kV.
    pub kv: f64,
    /// Edge of a pixel, mm.
    pub pixel_mm: f64,
    /// Pores and pixels of cracks that are true.
    pub pores: usize,
    /// Pixels of the true cracks.
    pub crack_pixels: usize,
    /// Scatter over primary behind the middle.
    pub scatter_to_primary: f64,
    /// What comes through the middle, over the open beam.
    pub transmission: f64,
    /// User and system time of making it, of the references, of ours.
    pub cpu_seconds: [f64; 3],
    /// With parts left out, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ablations: Option<Ablations>,
}

/// Means over cases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    /// Of ours.
    pub ours: f64,
    /// Of the reference.
    pub reference: f64,
    /// Of the strong reference.
    pub strong_reference: f64,
    /// Of Otsu's threshold on the corrected slice.
    pub otsu_corrected: f64,
}

/// All of it. Serialises to `intrados.experiment/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseTable {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Case by case.
    pub cases: Vec<CaseRow>,
    /// Means over them.
    pub mean: Means,
    /// Cases in which ours is ahead of the reference.
    pub wins: usize,
    /// The same against the strong one.
    pub wins_strong: usize,
    /// The same against Otsu's threshold on the corrected slice.
    pub wins_otsu_corrected: usize,
    /// Means of ours with parts left out: scatter, steering, the network.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without: Option<[f64; 3]>,
    /// Two-sided, Wilcoxon's signed ranks of ours against the reference.
    pub p_value: f64,
    /// The same against the strong one.
    pub p_value_strong: f64,
    /// The same against Otsu's threshold on the corrected slice.
    pub p_value_otsu_corrected: f64,
}

/// One case with the marks of all methods, for pictures.
#[derive(Debug, Clone)]
pub struct JudgedCase {
    /// Scores.
    pub row: CaseRow,
    /// The case.
    pub made: Made,
    /// Its plain and its corrected slice.
    pub slices: [Slice; 2],
    /// Marks of the reference, the strong reference and ours.
    pub marks: [MethodMarks; 3],
}

/// Makes a case and judges every method on it; with `apart`, ours with parts left out too.
///
/// # Errors
/// Cancelled, or the program's tables are damaged.
pub fn judge(
    case: &ExperimentCase,
    cases: &CaseSet,
    apart: bool,
    job: &Job,
) -> Result<JudgedCase, ExperimentError> {
    let mut clock = cpu_seconds();
    let mut lap = || {
        let now = cpu_seconds();
        now - std::mem::replace(&mut clock, now)
    };
    let made = make(case, cases, job)?;
    let making = lap();
    job.relabel(format!("{}: reconstructing", case.id));
    let first = plain(&made.scan, job)?;
    let second = corrected(&made.scan, Care::FULL, job)?;
    let [weak, strong] = [otsu(&first), sauvola(&second, &strongest())];
    let references = lap();
    let ours = ours::found(
        &second,
        Network::of_members().ok_or(ExperimentError::NoNetwork)?,
        &Choice::default(),
        &job.part(0.0, 0.0),
    )?;
    let own = lap();
    let [o, r, s] = [&ours, &weak, &strong].map(|marks| scored(marks, &made.truth, case.seed));
    let otsu_corrected = scored(&otsu(&second), &made.truth, case.seed).score;
    let mut row = CaseRow::new(case, &made, [o, r, s], otsu_corrected, [making, references, own]);
    if apart {
        row.ablations = Some(ablations(case, &made, &second, job)?);
    }
    Ok(JudgedCase { row, slices: [first, second], marks: [weak, strong, ours], made })
}

impl CaseRow {
    fn new(
        case: &ExperimentCase,
        made: &Made,
        [ours, reference, strong]: [IntervalScore; 3],
        otsu_corrected: f64,
        cpu_seconds: [f64; 3],
    ) -> Self {
        Self {
            id: case.id.clone(),
            kind: case.kind,
            ours: ours.score,
            reference: reference.score,
            strong_reference: strong.score,
            otsu_corrected,
            ours_ci95: ours.ci95,
            reference_ci95: reference.ci95,
            strong_reference_ci95: strong.ci95,
            terms: [ours.terms, reference.terms, strong.terms],
            kv: case.kv,
            pixel_mm: 1e3 * made.scan.sheet.voxel(),
            pores: made.truth.pores.components().members.len(),
            crack_pixels: made.truth.cracks.count(),
            scatter_to_primary: made.scatter_to_primary,
            transmission: made.transmission,
            cpu_seconds,
            ablations: None,
        }
    }
}

impl CaseTable {
    /// Of rows in their order.
    #[must_use]
    pub fn of(rows: Vec<CaseRow>) -> Self {
        let n = rows.len().max(1) as f64;
        let mean = |of: &dyn Fn(&CaseRow) -> f64| rows.iter().map(of).sum::<f64>() / n;
        let against =
            |of: fn(&CaseRow) -> f64| rows.iter().map(|r| r.ours - of(r)).collect::<Vec<f64>>();
        let [weak, strong, third] = [
            against(|r| r.reference),
            against(|r| r.strong_reference),
            against(|r| r.otsu_corrected),
        ];
        let wins = |differences: &[f64]| differences.iter().filter(|d| **d > 0.0).count();
        let parts: Option<Vec<[f64; 3]>> = rows
            .iter()
            .map(|r| {
                r.ablations.map(|a| [a.without_scatter, a.without_steering, a.without_network])
            })
            .collect();
        let without = parts
            .filter(|p| !p.is_empty())
            .map(|p| [0, 1, 2].map(|k| p.iter().map(|a| a[k]).sum::<f64>() / n));
        Self {
            schema: SCHEMA,
            without,
            version: env!("CARGO_PKG_VERSION"),
            mean: Means {
                ours: mean(&|r| r.ours),
                reference: mean(&|r| r.reference),
                strong_reference: mean(&|r| r.strong_reference),
                otsu_corrected: mean(&|r| r.otsu_corrected),
            },
            wins: wins(&weak),
            wins_strong: wins(&strong),
            wins_otsu_corrected: wins(&third),
            p_value: wilcoxon(&weak),
            p_value_strong: wilcoxon(&strong),
            p_value_otsu_corrected: wilcoxon(&third),
            cases: rows,
        }
    }
}

/// Found and true: green; true only: violet; found only: red. Cracks like pores.
const COLOURS: [[u8; 3]; 3] = [[60, 170, 90], [170, 40, 190], [213, 62, 0]];

impl JudgedCase {
    /// As a PNG: above, the plain slice and the corrected one; below, the plain one with what the
    /// reference found and the corrected one with what ours found.
    #[must_use]
    pub fn picture(&self) -> Option<Vec<u8>> {
        let [first, second] = [&self.slices[0], &self.slices[1]];
        let (w, h) = (first.grey.width, first.grey.height);
        let panels = [
            (first, None),
            (second, None),
            (first, Some(&self.marks[0])),
            (second, Some(&self.marks[2])),
        ];
        let mut rgb = vec![0; 3 * 4 * w * h];
        for (k, (slice, marks)) in panels.into_iter().enumerate() {
            let bright = self.level(slice);
            for i in 0..w * h {
                let at = 3 * ((k / 2 * h + i / w) * 2 * w + k % 2 * w + i % w);
                let grey = (150.0 * slice.grey.data[i] / bright).clamp(0.0, 255.0) as u8;
                rgb[at..at + 3]
                    .copy_from_slice(&marks.and_then(|m| self.colour(m, i)).unwrap_or([grey; 3]));
            }
        }
        Picture { width: 2 * w, height: 2 * h, rgb, caption: String::new() }.png()
    }

    fn level(&self, slice: &Slice) -> f32 {
        let body = slice.grey.data.iter().zip(&self.made.truth.body.data).filter(|(_, b)| **b);
        median(body.map(|(v, _)| *v)).unwrap_or(1.0).max(f32::MIN_POSITIVE)
    }

    fn colour(&self, marks: &MethodMarks, i: usize) -> Option<[u8; 3]> {
        let truth = &self.made.truth;
        match (
            marks.pores.data[i] || marks.cracks.data[i],
            truth.pores.data[i] || truth.cracks.data[i],
        ) {
            (true, true) => Some(COLOURS[0]),
            (false, true) => Some(COLOURS[1]),
            (true, false) => Some(COLOURS[2]),
            (false, false) => None,
        }
    }
}
