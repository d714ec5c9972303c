//! Calendar days.

use std::{borrow::Cow, fmt, str::FromStr};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A day of the Gregorian calendar, written as ISO 8601 does: `2026-05-03`. The earlier is less.
///
/// ```
/// use intrados_scene::structure::Date;
///
/// let [inspected, today]: [Date; 2] = ["2024-02-28", "2024-03-01"].map(|d| d.parse().unwrap());
/// assert_eq!(inspected.days_until(today), 2);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Date {
    year: i32,
    month: u32,
    day: u32,
}

/// Why a text is no date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DateError {
    /// It is written in another way.
    #[error("is no date: write year, month and day as 2026-05-03")]
    Form,
    /// No calendar has it.
    #[error("is a day that no calendar has: write year, month and day as 2026-05-03")]
    NoSuchDay,
    /// Nobody has measured then.
    #[error("is before {} or after {}: is the year right?", YEARS.start(), YEARS.end())]
    Year,
}

/// Years in which concrete has been looked at, or may be yet.
const YEARS: std::ops::RangeInclusive<i32> = 1850..=2200;

impl Date {
    /// Days from this one to another; negative to an earlier one.
    #[must_use]
    pub fn days_until(self, other: Self) -> i64 {
        other.number() - self.number()
    }

    /// This many days later.
    #[must_use]
    pub fn plus_days(self, days: i64) -> Self {
        Self::of_number(self.number() + days)
    }

    /// Its year.
    #[must_use]
    pub fn year(self) -> i32 {
        self.year
    }

    /// Today, in Greenwich.
    #[must_use]
    pub fn today() -> Self {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self::of_number(since.map_or(0, |d| (d.as_secs() / 86_400) as i64))
    }

    /// Whether nobody can have measured then yet: it is after today everywhere on earth.
    #[must_use]
    pub fn is_to_come(self) -> bool {
        self > Self::today().plus_days(1)
    }

    /// What is said of a day that [`Date::is_to_come`].
    #[must_use]
    pub fn to_come(self) -> String {
        format!(
            "{self} is a day to come (today is {}): is the year right? correct it",
            Self::today()
        )
    }

    /// Days since the first of January 1970. The year is taken to begin in March, so that the day
    /// that some years have more is its last (H. Hinnant, *chrono-compatible low-level date
    /// algorithms*).
    fn number(self) -> i64 {
        let (month, day) = (i64::from(self.month), i64::from(self.day));
        let year = i64::from(self.year) - i64::from(month <= 2);
        let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
        let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
        era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
    }

    /// The inverse of [`Date::number`].
    fn of_number(number: i64) -> Self {
        let days = number + 719_468;
        let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
        let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year + year / 4 - year / 100);
        let from_march = (5 * of_year + 2) / 153;
        let month = (from_march + 2) % 12 + 1;
        Self {
            year: (year + era * 400 + i64::from(month <= 2)) as i32,
            month: month as u32,
            day: (of_year - (153 * from_march + 2) / 5 + 1) as u32,
        }
    }
}

impl FromStr for Date {
    type Err = DateError;

    fn from_str(text: &str) -> Result<Self, DateError> {
        let digits = |part: Option<&str>, length: usize| -> Result<u32, DateError> {
            let part = part.filter(|p| p.len() == length && p.bytes().all(|b| b.is_ascii_digit()));
            part.and_then(|p| p.parse().ok()).ok_or(DateError::Form)
        };
        let mut parts = text.split('-');
        let year = digits(parts.next(), 4)? as i32;
        let (month, day) = (digits(parts.next(), 2)?, digits(parts.next(), 2)?);
        if parts.next().is_some() {
            return Err(DateError::Form);
        }
        let date = Self { year, month, day };
        if !(1..=12).contains(&month) || Self::of_number(date.number()) != date {
            return Err(DateError::NoSuchDay);
        }
        if YEARS.contains(&year) { Ok(date) } else { Err(DateError::Year) }
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04}-{:02}-{:02}", self.year, self.month, self.day)
    }
}

impl Serialize for Date {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Date {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let short = || text.chars().take(20).collect::<String>();
        text.parse().map_err(|why| de::Error::custom(format!("{:?} {why}", short())))
    }
}

impl JsonSchema for Date {
    fn schema_name() -> Cow<'static, str> {
        "Date".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "format": "date" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_over_leap_years_and_centuries() {
        let date = |text: &str| text.parse::<Date>().unwrap();
        for (from, to, days) in [
            ("1970-01-01", "2000-03-01", 11_017),
            ("1899-12-31", "1900-03-01", 60),
            ("1999-12-31", "2000-03-01", 61),
            ("2026-05-03", "2025-05-03", -365),
        ] {
            assert_eq!(date(from).days_until(date(to)), days, "{from} to {to}");
            assert_eq!(date(from).plus_days(days), date(to));
        }
        // Every day of four centuries is the day after the one before.
        let mut day = date("1850-01-01");
        while day < date("2200-12-31") {
            let next = day.plus_days(1);
            assert!(day < next && next.to_string().parse() == Ok(next), "{next}");
            day = next;
        }
    }

    #[test]
    fn what_is_no_day_is_refused() {
        for (text, why) in [
            ("2026-02-30", DateError::NoSuchDay),
            ("2025-02-29", DateError::NoSuchDay),
            ("2026-13-01", DateError::NoSuchDay),
            ("2026-00-01", DateError::NoSuchDay),
            ("2026-05-00", DateError::NoSuchDay),
            ("20260-5-03", DateError::Form),
            ("3.5.2026", DateError::Form),
            ("2026-5-3", DateError::Form),
            ("2026-05-03T10", DateError::Form),
            ("", DateError::Form),
            ("0026-05-03", DateError::Year),
            ("2262-05-03", DateError::Year),
        ] {
            assert_eq!(text.parse::<Date>(), Err(why), "{text}");
        }
    }
}
