//! In which unit lengths are written that are measured in the window: by the tape, the ruler, the
//! inspector and chainages. One choice for all of them, and the unit always stands beside the
//! number.

use std::cell::Cell;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::lang::fixed;

/// Metres of an inch and of a foot, by definition (international yard and pound agreement, 1959).
const INCH: f32 = 0.0254;
const FOOT: f32 = 12.0 * INCH;
/// Parts of an inch that are told apart.
const PARTS: i64 = 16;
/// Round lengths below a foot, inches.
const ROUND_INCHES: [f32; 7] = [6.0, 3.0, 1.0, 0.5, 0.25, 0.125, 0.0625];

/// The unit of lengths that are measured in the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lengths {
    /// Metres; what is shorter than one in millimetres, as on drawings.
    #[default]
    Metres,
    /// Millimetres, however many.
    Millimetres,
    /// Feet, inches and sixteenths of an inch.
    FeetAndInches,
}

impl Lengths {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Metres, Self::Millimetres, Self::FeetAndInches];

    /// What it is called in every language.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Metres => "m",
            Self::Millimetres => "mm",
            Self::FeetAndInches => "ft-in",
        }
    }
}

thread_local! {
    /// What is drawn is drawn on one thread.
    static CHOSEN: Cell<Lengths> = const { Cell::new(Lengths::Metres) };
}

/// Writes lengths so on this thread, from now on.
pub(crate) fn choose(lengths: Lengths) {
    CHOSEN.set(lengths);
}

fn chosen() -> Lengths {
    CHOSEN.get()
}

/// A length of so many metres, as it is read on a drawing: millimetres, from 10 m on centimetres.
pub(crate) fn length(m: f32) -> String {
    match chosen() {
        Lengths::Metres if m < 1.0 => millimetres(m),
        Lengths::Metres if m < 10.0 => metres(m, 3),
        Lengths::Metres => metres(m, 2),
        Lengths::Millimetres => millimetres(m),
        Lengths::FeetAndInches => feet(m),
    }
}

/// A place along a member, m from its start: as many digits everywhere, so that a moving one can be
/// read.
pub(crate) fn chainage(m: f32) -> String {
    match chosen() {
        Lengths::Metres => metres(m, 2),
        Lengths::Millimetres => millimetres(m),
        Lengths::FeetAndInches => feet(m),
    }
}

/// A length that is round already.
pub(crate) fn rounded(m: f32) -> String {
    match chosen() {
        Lengths::Metres if m < 1.0 => millimetres(m),
        Lengths::Metres => metres(m, 0),
        Lengths::Millimetres => millimetres(m),
        Lengths::FeetAndInches => feet(m),
    }
}

/// The largest round length that is not above so many metres.
pub(crate) fn round_within(most: f32) -> Option<f32> {
    match chosen() {
        Lengths::Metres | Lengths::Millimetres => round(most),
        Lengths::FeetAndInches if most >= FOOT => Some(FOOT * round(most / FOOT)?),
        Lengths::FeetAndInches => ROUND_INCHES.map(|n| n * INCH).into_iter().find(|l| *l <= most),
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `most`.
fn round(most: f32) -> Option<f32> {
    let power = 10_f32.powf(most.log10().floor());
    let round = [5.0, 2.0, 1.0].map(|k| k * power).into_iter().find(|l| *l <= most);
    round.filter(|l| l.is_finite())
}

/// A place in the world.
pub(crate) fn point(at: Vec3) -> String {
    match chosen() {
        Lengths::Metres => {
            let [x, y, z] = at.to_array().map(|x| fixed(x, 3));
            tr!("{}, {}, {} m", x, y, z)
        }
        Lengths::Millimetres => {
            let [x, y, z] = at.to_array().map(|x| fixed(1e3 * x, 0));
            tr!("{}, {}, {} mm", x, y, z)
        }
        Lengths::FeetAndInches => at.to_array().map(feet).join(", "),
    }
}

/// The three sides of a box.
pub(crate) fn sides(size: Vec3) -> String {
    let size = size.to_array();
    match chosen() {
        Lengths::Metres => format!("{} m", size.map(|x| fixed(x, 2)).join(" × ")),
        Lengths::Millimetres => format!("{} mm", size.map(|x| fixed(1e3 * x, 0)).join(" × ")),
        Lengths::FeetAndInches => size.map(feet).join(" × "),
    }
}

fn metres(m: f32, decimals: usize) -> String {
    format!("{} m", fixed(m, decimals))
}

fn millimetres(m: f32) -> String {
    format!("{} mm", fixed(1e3 * m, 0))
}

/// Feet, inches and sixteenths: 1 m is 3 ft 3 3/8 in.
fn feet(m: f32) -> String {
    let parts = (f64::from(m.abs()) / f64::from(INCH) * PARTS as f64).round() as i64;
    let (feet, inches, part) = (parts / (12 * PARTS), parts / PARTS % 12, parts % PARTS);
    let fraction = (part > 0).then(|| {
        let common = 1_i64 << part.trailing_zeros();
        format!("{}/{}", part / common, PARTS / common)
    });
    let inches = match (inches, fraction) {
        (0, Some(fraction)) => fraction,
        (whole, Some(fraction)) => format!("{whole} {fraction}"),
        (whole, None) => whole.to_string(),
    };
    let sign = if m < 0.0 && parts > 0 { "-" } else { "" };
    let feet = if feet > 0 { format!("{feet} ft ") } else { String::new() };
    format!("{sign}{feet}{inches} in")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `say` says in each of the units, in their order.
    fn all(say: impl Fn() -> String) -> [String; 3] {
        let said = Lengths::ALL.map(|lengths| {
            choose(lengths);
            say()
        });
        choose(Lengths::default());
        said
    }

    #[test]
    fn a_length_is_written_in_the_unit_that_was_chosen() {
        assert_eq!(all(|| length(0.25)), ["250 mm", "250 mm", "9 13/16 in"]);
        assert_eq!(all(|| length(1.0)), ["1.000 m", "1000 mm", "3 ft 3 3/8 in"]);
        assert_eq!(all(|| length(12.345)), ["12.35 m", "12345 mm", "40 ft 6 in"]);
        assert_eq!(all(|| chainage(0.25)), ["0.25 m", "250 mm", "9 13/16 in"]);
    }

    #[test]
    fn inches_are_written_as_fractions_in_their_lowest_terms() {
        let of = |inches: f32| feet(inches * INCH);
        assert_eq!([of(0.0), of(0.5), of(11.99)], ["0 in", "1/2 in", "1 ft 0 in"]);
        assert_eq!([of(12.0), of(30.75), of(-4.0)], ["1 ft 0 in", "2 ft 6 3/4 in", "-4 in"]);
    }

    #[test]
    fn places_and_sizes_always_have_their_unit() {
        let at = Vec3::new(0.3048, -1.0, 2.5);
        let points = [
            "0.305, -1.000, 2.500 m",
            "305, -1000, 2500 mm",
            "1 ft 0 in, -3 ft 3 3/8 in, 8 ft 2 7/16 in",
        ];
        assert_eq!(all(|| point(at)), points);
        let sizes = ["1.00 × 2.00 × 0.25 m", "1000 × 2000 × 250 mm"];
        let said = all(|| sides(Vec3::new(1.0, 2.0, 0.25)));
        assert_eq!(said[..2], sizes);
        assert_eq!(said[2], "3 ft 3 3/8 in × 6 ft 6 3/4 in × 9 13/16 in");
    }

    #[test]
    fn round_lengths_are_round_in_their_unit() {
        let of = |most: f32| all(move || round_within(most).map_or_else(String::new, rounded));
        assert_eq!(of(0.7), ["500 mm", "500 mm", "2 ft 0 in"]);
        assert_eq!(of(3.0), ["2 m", "2000 mm", "5 ft 0 in"]);
        assert_eq!(of(0.21), ["200 mm", "200 mm", "6 in"]);
    }
}
