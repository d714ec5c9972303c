//! Carbonic acid from the air: how deep it has neutralised the cover, which is when steel loses its
//! skin.
//!
//! x_c(t) = √(2 k_e k_c R⁻¹ C_s) √t W(t), R⁻¹ = k_t R_ACC,0⁻¹ + ε_t (fib Bulletin 34, annex B1; fib
//! MC2010, 7.8.3), with k_e = ((1 − RH⁵)/(1 − .65⁵))^2.5, k_c = (t_c/7 d)^−.567 and W(t) =
//! (t₀/t)^w, w = (p_SR ToW)^.446/2, t₀ = 28 days.

use super::{DAY, Error, YEAR, checked};

/// mm²/a per kg/m³, the unit of the code, in m²/s per kg/m³.
const RESISTANCE: f64 = 1e-6 / YEAR;

/// A front of carbonation on its way into concrete.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front {
    /// x_c/(√t W), m/√s.
    pub rate: f64,
    /// Exponent w of the weather, 0 where no rain falls.
    pub weather: f64,
}

impl Front {
    /// `resistance`: R⁻¹, (mm²/a)/(kg/m³); `environment`, `execution`: k_e, k_c; `carbon_dioxide`:
    /// C_s, kg/m³; `weather`: w.
    ///
    /// # Errors
    /// A factor is negative or without bounds, or w not in 0..=.45.
    pub(crate) fn new(
        resistance: f64,
        environment: f64,
        execution: f64,
        carbon_dioxide: f64,
        weather: f64,
    ) -> Result<Self, Error> {
        checked(
            "inverse carbonation resistance",
            resistance,
            0.0,
            1e6,
            "0 to 1e6 mm²/a per kg/m³",
        )?;
        checked("k_e of carbonation", environment, 0.0, 10.0, "0 to 10")?;
        checked("k_c of carbonation", execution, 0.0, 20.0, "0 to 20")?;
        checked("carbon dioxide", carbon_dioxide, 0.0, 2.0, "0 to 2 kg/m³")?;
        checked("exponent of the weather", weather, 0.0, 0.45, "0 to 0.45")?;
        Ok(Self {
            rate: (2.0 * environment * execution * resistance * RESISTANCE * carbon_dioxide).sqrt(),
            weather,
        })
    }

    /// Depth of the front after `time` (s), m.
    #[must_use]
    pub fn depth(&self, time: f64) -> f64 {
        let time = time.max(0.0);
        if time > 0.0 {
            self.rate * time.sqrt() * (28.0 * DAY / time).powf(self.weather)
        } else {
            0.0
        }
    }

    /// When the front reaches `cover` (m), s; infinite if it never does.
    #[must_use]
    pub(crate) fn initiation(&self, cover: f64) -> f64 {
        if cover <= 0.0 {
            return 0.0;
        }
        (cover / (self.rate * (28.0 * DAY).powf(self.weather))).powf(1.0 / (0.5 - self.weather))
    }
}

/// k_e of a relative humidity (0 to 1).
#[must_use]
pub(crate) fn environment(humidity: f64) -> f64 {
    ((1.0 - humidity.clamp(0.0, 1.0).powi(5)) / (1.0 - 0.65_f64.powi(5))).powf(2.5)
}

/// k_c of a time of curing, days.
#[must_use]
pub(crate) fn execution(days: f64) -> f64 {
    (days.max(1.0) / 7.0).powf(-0.567)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: R⁻¹ = 1.25 · 6.8e-11 m²/s·m³/kg · 3.15576e13 + 315.5 = 2997.9 mm²/a per kg/m³; 65
    /// %, seven days, .00082 kg/m³: √(2 · 2997.9 · .00082) = 2.2173 mm/√a, 11.09 mm in 25 years,
    /// and 25 mm are reached after (25/2.2173)² = 127.1 years.
    #[test]
    fn the_root_of_time_by_hand() {
        let inverse = 1.25 * 6.8e-11 / RESISTANCE + 315.5;
        assert!((inverse - 2997.9).abs() < 0.1, "{inverse}");
        let front = Front::new(inverse, environment(0.65), execution(7.0), 8.2e-4, 0.0).unwrap();
        assert!((1e3 * front.depth(25.0 * YEAR) - 11.087).abs() < 2e-3);
        assert!((front.initiation(0.025) / YEAR - 127.1).abs() < 0.1);
        assert!(Front::new(f64::NAN, 1.0, 1.0, 8e-4, 0.0).is_err());
    }

    /// k_e(.8) = ((1 − .32768)/(1 − .1160291))^2.5 = .50448; k_c(3) = (3/7)^−.567 = 1.6168; rain on
    /// 30 % of days, one in ten against it: w = .03^.446/2 = .10465.
    #[test]
    fn factors_by_hand() {
        assert!(
            (environment(0.8) - 0.50448).abs() < 1e-4 && (environment(0.65) - 1.0).abs() < 1e-12
        );
        assert!((execution(3.0) - 1.6168).abs() < 1e-4);
    }

    /// Rain slows the front, and arrival is the inverse of depth.
    #[test]
    fn arrival_is_the_inverse_of_depth() {
        for w in [0.0, 0.1, 0.25] {
            let front = Front::new(3000.0, 0.6, 1.3, 8.2e-4, w).unwrap();
            let t = front.initiation(0.03);
            assert!((front.depth(t) / 0.03 - 1.0).abs() < 1e-9, "{w}");
            assert!(
                w == 0.0
                    || front.depth(30.0 * YEAR)
                        < Front { weather: 0.0, ..front }.depth(30.0 * YEAR)
            );
        }
        assert_eq!((Front { rate: 0.0, weather: 0.0 }).initiation(0.03), f64::INFINITY);
    }
}
