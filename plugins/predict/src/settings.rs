use intrados_ct::detect;
use intrados_damage::grading::Profile;
use intrados_forecast as forecast;
use intrados_gauges as gauges;

/// How to predict.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictSettings {
    /// How slices are read.
    pub detect: detect::DetectSettings,
    /// How sections become damage and damage becomes a state.
    pub profile: Profile,
    /// How lives in finite elements are computed; none: nothing is foretold.
    pub forecast: Option<forecast::ForecastSettings>,
    /// Whether what members bear is computed, and what their damage costs of that.
    pub strength: bool,
    /// How readings are made where nobody read the gauges of a member whose damage is planted.
    pub simulation: gauges::Simulation,
    /// Whether a bad slice ends the work, instead of being left out.
    pub strict: bool,
}

impl Default for PredictSettings {
    fn default() -> Self {
        Self {
            detect: detect::DetectSettings::default(),
            profile: Profile::default(),
            forecast: Some(forecast::ForecastSettings::default()),
            strength: false,
            simulation: gauges::Simulation::default(),
            strict: false,
        }
    }
}
