//! What of the known defects an instrument would see: a camera ([`photograph`]), a scanner
//! ([`radiograph`]).

pub mod photograph;
pub mod radiograph;

/// Contrast to noise from which a defect is seen (Rose 1948).
pub(crate) const SEEN_FROM: f64 = 5.0;
