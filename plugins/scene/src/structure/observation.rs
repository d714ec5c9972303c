//! What was measured or seen on a member: instruments held to it, cores taken from it, findings of
//! an inspection. What it says of damage is not told here.

use std::{fmt, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Date;

/// One thing that was measured or seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Id of the member.
    pub member: String,
    /// Name, unique within the member.
    pub name: String,
    /// When.
    pub date: Option<Date>,
    /// Where.
    pub spot: Spot,
    /// What it was measured with, for people.
    pub instrument: Option<String>,
    /// A photograph of it, JPEG or PNG.
    pub picture: Option<PathBuf>,
    /// What was found.
    pub shows: Shows,
}

/// Where on its member something was observed, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// From and to on the axis, 0 to 1; equal of a point, `[0, 1]` where nobody said.
    pub along: [f32; 2],
    /// Side, degrees about the axis, 0 to 360.
    pub angle_deg: Option<f32>,
    /// Above the lowest point of the member, m.
    pub height_m: Option<f32>,
}

impl Default for Spot {
    fn default() -> Self {
        Self { along: [0.0, 1.0], angle_deg: None, height_m: None }
    }
}

impl Spot {
    /// Whether anybody said where on the axis it is.
    #[must_use]
    pub fn is_placed(&self) -> bool {
        self.along != [0.0, 1.0]
    }
}

/// What was found. Every standard error is there: the one that was given, or the usual one of the
/// instrument.
#[derive(Debug, Clone, PartialEq)]
pub enum Shows {
    /// Concrete over the nearest steel, by a cover meter.
    Cover {
        /// mm.
        mm: f64,
        /// mm.
        std_error_mm: f64,
    },
    /// Rebound number of EN 12504-2: the median of one place's readings.
    Rebound {
        /// Without a unit.
        number: f64,
        /// Of the number.
        std_error: f64,
    },
    /// Velocity of an ultrasonic pulse by EN 12504-4.
    Velocity {
        /// m/s.
        m_s: f64,
        /// m/s.
        std_error_m_s: f64,
    },
    /// Compressive strength of a core as it was tested (EN 12504-1), for EN 13791 to assess.
    CoreStrength {
        /// MPa.
        mpa: f64,
        /// MPa.
        std_error_mpa: f64,
        /// mm.
        diameter_mm: f64,
        /// Of the core as tested, mm.
        length_mm: f64,
    },
    /// Potential of the steel by ASTM C876.
    HalfCell {
        /// Against copper/copper sulphate, whatever it was measured with, mV.
        mv: f64,
        /// mV.
        std_error_mv: f64,
        /// What it was measured with.
        electrode: Electrode,
    },
    /// Chlorides by depth, from dust or slices of a core (EN 14629).
    Chloride {
        /// Below the surface, middle of each sample, rising, mm.
        depths_mm: Vec<f64>,
        /// Of each sample, % of the mass of cement.
        percent_of_cement: Vec<f64>,
        /// Of each of these, % of the mass of cement.
        std_error_percent: f64,
    },
    /// Depth of carbonation by phenolphthalein (EN 14630).
    Carbonation {
        /// mm.
        mm: f64,
        /// mm.
        std_error_mm: f64,
    },
    /// Area that sounds hollow under the hammer.
    Sounding {
        /// m².
        hollow_m2: f64,
        /// Area that was tapped, m².
        tapped_m2: f64,
    },
    /// A crack.
    Crack {
        /// On the surface, mm.
        width_mm: f64,
        /// mm.
        std_error_mm: f64,
        /// How it runs.
        course: Course,
        /// m.
        length_m: Option<f64>,
    },
    /// Concrete that has come off.
    Spall {
        /// m².
        area_m2: f64,
        /// mm.
        depth_mm: Option<f64>,
        /// Whether steel lies bare in it.
        bars_bare: bool,
    },
    /// Stains of rust.
    Rust {
        /// m².
        area_m2: f64,
    },
    /// Lime and salts brought out by water.
    Efflorescence {
        /// m².
        area_m2: f64,
    },
    /// A wet spot.
    WetSpot {
        /// m².
        area_m2: f64,
    },
    /// It was looked at there, and nothing was found.
    Intact {
        /// Share of the surface there that was looked at, 0 to 1.
        seen: f64,
        /// Half of all cracks of this width would have been found, mm.
        limit_mm: f64,
    },
}

/// Reference electrodes of half-cell potentials.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Electrode {
    /// Copper in saturated copper sulphate, as ASTM C876 takes it.
    #[default]
    CopperSulphate,
    /// Silver in silver chloride, saturated potassium chloride.
    SilverChloride,
    /// Saturated calomel.
    Calomel,
}

impl Electrode {
    /// Its potential against the standard hydrogen electrode at 25 °C, mV: 318, 197 and 241, as
    /// tables of reference electrodes have it. Other fillings of silver chloride differ by up to
    /// 90 mV: convert those yourself.
    const fn against_hydrogen(self) -> f64 {
        match self {
            Self::CopperSulphate => 318.0,
            Self::SilverChloride => 197.0,
            Self::Calomel => 241.0,
        }
    }

    /// What a potential measured with it would be against copper/copper sulphate, mV.
    #[must_use]
    pub(crate) fn to_copper_sulphate(self, mv: f64) -> f64 {
        mv + (self.against_hydrogen() - Self::CopperSulphate.against_hydrogen())
    }

    /// Its name, for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CopperSulphate => "Cu/CuSO₄",
            Self::SilverChloride => "Ag/AgCl",
            Self::Calomel => "calomel",
        }
    }
}

/// How a crack runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Course {
    /// Along the member's axis, as over a bar.
    Along,
    /// Across it.
    Across,
    /// Slanting, as from shear.
    Diagonal,
    /// A net of them.
    Map,
}

impl Course {
    /// Its name, for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Diagonal => "diagonal",
            Self::Map => "map",
        }
    }
}

/// Usual standard errors of instruments, for what gives none. Where a standard states a tolerance,
/// it counts as two standard errors; what no standard states is ours, and says so.
pub mod usual {
    /// Cover meter, mm: 2 mm or 10 %, whichever is more. BS 1881-204 asks for 2 mm or 5 % at a
    /// single bar in the laboratory, as a bound; beside other bars and through rough faces it is
    /// about four times that (ours).
    #[must_use]
    pub fn cover_mm(mm: f64) -> f64 {
        f64::max(2.0, 0.1 * mm)
    }

    /// Rebound number: 2. Hammers of one design differ by 1 to 3 (ASTM C805, 5.3); the median of
    /// nine readings of one place adds little to that.
    pub(crate) const REBOUND: f64 = 2.0;

    /// Pulse velocity, m/s: 2 %. EN 12504-4 asks for the path's length and the time of travel to
    /// 1 % each; contact and moisture make it two (ours).
    #[must_use]
    pub fn velocity_m_s(m_s: f64) -> f64 {
        0.02 * m_s
    }

    /// Strength of a core, MPa: 5 %, of drilling, preparing and testing in one laboratory (ours;
    /// what one core says of its member scatters more, and is no error of the test).
    #[must_use]
    pub(crate) fn core_mpa(mpa: f64) -> f64 {
        0.05 * mpa
    }

    /// Half-cell potential, mV: 10. By ASTM C876 two electrodes at one place should not differ by
    /// more than 20 mV.
    pub(crate) const HALF_CELL_MV: f64 = 10.0;

    /// Chloride, % of the mass of cement: .03 or 10 % of the profile's mean, whichever is more, of
    /// taking the dust and analysing it (ours).
    #[must_use]
    pub(crate) fn chloride_percent(mean: f64) -> f64 {
        f64::max(0.03, 0.1 * mean)
    }

    /// Depth of carbonation, mm: 1 mm or 10 %, whichever is more. The front is read to a millimetre
    /// and waves around aggregate (ours).
    #[must_use]
    pub fn carbonation_mm(mm: f64) -> f64 {
        f64::max(1.0, 0.1 * mm)
    }

    /// Half of all cracks of this width an eye finds, mm (ours).
    pub const FOUND_MM: f64 = 0.15;

    /// Width of a crack, mm: .05, the step of a crack card, or 10 %, whichever is more, since it
    /// changes along the crack (ours).
    #[must_use]
    pub fn crack_mm(mm: f64) -> f64 {
        f64::max(0.05, 0.1 * mm)
    }
}

impl Shows {
    /// Its kind, as in files and tables.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Cover { .. } => "cover",
            Self::Rebound { .. } => "rebound",
            Self::Velocity { .. } => "velocity",
            Self::CoreStrength { .. } => "core strength",
            Self::HalfCell { .. } => "half-cell",
            Self::Chloride { .. } => "chloride",
            Self::Carbonation { .. } => "carbonation",
            Self::Sounding { .. } => "sounding",
            Self::Crack { .. } => "crack",
            Self::Spall { .. } => "spall",
            Self::Rust { .. } => "rust",
            Self::Efflorescence { .. } => "efflorescence",
            Self::WetSpot { .. } => "wet spot",
            Self::Intact { .. } => "intact",
        }
    }
}

/// The value with its unit, for people: `32 ± 3.2 mm`.
impl fmt::Display for Shows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cover { mm, std_error_mm } | Self::Carbonation { mm, std_error_mm } => {
                write!(f, "{mm} ± {} mm", short(*std_error_mm))
            }
            Self::Rebound { number, std_error } => write!(f, "{number} ± {}", short(*std_error)),
            Self::Velocity { m_s, std_error_m_s } => {
                write!(f, "{m_s} ± {} m/s", short(*std_error_m_s))
            }
            Self::CoreStrength { mpa, std_error_mpa, diameter_mm, length_mm } => {
                let error = short(*std_error_mpa);
                write!(f, "{mpa} ± {error} MPa (core {diameter_mm} × {length_mm} mm)")
            }
            Self::HalfCell { mv, std_error_mv, .. } => {
                write!(f, "{mv} ± {} mV (Cu/CuSO₄)", short(*std_error_mv))
            }
            Self::Chloride { depths_mm, percent_of_cement, std_error_percent } => {
                let at =
                    |(depth, percent): (&f64, &f64)| format!("{} at {depth} mm", short(*percent));
                let all: Vec<_> = depths_mm.iter().zip(percent_of_cement).map(at).collect();
                write!(f, "{} ± {} % of cement", all.join(", "), short(*std_error_percent))
            }
            Self::Sounding { hollow_m2, tapped_m2 } => {
                write!(f, "{hollow_m2} of {tapped_m2} m² hollow")
            }
            Self::Crack { width_mm, std_error_mm, course, length_m } => {
                write!(f, "{width_mm} ± {} mm, {}", short(*std_error_mm), course.name())?;
                length_m.map_or(Ok(()), |length| write!(f, ", {length} m long"))
            }
            Self::Spall { area_m2, depth_mm, bars_bare } => {
                write!(f, "{area_m2} m²")?;
                depth_mm.map_or(Ok(()), |depth| write!(f, ", {depth} mm deep"))?;
                f.write_str(if *bars_bare { ", bars bare" } else { "" })
            }
            Self::Rust { area_m2 }
            | Self::Efflorescence { area_m2 }
            | Self::WetSpot { area_m2 } => write!(f, "{area_m2} m²"),
            Self::Intact { .. } => f.write_str("nothing found"),
        }
    }
}

/// A number with no more digits than matter, for people.
fn short(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ASTM C876's −350 mV against copper sulphate is about −270 against calomel.
    #[test]
    fn potentials_are_converted() {
        assert_eq!(Electrode::Calomel.to_copper_sulphate(-273.0), -350.0);
        assert_eq!(Electrode::SilverChloride.to_copper_sulphate(-229.0), -350.0);
        assert_eq!(Electrode::CopperSulphate.to_copper_sulphate(-350.0), -350.0);
    }

    #[test]
    fn values_are_said_with_unit_and_error() {
        let cover = Shows::Cover { mm: 32.0, std_error_mm: usual::cover_mm(32.0) };
        assert_eq!(cover.to_string(), "32 ± 3.2 mm");
        let spall = Shows::Spall { area_m2: 0.2, depth_mm: Some(30.0), bars_bare: true };
        assert_eq!(spall.to_string(), "0.2 m², 30 mm deep, bars bare");
    }
}
