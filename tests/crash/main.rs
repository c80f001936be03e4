//! The simulated campaign killed at every write of its journal, at random instants and while it goes on again, with the
//! tail of its write-ahead log cut: no press is lost beyond the one in flight, none is made twice, and the results are those
//! of the uninterrupted campaign.
//!
//! Random instants are few here; all thousand of them by `SKINRIG_CRASHES=1000 cargo test --release -p skinrig --test crash`.
//! Equal means: the same counts, every press valid, certified clocks, and an RMSE within the 95 % interval of the
//! uninterrupted campaign. The events themselves differ: the noise of the simulated rig goes by its time, which begins
//! anew with each process.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

mod disk;
mod kills;
mod lab;
mod power;
mod rig;
