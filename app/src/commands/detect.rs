//! `intrados detect`: pores and cracks in CT slices.

use intrados_ct::batch::DetectionWriter;
use intrados_ct::{
    batch::{Batch, SliceTally, Unused, detect_files},
    detect::{DetectSettings, Method},
    slice::pair,
};
use serde::Serialize;

use crate::{
    args,
    console::one_line,
    failure::{Failure, Outcome},
    output::{self, Files},
    session::Session,
};

/// What was found, and where it was written. Schema `intrados.detect/1`.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    batch: Batch,
    files: Vec<String>,
}

pub(crate) fn run(session: &Session, args: &args::Detect) -> Result<Outcome, Failure> {
    let masks = if args.truth.is_empty() { Vec::new() } else { pair(&args.slices, &args.truth)? };
    let progress = session.watch(format!("reading {} slices", args.slices.len()));
    let settings = DetectSettings { method: args.method.into(), ..DetectSettings::default() };
    let how = SliceTally { pixel_mm: args.pixel_mm, settings, strict: args.strict };
    let detected = |writer: Option<&mut DetectionWriter>| {
        detect_files::<Failure>(&args.slices, &masks, &how, &session.job, writer)
    };
    let (batch, files) = match &args.out {
        None => (detected(None)?, Vec::new()),
        Some(out) => {
            let (mut files, batch) = output::in_parts(session, out, &"detect", |files| {
                let mut writer = DetectionWriter::new(files);
                let batch = detected(Some(&mut writer))?;
                writer.tables(&batch)?;
                Ok(batch)
            })?;
            let names = files.listed(DetectionWriter::LIST);
            files.finish(DetectionWriter::LIST, &batch)?;
            (batch, names)
        }
    };
    drop(progress);
    let unused = |u: &Unused| format!("{}: not used, because {}", u.name(), one_line(&u.because));
    batch
        .unused
        .iter()
        .map(unused)
        .chain(batch.notes.iter().cloned())
        .for_each(|line| tracing::warn!("{line}"));
    let report = Report { batch, files };
    session.print(&report, || report.table())?;
    Ok(Outcome::Done)
}

impl From<args::Method> for Method {
    fn from(method: args::Method) -> Self {
        match method {
            args::Method::Auto | args::Method::Network => Self::Network,
            args::Method::Classical => Self::Classical,
        }
    }
}

impl Report {
    fn table(&self) -> String {
        let with_truth = self.batch.total.truth.is_some();
        let mut head = vec!["slice", "pores", "porosity", "cracks", "crack length px", "seconds"];
        if with_truth {
            head.extend(["F1", "Dice", "IoU", "porosity error"]);
        }
        let score = |truth: &Option<intrados_ct::score::Score>| match truth {
            _ if !with_truth => Vec::new(),
            Some(s) => [s.f1, s.dice, s.iou, s.porosity_error]
                .map(|x| x.map_or("-".into(), |x| format!("{x:.3}")))
                .to_vec(),
            None => vec!["-".to_owned(); 4],
        };
        let mut rows = vec![head.into_iter().map(String::from).collect::<Vec<_>>()];
        let row = |name: String,
                   pores: usize,
                   porosity: f64,
                   cracks: usize,
                   length: f64,
                   seconds: f64| {
            [
                name,
                pores.to_string(),
                format!("{:.3} %", 100.0 * porosity),
                cracks.to_string(),
                format!("{:.0}", length + 0.0),
                format!("{seconds:.2}"),
            ]
        };
        for s in &self.batch.slices {
            let base = row(s.name(), s.pores, s.porosity, s.cracks, s.crack_length_px, s.seconds);
            rows.push(Vec::from(base).into_iter().chain(score(&s.truth)).collect());
        }
        let t = &self.batch.total;
        let base = row(
            format!("all {}", t.slices),
            t.pores,
            t.porosity,
            t.cracks,
            t.crack_length_px,
            t.seconds,
        );
        rows.push(Vec::from(base).into_iter().chain(score(&t.truth)).collect());
        let mut text = output::table(&rows);
        for u in &self.batch.unused {
            text += &format!("not used {}: {}\n", u.name(), one_line(&u.because));
        }
        self.batch.notes.iter().for_each(|n| text += &format!("note: {n}\n"));
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}
