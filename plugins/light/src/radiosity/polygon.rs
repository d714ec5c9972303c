//! Convex polygons seen from a point: cut, shadowed, measured.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

/// Corners in order, all in one plane.
pub(super) type Polygon = Vec<DVec3>;

/// Lengths below this are roundings, m.
pub(super) const TINY: f64 = 1e-9;

/// The half-space `n·p ≥ d`, `n` of unit length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) n: DVec3,
    pub(super) d: f64,
}

impl Plane {
    pub(super) fn through(p: DVec3, n: DVec3) -> Self {
        Self { n, d: n.dot(p) }
    }

    pub(super) fn height(&self, p: DVec3) -> f64 {
        self.n.dot(p) - self.d
    }

    pub(super) fn turned(&self) -> Self {
        Self { n: -self.n, d: -self.d }
    }

    /// Whether the plane's positive side holds none of the polygon.
    pub(super) fn misses(&self, polygon: &[DVec3]) -> bool {
        polygon.iter().all(|&p| self.height(p) <= TINY)
    }

    /// The part of a polygon on the plane's positive side (Sutherland and Hodgman, Comm. ACM 17,
    /// 1974).
    pub(super) fn cut(&self, polygon: &[DVec3], into: &mut Polygon) {
        into.clear();
        let Some(&last) = polygon.last() else { return };
        let (mut a, mut ha) = (last, self.height(last));
        for &b in polygon {
            let hb = self.height(b);
            if (ha >= 0.0) != (hb >= 0.0) {
                into.push(a + (b - a) * (ha / (ha - hb)));
            }
            if hb >= 0.0 {
                into.push(b);
            }
            (a, ha) = (b, hb);
        }
    }

    pub(super) fn cut_new(&self, polygon: &[DVec3]) -> Polygon {
        let mut into = Polygon::with_capacity(polygon.len() + 2);
        self.cut(polygon, &mut into);
        into
    }
}

/// What a convex blocker hides from a point: a cone cut off at the blocker, convex as well.
pub(super) struct Shadow([Plane; 5]);

impl Shadow {
    /// `None` for a blocker that is seen edge on.
    pub(super) fn new(x: DVec3, blocker: &[DVec3; 4], normal: DVec3) -> Option<Self> {
        let base = Plane::through(blocker[0], normal);
        let height = base.height(x);
        if height.abs() <= TINY {
            return None;
        }
        let middle = 0.5 * (blocker[0] + blocker[2]);
        let side = |i: usize| {
            let plane = Plane::through(
                x,
                (blocker[i] - x).cross(blocker[(i + 1) % 4] - x).normalize_or_zero(),
            );
            if plane.height(middle) < 0.0 { plane.turned() } else { plane }
        };
        Some(Self([
            if height > 0.0 { base.turned() } else { base },
            side(0),
            side(1),
            side(2),
            side(3),
        ]))
    }

    /// Takes the shadow away: what the polygon's planes cut off one after the other is lit, what is
    /// left in the end is dark.
    pub(super) fn take_from(&self, polygon: Polygon, lit: &mut Vec<Polygon>) {
        if self.0.iter().any(|plane| plane.misses(&polygon)) {
            return lit.push(polygon);
        }
        let dark = self.0.iter().fold(polygon.clone(), |rest, plane| plane.cut_new(&rest));
        if dark.len() < 3 {
            return lit.push(polygon);
        }
        let mut rest = polygon;
        for plane in &self.0 {
            let outside = plane.turned();
            if !outside.misses(&rest) {
                lit.push(outside.cut_new(&rest));
                rest = plane.cut_new(&rest);
            }
        }
    }
}

/// Lambert's formula: share of the light of a Lambert surface at `x` with normal `n` that reaches
/// the polygon, F = 1/2π |Σ angle of edge · cosine between n and the edge's plane|, over what is
/// above the surface's horizon.
pub(super) fn form_factor(x: DVec3, n: DVec3, polygon: &[DVec3], spare: &mut Polygon) -> f64 {
    let horizon = Plane::through(x, n);
    let polygon = if polygon.iter().all(|&p| horizon.height(p) >= 0.0) {
        polygon
    } else {
        horizon.cut(polygon, spare);
        spare
    };
    let Some(&last) = polygon.last() else { return 0.0 };
    let mut a = last - x;
    let mut sum = 0.0;
    for &b in polygon {
        let b = b - x;
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * n.dot(cross) / length;
        }
        a = b;
    }
    (0.5 * FRAC_1_PI * sum).abs()
}

/// Area of a plane polygon.
pub(super) fn area(polygon: &[DVec3]) -> f64 {
    let fan = polygon.windows(2).skip(1).map(|w| (w[0] - polygon[0]).cross(w[1] - polygon[0]));
    0.5 * fan.sum::<DVec3>().length()
}
