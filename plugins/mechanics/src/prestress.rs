//! Force along a tendon: what of the jack's force arrives where, and what is lost when.
//!
//! Friction: P(s) = P₀ e^(−μ(θ + ks)) with the angle θ turned since the jack and the unintended
//! angle k per metre (EN 1992-1-1 (5.45)). Anchorage slip w: the tendon runs back until friction,
//! now the other way, stops it. Where it runs back the force is P′(s) = P′(0) e^(+μ(θ + ks)), and
//! the area between the two curves is what the tendon gets shorter: ∫(P − P′) ds/(E A) = w. Elastic
//! shortening, creep and shrinkage come from the concrete; relaxation from the strand's own law.
//! Every loss is kept as a component of its own.

use crate::material::Error;
use crate::material::steel::Strand;

/// A point of a tendon's axis.
pub(crate) type Point = [f64; 3];

/// Arc length and angle turned along a tendon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Path {
    /// Distance from the first anchorage, m.
    lengths: Vec<f64>,
    /// Angle turned since there, rad.
    angles: Vec<f64>,
}

/// Why a tendon cannot be stressed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrestressError {
    /// It has no length, or its coordinates are not numbers.
    #[error(
        "tendon: point {0} is not a number or coincides with the one before: give distinct points along the axis"
    )]
    Point(usize),
    /// Fewer than two points.
    #[error("tendon: {0} point(s) make no axis: give at least two")]
    TooShort(usize),
    /// A value that no tendon has.
    #[error("tendon: {0}")]
    Value(#[from] Error),
    /// The anchorages slip more than the tendon was stretched.
    #[error(
        "tendon: a slip of {slip:.4} m is more than its elongation of {elongation:.4} m: nothing of the force is left"
    )]
    Slack {
        /// Given slip, m.
        slip: f64,
        /// Elongation under the force that the slip finds, m.
        elongation: f64,
    },
}

impl Path {
    /// A polyline whose corners are real deviations: each counts its angle in its vertex.
    ///
    /// # Errors
    ///
    /// If there are fewer than two distinct finite points.
    #[cfg(test)]
    pub(crate) fn polyline(points: &[Point]) -> Result<Self, PrestressError> {
        let (lengths, corners) = measure(points)?;
        // A vertex stands for both sides of its deviation; the angle is reached half in it, so that
        // both directions agree.
        let mut angles = vec![0.0; lengths.len()];
        for i in 1..lengths.len() {
            angles[i] = angles[i - 1] + 0.5 * (corners[i - 1] + corners[i]);
        }
        Ok(Self { lengths, angles })
    }

    /// Points on a smooth curve: the angle of each vertex is spread over the halves of its two
    /// sides as curvature, and the ends are as curved as their neighbours. Exact for a circle.
    ///
    /// # Errors
    ///
    /// As [`Self::polyline`].
    pub(crate) fn curve(points: &[Point]) -> Result<Self, PrestressError> {
        let (lengths, corners) = measure(points)?;
        let last = lengths.len() - 1;
        let mut curvature: Vec<f64> = (0..=last)
            .map(|i| {
                if i == 0 || i == last {
                    0.0
                } else {
                    2.0 * corners[i] / (lengths[i + 1] - lengths[i - 1])
                }
            })
            .collect();
        if last >= 2 {
            (curvature[0], curvature[last]) = (curvature[1], curvature[last - 1]);
        }
        let mut angles = vec![0.0; lengths.len()];
        for i in 1..=last {
            angles[i] = angles[i - 1]
                + 0.5 * (curvature[i - 1] + curvature[i]) * (lengths[i] - lengths[i - 1]);
        }
        Ok(Self { lengths, angles })
    }

    /// An arc of `radius` (m) over `angle` (rad), in `stations` ≥ 2 equally spaced points.
    #[must_use]
    pub(crate) fn arc(radius: f64, angle: f64, stations: usize) -> Self {
        let n = stations.max(2);
        let angles: Vec<f64> = (0..n).map(|i| angle.abs() * i as f64 / (n - 1) as f64).collect();
        Self { lengths: angles.iter().map(|a| a * radius.abs()).collect(), angles }
    }

    /// Angles turned since the first anchorage, rad.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// Length of the tendon, m.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn length(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }
}

/// Arc length at every point, and the angle between the sides that meet there.
fn measure(points: &[Point]) -> Result<(Vec<f64>, Vec<f64>), PrestressError> {
    if points.len() < 2 {
        return Err(PrestressError::TooShort(points.len()));
    }
    let mut lengths = vec![0.0];
    let mut sides: Vec<Point> = Vec::new();
    for (i, pair) in points.windows(2).enumerate() {
        let side: Point = std::array::from_fn(|c| pair[1][c] - pair[0][c]);
        let length = side.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(length.is_finite() && length > 0.0) {
            return Err(PrestressError::Point(i + 1));
        }
        sides.push(side.map(|x| x / length));
        lengths.push(lengths[i] + length);
    }
    let mut corners = vec![0.0; points.len()];
    for (i, pair) in sides.windows(2).enumerate() {
        // The half angle by |a − b| = 2 sin(α/2) is exact for small angles, where the cosine is
        // not.
        let chord = (0..3).map(|c| (pair[0][c] - pair[1][c]).powi(2)).sum::<f64>().sqrt();
        corners[i + 1] = 2.0 * (0.5 * chord).min(1.0).asin();
    }
    Ok((lengths, corners))
}

/// Which end is jacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) enum Jack {
    /// The first point.
    #[default]
    First,
    /// The last point.
    Last,
    /// Both.
    Both,
}

/// A tendon and how it is stressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tendon {
    /// Its steel.
    pub strand: Strand,
    /// Its section, m².
    pub area: f64,
    /// Stress at the jack, Pa.
    pub jacking: f64,
    /// Coefficient of friction μ, 1/rad: about .19 for strands in ducts, .05 to .07 for greased
    /// ones.
    pub friction: f64,
    /// Unintended angle k, rad/m: .005 to .01.
    pub wobble: f64,
    /// Slip at a jacked anchorage when it is locked, m.
    pub slip: f64,
    /// Jacked ends.
    pub jack: Jack,
}

/// Stress and losses (Pa, positive) at a point of a tendon.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Station {
    /// Distance from the first anchorage, m.
    pub length: f64,
    /// Angle turned since there, rad.
    pub angle: f64,
    /// Stress at the jack, Pa.
    pub jacking: f64,
    /// Lost by friction.
    pub friction: f64,
    /// Lost by anchorage slip.
    pub slip: f64,
    /// Lost by elastic shortening of the concrete while other tendons are stressed.
    pub shortening: f64,
    /// Lost by relaxation.
    pub relaxation: f64,
}

impl Station {
    /// Stress that is left, Pa. (Creep and shrinkage act through the strain of the concrete
    /// around.)
    #[must_use]
    pub(crate) fn stress(&self) -> f64 {
        self.jacking - self.friction - self.slip - self.shortening - self.relaxation
    }
}

impl Tendon {
    /// Stress after jacking and locking at every point of `path`.
    ///
    /// # Errors
    ///
    /// If a value is not that of a tendon, or slip exceeds elongation.
    pub(crate) fn stressed(&self, path: &Path) -> Result<Vec<Station>, PrestressError> {
        use crate::material::checked;
        self.strand.check()?;
        checked("section", self.area, 1e-7, 1.0, "square metres")?;
        checked(
            "jacking stress",
            self.jacking,
            1e6,
            self.strand.strength,
            "1 MPa up to the strength of the strand (in Pa)",
        )?;
        checked("friction", self.friction, 0.0, 2.0, "0 to 2 per radian")?;
        checked("wobble", self.wobble, 0.0, 1.0, "0 to 1 rad/m")?;
        checked("anchorage slip", self.slip, 0.0, 0.1, "0 to 0.1 m")?;
        // f = μ(θ + ks), the exponent of friction since the first anchorage.
        let exponents: Vec<f64> = path
            .lengths
            .iter()
            .zip(&path.angles)
            .map(|(s, a)| self.friction * (a + self.wobble * s))
            .collect();
        let total = exponents.last().copied().unwrap_or(0.0);
        let backward: Vec<f64> = exponents.iter().map(|f| total - f).collect();
        let from = |exponents: &[f64]| -> Vec<f64> {
            exponents.iter().map(|f| self.jacking * (-f).exp()).collect()
        };
        let jacked: Vec<f64> = match self.jack {
            Jack::First => from(&exponents),
            Jack::Last => from(&backward),
            Jack::Both => {
                from(&exponents).iter().zip(from(&backward)).map(|(a, b)| a.max(b)).collect()
            }
        };
        let mut locked = jacked.clone();
        if self.jack != Jack::Last {
            locked = self.lock(&locked, &exponents, &path.lengths)?;
        }
        if self.jack != Jack::First {
            locked = self.lock(&locked, &backward, &path.lengths)?;
        }
        let station = |i: usize| Station {
            length: path.lengths[i],
            angle: path.angles[i],
            jacking: self.jacking,
            friction: self.jacking - jacked[i],
            slip: jacked[i] - locked[i],
            ..Station::default()
        };
        Ok((0..jacked.len()).map(station).collect())
    }

    /// Stress after the anchorage where `exponents` is zero has slipped: min(σ, p e^f), with p so
    /// that the area between the two is E w.
    fn lock(
        &self,
        stress: &[f64],
        exponents: &[f64],
        lengths: &[f64],
    ) -> Result<Vec<f64>, PrestressError> {
        if self.slip == 0.0 {
            return Ok(stress.to_vec());
        }
        let drawn_in = |p: f64| self.drawn_in(stress, exponents, lengths, p);
        let elongation = drawn_in(0.0);
        if elongation <= self.slip {
            return Err(PrestressError::Slack { slip: self.slip, elongation });
        }
        // The draw-in falls as p rises: bisection, to the last bit that matters.
        let (mut low, mut high) = (0.0, self.jacking);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if drawn_in(middle) > self.slip { low = middle } else { high = middle }
        }
        Ok(stress.iter().zip(exponents).map(|(s, f)| s.min(low * f.exp())).collect())
    }

    /// How much the tendon shortens, m, if the stress at the slipping anchorage falls to p.
    ///
    /// Between two points both curves are exponentials of arc length (the angle is linear there),
    /// so each piece is integrated exactly, up to where they meet.
    fn drawn_in(&self, stress: &[f64], exponents: &[f64], lengths: &[f64], p: f64) -> f64 {
        let mut sum = 0.0;
        for i in 1..stress.len() {
            let (length, old) = ((lengths[i] - lengths[i - 1]).abs(), [stress[i - 1], stress[i]]);
            let new = [p * exponents[i - 1].exp(), p * exponents[i].exp()];
            let over = [old[0] - new[0], old[1] - new[1]];
            sum += match (over[0] > 0.0, over[1] > 0.0) {
                (true, true) => length * (mean(old) - mean(new)),
                (false, false) => 0.0,
                (first, _) => {
                    // ln(old/new) is linear over the piece: where it is zero they meet.
                    let logs = [(old[0] / new[0]).ln(), (old[1] / new[1]).ln()];
                    let share = logs[0] / (logs[0] - logs[1]);
                    let meeting = old[0].powf(1.0 - share) * old[1].powf(share);
                    let (part, inside) = if first { (share, 0) } else { (1.0 - share, 1) };
                    length * part * (mean([old[inside], meeting]) - mean([new[inside], meeting]))
                }
            };
        }
        sum / self.strand.modulus
    }

    /// Adds what the strand relaxes in `duration` (s) while the concrete around changed the stress
    /// by `change` (Pa, one per station; creep, shrinkage, loads), and returns the stress that is
    /// then in the strand.
    #[cfg(test)]
    pub(crate) fn relax(
        &self,
        stations: &mut [Station],
        change: impl Fn(usize) -> f64,
        duration: f64,
    ) -> Vec<f64> {
        let relaxed = stations.iter_mut().enumerate().map(|(i, station)| {
            let stress = station.stress() + change(i);
            let more = self.strand.relax(stress, station.relaxation, duration);
            station.relaxation += more;
            stress - more
        });
        relaxed.collect()
    }
}

/// Logarithmic mean: the average of an exponential between its end values.
fn mean([a, b]: [f64; 2]) -> f64 {
    let x = (b / a).ln();
    if a <= 0.0 || b <= 0.0 || x.abs() < 1e-6 { 0.5 * (a + b) } else { (b - a) / x }
}

/// Loss by elastic shortening when `tendons` equal tendons are stressed one after the other and all
/// of them shorten the concrete at their place by `strain` (negative): on average E_p |ε| (n −
/// 1)/(2n) (EN 1992-1-1 (5.44)). Pa.
#[must_use]
#[cfg(test)]
pub(crate) fn shortening(strand: &Strand, strain: f64, tendons: usize) -> f64 {
    let n = tendons.max(1) as f64;
    strand.modulus * (-strain).max(0.0) * (n - 1.0) / (2.0 * n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn tendon(friction: f64, wobble: f64) -> Tendon {
        Tendon {
            strand: Strand::default(),
            area: 140e-6,
            jacking: 1395e6,
            friction,
            wobble,
            slip: 0.0,
            jack: Jack::First,
        }
    }

    /// Points of a circle of radius r over an angle.
    fn circle(radius: f64, angle: f64, n: usize) -> Vec<Point> {
        (0..n)
            .map(|i| angle * i as f64 / (n - 1) as f64)
            .map(|a| [radius * a.cos(), radius * a.sin(), 0.0])
            .collect()
    }

    /// R 3.125 m: μ .06, k .01 and μ .2, k .005 after a quarter, a half and a whole turn (computed
    /// independently).
    #[test]
    fn friction_along_a_ring() {
        for (mu, k, expected) in
            [(0.06, 0.01, [0.9074, 0.8233, 0.6779]), (0.2, 0.005, [0.7268, 0.5283, 0.2791])]
        {
            for (angle, ratio) in [PI / 2.0, PI, 2.0 * PI].into_iter().zip(expected) {
                let stations = tendon(mu, k).stressed(&Path::arc(3.125, angle, 50)).unwrap();
                assert!((stations[49].stress() / 1395e6 - ratio).abs() < 6e-5, "{mu} {angle}");
            }
        }
    }

    /// Slip of 6 mm, μ .2, k .005, R 3 m: it reaches l = −ln(1 − √(wEm/σ))/m = 4.0213 m, and .58030
    /// of the jack's force is left at the anchorage.
    #[test]
    fn anchorage_slip_of_a_ring() {
        let tendon = Tendon { slip: 6e-3, ..tendon(0.2, 0.005) };
        let path = Path::arc(3.0, 2.0 * PI, 400);
        let stations = tendon.stressed(&path).unwrap();
        assert!(
            (stations[0].stress() / 1395e6 - 0.580_30).abs() < 2e-5,
            "{}",
            stations[0].stress() / 1395e6
        );
        let reach = stations.iter().filter(|s| s.slip > 0.0).map(|s| s.length).fold(0.0, f64::max);
        assert!((reach - 4.0213).abs() < 6.0 * PI / 399.0, "{reach}");
        // The area is the slip, whatever the number of stations.
        for n in [3, 17, 400] {
            let coarse = tendon.stressed(&Path::arc(3.0, 2.0 * PI, n)).unwrap();
            assert!((coarse[0].stress() / stations[0].stress() - 1.0).abs() < 1e-9, "{n}");
        }
    }

    /// On a short tendon the slip reaches the dead end: without friction it is w/L everywhere.
    #[test]
    fn slip_reaches_the_dead_end() {
        let tendon = Tendon { slip: 6e-3, ..tendon(0.0, 0.0) };
        let stations = tendon
            .stressed(&Path::polyline(&[[0.0; 3], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0]]).unwrap())
            .unwrap();
        assert!(stations.iter().all(|s| (s.slip - 195e9 * 6e-4).abs() < 1.0));
        let short = Path::polyline(&[[0.0; 3], [0.5, 0.0, 0.0]]).unwrap();
        assert!(matches!(tendon.stressed(&short), Err(PrestressError::Slack { .. })));
    }

    #[test]
    fn both_ends_are_symmetric_and_the_last_end_mirrors_the_first() {
        let path = Path::arc(3.0, PI, 101);
        let with =
            |jack| Tendon { slip: 3e-3, jack, ..tendon(0.2, 0.005) }.stressed(&path).unwrap();
        let (first, last, both) = (with(Jack::First), with(Jack::Last), with(Jack::Both));
        for i in 0..=100 {
            assert!((first[i].stress() - last[100 - i].stress()).abs() < 1.0);
            assert!((both[i].stress() - both[100 - i].stress()).abs() < 1.0);
            assert!(both[i].stress() >= first[i].stress() - 1.0);
        }
    }

    #[test]
    fn angle_of_polylines_and_of_curves() {
        let ring = Path::curve(&circle(3.0, 1.5 * PI, 40)).unwrap();
        assert!((ring.angles()[39] / (1.5 * PI) - 1.0).abs() < 1e-12);
        assert!((ring.length() / (4.5 * PI) - 1.0).abs() < 1e-3);
        // One corner of 45° between straight pieces.
        let bent =
            Path::polyline(&[[0.0; 3], [4.0, 0.0, 0.0], [6.0, 2.0, 0.0], [9.0, 5.0, 0.0]]).unwrap();
        assert!((bent.angles()[3] - PI / 4.0).abs() < 1e-12);
        // A parabola y = 4f x(L−x)/L² turns by 2 atan(4f/L); the error falls as the square of the
        // spacing.
        let parabola = |n: usize| {
            let points: Vec<Point> = (0..=n)
                .map(|i| 20.0 * i as f64 / n as f64)
                .map(|x| [x, 4.0 * x * (20.0 - x) / 400.0, 0.0])
                .collect();
            Path::curve(&points).unwrap().angles()[n] - 2.0 * (0.2f64).atan()
        };
        assert!(
            parabola(40).abs() < 1e-3 && (parabola(40) / parabola(80) - 4.0).abs() < 0.5,
            "{} {}",
            parabola(40),
            parabola(80)
        );
    }

    /// Curvature that varies: the area rule holds whatever the profile.
    #[test]
    fn slip_on_variable_curvature_keeps_its_area() {
        let points: Vec<Point> = (0..=200)
            .map(|i| 0.1 * f64::from(i))
            .map(|x| [x, 0.6 * (0.4 * x).sin(), 0.0])
            .collect();
        let path = Path::curve(&points).unwrap();
        let tendon = Tendon { slip: 5e-3, ..tendon(0.19, 0.01) };
        let stations = tendon.stressed(&path).unwrap();
        let area: f64 = stations
            .windows(2)
            .map(|p| 0.5 * (p[0].slip + p[1].slip) * (p[1].length - p[0].length))
            .sum();
        assert!((area / 195e9 / 5e-3 - 1.0).abs() < 1e-3);
        assert!(stations.iter().all(|s| s.slip >= 0.0 && s.friction >= -1e-6));
    }

    #[test]
    fn relaxation_is_kept_apart() {
        let tendon = tendon(0.06, 0.01);
        let mut stations = tendon.stressed(&Path::arc(3.125, PI, 5)).unwrap();
        let before = stations[0].stress();
        let stress = tendon.relax(&mut stations, |_| 0.0, 1000.0 * 3600.0);
        assert!(
            (stations[0].relaxation / 1e6 - 21.19).abs() < 6e-3
                && (before - stations[0].relaxation - stress[0]).abs() < 1e-3
        );
        assert!(stations[4].relaxation < stations[0].relaxation);
        // n = 2 tendons: the first loses what the second presses, half of the total, a quarter on
        // average.
        assert!((shortening(&tendon.strand, -1e-4, 2) - 0.25 * 195e9 * 1e-4).abs() < 1e-3);
        assert_eq!(shortening(&tendon.strand, -1e-4, 1), 0.0);
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(matches!(Path::polyline(&[[0.0; 3]]), Err(PrestressError::TooShort(1))));
        assert!(matches!(Path::curve(&[[0.0; 3], [0.0; 3]]), Err(PrestressError::Point(1))));
        assert!(matches!(Path::curve(&[[0.0; 3], [f64::NAN; 3]]), Err(PrestressError::Point(1))));
        for bad in [f64::NAN, -1.0, 1e12] {
            assert!(
                Tendon { jacking: bad, ..tendon(0.2, 0.0) }
                    .stressed(&Path::arc(3.0, 1.0, 5))
                    .is_err()
            );
        }
    }
}
