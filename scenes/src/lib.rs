//! The scenes that the program carries with it, as files that run as they are (`intrados predict
//! scenes/column.ron`) and as text within every build.

/// A table of names and what stands in their files.
macro_rules! scenes {
    ($($name:literal),*) => { &[$(($name, include_str!(concat!("../", $name, ".ron")))),*] };
}

/// Name and text of each bundled scene: those of the three kinds of structures first, then bodies for
/// scanners, then rooms for light.
///
/// ```
/// let (name, text) = intrados_scenes::BUNDLED[0];
/// assert!(name == "column" && text.contains("intrados.scene/1"));
/// ```
pub const BUNDLED: &[(&str, &str)] = scenes!(
    "column",
    "beam",
    "tunnel",
    "tunnel-pipe",
    "specimens",
    "cornell",
    "room",
    "slit",
    "door",
    "corridor",
    "maze"
);
