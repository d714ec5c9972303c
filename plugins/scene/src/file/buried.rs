//! Bars of which nothing is left but what would lie in the cover of an end face.

use crate::structure::{Bars, Reinforcement};

/// Thousandths of an axis that are none.
const HAIR: f32 = 1e-3;

/// Where among the bars along an axis of this length (m) that is so, and what to write instead:
/// of a set, or of what a lap leaves of it.
pub(super) fn buried(r: &Reinforcement, length_m: f32) -> Vec<[String; 2]> {
    // As they are laid.
    let cover = (0.001 * r.cover_mm).min(0.4 * length_m) / length_m;
    let faces = Faces { cover, cover_mm: r.cover_mm };
    r.bars.iter().enumerate().flat_map(|(i, bars)| faces.of(bars, i, length_m)).collect()
}

/// What keeps bars away from both ends.
struct Faces {
    /// Share of the axis.
    cover: f32,
    cover_mm: f32,
}

impl Faces {
    fn of(&self, bars: &Bars, number: usize, length_m: f32) -> Vec<[String; 2]> {
        let [from, to] = bars.span();
        let ends = ["the bars end", "nothing is left of them: let them end"];
        let begins = ["the bars begin", "nothing is left of them: let them begin"];
        let own = [("to", self.before(to, ends)), ("from", self.behind(from, begins))];
        let mut found: Vec<(String, String)> =
            own.into_iter().filter_map(|(at, why)| Some((at.to_owned(), why?))).collect();
        let ends = ["the lap ends", "nothing is left of the bars before it: let it end"];
        let begins = ["the lap begins", "nothing is left of the bars behind it: let it begin"];
        for (k, lap) in bars.laps().iter().enumerate() {
            let [start, end] = lap.span(length_m);
            let whys = self.before(end, ends).into_iter().chain(self.behind(start, begins));
            found.extend(whys.map(|why| (format!("laps[{k}].at"), why)));
        }
        found.into_iter().map(|(at, why)| [format!("bars[{number}].{at}"), why]).collect()
    }

    /// What ends in the cover of the first face.
    fn before(&self, end: f32, [what, rest]: [&str; 2]) -> Option<String> {
        let (cover, least) = (self.cover_mm, (1000.0 * self.cover - HAIR).ceil() / 1000.0);
        (end <= self.cover).then(|| {
            format!(
                "{what} at {end:.3} of the axis, within {cover} mm of cover, and {rest} beyond {least:.3}"
            )
        })
    }

    /// What begins in the cover of the last face.
    fn behind(&self, begin: f32, [what, rest]: [&str; 2]) -> Option<String> {
        let most = (1000.0 * (1.0 - self.cover) + HAIR).floor() / 1000.0;
        let cover = self.cover_mm;
        (begin >= 1.0 - self.cover).then(|| {
            format!(
                "{what} at {begin:.3} of the axis, within {cover} mm of cover, and {rest} before {most:.3}"
            )
        })
    }
}
