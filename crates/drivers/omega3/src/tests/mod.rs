//! The driver over a scripted library, on a virtual clock: exact, and without any waiting.

mod engine;
mod open;
mod owner;
mod scripted;
