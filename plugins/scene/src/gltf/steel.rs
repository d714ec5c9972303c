//! Where steel runs and how a member lies, as `extras.intrados` of nodes says it: in the file's
//! world, m.

use glam::Vec3;
use serde_json::{Map, Value, json};

use super::json::Json;
use crate::{
    Frame, Part, SteelLine,
    structure::{Bond, Grade, Prestress},
};

/// Points that one line may have.
const MOST_POINTS: usize = 10_000;

/// `steel` of a node.
pub(super) fn said(line: &SteelLine) -> Value {
    let mut said = Map::new();
    said.insert("name".into(), line.name.clone().into());
    said.insert("diameter_m".into(), line.diameter.into());
    said.insert("line".into(), line.line.iter().map(|p| json!(p.to_array())).collect());
    if let Some(grade) = line.grade {
        said.insert("grade".into(), grade.name.into());
        said.insert("f_y_mpa".into(), grade.yield_mpa.into());
    }
    if line.bond == Bond::Slip {
        said.insert("bond".into(), json!(line.bond));
    }
    if line.bond == Bond::Slip || line.inward != Vec3::ZERO {
        said.insert("ends".into(), json!(line.ends));
    }
    if line.inward != Vec3::ZERO {
        said.insert("inward_m".into(), json!(line.inward.to_array()));
    }
    if let Some(prestress) = &line.prestress {
        said.insert("prestress".into(), serde_json::to_value(prestress).unwrap_or_default());
    }
    said.into()
}

/// The same, read; none where it is damaged.
pub(super) fn read(said: &Value, part: Part) -> Option<SteelLine> {
    let points = said.list("line");
    let line: Vec<Vec3> = points.iter().take(MOST_POINTS).map(point).collect::<Option<_>>()?;
    let diameter = said.number("diameter_m")? as f32;
    let fits = (2..=MOST_POINTS).contains(&points.len()) && (1e-4..=2.0).contains(&diameter);
    let f_y = said.number("f_y_mpa").map(|f| f as f32).filter(|f| (150.0..=1000.0).contains(f));
    let grade = said.text("grade").and_then(Grade::named).map(|g| g.at(f_y));
    let prestress: Option<Prestress> = serde_json::from_value(said.field("prestress").clone()).ok();
    fits.then(|| SteelLine {
        name: said.text("name").unwrap_or("").to_owned(),
        part,
        diameter,
        line,
        grade,
        bond: serde_json::from_value(said.field("bond").clone()).unwrap_or_default(),
        ends: serde_json::from_value(said.field("ends").clone()).unwrap_or_default(),
        inward: point(said.field("inward_m")).unwrap_or_default(),
        prestress,
    })
}

fn point(said: &Value) -> Option<Vec3> {
    let point: [f32; 3] = serde_json::from_value(said.clone()).ok()?;
    Some(Vec3::from(point)).filter(|p| p.is_finite())
}

/// `frame` of a node.
pub(super) fn said_frame(frame: &Frame) -> Value {
    let [start, axis, zero] = [frame.start, frame.axis, frame.zero].map(|v| v.to_array());
    json!({ "start": start, "axis": axis, "zero": zero })
}

/// The same, read; none where its directions do not stand square on each other.
pub(super) fn read_frame(said: &Value) -> Option<Frame> {
    let vector = |key| {
        let [x, y, z] = said.numbers::<3>(key)?.map(|x| x as f32);
        Some(Vec3::new(x, y, z))
    };
    let frame = Frame { start: vector("start")?, axis: vector("axis")?, zero: vector("zero")? };
    let along = frame.axis.try_normalize()?;
    let is_square = along.dot(frame.zero).abs() < 1e-3 && (frame.zero.length() - 1.0).abs() < 1e-3;
    is_square.then_some(frame)
}
