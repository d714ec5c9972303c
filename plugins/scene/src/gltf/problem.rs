//! What can be wrong with a file, and how it is said.

use std::{fmt, path::PathBuf};

use intrados_stage::access::Denied;

/// How bad a problem is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Breaks a rule of glTF 2.0 (or one of our limits).
    Error,
    /// Legal, but hardly meant.
    Warning,
    /// Good to know.
    Note,
}

/// Where in the file.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Place {
    /// JSON pointer (RFC 6901); empty: the whole document.
    Pointer(String),
    /// Byte offset in a GLB.
    Byte(u64),
    /// Line and column of the JSON text, from 1.
    Text {
        /// Line.
        line: usize,
        /// Column.
        column: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pointer(pointer) if pointer.is_empty() => f.write_str("/"),
            Self::Pointer(pointer) => f.write_str(pointer),
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::Text { line, column } => write!(f, "JSON line {line}, column {column}"),
        }
    }
}

/// One problem of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GltfProblem {
    /// How bad.
    pub severity: Severity,
    /// The place in the file.
    pub place: Place,
    /// Stable short name for scripts, for example `"INDEX_OUT_OF_RANGE"`.
    pub code: &'static str,
    /// What is wrong, a plain sentence without its full stop.
    pub message: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl GltfProblem {
    /// An error at a JSON pointer.
    pub(super) fn error(
        pointer: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
        remedy: &'static str,
    ) -> Self {
        let (place, message) = (Place::Pointer(pointer.into()), message.into());
        Self { severity: Severity::Error, place, code, message, remedy }
    }

    /// A warning at a JSON pointer.
    pub(super) fn warning(
        pointer: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
        remedy: &'static str,
    ) -> Self {
        Self { severity: Severity::Warning, ..Self::error(pointer, code, message, remedy) }
    }

    /// The same problem further up: `prefix` + its pointer.
    pub(super) fn under(mut self, prefix: &str) -> Self {
        if let Place::Pointer(pointer) = &mut self.place {
            pointer.insert_str(0, prefix);
        }
        self
    }

    /// Whether geometry cannot be trusted because of it: an error in the container, the JSON text,
    /// `asset`, required extensions, buffers, accessors, meshes, nodes or scenes. Errors in
    /// materials, textures, images, samplers, animations, skins, cameras and lights cost only
    /// those.
    #[must_use]
    pub fn blocks_geometry(&self) -> bool {
        const GEOMETRY: [&str; 9] = [
            "",
            "asset",
            "extensionsRequired",
            "buffers",
            "bufferViews",
            "accessors",
            "meshes",
            "nodes",
            "scenes",
        ];
        let in_geometry = match &self.place {
            Place::Pointer(pointer) => {
                let subject = pointer.split('/').nth(1).unwrap_or("");
                // A node's light is its own affair.
                (subject == "scene" || GEOMETRY.contains(&subject))
                    && !pointer.contains("/extensions/KHR_lights_punctual")
            }
            Place::Byte(_) | Place::Text { .. } => true,
        };
        self.severity == Severity::Error && in_geometry
    }
}

impl fmt::Display for GltfProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.place, self.message, self.remedy)
    }
}

/// Why a file could not be imported or validated. One line.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// It cannot be read at all.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: Denied,
    },
    /// It is damaged, or beyond what we support.
    #[error("{}: {problem}{}", path.display(), if *others > 0 { format!(" (and {others} more problems)") } else { String::new() })]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The first problem that stops the import.
        problem: Box<GltfProblem>,
        /// How many other errors there are.
        others: usize,
    },
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] intrados_stage::Cancelled),
}

/// Remedies that many rules share.
pub(super) mod remedy {
    pub(crate) const EXPORT: &str = "export the model again";
    pub(crate) const REFERENCE: &str = "remove the reference or add what it refers to";
    pub(crate) const SMALLER: &str = "split the model into smaller files";
}
