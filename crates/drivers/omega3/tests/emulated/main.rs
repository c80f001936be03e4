//! The driver over the stand-in for the vendor's library, loaded exactly as the vendor's, with the arm's firmware in a
//! process of its own. All results are emulated.
#![cfg(unix)]

mod death;
mod faults;
mod loading;
mod motion;
mod support;
