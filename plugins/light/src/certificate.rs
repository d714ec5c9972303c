//! Whether an error bar may be trusted: what the scores say of themselves, and what only the other
//! side can say of them.
//!
//! Scores that converge tell nothing of light that no walk has met. So walks from one side alone
//! are never certified; of two sides both must be alive and agree, and what
//! [`intrados_transport::unmet`] says may be missing must not show.

use intrados_transport::{Side, Unmet};

use crate::Exposure;

/// The two sides may differ by so many standard errors.
const GAP: f64 = 3.0;
/// Light that may be missing does not show where it is less than this share of the reading, however
/// small the error bar is.
const SHOWS: f64 = 1e-3;
/// What is said of one side alone.
pub(crate) const ALONE: &str =
    "walked from one side alone: nothing vouches for what its walks have not met";

/// Why one side does not vouch for the other: their means, and the gap between them in standard
/// errors.
pub(crate) fn disagreement([primal, dual]: [f64; 2], gap: Option<f64>) -> Option<String> {
    let is_dead = |mean: f64| mean.is_nan() || mean <= 0.0;
    match gap {
        _ if is_dead(primal) => Some("walks from the sensor have found no light".into()),
        _ if is_dead(dual) => Some("no walk from the lamps has met the sensor".into()),
        Some(z) if z.abs() > GAP => {
            Some(format!("the two sides differ by {:.1} standard errors (limit {GAP})", z.abs()))
        }
        Some(_) => None,
        None => Some("one side has no error bar yet, so that the two cannot be compared".into()),
    }
}

/// What either side may lack at most, given mean and standard error of both.
pub(crate) fn bounds(unmet: &Unmet, [p, d]: [(f64, f64); 2]) -> [f64; 2] {
    let more = |mine: (f64, f64), other: (f64, f64)| (other.0 + 3.0 * other.1 - mine.0).max(0.0);
    [unmet.bound(Side::Primal, more(p, d)), unmet.bound(Side::Dual, more(d, p))]
}

/// Why light may be missing that would show.
pub(crate) fn missing(mean: f64, std_error: f64, unaccounted: Option<f64>) -> Option<String> {
    let Some(bound) = unaccounted else {
        return Some("it is not known where walks have been".into());
    };
    // Both with 95 % confidence.
    let shows = bound > (1.96 * std_error).max(SHOWS * mean);
    shows.then(|| {
        format!(
            "up to {:.2} % of the light has not been accounted for",
            100.0 * bound / (mean + bound)
        )
    })
}

/// What speaks, by its own scores, against the error bar of a picture's mean to which an exposure
/// contributes.
pub(crate) fn own_complaints(exposure: &Exposure, both: bool) -> Vec<String> {
    let mut complaints = Vec::new();
    // From one walk a pixel nothing is known of what it varies by.
    if exposure.side == Side::Primal
        && exposure.film.as_ref().is_some_and(|film| film.fewest_samples() < 2)
    {
        complaints.push("fewer than two samples in some pixels".to_owned());
    }
    if let Some(evidence) = exposure
        .scores
        .first()
        .map(intrados_transport::Scores::converged)
        .filter(|evidence| !evidence.holds())
    {
        let side = if both { format!("{}: ", side_name(exposure.side)) } else { String::new() };
        complaints.push(side + &evidence.complaint());
    }
    complaints
}

fn side_name(side: Side) -> &'static str {
    match side {
        Side::Primal => "primal",
        Side::Dual => "dual",
    }
}
