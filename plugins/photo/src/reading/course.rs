//! Middle lines of what is long and thin.
//!
//! Of every connected piece the longest of all shortest ways, and then, again and again, the
//! longest that still branches off. Ways keep to the middle: a step costs the more the nearer it is
//! to the rim.

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, HashMap, HashSet},
};

use intrados_raster::Mask;

/// Shortest branch, pixels, and how many times the stem is half as wide where it leaves.
const SHORTEST: f64 = 10.0;
const BROAD: f64 = 3.0;
/// Most branches of a piece.
const MOST: usize = 64;
/// Points before and after that a line is smoothed by.
const SMOOTH: usize = 2;

/// A middle line, pixels from the top left of the picture, a pixel or so between points, and how
/// far the rim is.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Line {
    pub(super) points: Vec<[f64; 2]>,
    /// Pixels from the middle to the rim, by point.
    pub(super) half: Vec<f64>,
    /// Number of the piece that it belongs to.
    pub(super) piece: usize,
}

impl Line {
    /// Pixels from end to end, along the line.
    pub(super) fn length(&self) -> f64 {
        let step = |w: &[[f64; 2]]| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
        self.points.windows(2).map(step).sum()
    }
}

/// All middle lines of a mask, piece by piece, stems before branches.
pub(super) fn lines(mask: &Mask) -> Vec<Line> {
    let inside = mask.distance();
    let mut ways = Ways { mask, half: &inside.data, from: vec![usize::MAX; mask.data.len()] };
    let mut lines = Vec::new();
    let mut seen = vec![false; mask.data.len()];
    let mut piece = 0;
    for start in mask.pixels() {
        if seen[start] {
            continue;
        }
        let reached = ways.spread(&[start]);
        reached.iter().for_each(|&i| seen[i] = true);
        let Some(&end) = reached.last() else { continue };
        let stem_reached = ways.spread(&[end]);
        let mut tree = ways.back(stem_reached.last().copied().unwrap_or(end));
        if tree.len() > 1 {
            lines.push(ways.line(&tree, piece));
        }
        for _ in 0..MOST {
            let reached = ways.spread(&tree);
            let Some(&tip) = reached.last() else { break };
            let branch = ways.back(tip);
            let stem = branch.last().map_or(0.0, |&i| f64::from(inside.data[i]));
            let line = ways.line(&branch, piece);
            if line.length() < SHORTEST.max(BROAD * stem) {
                break;
            }
            lines.push(line);
            tree.extend(branch);
        }
        piece += 1;
    }
    lines
}

/// Shortest ways in a mask.
struct Ways<'a> {
    mask: &'a Mask,
    half: &'a [f32],
    from: Vec<usize>,
}

/// A pixel on the way, cheapest first.
#[derive(PartialEq)]
struct Next(f64, usize);

impl Eq for Next {}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

impl Ways<'_> {
    /// Costs from some pixels to all that hang together with them (Dijkstra 1959); these in order of
    /// their cost.
    fn spread(&mut self, starts: &[usize]) -> Vec<usize> {
        let mut reached = Vec::new();
        let mut heap = BinaryHeap::new();
        let mut open: HashMap<usize, f64> = HashMap::new();
        for &start in starts {
            self.from[start] = usize::MAX;
            open.insert(start, 0.0);
            heap.push(Next(0.0, start));
        }
        let mut done = HashSet::new();
        while let Some(Next(cost, at)) = heap.pop() {
            if !done.insert(at) {
                continue;
            }
            reached.push(at);
            for (next, length) in around(self.mask, at) {
                let rim = f64::from(self.half[next]).max(0.5);
                let total = cost + length * (1.0 + 2.0 / (rim * rim));
                if !done.contains(&next) && open.get(&next).is_none_or(|c| total < *c) {
                    open.insert(next, total);
                    self.from[next] = at;
                    heap.push(Next(total, next));
                }
            }
        }
        reached
    }

    /// From a pixel back to where the last spread began.
    fn back(&self, mut at: usize) -> Vec<usize> {
        let mut way = vec![at];
        while let Some(&before) = self.from.get(at).filter(|&&from| from != usize::MAX) {
            way.push(before);
            at = before;
        }
        way
    }

    /// A way as a smooth line.
    fn line(&self, way: &[usize], piece: usize) -> Line {
        let raw: Vec<[f64; 2]> = way
            .iter()
            .map(|&i| {
                let (x, y) = self.mask.place(i);
                [x as f64 + 0.5, y as f64 + 0.5]
            })
            .collect();
        let smooth = |k: usize| {
            // As many before as after, so that ends stay where they are.
            let reach = SMOOTH.min(k).min(raw.len() - 1 - k);
            let of = &raw[k - reach..=k + reach];
            [0, 1].map(|c| of.iter().map(|p| p[c]).sum::<f64>() / of.len() as f64)
        };
        Line {
            points: (0..raw.len()).map(smooth).collect(),
            half: way.iter().map(|&i| f64::from(self.half[i])).collect(),
            piece,
        }
    }
}

/// Set pixels beside and askew of one, and how far they are.
fn around(mask: &Mask, at: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    let (x, y) = mask.place(at);
    let all = (-1_isize..=1).flat_map(|dy| (-1_isize..=1).map(move |dx| (dx, dy)));
    all.filter(|step| *step != (0, 0)).filter_map(move |(dx, dy)| {
        let (u, v) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
        let index = (u < mask.width && v < mask.height).then(|| v * mask.width + u)?;
        mask.data[index].then(|| (index, if dx != 0 && dy != 0 { 2_f64.sqrt() } else { 1.0 }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of three pixels' width with a branch: two middle lines, within a pixel of the truth.
    #[test]
    fn a_fork_is_a_stem_and_a_branch() {
        let (w, h) = (80, 60);
        let near = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| {
            let (d, q) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let t = ((d[0] * q[0] + d[1] * q[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
            (q[0] - t * d[0]).hypot(q[1] - t * d[1])
        };
        let [a, b, c, d] = [[5.0, 30.0], [75.0, 36.0], [40.0, 33.0], [52.0, 18.0]];
        let at = |i: usize| [(i % w) as f64 + 0.5, (i / w) as f64 + 0.5];
        let data = (0..w * h).map(|i| near(a, b, at(i)) < 1.6 || near(c, d, at(i)) < 1.6).collect();
        let found = lines(&Mask { width: w, height: h, data });
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[0].length() - 71.0).abs() < 4.0, "{}", found[0].length());
        assert!((found[1].length() - 19.0).abs() < 4.0, "{}", found[1].length());
        let [stem, branch] = [&found[0], &found[1]];
        // Tips lie on the rim; elsewhere lines keep to the middle.
        let inner = |line: &Line| line.points[4..line.points.len() - 4].to_vec();
        assert!(inner(stem).iter().all(|p| near(a, b, *p) < 1.0));
        assert!(inner(branch).iter().all(|p| near(c, d, *p) < 1.3));
    }

    #[test]
    fn pieces_that_do_not_touch_are_lines_of_their_own() {
        let mask = Mask::drawn(&["######....", "..........", "....######"]);
        let found = lines(&mask);
        assert_eq!(found.len(), 2);
        assert_ne!(found[0].piece, found[1].piece);
    }
}
