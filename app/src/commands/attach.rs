//! `intrados attach`: evidence put beside a scene.

use std::path::{Path, PathBuf};

use intrados_photo::Photograph;
use intrados_predict::attaching::{self, Unfit};
use intrados_scene::{
    attach::{Attachment, Cut, Finding, Listed, Project, Raw, What},
    structure::{Course, Electrode},
};
use serde::Serialize;

use super::detach::{known_as, rows};
use crate::{
    args::{self, FindingArgs},
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Files that are listed for people.
const SHOWN: usize = 5;

/// Schema `intrados.attach/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    evidence: String,
    member: String,
    /// What people call it.
    member_name: String,
    name: String,
    /// What is known now and was not before.
    added: Vec<Listed>,
    files: Vec<String>,
    /// What the user should know: columns that were not read, and other doubts.
    notes: Vec<String>,
}

pub(crate) fn run(session: &Session, args: &args::Attach) -> Result<Outcome, Failure> {
    let what = attachment(args)?;
    let project = Project::edit(&args.project, &session.access, &session.job)?;
    let what = Attachment { member: known_as(session, &project, &args.member)?, ..what };
    let progress = session.watch(format!("attaching to {}", args.project.display()));
    let proposal = project.propose(&what, &session.job)?;
    let notes = attaching::examine(&proposal, &what, &session.job).map_err(refused)?;
    let (name, added) = (proposal.name.clone(), proposal.added.clone());
    let member_name = proposal.scene.name_of(&what.member).to_owned();
    let files = proposal.commit()?;
    drop(progress);
    notes.iter().for_each(|note| session.note(note));
    let report = Report {
        schema: "intrados.attach/1",
        version: env!("CARGO_PKG_VERSION"),
        evidence: project.evidence().display().to_string(),
        member: what.member,
        member_name,
        name,
        added,
        files: output::names(&files),
        notes,
    };
    session.print(&report, || report.table())?;
    Ok(Outcome::Done)
}

fn attachment(args: &args::Attach) -> Result<Attachment, Failure> {
    let place = &args.place;
    Ok(Attachment {
        member: args.member.clone(),
        name: args.name.clone().or_else(|| args.load.load_test.clone()),
        date: place.date,
        along: place.along.map(|a| a.0),
        face: place.face,
        angle_deg: place.angle,
        height_m: place.height,
        instrument: place.instrument.clone(),
        picture: picture(place.picture.as_deref())?,
        confirmed: place.confirmed,
        what: what(args)?,
    })
}

fn refused(unfit: Unfit) -> Failure {
    match unfit {
        Unfit::Because(why) => Failure::BadInput(why),
        Unfit::Cancelled => Failure::Interrupted,
    }
}

/// A photograph that the report can show.
fn picture(file: Option<&Path>) -> Result<Option<PathBuf>, Failure> {
    let Some(file) = file else { return Ok(None) };
    attaching::picture(file).map_err(refused)?;
    Ok(Some(file.to_owned()))
}

fn what(args: &args::Attach) -> Result<What, Failure> {
    let f = &args.finding;
    let load = &args.load;
    none_of(&[
        (load.force_kn.is_some() && load.load_test.is_none(), "--force-kn is of a --load-test"),
        (f.course.is_some() && f.crack.is_none(), "--course is of a --crack"),
        (f.length_m.is_some() && f.crack.is_none(), "--length-m is of a --crack"),
        (f.bars_bare && f.spall.is_none(), "--bars-bare is of a --spall"),
        (f.tapped.is_some() && f.hollow.is_none(), "--tapped is of --hollow"),
        (f.of_concrete && f.chloride.is_none(), "--of-concrete is of --chloride"),
        (f.length_mm.is_some() && f.core_strength.is_none(), "--length-mm is of a --core-strength"),
    ])?;
    if let Some(force_kn) = load.force_kn {
        return load_test(args, force_kn);
    }
    if let Some(finding) = finding(f) {
        return single(f, finding);
    }
    none_of(&[(f.std_error.is_some(), "--std-error is of a finding; a table has its column")])?;
    if let Some(picks) = &args.of_file.pose {
        return photograph(args, picks);
    }
    if args.stack.raw.is_some() {
        return slices(args, &args.files);
    }
    let kinds: Vec<Option<bool>> = args.files.iter().map(|file| What::is_table(file)).collect();
    if let Some(other) = kinds.iter().position(Option::is_none) {
        let file = args.files[other].display();
        let ending = args.files[other].extension().unwrap_or_default().to_ascii_lowercase();
        if ["jpg", "jpeg"].iter().any(|jpeg| ending == *jpeg) {
            return Err(Failure::BadInput(format!(
                "{file}: is a photograph: give --pose PICKS.csv to have it read, or name a finding and add it with --picture; CT slices are saved as .png or .tif, without loss"
            )));
        }
        return Err(Failure::BadInput(format!(
            "{file}: is neither a table (.csv, .tsv, .txt) nor CT slices (.tif, .png, .mha, .dcm): convert it, or give the --raw size of bare voxels"
        )));
    }
    match &args.files[..] {
        [file] if kinds == [Some(true)] => table(args, file),
        files if !kinds.contains(&Some(true)) => slices(args, files),
        _ => Err(Failure::Usage("a table is attached alone: give one command to each".into())),
    }
}

/// Refuses options that do not fit what is attached, with what they are of.
fn none_of(options: &[(bool, &str)]) -> Result<(), Failure> {
    match options.iter().find(|(given, _)| *given) {
        Some((_, option)) => Err(Failure::Usage(format!("{option}: leave it out"))),
        None => Ok(()),
    }
}

/// A photograph that is read.
fn photograph(args: &args::Attach, picks: &Path) -> Result<What, Failure> {
    let (place, of) = (&args.place, &args.of_file);
    none_of(&[
        (place.along.is_some(), "--along: where a photograph looks, its picks tell"),
        (place.face.is_some() || place.angle.is_some(), "--face and --angle: its picks tell"),
        (place.height.is_some(), "--height: its picks tell"),
        (place.instrument.is_some(), "--instrument is of a finding or of a table"),
        (args.stack.stack || args.stack.raw.is_some(), "--stack and --raw are of CT slices"),
        (place.confirmed, "--confirmed is of a finding or of a table"),
        (of.pixel_mm.is_some(), "--pixel-mm is of CT slices"),
        (
            of.unit.is_some() || of.kind.is_some() || of.test.is_some(),
            "--unit, --kind and --test are of tables",
        ),
    ])?;
    let [file] = &args.files[..] else {
        return Err(Failure::Usage(
            "a photograph is attached alone: give one command to each".into(),
        ));
    };
    let photograph = Photograph::open(file).map_err(|error| {
        let line = format!("{}: {error}", file.display());
        if error.is_missing() { Failure::NoInput(line) } else { Failure::BadInput(line) }
    })?;
    let name = file.display();
    photograph.doubts.iter().for_each(|doubt| tracing::warn!("{name}: {doubt}"));
    Ok(What::Photograph { files: [file.clone(), picks.to_owned()], focal_px: of.focal_px })
}

fn load_test(args: &args::Attach, force_kn: f64) -> Result<What, Failure> {
    let (f, place) = (&args.finding, &args.place);
    none_of(&[
        (args.name.is_some(), "--name is said by --load-test"),
        (place.face.is_some() || place.angle.is_some(), "--face and --angle: a weight is on top"),
        (place.height.is_some(), "--height is of a finding; a load test has --along"),
        (place.date.is_some(), "--date is of a finding or of a table"),
        (place.confirmed, "--confirmed is of a finding or of a table"),
        (place.instrument.is_some(), "--instrument is of a finding or of a table"),
        (f.std_error.is_some(), "--std-error is of a finding"),
        (f.depth_mm.is_some(), "--depth-mm is of a --spall or of CT slices"),
        (f.diameter_mm.is_some(), "--diameter-mm is of a --core-strength or of CT slices"),
        (f.electrode.is_some(), "--electrode is of a --half-cell or of a table"),
    ])?;
    Ok(What::LoadTest { force_kn })
}

fn single(f: &FindingArgs, finding: Finding) -> Result<What, Failure> {
    none_of(&[
        (f.depth_mm.is_some() && f.spall.is_none(), "--depth-mm is of a --spall or of CT slices"),
        (
            f.diameter_mm.is_some() && f.core_strength.is_none(),
            "--diameter-mm is of a --core-strength or of CT slices",
        ),
        (
            f.electrode.is_some() && f.half_cell.is_none(),
            "--electrode is of a --half-cell or of a table",
        ),
        (
            f.std_error.is_some() && !has_error(&finding),
            "--std-error does not fit this finding, which has no error",
        ),
    ])?;
    Ok(What::Finding(finding))
}

fn table(args: &args::Attach, file: &Path) -> Result<What, Failure> {
    let (f, of) = (&args.finding, &args.of_file);
    none_of(&[
        (args.stack.stack, "--stack is of CT slices"),
        (args.stack.voxel_mm.is_some(), "--voxel-mm is of CT slices"),
        (args.stack.axis.is_some(), "--axis is of CT slices"),
        (f.depth_mm.is_some(), "--depth-mm is of CT slices or of a --spall"),
        (f.diameter_mm.is_some(), "--diameter-mm is of CT slices or of a --core-strength"),
        (of.pixel_mm.is_some(), "--pixel-mm is of CT slices"),
    ])?;
    Ok(What::Table {
        file: file.to_owned(),
        kind: of.kind.map(Into::into),
        unit: of.unit.clone(),
        test: of.test.clone(),
        electrode: f.electrode.map_or(Electrode::default(), Into::into),
    })
}

fn slices(args: &args::Attach, files: &[PathBuf]) -> Result<What, Failure> {
    let (f, of, stack) = (&args.finding, &args.of_file, &args.stack);
    none_of(&[
        (of.unit.is_some(), "--unit is of a table"),
        (of.kind.is_some(), "--kind is of a table"),
        (of.test.is_some(), "--test is of a table"),
        (f.electrode.is_some(), "--electrode is of a --half-cell or of a table"),
        (args.place.confirmed, "--confirmed is of a finding or of a table"),
        (args.place.height.is_some(), "--height is of a finding; slices have --along"),
        (args.place.instrument.is_some(), "--instrument is of a finding or of a table"),
        (
            of.pixel_mm.is_some() && (stack.stack || stack.raw.is_some()),
            "--pixel-mm is of single slices; a volume has --voxel-mm",
        ),
        (
            stack.voxel_mm.is_some() && !stack.stack && stack.raw.is_none(),
            "--voxel-mm is of a volume (--stack); single slices have --pixel-mm",
        ),
    ])?;
    if args.place.along.is_some_and(|a| a.0[0].to_bits() != a.0[1].to_bits()) {
        return Err(Failure::Usage("--along: a core lies at one place, such as 0.3".into()));
    }
    let cut = Cut {
        depth_m: f.depth_mm.map(|mm| (1e-3 * mm) as f32),
        diameter_mm: f.diameter_mm.map(|mm| mm as f32),
        axis: stack.axis.map(Into::into),
    };
    let files = files.to_vec();
    if !stack.stack && stack.raw.is_none() {
        return Ok(What::Slices { files, pixel_mm: of.pixel_mm, cut });
    }
    let raw = stack.raw.map(|size| Raw {
        size: size.0,
        voxel: stack.voxel_type,
        skip: stack.skip_bytes,
        big_endian: stack.big_endian,
    });
    Ok(What::Stack { files, voxel_mm: stack.voxel_mm.map(|v| v.0), raw, cut })
}

/// Whether a finding is measured with an error.
fn has_error(finding: &Finding) -> bool {
    !matches!(
        finding,
        Finding::Sounding { .. }
            | Finding::Spall { .. }
            | Finding::Rust { .. }
            | Finding::Efflorescence { .. }
            | Finding::WetSpot { .. }
            | Finding::Intact
    )
}

/// The finding that the options tell; none: a file is given.
fn finding(f: &FindingArgs) -> Option<Finding> {
    let error = f.std_error;
    if let Some(width_mm) = f.crack {
        let course = f.course.map_or(Course::Map, Into::into);
        return Some(Finding::Crack {
            width_mm,
            std_error_mm: error,
            course,
            length_m: f.length_m,
        });
    }
    if let Some(profile) = &f.chloride {
        let (depths_mm, percents) = profile.0.iter().map(|[d, p]| (*d, *p)).unzip();
        let (percent_of_cement, percent_of_concrete) =
            if f.of_concrete { (Vec::new(), percents) } else { (percents, Vec::new()) };
        return Some(Finding::Chloride {
            depths_mm,
            percent_of_cement,
            percent_of_concrete,
            std_error_percent: error,
        });
    }
    let electrode = f.electrode.map_or(Electrode::default(), Into::into);
    let (depth_mm, bars_bare) = (f.depth_mm, f.bars_bare);
    let cells = [
        f.cover.map(|mm| Finding::Cover { mm, std_error_mm: error }),
        f.half_cell.map(|mv| Finding::HalfCell { mv, std_error_mv: error, electrode }),
        f.rebound.map(|number| Finding::Rebound { number, std_error: error }),
        f.velocity.map(|m_s| Finding::Velocity { m_s, std_error_m_s: error }),
        f.carbonation.map(|mm| Finding::Carbonation { mm, std_error_mm: error }),
        f.core_strength.map(|mpa| Finding::CoreStrength {
            mpa,
            std_error_mpa: error,
            diameter_mm: f.diameter_mm.unwrap_or_default(),
            length_mm: f.length_mm.unwrap_or_default(),
        }),
        f.hollow.map(|hollow_m2| Finding::Sounding {
            hollow_m2,
            tapped_m2: f.tapped.unwrap_or_default(),
        }),
        f.spall.map(|area_m2| Finding::Spall { area_m2, depth_mm, bars_bare }),
        f.rust.map(|area_m2| Finding::Rust { area_m2 }),
        f.efflorescence.map(|area_m2| Finding::Efflorescence { area_m2 }),
        f.wet.map(|area_m2| Finding::WetSpot { area_m2 }),
        f.intact.then_some(Finding::Intact),
    ];
    cells.into_iter().flatten().next()
}

impl Report {
    fn table(&self) -> String {
        let mut text = format!("{} of {}, in {}\n", self.name, self.member_name, self.evidence);
        text += &output::table(&rows(&self.added));
        self.files.iter().take(SHOWN).for_each(|file| text += &format!("file {file}\n"));
        if self.files.len() > SHOWN {
            text += &format!("and {} more files\n", self.files.len() - SHOWN);
        }
        text
    }
}
