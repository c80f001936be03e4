//! The driver over a model of the camera: production code above the transport, registers and EVT2 bytes below it.
#![expect(clippy::unwrap_used, reason = "tests")]

mod configure;
mod contract;
mod identify;
mod model;
mod sequences;
mod stream;
mod tolerance;
