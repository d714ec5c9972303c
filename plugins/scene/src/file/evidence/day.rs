//! Days as spreadsheets and instruments write them.

use crate::structure::Date;

/// Which of the first two numbers of `05/03/2026` is the day.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DayOrder {
    DayFirst,
    MonthFirst,
}

/// The days of spreadsheets that are taken for such, 1954 to 2119.
const SERIALS: std::ops::Range<i64> = 20_000..80_000;
/// The day of spreadsheets that is 1 January 1970.
const EPOCH: i64 = 25_569;

/// A day as it was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SheetDay {
    pub(super) date: Date,
    /// It was a spreadsheet's number of a day.
    pub(super) is_serial: bool,
}

/// Two numbers before a year that may be day and month, or month and day.
fn open_pair(cell: &str) -> Option<[u32; 2]> {
    let day = cell.trim().split(['T', ' ']).next()?;
    let parts: Vec<&str> = day.split(['/', '-']).collect();
    let [first, second, year] = parts[..] else { return None };
    let short = |part: &str| part.parse::<u32>().ok().filter(|_| part.len() <= 2);
    (year.len() == 4).then_some([short(first)?, short(second)?])
}

/// In which order the days of a column are written, where one of them decides it.
pub(super) fn order<'a>(cells: impl Iterator<Item = &'a str>) -> Option<DayOrder> {
    let (mut day_first, mut month_first) = (false, false);
    for [first, second] in cells.filter_map(open_pair) {
        day_first |= first > 12;
        month_first |= second > 12;
    }
    match (day_first, month_first) {
        (true, false) => Some(DayOrder::DayFirst),
        (false, true) => Some(DayOrder::MonthFirst),
        _ => None,
    }
}

/// Reads a day, of which the hour says nothing here.
pub(super) fn read(cell: &str, order: Option<DayOrder>) -> Result<SheetDay, String> {
    let day = cell.trim().split(['T', ' ']).next().unwrap_or(cell);
    let of = |year: u32, month: u32, day: u32| {
        let date = format!("{year:04}-{month:02}-{day:02}").parse::<Date>();
        date.map(|date| SheetDay { date, is_serial: false }).map_err(|why| why.to_string())
    };
    if day.bytes().all(|b| b.is_ascii_digit() || b == b'.') && !day.is_empty() {
        let digits = day.split('.').next().unwrap_or(day);
        if let (8, Ok(number), false) = (day.len(), day.parse::<u32>(), day.contains('.')) {
            return of(number / 10_000, number / 100 % 100, number % 100);
        }
        let is_alone = day.matches('.').count() < 2;
        if let Some(serial) = digits.parse::<i64>().ok().filter(|n| is_alone && SERIALS.contains(n))
        {
            let start = "1970-01-01".parse::<Date>().map_err(|why| why.to_string())?;
            return Ok(SheetDay { date: start.plus_days(serial - EPOCH), is_serial: true });
        }
    }
    let parts: Vec<&str> = day.trim_end_matches('.').split(['-', '/', '.']).collect();
    let numbers: Vec<Option<u32>> = parts.iter().map(|part| part.parse().ok()).collect();
    let [Some(a), Some(b), Some(c)] = numbers[..] else {
        return Err("is no date: write year, month and day as 2026-05-03".into());
    };
    let lengths: Vec<usize> = parts.iter().map(|part| part.len()).collect();
    match lengths[..] {
        [4, 1..=2, 1..=2] => of(a, b, c),
        [1..=2, 1..=2, 4] if day.contains('.') => of(c, b, a),
        [1..=2, 1..=2, 4] => match order {
            Some(DayOrder::DayFirst) => of(c, b, a),
            Some(DayOrder::MonthFirst) => of(c, a, b),
            None if a == b => of(c, a, b),
            None if a > 12 => of(c, b, a),
            None if b > 12 => of(c, a, b),
            None => Err(format!(
                "is {c:04}-{b:02}-{a:02} or {c:04}-{a:02}-{b:02}, and no row decides which: write year, month and day as 2026-05-03"
            )),
        },
        [1..=2, 1..=2, 1..=2] => {
            Err("has a year of two digits, which may be first or last: write 2026-05-03".into())
        }
        _ => Err("is no date: write year, month and day as 2026-05-03".into()),
    }
}

/// Whether a cell is a day for certain.
pub(super) fn is_day(cell: &str) -> bool {
    read(cell, Some(DayOrder::DayFirst)).is_ok_and(|day| !day.is_serial)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_read_as_their_column_writes_them() {
        for (cell, column, day) in [
            ("2026-05-03", "", Some("2026-05-03")),
            ("2026/5/3", "", Some("2026-05-03")),
            ("2026-05-03T23:30:00-08:00", "", Some("2026-05-03")),
            ("20260503", "", Some("2026-05-03")),
            ("03.05.2026", "", Some("2026-05-03")),
            ("3.5.2026 14:00", "", Some("2026-05-03")),
            ("46145", "", Some("2026-05-03")),
            ("46145.75", "", Some("2026-05-03")),
            ("05/03/2026", "05/23/2026", Some("2026-05-03")),
            ("05/03/2026", "23/03/2026", Some("2026-03-05")),
            ("05/05/2026", "", Some("2026-05-05")),
            ("05/23/2026", "", Some("2026-05-23")),
            ("05/03/2026", "", None),
            ("03-05-2026", "", None),
            ("26-05-03", "", None),
            ("260503", "", None),
            ("03.05.26", "", None),
            ("2026-02-30", "", None),
            ("May", "", None),
            ("", "", None),
        ] {
            let found = read(cell, order([cell, column].into_iter())).ok();
            assert_eq!(found.map(|d| d.date.to_string()).as_deref(), day, "{cell} beside {column}");
        }
    }
}
