//! Heat of hardening concrete, and the constants of its conduction.

use super::creep::maturity_rate;
use super::{DAY, Error, checked};

/// Conductivity of mature concrete at 20 °C, W/(m·K), between the limits of EN 1992-1-2 §3.3.3
/// (1.33 and 1.95).
pub(crate) const CONDUCTIVITY: f64 = 1.6;

/// Specific heat of dry concrete at 20 °C, J/(kg·K) (EN 1992-1-2 §3.3.2).
pub(crate) const SPECIFIC_HEAT: f64 = 900.0;

/// Heat of hydration: Q(t_e) = Q_∞ (1 − e^(−t_e/τ)) with the equivalent age t_e = ∫ exp(13.65 −
/// 4000 K/T) dt, the clock of EN 1992-1-1 (B.10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hydration {
    /// All of the heat, J/m³ of concrete.
    pub heat: f64,
    /// Time in which 63 % of it comes at 20 °C, s.
    pub time: f64,
}

impl Hydration {
    /// `cement` kg/m³ of `heat` J/kg (3.5e5 for CEM I 42.5, say) that comes in `time` s (one day,
    /// say).
    ///
    /// # Errors
    ///
    /// For values that no cement has.
    pub(crate) fn new(cement: f64, heat: f64, time: f64) -> Result<Self, Error> {
        checked("cement content", cement, 0.0, 1000.0, "0 to 1000 kg/m³")?;
        checked("heat of the cement", heat, 0.0, 6e5, "0 to 6e5 J/kg")?;
        checked(
            "time of hydration",
            time,
            0.01 * DAY,
            100.0 * DAY,
            "0.01 to 100 days, in seconds",
        )?;
        Ok(Self { heat: cement * heat, time })
    }

    /// Adiabatic rise of temperature after all of the heat, K.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn adiabatic_rise(&self, density: f64, specific_heat: f64) -> f64 {
        self.heat / (density * specific_heat)
    }

    /// Heat, J/m³, that comes in a step of `duration` (s) at `temperature` (K) from the equivalent
    /// age `age` (s), and the equivalent age at its end. What is summed over steps is exactly Q.
    #[must_use]
    pub(crate) fn released(&self, age: f64, duration: f64, temperature: f64) -> (f64, f64) {
        let end = age + duration * maturity_rate(temperature);
        (self.heat * (-age / self.time).exp() * -(-(end - age) / self.time).exp_m1(), end)
    }

    /// Heat source, W/m³, at the equivalent age and temperature.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn rate(&self, age: f64, temperature: f64) -> f64 {
        self.heat / self.time * (-age / self.time).exp() * maturity_rate(temperature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_the_heat_comes_and_no_more() {
        let cement = Hydration::new(350.0, 3.5e5, DAY).unwrap();
        for steps in [10, 1000] {
            let (mut age, mut sum) = (0.0, 0.0);
            for k in 0..steps {
                let (heat, next) =
                    cement.released(age, 60.0 * DAY / f64::from(steps), 283.0 + f64::from(k % 20));
                (age, sum) = (next, sum + heat);
            }
            assert!((sum / cement.heat - 1.0).abs() < 1e-9);
        }
        let (step, _) = cement.released(DAY, 1.0, 303.0);
        assert!((step / cement.rate(DAY, 303.0) - 1.0).abs() < 1e-4);
        assert!(cement.rate(0.0, 313.15) > 2.0 * cement.rate(0.0, 293.15));
    }

    /// 350 kg/m³ of 350 kJ/kg in 2400 kg/m³ of 900 J/(kg·K): 56.7 K, and an adiabatic run gets
    /// there.
    #[test]
    fn adiabatic_run_reaches_its_rise() {
        let cement = Hydration::new(350.0, 3.5e5, DAY).unwrap();
        assert!((cement.adiabatic_rise(2400.0, SPECIFIC_HEAT) - 56.713).abs() < 1e-3);
        let (mut age, mut temperature) = (0.0, 293.15);
        for _ in 0..5000 {
            let (heat, next) = cement.released(age, 600.0, temperature);
            (age, temperature) = (next, temperature + heat / (2400.0 * SPECIFIC_HEAT));
        }
        assert!((temperature - 293.15 - 56.713).abs() < 1e-3, "{temperature}");
    }
}
