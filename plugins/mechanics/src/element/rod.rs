//! Bars: two nodes of their own, or embedded in a brick (with [`super::embed`]), bonded to it or
//! slipping along it.
//!
//! An embedded piece follows its host, u_end = Σ N_a(ξ_end) u_a, so its axial strain is a row over
//! the host's 24 unknowns. With slip, each end gets one unknown more, how far the bar has moved
//! ahead of the concrete along its own direction; the bond stress τ(s) acts between them. Prestress
//! is an initial stress in the law. As the shape functions reproduce any rigid motion, a piece's
//! forces on its host balance exactly, turn by turn.

use super::{Element, ElementError, hex8};
use glam::DVec3;

/// A straight bar between two nodes (T3D2); `law(strain)` answers stress and tangent (Pa). The area
/// is that of the steel (m²).
///
/// # Errors
/// [`ElementError::Degenerate`] without length, [`ElementError::NotFinite`].
pub(crate) fn rod(
    nodes: &[DVec3; 2],
    u: &[f64; 6],
    area: f64,
    law: impl FnOnce(f64) -> (f64, f64),
) -> Result<Element<6>, ElementError> {
    let (along, length) = direction(nodes)?;
    let row: [f64; 6] =
        std::array::from_fn(|c| if c < 3 { -along[c] } else { along[c - 3] } / length);
    let mut element = Element::zero();
    let (stress, tangent) = law(product(&row, u));
    element.add(&[row], &[stress], &[[tangent]], area * length);
    element.finite()
}

/// A straight piece of a bar within one brick.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// The brick that it lies in.
    pub host: usize,
    /// The segment of the polyline that it is part of.
    pub segment: usize,
    /// Its ends (m).
    pub ends: [DVec3; 2],
    /// Their natural coordinates in the host.
    pub natural: [DVec3; 2],
    /// Their distance from the bar's start along the polyline (m).
    pub along: [f64; 2],
}

impl Piece {
    /// Its length (m).
    #[must_use]
    pub fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    /// Strain over the host's unknowns (1/m): t·Σ (N_a(ξ₂) − N_a(ξ₁)) u_a / L.
    ///
    /// # Errors
    /// [`ElementError::Degenerate`] without length.
    pub(crate) fn strain_row(&self) -> Result<[f64; 24], ElementError> {
        let (along, length) = direction(&self.ends)?;
        let [first, second] = self.natural.map(hex8::shape);
        Ok(std::array::from_fn(|c| (second[c / 3] - first[c / 3]) * along[c % 3] / length))
    }

    /// Adds the bonded piece to stiffness (24 × 24, by rows) and force of its host, one point (the
    /// strain is constant). `law(strain)` answers stress, initial stress included, and tangent (Pa).
    ///
    /// # Errors
    /// As [`rod`].
    pub(crate) fn add_bonded(
        &self,
        u: &[f64; 24],
        area: f64,
        law: impl FnOnce(f64) -> (f64, f64),
        [k, f]: [&mut [f64]; 2],
    ) -> Result<(), ElementError> {
        let row = self.strain_row()?;
        let (stress, tangent) = law(product(&row, u));
        let volume = area * self.length();
        if !(volume * stress).is_finite() || !(volume * tangent).is_finite() {
            return Err(ElementError::NotFinite);
        }
        for ((force, stiffness), r) in f.iter_mut().zip(k.chunks_exact_mut(24)).zip(&row) {
            *force += volume * stress * r;
            let by = volume * tangent * r;
            stiffness.iter_mut().zip(&row).for_each(|(k, c)| *k += by * c);
        }
        Ok(())
    }

    /// The same alone.
    #[cfg(test)]
    fn bonded(
        &self,
        u: &[f64; 24],
        area: f64,
        law: impl FnOnce(f64) -> (f64, f64),
    ) -> Result<Element<24>, ElementError> {
        let mut element = Element::zero();
        let both = [element.stiffness.as_flattened_mut(), &mut element.force[..]];
        self.add_bonded(u, area, law, both)?;
        Ok(element)
    }

    /// The piece with slip: the host's 24 unknowns, then the slips s₁, s₂ of its ends (m, positive
    /// along the polyline). The bar strains by (s₂ − s₁)/L more than its host. `bond(end, slip)`
    /// answers bond stress τ and dτ/ds (Pa, Pa/m) and is integrated at the ends, each with half the
    /// surface, because points inside make stiff bond oscillate. An anchored end has its slip fixed
    /// at 0.
    ///
    /// # Errors
    /// As [`rod`].
    pub(crate) fn slipping(
        &self,
        unknowns: &[f64; 26],
        area: f64,
        perimeter: f64,
        law: impl FnOnce(f64) -> (f64, f64),
        mut bond: impl FnMut(usize, f64) -> (f64, f64),
    ) -> Result<Element<26>, ElementError> {
        let (length, host) = (self.length(), self.strain_row()?);
        let row: [f64; 26] =
            std::array::from_fn(
                |c| if c < 24 { host[c] } else { (2.0 * c as f64 - 49.0) / length },
            );
        let (stress, tangent) = law(product(&row, unknowns));
        let mut element = Element::zero();
        element.add(&[row], &[stress], &[[tangent]], area * length);
        for end in 0..2 {
            let (stress, slope) = bond(end, unknowns[24 + end]);
            element.force[24 + end] += 0.5 * perimeter * length * stress;
            element.stiffness[24 + end][24 + end] += 0.5 * perimeter * length * slope;
        }
        element.finite()
    }
}

fn direction(ends: &[DVec3; 2]) -> Result<(DVec3, f64), ElementError> {
    let step = ends[1] - ends[0];
    let length = step.length();
    if length > 0.0 && length.is_finite() {
        Ok((step / length, length))
    } else {
        Err(ElementError::Degenerate { point: 0 })
    }
}

fn product<const N: usize>(row: &[f64; N], u: &[f64; N]) -> f64 {
    row.iter().zip(u).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{
        Bench, bricks, crooked, differences, hooke, noise, off, pick, times, unknowns,
    };
    use crate::element::embed::{brute, embed};
    use crate::element::hex8::{Kind, Modes, integrate};

    fn piece() -> (Piece, [DVec3; 8]) {
        let nodes = crooked();
        let natural = [DVec3::new(-1.0, 0.2, -0.4), DVec3::new(0.3, 1.0, 0.7)];
        let ends = natural.map(|x| hex8::position(&nodes, x));
        (
            Piece { host: 0, segment: 0, ends, natural, along: [0.0, ends[0].distance(ends[1])] },
            nodes,
        )
    }

    /// Prestress by itself pulls at nothing: force and moment of a piece on its host vanish.
    #[test]
    fn prestress_is_self_equilibrating() {
        let (piece, nodes) = piece();
        let force = piece.bonded(&[0.0; 24], 1e-3, |_| (1.2e9, 195e9)).unwrap().force;
        let forces: Vec<DVec3> = force.chunks_exact(3).map(DVec3::from_slice).collect();
        let total: DVec3 = forces.iter().copied().sum();
        let moment: DVec3 = forces.iter().zip(&nodes).map(|(f, x)| x.cross(*f)).sum();
        assert!(
            total.length() < 1e-14 * 1.2e6 && moment.length() < 1e-14 * 1.2e6 * 4.0,
            "{total} {moment}"
        );
        // Virtual work in a uniform stretch ε = 1: T L.
        let work: f64 = forces.iter().zip(&nodes).map(|(f, x)| f.dot(*x)).sum();
        assert!((work - 1.2e6 * piece.length()).abs() < 1e-12 * work);
    }

    #[test]
    fn tangents_by_differences() {
        let (piece, _) = piece();
        let steel = |e: f64| (300.0 + 200.0 * e - 900.0 * e * e * e, 200.0 - 2700.0 * e * e);
        let bond = |_: usize, s: f64| (5.0 * s.tanh(), 5.0 / s.cosh().powi(2));
        let u: [f64; 26] = noise::<26>(4).map(|x| 0.3 * x);
        let element = piece.slipping(&u, 0.2, 0.7, steel, bond).unwrap();
        let slope =
            differences(&u, 1e-5, |u| piece.slipping(u, 0.2, 0.7, steel, bond).unwrap().force);
        assert!(off(element.stiffness.as_flattened(), slope.as_flattened()) < 1e-8);
        let (nodes, u) = ([DVec3::ZERO, DVec3::new(1.0, 2.0, 2.0)], noise::<6>(5));
        let element = rod(&nodes, &u, 0.2, steel).unwrap();
        let slope = differences(&u, 1e-5, |u| rod(&nodes, u, 0.2, steel).unwrap().force);
        assert!(off(element.stiffness.as_flattened(), slope.as_flattened()) < 1e-8);
        assert!(rod(&[DVec3::ONE; 2], &u, 0.2, steel).is_err());
    }

    /// Bars stiffen a block as springs in parallel: (E A + E_s A_s) ε = N, whatever the mesh.
    #[test]
    fn bonded_bar_shares_the_strain() {
        let (nodes, elements) = bricks([3, 2, 2], DVec3::new(3.0, 1.0, 1.0));
        let host = |n: usize| elements[n].map(|i| nodes[i]);
        let bar = [DVec3::new(0.0, 0.5, 0.5), DVec3::new(3.0, 0.5, 0.5)];
        let pieces = embed(&bar, brute(&nodes, &elements), host).unwrap();
        let (e, es, area) = (30e9, 200e9, 0.02);
        let c = hooke(e, 0.0);
        let mut bench = Bench::new(3 * nodes.len());
        for (n, element) in elements.iter().enumerate() {
            let solid = integrate(
                Kind::Incompatible,
                &host(n),
                &[0.0; 24],
                &mut Modes::default(),
                |_, s| (times(&c, s), c),
            )
            .unwrap();
            bench.add(&unknowns::<8, 24>(element), &solid.stiffness);
        }
        let steel = |e: f64| (es * e, es);
        for piece in &pieces {
            bench.add(
                &unknowns::<8, 24>(&elements[piece.host]),
                &piece.bonded(&[0.0; 24], area, steel).unwrap().stiffness,
            );
        }
        for (n, x) in nodes.iter().enumerate() {
            (1..3).filter(|&i| x[i] == 0.0).for_each(|i| bench.fixed[3 * n + i] = Some(0.0));
            if x.x == 0.0 || x.x == 3.0 {
                bench.fixed[3 * n] = Some(1e-3 * x.x);
            }
        }
        let u = bench.solve();
        let mut pull = 0.0;
        for (n, element) in elements.iter().enumerate() {
            let places = unknowns::<8, 24>(element);
            let at = pick(&u, &places);
            let mut force =
                integrate(Kind::Incompatible, &host(n), &at, &mut Modes::default(), |_, s| {
                    (times(&c, s), c)
                })
                .unwrap()
                .force;
            for piece in pieces.iter().filter(|p| p.host == n) {
                force
                    .iter_mut()
                    .zip(piece.bonded(&at, area, steel).unwrap().force)
                    .for_each(|(f, p)| *f += p);
            }
            pull += (0..24)
                .filter(|k| k % 3 == 0 && nodes[element[k / 3]].x == 3.0)
                .map(|k| force[k])
                .sum::<f64>();
        }
        let exact = 1e-3 * (e + es * area);
        assert!((pull - exact).abs() < 1e-10 * exact, "{pull} for {exact}");
    }

    /// Ring prestress (research: 8 × 140 mm² at 1100 MPa, R 3.125, s 0.5, r_i 2.75, t 0.55): p =
    /// T/(R s) = 0.78848 MPa by the virtual work of a uniform expansion, mean hoop stress −T/(s t)
    /// = −4.480 MPa in the solved ring.
    #[test]
    fn circular_tendon_squeezes_a_ring() {
        let (tension, radius, spacing, inner, thick) =
            (8.0 * 140e-6 * 1100e6, 3.125, 0.5, 2.75, 0.55);
        let (around, across) = (24, 4);
        let quarter = std::f64::consts::FRAC_PI_2;
        let (flat, elements) = bricks([across, around, 1], DVec3::new(thick, quarter, spacing));
        let nodes: Vec<DVec3> = flat
            .iter()
            .map(|x| DVec3::new((inner + x.x) * x.y.cos(), (inner + x.x) * x.y.sin(), x.z))
            .collect();
        let host = |n: usize| elements[n].map(|i| nodes[i]);
        // Ends on the chord of the outermost facets' planes of symmetry; vertices at the mesh's
        // radial planes and halfway.
        let bar: Vec<DVec3> = (0..=around)
            .map(|i| quarter * i as f64 / around as f64)
            .map(|a| DVec3::new(radius * a.cos(), radius * a.sin(), 0.25))
            .collect();
        let pieces = embed(&bar, brute(&nodes, &elements), host).unwrap();
        let (mut work, mut length) = (0.0, 0.0);
        let c = hooke(34.5e9, 0.2);
        let mut bench = Bench::new(3 * nodes.len());
        for (n, element) in elements.iter().enumerate() {
            let solid = integrate(
                Kind::Incompatible,
                &host(n),
                &[0.0; 24],
                &mut Modes::default(),
                |_, s| (times(&c, s), c),
            )
            .unwrap();
            bench.add(&unknowns::<8, 24>(element), &solid.stiffness);
        }
        for piece in &pieces {
            let force = piece.bonded(&[0.0; 24], 1.0, |_| (tension, 0.0)).unwrap().force;
            work += (0..24)
                .filter(|k| k % 3 < 2)
                .map(|k| force[k] * nodes[elements[piece.host][k / 3]][k % 3])
                .sum::<f64>();
            length += piece.length();
            bench.push(&unknowns::<8, 24>(&elements[piece.host]), &force.map(|f| -f));
        }
        assert!((length - quarter * radius).abs() < 2e-4 * length);
        // Work of p on the cylinder of radius R moved by u = x: p R · (R π/2) s.
        let pressure = work / (radius * radius * quarter * spacing);
        assert!((pressure - 0.78848e6).abs() < 5e-4 * 0.78848e6, "{pressure}");
        for (n, (x, flat)) in nodes.iter().zip(&flat).enumerate() {
            if flat.y == 0.0 {
                bench.fixed[3 * n + 1] = Some(0.0);
            }
            if (flat.y - quarter).abs() < 1e-12 {
                bench.fixed[3 * n] = Some(0.0);
            }
            if x.z == 0.0 {
                bench.fixed[3 * n + 2] = Some(0.0);
            }
        }
        let u = bench.solve();
        let (mut hoop, mut volume) = (0.0, 0.0);
        for (n, element) in elements.iter().enumerate() {
            let corners = host(n);
            let at = pick(&u, &unknowns::<8, 24>(element));
            let mut modes = Modes::default();
            integrate(Kind::Incompatible, &corners, &at, &mut modes, |_, s| (times(&c, s), c))
                .unwrap();
            for natural in hex8::GAUSS {
                let stress = times(
                    &c,
                    &hex8::rows(Kind::Incompatible, &corners, natural).unwrap().strain(&at, &modes),
                );
                let x = hex8::position(&corners, natural);
                let (cos, sin) = (x.x / x.x.hypot(x.y), x.y / x.x.hypot(x.y));
                let weight = hex8::jacobian(&corners, natural).determinant() / x.x.hypot(x.y);
                hoop += weight
                    * (stress[0] * sin * sin + stress[1] * cos * cos - 2.0 * stress[3] * sin * cos);
                volume += weight;
            }
        }
        assert!((hoop / volume + 4.480e6).abs() < 3e-3 * 4.480e6, "{}", hoop / volume);
    }

    /// Pull-out from rigid concrete with linear bond τ = k s: E A s″ = k U s, so F = √(E A k U)
    /// tanh(λ L) s(L), λ² = k U/(E A). The error falls with h².
    #[test]
    fn pull_out_of_a_slipping_bar() {
        let (e, area, perimeter, k, length) = (200e9f64, 2.01e-4, 0.0503, 1e10, 0.4);
        let lambda = (k * perimeter / (e * area)).sqrt();
        let exact = (e * area * k * perimeter).sqrt() * (lambda * length).tanh();
        let error = |count: usize| {
            let (nodes, elements) = bricks([count, 1, 1], DVec3::new(length, 0.1, 0.1));
            let bar = [DVec3::new(0.0, 0.03, 0.06), DVec3::new(length, 0.03, 0.06)];
            let pieces =
                embed(&bar, brute(&nodes, &elements), |n| elements[n].map(|i| nodes[i])).unwrap();
            assert_eq!(pieces.len(), count);
            let mut bench = Bench::new(count + 1);
            let mut last = [[0.0; 2]; 2];
            for (n, piece) in pieces.iter().enumerate() {
                let full = piece
                    .slipping(&[0.0; 26], area, perimeter, |s| (e * s, e), |_, s| (k * s, k))
                    .unwrap()
                    .stiffness;
                last = [[full[24][24], full[24][25]], [full[25][24], full[25][25]]];
                bench.add(&[n, n + 1], &last);
            }
            bench.fixed[count] = Some(1e-4);
            let s = bench.solve();
            let force = last[1][0] * s[count - 1] + last[1][1] * s[count];
            (force / 1e-4 - exact).abs() / exact
        };
        let (coarse, fine) = (error(20), error(40));
        assert!(fine < 2e-3 && (coarse / fine - 4.0).abs() < 0.3, "{coarse} {fine}");
    }
}
