//! The window: not here yet.

/// Opens the window.
pub(crate) fn run(_scene: Option<std::path::PathBuf>) -> anyhow::Result<()> {
    anyhow::bail!("it is not built yet")
}
