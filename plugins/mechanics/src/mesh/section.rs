//! Cross-sections as plane meshes of quadrilaterals, extruded along z.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

use glam::{DVec2, DVec3};

use super::{
    Cell, HexFace, Mesh, MeshError,
    generate::{MAX_CELLS, MAX_HEXES, ascending},
};

/// A plane mesh in x and y, m.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Section {
    /// Points.
    pub points: Vec<DVec2>,
    /// Quadrilaterals, counterclockwise.
    pub quads: Vec<[u32; 4]>,
}

/// A box girder in x (across) and y (up, 0 at half its depth), symmetric about x = 0, m. Webs lean
/// where `web_top_width` ≠ `bottom_width`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Girder {
    /// Width of the top slab.
    pub top_width: f64,
    /// Distance between the outer sides of the webs under the top slab.
    pub web_top_width: f64,
    /// Width of the bottom slab.
    pub bottom_width: f64,
    /// Height of the whole.
    pub depth: f64,
    /// Thickness of the top slab.
    pub top: f64,
    /// Thickness of the bottom slab.
    pub bottom: f64,
    /// Thickness of each web, measured horizontally.
    pub web: f64,
}

impl Section {
    /// Rectangle with the given lines.
    ///
    /// # Errors
    /// Lines that do not ascend.
    pub(crate) fn rectangle(x: &[f64], y: &[f64]) -> Result<Self, MeshError> {
        ascending("x", x)?;
        ascending("y", y)?;
        Self::lattice([x.len() - 1, y.len() - 1], |i, j| DVec2::new(x[i], y[j]), |_, _| true)
    }

    /// Disc about the origin, by a core of `divisions`² quadrilaterals and `rings` rings of
    /// 4·`divisions` around it (a butterfly: no flat corners).
    ///
    /// # Errors
    /// A radius not above 0, no divisions or no rings.
    pub(crate) fn disc(radius: f64, divisions: usize, rings: usize) -> Result<Self, MeshError> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(MeshError::whole(format!("a disc of radius {radius} m: give one above 0")));
        }
        if divisions == 0 || rings == 0 {
            return Err(MeshError::whole(
                "a disc needs at least one division a quarter and one ring",
            ));
        }
        // Lines of the core leave its edge at equal angles: spacing √2 sin θ of the elliptic map of
        // square to disc, x = u √(1 − v²/2), blended with the square. BLEND rounds the core's
        // corners to about 120°, CORE is its reach.
        const BLEND: f64 = 0.45;
        const CORE: f64 = 0.55;
        let line = |i: usize| SQRT_2 * (FRAC_PI_2 * i as f64 / divisions as f64 - FRAC_PI_4).sin();
        let core = |u: f64, v: f64| {
            let round = DVec2::new(u * (1.0 - 0.5 * v * v).sqrt(), v * (1.0 - 0.5 * u * u).sqrt());
            CORE * radius * ((1.0 - BLEND) * DVec2::new(u, v) + BLEND * round)
        };
        let n = divisions;
        let mut disc = Self::lattice([n, n], |i, j| core(line(i), line(j)), |_, _| true)?;
        // The edge of the core, counterclockwise from its lower right corner.
        let at = |i: usize, j: usize| (i + (n + 1) * j) as u32;
        let edge: Vec<u32> = (0..n)
            .map(|t| at(n, t))
            .chain((0..n).map(|t| at(n - t, n)))
            .chain((0..n).map(|t| at(0, n - t)))
            .chain((0..n).map(|t| at(t, 0)))
            .collect();
        let mut inner = edge.clone();
        for ring in 1..=rings {
            let share = ring as f64 / rings as f64;
            let from = disc.points.len() as u32;
            for (t, &node) in edge.iter().enumerate() {
                let (sin, cos) = (FRAC_PI_2 * t as f64 / n as f64 - FRAC_PI_4).sin_cos();
                let start = disc.points[node as usize];
                disc.points.push(start.lerp(radius * DVec2::new(cos, sin), share));
            }
            let outer: Vec<u32> = (from..from + edge.len() as u32).collect();
            for t in 0..edge.len() {
                let next = (t + 1) % edge.len();
                disc.quads.push([inner[t], outer[t], outer[next], inner[next]]);
            }
            inner = outer;
        }
        Ok(disc)
    }

    /// Box girder, elements at most `largest` (m) wide.
    ///
    /// # Errors
    /// Sizes that leave no hole, no web or no slab.
    pub(crate) fn girder(girder: &Girder, largest: f64) -> Result<Self, MeshError> {
        let Girder { top_width, web_top_width, bottom_width, depth, top, bottom, web } = *girder;
        let positive = [top_width, web_top_width, bottom_width, depth, top, bottom, web, largest]
            .iter()
            .all(|s| *s > 0.0 && s.is_finite());
        if !positive
            || top + bottom >= depth
            || 2.0 * web >= web_top_width.min(bottom_width)
            || top_width < web_top_width
        {
            return Err(MeshError::whole(format!(
                "box girder {top_width} × {depth} m: slabs ({top} and {bottom}) and webs ({web}) must leave a hole, \
                 and the top slab must cover the webs"
            )));
        }
        let overhang = 0.5 * (top_width - web_top_width);
        let steps = |length: f64| (length / largest - 1e-9).ceil().max(1.0) as usize;
        let columns = [
            if overhang > 1e-9 * top_width { steps(overhang) } else { 0 },
            steps(web),
            steps(web_top_width.max(bottom_width) - 2.0 * web),
        ];
        let rows = [steps(bottom), steps(depth - top - bottom), steps(top)];
        let [over, in_web, between] = columns;
        let total = [2 * over + 2 * in_web + between, rows.iter().sum()];
        // Marks along x at a height: the slanted webs move them; above, the top slab is straight.
        let half_web = |y: f64| {
            0.5 * (bottom_width + (web_top_width - bottom_width) * (y / (depth - top)).min(1.0))
        };
        let height = |j: usize| {
            let part = |j: usize, n: usize| j as f64 / n as f64;
            if j <= rows[0] {
                bottom * part(j, rows[0])
            } else if j <= rows[0] + rows[1] {
                bottom + (depth - top - bottom) * part(j - rows[0], rows[1])
            } else {
                depth - top + top * part(j - rows[0] - rows[1], rows[2])
            }
        };
        let across = |i: usize, y: f64| {
            let (outer, half) = (half_web(y), 0.5 * top_width);
            let marks = [
                (-half, over),
                (-outer, in_web),
                (-outer + web, between),
                (outer - web, in_web),
                (outer, over),
                (half, 0),
            ];
            let mut left = i;
            for pair in marks.windows(2) {
                let [(from, steps), (to, _)] = [pair[0], pair[1]];
                if left <= steps && steps > 0 {
                    return from + (to - from) * left as f64 / steps as f64;
                }
                left -= steps;
            }
            half
        };
        let point = |i: usize, j: usize| DVec2::new(across(i, height(j)), height(j) - 0.5 * depth);
        let keep = |i: usize, j: usize| {
            let (in_box, in_hole) = (
                i >= over && i < total[0] - over,
                i >= over + in_web && i < total[0] - over - in_web,
            );
            if j < rows[0] {
                in_box
            } else if j < rows[0] + rows[1] {
                in_box && !in_hole
            } else {
                true
            }
        };
        Self::lattice(total, point, keep)
    }

    fn lattice(
        cells: [usize; 2],
        point: impl Fn(usize, usize) -> DVec2,
        keep: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, MeshError> {
        let [ni, nj] = cells;
        if ni.checked_mul(nj).is_none_or(|n| n > MAX_CELLS) {
            return Err(MeshError::whole(format!(
                "a section of {ni} × {nj} elements: at most {MAX_CELLS}"
            )));
        }
        let mut index = vec![u32::MAX; (ni + 1) * (nj + 1)];
        let mut section = Self::default();
        for j in 0..nj {
            for i in (0..ni).filter(|&i| keep(i, j)) {
                let quad =
                    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| i + (ni + 1) * j);
                quad.iter().for_each(|&n| index[n] = 0);
                section.quads.push(quad.map(|n| n as u32));
            }
        }
        for (n, slot) in index.iter_mut().enumerate().filter(|(_, s)| **s == 0) {
            *slot = section.points.len() as u32;
            section.points.push(point(n % (ni + 1), n / (ni + 1)));
        }
        section.quads.iter_mut().flatten().for_each(|n| *n = index[*n as usize]);
        Ok(section)
    }

    /// Area, m².
    #[must_use]
    #[cfg(test)]
    pub(crate) fn area(&self) -> f64 {
        let corner = |n: u32| self.points[n as usize];
        self.quads
            .iter()
            .map(|&[a, b, c, d]| 0.5 * (corner(c) - corner(a)).perp_dot(corner(d) - corner(b)))
            .sum()
    }

    /// Extrudes through the given planes. The ends are the sets `z0` and `z1`, the mantle is
    /// `side`.
    ///
    /// # Errors
    /// Planes that do not ascend, too many elements, a section that is folded.
    pub(crate) fn extrude(&self, z: &[f64], region: &str) -> Result<Mesh, MeshError> {
        ascending("z", z)?;
        let (layers, points) = (z.len() - 1, self.points.len());
        if layers.checked_mul(self.quads.len()).is_none_or(|n| n > MAX_HEXES) {
            return Err(MeshError::whole(format!(
                "{layers} layers of {} elements: at most {MAX_HEXES} together",
                self.quads.len()
            )));
        }
        let mut mesh = Mesh { regions: vec![region.to_owned()], ..Mesh::default() };
        mesh.nodes = z
            .iter()
            .flat_map(|&z| self.points.iter().map(move |p| DVec3::new(p.x, p.y, z)))
            .collect();
        for layer in 0..layers {
            for quad in &self.quads {
                let nodes =
                    std::array::from_fn(|c| quad[c % 4] + ((layer + c / 4) * points) as u32);
                mesh.hexes.push(Cell { nodes, region: 0 });
            }
        }
        mesh.check()?;
        let quads = self.quads.len() as u32;
        let end = |from: u32, face: u8| {
            (from..from + quads).map(|hex| HexFace { hex, face }).collect::<Vec<_>>()
        };
        let side = mesh.outer_faces().into_iter().filter(|f| f.face > 1).collect();
        mesh.name_side("z0", end(0, 0));
        mesh.name_side("z1", end((layers as u32 - 1) * quads, 1));
        mesh.name_side("side", side);
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::{divide, hex};
    use super::*;

    #[test]
    fn a_round_column_has_good_elements_and_converges_to_the_disc() {
        let polygon = |n: f64, r: f64| 0.5 * n * r * r * (2.0 * PI / n).sin();
        for (divisions, rings) in [(1, 1), (4, 2), (8, 4), (16, 8)] {
            let section = Section::disc(0.4, divisions, rings).unwrap();
            // The outline is the regular polygon of 4·divisions sides.
            assert!((section.area() - polygon(4.0 * divisions as f64, 0.4)).abs() < 1e-14);
            let mesh = section.extrude(&[0.0, 0.5, 1.5], "c").unwrap();
            assert_eq!(mesh.hexes.len(), 2 * (divisions * divisions + 4 * divisions * rings));
            assert_eq!(mesh.face_sets["side"].len(), 2 * 4 * divisions);
            assert!(
                mesh.node_sets["side"].iter().all(|&n| (mesh.nodes[n as usize]
                    .truncate()
                    .length()
                    - 0.4)
                    .abs()
                    < 1e-15)
            );
            // No corner narrower than asin 0.7 = 44° or wider than 136°, on any mesh.
            let worst = (0..mesh.hexes.len() as u32)
                .flat_map(|h| (0..8).map(move |c| (h, c)))
                .map(|(h, c)| hex::corner_quality(&mesh.corners(h), c))
                .fold(1.0, f64::min);
            assert!(worst > 0.7, "{divisions}: {worst}");
            assert_eq!(mesh.bodies().1, 1);
        }
    }

    #[test]
    fn a_girder_has_its_area_and_is_hollow() {
        let girder = Girder {
            top_width: 3.0,
            web_top_width: 1.8,
            bottom_width: 1.6,
            depth: 1.2,
            top: 0.2,
            bottom: 0.15,
            web: 0.2,
        };
        let section = Section::girder(&girder, 0.1).unwrap();
        // Slabs and webs; the bottom slab widens with the webs: (1.6 + its width at 0.15) / 2 ·
        // 0.15.
        let at = 1.6 + 0.2 * 0.15;
        let expected = 3.0 * 0.2 + 0.5 * (1.6 + at) * 0.15 + 2.0 * 0.2 * 0.85;
        assert!((section.area() - expected).abs() < 1e-12, "{} {expected}", section.area());
        let mesh = section.extrude(&divide(0.0, 4.0, &[], 0.5), "g").unwrap();
        assert!((mesh.volume() - 4.0 * expected).abs() < 1e-11);
        assert_eq!(mesh.bodies().1, 1);
        let [low, high] = mesh.bounds().unwrap();
        assert!(
            (low - DVec3::new(-1.5, -0.6, 0.0)).length() < 1e-12
                && (high - DVec3::new(1.5, 0.6, 4.0)).length() < 1e-12
        );
        // Without overhang, with upright webs: a plain box.
        let plain = Girder { top_width: 1.6, web_top_width: 1.6, ..girder };
        let section = Section::girder(&plain, 10.0).unwrap();
        assert!((section.area() - (1.6 * 0.35 + 0.4 * 0.85)).abs() < 1e-12);
        assert_eq!(section.quads.len(), 8);
        assert!(
            Section::girder(&Girder { web: 0.9, ..girder }, 0.1)
                .unwrap_err()
                .reason
                .contains("must leave a hole")
        );
    }

    #[test]
    fn a_rectangle_is_a_block() {
        let mesh = Section::rectangle(&[0.0, 0.2, 0.4], &[0.0, 0.4])
            .unwrap()
            .extrude(&[0.0, 1.0], "c")
            .unwrap();
        assert!((mesh.volume() - 0.16).abs() < 1e-15);
        assert!(Section::disc(-1.0, 2, 2).is_err());
        assert!(Section::disc(1.0, 0, 2).is_err());
    }
}
