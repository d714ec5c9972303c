//! IFC through IfcOpenShell, in a process of its own: what it does wrong costs a message, not the
//! program.

use std::{
    collections::{BTreeMap, HashSet},
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    path::Path,
    process::{Child, Command, Stdio},
    sync::mpsc::{self, RecvTimeoutError},
    time::{Duration, Instant},
};

use glam::{DMat4, DVec3, Vec3};
use intrados_stage::{Job, access};
use serde::Deserialize;
use serde_json::Value;

use super::{
    ImportError, georeference,
    source::{Above, Course, Element, Georeference, Matter, Properties, Source, Surface},
};

/// The converter, which is ours.
const SCRIPT: &str = concat!(include_str!("sweep.py"), include_str!("ifc.py"));
/// What brings IfcOpenShell.
const INSTALL: &str = "pip install ifcopenshell==0.9.0.post1";
/// Longest file that is read, bytes: IfcOpenShell takes some ten times as much memory.
pub(super) const LONGEST: u64 = 1 << 30;
/// Longest answer that is read, bytes.
const LONGEST_ANSWER: u64 = 2 << 30;
/// How long the converter may be silent, while it opens the file and reads properties.
const SILENCE: Duration = Duration::from_secs(300);
/// How long one element may take it, s, where `INTRADOS_IFC_SECONDS` does not say.
const ONE_ELEMENT: f64 = 60.0;
/// How long it may take to end once it is asked to.
const GRACE: Duration = Duration::from_millis(500);

/// What the converter says while it works.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Line {
    done: usize,
    total: usize,
    what: String,
    ready: bool,
    fault: Option<String>,
    message: String,
}

/// `elements.json`.
#[derive(Debug, Deserialize)]
struct Answer {
    schema: String,
    draft: Option<String>,
    ifcopenshell: String,
    units: Vec<String>,
    /// The one of them that is used.
    #[serde(default)]
    unit: Option<String>,
    metres_per_unit: f64,
    year: Option<i32>,
    /// The text that says so.
    #[serde(default)]
    year_text: String,
    project: String,
    /// Names of all its projects.
    #[serde(default)]
    projects: Vec<String>,
    /// Bars and tendons without a shape.
    #[serde(default)]
    steel_without_shape: usize,
    georeference: Georeference,
    elements: Vec<Told>,
}

#[derive(Debug, Deserialize)]
struct Told {
    step: u64,
    id: String,
    class: String,
    name: String,
    object_type: String,
    predefined: String,
    #[serde(rename = "type")]
    type_name: String,
    above: Vec<Above>,
    properties: Properties,
    materials: Vec<Matter>,
    attributes: BTreeMap<String, Value>,
    courses: Vec<ToldCourse>,
    shapes: Vec<Shape>,
    /// Types of what its body is made of, where there is no surface.
    #[serde(default)]
    items: String,
    /// Why there is none.
    #[serde(default)]
    reason: String,
    /// What is wrong with all else that the file says of it.
    #[serde(default)]
    damaged: String,
}

#[derive(Debug, Deserialize)]
struct ToldCourse {
    diameter: f64,
    line: Vec<[f64; 3]>,
    /// Whether parameters of its disk cut it.
    #[serde(default)]
    is_cut: bool,
}

/// A surface in `shapes.bin`.
#[derive(Debug, Deserialize)]
struct Shape {
    at: usize,
    corners: usize,
    triangles: usize,
    colour: Option<[f32; 3]>,
    matrix: [f64; 16],
}

/// Reads an IFC file.
pub(super) fn ifc(path: &Path, job: &Job) -> Result<Source, ImportError> {
    let folder = tempfile::tempdir().map_err(|e| ImportError::write(&std::env::temp_dir(), &e))?;
    ifcopenshell(path, SCRIPT, folder.path(), &job.part(0.0, 0.8))?;
    let read = |name: &str| {
        let file = folder.path().join(name);
        access::read(&file, LONGEST_ANSWER)
            .map_err(|e| ImportError::bad(path, format!("IfcOpenShell's answer ({name}) {e}")))
    };
    let answer: Answer = serde_json::from_slice(&read("elements.json")?)
        .map_err(|e| ImportError::bad(path, format!("IfcOpenShell's answer is damaged: {e}")))?;
    source(answer, &read("shapes.bin")?).map_err(|what| ImportError::bad(path, what))
}

/// Runs a Python `script` on an IFC file, with IfcOpenShell and a `folder` for its answer: `script
/// MODEL.ifc FOLDER`. The script says lines of JSON: `{"done", "total", "what"}` now and then, at
/// the end `{"ready": true}` or `{"fault", "message"}`.
///
/// # Errors
/// The file is no IFC file, IfcOpenShell is not there or not new enough, it breaks off or is silent
/// for long, or the job was cancelled.
pub fn ifcopenshell(
    path: &Path,
    script: &str,
    folder: &Path,
    job: &Job,
) -> Result<(), ImportError> {
    look(path)?;
    let place = folder.join("script.py");
    std::fs::write(&place, script).map_err(|e| ImportError::write(&place, &e))?;
    run(path, &place, folder, job)
}

/// Refuses what needs no converter to be refused: by size, by its first and its last line.
fn look(path: &Path) -> Result<(), ImportError> {
    let (mut file, length) = access::open(path).map_err(|e| ImportError::denied(path, &e))?;
    if length > LONGEST {
        let size = length as f64 / f64::from(1 << 30);
        let most = LONGEST >> 30;
        return Err(ImportError::bad(
            path,
            format!(
                "{size:.1} GiB, and an IFC file of at most {most} GiB is read: export the structure alone, or in parts"
            ),
        ));
    }
    let unreadable = |e: std::io::Error| ImportError::bad(path, format!("cannot be read: {e}"));
    let mut start = [0; 256];
    let count = file.read(&mut start).map_err(unreadable)?;
    let start = String::from_utf8_lossy(start.get(..count).unwrap_or_default()).into_owned();
    if !start.contains("ISO-10303-21") {
        let what = if start.starts_with("PK") {
            "is packed (ifcZIP): unpack it first"
        } else if start.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
            "is XML (ifcXML): export it as IFC-SPF, the plain text"
        } else {
            "is no IFC file: its first line is not ISO-10303-21; export the model as IFC again"
        };
        return Err(ImportError::bad(path, what));
    }
    file.seek(SeekFrom::Start(length.saturating_sub(256))).map_err(unreadable)?;
    let mut end = Vec::new();
    file.take(256).read_to_end(&mut end).map_err(unreadable)?;
    if String::from_utf8_lossy(&end).contains("END-ISO-10303-21") {
        Ok(())
    } else {
        let what = "ends in the middle, without END-ISO-10303-21: copy or export it again, whole";
        Err(ImportError::bad(path, what))
    }
}

/// A process that ends with us: it watches its standard input, of which we hold the other end, and
/// ends those that it started.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        let begin = Instant::now();
        while begin.elapsed() < GRACE && matches!(self.0.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The Python that `INTRADOS_PYTHON` names, else `python3`.
fn python() -> std::ffi::OsString {
    std::env::var_os("INTRADOS_PYTHON").filter(|v| !v.is_empty()).unwrap_or("python3".into())
}

/// How long one element may take, s.
fn seconds() -> f64 {
    let said = std::env::var("INTRADOS_IFC_SECONDS").ok().and_then(|s| s.trim().parse().ok());
    said.filter(|s| (0.1..=1e5).contains(s)).unwrap_or(ONE_ELEMENT)
}

fn run(path: &Path, script: &Path, folder: &Path, job: &Job) -> Result<(), ImportError> {
    job.relabel(format!("reading {} with IfcOpenShell", path.display()));
    let python = python();
    let errors = folder.join("errors.txt");
    let log = std::fs::File::create(&errors).map_err(|e| ImportError::write(&errors, &e))?;
    let child = Command::new(&python)
        .arg(script)
        .arg(path)
        .arg(folder)
        .arg(seconds().to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(log)
        .spawn()
        .map_err(|e| {
            let python = python.to_string_lossy();
            ImportError::NoConverter(format!(
                "{}: IFC is read by IfcOpenShell, and {python} cannot be run ({e}): install Python 3 and {INSTALL}, or name a Python that has it in INTRADOS_PYTHON",
                path.display()
            ))
        })?;
    let mut child = Running(child);
    let lines = child.0.stdout.take().map(listen);
    let Some(lines) = lines else {
        return Err(ImportError::bad(path, "IfcOpenShell does not answer"));
    };
    let mut heard = Instant::now();
    let mut last = String::new();
    loop {
        job.step(0, 0)?;
        match lines.recv_timeout(Duration::from_millis(50)) {
            Ok(line) => {
                heard = Instant::now();
                let said: Line = serde_json::from_str(&line).unwrap_or_default();
                if let Some(fault) = said.fault {
                    return Err(refused(path, &fault, &said.message));
                }
                if said.ready {
                    return Ok(());
                }
                if said.total > 0 {
                    job.step(said.done, said.total)?;
                    last = said.what;
                }
            }
            Err(RecvTimeoutError::Timeout) if heard.elapsed() < SILENCE => {}
            Err(RecvTimeoutError::Timeout) => {
                let what = format!(
                    "IfcOpenShell has said nothing for {} s, last {}: take that element, or what follows it, out of the file",
                    SILENCE.as_secs(),
                    if last.is_empty() { "while it opened the file" } else { &last }
                );
                return Err(ImportError::bad(path, what));
            }
            Err(RecvTimeoutError::Disconnected) => return Err(broken_off(path, &errors, &last)),
        }
    }
}

/// Reads lines on a thread of its own, so that silence can be told from an end.
fn listen(output: std::process::ChildStdout) -> mpsc::Receiver<String> {
    let (send, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in BufReader::new(output).lines() {
            let Ok(line) = line else { break };
            if send.send(line).is_err() {
                break;
            }
        }
    });
    lines
}

fn refused(path: &Path, fault: &str, message: &str) -> ImportError {
    let place = path.display();
    match fault {
        "absent" => ImportError::NoConverter(format!(
            "{place}: IFC is read by IfcOpenShell, which this Python does not have ({message}): {INSTALL}"
        )),
        "old" => ImportError::NoConverter(format!(
            "{place}: IfcOpenShell {message} is too old for this, 0.8 is the oldest that will do: {INSTALL}"
        )),
        "units" => ImportError::bad(
            path,
            "says no unit of length (no IfcUnitAssignment of the project has a LENGTHUNIT): export it again with units, millimetres or metres",
        ),
        "empty" => ImportError::bad(
            path,
            "has no element with a shape: export the model with its geometry",
        ),
        "schema" => ImportError::bad(path, format!("{message}: export it as IFC4 or IFC2X3")),
        "stranger" => ImportError::bad(path, message),
        _ => ImportError::bad(
            path,
            format!("IfcOpenShell cannot read it ({message}): export it again"),
        ),
    }
}

fn broken_off(path: &Path, errors: &Path, last: &str) -> ImportError {
    let told = access::read(errors, 1 << 20).unwrap_or_default();
    let told = String::from_utf8_lossy(&told);
    let why = told.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("without a word");
    let at = if last.is_empty() { String::new() } else { format!(" near {last}") };
    ImportError::bad(
        path,
        format!("IfcOpenShell broke off{at} ({}): export it again", crate::file::shorten(why)),
    )
}

/// The answer in our own terms: y up, and coordinates as the file has them.
fn source(answer: Answer, shapes: &[u8]) -> Result<Source, String> {
    let mut notes = Vec::new();
    if let Some(draft) = &answer.draft {
        notes.push(format!("its schema {draft} was never released: read as IFC4X3_ADD2"));
    }
    if answer.units.iter().any(|u| Some(u) != answer.units.first()) {
        notes.push(format!(
            "it has several units of length ({}): {} is used; are sizes right?",
            answer.units.join(", "),
            answer.unit.as_ref().or(answer.units.first()).map_or("", String::as_str)
        ));
    }
    notes.extend(remarks(&answer));
    let missing = bodiless(&answer.elements);
    let damaged: Vec<String> = (answer.elements.iter().filter(|e| !e.damaged.is_empty()))
        .map(|e| {
            let name = crate::file::shorten(&e.name);
            format!("{} \"{name}\": its properties are damaged ({}): left out", e.class, e.damaged)
        })
        .collect();
    let elements: Result<Vec<Element>, String> =
        answer.elements.into_iter().map(|told| element(told, shapes)).collect();
    let mut elements = elements?;
    if elements.iter().all(|e| e.surface.is_empty() && e.courses.is_empty()) {
        let why =
            if missing.is_empty() { "no element has a body".into() } else { missing.join("; ") };
        return Err(format!(
            "has no surfaces: {why}; export bodies as extrusions or as triangles (IfcTriangulatedFaceSet)"
        ));
    }
    notes.extend(missing.into_iter().map(|m| format!("{m}: left out, and its load is missing")));
    notes.extend(elements.iter_mut().filter_map(|e| e.twice.take()));
    notes.extend(damaged);
    let unit = answer.unit.or(answer.units.first().cloned()).unwrap_or_default();
    let scale = answer.metres_per_unit;
    let georeference = georeference::resolve(answer.georeference, scale, &mut notes);
    Ok(Source {
        moved: DVec3::ZERO,
        format: format!("{} in {unit}, by IfcOpenShell {}", answer.schema, answer.ifcopenshell),
        is_ifc: true,
        project: answer.project,
        year: answer.year,
        elements,
        metres_per_unit: scale,
        notes,
        georeference,
    })
}

/// What the file says of itself that has two readings.
fn remarks(answer: &Answer) -> Vec<String> {
    let mut notes = Vec::new();
    if answer.projects.len() > 1 {
        notes.push(format!(
            "it has {} projects: the units of \"{}\" are used for all; export them one by one",
            answer.projects.len(),
            answer.project
        ));
    }
    if let Some(year) = answer.year
        && answer.year_text.trim().trim_end_matches(".0") != year.to_string()
    {
        notes.push(format!(
            "its year of construction is \"{}\": {year} is taken; say another one with --year",
            crate::file::shorten(&answer.year_text)
        ));
    }
    if answer.year.is_none() && !answer.year_text.is_empty() && answer.year_text != "None" {
        notes.push(format!(
            "its year of construction is \"{}\", no year from 1800 on: it is not used; say --year",
            crate::file::shorten(&answer.year_text)
        ));
    }
    if let Some(year) = answer.year.filter(|y| i64::from(*y) > super::project::this_year() as i64) {
        notes.push(format!(
            "its year of construction, {year}, is to come: no age follows from it; say --year"
        ));
    }
    if answer.steel_without_shape > 0 {
        notes.push(format!(
            "{} reinforcing bars, meshes or tendons have no shape and are not used: export them with their geometry",
            answer.steel_without_shape
        ));
    }
    let cut = answer.elements.iter().filter(|e| e.courses.iter().any(|c| c.is_cut));
    let cut: Vec<&Told> = cut.collect();
    if let [first, ..] = &cut[..] {
        notes.push(format!(
            "StartParam and EndParam of {} bars (such as \"{}\") end them within their polyline, as IFC has it: are they so short?",
            cut.len(),
            first.name
        ));
    }
    notes
}

/// Elements without a body, by class and reason; not those whose parts have one.
fn bodiless(elements: &[Told]) -> Vec<String> {
    let wholes: HashSet<&str> =
        elements.iter().flat_map(|e| &e.above).map(|above| above.id.as_str()).collect();
    let mut of: BTreeMap<(&str, &str, &str), Vec<&str>> = BTreeMap::new();
    let is_without = |e: &&Told| e.shapes.is_empty() && e.courses.is_empty();
    for told in elements.iter().filter(is_without) {
        if !wholes.contains(told.id.as_str()) && !told.class.starts_with("IfcReinforcing") {
            let key = (told.class.as_str(), told.items.as_str(), told.reason.as_str());
            of.entry(key).or_default().push(&told.name);
        }
    }
    let said = |((class, items, reason), names): ((&str, &str, &str), Vec<&str>)| {
        let name = crate::file::shorten(names.first().copied().unwrap_or_default());
        let shape = if items.is_empty() { String::new() } else { format!(", {items}") };
        let reason = if reason.is_empty() { "has no shape" } else { reason };
        match names.len() {
            1 => format!("{class} \"{name}\"{shape}: {reason}"),
            n => format!("{n} {class} (such as \"{name}\"{shape}): {reason}"),
        }
    };
    of.into_iter().map(said).collect()
}

/// Share of the smaller of two boxes in the other beyond which two bodies of an element are one.
const SAME_PLACE: f64 = 0.5;

/// Whether two bodies of an element lie at one place: the same one in two kinds of shape.
fn is_same_place(a: &Surface, b: &Surface) -> bool {
    let volume = |[low, high]: [DVec3; 2]| (high - low).max(DVec3::ZERO).element_product();
    let ([la, ha], [lb, hb]) = (a.bounds(), b.bounds());
    let smaller = volume([la, ha]).min(volume([lb, hb]));
    smaller > 0.0 && volume([la.max(lb), ha.min(hb)]) > SAME_PLACE * smaller
}

/// A Body is said once; some exporters say it again, as another kind of shape, and some in pieces.
/// Pieces lie beside each other, and all count.
fn element(told: Told, shapes: &[u8]) -> Result<Element, String> {
    let mut surface = Surface::default();
    let mut colour = None;
    let mut again = 0;
    for shape in &told.shapes {
        let mut own = Surface::default();
        add(&mut own, shape, shapes)
            .ok_or_else(|| format!("IfcOpenShell's shape of #{} is damaged", told.step))?;
        colour = colour.or(shape.colour.map(Vec3::from_array));
        if !surface.is_empty() && is_same_place(&surface, &own) {
            again += 1;
            continue;
        }
        let first = surface.points.len() as u32;
        surface.points.append(&mut own.points);
        surface.triangles.extend(own.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    let twice = (again > 0).then(|| {
        let name = crate::file::shorten(&told.name);
        format!(
            "{} \"{name}\" has {} bodies at one place: the first one counts",
            told.class,
            1 + again
        )
    });
    let course = |c: ToldCourse| Course {
        diameter: c.diameter,
        line: c.line.into_iter().map(|p| upright(DVec3::from_array(p))).collect(),
    };
    Ok(Element {
        id: told.id,
        class: told.class,
        predefined: told.predefined,
        name: told.name,
        words: vec![told.object_type, told.type_name],
        above: told.above,
        properties: told.properties,
        materials: told.materials,
        attributes: told.attributes,
        courses: told.courses.into_iter().map(course).filter(|c| c.line.len() > 1).collect(),
        surface,
        colour,
        twice,
        ..Element::default()
    })
}

/// IFC has z up, we have y.
fn upright(p: DVec3) -> DVec3 {
    DVec3::new(p.x, p.z, -p.y)
}

fn add(surface: &mut Surface, shape: &Shape, bytes: &[u8]) -> Option<()> {
    let corners = bytes.get(shape.at..shape.at.checked_add(shape.corners.checked_mul(24)?)?)?;
    let begin = shape.at + corners.len();
    let triangles = bytes.get(begin..begin.checked_add(shape.triangles.checked_mul(12)?)?)?;
    let matrix = DMat4::from_cols_array(&shape.matrix);
    let first = u32::try_from(surface.points.len()).ok()?;
    for corner in corners.chunks_exact(24) {
        let number =
            |i: usize| Some(f64::from_le_bytes(corner.get(8 * i..)?.get(..8)?.try_into().ok()?));
        let p = DVec3::new(number(0)?, number(1)?, number(2)?);
        let p = upright(matrix.transform_point3(p));
        surface.points.push(p.is_finite().then_some(p)?);
    }
    for triangle in triangles.chunks_exact(12) {
        let number =
            |i: usize| Some(u32::from_le_bytes(triangle.get(4 * i..)?.get(..4)?.try_into().ok()?));
        let indices = [number(0)?, number(1)?, number(2)?];
        if indices.iter().any(|&i| i as usize >= shape.corners) {
            return None;
        }
        surface.triangles.push(indices.map(|i| i + first));
    }
    Some(())
}
