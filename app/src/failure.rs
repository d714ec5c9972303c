//! What can go wrong, and the exit code that says so.

use intrados_ct::SliceError;
use intrados_experiments::ExperimentError;
use intrados_photo::{map::MapError, picks::PicksError, series::SeriesError};
use intrados_predict::PredictError;
use intrados_report::{RecordError, pdf::PdfError};
use intrados_scene::{ErrorKind, LoadError, attach::AttachError, gltf::ImportError, import};
use intrados_stage::{Cancelled, access::Denied, file::WriteError};
use intrados_xray::{recon::ReconError, scan::ScanError, volume::VolumeError};

/// Why a command did not do its work. One line each.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    #[error("{0}")]
    Internal(String),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    BadInput(String),
    #[error("{0}")]
    NoInput(String),
    #[error("{0}")]
    CannotWrite(String),
    #[error("interrupted")]
    Interrupted,
}

/// How a command ended that did its work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    Done,
    /// A check of `verify` failed.
    NotPassed,
    /// Another stop rule came before the target.
    TargetNotReached,
    /// `validate` found errors.
    Faulty,
    /// `validate` did not find a file.
    Missing,
    /// Stopped by a signal; what there was is written.
    Interrupted,
    /// A unit of a campaign that goes on when it is started again.
    ToBeContinued,
}

impl Failure {
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Internal(_) => 1,
            Self::Usage(_) => 2,
            Self::BadInput(_) => 65,
            Self::NoInput(_) => 66,
            Self::CannotWrite(_) => 73,
            Self::Interrupted => 130,
        }
    }

    pub(crate) fn cannot_write(path: &std::path::Path, error: impl std::fmt::Display) -> Self {
        Self::CannotWrite(format!("{}: cannot be written: {error}", path.display()))
    }

    /// A file that cannot be opened or read.
    /// A file that was not opened.
    pub(crate) fn denied(path: &std::path::Path, why: &Denied) -> Self {
        let line = format!("{}: {why}", path.display());
        if why.is_missing() { Self::NoInput(line) } else { Self::BadInput(line) }
    }

    pub(crate) fn no_input(path: &std::path::Path, error: &std::io::Error) -> Self {
        let why = match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such file: check the path".to_owned(),
            std::io::ErrorKind::PermissionDenied => {
                "may not be read: check its permissions".to_owned()
            }
            _ => format!("cannot be read: {error}"),
        };
        Self::NoInput(format!("{}: {why}", path.display()))
    }
}

impl Outcome {
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::NotPassed => 1,
            Self::TargetNotReached => 3,
            Self::Faulty => 65,
            Self::Missing => 66,
            Self::Interrupted => 130,
            // EX_TEMPFAIL of sysexits.h: schedulers know it as "try again".
            Self::ToBeContinued => 75,
        }
    }
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Interrupted
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error.kind() {
            ErrorKind::NoInput => Self::NoInput(error.to_string()),
            ErrorKind::BadInput => Self::BadInput(error.to_string()),
            ErrorKind::Cancelled => Self::Interrupted,
        }
    }
}

impl From<ImportError> for Failure {
    fn from(error: ImportError) -> Self {
        match error {
            ImportError::Read { path, source } => Self::denied(&path, &source),
            ImportError::Damaged { .. } => Self::BadInput(error.to_string()),
            ImportError::Cancelled(_) => Self::Interrupted,
        }
    }
}

impl From<AttachError> for Failure {
    fn from(error: AttachError) -> Self {
        match error {
            AttachError::Load(error) => error.into(),
            AttachError::BadInput(text) => Self::BadInput(text),
            AttachError::NoInput(text) => Self::NoInput(text),
            AttachError::CannotWrite(text) => Self::CannotWrite(text),
        }
    }
}

impl From<import::ImportError> for Failure {
    fn from(error: import::ImportError) -> Self {
        use import::ImportError as E;
        match error {
            E::Load(error) => error.into(),
            E::BadInput(text) => Self::BadInput(text),
            E::NoInput(text) | E::NoConverter(text) => Self::NoInput(text),
            E::CannotWrite(text) => Self::CannotWrite(text),
            E::Cancelled => Self::Interrupted,
        }
    }
}

impl From<PredictError> for Failure {
    fn from(error: PredictError) -> Self {
        match error {
            PredictError::Slice(error) => error.into(),
            PredictError::Cancelled(_) => Self::Interrupted,
            _ => Self::BadInput(error.to_string()),
        }
    }
}

impl From<SliceError> for Failure {
    fn from(error: SliceError) -> Self {
        match error {
            SliceError::File(error) => error.into(),
            SliceError::Cancelled(_) => Self::Interrupted,
            _ => Self::BadInput(error.to_string()),
        }
    }
}

impl From<PicksError> for Failure {
    fn from(error: PicksError) -> Self {
        match &error {
            PicksError::Denied { path, source } => Self::denied(path, source),
            PicksError::Bad { .. } => Self::BadInput(error.to_string()),
        }
    }
}

impl From<SeriesError> for Failure {
    fn from(error: SeriesError) -> Self {
        match &error {
            SeriesError::Denied { path, source } => Self::denied(path, source),
            _ => Self::BadInput(error.to_string()),
        }
    }
}

impl From<MapError> for Failure {
    fn from(error: MapError) -> Self {
        match error {
            MapError::Cancelled(_) => Self::Interrupted,
            error => Self::BadInput(error.to_string()),
        }
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::CannotWrite(error.to_string())
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::Write(error) => error.into(),
            RecordError::Model(error) => error.into(),
            RecordError::Pdf(error) => error.into(),
            RecordError::Changed(_) => Self::BadInput(error.to_string()),
            RecordError::Cancelled(cancelled) => cancelled.into(),
        }
    }
}

impl From<PdfError> for Failure {
    fn from(error: PdfError) -> Self {
        match error {
            PdfError::NoPrinter => Self::NoInput(error.to_string()),
            PdfError::Failed(text) => Self::CannotWrite(text),
            PdfError::Cancelled(cancelled) => cancelled.into(),
        }
    }
}

impl From<ScanError> for Failure {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::Cancelled(_) => Self::Interrupted,
            ScanError::Bad(text) => Self::BadInput(text),
            ScanError::Physics(error) => Self::Internal(error.to_string()),
        }
    }
}

impl From<ExperimentError> for Failure {
    fn from(error: ExperimentError) -> Self {
        match error {
            ExperimentError::Cancelled(_) => Self::Interrupted,
            error => Self::Internal(error.to_string()),
        }
    }
}

impl From<ReconError> for Failure {
    fn from(error: ReconError) -> Self {
        match error {
            ReconError::Cancelled(_) => Self::Interrupted,
            ReconError::Bad(text) => Self::BadInput(text),
        }
    }
}

/// Of a volume that is read; one that is written says so itself.
impl From<VolumeError> for Failure {
    fn from(error: VolumeError) -> Self {
        match error {
            VolumeError::Cancelled(_) => Self::Interrupted,
            error if error.is_missing() => Self::NoInput(error.to_string()),
            error => Self::BadInput(error.to_string()),
        }
    }
}
