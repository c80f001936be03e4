//! The Python package `skinrig`: sessions as tables and arrays, analyses, comparisons, simulated campaigns.
//!
//! `skinrig.pyi` beside this crate's manifest declares what Python sees; `docs/how-to/python.md` shows its use.

mod error;
mod events;
mod functions;
mod options;
mod session;
mod table;

use pyo3::prelude::*;

/// Sessions of tactile-skin campaigns: tables, events, analyses, comparisons and simulated campaigns.
///
/// Names of columns and fields end in their unit. Positions are in the skin's frame. Times in `_s` and `_ns` count from the
/// session's start on the host clock, times in `_us` are on one camera's clock.
#[pymodule(name = "skinrig", gil_used = true)]
mod module {
    #[pymodule_export]
    use crate::error::{
        DamagedSessionError, InputError, InvalidSessionWarning, LimitError, MachineError, RigError,
        SkinrigError, StoppedError,
    };
    #[pymodule_export]
    use crate::functions::{analyze, compare, simulate};
    #[pymodule_export]
    use crate::session::Session;

    #[pymodule_init]
    fn init(_module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        skinrig::library::read_references();
        Ok(())
    }
}
