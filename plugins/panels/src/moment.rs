//! When a structure is looked at: now, at an equilibrium of its lives so far, or at one of the years
//! that were forecast. Nothing between is shown, since nobody has computed it.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use intrados_damage::{
    verdict::Basis,
    zone::{self, ZONES},
};
use intrados_forecast::Passed;
use intrados_mechanics::plugin::ShownAt;
use intrados_predict::{MemberPrediction, Prediction};
use intrados_scene::{Scene, plugin::CurrentScene, structure::Date};
use intrados_stage::time::{DAY, YEAR};

use crate::{Latest, lang::term};

/// Moments that are closer, years, are one.
const SAME: f64 = 1.0 / 365.25;

/// What is shown.
#[derive(Resource, Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Moment {
    /// Years from now on; before it where that is negative.
    pub(crate) years: f64,
    /// Only what those years add, by the forecast alone.
    pub(crate) added: bool,
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

/// How a member's life goes on, by mechanics and rust.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    /// Its age now, years.
    age: f64,
    /// Equilibria in order of time: years from now, and the damage of its zones.
    passed: Vec<(f64, [f64; ZONES])>,
}

impl Course {
    /// None: no life was computed.
    pub(crate) fn of(told: &MemberPrediction) -> Option<Self> {
        let details = &told.evidence.get("forecast")?.details;
        let age = details.get("age_years")?.as_f64()?;
        let course = details.get("course")?.clone();
        let course: Vec<Passed> = serde_json::from_value(course).ok()?;
        let passed: Vec<_> = course.iter().map(|p| (p.years - age, p.damage)).collect();
        (!passed.is_empty()).then_some(Self { age, passed })
    }

    /// Damage at the last equilibrium until then; none: before the first, or after the last.
    pub(crate) fn at(&self, years: f64) -> Option<[f64; ZONES]> {
        let passed = self.passed.partition_point(|(when, _)| *when <= years + SAME);
        let is_over = years > self.end() + SAME;
        passed.checked_sub(1).filter(|_| !is_over).map(|last| self.passed[last].1)
    }

    /// Years from now to where it ends.
    pub(crate) fn end(&self) -> f64 {
        self.passed.last().map_or(0.0, |(years, _)| *years)
    }

    /// All of it: years from now, and damage.
    pub(crate) fn passed(&self) -> &[(f64, [f64; ZONES])] {
        &self.passed
    }

    /// The zone where most is added from now until then, as people call it, and its damage now and
    /// then.
    pub(crate) fn worst(&self, years: f64) -> Option<(String, f64, f64)> {
        let (now, then) = (self.at(0.0)?, self.at(years)?);
        let added = |zone: &usize| then[*zone] - now[*zone];
        let worst = (0..ZONES).max_by(|a, b| added(a).total_cmp(&added(b)))?;
        Some((place(worst), now[worst], then[worst]))
    }
}

/// Where a zone is on its axis.
pub(crate) fn place(zone: usize) -> String {
    term(&zone::place(zone))
}

/// All moments at which there is something to see, in years from now.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Timeline {
    /// Equilibria of any of the members, in order.
    pub(crate) computed: Vec<f64>,
    /// When parts were poured.
    pub(crate) pours: Vec<f64>,
    /// When something was seen or read.
    pub(crate) looks: Vec<f64>,
    /// The day that counts as now, if anybody says.
    pub(crate) today: Option<Date>,
}

impl Timeline {
    fn of(scene: &Scene, courses: &[Option<Course>]) -> Self {
        let all = courses.iter().flatten();
        let computed = all.clone().flat_map(|c| &c.passed).map(|(years, _)| *years);
        let of_assembly = |member: &str| scene.structure.assembly_of(member);
        let pours = scene.members.iter().zip(courses).flat_map(|(member, course)| {
            let (age, of) = (course.as_ref().map(|c| c.age), of_assembly(&member.id));
            let pours = of.into_iter().flat_map(|a| &a.pours);
            pours.filter_map(move |pour| Some(f64::from(pour.at_days) * DAY / YEAR - age?))
        });
        let today = scene.structure.today();
        let ago = |date: &Date| Some(-(date.days_until(today?) as f64) * DAY / YEAR);
        let looks = scene.structure.dates().iter().filter_map(ago).collect();
        Self { computed: in_order(computed), pours: in_order(pours), looks, today }
    }

    /// From the first equilibrium to the last.
    pub(crate) fn range(&self) -> Option<[f64; 2]> {
        let (first, last) = (self.computed.first()?, self.computed.last()?);
        (last - first > SAME).then_some([*first, *last])
    }

    /// The equilibrium that is nearest; coming from another one and moving off it, at least the
    /// next in that direction.
    pub(crate) fn nearest(&self, years: f64, from: f64) -> f64 {
        let near = |a: &&f64, b: &&f64| (*a - years).abs().total_cmp(&(*b - years).abs());
        let nearest = self.computed.iter().min_by(near).copied().unwrap_or(0.0);
        if (nearest - from).abs() > SAME || (years - from).abs() < 1e-9 {
            return nearest;
        }
        self.beyond(from, years > from).unwrap_or(nearest)
    }

    /// The next equilibrium after a moment, or the one before it.
    pub(crate) fn beyond(&self, years: f64, forward: bool) -> Option<f64> {
        match forward {
            true => self.computed.iter().find(|c| **c > years + SAME).copied(),
            false => self.computed.iter().rfind(|c| **c < years - SAME).copied(),
        }
    }
}

fn in_order(years: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut years: Vec<f64> = years.collect();
    years.sort_by(f64::total_cmp);
    years.dedup_by(|b, a| *b - *a < SAME);
    years
}

/// The lives of the members of the newest prediction.
#[derive(Resource, Default)]
pub(crate) struct Courses {
    of: Option<Arc<Prediction>>,
    courses: Vec<Option<Course>>,
    pub(crate) timeline: Timeline,
}

impl Courses {
    /// That of a member.
    pub(crate) fn get(&self, member: usize) -> Option<&Course> {
        self.courses.get(member)?.as_ref()
    }

    /// Reads them anew once the prediction is another one.
    fn follow(&mut self, scene: &Scene, latest: &Latest) {
        let result = latest.result_for(scene);
        if self.of.as_ref().map(Arc::as_ptr) == result.map(Arc::as_ptr) {
            return;
        }
        let members = result.iter().flat_map(|r| &r.members);
        self.courses = members.map(Course::of).collect();
        self.timeline = Timeline::of(scene, &self.courses);
        self.of = result.cloned();
    }

    /// The moment in a member's life that is now, s.
    fn age(&self) -> Option<f64> {
        self.courses.iter().flatten().map(|c| c.age * YEAR).next()
    }
}

/// Keeps the lives and the moment in step with the prediction, and shows the surfaces of members as
/// they are then.
pub(crate) fn follow(
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    mut courses: ResMut<Courses>,
    mut moment: ResMut<Moment>,
    mut at: ResMut<ShownAt>,
) {
    let Some(scene) = scene else { return };
    courses.bypass_change_detection().follow(&scene.0, &latest);
    if courses.timeline.range().is_none() {
        moment.set_if_neq(Moment::default());
    }
    let then = courses.age().map(|age| age + moment.years * YEAR).filter(|_| !moment.is_now());
    at.set_if_neq(ShownAt(then));
}

impl Moment {
    pub(crate) fn is_now(self) -> bool {
        self.years.abs() < SAME
    }

    /// What is shown of every member.
    pub(crate) fn seen(self, scene: &Scene, latest: &Latest, courses: &Courses) -> Vec<Seen> {
        let one = |index: usize| {
            let now = latest.member(index).map_or(Seen::default(), |p| Seen {
                zones: p.zones.0.map(|r| r.map(|r| r.value)),
                foretold: p.basis.map(|b| b == Basis::Forecast),
            });
            self.of(now, courses.get(index))
        };
        (0..scene.members.len()).map(one).collect()
    }

    fn of(self, now: Seen, course: Option<&Course>) -> Seen {
        if self.is_now() {
            return now;
        }
        // What other years do to it is unknown, however well it is known now.
        let Some(course) = course else { return Seen::default() };
        let Some(then) = course.at(self.years) else { return Seen::default() };
        let foretold = Seen { zones: then.map(Some), foretold: [true; ZONES] };
        match (self.added, self.years > 0.0) {
            (true, true) => {
                let Some(begin) = course.at(0.0) else { return Seen::default() };
                let added = std::array::from_fn(|z| Some((then[z] - begin[z]).max(0.0)));
                Seen { zones: added, ..foretold }
            }
            // What was measured since says nothing of the years before.
            (_, false) => foretold,
            // What is measured does not heal.
            (false, true) => {
                let mut seen = now;
                for (zone, then) in then.iter().enumerate() {
                    if seen.zones[zone].is_none_or(|now| *then > now) {
                        (seen.zones[zone], seen.foretold[zone]) = (Some(*then), true);
                    }
                }
                seen
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course() -> Course {
        let (mut now, mut later) = ([0.1; ZONES], [0.2; ZONES]);
        (now[3], later[3]) = (0.05, 0.7);
        Course { age: 30.0, passed: vec![(-10.0, [0.01; ZONES]), (0.0, now), (20.0, later)] }
    }

    #[test]
    fn years_ahead_take_nothing_away_and_add_what_the_life_adds() {
        let course = course();
        let mut known = Seen { zones: [Some(0.4); ZONES], foretold: [false; ZONES] };
        known.zones[9] = None;
        let at = |years, added| Moment { years, added }.of(known, Some(&course));
        assert_eq!(at(0.0, false), known);
        let ahead = at(20.0, false);
        assert_eq!(ahead.zones[0], Some(0.4), "what is measured does not heal");
        assert_eq!((ahead.zones[3], ahead.zones[9]), (Some(0.7), Some(0.2)));
        let of: Vec<usize> = (0..ZONES).filter(|z| ahead.foretold[*z]).collect();
        assert_eq!(of, [3, 9]);
        assert!((at(20.0, true).zones[3].unwrap() - 0.65).abs() < 1e-12);
        assert_eq!(course.worst(20.0), Some((place(3), 0.05, 0.7)));
        // Of one without a life nothing is said.
        let ahead = Moment { years: 20.0, added: false };
        assert_eq!(ahead.of(known, None), Seen::default());
    }

    #[test]
    fn years_before_are_told_by_the_life_alone_and_end_where_it_ends() {
        let course = course();
        let known = Seen { zones: [Some(0.4); ZONES], foretold: [false; ZONES] };
        let at = |years| Moment { years, added: false }.of(known, Some(&course));
        assert_eq!(at(-10.0), Seen { zones: [Some(0.01); ZONES], foretold: [true; ZONES] });
        assert_eq!(at(-4.0).zones[0], Some(0.01), "of the equilibrium before");
        assert_eq!(at(-11.0), Seen::default(), "before anything was computed");
        assert_eq!(at(21.0), Seen::default(), "after its end");
    }

    #[test]
    fn a_slider_finds_equilibria_and_leaves_them() {
        let timeline = Timeline { computed: vec![-10.0, -9.9, 0.0, 20.0], ..Timeline::default() };
        assert_eq!(timeline.range(), Some([-10.0, 20.0]));
        assert_eq!(timeline.nearest(7.0, 0.0), 20.0, "the next one, since it moves that way");
        assert_eq!(timeline.nearest(17.0, 0.0), 20.0);
        assert_eq!(timeline.nearest(-9.0, 20.0), -9.9);
        assert_eq!(timeline.nearest(0.1, 0.0), 20.0);
        assert_eq!(timeline.nearest(0.0, 0.0), 0.0);
        assert_eq!(timeline.beyond(0.0, false), Some(-9.9));
        assert_eq!(timeline.beyond(20.0, true), None);
    }
}
