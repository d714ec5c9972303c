//! Grids, as meters of potential and cover write them: a place along the axis a row, a place across
//! the face a column.

use intrados_stage::sheet;

use super::{Column, Holds, Kind, Layout, Problem, Table, doubt::is_gap, shorten, unit};
use crate::file::evidence::units::split_unit;

/// Whether a name is a place across a face, as the header of a grid has it.
pub(super) fn is_place_across(name: &str) -> bool {
    let base = split_unit(name).0.trim_end_matches(['m', ' ']);
    sheet::number(base, sheet::own_mark(base)).is_some()
}

impl Table<'_> {
    /// Whether the columns that hold values are named by their places.
    pub(super) fn is_grid(&self) -> bool {
        let is_place = |name: &str| name.is_empty() || is_place_across(name);
        !self.channels.is_empty()
            && self.channels.iter().all(|channel| is_place(&channel.name))
            && !self.has(Column::Date)
    }

    /// What a grid holds: as it is given, by its row of units, or by values that only potentials
    /// have.
    pub(super) fn of_grid(&mut self, layout: &Layout) -> Result<Holds, Problem> {
        self.channels.retain(|channel| !channel.name.is_empty());
        let below = self.unit_below(layout)?;
        let given = self.survey.unit.clone();
        if let (Some(below), Some(given)) = (&below, &given)
            && below != given
        {
            let (below, given) = (shorten(below), shorten(given));
            let message =
                format!("the unit is {below} here, and {given} is given: correct one of them");
            return Err(self.in_header("UNIT", message));
        }
        let said = below.or(given);
        let kind = match self.survey.kind {
            Some(kind) => kind,
            None => self.likely_kind(layout, said.as_deref())?,
        };
        let said = said.or(kind.units().first().map(|(name, _)| (*name).to_owned()));
        self.value_unit = said.filter(|name| !name.is_empty());
        unit(Some(kind), self.value_unit.as_deref())
            .map_err(|why| self.in_header("UNIT", format!("the unit of the grid {why}")))?;
        let file = self.file;
        self.notes.push(format!(
            "{file}: places across a face are not used: a row's readings count for its place along the axis"
        ));
        match self.unfit(Holds::Grid { kind }) {
            Some(message) => Err(self.in_header("UNFIT", message)),
            None => Ok(Holds::Grid { kind }),
        }
    }

    /// The one unit that a row below the header gives to what was measured; m and degrees are those
    /// of places.
    fn unit_below(&self, layout: &Layout) -> Result<Option<String>, Problem> {
        let cells = self.channels.iter().filter_map(|channel| layout.units.get(channel.index));
        let mut named = cells
            .map(|cell| cell.trim_matches(['[', ']', '(', ')', ' ']))
            .filter(|unit| !matches!(*unit, "" | "-" | "--" | "m" | "°" | "deg"));
        let Some(first) = named.next() else { return Ok(None) };
        match named.find(|other| *other != first) {
            Some(other) => {
                let message = format!(
                    "columns of one grid are in {} and in {}: give them one unit",
                    shorten(first),
                    shorten(other)
                );
                Err(self.in_header("UNIT", message))
            }
            None => Ok(Some(first.to_owned())),
        }
    }

    /// The kind of a grid of which none is given.
    fn likely_kind(&mut self, layout: &Layout, unit: Option<&str>) -> Result<Kind, Problem> {
        match unit {
            Some("mV" | "V") => return Ok(Kind::HalfCell),
            Some("m/s" | "km/s") => return Ok(Kind::Velocity),
            _ => {}
        }
        // Nothing but potentials is below 0; what instruments write for nothing may be one cell.
        let mut reader = self.reader(&layout.text);
        let (mut below, mut all) = (0_usize, 0_usize);
        for record in reader.records().map_while(Result::ok) {
            for channel in &self.channels {
                let Some(cell) = record.get(channel.index).filter(|cell| !is_gap(cell)) else {
                    continue;
                };
                all += 1;
                below += usize::from(cell.starts_with(['-', '\u{2212}']));
            }
        }
        if unit.is_none() && 2 * below > all {
            let (file, electrode) = (self.file, self.survey.electrode.name());
            self.notes.push(format!(
                "{file}: its grid names no kind; its values are below 0, and were read as half-cell potentials in mV against {electrode}"
            ));
            return Ok(Kind::HalfCell);
        }
        let message = "nothing says what the grid holds: give its kind (kind: Cover in evidence.ron, attach --kind cover), one of cover, rebound, velocity, half-cell, carbonation";
        Err(self.in_header("NO_KIND", message.into()))
    }
}
