//! What was found again: readings of one defect at several inspections.

use std::collections::{BTreeMap, BTreeSet};

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
    let mut earlier = PlaceIndex::default();
    for one_date in by_date.chunk_by(|&a, &b| when(observations[a]) == when(observations[b])) {
        let mut touched = Vec::with_capacity(one_date.len());
        for &k in one_date {
            let later = observations[k];
            let apart =
                |group: usize| apart(observations[*groups.get(group)?.last()?], later, length_m);
            match earlier.take_nearest(later, length_m, apart) {
                Some(group) => {
                    groups[group].push(k);
                    touched.push(group);
                }
                None => {
                    touched.push(groups.len());
                    groups.push(vec![k]);
                }
            }
        }
        // What was found on one date is found again on a later one, not on the same.
        for group in touched {
            if let Some(&last) = groups[group].last() {
                earlier.insert(observations[last], group);
            }
        }
    }
    groups.sort_by_key(|group| group.iter().copied().min());
    groups
}

/// Groups by the kind, side and middle of the last observation of each, so that the nearest is
/// found without asking all.
#[derive(Default)]
struct PlaceIndex {
    places: BTreeMap<(u8, Option<u8>), BTreeSet<(u32, usize)>>,
    /// The longest half of an observation's reach along the axis, 0 to 1.
    half: f32,
}

/// Sectors of sides: what is one face lies in the same or the next.
const SECTORS: u8 = (360.0 / SAME_FACE_DEG) as u8;

impl PlaceIndex {
    fn insert(&mut self, o: &Observation, group: usize) {
        let Some(kind) = kind_number(&o.shows).filter(|_| o.spot.is_placed()) else { return };
        self.half = self.half.max(0.5 * (o.spot.along[1] - o.spot.along[0]).abs());
        let place = (bits(middle(o)), group);
        self.places.entry((kind, sector(&o.spot))).or_default().insert(place);
    }

    /// The group that an observation continues, taken out of the index; the first of equally near
    /// ones.
    fn take_nearest(
        &mut self,
        o: &Observation,
        length_m: f64,
        apart: impl Fn(usize) -> Option<f64>,
    ) -> Option<usize> {
        let kind = kind_number(&o.shows).filter(|_| o.spot.is_placed())?;
        let beside = |by: u8| sector(&o.spot).map(|s| (s + by) % SECTORS);
        let mut sectors = vec![sector(&o.spot), beside(1), beside(SECTORS - 1)];
        sectors.dedup();
        let own = 0.5 * (o.spot.along[1] - o.spot.along[0]).abs();
        let reach = self.half + own + (SAME_PLACE_M / length_m.max(1e-9)) as f32 + 1e-6;
        let [low, high] = [-reach, reach].map(|by| bits((middle(o) + by).clamp(-1.0, 3.0)));
        let mut nearest: Option<(f64, usize, (u8, Option<u8>), u32)> = None;
        for sector in sectors {
            let key = (kind, sector);
            let Some(places) = self.places.get(&key) else { continue };
            let middle = bits(middle(o));
            let fits = |&(at, group): &(u32, usize)| Some((apart(group)?, group, key, at));
            let up = places.range((middle, 0)..=(high, usize::MAX)).find_map(fits);
            let down = places.range((low, 0)..(middle, 0)).rev().find_map(fits);
            for found in [up, down].into_iter().flatten() {
                let is_nearer = |known: &(f64, usize, _, _)| {
                    found.0.total_cmp(&known.0).then(found.1.cmp(&known.1)).is_lt()
                };
                if nearest.as_ref().is_none_or(is_nearer) {
                    nearest = Some(found);
                }
            }
        }
        let (_, group, key, at) = nearest?;
        self.places.get_mut(&key)?.remove(&(at, group));
        Some(group)
    }
}

fn middle(o: &Observation) -> f32 {
    0.5 * (o.spot.along[0] + o.spot.along[1])
}

/// Numbers that are ordered as places on the axis (0 to 1, with room on either side) are.
fn bits(along: f32) -> u32 {
    (along + 2.0).to_bits()
}

fn sector(spot: &Spot) -> Option<u8> {
    let deg = spot.angle_deg?.rem_euclid(360.0);
    Some((deg / SAME_FACE_DEG) as u8 % SECTORS)
}

/// What may be found again, by kind; none of what an instrument reads.
fn kind_number(shows: &Shows) -> Option<u8> {
    match shows {
        Shows::Crack { course, .. } => Some(*course as u8),
        Shows::Spall { .. } => Some(10),
        Shows::Sounding { .. } => Some(11),
        Shows::Rust { .. } => Some(12),
        Shows::Efflorescence { .. } => Some(13),
        Shows::WetSpot { .. } => Some(14),
        _ => None,
    }
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
    let is_one_kind = kind_number(&a.shows).is_some_and(|k| Some(k) == kind_number(&b.shows));
    let is_one = is_one_kind && is_one_face(&a.spot, &b.spot);
    let gap = length_m
        * f64::from((a.spot.along[0] - b.spot.along[1]).max(b.spot.along[0] - a.spot.along[1]));
    let is_near = a.spot.is_placed() && b.spot.is_placed() && gap <= SAME_PLACE_M;
    let apart = f64::from(middle(a)) - f64::from(middle(b));
    (is_one && is_near).then(|| length_m * apart.abs())
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

    /// The pairing of a few hundred is that of asking all of them, and a hundred thousand take no
    /// longer than their sorting.
    #[test]
    fn the_nearest_is_found_without_asking_all() {
        let key = intrados_stage::random::Key::new(5, 0);
        let days = ["2016-05-03", "2018-05-03", "2021-05-03"];
        let many: Vec<Observation> = (0..300_u32)
            .map(|k| {
                let at = 0.2 + 0.6 * key.unit64(4 * k) as f32;
                let wide = 0.02 * key.unit64(4 * k + 1) as f32;
                let side = (360.0 * key.unit64(4 * k + 2)) as f32;
                crack(Some(days[k as usize % 3]), [at, at + wide], side, 0.3)
            })
            .collect();
        let list: Vec<&Observation> = many.iter().collect();
        assert_eq!(found_again(&list, 6.0), asking_all(&list, 6.0));
        let one_place: Vec<Observation> = (0..100_000)
            .map(|k| crack(Some(days[k % 2]), [0.5; 2], if k % 4 < 2 { 0.0 } else { 90.0 }, 0.3))
            .collect();
        let list: Vec<&Observation> = one_place.iter().collect();
        assert_eq!(found_again(&list, 6.0).len(), 50_000);
    }

    /// As it is defined: each in turn joins the nearest group that ends earlier.
    fn asking_all(observations: &[&Observation], length_m: f64) -> Vec<Vec<usize>> {
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

    #[test]
    fn what_has_no_date_is_the_latest() {
        let [undated, old] =
            [crack(None, [0.4, 0.4], 0.0, 0.3), crack(Some("2021-05-01"), [0.4, 0.4], 0.0, 0.5)];
        assert_eq!(found_again(&[&undated, &old], 6.0), [[1, 0]]);
        // Two without a date are of one day.
        assert_eq!(found_again(&[&undated, &undated], 6.0), [[0], [1]]);
    }
}
