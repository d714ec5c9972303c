//! Where numbers stand beside marks on a drawing, so that none lies upon another.
//!
//! Marks are taken in their order, and each number goes where it costs least: as far as it stands
//! off its mark, as much as it hides of marks, and much more what it hides of numbers that stand
//! already. This is the greedy placement of cartography (Christensen, Marks and Shieber 1995), which
//! is good enough for some dozen marks and the same for any run.

/// A box on a drawing: left and top, right and bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

/// What a number stands beside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mark {
    Line([f64; 2], [f64; 2]),
    Box(Area),
}

/// A number that has its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Label {
    pub(super) area: Area,
    /// From the mark to the number, where it stands so far off that it needs one.
    pub(super) leader: Option<[[f64; 2]; 2]>,
}

/// Distances from the mark that are tried, pixels.
const DISTANCES: [f64; 9] = [3.0, 7.0, 12.0, 18.0, 26.0, 36.0, 50.0, 70.0, 100.0];
/// From this distance on a line leads to the number.
const LEADER: f64 = 6.0;
/// Directions that are tried at each; the first is to the right.
const DIRECTIONS: u32 = 24;
/// Costs of a square pixel of another number, of a line two pixels wide and of a pale area, and of a
/// pixel of distance.
const ON_NUMBER: f64 = 100.0;
const ON_LINE: f64 = 2.0;
const ON_AREA: f64 = 0.1;
const OFF: f64 = 1.5;
/// Left free between numbers, pixels: 1 and 2 are not 12.
const GAP: f64 = 4.0;

impl Area {
    fn overlap(&self, other: &Self) -> f64 {
        let side = |k: usize| self.high[k].min(other.high[k]) - self.low[k].max(other.low[k]);
        side(0).max(0.0) * side(1).max(0.0)
    }

    fn grown(&self, by: f64) -> Self {
        Self { low: self.low.map(|v| v - by), high: self.high.map(|v| v + by) }
    }

    /// Its point nearest to another.
    fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| p[k].clamp(self.low[k], self.high[k].max(self.low[k])))
    }

    fn centre(&self) -> [f64; 2] {
        [0, 1].map(|k| 0.5 * (self.low[k] + self.high[k]))
    }
}

impl Mark {
    fn around(&self) -> Area {
        match *self {
            Self::Line(a, b) => {
                Area { low: [0, 1].map(|k| a[k].min(b[k])), high: [0, 1].map(|k| a[k].max(b[k])) }
            }
            Self::Box(area) => area,
        }
    }

    /// What it costs that a number hides a part of it.
    fn hidden_by(&self, area: &Area) -> f64 {
        match *self {
            Self::Line(a, b) => ON_LINE * 2.0 * length_within(a, b, area),
            Self::Box(own) => ON_AREA * own.overlap(area),
        }
    }

    fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        let (a, b) = match *self {
            Self::Line(a, b) => (a, b),
            Self::Box(area) => return area.nearest(p),
        };
        let d = [b[0] - a[0], b[1] - a[1]];
        let square = (d[0] * d[0] + d[1] * d[1]).max(1e-9);
        let t = (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / square).clamp(0.0, 1.0);
        [a[0] + t * d[0], a[1] + t * d[1]]
    }
}

/// Length of the part of a segment in a box (Liang and Barsky 1984).
fn length_within(a: [f64; 2], b: [f64; 2], area: &Area) -> f64 {
    let d = [b[0] - a[0], b[1] - a[1]];
    let [mut from, mut to] = [0.0_f64, 1.0_f64];
    for k in 0..2 {
        if d[k].abs() < 1e-9 {
            if a[k] < area.low[k] || a[k] > area.high[k] {
                return 0.0;
            }
            continue;
        }
        let ends = [(area.low[k] - a[k]) / d[k], (area.high[k] - a[k]) / d[k]];
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    (to - from).max(0.0) * d[0].hypot(d[1])
}

/// Places a number of each size beside its mark, all of them `within`.
pub(super) fn place(marks: &[(Mark, [f64; 2])], within: &Area) -> Vec<Label> {
    let mut placed: Vec<Label> = Vec::with_capacity(marks.len());
    for (mark, size) in marks {
        let cost = |area: &Area| {
            let p = mark.nearest(area.centre());
            let q = area.nearest(p);
            let wide = area.grown(GAP);
            let on_numbers: f64 = placed.iter().map(|label| label.area.overlap(&wide)).sum();
            let on_marks: f64 = marks.iter().map(|(mark, _)| mark.hidden_by(area)).sum();
            ON_NUMBER * on_numbers + on_marks + OFF * (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let best = candidates(mark, *size, within)
            .map(|area| (area, cost(&area)))
            .reduce(|best, other| if other.1 < best.1 { other } else { best });
        let Some((area, _)) = best else { continue };
        let from = mark.nearest(area.centre());
        let to = area.nearest(from);
        let off = (from[0] - to[0]).hypot(from[1] - to[1]);
        placed.push(Label { area, leader: (off >= LEADER).then_some([from, to]) });
    }
    placed
}

/// Places around a mark, moved into the drawing.
fn candidates(mark: &Mark, size: [f64; 2], within: &Area) -> impl Iterator<Item = Area> {
    let (around, within) = (mark.around(), *within);
    let (centre, half) = (around.centre(), size.map(|s| 0.5 * s));
    let at = move |distance: f64, direction: u32| {
        let (sin, cos) =
            (std::f64::consts::TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        let way = [cos, sin];
        let middle = [0, 1].map(|k| {
            let reach = 0.5 * (around.high[k] - around.low[k]) + distance + half[k];
            let most = (within.high[k] - half[k]).max(within.low[k] + half[k]);
            // Beyond the mark's side or its corner, not on an ellipse that would cut it.
            let way = (std::f64::consts::SQRT_2 * way[k]).clamp(-1.0, 1.0);
            (centre[k] + reach * way).clamp(within.low[k] + half[k], most)
        });
        Area { low: [0, 1].map(|k| middle[k] - half[k]), high: [0, 1].map(|k| middle[k] + half[k]) }
    };
    DISTANCES.into_iter().flat_map(move |d| (0..DIRECTIONS).map(move |n| at(d, n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWING: Area = Area { low: [0.0, 0.0], high: [900.0, 200.0] };

    fn overlaps(placed: &[Label]) -> usize {
        let pairs = placed.iter().enumerate().flat_map(|(i, a)| {
            placed[i + 1..].iter().map(move |b| a.area.grown(GAP).overlap(&b.area))
        });
        pairs.filter(|overlap| *overlap > 0.0).count()
    }

    /// One mark's number stands to its right, close by and with no line.
    #[test]
    fn a_number_alone_stands_beside_its_mark() {
        let mark = Mark::Line([100.0, 90.0], [100.0, 110.0]);
        let [label] = place(&[(mark, [7.0, 9.0])], &DRAWING)[..] else { panic!() };
        assert_eq!(label.leader, None);
        assert_eq!(label.area.low, [103.0, 95.5]);
    }

    /// Twenty defects at one place: each has its number, none upon another nor outside, and what is
    /// far away has a line from its mark.
    #[test]
    fn numbers_of_one_place_do_not_overlap() {
        for at in [[450.0, 100.0], [0.0, 0.0], [899.0, 199.0]] {
            let mark = Mark::Line(at, [at[0] + 1.0, at[1] + 1.0]);
            let marks = vec![(mark, [14.0, 9.0]); 20];
            let placed = place(&marks, &DRAWING);
            assert_eq!((placed.len(), overlaps(&placed)), (20, 0));
            for label in &placed {
                let inside = (0..2).all(|k| {
                    label.area.low[k] >= DRAWING.low[k] && label.area.high[k] <= DRAWING.high[k]
                });
                assert!(inside, "{label:?}");
                let near = mark.nearest(label.area.centre());
                let to = label.area.nearest(near);
                let far = (near[0] - to[0]).hypot(near[1] - to[1]) >= LEADER;
                assert_eq!(label.leader.is_some(), far);
            }
            assert!(placed.iter().any(|label| label.leader.is_some()));
            assert_eq!(placed, place(&marks, &DRAWING), "the same for any run");
        }
    }

    /// Beside other marks there is room; a number leaves them to be seen.
    #[test]
    fn numbers_leave_marks_to_be_seen() {
        let line = |x: f64| (Mark::Line([x, 60.0], [x, 140.0]), [7.0, 9.0]);
        let marks: Vec<_> = (0..6).map(|k| line(400.0 + 8.0 * f64::from(k))).collect();
        let placed = place(&marks, &DRAWING);
        assert_eq!(overlaps(&placed), 0);
        for label in &placed {
            assert!(marks.iter().all(|(mark, _)| mark.hidden_by(&label.area) < 1e-9));
        }
    }
}
