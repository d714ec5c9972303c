//! Intrados, put together: every plugin in one [`App`], and the command line and the window that
//! drive it. Another team's program is three lines:
//!
//! ```no_run
//! use std::process::ExitCode;
//!
//! fn main() -> ExitCode {
//!     intrados::main(|| {
//!         let mut app = intrados::simulation();
//!         // app.add_plugins(TheirPlugin).add_evidence(TheirInstrument);
//!         app
//!     })
//! }
//! ```

#![warn(
    clippy::print_stderr,
    reason = "it panics where stderr is full, and a result is lost: `console::say`"
)]

mod accumulator;
mod args;
mod commands;
mod console;
#[cfg(feature = "desktop")]
pub mod desktop;
mod drive;
pub mod embedded;
mod failure;
mod options;
mod output;
mod picture;
mod processor;
mod progress;
mod sealed;
mod session;

use std::{process::ExitCode, sync::Arc};

// Not used here: for one build of `parquet`, with the window and without; see `stage`.
use ahash as _;

use bevy_app::App;
use intrados_ct::detect::{self, Method};
use intrados_predict::PredictSettings;

/// Runs the program for the arguments of this process. `build` makes the [`App`] that it works
/// with: [`simulation`] and whatever else plugins bring.
pub fn main(build: impl Fn() -> App + Send + Sync + 'static) -> ExitCode {
    processor::check();
    run(Arc::new(build))
}

/// What makes an [`App`].
type Build = Arc<dyn Fn() -> App + Send + Sync>;

/// A function of its own: nothing of it may be moved before the check.
#[inline(never)]
fn run(build: Build) -> ExitCode {
    match options::read(std::env::args_os()) {
        Ok(cli) => session::run(&cli, build, commands::run),
        Err(options::Unread::Words(error)) => error.exit(),
        Err(options::Unread::Unused(line)) => {
            console::say(format_args!("intrados: {line}"));
            ExitCode::from(failure::Failure::Usage(line).code())
        }
    }
}

/// All plugins that know no window. Add your own to it, and call [`App::update`] for each frame.
pub fn simulation() -> App {
    let mut app = App::new();
    app.add_plugins((
        intrados_stage::StagePlugin,
        intrados_scene::ScenePlugin,
        intrados_light::LightPlugin::default(),
        intrados_mechanics::MechanicsPlugin,
        intrados_xray::XrayPlugin,
        intrados_predict::PredictPlugin { settings: predicting() },
    ));
    app
}

/// How damage is predicted unless somebody says otherwise: slices by the network.
pub fn predicting() -> PredictSettings {
    let detect =
        detect::DetectSettings { method: Method::Network, ..detect::DetectSettings::default() };
    PredictSettings { detect, ..PredictSettings::default() }
}
