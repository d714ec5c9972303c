//! Symmetric tensors as six numbers: xx, yy, zz, xy, yz, zx.
//!
//! Stress holds its components as they are, strain holds engineering shear γ = 2ε, so that stress ·
//! strain (the plain scalar product of six numbers) is work per volume. Functions that need to know
//! which of the two they get say so in their name.

/// Stress (Pa) or strain (engineering shear, γ = 2ε) in the order xx, yy, zz, xy, yz, zx.
pub(crate) type Voigt = [f64; 6];

/// ∂stress/∂strain, row = stress component.
pub(crate) type Tangent = [[f64; 6]; 6];

/// Three orthonormal axes as rows, such as r, θ, z.
pub(crate) type Frame = [[f64; 3]; 3];

/// Nothing.
pub(crate) const ZERO: Voigt = [0.0; 6];

/// The axes of each of the six components.
const AXES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

/// a + b.
#[must_use]
pub(crate) fn add(a: &Voigt, b: &Voigt) -> Voigt {
    std::array::from_fn(|i| a[i] + b[i])
}

/// a − b.
#[must_use]
pub(crate) fn sub(a: &Voigt, b: &Voigt) -> Voigt {
    std::array::from_fn(|i| a[i] - b[i])
}

/// a · s.
#[must_use]
pub(crate) fn scale(a: &Voigt, s: f64) -> Voigt {
    a.map(|x| x * s)
}

/// tangent · s.
#[must_use]
pub(crate) fn scale_tangent(mut tangent: Tangent, s: f64) -> Tangent {
    tangent.as_flattened_mut().iter_mut().for_each(|c| *c *= s);
    tangent
}

/// Stress · strain: work per volume, J/m³.
#[must_use]
pub(crate) fn dot(stress: &Voigt, strain: &Voigt) -> f64 {
    stress.iter().zip(strain).map(|(a, b)| a * b).sum()
}

/// Tangent times strain, or compliance times stress.
#[must_use]
pub(crate) fn apply(tangent: &Tangent, v: &Voigt) -> Voigt {
    std::array::from_fn(|i| dot(&tangent[i], v))
}

/// The same number in all three directions: strain of free swelling, or hydrostatic stress.
#[must_use]
pub(crate) fn isotropic(value: f64) -> Voigt {
    [value, value, value, 0.0, 0.0, 0.0]
}

/// Hooke's law, stress = C · strain, for modulus `e` (Pa) and Poisson's ratio `nu`.
#[must_use]
pub(crate) fn stiffness(e: f64, nu: f64) -> Tangent {
    let mu = e / (2.0 * (1.0 + nu));
    let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    block(lambda + 2.0 * mu, lambda, mu)
}

/// Its stress of a strain.
#[must_use]
pub(crate) fn elastic_stress(e: f64, nu: f64, strain: &Voigt) -> Voigt {
    let mu = e / (2.0 * (1.0 + nu));
    let pressure = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) * i1(strain);
    let [x, y, z, xy, yz, zx] = *strain;
    let normal = |e: f64| pressure + 2.0 * mu * e;
    [normal(x), normal(y), normal(z), mu * xy, mu * yz, mu * zx]
}

/// Its strain of a stress, the inverse.
#[must_use]
pub(crate) fn elastic_strain(e: f64, nu: f64, stress: &Voigt) -> Voigt {
    let (across, shear) = (nu * i1(stress), 2.0 * (1.0 + nu));
    let [x, y, z, xy, yz, zx] = *stress;
    let normal = |s: f64| (1.0 + nu) * s - across;
    scale(&[normal(x), normal(y), normal(z), shear * xy, shear * yz, shear * zx], 1.0 / e)
}

/// The inverse of [`stiffness`], strain = C⁻¹ · stress.
#[must_use]
#[cfg(test)]
pub(crate) fn compliance(e: f64, nu: f64) -> Tangent {
    block(1.0 / e, -nu / e, 2.0 * (1.0 + nu) / e)
}

fn block(diagonal: f64, beside: f64, shear: f64) -> Tangent {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match (i, j) {
            _ if i < 3 && j < 3 => [beside, diagonal][usize::from(i == j)],
            _ if i == j => shear,
            _ => 0.0,
        })
    })
}

/// I₁, the sum of the normal components.
#[must_use]
pub(crate) fn i1(v: &Voigt) -> f64 {
    v[0] + v[1] + v[2]
}

/// J₂ = ½ s:s of the deviator s of a stress.
#[must_use]
pub(crate) fn j2_of_stress(s: &Voigt) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    normal / 6.0 + s[3] * s[3] + s[4] * s[4] + s[5] * s[5]
}

/// J₂ = ½ e:e of the deviator e of a strain.
#[must_use]
pub(crate) fn j2_of_strain(e: &Voigt) -> f64 {
    let normal = (e[0] - e[1]).powi(2) + (e[1] - e[2]).powi(2) + (e[2] - e[0]).powi(2);
    normal / 6.0 + 0.25 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
}

/// Von Mises' equivalent stress √(3 J₂).
#[must_use]
pub fn von_mises(stress: &Voigt) -> f64 {
    (3.0 * j2_of_stress(stress)).sqrt()
}

/// Principal values, largest first, and their directions as rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Largest (most tensile) first.
    pub values: [f64; 3],
    /// Row i belongs to value i; orthonormal.
    pub directions: Frame,
}

impl Principal {
    /// Principal stresses.
    #[must_use]
    pub fn of_stress(s: &Voigt) -> Self {
        Self::of(s, 1.0)
    }

    /// Principal strains.
    #[must_use]
    pub(crate) fn of_strain(e: &Voigt) -> Self {
        Self::of(e, 0.5)
    }

    /// A tensor that is not finite has no principal values: what it gets is not finite either, so
    /// that the caller sees what is wrong with it.
    fn of(v: &Voigt, shear: f64) -> Self {
        let (xy, yz, zx) = (shear * v[3], shear * v[4], shear * v[5]);
        let (values, rows) = rotated([[v[0], xy, zx], [xy, v[1], yz], [zx, yz, v[2]]]);
        let mut order = [0, 1, 2];
        // Three exchanges sort three.
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if values[order[i]].total_cmp(&values[order[j]]).is_lt() {
                order.swap(i, j);
            }
        }
        Self { values: order.map(|i| values[i]), directions: order.map(|i| rows[i]) }
    }

    /// The stress with these principal values and directions.
    #[must_use]
    pub(crate) fn as_stress(&self) -> Voigt {
        let mut stress = ZERO;
        for (value, n) in self.values.iter().zip(&self.directions) {
            for (s, (a, b)) in stress.iter_mut().zip(AXES) {
                *s += value * n[a] * n[b];
            }
        }
        stress
    }

    /// The strain with these principal values and directions.
    #[must_use]
    pub(crate) fn as_strain(&self) -> Voigt {
        double_shear(self.as_stress())
    }
}

/// Eigenvalues and, as rows, eigenvectors by Jacobi's rotations (Golub and Van Loan 2013, § 8.5):
/// for three by three twice as fast as by tridiagonal form, and as exact.
fn rotated(mut a: [[f64; 3]; 3]) -> ([f64; 3], Frame) {
    /// Convergence is quadratic: three or four do.
    const SWEEPS: usize = 12;
    /// What another sweep would turn by less than rounding.
    const NEGLIGIBLE: f64 = 1e-18;
    let mut rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off.is_nan() || off <= NEGLIGIBLE * (a[0][0].abs() + a[1][1].abs() + a[2][2].abs()) {
            break;
        }
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            a[p][p] -= t * a[p][q];
            a[q][q] += t * a[p][q];
            let (x, y) = (a[p][r], a[q][r]);
            (a[p][r], a[q][r]) = (c * x - s * y, s * x + c * y);
            (a[r][p], a[r][q]) = (a[p][r], a[q][r]);
            (a[p][q], a[q][p]) = (0.0, 0.0);
            let (x, y) = (rows[p], rows[q]);
            (rows[p], rows[q]) = (
                std::array::from_fn(|k| c * x[k] - s * y[k]),
                std::array::from_fn(|k| s * x[k] + c * y[k]),
            );
        }
    }
    ([a[0][0], a[1][1], a[2][2]], rows)
}

fn double_shear(v: Voigt) -> Voigt {
    [v[0], v[1], v[2], 2.0 * v[3], 2.0 * v[4], 2.0 * v[5]]
}

fn halve_shear(v: &Voigt) -> Voigt {
    [v[0], v[1], v[2], 0.5 * v[3], 0.5 * v[4], 0.5 * v[5]]
}

/// The axes that [`rotate_stress`] needs to go back.
#[must_use]
pub(crate) fn transposed(frame: &Frame) -> Frame {
    std::array::from_fn(|i| std::array::from_fn(|j| frame[j][i]))
}

/// Components of a stress along the axes of `frame`: σ′ = Q σ Qᵀ.
#[must_use]
pub fn rotate_stress(stress: &Voigt, frame: &Frame) -> Voigt {
    let [xx, yy, zz, xy, yz, zx] = *stress;
    let half = frame.map(|[x, y, z]| {
        [x * xx + y * xy + z * zx, x * xy + y * yy + z * yz, x * zx + y * yz + z * zz]
    });
    let mut turned = ZERO;
    for (s, (i, j)) in turned.iter_mut().zip(AXES) {
        *s = half[i][0] * frame[j][0] + half[i][1] * frame[j][1] + half[i][2] * frame[j][2];
    }
    turned
}

/// Components of a strain along the axes of `frame`.
#[must_use]
pub(crate) fn rotate_strain(strain: &Voigt, frame: &Frame) -> Voigt {
    double_shear(rotate_stress(&halve_shear(strain), frame))
}

/// A tangent given along the axes of `frame`, in the world's axes: Tᵀ C T, where T turns strain
/// into the frame (Bond's matrix).
#[must_use]
pub(crate) fn rotate_tangent(local: &Tangent, frame: &Frame) -> Tangent {
    let mut turn = [ZERO; 6];
    for (row, (i, j)) in turn.iter_mut().zip(AXES) {
        let (a, b) = (frame[i], frame[j]);
        let shear = if i == j { 1.0 } else { 2.0 };
        for (t, (m, n)) in row.iter_mut().zip(AXES) {
            *t = 0.5 * shear * (a[m] * b[n] + a[n] * b[m]);
        }
    }
    // Rows of C T, then of Tᵀ (C T).
    let (mut product, mut world) = ([ZERO; 6], [ZERO; 6]);
    for (row, weights) in product.iter_mut().zip(local) {
        weights.iter().zip(&turn).for_each(|(w, turn)| add_times(row, *w, turn));
    }
    for (weights, product) in turn.iter().zip(&product) {
        world.iter_mut().zip(weights).for_each(|(row, w)| add_times(row, *w, product));
    }
    world
}

/// sum += weight · row.
fn add_times(sum: &mut Voigt, weight: f64, row: &Voigt) {
    sum.iter_mut().zip(row).for_each(|(s, r)| *s += weight * r);
}

/// Axes r, θ, z at `point` of the cylinder around the line through `origin` along `axis`. On that
/// line r is any direction across it.
#[must_use]
pub fn cylindrical(point: [f64; 3], origin: [f64; 3], axis: [f64; 3]) -> Frame {
    let inner = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let along =
        |a: [f64; 3], b: [f64; 3], s: f64| -> [f64; 3] { std::array::from_fn(|i| a[i] + s * b[i]) };
    let unit = |a: [f64; 3]| a.map(|x| x / inner(a, a).sqrt());
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let z = unit(axis);
    let arm = along(point, origin, -1.0);
    let mut across = along(arm, z, -inner(arm, z));
    if inner(across, across) <= 1e-24 * inner(arm, arm).max(f64::MIN_POSITIVE) {
        let thinnest = (0..3).min_by(|&a, &b| z[a].abs().total_cmp(&z[b].abs())).unwrap_or(0);
        let mut e = [0.0; 3];
        e[thinnest] = 1.0;
        across = along(e, z, -z[thinnest]);
    }
    let r = unit(across);
    [r, cross(z, r), z]
}

/// An equivalent strain and its derivative by the strain.
pub(crate) type Equivalent = (f64, Voigt);

/// Principal stresses, largest first, without directions: roots of the characteristic polynomial by
/// the angle of its three real ones (Smith 1961); exact to the square root of rounding.
#[must_use]
pub(crate) fn principals(s: &Voigt) -> [f64; 3] {
    let mean = i1(s) / 3.0;
    let [a, b, c] = [s[0] - mean, s[1] - mean, s[2] - mean];
    let [xy, yz, zx] = [s[3], s[4], s[5]];
    let size = ((a * a + b * b + c * c) / 6.0 + (xy * xy + yz * yz + zx * zx) / 3.0).sqrt();
    if size <= 0.0 {
        return [mean; 3];
    }
    let det = a * (b * c - yz * yz) - xy * (xy * c - yz * zx) + zx * (xy * yz - b * zx);
    let angle = (0.5 * det / size.powi(3)).clamp(-1.0, 1.0).acos() / 3.0;
    let [most, least] =
        [0.0, 2.0].map(|k| mean + 2.0 * size * (angle + k * std::f64::consts::FRAC_PI_3).cos());
    [most, 3.0 * mean - most - least, least]
}

/// The largest and the least of them.
#[must_use]
pub(crate) fn extreme_principals(s: &Voigt) -> [f64; 2] {
    let [most, _, least] = principals(s);
    [most, least]
}

/// Modified von Mises equivalent strain (de Vree, Brekelmans and van Gils 1995) with `k` = f_c/f_t:
/// (k−1)I₁/(2k(1−2ν)) + √(((k−1)I₁/(1−2ν))² + 12k J₂/(1+ν)²)/(2k). It is ε in uniaxial tension
/// and |ε|/k in uniaxial compression.
#[must_use]
pub(crate) fn modified_von_mises(strain: &Voigt, k: f64, nu: f64) -> Equivalent {
    let a = (k - 1.0) / (1.0 - 2.0 * nu);
    let b = 12.0 * k / (1.0 + nu).powi(2);
    let i = i1(strain);
    let root = (a * a * i * i + b * j2_of_strain(strain)).sqrt();
    if root <= 0.0 {
        return (0.0, ZERO);
    }
    let mean = i / 3.0;
    let by_i1 = (a + a * a * i / root) / (2.0 * k);
    let by_j2 = b / (4.0 * k * root);
    let derivative = std::array::from_fn(|c| match c {
        0..3 => by_i1 + by_j2 * (strain[c] - mean),
        _ => by_j2 * 0.5 * strain[c],
    });
    ((a * i + root) / (2.0 * k), derivative)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use intrados_stage::random::Key;

    #[test]
    fn elastic_stress_and_strain_are_those_of_the_matrices() {
        for walk in 0..20 {
            let (e, nu, v) = (30e9, 0.2, random(walk, 1e-3));
            let stress = elastic_stress(e, nu, &v);
            assert!(largest(&sub(&stress, &apply(&stiffness(e, nu), &v))) < 1e-12 * e * 1e-3);
            assert!(largest(&sub(&elastic_strain(e, nu, &stress), &v)) < 1e-15);
            assert!(largest(&sub(&apply(&compliance(e, nu), &stress), &v)) < 1e-15);
        }
    }

    #[test]
    fn the_least_principal_stress_is_that_of_the_axes() {
        for walk in 0..1000 {
            let stress = random(walk, 1e7);
            let least = Principal::of_stress(&stress).values[2];
            assert!((extreme_principals(&stress)[1] - least).abs() < 1e-6, "{stress:?}");
        }
        for (stress, least) in [
            ([-3.0, -3.0, -3.0, 0.0, 0.0, 0.0], -3.0),
            ([1.0, 1.0, -2.0, 0.0, 0.0, 0.0], -2.0),
            ([5.0, -1.0, -1.0, 0.0, 0.0, 0.0], -1.0),
        ] {
            assert!((extreme_principals(&stress)[1] - least).abs() < 1e-7, "{stress:?}");
        }
    }

    /// A tensor of random components within ±`size`.
    pub(crate) fn random(walk: u64, size: f64) -> Voigt {
        let key = Key::new(7, walk);
        std::array::from_fn(|i| size * (2.0 * key.unit64(i as u32) - 1.0))
    }

    pub(crate) fn largest(v: &Voigt) -> f64 {
        v.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    }

    #[test]
    fn compliance_inverts_stiffness() {
        let (c, s) = (stiffness(3e10, 0.2), compliance(3e10, 0.2));
        for walk in 0..100 {
            let e = random(walk, 1e-3);
            assert!(largest(&sub(&apply(&s, &apply(&c, &e)), &e)) < 1e-17);
        }
    }

    #[test]
    fn principal_values_rebuild_the_tensor_even_when_they_coincide() {
        let mut cases: Vec<Voigt> = (0..500).map(|w| random(w, 1e-3)).collect();
        cases.push(isotropic(2e-3));
        cases.push([1e-3, 1e-3, -1e-3, 0.0, 0.0, 0.0]);
        cases.push([1e-3, 1e-3, 1e-3, 1e-19, 0.0, -1e-22]);
        cases.push([1.0, 1e-12, -1e-12, 1e-14, 1e-13, 1e-15]);
        cases.push([0.0, 0.0, 0.0, 1e-3, 0.0, 0.0]);
        cases.push(ZERO);
        for e in cases {
            let p = Principal::of_strain(&e);
            assert!(p.values[0] >= p.values[1] && p.values[1] >= p.values[2]);
            assert!(largest(&sub(&p.as_strain(), &e)) <= 1e-14 * largest(&e), "{e:?}");
            for i in 0..3 {
                for j in 0..3 {
                    let inner: f64 = (0..3).map(|a| p.directions[i][a] * p.directions[j][a]).sum();
                    assert!(
                        (inner - f64::from(u8::from(i == j))).abs() < 1e-13,
                        "{e:?} {i} {j} {inner}"
                    );
                }
            }
        }
        assert!(Principal::of_stress(&[f64::NAN; 6]).values[0].is_nan());
    }

    #[test]
    fn rotation_keeps_invariants_work_and_comes_back() {
        for walk in 0..100 {
            let (s, e) = (random(walk, 1e6), random(walk + 1000, 1e-3));
            let p = random(walk + 2000, 5.0);
            let frame = cylindrical([p[0], p[1], p[2]], [0.1, 0.2, 0.3], [p[3], p[4], 1.0]);
            let (sr, er) = (rotate_stress(&s, &frame), rotate_strain(&e, &frame));
            assert!(
                (i1(&sr) - i1(&s)).abs() < 1e-6
                    && (j2_of_stress(&sr) / j2_of_stress(&s) - 1.0).abs() < 1e-12
            );
            assert!((j2_of_strain(&er) / j2_of_strain(&e) - 1.0).abs() < 1e-12);
            assert!((dot(&sr, &er) - dot(&s, &e)).abs() < 1e-9);
            assert!(largest(&sub(&rotate_stress(&sr, &transposed(&frame)), &s)) < 1e-8);
        }
    }

    #[test]
    fn rotated_tangent_gives_the_rotated_stress() {
        let local: Tangent = std::array::from_fn(|i| random(i as u64, 1e9));
        let frame = cylindrical([1.0, 2.0, 3.0], [0.3, 0.1, 0.0], [0.2, 0.5, 1.0]);
        let (global, strain) = (rotate_tangent(&local, &frame), random(50, 1e-3));
        let expected =
            rotate_stress(&apply(&local, &rotate_strain(&strain, &frame)), &transposed(&frame));
        assert!(largest(&sub(&apply(&global, &strain), &expected)) < 1e-8);
    }

    /// A hoop stress seen from the world at 90° is a stress along −x.
    #[test]
    fn hoop_stress_at_the_crown_is_horizontal() {
        let frame = cylindrical([0.0, 3.0, 1.0], [0.0; 3], [0.0, 0.0, 2.0]);
        let local = rotate_stress(&[5.0, 0.0, 0.0, 0.0, 0.0, 0.0], &frame);
        assert!(largest(&sub(&local, &[0.0, 5.0, 0.0, 0.0, 0.0, 0.0])) < 1e-12);
        let on_axis = cylindrical([0.0, 0.0, 7.0], [0.0; 3], [0.0, 0.0, 1.0]);
        assert!(on_axis.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn equivalent_strains_in_uniaxial_tension_and_compression() {
        let (nu, k, e) = (0.2, 10.0, 1e-4);
        let tension = [e, -nu * e, -nu * e, 0.0, 0.0, 0.0];
        let compression = scale(&tension, -1.0);
        assert!((modified_von_mises(&tension, k, nu).0 - e).abs() < 1e-18);
        assert!((modified_von_mises(&compression, k, nu).0 - e / k).abs() < 1e-18);
    }

    #[test]
    fn derivatives_of_equivalent_strains_are_those_of_finite_differences() {
        for walk in 0..200 {
            let e = random(walk, 1e-3);
            let f = |e: &Voigt| modified_von_mises(e, 12.0, 0.2);
            let (_, derivative) = f(&e);
            for c in 0..6 {
                let step = 1e-8;
                let (mut up, mut down) = (e, e);
                up[c] += step;
                down[c] -= step;
                let numeric = (f(&up).0 - f(&down).0) / (2.0 * step);
                assert!(
                    (numeric - derivative[c]).abs() < 2e-4,
                    "{walk} {c} {numeric} {}",
                    derivative[c]
                );
            }
        }
    }
}
