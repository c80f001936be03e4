//! Owns the functions of the package: analyze, compare, simulate.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use skinrig::analysis_request::AnalysisRequest;
use skinrig::exit::Failure;
use skinrig::library::{self, CompareOptions, ControlHandle, ProtocolSource, Simulation};

use crate::error::raised;
use crate::options::{overrides, results_to_python, to_python};

/// Python hears of ctrl-C this often during a simulation.
const LISTEN_EVERY: Duration = Duration::from_millis(100);

/// Analyses a session, or the one that a selection names, and returns the results, as `skinrig analyze` does.
///
/// `settings` are the keys and values of `--set`, for example `{"analysis.min_samples": 5}`. With `save` the results and the
/// report are written beside the session, those of other settings as a variant with the name `name`. `calibration_from` is an
/// earlier session of the same skin, whose calibration the calibration presses correct. INVALID results raise
/// `InvalidSessionWarning`.
#[pyfunction]
#[pyo3(signature = (path, settings=None, *, name=None, reference_code=false, calibration_from=None, save=false))]
pub(crate) fn analyze<'py>(
    py: Python<'py>,
    path: PathBuf,
    settings: Option<&Bound<'py, PyDict>>,
    name: Option<String>,
    reference_code: bool,
    calibration_from: Option<PathBuf>,
    save: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let overrides = overrides(settings)?;
    let text = py.detach(|| {
        let choices = AnalysisRequest {
            overrides: &overrides,
            reference_code,
            name: name.as_deref(),
            calibration_from: calibration_from.as_deref(),
            selection: None,
        };
        library::analyze(&path, choices, save).map(|document| document.to_string())
    });
    results_to_python(py, &path, &text.map_err(raised)?)
}

/// Compares two or more skins and returns the results, as `skinrig compare` does.
///
/// A skin is a session file, a folder of sessions, or the name of a prototype, whose sessions lie in the folder `sessions`.
/// `margins` are texts such as `"rmse=0.5mm"`; `within_mm` is the error threshold of the pass rate. With `out` the page and its
/// results are written. Skins that may not be compared raise `InputError`.
#[pyfunction]
#[pyo3(signature = (*skins, sessions=None, limits=None, margins=Vec::new(), within_mm=None, despite=Vec::new(), analysis=None, out=None))]
#[expect(
    clippy::too_many_arguments,
    reason = "one per option of `skinrig compare`"
)]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    skins: &Bound<'py, PyTuple>,
    sessions: Option<PathBuf>,
    limits: Option<PathBuf>,
    margins: Vec<String>,
    within_mm: Option<f64>,
    despite: Vec<String>,
    analysis: Option<String>,
    out: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    let skin = |skin: Bound<'py, PyAny>| {
        let path: PathBuf = skin.extract()?;
        Ok(path.to_string_lossy().into_owned())
    };
    let skins: Vec<String> = skins.iter().map(skin).collect::<PyResult<_>>()?;
    if skins.len() < 2 {
        let found = skins.len();
        return Err(PyTypeError::new_err(format!(
            "compare: expected two or more skins, found {found}"
        )));
    }
    let options = CompareOptions {
        skins,
        sessions: sessions.unwrap_or_else(|| PathBuf::from("sessions")),
        limits,
        margins,
        within_mm,
        despite,
        analysis,
        out,
    };
    let text = py.detach(|| library::compare(options).map(|document| document.to_string()));
    to_python(py, &text.map_err(raised)?)
}

/// Runs a campaign on the simulated rig and returns the path of the sealed session in the folder `out`.
///
/// `protocol` is a path, or the text of a protocol: a `str` with more than one line. `set` are the keys and values of `--set`,
/// `level` is kinematic, geometric or optical. Ctrl-C stops after the current press and keeps the session.
#[pyfunction]
#[pyo3(signature = (protocol, out, set=None, *, level=None, seed=None))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    protocol: &Bound<'py, PyAny>,
    out: PathBuf,
    set: Option<&Bound<'py, PyDict>>,
    level: Option<String>,
    seed: Option<u64>,
) -> PyResult<Bound<'py, PyAny>> {
    let simulation = Simulation {
        protocol: source(protocol)?,
        overrides: overrides(set)?,
        folder: out,
        level,
        seed,
        command_line: "skinrig.simulate".to_owned(),
    };
    let path = until_interrupted(py, |control| library::simulate(simulation, control))?;
    py.import("pathlib")?.call_method1("Path", (path,))
}

/// A text of several lines is a protocol, everything else a path.
fn source(protocol: &Bound<'_, PyAny>) -> PyResult<ProtocolSource> {
    if let Ok(text) = protocol.cast::<PyString>() {
        let text: String = text.extract()?;
        if text.contains('\n') {
            return Ok(ProtocolSource::Text(text));
        }
    }
    protocol.extract().map(ProtocolSource::File)
}

/// Runs `work` without the interpreter's lock. A signal that Python turns into an exception stops it, and is raised when it has
/// ended.
fn until_interrupted<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(ControlHandle) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let control = ControlHandle::new();
    let handle = control.clone();
    std::thread::scope(|scope| {
        // Dropped at the end of the thread, however it ends.
        let (running, ended) = mpsc::channel::<()>();
        let ended = Mutex::new(ended);
        let worker = scope.spawn(move || {
            let _running = running;
            work(handle)
        });
        let mut interrupted = None;
        while py.detach(|| is_running(&ended)) {
            if let Err(error) = py.check_signals() {
                control.stop();
                interrupted = Some(error);
            }
        }
        let result = worker
            .join()
            .unwrap_or_else(|_| Err(Failure::internal("the simulation panicked")));
        match interrupted {
            Some(error) => Err(error),
            None => result.map_err(raised),
        }
    })
}

/// False once the thread at the other end has ended.
fn is_running(ended: &Mutex<mpsc::Receiver<()>>) -> bool {
    let ended = ended.lock().unwrap_or_else(PoisonError::into_inner);
    !matches!(
        ended.recv_timeout(LISTEN_EVERY),
        Err(mpsc::RecvTimeoutError::Disconnected)
    )
}
