//! What is wrong with an input.

use std::fmt;

use serde::Serialize;

use crate::gltf;

/// How bad a [`Problem`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know.
    Note,
    /// The scene loads, but something was assumed or left out.
    Warning,
    /// The scene does not load.
    Error,
}

/// One thing that is wrong with an input, with its place and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// How bad it is.
    pub severity: Severity,
    /// Where: `file:line:column`, or the path of the field, for example `members[2].body.height_m`.
    pub place: String,
    /// Short stable name of this sort of problem, for scripts.
    pub code: &'static str,
    /// What is wrong and what to do, one line.
    pub message: String,
}

impl Problem {
    /// A problem that keeps the scene from loading.
    pub fn error(place: impl Into<String>, code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, place: place.into(), code, message: message.into() }
    }

    /// A problem that the scene loads in spite of.
    pub fn warning(
        place: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
    ) -> Self {
        Self { severity: Severity::Warning, place: place.into(), code, message: message.into() }
    }
}

impl From<gltf::GltfProblem> for Problem {
    fn from(p: gltf::GltfProblem) -> Self {
        let severity = match p.severity {
            gltf::Severity::Error => Severity::Error,
            gltf::Severity::Warning => Severity::Warning,
            gltf::Severity::Note => Severity::Note,
        };
        Self {
            severity,
            place: p.place.to_string(),
            code: p.code,
            message: format!("{}; {}", p.message, p.remedy),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() {
            f.write_str(&self.message)
        } else {
            write!(f, "{}: {}", self.place, self.message)
        }
    }
}

/// Why something cannot be written, and what to do; without the name of the file that was to be
/// written aside, which means nothing to anybody.
pub(crate) fn unwritten(error: &std::io::Error) -> String {
    use std::io::ErrorKind as K;
    match error.kind() {
        K::PermissionDenied | K::ReadOnlyFilesystem => {
            "may not be written: change its permissions, or use a folder in which you may write"
                .to_owned()
        }
        K::StorageFull | K::QuotaExceeded => "the disk is full: make room on it".to_owned(),
        _ => match error.raw_os_error() {
            Some(code) => {
                format!("cannot be written: {}", std::io::Error::from_raw_os_error(code))
            }
            None => format!("cannot be written: {error}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_written_has_a_remedy_and_no_name_of_a_file_aside() {
        let denied = std::io::Error::new(std::io::ErrorKind::PermissionDenied, "at /x/.tmp-abc");
        let said = unwritten(&denied);
        assert!(said.contains("permissions") && !said.contains(".tmp"), "{said}");
    }
}
