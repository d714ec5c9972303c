//! Intrados, put together: every plugin in one [`App`](bevy_app::App), without a window or with one.

#[cfg(feature = "desktop")]
pub mod desktop;

use bevy_app::App;

/// All plugins that know no window. Add your own to it, and call [`App::update`](bevy_app::App::update) for each frame.
pub fn simulation() -> App {
    let mut app = App::new();
    app.add_plugins((
        intrados_stage::StagePlugin,
        intrados_scene::ScenePlugin,
        intrados_light::LightPlugin::default(),
        intrados_mechanics::MechanicsPlugin,
        intrados_xray::XrayPlugin,
        intrados_damage::DamagePlugin::default(),
    ));
    app
}
