//! What the window takes from the machine that it runs on.

use std::path::PathBuf;

use bevy_ecs::prelude::*;

/// All that depends on the machine comes through [`PanelsPlugin`](crate::PanelsPlugin), so that a
/// window without such settings looks the same everywhere.
#[derive(Resource)]
pub(crate) struct MachineSetup {
    /// Where folders of new structures are proposed.
    pub(crate) documents: Option<PathBuf>,
    /// The program that prints reports as PDF.
    pub(crate) pdf_printer: Option<PathBuf>,
}
