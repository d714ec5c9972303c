//! Intrados, put together: every plugin in one [`App`](bevy_app::App), without a window or with one.

#[cfg(feature = "desktop")]
pub mod desktop;

use bevy_app::App;
use intrados_ct::detect::{self, Method};
use intrados_damage::predict::Settings;

/// All plugins that know no window. Add your own to it, and call [`App::update`](bevy_app::App::update) for each frame.
pub fn simulation() -> App {
    let mut app = App::new();
    app.add_plugins((
        intrados_stage::StagePlugin,
        intrados_scene::ScenePlugin,
        intrados_light::LightPlugin::default(),
        intrados_mechanics::MechanicsPlugin,
        intrados_xray::XrayPlugin,
        intrados_damage::DamagePlugin { settings: predicting() },
    ));
    app
}

/// How damage is predicted unless somebody says otherwise: slices by the network.
pub fn predicting() -> Settings {
    let detect = detect::Settings { method: Method::Network, ..detect::Settings::default() };
    Settings { detect, ..Settings::default() }
}
