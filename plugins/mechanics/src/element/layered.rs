//! Bricks that grow: layers along one natural direction, born in turn.
//!
//! Each layer has its own 2×2×2 points (two across, so that bending within a layer is exact, and
//! one layer is the brick of [`hex8`]). A layer is born free of stress at the strain of its moment;
//! what it is strained later counts from there, which the element remembers per point. So many
//! pours need one element, where the refined mesh needs one per pour, and where the refined mesh
//! deforms linearly across its layers both give the same.
//!
//! The modes' gradients vanish in the mean over the *born* part, so that a constant stress passes
//! the patch test at any age. A birth moves that mean: then the strain that the modes have made so
//! far is frozen into the points, the modes start again from zero, and the force on them at that
//! moment is kept as their zero. A birth by itself moves nothing.

use super::ElementError;
use super::hex8::{self, GAUSS, Map, Modes, Solid};
use crate::tensor::{Tangent, Voigt};
use glam::DVec3;

/// A brick's layers, and what they remember.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    axis: usize,
    cuts: Vec<f64>,
    born: Vec<bool>,
    carried: Vec<Voigt>,
    held: [f64; 9],
    modes: Modes,
}

impl Layers {
    /// `count` layers of equal natural thickness along ξ (axis 0), η (1) or ζ (2), none born.
    /// `None` without layers or with a wrong axis.
    #[must_use]
    pub fn equal(axis: usize, count: usize) -> Option<Self> {
        Self::new(
            axis,
            (0..=count)
                .map(|i| if i == count { 1.0 } else { 2.0 * i as f64 / count as f64 - 1.0 })
                .collect(),
        )
    }

    /// Layers between cuts that rise from −1 to 1. `None` if they do not.
    #[must_use]
    pub fn new(axis: usize, cuts: Vec<f64>) -> Option<Self> {
        let count = cuts.len().checked_sub(1)?;
        let sound = axis < 3
            && count > 0
            && cuts[0] == -1.0
            && cuts[count] == 1.0
            && cuts.windows(2).all(|c| c[0] < c[1]);
        sound.then(|| Self {
            axis,
            cuts,
            born: vec![false; count],
            carried: vec![[0.0; 6]; 8 * count],
            held: [0.0; 9],
            modes: Modes::default(),
        })
    }

    /// Which layers are born.
    #[must_use]
    pub fn born(&self) -> &[bool] {
        &self.born
    }

    /// Points in all layers: point 8 l + p is Gauss point p of layer l.
    #[must_use]
    pub fn points(&self) -> usize {
        self.carried.len()
    }

    /// Natural coordinates of a point and its weight, half the layer's natural thickness.
    #[must_use]
    pub fn place(&self, point: usize) -> (DVec3, f64) {
        let (low, high) = (self.cuts[point / 8], self.cuts[point / 8 + 1]);
        let (mut natural, half) = (GAUSS[point % 8], 0.5 * (high - low));
        natural[self.axis] = low + half * (1.0 + natural[self.axis]);
        (natural, half)
    }

    /// Whether the point's layer is born.
    #[must_use]
    pub fn is_born(&self, point: usize) -> bool {
        self.born[point / 8]
    }

    fn live(&self) -> impl Iterator<Item = (usize, DVec3, f64)> + '_ {
        (0..self.points()).filter(|&point| self.is_born(point)).map(|point| {
            let (natural, weight) = self.place(point);
            (point, natural, weight)
        })
    }

    /// Centre of the born part, where the modes have their tops.
    fn shift(&self) -> DVec3 {
        let (mut moment, mut weight) = (0.0, 0.0);
        for (_, natural, w) in self.live() {
            moment += w * natural[self.axis];
            weight += w;
        }
        let mut shift = DVec3::ZERO;
        shift[self.axis] = if weight > 0.0 { moment / weight } else { 0.0 };
        shift
    }

    /// Integrates the born layers with incompatible modes as [`hex8::integrate`] does; the law gets
    /// a point's strain since its birth.
    ///
    /// # Errors
    /// As [`hex8::integrate`].
    pub fn integrate(
        &mut self,
        nodes: &[DVec3; 8],
        u: &[f64; 24],
        mut law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
    ) -> Result<Solid, ElementError> {
        let map = Map::new(nodes, self.shift())?;
        let mut modes = self.modes;
        let solid = hex8::settle(
            &map,
            || self.live(),
            u,
            &mut modes,
            &self.held,
            |point, strain| law(point, &sum(strain, &self.carried[point])),
        )?;
        self.modes = modes;
        Ok(solid)
    }

    /// Strain of a point since its birth.
    ///
    /// # Errors
    /// [`ElementError::Inverted`].
    pub fn strain(
        &self,
        nodes: &[DVec3; 8],
        u: &[f64; 24],
        point: usize,
    ) -> Result<Voigt, ElementError> {
        let rows = Map::new(nodes, self.shift())?.rows(self.place(point).0)?;
        Ok(sum(&rows.strain(u, &self.modes), &self.carried[point]))
    }

    /// A layer is born at displacements `u`; `stress` tells the present stress of the points that
    /// live already. Born twice is born once.
    ///
    /// # Errors
    /// [`ElementError::Inverted`], [`ElementError::NotFinite`].
    pub fn bear(
        &mut self,
        layer: usize,
        nodes: &[DVec3; 8],
        u: &[f64; 24],
        mut stress: impl FnMut(usize) -> Voigt,
    ) -> Result<(), ElementError> {
        if self.born.get(layer).is_none_or(|born| *born) {
            return Ok(());
        }
        let before = Map::new(nodes, self.shift())?;
        let (still, rest) = ([0.0; 24], Modes::default());
        let mut carried = self.carried.clone();
        for (point, natural, _) in self.live() {
            carried[point] =
                sum(&carried[point], &before.rows(natural)?.strain(&still, &self.modes));
        }
        for (point, carried) in carried.iter_mut().enumerate().skip(8 * layer).take(8) {
            *carried = before.rows(self.place(point).0)?.strain(u, &rest).map(|e| -e);
        }
        let older: Vec<_> = self.live().collect();
        let mut grown = Self { carried, modes: rest, ..self.clone() };
        grown.born[layer] = true;
        grown.held = [0.0; 9];
        let after = Map::new(nodes, grown.shift())?;
        for (point, natural, weight) in older {
            let (rows, s) = (after.rows(natural)?, stress(point));
            let volume = weight
                * hex8::right_way_round(hex8::jacobian(nodes, natural).determinant(), point)?;
            for (row, s) in rows.modes.iter().zip(s) {
                grown.held.iter_mut().zip(row).for_each(|(held, g)| *held += volume * g * s);
            }
        }
        if grown.held.iter().chain(grown.carried.as_flattened()).any(|x| !x.is_finite()) {
            return Err(ElementError::NotFinite);
        }
        *self = grown;
        Ok(())
    }
}

fn sum(a: &Voigt, b: &Voigt) -> Voigt {
    std::array::from_fn(|k| a[k] + b[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{
        Bench, bricks, crooked, hooke, noise, off, pick, times, unknowns,
    };
    use crate::element::hex8::{CORNERS, Kind};

    #[test]
    fn all_layers_together_are_the_brick() {
        let nodes = CORNERS
            .map(|c| DVec3::new(2.0 * c.x + 0.3 * c.y, c.y - 0.2 * c.z, 0.5 * c.z + 0.1 * c.x));
        let (c, u) = (hooke(3.0, 0.2), noise(7));
        let whole =
            hex8::integrate(Kind::Incompatible, &nodes, &u, &mut Modes::default(), |_, e| {
                (times(&c, e), c)
            })
            .unwrap();
        for axis in 0..3 {
            let mut layers = Layers::new(axis, vec![-1.0, -0.3, 0.1, 1.0]).unwrap();
            (0..3).for_each(|l| layers.bear(l, &nodes, &[0.0; 24], |_| [0.0; 6]).unwrap());
            let solid = layers.integrate(&nodes, &u, |_, e| (times(&c, e), c)).unwrap();
            assert!(off(solid.stiffness.as_flattened(), whole.stiffness.as_flattened()) < 1e-13);
            assert!(off(&solid.force, &whole.force) < 1e-13);
        }
    }

    /// Constant strain in a crooked brick of which a part is born: modes rest, stress is exact. And
    /// births move nothing.
    #[test]
    fn patch_test_and_still_births() {
        let (nodes, c) = (crooked(), hooke(3.0, 0.2));
        let linear: [f64; 24] = std::array::from_fn(|i| {
            let x = nodes[i / 3];
            [x.x + 0.5 * x.y, 0.2 * x.z - x.y, 0.3 * x.x][i % 3]
        });
        let exact = [1.0, -1.0, 0.0, 0.5, 0.2, 0.3];
        let mut layers = Layers::equal(1, 4).unwrap();
        layers.bear(0, &nodes, &[0.0; 24], |_| [0.0; 6]).unwrap();
        layers.bear(2, &nodes, &[0.0; 24], |_| [0.0; 6]).unwrap();
        let law = |_: usize, e: &Voigt| (times(&c, e), c);
        layers.integrate(&nodes, &linear, law).unwrap();
        assert!(layers.modes.0.iter().all(|m| m.abs() < 1e-13));
        assert!(off(&layers.strain(&nodes, &linear, 3).unwrap(), &exact) < 1e-13);

        let bent = noise(2);
        let before = layers.integrate(&nodes, &bent, law).unwrap();
        let strains: Vec<Voigt> =
            (0..layers.points()).map(|p| layers.strain(&nodes, &bent, p).unwrap()).collect();
        layers.bear(3, &nodes, &bent, |p| times(&c, &strains[p])).unwrap();
        let after = layers.integrate(&nodes, &bent, law).unwrap();
        assert!(off(&after.force, &before.force) < 1e-12);
        for (point, old) in strains.iter().enumerate().filter(|(p, _)| layers.is_born(*p)) {
            let now = layers.strain(&nodes, &bent, point).unwrap();
            let was = if point / 8 == 3 { [0.0; 6] } else { *old };
            assert!((0..6).all(|k| (now[k] - was[k]).abs() < 1e-12));
        }
    }

    /// A bar of four layers under growing shortening, a layer born after each step: the layered
    /// brick, a mesh of four bricks, and R = Σ A_i E (ε − ε_birth,i).
    #[test]
    fn bar_that_grows_under_axial_load_equals_the_refined_mesh() {
        let (e, size, count) = (30e9, DVec3::new(2.0, 0.4, 0.4), 4);
        let c = hooke(e, 0.2);
        let steps = [-1e-4, -3e-4, -4e-4, -9e-4].map(|x| x * size.x);
        let hold = |bench: &mut Bench, nodes: &[DVec3], shortening: f64| {
            for (n, x) in nodes.iter().enumerate() {
                (0..3).filter(|&i| x[i] == 0.0).for_each(|i| bench.fixed[3 * n + i] = Some(0.0));
                if x.x == size.x {
                    bench.fixed[3 * n] = Some(shortening);
                }
            }
        };

        // One layered brick.
        let (nodes, elements) = bricks([1, 1, 1], size);
        let corners = elements[0].map(|n| nodes[n]);
        let places = unknowns::<8, 24>(&elements[0]);
        let law = |_: usize, strain: &Voigt| (times(&c, strain), c);
        let (mut layers, mut u, mut grown) =
            (Layers::equal(2, count).unwrap(), vec![0.0; 24], Vec::new());
        for (layer, shortening) in steps.into_iter().enumerate() {
            let now = layers.clone();
            let at = pick(&u, &places);
            layers
                .bear(layer, &corners, &at, |p| times(&c, &now.strain(&corners, &at, p).unwrap()))
                .unwrap();
            let solid = layers.integrate(&corners, &pick(&u, &places), law).unwrap();
            let mut bench = Bench::new(24);
            bench.add(&places, &solid.stiffness);
            let old = pick(&u, &places);
            let right: [f64; 24] = std::array::from_fn(|r| {
                (0..24).map(|k| solid.stiffness[r][k] * old[k]).sum::<f64>() - solid.force[r]
            });
            bench.push(&places, &right);
            hold(&mut bench, &nodes, shortening);
            u = bench.solve();
            let force = layers.integrate(&corners, &pick(&u, &places), law).unwrap().force;
            let reaction: f64 = (0..24)
                .filter(|k| k % 3 == 0 && corners[k / 3].x == size.x)
                .map(|k| force[k])
                .sum();
            grown.push(reaction);
        }

        // One brick a layer, stresses added step by step.
        let (nodes, elements) = bricks([1, 1, count], size);
        let (mut reaction, mut last) = (0.0, 0.0);
        for (layer, shortening) in steps.into_iter().enumerate() {
            let mut bench = Bench::new(3 * nodes.len());
            let mut solids = Vec::new();
            for element in &elements[..=layer] {
                let solid = hex8::integrate(
                    Kind::Incompatible,
                    &element.map(|n| nodes[n]),
                    &[0.0; 24],
                    &mut Modes::default(),
                    law,
                )
                .unwrap();
                bench.add(&unknowns::<8, 24>(element), &solid.stiffness);
                solids.push((element, solid));
            }
            hold(&mut bench, &nodes, shortening - last);
            (4 * (layer + 2) * 3..bench.fixed.len()).for_each(|i| bench.fixed[i] = Some(0.0));
            let step = bench.solve();
            for (element, solid) in &solids {
                let du = pick(&step, &unknowns::<8, 24>(element));
                for r in (0..24).filter(|r| r % 3 == 0 && nodes[element[r / 3]].x == size.x) {
                    reaction += (0..24).map(|k| solid.stiffness[r][k] * du[k]).sum::<f64>();
                }
            }
            last = shortening;
            let area = size.y * size.z / count as f64;
            let closed: f64 = (0..=layer)
                .map(|l| area * e * (shortening - if l == 0 { 0.0 } else { steps[l - 1] }) / size.x)
                .sum();
            assert!(
                (reaction - closed).abs() < 1e-11 * closed.abs(),
                "mesh {reaction}, closed {closed}"
            );
            assert!(
                (grown[layer] - closed).abs() < 1e-11 * closed.abs(),
                "layered {}, closed {closed}",
                grown[layer]
            );
        }
    }

    /// A cantilever in pure bending, cast in two lifts (ν = 0): each increment bends what is there
    /// about its own axis.
    #[test]
    fn bending_of_a_section_cast_in_two_lifts() {
        let (e, length, width, depth) = (30e9, 2.0, 0.3, 0.8);
        let (nodes, elements) = bricks([1, 1, 1], DVec3::new(length, width, depth));
        let corners = elements[0].map(|n| nodes[n]);
        let places = unknowns::<8, 24>(&elements[0]);
        let c = hooke(e, 0.0);
        let law = |_: usize, strain: &Voigt| (times(&c, strain), c);
        // Axial force and moment about mid depth, on the end's four nodes.
        let pull = |n: f64, m: f64| {
            let mut load = [0.0; 24];
            for a in 0..8 {
                if corners[a].x == length {
                    load[3 * a] =
                        n / 4.0 + m / (2.0 * depth) * (if corners[a].z > 0.0 { 1.0 } else { -1.0 });
                }
            }
            load
        };
        let (mut layers, mut u, mut total) =
            (Layers::equal(2, 2).unwrap(), vec![0.0; 24], [0.0; 24]);
        for (layer, load) in [pull(-1e6, -2e5 + 1e6 * 0.2), pull(0.0, 3e5)].into_iter().enumerate()
        {
            let (now, at) = (layers.clone(), pick(&u, &places));
            layers
                .bear(layer, &corners, &at, |p| times(&c, &now.strain(&corners, &at, p).unwrap()))
                .unwrap();
            total.iter_mut().zip(load).for_each(|(t, l)| *t += l);
            let solid = layers.integrate(&corners, &at, law).unwrap();
            let mut bench = Bench::new(24);
            bench.add(&places, &solid.stiffness);
            bench.push(&places, &std::array::from_fn(|r| total[r] - solid.force[r]));
            for a in 0..8 {
                (0..3)
                    .filter(|&i| i == 1 || corners[a].x == 0.0)
                    .for_each(|i| bench.fixed[places[3 * a + i]] = Some(0.0));
            }
            u.iter_mut().zip(bench.solve()).for_each(|(u, du)| *u += du);
            layers.integrate(&corners, &pick(&u, &places), law).unwrap();
        }
        // First lift: N = −1 MN at z = 0.2 (its own axis) and M = −0.2 MNm; then M = 0.3 MNm on the
        // whole.
        let at = pick(&u, &places);
        for point in 0..layers.points() {
            let z = 0.5 * depth * (1.0 + layers.place(point).0.z);
            let whole = 3e5 * (z - 0.4) / (width * depth.powi(3) / 12.0);
            let first = if point < 8 {
                -1e6 / (width * 0.4) - 2e5 * (z - 0.2) / (width * 0.4f64.powi(3) / 12.0)
            } else {
                0.0
            };
            let stress = e * layers.strain(&corners, &at, point).unwrap()[0];
            assert!(
                (stress - first - whole).abs() < 1e-9 * 1e7,
                "point {point}: {stress} for {}",
                first + whole
            );
        }
    }

    #[test]
    fn cuts_must_rise_from_end_to_end() {
        assert!(
            Layers::equal(3, 2).is_none()
                && Layers::equal(0, 0).is_none()
                && Layers::new(0, vec![]).is_none()
        );
        assert!(
            Layers::new(0, vec![-1.0, 0.5, 0.5, 1.0]).is_none()
                && Layers::new(0, vec![-1.0, f64::NAN, 1.0]).is_none()
        );
    }
}
