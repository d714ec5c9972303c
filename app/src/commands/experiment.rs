//! `intrados experiment`: what the documentation quotes, again.

use intrados_experiments::{
    apart::{Paired, Worth, corrections},
    calibration::{Calibration, calibration},
    case::{CaseSet, ExperimentCase},
    table::{CaseRow, CaseTable, judge},
};

use serde::Serialize;

use super::walks;
use crate::{
    args,
    failure::{Failure, Outcome},
    output::{self, Files},
    predicting,
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Experiment) -> Result<Outcome, Failure> {
    match args.name {
        args::ExperimentName::Table31 => table_3_1(session, args),
        args::ExperimentName::Calibration => calibrated(session, args),
    }
}

/// Whether `name` can be written, before minutes are spent on what it is to hold.
fn may_keep(args: &args::Experiment, name: &str) -> Result<(), Failure> {
    let Some(out) = &args.out else { return Ok(()) };
    output::folder(out)?;
    output::may_write(&out.join(name))
}

/// Writes `name`, where a folder was asked for.
fn keep(args: &args::Experiment, name: &str, found: &impl Serialize) -> Result<(), Failure> {
    let Some(out) = &args.out else { return Ok(()) };
    output::put(&out.join(name), output::json(found)?.as_bytes())
}

/// Writes `calibration.json`.
fn calibrated(session: &Session, args: &args::Experiment) -> Result<Outcome, Failure> {
    const LIST: &str = "calibration.json";
    may_keep(args, LIST)?;
    let scenes =
        args.scenes.iter().map(|path| walks::load(session, path)).collect::<Result<Vec<_>, _>>()?;
    let progress = session.watch("plantings");
    let (plantings, settings) = (args.plantings as usize, predicting());
    let found = match &args.out {
        None => calibration(&scenes, plantings, &settings, None, &session.job)?,
        Some(out) => {
            let (files, found) =
                output::in_parts(session, out, &("calibration", &settings), |parts| {
                    Ok(calibration(&scenes, plantings, &settings, Some(parts), &session.job)?)
                })?;
            files.finish(LIST, &found)?;
            found
        }
    };
    drop(progress);
    session.print(&found, || coverages(&found))?;
    Ok(Outcome::Done)
}

fn coverages(found: &Calibration) -> String {
    let mut rows = vec![
        ["planted by", "95 % intervals of", "hold the truth", "95 % interval", "n"]
            .map(String::from)
            .to_vec(),
    ];
    let percent = |x: f64| format!("{:.1} %", 100.0 * x);
    for (set, odds) in [(&found.declared, "declared odds"), (&found.clustered, "other odds")] {
        let score = &set.score;
        let named = [
            ("members", score.coverage_95),
            ("zones (n: members)", score.zone_coverage_95),
            ("porosities of drawn slices", score.slice_coverage_95),
        ];
        rows.extend(named.iter().filter_map(|(name, figure)| {
            let f = figure.as_ref()?;
            let interval = format!("{} to {}", percent(f.ci95[0]), percent(f.ci95[1]));
            Some(vec![
                odds.to_owned(),
                (*name).to_owned(),
                percent(f.value),
                interval,
                f.n.to_string(),
            ])
        }));
    }
    output::table(&rows)
}

fn table_3_1(session: &Session, args: &args::Experiment) -> Result<Outcome, Failure> {
    let mut cases = CaseSet::twenty()?;
    if let Some(number) = args.rehearsal {
        cases = cases.rehearsal(number);
    }
    may_keep(args, if args.corrections { "corrections.json" } else { "table-3-1.json" })?;
    let [first, last] = args.cases.0;
    let progress = session.watch("twenty cases");
    let chosen: Vec<ExperimentCase> =
        cases.cases.iter().take(last).skip(first - 1).cloned().collect();
    if args.corrections {
        let worths = Corrections {
            schema: "intrados.experiment.corrections/2",
            corrections: corrections(&chosen, &cases, &session.job)?,
        };
        drop(progress);
        keep(args, "corrections.json", &worths)?;
        session.print(&worths, || worths.text())?;
        return Ok(Outcome::Done);
    }
    let key = (args.rehearsal, args.ablations);
    let table = match &args.out {
        None => CaseTable::of(
            chosen
                .iter()
                .map(|case| Ok(judge(case, &cases, args.ablations, &session.job)?.row))
                .collect::<Result<_, Failure>>()?,
        ),
        Some(out) => {
            let (files, rows) = output::in_parts(session, out, &key, |files| {
                let row = |case: &ExperimentCase| {
                    files.part(&case.id, |files| {
                        let judged = judge(case, &cases, args.ablations, &session.job)?;
                        if let Some(png) = judged.picture() {
                            files.write(format!("{}.png", case.id), &png)?;
                        }
                        Ok(judged.row)
                    })
                };
                chosen.iter().map(row).collect::<Result<Vec<_>, Failure>>()
            })?;
            let table = CaseTable::of(rows);
            files.finish("table-3-1.json", &table)?;
            table
        }
    };
    drop(progress);
    session.print(&table, || text(&table))?;
    Ok(Outcome::Done)
}

/// Schema `intrados.experiment.corrections/2`.
#[derive(Debug, Serialize)]
struct Corrections {
    schema: &'static str,
    corrections: Vec<Worth>,
}

impl Corrections {
    fn text(&self) -> String {
        let heads = ["corrections", "nRMSE", "more", "ours", "more", "Otsu", "more"];
        let mut rows = vec![heads.map(String::from).to_vec()];
        for w in &self.corrections {
            let pair = |p: &Paired, digits: usize| {
                let [more, error] = &p.more;
                [
                    format!("{:.digits$}", p.mean),
                    if *more == 0.0 {
                        String::new()
                    } else {
                        format!("{more:+.digits$} ± {error:.digits$}")
                    },
                ]
            };
            let cells = [pair(&w.nrmse, 4), pair(&w.ours, 1), pair(&w.otsu, 1)];
            rows.push(
                std::iter::once(w.name.to_owned()).chain(cells.into_iter().flatten()).collect(),
            );
        }
        output::table(&rows)
    }
}

fn text(table: &CaseTable) -> String {
    let heads = [
        "case",
        "kind",
        "pixel mm",
        "pores",
        "crack px",
        "ours",
        "95 %",
        "reference",
        "95 %",
        "strong",
        "95 %",
        "Otsu, corrected",
        "CPU-s",
    ];
    let mut rows = vec![heads.map(String::from).to_vec()];
    rows.extend(table.cases.iter().map(row));
    let mean = &table.mean;
    let means = [
        "mean",
        "",
        "",
        "",
        "",
        &number(mean.ours),
        "",
        &number(mean.reference),
        "",
        &number(mean.strong_reference),
        "",
        &number(mean.otsu_corrected),
    ];
    rows.push(means.map(String::from).to_vec());
    let parts = table.without.map_or(String::new(), |[scatter, steering, network]| {
        format!(
            "ours without scatter correction {scatter:.2}, without steering at equal time {steering:.2}, without the network {network:.2}\n"
        )
    });
    format!(
        "{}{parts}ours ahead of the reference in {} of {n}, p = {:.1e}; of the strong one in {}, p = {:.1e}; of Otsu on the corrected slice in {}, p = {:.1e} (Wilcoxon, two-sided)\n",
        output::table(&rows),
        table.wins,
        table.p_value,
        table.wins_strong,
        table.p_value_strong,
        table.wins_otsu_corrected,
        table.p_value_otsu_corrected,
        n = table.cases.len()
    )
}

fn row(r: &CaseRow) -> Vec<String> {
    let interval = |[low, high]: [f64; 2]| format!("{low:.1}–{high:.1}");
    vec![
        r.id.clone(),
        format!("{:?}", r.kind).to_lowercase(),
        format!("{:.3}", r.pixel_mm),
        r.pores.to_string(),
        r.crack_pixels.to_string(),
        number(r.ours),
        interval(r.ours_ci95),
        number(r.reference),
        interval(r.reference_ci95),
        number(r.strong_reference),
        interval(r.strong_reference_ci95),
        number(r.otsu_corrected),
        format!("{:.0}", r.cpu_seconds.iter().sum::<f64>()),
    ]
}

fn number(value: f64) -> String {
    format!("{value:.1}")
}
