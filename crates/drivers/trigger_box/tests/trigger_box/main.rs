//! Tests of the driver: on a scripted line, and with the real firmware on an emulated processor.

mod emulated;
mod scripted;
