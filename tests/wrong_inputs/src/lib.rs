//! Wrong and unusual recordings and setups, each with its allowed outcomes: no wrong result may be valid.
//!
//! A [`bench::Bench`] holds what was executed (presses, cameras, clocks) and what the documents claim (schedule, table of
//! positions, rig description); a case of [`cases::all`] changes either in a few lines, and [`judge::judge`] compares the
//! analysis with the truth.

pub mod bench;
pub mod cases;
pub mod judge;
