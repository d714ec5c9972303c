//! A report as PDF, by a program that prints pages, where there is one.

use std::{
    io,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use intrados_stage::{Cancelled, Job};

/// Programs that print HTML, the better one first.
const PRINTERS: [&str; 6] = [
    "weasyprint",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "microsoft-edge",
];
/// A printer that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(180);

/// What to do where there is no such program.
pub const BY_HAND: &str = "A PDF is printed by WeasyPrint or Chromium, and neither is installed: \
                           install one, or print report.html from any browser into a file.";

/// Why there is no PDF.
#[derive(Debug, thiserror::Error)]
pub enum PdfError {
    /// No program prints here.
    #[error("{BY_HAND}")]
    NoPrinter,
    /// It did not print.
    #[error("{0}")]
    Failed(String),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The program that would print.
#[must_use]
pub fn printer() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let places = PRINTERS.iter().flat_map(|name| folders.iter().map(move |f| f.join(name)));
    places.into_iter().find(|place| place.is_file())
}

/// Prints `html` into `pdf`.
///
/// # Errors
/// [`PdfError`].
pub fn print(html: &Path, pdf: &Path, job: &Job) -> Result<(), PdfError> {
    let printer = printer().ok_or(PdfError::NoPrinter)?;
    let failed = |e: io::Error| PdfError::Failed(format!("{}: {e}", printer.display()));
    let html = std::path::absolute(html).map_err(failed)?;
    let is_weasy = printer.ends_with("weasyprint");
    let attempts: [&[&str]; 2] = match is_weasy {
        // For screen readers; what is older does not know it.
        true => [&["--pdf-variant", "pdf/ua-1"], &[]],
        // A browser has no sandbox of its own where it runs as root, and says so by failing.
        false => [&[], &["--no-sandbox"]],
    };
    for extra in attempts {
        let mut command = Command::new(&printer);
        if is_weasy {
            command.args(extra).arg(&html).arg(pdf);
        } else {
            command.args(["--headless", "--disable-gpu", "--no-pdf-header-footer"]);
            command.arg("--generate-pdf-document-outline").args(extra);
            let mut to = std::ffi::OsString::from("--print-to-pdf=");
            to.push(pdf);
            command.arg(to).arg(&html);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        run(command, job, &printer)?;
        if pdf.metadata().is_ok_and(|m| m.len() > 0) {
            return Ok(());
        }
    }
    let remedy = "print report.html from any browser into a file";
    Err(PdfError::Failed(format!("{}: has printed nothing: {remedy}", printer.display())))
}

/// Waits for a program, and ends it with the job.
fn run(mut command: Command, job: &Job, printer: &Path) -> Result<(), PdfError> {
    let failed = |e: io::Error| PdfError::Failed(format!("{}: {e}", printer.display()));
    let mut child = command.spawn().map_err(failed)?;
    let since = Instant::now();
    loop {
        if child.try_wait().map_err(failed)?.is_some() {
            return Ok(());
        }
        let is_stopped = job.check();
        if is_stopped.is_err() || since.elapsed() > PATIENCE {
            // It may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            is_stopped?;
            let why = format!("{}: took longer than three minutes", printer.display());
            return Err(PdfError::Failed(why));
        }
        std::thread::sleep(Duration::from_millis(40));
    }
}
