//! What every file of a report says of a member in the same words.

use intrados_damage::{
    evidence::called,
    grading::{Profile, State},
};
use intrados_predict::{Defect, MemberPrediction};
use intrados_stage::Estimate;

use crate::basis;

/// Where there is nothing to say.
pub(crate) const NOTHING: &str = "–";

/// What is to be done about a member of which things were found that say nothing of its strength.
pub(crate) const UNTOLD: &str =
    "Look at it closely: what was found there does not tell what it has lost.";

/// Damage by a forecast, less than which is worth no line of its own.
const LITTLE: f64 = 0.02;

/// Whether a member is worth a line of its own: something was measured or found on it, its truth is
/// known, or the forecast expects damage.
pub(crate) fn matters(m: &MemberPrediction) -> bool {
    let is_measured = m.evidence.values().any(|e| e.measured);
    m.damage.is_some_and(|d| d >= LITTLE || is_measured || m.truth.is_some())
        || !m.defects.is_empty()
        || m.failure.is_some()
}

/// What is the matter with a member, in few words: the defects that were found, or what is lost by
/// the rest of its evidence.
pub(crate) fn finding(m: &MemberPrediction) -> String {
    let mut told: Vec<String> = m.defects.iter().take(3).map(defect).collect();
    if m.defects.len() > told.len() {
        told.push(format!("{} more", m.defects.len() - told.len()));
    }
    if let Some(end) = &m.failure {
        told.insert(0, end.sentence());
    }
    if told.is_empty() {
        // The cause that counts most, and who says so.
        let causes = m.causes.iter().filter_map(|(cause, zones)| Some((cause, zones.worst()?.1)));
        let most = causes.max_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let sources: Vec<&str> = m.evidence.keys().map(|source| word(source)).collect();
        let what = most.map_or("damage", |(cause, _)| cause.name());
        told.push(if m.to_inspect {
            format!("nothing found by {}", sources.join(", "))
        } else {
            format!("loss of {what}, by {}", sources.join(", "))
        });
    }
    told.join("; ")
}

/// A defect, its size and how much of it there is.
pub(crate) fn defect(d: &Defect) -> String {
    let size = if d.size.is_empty() { String::new() } else { format!(", {}", d.size) };
    let quantity = d.quantity().map_or_else(String::new, |q| format!(", {q}"));
    let change = d.change().map_or_else(String::new, |c| format!(" [{c}]"));
    format!("{}{size}{quantity}{change}", d.kind)
}

/// A text in which files stand without the folders that they lie in.
pub(crate) fn files(text: &str) -> String {
    let is_file = |name: &str| {
        name.rsplit_once('.').is_some_and(|(_, end)| {
            (2..=5).contains(&end.len()) && end.chars().all(|c| c.is_ascii_alphanumeric())
        })
    };
    let one = |word: &str| {
        let kept = word.trim_end_matches([',', ';', ':', ')']);
        match kept.rsplit_once(['/', '\\']) {
            Some((_, name)) if is_file(name) => format!("{name}{}", &word[kept.len()..]),
            // A folder whose name goes on after a blank.
            Some((folders, _)) if folders.contains('/') && kept.starts_with('/') => String::new(),
            _ => word.to_owned(),
        }
    };
    let words: Vec<String> = text.split(' ').map(one).filter(|word| !word.is_empty()).collect();
    words.join(" ")
}

/// So many of something, in the right number.
pub(crate) fn many(n: usize, one: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") }
}

/// A source of evidence, in an engineer's word.
pub(crate) fn word(source: &str) -> &str {
    called(source)
}

/// When something should be done about a member: from the day of the inspection on.
pub(crate) fn due(m: &MemberPrediction, basis: &basis::Basis) -> String {
    let within = within(m.within_months);
    match m.within_months.filter(|&months| months > 0) {
        None => within,
        Some(months) => match basis.until(months) {
            None => format!("within {within}"),
            Some(date) => {
                let until = date.to_string();
                format!("within {within}, by {}", until.get(..7).unwrap_or(&until))
            }
        },
    }
}

/// A time of months.
pub(crate) fn within(months: Option<u32>) -> String {
    match months {
        None => NOTHING.into(),
        Some(0) => "at once".into(),
        Some(n) => many(n as usize, "month"),
    }
}

/// A piece of the axis of a member that is so long, m.
pub(crate) fn metres([from, to]: [f64; 2], length_m: f64) -> String {
    if from == to {
        format!("{:.2}", length_m * from)
    } else {
        format!("{:.2} to {:.2}", length_m * from, length_m * to)
    }
}

/// The worse half of a profile's states.
pub(crate) fn worse_half(profile: &Profile) -> &[State] {
    &profile.states[profile.states.len() / 2..]
}

/// How likely it is that a member is in one of them.
pub(crate) fn bad_probability(m: &MemberPrediction, profile: &Profile) -> f64 {
    worse_half(profile).iter().filter_map(|s| m.state_probability.get(&s.name)).sum()
}

/// The step of four that a state's rank among so many is.
pub(crate) fn level(rank: usize, states: usize) -> usize {
    (3 * rank).div_ceil(states.saturating_sub(1).max(1)).min(3)
}

/// A value with its standard error.
pub(crate) fn plus_minus(r: Estimate) -> String {
    format!("{:.2} ± {:.2}", r.value, r.std_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_stand_without_their_folders() {
        assert_eq!(
            files("core 1, bridge/evidence/3kDa_core_1/a.tif … core 1, /tmp/x/b.mha, across x (8)"),
            "core 1, a.tif … core 1, b.mha, across x (8)"
        );
        let as_it_is = "pier / foundation of C30/37, 9.8e-11 m²/s, w/c 0.55";
        assert_eq!(files(as_it_is), as_it_is);
    }

    #[test]
    fn one_is_not_many() {
        assert_eq!([many(1, "member"), many(2, "member")], ["1 member", "2 members"]);
    }
}
