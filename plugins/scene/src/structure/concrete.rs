//! Concrete, when it was poured, the air about it and what attacks it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a member is of that is no concrete. What bears tension is computed as elastic up to its
/// strength; what is brittle is computed as concrete all the same, and that is said wherever its
/// concrete is named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Matter {
    /// What people call it, such as `Steel S355`.
    pub name: String,
    /// Young's modulus, GPa; of wood along the grain.
    pub modulus_gpa: f32,
    /// Poisson's ratio.
    pub poisson: f32,
    /// kg/m³.
    pub density_kg_m3: f32,
    /// Thermal expansion, 1e-6/K; of wood along the grain.
    #[serde(default = "as_concrete")]
    pub expansion_1e6_k: f32,
    /// Characteristic strength of what bears tension as it bears compression (metal, and wood along
    /// the grain in bending), MPa; none: it is brittle.
    #[serde(default)]
    pub strength_mpa: Option<f32>,
}

/// Mean tensile strength of EN 1992-1-1, table 3.1, by the characteristic strength, MPa both.
#[must_use]
pub(crate) fn fctm(fck: f64) -> f64 {
    if fck <= 50.0 { 0.3 * fck.powf(2.0 / 3.0) } else { 2.12 * (1.0 + (fck + 8.0) / 10.0).ln() }
}

/// EN 1992-1-1, 3.1.3 (5).
fn as_concrete() -> f32 {
    10.0
}

impl Matter {
    /// What people call it, and as what it is computed.
    #[must_use]
    pub fn computed_as(&self, concrete: &str) -> String {
        let law = if self.strength_mpa.is_some() { "elastic" } else { concrete };
        format!("{}, computed as {law}", self.name)
    }
}

/// A concrete that is no class of Eurocode 2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Concrete {
    /// Name that members refer to.
    pub name: String,
    /// Characteristic cylinder strength, MPa. What is not given follows from it by the code.
    pub fck_mpa: f32,
    /// Whose rules give what is not given, creep, shrinkage and growth of strength.
    #[serde(default)]
    pub code: Code,
    /// Mean cylinder strength where it was measured, MPa; f_ck + 8 where it was not.
    #[serde(default)]
    pub fcm_mpa: Option<f32>,
    /// Mean tensile strength, MPa.
    #[serde(default)]
    pub fctm_mpa: Option<f32>,
    /// Secant modulus, GPa; by Model Code 2010 the tangent at the origin.
    #[serde(default)]
    pub ecm_gpa: Option<f32>,
    /// Standard error of that modulus where it was measured, GPa; without it the modulus counts as
    /// assumed, wherever it matters how sure it is.
    #[serde(default)]
    pub ecm_error_gpa: Option<f32>,
    /// Poisson's ratio.
    #[serde(default)]
    pub poisson: Option<f32>,
    /// kg/m³.
    #[serde(default)]
    pub density_kg_m3: Option<f32>,
    /// Fracture energy, N/m.
    #[serde(default)]
    pub fracture_n_m: Option<f32>,
    /// Cement class of Eurocode 2.
    #[serde(default)]
    pub cement: Cement,
    /// Heat that it makes while it hardens; none: none is computed.
    #[serde(default)]
    pub hydration: Option<Hydration>,
}

/// Whose rules a concrete follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum Code {
    /// EN 1992-1-1: 3.1 and Annex B.
    #[default]
    Ec2,
    /// fib Model Code 2010: 5.1, creep by 5.1.9.4 (basic and drying).
    Mc2010,
}

/// Heat of hydration: Q(t) = cement · heat · (1 − exp(−t/time)), t at 20 °C.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hydration {
    /// Cement in the concrete, kg/m³.
    pub cement_kg_m3: f32,
    /// Heat of the cement, kJ/kg.
    #[serde(default = "heat")]
    pub heat_kj_kg: f32,
    /// Time in which 63 % of it comes at 20 °C, days.
    #[serde(default = "a_day")]
    pub time_days: f32,
}

fn heat() -> f32 {
    350.0
}

fn a_day() -> f32 {
    1.0
}

/// Cement classes of Eurocode 2: how fast it hardens.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Cement {
    /// Slow.
    S,
    /// Normal.
    #[default]
    N,
    /// Rapid.
    R,
}

/// A part that is poured at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pour {
    /// From, on the axis, 0 to 1.
    pub from: f32,
    /// To, on the axis, 0 to 1.
    pub to: f32,
    /// Which angles, degrees; all around where there is none.
    #[serde(default)]
    pub angles_deg: Option<(f32, f32)>,
    /// When.
    pub at_days: f32,
    /// Fresh concrete, °C.
    #[serde(default = "twenty")]
    pub temperature_c: f32,
}

fn twenty() -> f32 {
    20.0
}

/// What attacks a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exposure {
    /// Class of EN 206, for example `XD3`; or several, `XC4, XD3, XF4`.
    pub class: String,
    /// Chlorides, from de-icing salt or sea water. Without them the class alone speaks: salt in XD
    /// and XS, carbonic acid in XC, by assumed values.
    #[serde(default)]
    pub chloride: Option<Chloride>,
    /// How long until now, years.
    #[serde(default)]
    pub years: f32,
}

impl Exposure {
    /// The classes that EN 206 knows.
    pub const CLASSES: [&str; 18] = [
        "X0", "XC1", "XC2", "XC3", "XC4", "XD1", "XD2", "XD3", "XS1", "XS2", "XS3", "XF1", "XF2",
        "XF3", "XF4", "XA1", "XA2", "XA3",
    ];

    /// Its classes one by one.
    pub fn classes(&self) -> impl Iterator<Item = &str> {
        self.class.split(|c: char| !c.is_ascii_alphanumeric()).filter(|c| !c.is_empty())
    }
}

/// Diffusion of chlorides, C = C₀ + (C_s − C₀)(1 − erf(x / 2√(D t))), D = D₂₈ (28 d / t)^a, and
/// what they do to steel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chloride {
    /// C_s, % of binder mass.
    pub surface_percent: f32,
    /// C₀, % of binder mass.
    #[serde(default)]
    pub initial_percent: f32,
    /// D at 28 days, 1e-12 m²/s.
    pub diffusion_1e12_m2_s: f32,
    /// a.
    #[serde(default)]
    pub ageing: f32,
    /// At which steel begins to corrode, % of binder mass.
    #[serde(default = "critical")]
    pub critical_percent: f32,
    /// Corrosion current afterwards, µA/cm².
    #[serde(default = "current")]
    pub current_ua_cm2: f32,
}

fn critical() -> f32 {
    0.6
}

fn current() -> f32 {
    1.0
}

/// Air about the members.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Climate {
    /// Relative, %.
    #[serde(default = "humidity")]
    pub humidity_percent: f32,
    /// °C.
    #[serde(default = "twenty")]
    pub temperature_c: f32,
}

fn humidity() -> f32 {
    65.0
}

impl Default for Climate {
    fn default() -> Self {
        Self { humidity_percent: humidity(), temperature_c: twenty() }
    }
}
