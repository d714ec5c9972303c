//! When a structure is looked at: now, or as many years on as its lives were computed. Nothing
//! between is shown, since nobody has computed it.

use intrados_damage::{verdict::Basis, zone::ZONES};
use intrados_predict::MemberPrediction;
use intrados_scene::Scene;

use crate::Latest;

/// What is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Damage as it is known.
    #[default]
    Now,
    /// Damage at the end of the forecast: what is known now, or what is foretold where that is more.
    Ahead,
    /// What those years add, by the forecast alone.
    Added,
}

/// Damage of a member by its zones, and where that is foretold alone.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Seen {
    pub(crate) zones: [Option<f64>; ZONES],
    pub(crate) foretold: [bool; ZONES],
}

impl Seen {
    /// The most of it.
    pub(crate) fn most(&self) -> Option<f64> {
        self.zones.iter().flatten().copied().reduce(f64::max)
    }
}

/// What a member's life foretells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course {
    /// From now to `later`.
    pub(crate) years: f64,
    pub(crate) now: [f64; ZONES],
    pub(crate) later: [f64; ZONES],
}

impl Course {
    /// None: no life was computed, or it ends before.
    pub(crate) fn of(told: &MemberPrediction) -> Option<Self> {
        let details = &told.evidence.get("forecast")?.details;
        let damage = |when: &str| {
            let zones = details.get(when)?.as_array()?;
            let mut damage = [0.0; ZONES];
            for (zone, place) in zones.iter().zip(&mut damage) {
                *place = zone["damage"].as_f64()?;
            }
            (zones.len() == ZONES).then_some(damage)
        };
        let years = details.get("ahead_years")?.as_f64()?;
        Some(Self { years, now: damage("now")?, later: damage("later")? })
    }

    /// The zone where most is added, as people call it, and the damage there now and later.
    pub(crate) fn worst(&self) -> (String, f64, f64) {
        let added = |zone: &usize| self.later[*zone] - self.now[*zone];
        let worst = (0..ZONES).max_by(|a, b| added(a).total_cmp(&added(b))).unwrap_or_default();
        (place(worst), self.now[worst], self.later[worst])
    }
}

/// Where a zone is on its axis.
pub(crate) fn place(zone: usize) -> String {
    tr!("{} to {} %", 100 * zone / ZONES, 100 * (zone + 1) / ZONES)
}

/// For how many years lives were computed; none: of no member.
pub(crate) fn years(scene: &Scene, latest: &Latest) -> Option<f64> {
    let result = latest.result_for(scene)?;
    result.members.iter().find_map(|told| Some(Course::of(told)?.years))
}

impl Moment {
    /// What is shown of every member.
    pub(crate) fn seen(self, scene: &Scene, latest: &Latest) -> Vec<Seen> {
        let result = latest.result_for(scene);
        let one = |index: usize| {
            let now = latest.member(index).map_or(Seen::default(), |p| Seen {
                zones: p.zones.0.map(|r| r.map(|r| r.value)),
                foretold: p.basis.map(|b| b == Basis::Forecast),
            });
            let told = result.and_then(|r| r.members.get(index));
            self.of(now, told.and_then(Course::of).as_ref())
        };
        (0..scene.members.len()).map(one).collect()
    }

    fn of(self, now: Seen, course: Option<&Course>) -> Seen {
        match (self, course) {
            (Self::Now, _) => now,
            // What the years do to it is unknown, however well it is known now.
            (_, None) => Seen::default(),
            (Self::Ahead, Some(course)) => {
                let mut seen = now;
                for (zone, later) in course.later.iter().enumerate() {
                    let is_more = seen.zones[zone].is_none_or(|now| *later > now);
                    if is_more {
                        (seen.zones[zone], seen.foretold[zone]) = (Some(*later), true);
                    }
                }
                seen
            }
            (Self::Added, Some(course)) => {
                let mut zones = [None; ZONES];
                for (zone, place) in zones.iter_mut().enumerate() {
                    *place = Some((course.later[zone] - course.now[zone]).max(0.0));
                }
                Seen { zones, foretold: [true; ZONES] }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn years_ahead_take_nothing_away_and_add_what_the_life_adds() {
        let (mut now, mut later) = ([0.1; ZONES], [0.2; ZONES]);
        (now[3], later[3]) = (0.05, 0.7);
        let course = Course { years: 20.0, now, later };
        let mut known = Seen { zones: [Some(0.4); ZONES], foretold: [false; ZONES] };
        known.zones[9] = None;
        assert_eq!(Moment::Now.of(known, Some(&course)), known);
        let ahead = Moment::Ahead.of(known, Some(&course));
        assert_eq!(ahead.zones[0], Some(0.4), "what is measured does not heal");
        assert_eq!((ahead.zones[3], ahead.zones[9]), (Some(0.7), Some(0.2)));
        let of: Vec<usize> = (0..ZONES).filter(|z| ahead.foretold[*z]).collect();
        assert_eq!(of, [3, 9]);
        let added = Moment::Added.of(known, Some(&course));
        assert!((added.zones[3].unwrap() - 0.65).abs() < 1e-12);
        assert_eq!(course.worst(), (place(3), 0.05, 0.7));
        // Of one without a life nothing is said.
        assert_eq!(Moment::Ahead.of(known, None), Seen::default());
    }
}
