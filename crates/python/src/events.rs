//! Owns the events of a press as a numpy array.

use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use skinrig_model::{CdEvent, Polarity};

use crate::table::array;

/// Fields of an event, packed; the same as in an export to npz.
const FIELDS: [(&str, &str); 4] = [
    ("t_us", "<i8"),
    ("x_px", "<u2"),
    ("y_px", "<u2"),
    ("on", "?"),
];
/// Length of a packed event.
const EVENT_BYTES: usize = 13;

/// Packed events.
#[derive(Default)]
pub(crate) struct PackedEvents(Vec<u8>);

impl PackedEvents {
    pub(crate) fn push(&mut self, event: CdEvent) {
        let mut bytes = [0; EVENT_BYTES];
        bytes[..8].copy_from_slice(&event.t_us.to_le_bytes());
        bytes[8..10].copy_from_slice(&event.x.to_le_bytes());
        bytes[10..12].copy_from_slice(&event.y.to_le_bytes());
        bytes[12] = u8::from(event.polarity == Polarity::On);
        self.0.extend_from_slice(&bytes);
    }

    /// A structured array of the events.
    pub(crate) fn to_array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let fields = FIELDS.to_vec().into_pyobject(py)?;
        let dtype = py.import("numpy")?.call_method1("dtype", (fields,))?;
        array(py, PyByteArray::new(py, &self.0), dtype)
    }
}
