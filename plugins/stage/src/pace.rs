use std::time::{Duration, Instant};

use bevy_ecs::resource::Resource;

/// How much progressive work a frame may do.
///
/// It decides *when* passes run and never what they compute: the results are the same bits at any
/// pace.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Exactly so many passes a frame (command line, tests).
    Passes(u32),
    /// Passes, or steps that are shorter, until the time is over, at least one (window).
    Within(Duration),
    /// Nothing: paused.
    Rest,
    /// Nothing, since nobody looks at frames: work off the frame may take the whole machine
    /// (command line).
    Unwatched,
}

impl Default for Pace {
    fn default() -> Self {
        Self::Passes(1)
    }
}

impl Pace {
    /// Calls `pass` as often as the pace allows, or until it returns `false` (finished). Returns
    /// how many passes ran.
    ///
    /// ```
    /// use intrados_stage::Pace;
    /// let mut left = 3;
    /// let ran = Pace::Passes(8).run(|| { left -= 1; left > 0 });
    /// assert_eq!((ran, left), (3, 0));
    /// ```
    pub fn run(self, mut pass: impl FnMut() -> bool) -> u32 {
        let begin = Instant::now();
        let mut ran = 0;
        let may_go_on = |ran: u32| match self {
            Self::Passes(n) => ran < n,
            Self::Within(slice) => ran == 0 || begin.elapsed() < slice,
            Self::Rest | Self::Unwatched => false,
        };
        while may_go_on(ran) {
            ran += 1;
            if !pass() {
                break;
            }
        }
        ran
    }
}
