//! `intrados view`: the window.

use clap::CommandFactory;

use crate::{
    args::{Cli, View},
    failure::{Failure, Outcome},
};

pub(crate) fn run(args: &View) -> Result<Outcome, Failure> {
    if let Some(reason) = no_window() {
        eprintln!("intrados: {reason}");
        eprintln!("{}", Cli::command().render_help());
        return Err(Failure::Usage("no window: name a command, for example `intrados render column`".into()));
    }
    open(args)
}

/// Why there can be no window, if so.
fn no_window() -> Option<&'static str> {
    if cfg!(not(feature = "desktop")) {
        return Some("this program was built without its window (feature `desktop`)");
    }
    let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let is_blind = cfg!(all(unix, not(target_os = "macos"))) && !set("DISPLAY") && !set("WAYLAND_DISPLAY");
    is_blind.then_some("there is no display (DISPLAY and WAYLAND_DISPLAY are not set)")
}

#[cfg(feature = "desktop")]
fn open(args: &View) -> Result<Outcome, Failure> {
    if let Some(scene) =
        args.scene.as_ref().filter(|s| !s.exists() && intrados_scene::bundled().iter().all(|(n, _)| std::path::Path::new(n) != stem(s)))
    {
        return Err(Failure::NoInput(format!("{}: there is no such file or bundled scene: check the path", scene.display())));
    }
    intrados::desktop::run(args.scene.clone()).map_err(|e| Failure::Internal(format!("the window failed: {e:#}")))?;
    Ok(Outcome::Done)
}

/// A bundled scene may be named by its path in the repository.
#[cfg(feature = "desktop")]
fn stem(scene: &std::path::Path) -> std::path::PathBuf {
    scene.strip_prefix("scenes").map_or_else(|_| scene.to_path_buf(), |rest| rest.with_extension(""))
}

#[cfg(not(feature = "desktop"))]
fn open(_: &View) -> Result<Outcome, Failure> {
    Err(Failure::Usage("this program was built without its window".into()))
}
