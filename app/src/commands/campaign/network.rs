//! A table of bridges as units: the rows of one part of it.

use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

use intrados_damage::grading::Profile;
use intrados_forecast::{self as forecast, ForecastError, ForecastSettings, span};
use intrados_scene::Scene;
use intrados_stage::access;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{plan::Structure, table::Rows};
use crate::{args::LifeArg, failure::Failure, output, session::Session};

/// How spans of a table live.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Network {
    /// Bridges of the table that count.
    pub(crate) rows: usize,
    pub(crate) life: LifeArg,
    pub(crate) settings: span::Settings,
}

/// Longest table that is read, bytes.
const LONGEST: u64 = 1 << 30;
/// Between two notes of what is done.
const NOTE: Duration = Duration::from_secs(10);
/// What is done of a unit that is not.
const BEGUN: &str = "begun.json";

/// Reads a table of bridges; its hash.
pub(super) fn read(path: &Path) -> Result<(span::BridgeTable, String), Failure> {
    let bytes = access::read(path, LONGEST).map_err(|why| Failure::denied(path, &why))?;
    let table = span::parse(&bytes)
        .map_err(|why| Failure::BadInput(format!("{}: {why}", path.display())))?;
    Ok((table, blake3::hash(&bytes).to_hex().to_string()))
}

/// What is done of a unit: how many bridges, and their rows.
#[derive(Serialize, Deserialize)]
struct Begun {
    bridges: usize,
    rows: Rows,
}

/// The rows of part I of N of the bridges, one a span; noted in `folder` while they come.
pub(super) fn rows(
    session: &Session,
    network: &Network,
    structure: &Structure,
    [i, n]: [u64; 2],
    folder: &Path,
) -> Result<Rows, Failure> {
    let (table, hash) = read(&structure.path)?;
    let bridges = table.bridges;
    if hash != structure.hash {
        return Err(Failure::BadInput(format!(
            "{}: has changed since the campaign was planned: plan a new one",
            structure.path.display()
        )));
    }
    let rows = network.rows.min(bridges.len()) as u64;
    let [from, to] = [i, i + 1].map(|k| (rows * k / n) as usize);
    let ours = bridges.get(from..to).unwrap_or_default();
    let profile = Profile::default();
    let note = folder.join(BEGUN);
    let mut begun = recall(&note, ours.len()).unwrap_or_else(|| Begun {
        bridges: 0,
        rows: Rows { columns: columns(&profile), rows: Vec::new() },
    });
    let (mut sections, mut noted) = (span::Sections::default(), Instant::now());
    let _progress = session.watch(format!("lives of {} bridges", ours.len()));
    while let Some(bridge) = ours.get(begun.bridges) {
        if session.job.step(begun.bridges, ours.len()).is_err() {
            output::put(&note, output::json(&begun)?.as_bytes())?;
            return Err(Failure::Interrupted);
        }
        match of_bridge(session, network, bridge, &profile, &mut sections) {
            Ok(rows) => begun.rows.rows.extend(rows),
            Err(Failure::Interrupted) => continue,
            Err(failure) => return Err(failure),
        }
        begun.bridges += 1;
        if noted.elapsed() >= NOTE {
            output::put(&note, output::json(&begun)?.as_bytes())?;
            noted = Instant::now();
        }
    }
    _ = fs::remove_file(&note);
    Ok(begun.rows)
}

/// What an earlier start has done; one that cannot be read is done again.
fn recall(note: &Path, most: usize) -> Option<Begun> {
    let begun: Begun = serde_json::from_slice(&access::read(note, LONGEST).ok()?).ok()?;
    (begun.bridges <= most).then_some(begun)
}

fn columns(profile: &Profile) -> Vec<String> {
    let mut columns: Vec<String> = [
        "bridge_id",
        "name",
        "road",
        "latitude [deg]",
        "longitude [deg]",
        "year",
        "rehabilitated",
        "span",
        "of_spans",
        "length [m]",
        "kind",
        "concrete",
        "damage [1]",
        "damage_std_error [1]",
        "state",
    ]
    .map(String::from)
    .into();
    columns.extend(profile.states.iter().map(|state| format!("p_{} [1]", state.name)));
    columns.extend(
        [
            "p_rust [1]",
            "steel_lost [1]",
            "steel_lost_std_error [1]",
            "cracked [1]",
            "crack_width [mm]",
            "foretold_now [1]",
            "foretold_later [1]",
            "look",
            "not_forecast",
        ]
        .map(String::from),
    );
    columns
}

/// The rows of a bridge, one a span.
fn of_bridge(
    session: &Session,
    network: &Network,
    bridge: &span::Bridge,
    profile: &Profile,
    sections: &mut span::Sections,
) -> Result<Vec<Vec<Value>>, Failure> {
    let spans = span::spans(bridge);
    let mut rows = Vec::new();
    for (k, span) in spans.iter().enumerate() {
        let mut row = vec![
            json!(bridge.id),
            json!(bridge.name),
            json!(bridge.road),
            json!(bridge.place.map(|p| p[0])),
            json!(bridge.place.map(|p| p[1])),
            json!(bridge.year),
            json!(bridge.rehabilitated),
            json!(k + 1),
            json!(bridge.spans.len()),
            json!(bridge.spans.get(k)),
        ];
        let life = match (span, network.life) {
            (Err(why), _) => Err((*why).to_owned()),
            (Ok(span), LifeArg::Section) => {
                sections.live(span, network.settings, profile).map_err(|why| why.to_string())
            }
            (Ok(span), LifeArg::Full) => full(session, span, network.settings, profile)?,
        };
        row.extend(match span {
            Ok(span) => [json!(span.kind.name()), json!(span.class)],
            Err(_) => [Value::Null, Value::Null],
        });
        row.extend(said(&life, profile));
        row.push(span.as_ref().map_or(Value::Null, |span| json!(look(span))));
        row.push(life.err().map_or(Value::Null, |why| json!(why)));
        rows.push(row);
    }
    Ok(rows)
}

/// The cells from damage to what is foretold for later.
fn said(life: &Result<span::Life, String>, profile: &Profile) -> Vec<Value> {
    let Ok(life) = life else { return vec![Value::Null; profile.states.len() + 10] };
    let mut cells =
        vec![json!(life.damage.value), json!(life.damage.std_error), json!(life.verdict.state)];
    cells.extend(profile.states.iter().map(|s| json!(life.verdict.probability.get(&s.name))));
    cells.extend([
        json!(life.rusts),
        json!(life.worst.steel_lost),
        json!(life.worst.steel_lost_std_error),
        json!(life.worst.cracked),
        json!(life.crack_mm),
        json!(life.worst.damage),
        json!(life.later),
    ]);
    cells
}

/// Where to look first: what the sections say is decided by cover and salt there.
fn look(span: &span::Span) -> &'static str {
    match (span.kind, span.continuous) {
        (span::Kind::Deck, _) => {
            "deck: half-cell and cover from above, soffit between girders; girders are not forecast"
        }
        (_, true) => "deck over the piers: half-cell, cover, chloride; then the soffit at mid-span",
        (_, false) => "soffit at mid-span: cracks, cover, half-cell",
    }
}

/// The life of a span in finite elements; why there is none.
fn full(
    session: &Session,
    span: &span::Span,
    settings: span::Settings,
    profile: &Profile,
) -> Result<Result<span::Life, String>, Failure> {
    let text = match span::drawn(span, settings) {
        Ok(text) => text,
        Err(why) => return Ok(Err(why.to_owned())),
    };
    let internal = |e: std::io::Error| Failure::Internal(format!("a temporary file: {e}"));
    let file = tempfile::Builder::new().suffix(".ron").tempfile().map_err(internal)?;
    fs::write(file.path(), text).map_err(internal)?;
    let scene = Scene::open(file.path(), &session.job)?;
    let ahead_years = settings.ahead_years;
    let settings = ForecastSettings { ahead_years, ..ForecastSettings::default() };
    // Shares of this life are none of the unit's.
    let job = session.job.part(0.0, 0.0);
    match forecast::forecast(&scene, span::ID, None, &profile.rule, settings, &job) {
        Err(ForecastError::Cancelled) => Err(Failure::Interrupted),
        Err(why) => Ok(Err(why.to_string())),
        Ok(told) => Ok(told
            .first()
            .map(|told| {
                let later = told.later.unwrap_or(told.now);
                let rusts = told.rust.probability_depassivated;
                span::of_foretold([told.now, later], rusts, profile)
            })
            .ok_or_else(|| "no member came of it".to_owned())),
    }
}
