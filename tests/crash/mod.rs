//! Kills the simulated campaign at every write of its journal, at random times and again while it resumes, and truncates its
//! write-ahead log: no press is lost except the one in flight, none is repeated, and the results match the uninterrupted
//! campaign.
//!
//! Only a few random times by default; a thousand with `SKINRIG_CRASHES=1000 cargo test --release -p skinrig --test commands killed_at_random`.
//! Matching results: the same counts, every press valid, certified clocks, and an RMSE within the 95 % interval of the
//! uninterrupted campaign. The events themselves differ: the noise of the simulated rig depends on its time, which restarts
//! with each process.

mod disk;
mod kills;
mod lab;
mod power;
mod rig;
