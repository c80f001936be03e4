//! Wrong and odd recordings and set-ups, each with the only outcomes allowed: no wrong number may end valid.
//!
//! A [`bench::Bench`] is what was done (presses, cameras, clocks) and what is said about it (schedule, table of positions, rig
//! description); a case of [`cases::all`] changes either by a few lines, and [`judge::judge`] compares what the analysis makes of
//! it with what was done.

pub mod bench;
pub mod cases;
pub mod judge;
