//! Rows of results: what a unit leaves, and what is collected of all.

use intrados_stage::csv;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::failure::Failure;

/// Columns with their units, such as `span [m]`, and rows of nothing, truth, numbers and words.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Rows {
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<Value>>,
}

impl Rows {
    pub(crate) fn new(columns: &[&str]) -> Self {
        Self { columns: columns.iter().map(|c| (*c).to_owned()).collect(), rows: Vec::new() }
    }

    /// Adds the rows of another one below.
    pub(crate) fn append(&mut self, other: Self) -> Result<(), Failure> {
        if self.columns.is_empty() {
            *self = other;
            return Ok(());
        }
        if self.columns != other.columns {
            return Err(Failure::BadInput(format!(
                "results of different columns: {} beside {}: plan all of it with one profile",
                other.columns.join(", "),
                self.columns.join(", ")
            )));
        }
        self.rows.extend(other.rows);
        Ok(())
    }

    /// As a table of text: numbers with all their digits.
    pub(crate) fn csv(&self) -> String {
        let columns: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        let mut table = csv::Table::new(&columns);
        for row in &self.rows {
            table.row(&row.iter().map(cell).collect::<Vec<_>>());
        }
        table.text()
    }

    /// One object a row.
    pub(crate) fn objects(&self) -> Vec<Map<String, Value>> {
        let object = |row: &Vec<Value>| {
            self.columns.iter().cloned().zip(row.iter().cloned()).collect::<Map<_, _>>()
        };
        self.rows.iter().map(object).collect()
    }

    /// Where a column stands.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }
}

/// A value as text: numbers with all their digits.
pub(crate) fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
