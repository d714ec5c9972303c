//! What is known of a concrete, and what has to be assumed because it is not.
//!
//! An experiment gives a few values, a drawing gives a class. [`Given::complete`] fills in the rest
//! from the codes and keeps a list of what it filled in, so that a report can say so.

use super::{
    DAY, Error, MPA, checked,
    softening::{Compression, Tension},
};

/// Strength class of EN 1992-1-1, table 3.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Class {
    /// Characteristic cylinder strength f_ck, Pa.
    pub fck: f64,
    /// Characteristic cube strength, Pa.
    pub cube: f64,
}

impl std::str::FromStr for Class {
    type Err = Error;

    /// Reads "C30/37".
    fn from_str(name: &str) -> Result<Self, Error> {
        let unknown = || Error::UnknownClass(name.chars().take(40).collect());
        let (cylinder, cube) = name
            .trim()
            .strip_prefix(['C', 'c'])
            .and_then(|rest| rest.split_once('/'))
            .ok_or_else(unknown)?;
        let megapascal = |text: &str| {
            text.trim().parse::<f64>().ok().filter(|f| (8.0..=130.0).contains(f)).map(|f| f * MPA)
        };
        match (megapascal(cylinder), megapascal(cube)) {
            (Some(fck), Some(cube)) if fck <= cube => Ok(Self { fck, cube }),
            _ => Err(unknown()),
        }
    }
}

/// How fast a cement hardens (EN 1992-1-1 §3.1.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Cement {
    /// CEM 32,5 N: slow.
    S,
    /// CEM 32,5 R and 42,5 N: normal.
    #[default]
    N,
    /// CEM 42,5 R and above: rapid.
    R,
}

impl Cement {
    /// s of β_cc(t).
    #[must_use]
    pub(crate) fn hardening(self) -> f64 {
        [0.38, 0.25, 0.20][self as usize]
    }

    /// α of the adjusted age at loading.
    #[must_use]
    pub(crate) fn age_exponent(self) -> f64 {
        [-1.0, 0.0, 1.0][self as usize]
    }
}

/// Which code fills in what is not given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Code {
    /// EN 1992-1-1:2004.
    #[default]
    Ec2,
    /// fib Model Code 2010.
    Mc2010,
}

/// What is known of a concrete at 28 days. Leave out what is not.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Given {
    /// Which code fills the gaps.
    pub code: Code,
    /// Characteristic cylinder strength, Pa.
    pub fck: Option<f64>,
    /// Mean cylinder strength, Pa.
    pub fcm: Option<f64>,
    /// Mean tensile strength, Pa.
    pub fctm: Option<f64>,
    /// Modulus of elasticity, Pa.
    pub modulus: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Fracture energy in tension G_f, J/m².
    pub fracture_energy: Option<f64>,
    /// Crushing energy in compression G_c, J/m².
    pub crushing_energy: Option<f64>,
    /// Strain at the peak in uniaxial compression ε_c1, positive.
    pub peak_strain: Option<f64>,
    /// Density, kg/m³.
    pub density: Option<f64>,
    /// Thermal expansion, 1/K.
    pub expansion: Option<f64>,
    /// Factor α_E of the modulus by the aggregate (MC2010 table 5.1-6): 1.2 basalt, 1 quartzite, .9
    /// limestone, .7 sandstone.
    pub aggregate: Option<f64>,
    /// Cement.
    pub cement: Option<Cement>,
}

impl From<Class> for Given {
    fn from(class: Class) -> Self {
        Self { fck: Some(class.fck), ..Self::default() }
    }
}

/// A value that nobody gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumption {
    /// Of what.
    pub quantity: &'static str,
    /// SI.
    pub value: f64,
    /// By which formula.
    pub source: &'static str,
}

/// Everything that the laws need to know of a concrete at 28 days.
#[derive(Debug, Clone, PartialEq)]
pub struct Properties {
    /// Which code filled the gaps.
    pub code: Code,
    /// Characteristic cylinder strength, Pa.
    pub fck: f64,
    /// Mean cylinder strength, Pa.
    pub fcm: f64,
    /// Mean tensile strength, Pa.
    pub fctm: f64,
    /// Modulus of elasticity, Pa: E_cm of EC2 (secant at .4 f_cm) or E_ci of MC2010 (tangent).
    pub modulus: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Fracture energy in tension G_f, J/m².
    pub fracture_energy: f64,
    /// Crushing energy in compression G_c, J/m².
    pub crushing_energy: f64,
    /// Strain at the peak in uniaxial compression, positive.
    pub peak_strain: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Thermal expansion, 1/K.
    pub expansion: f64,
    /// Cement.
    pub cement: Cement,
    /// What was not given.
    pub assumed: Vec<Assumption>,
}

/// f_ctm of EN 1992-1-1, table 3.1, and of MC2010 (5.1-3): .3 f_ck^(2/3) up to C50/60, then 2.12
/// ln(1 + f_cm/10), MPa. In Pa.
#[must_use]
pub fn tensile_strength(fck: f64) -> f64 {
    let f = fck / MPA;
    let megapascal =
        if f <= 50.0 { 0.3 * f.powf(2.0 / 3.0) } else { 2.12 * (1.0 + (f + 8.0) / 10.0).ln() };
    megapascal * MPA
}

/// E_cm = 22 (f_cm/10)^.3 GPa (EN 1992-1-1, table 3.1), Pa.
#[must_use]
pub fn secant_modulus(fcm: f64) -> f64 {
    22e9 * (fcm / MPA / 10.0).powf(0.3)
}

/// E_ci = 21.5 α_E (f_cm/10)^(1/3) GPa (MC2010 5.1-21), Pa.
#[must_use]
pub(crate) fn initial_modulus(fcm: f64, aggregate: f64) -> f64 {
    21.5e9 * aggregate * (fcm / MPA / 10.0).cbrt()
}

/// G_f = 73 f_cm^.18 N/m (MC2010 5.1-9).
#[must_use]
pub fn fracture_energy(fcm: f64) -> f64 {
    73.0 * (fcm / MPA).powf(0.18)
}

/// ε_c1 = .7 f_cm^.31 ‰, at most 2.8 ‰ (EN 1992-1-1, table 3.1).
#[must_use]
pub(crate) fn peak_strain(fcm: f64) -> f64 {
    (0.7e-3 * (fcm / MPA).powf(0.31)).min(2.8e-3)
}

impl Given {
    /// Fills the gaps.
    ///
    /// # Errors
    ///
    /// If no strength is given, or a value is one that no concrete has.
    pub fn complete(self) -> Result<Properties, Error> {
        let mut assumed = Vec::new();
        let mut fill = |quantity, given: Option<f64>, value: f64, source| match given {
            Some(v) => v,
            None => {
                assumed.push(Assumption { quantity, value, source });
                value
            }
        };
        let fcm = match (self.fcm, self.fck) {
            (Some(fcm), _) => fcm,
            (None, Some(fck)) => fill("fcm", None, fck + 8.0 * MPA, "fck + 8 MPa"),
            (None, None) => return Err(Error::NoStrength),
        };
        let fcm = checked(
            "mean strength fcm",
            fcm,
            5.0 * MPA,
            200.0 * MPA,
            "5 MPa to 200 MPa (strengths are in Pa)",
        )?;
        let fck = match self.fck {
            Some(fck) => fck,
            None => {
                fill("fck", None, (fcm - 8.0 * MPA).max(0.6 * fcm), "fcm − 8 MPa, at least .6 fcm")
            }
        };
        let fck = checked(
            "characteristic strength fck",
            fck,
            2.0 * MPA,
            fcm,
            "2 MPa up to the mean strength",
        )?;
        let fctm =
            fill("fctm", self.fctm, tensile_strength(fck), ".3 fck^(2/3) or 2.12 ln(1 + fcm/10)");
        let fctm = checked(
            "tensile strength",
            fctm,
            0.1 * MPA,
            0.5 * fcm,
            "0.1 MPa up to half the compressive strength",
        )?;
        let modulus = match self.code {
            Code::Ec2 => fill("modulus", self.modulus, secant_modulus(fcm), "22 GPa (fcm/10)^.3"),
            Code::Mc2010 => fill(
                "modulus",
                self.modulus,
                initial_modulus(fcm, self.aggregate.unwrap_or(1.0)),
                "21.5 GPa αE (fcm/10)^(1/3)",
            ),
        };
        let modulus = checked("modulus of elasticity", modulus, 1e9, 2e11, "1 GPa to 200 GPa")?;
        let poisson = checked(
            "Poisson's ratio",
            fill("poisson", self.poisson, 0.2, "EC2 §3.1.3"),
            0.0,
            0.45,
            "0 to 0.45",
        )?;
        let gf = fill(
            "fracture energy",
            self.fracture_energy,
            fracture_energy(fcm),
            "MC2010: 73 fcm^.18 N/m",
        );
        let gf = checked("fracture energy", gf, 1.0, 1e5, "1 J/m² to 1e5 J/m²")?;
        let gc = fill(
            "crushing energy",
            self.crushing_energy,
            250.0 * gf,
            "250 Gf (Rijkswaterstaat RTD 1016)",
        );
        let gc = checked("crushing energy", gc, gf, 1e7, "the fracture energy up to 1e7 J/m²")?;
        // A peak strain given with a stiffer or softer concrete must leave the curve concave:
        // E·ε_c1 > f_c.
        let peak = fill(
            "peak strain",
            self.peak_strain,
            peak_strain(fcm).max(1.3 * fcm / modulus),
            "EC2: .7 fcm^.31 ‰, at least 1.3 fcm/E",
        );
        let peak = checked(
            "strain at the compressive peak",
            peak,
            1.05 * fcm / modulus,
            0.02,
            "more than 1.05 fcm/E, up to 0.02",
        )?;
        let density = checked(
            "density",
            fill("density", self.density, 2400.0, "EN 1991-1-1"),
            200.0,
            8000.0,
            "200 to 8000 kg/m³",
        )?;
        let expansion = fill("thermal expansion", self.expansion, 1e-5, "EC2 §3.1.3");
        let expansion = checked("thermal expansion", expansion, 0.0, 1e-4, "0 to 1e-4 per kelvin")?;
        let cement = self.cement.unwrap_or_default();
        if self.cement.is_none() {
            assumed.push(Assumption {
                quantity: "cement s",
                value: cement.hardening(),
                source: "class N",
            });
        }
        Ok(Properties {
            code: self.code,
            fck,
            fcm,
            fctm,
            modulus,
            poisson,
            fracture_energy: gf,
            crushing_energy: gc,
            peak_strain: peak,
            density,
            expansion,
            cement,
            assumed,
        })
    }
}

/// Strengths and stiffness at an age, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aged {
    /// Characteristic compressive strength.
    pub fck: f64,
    /// Mean compressive strength.
    pub fcm: f64,
    /// Mean tensile strength.
    pub fctm: f64,
    /// Modulus of elasticity.
    pub modulus: f64,
}

impl Properties {
    /// Size of the largest element whose softening keeps fracture and crushing energy, m.
    #[must_use]
    pub(crate) fn largest_element(&self) -> f64 {
        let pulled = Tension::largest(self.modulus, self.fctm, self.fracture_energy);
        pulled.min(Compression::largest(self.fcm, self.peak_strain, self.crushing_energy))
    }

    /// β_cc(t) = exp(s(1 − √(28/t))) at `age` (s, adjusted for temperature): EN 1992-1-1 (3.2),
    /// MC2010 (5.1-51).
    ///
    /// Younger than six hours counts as six hours: the formula goes to nothing faster than any
    /// stiffness that an equation could be solved with.
    #[must_use]
    pub(crate) fn hardening(&self, age: f64) -> f64 {
        let days = (age / DAY).max(0.25);
        (self.cement.hardening() * (1.0 - (28.0 / days).sqrt())).exp()
    }

    /// Strengths and stiffness at `age`: f_cm β_cc; f_ctm β_cc^α with α = 1 before 28 days, 2/3
    /// after (3.4); E β_cc^.3 (3.5), in MC2010 E β_cc^.5.
    #[must_use]
    pub(crate) fn at(&self, age: f64) -> Aged {
        let b = self.hardening(age);
        let tension = if age < 28.0 * DAY { b } else { b.powf(2.0 / 3.0) };
        Aged {
            fck: self.fck * b,
            fcm: self.fcm * b,
            fctm: self.fctm * tension,
            modulus: self.modulus_at(age),
        }
    }

    /// The modulus at `age`, Pa.
    #[must_use]
    pub(crate) fn modulus_at(&self, age: f64) -> f64 {
        let exponent = match self.code {
            Code::Ec2 => 0.3,
            Code::Mc2010 => 0.5,
        };
        self.modulus * self.hardening(age).powf(exponent)
    }

    /// The values at 28 days.
    #[must_use]
    pub(crate) fn at_28_days(&self) -> Aged {
        Aged { fck: self.fck, fcm: self.fcm, fctm: self.fctm, modulus: self.modulus }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(class: &str) -> Properties {
        Given::from(class.parse::<Class>().unwrap()).complete().unwrap()
    }

    /// EN 1992-1-1, table 3.1 (rounded there to .1 MPa and 1 GPa).
    #[test]
    fn classes_are_those_of_the_table() {
        for (class, fctm, gpa, permille) in [
            ("C20/25", 2.2, 30.0, 2.0),
            ("C30/37", 2.9, 33.0, 2.2),
            ("C50/60", 4.1, 37.0, 2.45),
            ("C70/85", 4.6, 41.0, 2.7),
            ("C90/105", 5.0, 44.0, 2.8),
        ] {
            let p = of(class);
            assert!((p.fctm / MPA - fctm).abs() < 0.051, "{class} {}", p.fctm);
            assert!((p.modulus / 1e9 - gpa).abs() < 0.51, "{class} {}", p.modulus);
            assert!(
                (peak_strain(p.fcm) * 1e3 - permille).abs() < 0.051,
                "{class} {}",
                p.peak_strain
            );
        }
    }

    #[test]
    fn what_is_given_stays_and_what_is_assumed_is_listed() {
        let p = Given {
            fcm: Some(31e6),
            modulus: Some(25.85e9),
            fctm: Some(2.7e6),
            poisson: Some(0.18),
            ..Given::default()
        }
        .complete()
        .unwrap();
        assert_eq!((p.fcm, p.modulus, p.fctm, p.poisson), (31e6, 25.85e9, 2.7e6, 0.18));
        let names: Vec<_> = p.assumed.iter().map(|a| a.quantity).collect();
        assert!(
            names.contains(&"fck")
                && names.contains(&"fracture energy")
                && !names.contains(&"modulus")
                && !names.contains(&"fctm")
        );
        assert!((p.fracture_energy - 73.0 * 31f64.powf(0.18)).abs() < 1e-9);
    }

    #[test]
    fn strength_grows_with_age_as_in_the_code() {
        let p = of("C30/37");
        // s = .25: β_cc(7 d) = exp(−.25), β_cc(28 d) = 1, β_cc(∞) = exp(.25).
        assert!((p.hardening(7.0 * DAY) - (-0.25f64).exp()).abs() < 1e-12);
        assert!(
            (p.at(28.0 * DAY).fcm - p.fcm).abs() < 1e-6
                && (p.at(28.0 * DAY).modulus - p.modulus).abs() < 1e-3
        );
        assert!((p.hardening(1e9 * DAY) - 0.25f64.exp()).abs() < 1e-4);
        assert!(p.at(0.0).modulus > 0.0);
    }

    #[test]
    fn nonsense_is_refused() {
        for name in ["", "C", "30/37", "C37/30", "C1e9/2e9", "CNaN/NaN", "C30"] {
            assert!(matches!(name.parse::<Class>(), Err(Error::UnknownClass(_))), "{name}");
        }
        assert_eq!(Given::default().complete(), Err(Error::NoStrength));
        for bad in [f64::NAN, -1.0, 30.0] {
            assert!(Given { fcm: Some(bad), ..Given::default() }.complete().is_err());
            assert!(
                Given { fcm: Some(38e6), modulus: Some(bad), ..Given::default() }
                    .complete()
                    .is_err()
            );
        }
    }
}
