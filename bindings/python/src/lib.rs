//! What Python calls: commands of the program that answer in JSON, a scene that stays loaded, and
//! the reading of one slice. `python/intrados` makes typed reports of it.

mod slice;
mod watch;

use std::{ffi::OsString, path::PathBuf, sync::Arc};

use intrados::embedded::{Refusal, answer, open};
use pyo3::{prelude::*, types::PyModule};

use watch::watched;

/// A scene in memory, resolved and checked.
#[pyclass(frozen, module = "intrados._intrados")]
struct Loaded {
    scene: Arc<intrados_scene::Scene>,
}

/// Loads a scene; `allow` are folders that it may name files of.
#[pyfunction]
fn load(
    py: Python<'_>,
    path: PathBuf,
    allow: Vec<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Loaded> {
    let scene = watched(py, progress, move |job| open(&path, allow, job))?;
    Ok(Loaded { scene: Arc::new(scene) })
}

/// Runs a command by its words, on a scene if one is given, and returns its JSON.
#[pyfunction]
fn run(
    py: Python<'_>,
    words: Vec<OsString>,
    scene: Option<Py<Loaded>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let scene = scene.map(|loaded| Arc::clone(&loaded.get().scene));
    watched(py, progress, move |job| answer(&words, scene.as_ref(), job))
}

/// The exception that says why the program has refused: of the class that its exit code stands for.
fn exception(py: Python<'_>, refusal: &Refusal) -> PyErr {
    let class = match refusal.code {
        2 => "UsageError",
        65 => "InputError",
        66 => "MissingError",
        73 => "WriteError",
        _ => "Error",
    };
    let made = PyModule::import(py, "intrados._errors")
        .and_then(|errors| errors.getattr(class))
        .and_then(|class| class.call1((refusal.line.as_str(),)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(fault) => fault,
    }
}

/// The module `intrados._intrados`.
#[pymodule]
fn _intrados(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Loaded>()?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(slice::detect_array, module)?)?;
    module.add_function(wrap_pyfunction!(slice::detect_file, module)?)
}
