//! Byte formats: EVT2, EVT2.1 and EVT3 streams, folded chunks, Prophesee RAW files, bimvee HDF5 containers and
//! press-position tables.
//!
//! Parsers of foreign bytes are total: any input yields events, or an error with position and
//! expectation. Words without an event are counted in [`StreamStats`].

pub mod codec;
pub mod error;
pub mod hdf5;
pub mod inspect;
pub mod positions;
pub mod raw;
pub mod regular;
pub mod stream;

pub use error::FormatsError;
pub use stream::{
    Decoder, Discontinuity, EventSink, Geometry, Monitoring, Scanner, StreamStats, evt2, evt3,
    evt21,
};
