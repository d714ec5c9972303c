//! What was found again: readings of one defect at several inspections.

use std::mem::discriminant;

use intrados_scene::structure::{Date, Observation, Shows, Spot};

/// Places that are no farther apart than this are one place to somebody with a tape, m (ours).
const SAME_PLACE_M: f64 = 0.2;
/// Sides that are nearer than this are one face, degrees.
const SAME_FACE_DEG: f32 = 45.0;

/// Observations that show one defect, from the earliest to the latest, by their numbers in the
/// list; in the order of the first of each. Of one kind, on one face and in one place, at different
/// dates. One without a date is as of the day of the prediction, and so the latest.
#[must_use]
pub fn found_again(observations: &[&Observation], length_m: f64) -> Vec<Vec<usize>> {
    let mut by_date: Vec<usize> = (0..observations.len()).collect();
    by_date.sort_by_key(|&k| when(observations[k]));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in by_date {
        let later = observations[k];
        let apart = |group: &Vec<usize>| {
            let earlier = observations[*group.last()?];
            let is_later = when(earlier) < when(later);
            apart(earlier, later, length_m).filter(|_| is_later)
        };
        let near = groups.iter_mut().filter_map(|group| Some((apart(group)?, group)));
        match near.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, group)) => group.push(k),
            None => groups.push(vec![k]),
        }
    }
    groups.sort_by_key(|group| group.iter().copied().min());
    groups
}

/// Whether somebody has found the same again later, by number in the list.
pub(crate) fn is_superseded(observations: &[&Observation], length_m: f64) -> Vec<bool> {
    let mut superseded = vec![false; observations.len()];
    for group in found_again(observations, length_m) {
        let earlier = group.split_last().map_or(&[][..], |(_, earlier)| earlier);
        earlier.iter().for_each(|&k| superseded[k] = true);
    }
    superseded
}

/// What has no date comes last.
fn when(o: &Observation) -> (bool, Option<Date>) {
    (o.date.is_none(), o.date)
}

/// How far apart the middles of what may be one defect are, m; none where they are two.
fn apart(a: &Observation, b: &Observation, length_m: f64) -> Option<f64> {
    let is_one = is_one_kind(&a.shows, &b.shows) && is_one_face(&a.spot, &b.spot);
    let gap = length_m
        * f64::from((a.spot.along[0] - b.spot.along[1]).max(b.spot.along[0] - a.spot.along[1]));
    let is_near = a.spot.is_placed() && b.spot.is_placed() && gap <= SAME_PLACE_M;
    let middle = |o: &Observation| 0.5 * f64::from(o.spot.along[0] + o.spot.along[1]);
    (is_one && is_near).then(|| length_m * (middle(a) - middle(b)).abs())
}

fn is_one_kind(a: &Shows, b: &Shows) -> bool {
    match (a, b) {
        (Shows::Crack { course: a, .. }, Shows::Crack { course: b, .. }) => a == b,
        (
            Shows::Spall { .. }
            | Shows::Sounding { .. }
            | Shows::Rust { .. }
            | Shows::Efflorescence { .. }
            | Shows::WetSpot { .. },
            _,
        ) => discriminant(a) == discriminant(b),
        _ => false,
    }
}

fn is_one_face(a: &Spot, b: &Spot) -> bool {
    let is_one_height = match (a.height_m, b.height_m) {
        (Some(a), Some(b)) => f64::from((a - b).abs()) <= SAME_PLACE_M,
        _ => true,
    };
    let is_one_side = match (a.angle_deg, b.angle_deg) {
        (Some(a), Some(b)) => {
            let apart = (a - b).rem_euclid(360.0);
            apart.min(360.0 - apart) < SAME_FACE_DEG
        }
        (a, b) => a == b,
    };
    is_one_height && is_one_side
}

#[cfg(test)]
mod tests {
    use intrados_scene::structure::Course;

    use super::*;

    fn crack(date: Option<&str>, along: [f32; 2], angle_deg: f32, width_mm: f64) -> Observation {
        Observation {
            member: "B".into(),
            name: String::new(),
            date: date.map(|d| d.parse().unwrap()),
            spot: Spot { along, angle_deg: Some(angle_deg), height_m: None },
            instrument: None,
            picture: None,
            shows: Shows::Crack {
                width_mm,
                std_error_mm: 0.05,
                course: Course::Across,
                length_m: None,
            },
        }
    }

    #[test]
    fn one_crack_of_three_inspections_is_one() {
        let all = [
            crack(Some("2026-05-01"), [0.41, 0.41], 0.0, 0.6),
            crack(Some("2016-05-01"), [0.4, 0.4], 0.0, 0.2),
            crack(Some("2021-05-01"), [0.4, 0.4], 350.0, 0.35),
            // Of the same day, on another face, and farther away.
            crack(Some("2026-05-01"), [0.43, 0.43], 0.0, 0.3),
            crack(Some("2026-05-01"), [0.4, 0.4], 90.0, 0.3),
            crack(Some("2026-05-01"), [0.5, 0.5], 0.0, 0.3),
            // Nobody said where.
            crack(Some("2011-05-01"), [0.0, 1.0], 0.0, 0.3),
        ];
        let list: Vec<&Observation> = all.iter().collect();
        let groups = found_again(&list, 6.0);
        assert_eq!(groups, [vec![1, 2, 0], vec![3], vec![4], vec![5], vec![6]]);
        let old = is_superseded(&list, 6.0);
        assert_eq!(old, [false, true, true, false, false, false, false]);
    }

    #[test]
    fn what_has_no_date_is_the_latest() {
        let [undated, old] =
            [crack(None, [0.4, 0.4], 0.0, 0.3), crack(Some("2021-05-01"), [0.4, 0.4], 0.0, 0.5)];
        assert_eq!(found_again(&[&undated, &old], 6.0), [[1, 0]]);
        // Two without a date are of one day.
        assert_eq!(found_again(&[&undated, &undated], 6.0), [[0], [1]]);
    }
}
