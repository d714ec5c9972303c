//! Which hexahedron holds a point.

use glam::{DVec3, UVec3};

use super::Mesh;
use crate::element::hex8;

/// A point is inside as long as its natural coordinates stay within ±(1 + this).
pub(crate) const TOLERANCE: f64 = 1e-6;

/// Where a point is in the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Host {
    /// Index into [`Mesh::hexes`].
    pub hex: u32,
    /// Natural coordinates, each in ±(1 + [`TOLERANCE`]).
    pub natural: DVec3,
}

/// A uniform grid over the hexahedra of a valid mesh.
#[derive(Debug, Clone)]
pub struct Locator<'a> {
    mesh: &'a Mesh,
    low: DVec3,
    /// Boxes per metre.
    scale: DVec3,
    size: UVec3,
    /// Where each box's list begins in `hexes`, and the end.
    starts: Vec<u32>,
    hexes: Vec<u32>,
}

impl<'a> Locator<'a> {
    /// The mesh that is searched.
    #[must_use]
    pub fn mesh(&self) -> &'a Mesh {
        self.mesh
    }

    /// Sorts the hexahedra into about as many boxes.
    #[must_use]
    pub fn new(mesh: &'a Mesh) -> Self {
        let boxes: Vec<[DVec3; 2]> =
            (0..mesh.hexes.len() as u32).map(|h| around(&mesh.corners(h))).collect();
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = boxes.iter().fold(none, |[low, high], b| [low.min(b[0]), high.max(b[1])]);
        let extent =
            if boxes.is_empty() { DVec3::ONE } else { (high - low).max(DVec3::splat(1e-300)) };
        // Cubes of such a size that there are as many as hexahedra.
        let edge = (extent.x * extent.y * extent.z / boxes.len().max(1) as f64).cbrt().max(1e-300);
        let size = (extent / edge).ceil().clamp(DVec3::ONE, DVec3::splat(512.0)).as_uvec3();
        let mut grid = Self {
            mesh,
            low,
            scale: size.as_dvec3() / extent,
            size,
            starts: Vec::new(),
            hexes: Vec::new(),
        };
        let mut counts = vec![0u32; size.x as usize * size.y as usize * size.z as usize + 1];
        let entries = |grid: &Self, visit: &mut dyn FnMut(usize, u32)| {
            for (h, [low, high]) in (0u32..).zip(&boxes) {
                grid.covered(*low, *high).for_each(|b| visit(b, h));
            }
        };
        entries(&grid, &mut |b, _| counts[b + 1] += 1);
        for b in 1..counts.len() {
            counts[b] += counts[b - 1];
        }
        let mut next = counts.clone();
        let mut hexes = vec![0; counts[counts.len() - 1] as usize];
        entries(&grid, &mut |b, h| {
            hexes[next[b] as usize] = h;
            next[b] += 1;
        });
        (grid.starts, grid.hexes) = (counts, hexes);
        grid
    }

    /// Numbers of the boxes that a box in space touches.
    fn covered(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = usize> + use<'_, 'a> {
        let last = self.size - UVec3::ONE;
        let place = |p: DVec3| ((p - self.low) * self.scale).max(DVec3::ZERO).as_uvec3().min(last);
        let (from, to) = (place(low), place(high));
        let (nx, ny) = (self.size.x as usize, self.size.y as usize);
        (from.z..=to.z).flat_map(move |z| {
            (from.y..=to.y).flat_map(move |y| {
                (from.x..=to.x).map(move |x| x as usize + nx * (y as usize + ny * z as usize))
            })
        })
    }

    fn candidates(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = u32> {
        self.covered(low, high).flat_map(|b| {
            self.hexes[self.starts[b] as usize..self.starts[b + 1] as usize].iter().copied()
        })
    }

    /// The hexahedron that holds a point; on a common face the one that holds it deepest, then the
    /// lowest number.
    #[must_use]
    pub fn locate(&self, point: DVec3) -> Option<Host> {
        self.locate_where(point, |_| true)
    }

    /// As [`Locator::locate`], among the hexahedra that fulfil `admit` (hosts of embedded bars, for
    /// example).
    #[must_use]
    pub(crate) fn locate_where(&self, point: DVec3, admit: impl Fn(u32) -> bool) -> Option<Host> {
        if !point.is_finite() {
            return None;
        }
        let mut best: Option<(f64, Host)> = None;
        for hex in self.candidates(point, point).filter(|&h| admit(h)) {
            let corners = self.mesh.corners(hex);
            let [low, high] = around(&corners);
            let slack = TOLERANCE * (high - low).max_element();
            if (point - low).min_element() < -slack || (high - point).min_element() < -slack {
                continue;
            }
            let Some(natural) = hex8::locate(&corners, point) else { continue };
            let reach = natural.abs().max_element();
            if reach <= 1.0 + TOLERANCE && best.is_none_or(|(r, host)| (reach, hex) < (r, host.hex))
            {
                best = Some((reach, Host { hex, natural }));
            }
        }
        best.map(|(_, host)| host)
    }
}

fn around(corners: &[DVec3; 8]) -> [DVec3; 2] {
    corners[1..].iter().fold([corners[0]; 2], |[low, high], &p| [low.min(p), high.max(p)])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use intrados_stage::random::Key;

    use super::super::{Layer, Polar, block};
    use super::*;

    fn ring() -> Mesh {
        let layers =
            vec![Layer { region: "c".into(), radii: vec![2.75, 2.9, 3.2], ..Layer::default() }];
        Polar { layers, angles: Polar::angles(0.0, TAU, &[], 0.2), z: vec![0.0, 0.3, 1.0] }
            .build()
            .unwrap()
    }

    #[test]
    fn points_are_found_where_they_were_put() {
        let mut mesh = ring();
        // Warped elements, not only prisms.
        mesh.transform(|p| p + 0.02 * DVec3::new((3.0 * p.y).sin(), p.z * p.x, (2.0 * p.x).cos()));
        mesh.check().unwrap();
        let grid = Locator::new(&mesh);
        for n in 0..500 {
            let r = |d| Key::new(7, n).unit64(d);
            let hex = (r(0) * mesh.hexes.len() as f64) as u32;
            let xi = DVec3::new(r(1), r(2), r(3)) * 1.98 - 0.99;
            let host = grid.locate(hex8::position(&mesh.corners(hex), xi)).unwrap();
            assert_eq!(host.hex, hex);
            assert!((host.natural - xi).length() < 1e-9);
        }
    }

    #[test]
    fn outside_is_outside() {
        let mesh = ring();
        let grid = Locator::new(&mesh);
        assert_eq!(grid.locate(DVec3::new(0.0, 0.0, 0.5)), None);
        assert_eq!(grid.locate(DVec3::new(100.0, 0.0, 0.5)), None);
        assert_eq!(grid.locate(DVec3::NAN), None);
        let brick = block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        let grid = Locator::new(&brick);
        // A corner node is in the mesh, by the tolerance; a point 1e-5 outside is not.
        assert!(grid.locate(DVec3::new(2.0, 1.0, 1.0)).is_some());
        assert!(grid.locate(DVec3::new(2.0 + 1e-5, 1.0, 1.0)).is_none());
        assert_eq!(grid.locate_where(DVec3::new(1.0, 0.5, 0.5), |h| h == 1).unwrap().hex, 1);
    }

    #[test]
    fn an_empty_mesh_holds_nothing() {
        assert_eq!(Locator::new(&Mesh::default()).locate(DVec3::ZERO), None);
    }
}
