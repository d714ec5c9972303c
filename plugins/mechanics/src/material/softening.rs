//! Concrete past its strength, in one dimension: how much stress is left at a strain, for an
//! element of size h.
//!
//! A crack dissipates G_f per area, but a finite element spreads it over its size h: the strain
//! that stands for an opening w is w/h, and the curve must be stretched so that h·∫σ dε = G_f
//! whatever h is (crack band, Bažant and Oh 1983). An element above 2 E G_f/f_t² holds more elastic
//! energy at the peak than the crack can take: no curve can keep G_f, and the element is refused.

use super::Error;

/// Largest damage: what is left carries 1e-5 of the stiffness, which solvers can still see.
pub(crate) const MAX_DAMAGE: f64 = 1.0 - 1e-5;

/// Damage and its derivative by the strain that drives it.
pub(crate) type Damage = (f64, f64);

/// Tension: linear to κ₀ = f_t/E, then σ = f_t exp(−(κ − κ₀)/(ε_f − κ₀)) with ε_f = G_f/(h f_t) +
/// κ₀/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tension {
    /// Strain at the peak, f_t/E.
    pub threshold: f64,
    /// Strain ε_f where the tangent at the peak reaches zero stress.
    pub failure: f64,
}

impl Tension {
    /// For modulus `e`, strength `ft` (Pa), fracture energy `gf` (J/m²) and element size `h` (m).
    ///
    /// # Errors
    ///
    /// [`Error::ElementTooLarge`] if h ≥ 2 E G_f/f_t².
    pub(crate) fn new(e: f64, ft: f64, gf: f64, h: f64) -> Result<Self, Error> {
        let limit = Self::largest(e, ft, gf);
        match h < limit {
            true => Ok(Self::of(e, ft, gf, h)),
            false => Err(Error::ElementTooLarge { what: "tension", h, limit }),
        }
    }

    /// Size from which on an element has more elastic energy at its peak than its crack takes, m:
    /// 2 E G_f/f_t².
    pub(super) fn largest(e: f64, ft: f64, gf: f64) -> f64 {
        2.0 * e * gf / (ft * ft)
    }

    /// As [`Self::new`], but an element that is too large becomes as brittle as it can be (a
    /// hundredth of the elastic strain), not an error. For strengths that change with age in an
    /// element that was checked at 28 days.
    #[must_use]
    pub(crate) fn of(e: f64, ft: f64, gf: f64, h: f64) -> Self {
        let threshold = ft / e;
        Self { threshold, failure: (gf / (h * ft) + 0.5 * threshold).max(1.01 * threshold) }
    }

    /// d = 1 − (κ₀/κ) exp(−(κ − κ₀)/(ε_f − κ₀)).
    #[must_use]
    pub(crate) fn damage(&self, kappa: f64) -> Damage {
        if kappa <= self.threshold {
            return (0.0, 0.0);
        }
        let slope = 1.0 / (self.failure - self.threshold);
        let left = self.threshold / kappa * (-(kappa - self.threshold) * slope).exp();
        if 1.0 - left >= MAX_DAMAGE {
            (MAX_DAMAGE, 0.0)
        } else {
            (1.0 - left, left * (1.0 / kappa + slope))
        }
    }
}

/// Tension by two straight lines, the code's curve of a crack (MC2010 §5.1.8.2): f_t at no opening,
/// f_t/5 at w₁ = G_f/f_t, nothing at 5 w₁. Up to the knee microcracks grow, from there on one crack
/// opens. Beside it what bars give back to the concrete between cracks ([`Held`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knee {
    /// Strain at the peak, f_t/E.
    pub threshold: f64,
    /// w₁/h.
    opened: f64,
    held: Held,
}

/// Tension that bars' bond gives back to concrete between its cracks: in the mean a share β of its
/// strength (MC2010, 7.6.4.4, table 7.6-2), and no more than what bars, beside what they bear in
/// the mean, have left until they yield at the crack (Vecchio and Collins 1986, eqs. 24 to 31). Bars
/// along an axis bear R there, so that the crack across n bears Σ R n² and, where they have not the
/// same left, shear on its faces, which interlock up to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Held {
    /// β over the volume that bars reach, at once and after the load has lasted.
    pub most: [f64; 2],
    /// R of the bars along each axis over the strength.
    pub left: [f64; 3],
    /// n² of each axis.
    pub square: [f64; 3],
    /// Shear that faces bear while they are shut, over the strength, and what part of that a unit
    /// of strain across the crack takes: most/(1 + fading κ).
    pub interlock: [f64; 2],
    /// Shear that they bear already, over the strength.
    pub sheared: f64,
}

impl Held {
    /// Its stress over the strength at a strain across the crack.
    fn stress(&self, kappa: f64, lasted: bool) -> f64 {
        let most = self.most[usize::from(lasted)];
        let bars = || self.left.into_iter().zip(self.square);
        let least = bars()
            .filter(|(_, square)| *square > 0.0)
            .fold(f64::INFINITY, |least: f64, (left, _)| least.min(left));
        if most <= 0.0 || least >= most {
            return most;
        }
        let [interlock, fading] = self.interlock;
        let bears = (interlock / (1.0 + fading * kappa) - self.sheared).max(0.0);
        borne(&self.left, &self.square, bears).min(most)
    }
}

/// What bars bear across a crack, n² of whose normal along each axis is `square`, if those along
/// each bear at most `left` and the faces of the crack no more than `shear` along them.
#[must_use]
pub(super) fn borne(left: &[f64; 3], square: &[f64; 3], shear: f64) -> f64 {
    // Across the crack and along it, if no bars bear more than a level: the higher it is, the
    // more shear.
    let at = |level: f64| {
        let bars = left.iter().zip(square);
        let [mean, twice] = bars.fold([0.0; 2], |[mean, twice], (left, square)| {
            let bar = left.min(level);
            [mean + square * bar, twice + square * bar * bar]
        });
        (mean, (twice - mean * mean).max(0.0).sqrt())
    };
    let (mut low, mut high) = (0.0, left.iter().copied().fold(0.0, f64::max));
    let all = at(high);
    if all.1 <= shear {
        return all.0;
    }
    for _ in 0..LEVELS {
        let middle = 0.5 * (low + high);
        if at(middle).1 <= shear { low = middle } else { high = middle }
    }
    at(low).0
}

/// Halvings in which the level is found that bars bear.
const LEVELS: usize = 20;

impl Knee {
    /// For modulus `e`, strength `ft` (Pa), fracture energy `gf` (J/m²) and element size `h` (m);
    /// an element that is too large becomes as brittle as it can be.
    #[must_use]
    pub(crate) fn of(e: f64, ft: f64, gf: f64, h: f64) -> Self {
        let threshold = ft / e;
        let opened = (gf / (h * ft)).max(0.81 * threshold);
        Self { threshold, opened, held: Held::default() }
    }

    /// The same beside what bars give back.
    #[must_use]
    pub(crate) fn with(self, held: Held) -> Self {
        Self { held, ..self }
    }

    /// Strain at the knee.
    #[must_use]
    pub(crate) fn knee(&self) -> f64 {
        self.opened + 0.2 * self.threshold
    }

    /// d = 1 − (κ₀/κ) σ/f_t, where κ = κ₀ σ/f_t + w/h.
    #[must_use]
    pub(crate) fn damage(&self, kappa: f64) -> f64 {
        self.secant_damage(kappa, self.softened(kappa))
    }

    /// The same of what is pulled across the crack, which bars hold together; its faces, and so
    /// shear along them, know nothing of that.
    #[must_use]
    pub(crate) fn across(&self, kappa: f64, lasted: bool) -> f64 {
        self.secant_damage(kappa, self.softened(kappa).max(self.held.stress(kappa, lasted)))
    }

    fn secant_damage(&self, kappa: f64, stress: f64) -> f64 {
        match kappa <= self.threshold {
            true => 0.0,
            false => (1.0 - self.threshold / kappa * stress).min(MAX_DAMAGE),
        }
    }

    /// What the crack itself transfers, over f_t.
    fn softened(&self, kappa: f64) -> f64 {
        let stress = match kappa < self.knee() {
            true => 1.0 - 0.8 * (kappa - self.threshold) / (self.opened - 0.8 * self.threshold),
            false => {
                0.25 - 0.05 * (kappa - 0.25 * self.threshold)
                    / (self.opened - 0.05 * self.threshold)
            }
        };
        stress.max(0.0)
    }
}

/// Compression: linear to .4 f_c (where EC2 takes its secant modulus), then a power parabola that
/// leaves the line smoothly and reaches f_c at ε_c1 with no slope, then σ = f_c exp(−(κ −
/// ε_c1)/ε_s) with ε_s = G_c/(h f_c) − ε_c1/2.
///
/// Smaller elements than [`GAUGE`] crush as that length does: the code's curve is of bodies of that
/// size, and in bending all of it crushes together, whatever the mesh. Stretched over its own size
/// alone, a row of small bricks would bear in the zone of compression what no section bears (mean
/// stress .81 f_c for C30 and 60 mm, where the code's curve gives .75), and its bars would yield
/// where the section's do not. Where a row of them crushes by itself, [`Self::of`] is told so
/// (`together`), or less energy would be dissipated than G_c.
///
/// The parabola is σ = f_c(1 − .6 ((ε_c1 − κ)/(ε_c1 − ε₀))^p) with p = (E ε_c1 − .4 f_c)/(.6 f_c),
/// about 2.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Compression {
    /// Elastic limit ε₀ = .4 f_c/E.
    pub threshold: f64,
    /// Strain at the peak ε_c1, positive.
    pub peak: f64,
    /// Exponent p of the parabola.
    exponent: f64,
    /// f_c/E.
    strength: f64,
    /// Decay ε_s of the descending branch.
    decay: f64,
}

/// Length of the bodies that codes' curves of compression describe past the peak, m (CEB-FIP Model
/// Code 1990, 2.1.4.4.1).
pub(crate) const GAUGE: f64 = 0.2;

/// Share of the strength up to which compression is elastic.
pub(super) const ELASTIC: f64 = 0.4;

impl Compression {
    /// For modulus `e`, strength `fc` (Pa), strain at the peak, crushing energy `gc` (J/m²) and
    /// element size `h` (m).
    ///
    /// # Errors
    ///
    /// [`Error::ElementTooLarge`] if h ≥ 2 G_c/(f_c ε_c1).
    pub(crate) fn new(e: f64, fc: f64, peak: f64, gc: f64, h: f64) -> Result<Self, Error> {
        let limit = Self::largest(fc, peak, gc);
        match h < limit {
            true => Ok(Self::of(e, fc, peak, gc, h, 1.0)),
            false => Err(Error::ElementTooLarge { what: "compression", h, limit }),
        }
    }

    /// The same as of tension, m: 2 G_c/(f_c ε_c1).
    pub(super) fn largest(fc: f64, peak: f64, gc: f64) -> f64 {
        2.0 * gc / (fc * peak)
    }

    /// As [`Self::new`], but never an error (see [`Tension::of`]), where only a share of [`GAUGE`]
    /// crushes `together`: its strain is of so much of it.
    #[must_use]
    pub(crate) fn of(e: f64, fc: f64, peak: f64, gc: f64, h: f64, together: f64) -> Self {
        let strength = fc / e;
        let peak = peak.max(1.05 * strength);
        let exponent = (peak - ELASTIC * strength) / ((1.0 - ELASTIC) * strength);
        Self {
            threshold: ELASTIC * strength,
            peak,
            exponent,
            strength,
            decay: (gc / (h.max(together * GAUGE) * fc) - 0.5 * peak).max(0.01 * peak),
        }
    }

    /// d = 1 − σ(κ)/(E κ).
    #[must_use]
    pub(crate) fn damage(&self, kappa: f64) -> Damage {
        if kappa <= self.threshold {
            return (0.0, 0.0);
        }
        let (stress, slope) = if kappa < self.peak {
            let width = self.peak - self.threshold;
            let left = (self.peak - kappa) / width;
            let drop = (1.0 - ELASTIC) * left.powf(self.exponent - 1.0);
            (1.0 - drop * left, drop * self.exponent / width)
        } else {
            let stress = (-(kappa - self.peak) / self.decay).exp();
            (stress, -stress / self.decay)
        };
        let left = self.strength * stress / kappa;
        if 1.0 - left >= MAX_DAMAGE {
            (MAX_DAMAGE, 0.0)
        } else {
            (1.0 - left, left / kappa - self.strength * slope / kappa)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(stress: impl Fn(f64) -> f64, to: f64) -> f64 {
        let n = 20_000;
        let at = |k: i32| to * f64::from(k) / f64::from(n);
        (0..n).map(|k| 0.5 * (stress(at(k)) + stress(at(k + 1))) * to / f64::from(n)).sum()
    }

    /// E 30 GPa, f_t 3 MPa, G_f 100 N/m: the numbers of the verification list.
    #[test]
    fn crack_band_keeps_the_fracture_energy() {
        let (e, ft, gf) = (30e9, 3e6, 100.0);
        for (h, failure) in [(0.01, 3.3833e-3), (0.02, 1.7167e-3), (0.05, 7.1667e-4)] {
            let law = Tension::new(e, ft, gf, h).unwrap();
            assert!((law.failure - failure).abs() < 5e-8);
            // What `MAX_DAMAGE` leaves for the solver is no part of the law.
            let stress = |k: f64| {
                if law.damage(k).0 < MAX_DAMAGE { (1.0 - law.damage(k).0) * e * k } else { 0.0 }
            };
            let w = h * work(stress, 30.0 * law.failure);
            assert!((w / gf - 1.0).abs() < 3e-3, "{h} {w}");
        }
        let Err(Error::ElementTooLarge { limit, .. }) = Tension::new(e, ft, gf, 0.7) else {
            panic!("0.7 m must be too large")
        };
        assert!((limit - 0.666_666_7).abs() < 1e-6);
        assert!(Tension::new(e, ft, gf, 0.66).is_ok());
    }

    /// The code's curve keeps the fracture energy too, in small bricks and in large ones, and has a
    /// fifth of the strength at its knee.
    #[test]
    fn two_lines_keep_the_fracture_energy() {
        let (e, ft, gf) = (30e9, 3e6, 100.0);
        for h in [0.01, 0.05, 0.2] {
            let law = Knee::of(e, ft, gf, h);
            let stress = |k: f64| {
                if law.damage(k) < MAX_DAMAGE { (1.0 - law.damage(k)) * e * k } else { 0.0 }
            };
            let w = h * work(stress, 6.0 * gf / (h * ft));
            assert!((w / gf - 1.0).abs() < 3e-3, "{h} {w}");
            assert!((stress(law.knee()) / ft - 0.2).abs() < 1e-9);
            assert!((law.knee() - 0.2 * ft / e - gf / (h * ft)).abs() < 1e-12);
        }
    }

    /// Bars hold .6 f_t until what is left up to their yielding is less, and nothing once they
    /// yield. Bars one way hold an oblique crack as far as its faces interlock.
    #[test]
    fn bars_hold_until_they_yield() {
        let (e, ft, kappa) = (30e9, 3e6, 2e-3);
        let stress = |left: f64, square: [f64; 3], interlock: f64, lasted| {
            let held = Held {
                most: [0.6, 0.4],
                left: [left, 0.0, 0.0],
                square,
                interlock: [interlock, 500.0],
                sheared: 0.0,
            };
            let law = Knee::of(e, ft, 100.0, 0.1).with(held);
            (1.0 - law.across(kappa, lasted)) * e * kappa / ft
        };
        let (along, oblique) = ([1.0, 0.0, 0.0], [0.5, 0.5, 0.0]);
        for (left, square, interlock, lasted, expected) in [
            (2.0, along, 0.0, false, 0.6),
            (2.0, along, 0.0, true, 0.4),
            (0.3, along, 0.0, false, 0.3),
            // Half of what they have left, and as much shear.
            (0.8, oblique, 10.0, false, 0.4),
            (0.8, oblique, 0.4, false, 0.2),
        ] {
            let found = stress(left, square, interlock, lasted);
            assert!((found / expected - 1.0).abs() < 1e-4, "{left} {square:?}: {found} {expected}");
        }
        assert!(stress(0.0, along, 10.0, false) < 1e-3);
        assert!(stress(0.8, oblique, 0.0, false) < 1e-3);
    }

    #[test]
    fn compression_peaks_at_the_strength_and_keeps_the_crushing_energy() {
        let (e, fc, peak, gc) = (32.8e9, 38e6, 2.16e-3, 35e3);
        assert_eq!(
            Compression::of(e, fc, peak, gc, 0.05, 1.0),
            Compression::of(e, fc, peak, gc, GAUGE, 1.0)
        );
        for h in [GAUGE, 0.3] {
            let law = Compression::new(e, fc, peak, gc, h).unwrap();
            let stress = |k: f64| {
                if law.damage(k).0 < MAX_DAMAGE { (1.0 - law.damage(k).0) * e * k } else { 0.0 }
            };
            assert!(
                (stress(peak) / fc - 1.0).abs() < 1e-12
                    && stress(0.99 * peak) < fc
                    && stress(1.01 * peak) < fc
            );
            assert!((stress(0.4 * fc / e) - 0.4 * fc).abs() < 1.0);
            // After the peak, with what the band stored at the peak as seen by its secant.
            let to = peak + 30.0 * gc / (h * fc);
            let after = work(|k| stress(peak + k), to - peak) + 0.5 * fc * peak;
            assert!((h * after / gc - 1.0).abs() < 2e-3, "{h} {}", h * after);
        }
        assert!(matches!(
            Compression::new(e, fc, peak, gc, 1.0),
            Err(Error::ElementTooLarge { what: "compression", .. })
        ));
    }

    /// The most that the mean stress over a zone of compression gets to, under the curve of EN
    /// 1992-1-1 (3.14) and under ours in bricks of 60 mm: within 1 to 4.5 %, farthest for C12.
    #[test]
    fn a_zone_of_compression_bears_what_the_code_says() {
        for (fck, allowed) in
            [(12.0, 0.045), (20.0, 0.025), (30.0, 0.01), (40.0, 0.02), (50.0, 0.03)]
        {
            let fcm: f64 = fck + 8.0;
            let e = 22e9 * (0.1 * fcm).powf(0.3);
            let peak = (0.7e-3 * fcm.powf(0.31)).max(1.3e6 * fcm / e);
            let gc = 250.0 * 73.0 * fcm.powf(0.18);
            let law = Compression::of(e, 1e6 * fcm, peak, gc, 0.06, 1.0);
            let ours = |k: f64| (1.0 - law.damage(k).0) * e * k / (1e6 * fcm);
            let first = 0.7e-3 * fcm.powf(0.31);
            let k = 1.05 * e * first / (1e6 * fcm);
            let code = |strain: f64| {
                let eta = strain / first;
                if strain > 3.5e-3 { 0.0 } else { (k * eta - eta * eta) / (1.0 + (k - 2.0) * eta) }
            };
            let most = |stress: &dyn Fn(f64) -> f64| {
                let means = (1..=100).map(|n| 1e-4 * f64::from(n));
                means.map(|to| work(stress, to) / to).fold(0.0, f64::max)
            };
            let (ours, code) = (most(&ours), most(&code));
            println!("C{fck}: {ours:.3} f_cm, by the code {code:.3}");
            assert!((ours / code - 1.0).abs() < allowed, "C{fck}: {ours} {code}");
        }
    }

    #[test]
    fn damage_never_falls_and_has_the_derivative_it_says() {
        let tension = Tension::new(30e9, 3e6, 100.0, 0.05).unwrap();
        let compression = Compression::new(30e9, 30e6, 2e-3, 25e3, 0.05).unwrap();
        let laws: [&dyn Fn(f64) -> Damage; 2] =
            [&|k| tension.damage(k), &|k| compression.damage(k)];
        for (law, end) in laws.iter().zip([3e-3, 3e-2]) {
            let mut last = 0.0;
            for k in 1..2000 {
                let kappa = end * f64::from(k) / 2000.0;
                let (d, slope) = law(kappa);
                assert!(d >= last && d <= MAX_DAMAGE && slope >= 0.0);
                last = d;
                let step = 1e-9;
                let numeric = (law(kappa + step).0 - law(kappa - step).0) / (2.0 * step);
                assert!(
                    (numeric - slope).abs() <= 1e-3 * slope.abs().max(1.0),
                    "{kappa} {numeric} {slope}"
                );
            }
        }
    }
}
