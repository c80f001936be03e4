//! The trigger box's real firmware on an emulated ATmega328P, with a pseudo-terminal as serial port and a socket for its pins.
//!
//! [`EmulatedBox::start`] builds the firmware with avr-gcc and the board program `board.c` with libsimavr, once, and starts it. The driver
//! opens [`EmulatedBox::port`] like any serial port; a test or an emulated camera that needs the pulses opens an [`EdgeStream`] on
//! [`EmulatedBox::socket`].

mod board;
mod build;
mod edges;

pub use board::{BoardOptions, EmulatedBox, NoiseDone, NoisePerMillion, ResetCause};
pub use build::{BuildOutput, Unavailable, build};
pub use edges::{
    BoardClock, BoardMessage, CAMERA_1, CAMERA_2, CYCLES_PER_US, Edge, EdgeStream, INPUT, SPARE,
    trigger_edges,
};
