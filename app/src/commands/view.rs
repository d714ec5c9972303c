//! `intrados view`: the window.

#[cfg(feature = "desktop")]
use std::{error::Error, path::Path, sync::Arc};

#[cfg(feature = "desktop")]
use bevy_app::App;
use clap::CommandFactory;
#[cfg(feature = "desktop")]
use intrados_light::Render;
#[cfg(feature = "desktop")]
use intrados_panels::{Exporter, PanelsPlugin};

use crate::{
    args::{Cli, View},
    console::say,
    failure::{Failure, Outcome},
    session::Session,
};
#[cfg(feature = "desktop")]
use crate::{output, picture};

pub(crate) fn run(session: &Session, args: &View) -> Result<Outcome, Failure> {
    if let Some(reason) = no_window() {
        say(format_args!("intrados: {reason}"));
        say(Cli::command().render_help());
        return Err(Failure::Usage(
            "no window: name a command, for example `intrados render column`".into(),
        ));
    }
    open(session, args)
}

/// Why there can be no window, if so.
pub(super) fn no_window() -> Option<&'static str> {
    if cfg!(not(feature = "desktop")) {
        return Some("this program was built without its window (feature `desktop`)");
    }
    let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let is_blind =
        cfg!(all(unix, not(target_os = "macos"))) && !set("DISPLAY") && !set("WAYLAND_DISPLAY");
    is_blind.then_some("there is no display (DISPLAY and WAYLAND_DISPLAY are not set)")
}

#[cfg(feature = "desktop")]
fn open(session: &Session, args: &View) -> Result<Outcome, Failure> {
    if let Some(scene) = &args.scene {
        exists(scene)?;
    }
    let build = builder(session, PanelsPlugin::desktop());
    crate::desktop::run_app(build, args.scene.clone())
        .map_err(|e| Failure::Internal(format!("the window failed: {e:#}")))?;
    Ok(Outcome::Done)
}

/// Refuses what is neither a file nor a bundled scene.
#[cfg(feature = "desktop")]
pub(super) fn exists(scene: &Path) -> Result<(), Failure> {
    if scene.exists() || intrados_scene::bundled().iter().any(|(n, _)| Path::new(n) == stem(scene))
    {
        return Ok(());
    }
    Err(Failure::NoInput(format!(
        "{}: there is no such file or bundled scene: check the path",
        scene.display()
    )))
}

/// What makes the window's app.
#[cfg(feature = "desktop")]
pub(super) fn builder(session: &Session, panels: PanelsPlugin) -> impl Fn() -> App + 'static {
    let (access, build) = (session.access.clone(), session.build.clone());
    move || {
        let mut app = build();
        app.insert_resource(access.clone());
        app.add_plugins(panels.clone()).insert_resource(Exporter(Arc::new(write_exr)));
        app
    }
}

/// The picture of the window as EXR, as `intrados render` writes it.
#[cfg(feature = "desktop")]
fn write_exr(render: &Render, path: &Path) -> Result<(), Box<dyn Error + Send + Sync>> {
    let scene = &render.lit().scene;
    let facts = vec![
        ("intrados.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("intrados.scene", scene.name.clone()),
        ("intrados.sceneHash", scene.hash.clone()),
        ("intrados.camera", render.camera().name.clone()),
        ("intrados.samples", format!("{}", render.samples_per_pixel())),
        ("intrados.unit", "W/(m2 sr)".to_owned()),
    ];
    Ok(picture::exr(render.plate(), &facts).and_then(|bytes| output::put(path, &bytes))?)
}

/// A bundled scene may be named by its path in the repository.
#[cfg(feature = "desktop")]
fn stem(scene: &Path) -> std::path::PathBuf {
    scene
        .strip_prefix("scenes")
        .map_or_else(|_| scene.to_path_buf(), |rest| rest.with_extension(""))
}

#[cfg(not(feature = "desktop"))]
fn open(_: &Session, _: &View) -> Result<Outcome, Failure> {
    Err(Failure::Usage("this program was built without its window".into()))
}
