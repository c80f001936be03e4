//! Owns the exceptions: the classes, and which failure becomes which.

use std::ffi::{CStr, CString};

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;
use skinrig::exit::{Exit, Failure};
use skinrig_export::ExportError;
use skinrig_recorder::RecorderError;

create_exception!(
    skinrig,
    SkinrigError,
    PyException,
    "A failure, with the text that the command line prints."
);
create_exception!(
    skinrig,
    InputError,
    SkinrigError,
    "Bad input: an argument, a protocol, or a session file (exit code 2)."
);
create_exception!(
    skinrig,
    DamagedSessionError,
    InputError,
    "A file is damaged, or no session."
);
create_exception!(
    skinrig,
    RigError,
    SkinrigError,
    "A fault of the rig (exit code 3). The session is kept."
);
create_exception!(
    skinrig,
    LimitError,
    SkinrigError,
    "A limit was not met (exit code 4)."
);
create_exception!(
    skinrig,
    StoppedError,
    SkinrigError,
    "The run was stopped (exit code 5). The session is kept."
);
create_exception!(
    skinrig,
    MachineError,
    SkinrigError,
    "A fault of skinrig or of this machine, for example a full disk (exit code 1)."
);

create_exception!(
    skinrig,
    InvalidSessionWarning,
    PyUserWarning,
    "The session is INVALID: use none of its numbers."
);

/// Warns of a session that is INVALID.
pub(crate) fn warn_invalid(py: Python<'_>, why: &CStr) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<InvalidSessionWarning>(), why, 1)
}

/// The warning's text for a refusal.
pub(crate) fn why_invalid(refusal: Failure) -> Option<CString> {
    CString::new(without_styles(&refusal.message)).ok()
}

/// The exception for a failure.
pub(crate) fn raised(failure: Failure) -> PyErr {
    let text = without_styles(&failure.message);
    match failure.exit {
        Exit::Input if failure.is_damage => DamagedSessionError::new_err(text),
        Exit::Input => InputError::new_err(text),
        Exit::Rig => RigError::new_err(text),
        Exit::Limit => LimitError::new_err(text),
        Exit::Stopped => StoppedError::new_err(text),
        Exit::Ok | Exit::Internal | Exit::Night(_) => MachineError::new_err(text),
    }
}

/// The exception for a session that cannot be read.
pub(crate) fn unreadable(error: RecorderError) -> PyErr {
    raised(Failure::session(error))
}

/// The exception for a table that cannot be made.
pub(crate) fn no_table(error: ExportError) -> PyErr {
    match error {
        ExportError::Session(error) => unreadable(error),
        other => raised(Failure::internal(other)),
    }
}

/// `text` without the styles of a terminal: `ESC [ ... m`.
pub(crate) fn without_styles(text: &str) -> String {
    let mut parts = text.split("\u{1b}[");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once('m').map_or(part, |(_, rest)| rest));
    }
    plain
}
