//! Tests of the driver with the emulated libdrd, which is loaded like the vendor's library; the arm's firmware runs in a separate
//! process. All results are emulated.
#![cfg(unix)]

mod death;
mod faults;
mod loading;
mod motion;
mod support;
