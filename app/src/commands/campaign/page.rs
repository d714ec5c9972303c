//! Rows of predictions as the page of a network takes them.

use intrados_report::network::Item;
use serde_json::Value;

use super::table::Rows;

/// Names of the states that rows speak of, mildest first.
pub(crate) fn state_names(rows: &Rows) -> Vec<String> {
    probabilities(rows).map(|(_, name)| name).collect()
}

/// Columns of states' probabilities: those between the state and the next that is none.
fn probabilities(rows: &Rows) -> impl Iterator<Item = (usize, String)> {
    let first = rows.column("state").map_or(rows.columns.len(), |at| at + 1);
    rows.columns.iter().enumerate().skip(first).map_while(|(at, column)| {
        let name = column.strip_prefix("p_")?.strip_suffix(" [1]")?;
        (name != "rust").then(|| (at, name.to_owned()))
    })
}

/// A row as an item of the page.
pub(crate) fn items(rows: &Rows) -> Vec<Item> {
    let states: Vec<usize> = probabilities(rows).map(|(at, _)| at).collect();
    let at = |names: [&str; 2]| names.iter().find_map(|name| rows.column(name));
    let columns = [
        at(["bridge_id", "structure"]),
        at(["name", "name"]),
        at(["road", "road"]),
        at(["span", "member_id"]),
        at(["kind", "kind"]),
        at(["state", "state"]),
        at(["look", "advice"]),
        at(["not_forecast", "not_forecast"]),
    ];
    let numbers = [
        rows.column("latitude [deg]"),
        rows.column("longitude [deg]"),
        rows.column("year"),
        rows.column("damage [1]"),
        rows.column("damage_std_error [1]"),
        rows.column("foretold_later [1]"),
        rows.column("length [m]"),
        rows.column("foretold_now [1]"),
    ];
    let item = |row: &Vec<Value>| {
        let number = |at: Option<usize>| at.and_then(|at| row.get(at)).and_then(Value::as_f64);
        let word = |at: Option<usize>| at.and_then(|at| row.get(at)).map(super::table::cell);
        let [structure, name, road, part, kind, state, look, not_forecast] =
            columns.map(|at| word(at).unwrap_or_default());
        let [latitude, longitude, year, damage, std_error, later, length, foretold] =
            numbers.map(number);
        Item {
            structure,
            name,
            road,
            part,
            kind,
            state,
            look,
            not_forecast,
            place: latitude.zip(longitude).map(|(a, b)| [a, b]),
            year: year.map(|y| y as i32),
            damage,
            std_error,
            foretold,
            later,
            length,
            probability: states.iter().filter_map(|&at| number(Some(at))).collect(),
        }
    };
    rows.rows.iter().map(item).collect()
}
