//! The trigger box's real firmware on an emulated ATmega328P: its serial port is a pseudo-terminal, its pins are a socket.
//!
//! [`EmulatedBox::start`] builds the firmware with avr-gcc and the board program `board.c` on libsimavr, once, and starts
//! it. The driver opens [`EmulatedBox::port`] like any serial port; whoever wants the pulses, a test or an emulated
//! camera, opens an [`EdgeStream`] on [`EmulatedBox::socket`].

mod board;
mod build;
mod edges;

pub use board::{BoardOptions, EmulatedBox, NoiseDone, NoisePerMillion, ResetCause};
pub use build::{Built, Unavailable, build};
pub use edges::{
    BoardClock, CAMERA_1, CAMERA_2, CYCLES_PER_US, Edge, EdgeStream, INPUT, SPARE, Told,
    trigger_edges,
};
