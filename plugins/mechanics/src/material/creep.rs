//! Creep and shrinkage of the codes, as functions of age.
//!
//! Compliance J(t, t₀) is the strain at age t under unit stress since age t₀: elastic part plus
//! creep φ/E. Both codes give φ for a whole cross-section of given notional size in air of given
//! humidity, so drying is a property of the member, not of a point.

use super::concrete::{Cement, Code, Properties};
use super::{DAY, Error, MPA, checked};

/// Creep and shrinkage of one member.
#[derive(Debug, Clone, PartialEq)]
pub struct Creep {
    /// The concrete.
    pub concrete: Properties,
    /// Relative humidity of the air, 0 to 1.
    pub humidity: f64,
    /// Notional size h₀ = 2 A_c/u, m.
    pub notional_size: f64,
}

/// Free shrinkage, negative strains.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Shrinkage {
    /// By drying.
    pub drying: f64,
    /// By hydration, without loss of water.
    pub autogenous: f64,
}

impl Shrinkage {
    /// Both together.
    #[must_use]
    pub(crate) fn total(self) -> f64 {
        self.drying + self.autogenous
    }
}

/// How much faster than at 20 °C concrete ages at `temperature` (K): exp(13.65 − 4000/T), EN
/// 1992-1-1 (B.10) and MC2010 (5.1-85).
#[must_use]
pub(crate) fn maturity_rate(temperature: f64) -> f64 {
    (13.65 - 4000.0 / temperature.max(200.0)).exp()
}

/// exp(1.5 (k − .45)) for stress above .45 f_ck, else 1: EN 1992-1-1 (3.7). (MC2010 (5.1-74) begins
/// at .4 f_cm, which is nearly the same.) `ratio` is stress/f_ck; twice the limit and more count
/// alike.
#[must_use]
pub(crate) fn nonlinear_factor(ratio: f64) -> f64 {
    (1.5 * (ratio - 0.45)).clamp(0.0, 1.5).exp()
}

/// The modulus E/(1 + χφ) by which stress that comes slowly counts (Trost and Bažant's age-adjusted
/// effective modulus).
#[must_use]
#[cfg(test)]
pub(crate) fn age_adjusted_modulus(modulus: f64, phi: f64, chi: f64) -> f64 {
    modulus / (1.0 + chi * phi)
}

impl Creep {
    /// Creep of a member.
    ///
    /// # Errors
    ///
    /// If humidity is not in 0..=1 or the notional size not between 10 mm and 20 m.
    pub(crate) fn new(
        concrete: Properties,
        humidity: f64,
        notional_size: f64,
    ) -> Result<Self, Error> {
        checked("relative humidity", humidity, 0.0, 1.0, "a fraction from 0 to 1")?;
        checked("notional size", notional_size, 0.01, 20.0, "0.01 m to 20 m")?;
        Ok(Self { concrete, humidity, notional_size })
    }

    /// Age at loading, corrected for the cement: t₀(9/(2 + t₀^1.2) + 1)^α ≥ .5 days, EN 1992-1-1
    /// (B.9), MC2010 (5.1-73). In days.
    fn adjusted(&self, t0: f64) -> f64 {
        let days = (t0 / DAY).max(1e-3);
        (days * (9.0 / (2.0 + days.powf(1.2)) + 1.0).powf(self.concrete.cement.age_exponent()))
            .max(0.5)
    }

    /// Creep coefficient φ(t, t₀) at age `t` under load since age `t0` (s), relative to the elastic
    /// strain with the modulus of [`Self::reference_modulus`].
    #[must_use]
    pub(crate) fn phi(&self, t: f64, t0: f64) -> f64 {
        let under_load = ((t - t0) / DAY).max(0.0);
        match self.concrete.code {
            Code::Ec2 => self.phi_ec2(under_load, self.adjusted(t0)),
            Code::Mc2010 => self.phi_mc2010(under_load, self.adjusted(t0)),
        }
    }

    /// EN 1992-1-1 Annex B: φ_RH β(f_cm) β(t₀) β_c(t − t₀).
    fn phi_ec2(&self, under_load: f64, t0: f64) -> f64 {
        let fcm = self.concrete.fcm / MPA;
        let h0 = self.notional_size * 1e3;
        let alpha = |exponent: f64| if fcm > 35.0 { (35.0 / fcm).powf(exponent) } else { 1.0 };
        let dryness = (1.0 - self.humidity) / (0.1 * h0.cbrt());
        let phi_rh = (1.0 + alpha(0.7) * dryness) * alpha(0.2);
        let bh = (1.5 * (1.0 + (1.2 * self.humidity).powi(18)) * h0 + 250.0 * alpha(0.5))
            .min(1500.0 * alpha(0.5));
        phi_rh * 16.8 / fcm.sqrt() / (0.1 + t0.powf(0.2))
            * (under_load / (bh + under_load)).powf(0.3)
    }

    /// MC2010 §5.1.9.4.3: basic creep (5.1-64) and drying creep (5.1-67).
    fn phi_mc2010(&self, under_load: f64, t0: f64) -> f64 {
        let fcm = self.concrete.fcm / MPA;
        let h = self.notional_size * 1e3;
        let basic = 1.8 * fcm.powf(-0.7) * ((30.0 / t0 + 0.035).powi(2) * under_load).ln_1p();
        let strength = (35.0 / fcm).sqrt();
        let bh = (1.5 * h + 250.0 * strength).min(1500.0 * strength);
        let gamma = 1.0 / (2.3 + 3.5 / t0.sqrt());
        let size = (1.0 - self.humidity) / (0.1 * h / 100.0).cbrt();
        let drying = 412.0 * fcm.powf(-1.4) * size / (0.1 + t0.powf(0.2))
            * (under_load / (bh + under_load)).powf(gamma);
        basic + drying
    }

    /// The modulus that φ refers to: 1.05 E_cm (EC2 3.1.4) or E_ci (MC2010 5.1-62), at 28 days.
    #[must_use]
    pub(crate) fn reference_modulus(&self) -> f64 {
        match self.concrete.code {
            Code::Ec2 => 1.05 * self.concrete.modulus,
            Code::Mc2010 => self.concrete.modulus,
        }
    }

    /// J(t, t₀) = 1/E(t₀) + φ(t, t₀)/E_ref, 1/Pa.
    #[must_use]
    pub(crate) fn compliance(&self, t: f64, t0: f64) -> f64 {
        1.0 / self.concrete.modulus_at(t0) + self.phi(t, t0) / self.reference_modulus()
    }

    /// Free shrinkage at age `t` of concrete that dries since age `ts` (s).
    #[must_use]
    pub(crate) fn shrinkage(&self, t: f64, ts: f64) -> Shrinkage {
        let (age, dry) = ((t / DAY).max(0.0), ((t - ts) / DAY).max(0.0));
        match self.concrete.code {
            Code::Ec2 => self.shrinkage_ec2(age, dry),
            Code::Mc2010 => self.shrinkage_mc2010(age, dry),
        }
    }

    /// (d₁, d₂) of both codes, d₂ for f_cm/10 in MPa.
    fn drying_constants(&self) -> (f64, f64) {
        match self.concrete.cement {
            Cement::S => (3.0, 0.13),
            Cement::N => (4.0, 0.12),
            Cement::R => (6.0, 0.11),
        }
    }

    /// EN 1992-1-1 §3.1.4 and (B.11).
    fn shrinkage_ec2(&self, age: f64, dry: f64) -> Shrinkage {
        let (d1, d2) = self.drying_constants();
        let h0 = self.notional_size * 1e3;
        let humidity = 1.55 * (1.0 - self.humidity.powi(3));
        let whole = 0.85
            * (220.0 + 110.0 * d1)
            * (-d2 * self.concrete.fcm / MPA / 10.0).exp()
            * humidity
            * 1e-6;
        let size = piecewise(h0, &[(100.0, 1.0), (200.0, 0.85), (300.0, 0.75), (500.0, 0.70)]);
        let autogenous = 2.5
            * (self.concrete.fck / MPA - 10.0).max(0.0)
            * 1e-6
            * (1.0 - (-0.2 * age.sqrt()).exp());
        Shrinkage {
            drying: -size * whole * dry / (dry + 0.04 * h0.powf(1.5)),
            autogenous: -autogenous,
        }
    }

    /// MC2010 §5.1.9.4.4: basic (5.1-76) and drying shrinkage (5.1-77).
    fn shrinkage_mc2010(&self, age: f64, dry: f64) -> Shrinkage {
        let fcm = self.concrete.fcm / MPA;
        let h = self.notional_size * 1e3;
        let basic = match self.concrete.cement {
            Cement::S => 800.0,
            Cement::N => 700.0,
            Cement::R => 600.0,
        };
        let autogenous = basic
            * (0.1 * fcm / (6.0 + 0.1 * fcm)).powf(2.5)
            * 1e-6
            * (1.0 - (-0.2 * age.sqrt()).exp());
        // α_ds2 of MC2010 is .012 for N and for R.
        let (d1, d2) = (
            self.drying_constants().0,
            if self.concrete.cement == Cement::S { 0.013 } else { 0.012 },
        );
        let swelling_from = 0.99 * (35.0 / fcm).powf(0.1).min(1.0);
        let humidity = if self.humidity < swelling_from {
            -1.55 * (1.0 - self.humidity.powi(3))
        } else {
            0.25
        };
        let whole = (220.0 + 110.0 * d1) * (-d2 * fcm).exp() * humidity * 1e-6;
        Shrinkage { drying: whole * (dry / (0.035 * h * h + dry)).sqrt(), autogenous: -autogenous }
    }
}

/// Linear between points, constant outside.
fn piecewise(x: f64, points: &[(f64, f64)]) -> f64 {
    let after = points.partition_point(|p| p.0 <= x);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(p), None) | (None, Some(p)) => p.1,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::concrete::Given;
    use super::*;

    /// A member of strength `fcm` in MPa at 50 % humidity, cement N.
    pub(crate) fn member(code: Code, fcm: f64, size: f64) -> Creep {
        let concrete = Given { code, fcm: Some(fcm * MPA), ..Given::default() }.complete().unwrap();
        Creep::new(concrete, 0.5, size).unwrap()
    }

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value / expected - 1.0).abs() < tolerance, "{value} instead of {expected}");
    }

    /// Values computed independently from the formulas of the codes, in another language (RH 50 %,
    /// h₀ 300 mm, loaded at 28 d for 1e4 d).
    #[test]
    fn creep_coefficients() {
        for (code, fcm, phi) in [
            (Code::Ec2, 38.0, 2.1885),
            (Code::Ec2, 48.0, 1.7437),
            (Code::Mc2010, 38.0, 1.3278 + 0.9026),
            (Code::Mc2010, 48.0, 1.1275 + 0.6514),
        ] {
            close(member(code, fcm, 0.3).phi(10_028.0 * DAY, 28.0 * DAY), phi, 5e-5);
        }
        close(member(Code::Ec2, 38.0, 0.3).phi(1e9 * DAY, 28.0 * DAY), 2.2328, 5e-5);
    }

    /// The same, drying since 7 d, after 1e4 d.
    #[test]
    fn shrinkage_strains() {
        let at = |code| member(code, 38.0, 0.3).shrinkage(10_007.0 * DAY, 7.0 * DAY);
        let (ec2, mc) = (at(Code::Ec2), at(Code::Mc2010));
        close(ec2.drying, -3.543e-4, 3e-4);
        close(ec2.autogenous, -5.00e-5, 1e-3);
        close(mc.drying, -4.947e-4, 3e-4);
        close(mc.autogenous, -6.55e-5, 1e-3);
        assert_eq!(member(Code::Ec2, 38.0, 0.3).shrinkage(0.0, 0.0).total(), 0.0);
    }

    /// OOFEM's reference values for its deck `EC2creep.in` (f_cm 30 MPa, t₀ 7 d, RH 50 %, h₀ 100
    /// mm, N).
    #[test]
    fn compliance_agrees_with_oofem() {
        let creep = member(Code::Ec2, 30.0, 0.1);
        for (days, expected) in [(0.1, 4.5603e-11), (5.0, 6.8940e-11), (1e4, 1.592_03e-10)] {
            close(creep.compliance((7.0 + days) * DAY, 7.0 * DAY), expected, 5e-3);
        }
    }

    #[test]
    fn rapid_cement_is_older_than_it_is() {
        let mut creep = member(Code::Ec2, 38.0, 0.3);
        let normal = creep.phi(1e4 * DAY, 3.0 * DAY);
        creep.concrete.cement = Cement::R;
        assert!(creep.phi(1e4 * DAY, 3.0 * DAY) < normal);
        // 20 °C is the temperature at which a day is a day.
        assert!((maturity_rate(293.15) - 1.0).abs() < 6e-3 && maturity_rate(313.15) > 2.0);
    }

    #[test]
    fn nonlinear_creep_begins_at_45_percent() {
        assert_eq!((nonlinear_factor(0.2), nonlinear_factor(0.45)), (1.0, 1.0));
        close(nonlinear_factor(0.6), 0.225f64.exp(), 1e-12);
    }

    /// Column .4 × .4 m with 12 bars of 16 mm under 1.6 MN: creep and shrinkage move the load into
    /// the steel (AAEM method, χ = .8).
    #[test]
    fn reinforced_column_by_the_age_adjusted_modulus() {
        let steel = 12.0 * std::f64::consts::PI * 0.016f64.powi(2) / 4.0;
        let (concrete, n, ec, es) = (0.16 - steel, -1.6e6, 32e9, 200e9);
        let (phi, chi, shrinkage) = (2.0, 0.8, -3e-4);
        let first = n / (concrete * ec + steel * es);
        let later = age_adjusted_modulus(ec, phi, chi);
        let more = concrete * later * (phi * first + shrinkage) / (concrete * later + steel * es);
        let (sc, ss) = (ec * first + later * (more - phi * first - shrinkage), es * (first + more));
        close(sc, -7.1107e6, 1e-5);
        close(ss, -198.715e6, 1e-5);
        assert!((concrete * sc + steel * ss - n).abs() < 1e-6);
    }
}
