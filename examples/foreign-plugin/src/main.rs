//! Intrados with one plugin more: `work-light SCENE`.

use work_light::WorkLightPlugin;

#[cfg(feature = "desktop")]
fn main() -> anyhow::Result<()> {
    let build = || {
        let mut app = intrados::simulation();
        app.add_plugins((intrados_panels::PanelsPlugin::desktop(), WorkLightPlugin::default()));
        app
    };
    intrados::desktop::run_app(build, std::env::args_os().nth(1).map(Into::into))
}

#[cfg(not(feature = "desktop"))]
fn main() -> anyhow::Result<()> {
    let mut app = intrados::simulation();
    app.add_plugins(WorkLightPlugin::default());
    let scene = std::env::args_os().nth(1).unwrap_or_else(|| "column".into());
    let light = work_light::read(&mut app, scene.into(), 50)?;
    let (lux, error) = light.lux.ok_or_else(|| anyhow::anyhow!("no light has been found"))?;
    println!("{lux:.0} ± {error:.0} lx, {} lx asked for", light.needed);
    Ok(())
}
