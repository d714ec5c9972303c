//! Lays a polyline (bar, tendon) through bricks: walks along each segment, and cuts it where it
//! leaves one brick for the next.

use super::hex8;
use super::rod::Piece;
use glam::DVec3;

/// How far outside a brick (natural coordinate beyond ±1) still counts as inside while walking, so
/// that lines along faces and edges go through.
const EDGE: f64 = 1e-6;
/// How wide a gap between neighbouring bricks may be, in natural coordinates.
const GAP: f64 = 1e-3;
/// How far ahead, in sizes of the brick, the next brick is asked for.
const PROBES: [f64; 6] = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2];

/// Why a bar could not be laid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EmbedError {
    /// A part lies in no brick.
    #[error("the bar is outside the concrete at ({:.4}, {:.4}, {:.4}) m, {along:.4} m from its start (segment {segment}): move it inside or extend the mesh", at.x, at.y, at.z)]
    Outside {
        /// Where it leaves.
        at: DVec3,
        /// Segment of the polyline, from 0.
        segment: usize,
        /// Distance from the bar's start (m).
        along: f64,
    },
    /// Fewer than two different points, or one that is not finite.
    #[error("a bar needs at least two different points, all finite (point {point})")]
    Points {
        /// The offending point, from 0.
        point: usize,
    },
}

/// Splits a polyline at the faces of bricks. `locate(point)` names a brick that holds the point
/// (any of them on a shared face; accept natural coordinates up to 1 + 1e-6, or bars on the skin
/// fall out by rounding), `nodes(brick)` its corners. The pieces are in order without gap or
/// overlap: piece k lies between the bar's cuts k and k + 1, which also number the slips of
/// [`Piece::slipping`]. Repeated points are passed over; bricks are taken as convex.
///
/// # Errors
/// [`EmbedError`].
pub fn embed(
    points: &[DVec3],
    mut locate: impl FnMut(DVec3) -> Option<(usize, DVec3)>,
    nodes: impl Fn(usize) -> [DVec3; 8],
) -> Result<Vec<Piece>, EmbedError> {
    if let Some(point) = points.iter().position(|p| !p.is_finite()) {
        return Err(EmbedError::Points { point });
    }
    let (mut pieces, mut start) = (Vec::new(), 0.0);
    for (segment, ends) in points.windows(2).enumerate() {
        let line =
            Line { from: ends[0], to: ends[1], length: ends[0].distance(ends[1]), segment, start };
        if line.length > 0.0 {
            line.walk(&mut locate, &nodes, &mut pieces)?;
            start += line.length;
        }
    }
    if pieces.is_empty() { Err(EmbedError::Points { point: 0 }) } else { Ok(pieces) }
}

/// A segment of the polyline; places on it are distances from its start (m).
struct Line {
    from: DVec3,
    to: DVec3,
    length: f64,
    segment: usize,
    start: f64,
}

impl Line {
    fn at(&self, t: f64) -> DVec3 {
        if t >= self.length {
            self.to
        } else {
            self.from + (self.to - self.from) * (t / self.length)
        }
    }

    fn walk(
        &self,
        locate: &mut impl FnMut(DVec3) -> Option<(usize, DVec3)>,
        nodes: &impl Fn(usize) -> [DVec3; 8],
        pieces: &mut Vec<Piece>,
    ) -> Result<(), EmbedError> {
        let mut here = 0.0;
        while here < self.length {
            let Some((host, corners, mut end)) = self.ahead(here, locate, nodes) else {
                return Err(EmbedError::Outside {
                    at: self.at(here),
                    segment: self.segment,
                    along: self.start + here,
                });
            };
            if self.length - end < 1e-6 * size(&corners) {
                end = self.length;
            }
            let ends = [self.at(here), self.at(end)];
            let inside = |x: DVec3| {
                hex8::locate(&corners, x).filter(|natural| natural.abs().max_element() <= 1.0 + GAP)
            };
            let (Some(first), Some(second)) = (inside(ends[0]), inside(ends[1])) else {
                return Err(EmbedError::Outside {
                    at: ends[0],
                    segment: self.segment,
                    along: self.start + here,
                });
            };
            let along = [self.start + here, self.start + end];
            pieces.push(Piece {
                host,
                segment: self.segment,
                ends,
                natural: [first, second],
                along,
            });
            here = end;
        }
        Ok(())
    }

    /// The brick that the line is in just after `here`, and where it leaves it. Probes go further
    /// ahead until a brick leads on, so a tolerant `locate` that still answers the brick behind, or
    /// a hairline gap, does no harm.
    fn ahead(
        &self,
        here: f64,
        locate: &mut impl FnMut(DVec3) -> Option<(usize, DVec3)>,
        nodes: &impl Fn(usize) -> [DVec3; 8],
    ) -> Option<(usize, [DVec3; 8], f64)> {
        let mut scale = self.length;
        for probe in PROBES {
            let t = (here + probe * scale).min(0.5 * (here + self.length));
            let Some((host, _)) = locate(self.at(t)) else { continue };
            let corners = nodes(host);
            scale = scale.min(size(&corners));
            let end = self.exit(&corners, t);
            if end > t + 0.5 * (t - here) {
                return Some((host, corners, end));
            }
        }
        None
    }

    /// Where the line leaves a brick that it is in at `t`: the root of max|ξ| − 1, by secants and
    /// halvings in turn.
    fn exit(&self, corners: &[DVec3; 8], t: f64) -> f64 {
        let excess = |t: f64| {
            hex8::locate(corners, self.at(t))
                .map_or(f64::MAX, |natural| natural.abs().max_element() - 1.0 - EDGE)
        };
        let (mut low, mut high, mut below, mut above) =
            (t, self.length, excess(t), excess(self.length));
        if above <= 0.0 {
            return high;
        }
        if below > 0.0 {
            return t;
        }
        for turn in 0..200 {
            let secant = turn % 2 == 0 && above < 1e3;
            let middle = if secant {
                (low * above - high * below) / (above - below)
            } else {
                0.5 * (low + high)
            };
            let value = excess(middle);
            if value.abs() < 1e-13 || high - low <= 1e-15 * high {
                return middle;
            }
            if value > 0.0 {
                (high, above) = (middle, value)
            } else {
                (low, below) = (middle, value)
            }
        }
        low
    }
}

fn size(corners: &[DVec3; 8]) -> f64 {
    (0..4).map(|i| corners[i].distance(corners[(i + 6) % 4 + 4])).fold(f64::MAX, f64::min)
}

/// Asks every brick, for tests.
#[cfg(test)]
pub(crate) fn brute<'a>(
    nodes: &'a [DVec3],
    elements: &'a [[usize; 8]],
) -> impl FnMut(DVec3) -> Option<(usize, DVec3)> + 'a {
    move |point| {
        elements.iter().enumerate().find_map(|(n, element)| {
            let natural = hex8::locate(&element.map(|i| nodes[i]), point)?;
            (natural.abs().max_element() <= 1.0 + 1e-9).then_some((n, natural))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{bricks, noise};
    use crate::element::load::Face;

    /// Pieces join end to end, are as long as the bar, lie in their hosts, and end where their
    /// natural coordinates say.
    fn sound(points: &[DVec3], nodes: &[DVec3], elements: &[[usize; 8]]) -> Vec<Piece> {
        let host = |n: usize| elements[n].map(|i| nodes[i]);
        let pieces = embed(points, brute(nodes, elements), host).unwrap();
        let length: f64 = points.windows(2).map(|p| p[0].distance(p[1])).sum();
        assert!((pieces.iter().map(Piece::length).sum::<f64>() - length).abs() < 1e-12 * length);
        assert_eq!(
            (pieces[0].ends[0], pieces[pieces.len() - 1].ends[1]),
            (points[0], points[points.len() - 1])
        );
        assert!(pieces.windows(2).all(|p| p[0].ends[1] == p[1].ends[0]
            && p[0].along[1] == p[1].along[0]
            && p[0].segment <= p[1].segment));
        for piece in &pieces {
            let middle =
                hex8::locate(&host(piece.host), 0.5 * (piece.ends[0] + piece.ends[1])).unwrap();
            assert!(middle.abs().max_element() < 1.0 + 1e-5, "{piece:?}");
            for (end, natural) in piece.ends.iter().zip(piece.natural) {
                assert!(hex8::position(&host(piece.host), natural).distance(*end) < 1e-12);
                assert!(natural.abs().max_element() < 1.0 + 1e-5);
            }
        }
        pieces
    }

    #[test]
    fn through_corners_along_edges_and_faces() {
        let (nodes, elements) = bricks([3, 3, 3], DVec3::new(3.0, 3.0, 3.0));
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        assert_eq!(
            sound(&[corner(0.0, 0.0, 0.0), corner(3.0, 3.0, 3.0)], &nodes, &elements).len(),
            3
        );
        assert_eq!(
            sound(&[corner(0.0, 1.0, 1.0), corner(3.0, 1.0, 1.0)], &nodes, &elements).len(),
            3
        );
        assert_eq!(
            sound(&[corner(3.0, 0.0, 0.5), corner(0.0, 3.0, 0.5)], &nodes, &elements).len(),
            3
        );
        assert_eq!(
            sound(&[corner(0.0, 1.0, 0.2), corner(3.0, 1.0, 2.3)], &nodes, &elements).len(),
            5
        );
        assert_eq!(
            sound(
                &[
                    corner(0.5, 0.5, 0.5),
                    corner(0.6, 0.5, 0.5),
                    corner(0.6, 0.5, 0.5),
                    corner(1.0, 1.0, 1.0)
                ],
                &nodes,
                &elements
            )
            .len(),
            2
        );
        assert_eq!(
            sound(
                &[corner(0.0, 0.0, 0.0), corner(0.0, 0.0, 3.0), corner(3.0, 0.0, 3.0)],
                &nodes,
                &elements
            )
            .len(),
            6
        );
    }

    /// The seven bricks of the patch test have warped faces; 200 random polylines.
    #[test]
    fn random_lines_through_distorted_bricks() {
        let inner = [
            [0.249, 0.342, 0.192],
            [0.826, 0.288, 0.288],
            [0.850, 0.649, 0.263],
            [0.273, 0.750, 0.230],
            [0.320, 0.186, 0.643],
            [0.677, 0.305, 0.683],
            [0.788, 0.693, 0.644],
            [0.165, 0.745, 0.702],
        ];
        let nodes: Vec<DVec3> = hex8::CORNERS
            .into_iter()
            .map(|c| 0.5 * (c + DVec3::ONE))
            .chain(inner.map(DVec3::from))
            .collect();
        let mut elements = vec![std::array::from_fn(|a| 8 + a)];
        for face in Face::ALL {
            let [a, b, c, d] = face.nodes();
            elements.push([a, b, c, d, 8 + a, 8 + b, 8 + c, 8 + d]);
        }
        for seed in 0..200 {
            let random: [f64; 9] = noise(seed);
            let points: Vec<DVec3> =
                random.chunks_exact(3).map(|x| 0.5 * (DVec3::from_slice(x) + DVec3::ONE)).collect();
            sound(&points, &nodes, &elements);
        }
    }

    #[test]
    fn what_lies_outside_is_named() {
        let (nodes, elements) = bricks([2, 1, 1], DVec3::new(2.0, 1.0, 1.0));
        let host = |n: usize| elements[n].map(|i| nodes[i]);
        let out = |points: &[DVec3]| embed(points, brute(&nodes, &elements), host).unwrap_err();
        let from = DVec3::new(0.5, 0.5, 0.5);
        let EmbedError::Outside { at, segment, along } =
            out(&[from, DVec3::new(1.0, 0.5, 0.5), DVec3::new(4.0, 0.5, 0.5)])
        else {
            panic!()
        };
        assert!(
            at.distance(DVec3::new(2.0, 0.5, 0.5)) < 1e-5
                && segment == 1
                && (along - 1.5).abs() < 1e-5
        );
        assert!(matches!(
            out(&[DVec3::new(-1.0, 0.5, 0.5), from]),
            EmbedError::Outside { segment: 0, .. }
        ));
        assert_eq!(out(&[from]), EmbedError::Points { point: 0 });
        assert_eq!(out(&[from, from]), EmbedError::Points { point: 0 });
        assert_eq!(out(&[from, DVec3::NAN]), EmbedError::Points { point: 1 });
        // A hole within: two bricks apart by more than a hair.
        let apart: Vec<DVec3> =
            nodes.iter().map(|x| if x.x > 1.5 { *x + DVec3::X } else { *x }).collect();
        let far: [DVec3; 8] = std::array::from_fn(|a| {
            apart[elements[1][a]] + if a % 4 == 0 || a % 4 == 3 { DVec3::X } else { DVec3::ZERO }
        });
        let two = |n: usize| if n == 0 { host(0) } else { far };
        let locate = |x: DVec3| {
            (0..2).find_map(|n| {
                let natural = hex8::locate(&two(n), x)?;
                (natural.abs().max_element() <= 1.0).then_some((n, natural))
            })
        };
        let hole = embed(&[from, DVec3::new(2.5, 0.5, 0.5)], locate, two).unwrap_err();
        let EmbedError::Outside { at, .. } = hole else { panic!() };
        assert!((at.x - 1.0).abs() < 1e-5);
    }
}
