//! Owns arguments from Python: settings as `key=value`, and paths.

use std::path::Path;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use skinrig::library;

use crate::error::{warn_invalid, why_invalid};

/// Settings as `--set` takes them: a text stands as it is, everything else as JSON, which YAML reads.
pub(crate) fn overrides(settings: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let Some(settings) = settings else {
        return Ok(Vec::new());
    };
    let json = settings.py().import("json")?;
    let one = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key
            .extract()
            .map_err(|_| PyTypeError::new_err("settings: expected keys of type str"))?;
        let value: String = match value.cast::<PyString>() {
            Ok(text) => text.extract()?,
            Err(_) => json.call_method1("dumps", (value,))?.extract()?,
        };
        Ok(format!("{key}={value}"))
    };
    settings.iter().map(one).collect()
}

/// The results of a session as Python's own types, after a warning if they are INVALID.
pub(crate) fn results_to_python<'py>(
    py: Python<'py>,
    session: &Path,
    json: &str,
) -> PyResult<Bound<'py, PyAny>> {
    if let Some(why) = library::invalid_results(session, json).and_then(why_invalid) {
        warn_invalid(py, &why)?;
    }
    to_python(py, json)
}

/// A document of results as Python's own types.
pub(crate) fn to_python<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}
