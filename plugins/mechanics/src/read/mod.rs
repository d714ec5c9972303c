//! Meshes and models of other programs: Abaqus and CalculiX decks ([`abaqus`]), Gmsh meshes (by
//! [`crate::linear::parse_mesh`]).
//!
//! Files carry no units, so the reader is told [`Units`] and gives SI. What a file says is checked
//! before it is used, and what is not understood is refused with one line naming file, line and
//! remedy: nothing that changes the answer is skipped. What only concerns output is skipped and
//! noted.

pub mod abaqus;
mod deck;
pub(crate) mod gmsh;
#[cfg(test)]
pub(crate) mod solids;

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use intrados_stage::access::{self, Denied};

pub(crate) use deck::{
    Amplitude, Body, Concrete, Deck, Embedded, Fixed, Formulation, InitialStress, Load, Material,
    ModelChange, Pressure, Section, SectionKind, Step, Stiffening, Temperature,
};

/// The largest file that is read, bytes.
pub(crate) const MAX_BYTES: u64 = 2 << 30;
/// Faults that one line names.
const NAMED: usize = 12;
/// Entries that sets, loads and supports of one file may expand to.
const MAX_ENTRIES: usize = 50_000_000;

/// Units of a file: length, force, and what follows from them with the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// m, N, s, kg: SI.
    MetreNewton,
    /// mm, N, s, tonne: stress in MPa, density in t/mm³, acceleration in mm/s².
    MillimetreNewton,
}

impl Units {
    /// Metres.
    #[must_use]
    pub(crate) fn length(self) -> f64 {
        match self {
            Self::MetreNewton => 1.0,
            Self::MillimetreNewton => 1e-3,
        }
    }

    /// Square metres.
    #[must_use]
    pub(crate) fn area(self) -> f64 {
        self.length() * self.length()
    }

    /// Pascal.
    #[must_use]
    pub(crate) fn stress(self) -> f64 {
        match self {
            Self::MetreNewton => 1.0,
            Self::MillimetreNewton => 1e6,
        }
    }

    /// Kilogram per cubic metre.
    #[must_use]
    pub(crate) fn density(self) -> f64 {
        match self {
            Self::MetreNewton => 1.0,
            Self::MillimetreNewton => 1e12,
        }
    }

    /// J/(kg·K): the square of the unit of velocity.
    #[must_use]
    pub(crate) fn specific_heat(self) -> f64 {
        match self {
            Self::MetreNewton => 1.0,
            Self::MillimetreNewton => 1e-6,
        }
    }
}

/// Units that no deck is read in, as they were given.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("units {0:?}: give \"m,N\" or \"mm,N\"")]
pub struct UnitsError(String);

impl FromStr for Units {
    type Err = UnitsError;

    fn from_str(text: &str) -> Result<Self, UnitsError> {
        match text.replace(' ', "").as_str() {
            "m,N" => Ok(Self::MetreNewton),
            "mm,N" => Ok(Self::MillimetreNewton),
            _ => Err(UnitsError(text.to_owned())),
        }
    }
}

/// Why a file was not read. One line.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is not there, or may not be read.
    #[error("{}: {source}", path.display())]
    Missing {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is there and is not what it should be.
    #[error("{}{}: {reason}", path.display(), line.map_or(String::new(), |l| format!(":{l}")))]
    Bad {
        /// Which file.
        path: PathBuf,
        /// Where in it, counted from 1; in binary parts: none.
        line: Option<u32>,
        /// What is wrong and what would help.
        reason: String,
    },
}

impl ReadError {
    /// Whether the file was absent or unreadable, rather than damaged.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }
}

/// What is wrong and in which line; the file's name is added at the door.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) line: Option<u32>,
    pub(crate) reason: String,
}

impl Fault {
    pub(crate) fn at(line: u32, reason: impl Into<String>) -> Self {
        Self { line: Some(line), reason: reason.into() }
    }

    pub(crate) fn whole(reason: impl Into<String>) -> Self {
        Self { line: None, reason: reason.into() }
    }

    /// All faults as one, at the line of the first; none: nothing is wrong.
    pub(crate) fn all(faults: Vec<Self>) -> Result<(), Self> {
        let count = faults.len();
        let mut faults = faults.into_iter();
        let Some(mut all) = faults.next() else { return Ok(()) };
        for fault in faults.take(NAMED - 1) {
            let line = fault.line.map_or(String::new(), |l| format!("line {l}: "));
            all.reason += &format!("; {line}{}", fault.reason);
        }
        if count > NAMED {
            all.reason += &format!("; and {} more", count - NAMED);
        }
        Err(all)
    }

    pub(crate) fn of(self, path: &Path) -> ReadError {
        ReadError::Bad { path: path.to_owned(), line: self.line, reason: self.reason }
    }
}

/// A whole file, its size limited.
///
/// # Errors
/// It is missing, or larger than [`MAX_BYTES`].
pub fn bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    access::read(path, MAX_BYTES).map_err(|denied| match denied {
        Denied::System(source) => ReadError::Missing { path: path.to_owned(), source },
        Denied::TooLong(limit) => {
            Fault::whole(format!("larger than {} MiB; split the model", limit >> 20)).of(path)
        }
        why => Fault::whole(why.to_string()).of(path),
    })
}

/// A word of the file for a message: short, without control characters.
pub(crate) fn quote(word: &str) -> String {
    let clean: String =
        word.chars().take(40).map(|c| if c.is_control() { '?' } else { c }).collect();
    if word.chars().nth(40).is_some() { format!("\"{clean}…\"") } else { format!("\"{clean}\"") }
}

/// A finite number; Fortran's exponent `D` is understood.
pub(crate) fn number(word: &str) -> Result<f64, String> {
    let parsed = word.parse().or_else(|e| {
        if word.contains(['d', 'D']) { word.replace(['d', 'D'], "e").parse() } else { Err(e) }
    });
    match parsed {
        Ok(n) if f64::is_finite(n) => Ok(n),
        Ok(_) => Err(format!("{} is not a finite number", quote(word))),
        Err(_) if word.is_empty() => Err("a number is missing".into()),
        Err(_) => Err(format!("{} is not a number", quote(word))),
    }
}

/// A label: a whole number from 1 to 4 294 967 294.
pub(crate) fn label(word: &str) -> Result<u32, String> {
    match word.parse::<u32>() {
        Ok(n) if n > 0 && n < u32::MAX => Ok(n),
        _ if word.is_empty() => Err("a number is missing".into()),
        _ => Err(format!("{} is not a number of a node or element (1 to 4294967294)", quote(word))),
    }
}

/// Numbers of the file to positions in the mesh.
#[derive(Debug)]
pub(crate) struct LabelMap<T>(Vec<(u32, T)>);

impl<T> Default for LabelMap<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy> LabelMap<T> {
    /// Sorts the labels; two of the same: the label.
    pub(crate) fn new(mut pairs: Vec<(u32, T)>) -> Result<Self, u32> {
        if !pairs.is_sorted_by_key(|p| p.0) {
            pairs.sort_by_key(|p| p.0);
        }
        match pairs.windows(2).find(|w| w[0].0 == w[1].0) {
            Some(w) => Err(w[0].0),
            None => Ok(Self(pairs)),
        }
    }

    pub(crate) fn get(&self, label: u32) -> Option<T> {
        // Mostly labels run without gaps, and the place is known.
        let guess = label.checked_sub(self.0.first()?.0)? as usize;
        if let Some(&(found, value)) = self.0.get(guess)
            && found == label
        {
            return Some(value);
        }
        self.0.binary_search_by_key(&label, |p| p.0).ok().map(|i| self.0[i].1)
    }

    /// Existing labels in a range, ascending.
    pub(crate) fn range(&self, from: u32, to: u32) -> &[(u32, T)] {
        let start = self.0.partition_point(|p| p.0 < from);
        let end = self.0.partition_point(|p| p.0 <= to).max(start);
        &self.0[start..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_named() {
        assert_eq!("m,N".parse(), Ok(Units::MetreNewton));
        assert_eq!("mm, N".parse(), Ok(Units::MillimetreNewton));
        assert!("in,lbf".parse::<Units>().unwrap_err().to_string().contains("m,N"));
        // 7850 kg/m³ is 7.85e-9 t/mm³; 9810 mm/s² is 9.81 m/s²; force = density · volume ·
        // acceleration stays newton.
        let mm = Units::MillimetreNewton;
        assert!((7.85e-9 * mm.density() - 7850.0).abs() < 1e-9);
        assert!((mm.density() * mm.length().powi(3) * mm.length() - 1.0).abs() < 1e-12);
        assert!((mm.stress() * mm.area() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn numbers_are_finite_and_labels_positive() {
        assert_eq!(number("1.5D+03"), Ok(1500.0));
        assert_eq!(number("-2.e-3"), Ok(-0.002));
        for bad in ["nan", "inf", "1e999", "", "1,2", "0x1"] {
            assert!(number(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-3", "4294967295", "1.0", "99999999999999999999"] {
            assert!(label(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn labels_are_found_with_and_without_gaps() {
        let map = LabelMap::new(vec![(7, 'c'), (5, 'a'), (6, 'b'), (90, 'd')]).unwrap();
        assert_eq!(
            [map.get(5), map.get(7), map.get(90), map.get(8), map.get(1)],
            [Some('a'), Some('c'), Some('d'), None, None]
        );
        assert_eq!(map.range(6, 80).len(), 2);
        assert_eq!(map.range(80, 6).len(), 0);
        assert_eq!(LabelMap::new(vec![(1, ()), (2, ()), (1, ())]).unwrap_err(), 1);
    }
}
