//! The `skinrig` program as a laboratory meets it: the built binary, its files, its output and its exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]
#![expect(clippy::print_stderr, reason = "a test that is skipped says why")]

mod bundle;
mod catalogue;
mod causes;
mod challenge;
mod compare;
// Beside the other tests of the whole system; here because it starts the program.
#[cfg(unix)]
#[path = "../../../../tests/crash/mod.rs"]
mod crash;
mod damage;
#[cfg(unix)]
mod dask;
mod dataset;
mod displaced;
#[cfg(target_os = "linux")]
mod doctor;
#[cfg(target_os = "linux")]
mod emulated_bench;
mod evaluation;
mod faults;
mod help;
mod hil;
mod import;
mod import_refusals;
mod installed;
mod interrupt;
mod json;
mod lake;
#[cfg(target_os = "linux")]
mod nightly;
mod notify;
mod numbering;
mod online;
mod operator;
mod options;
mod pictures;
mod pipeline;
mod publish;
mod python;
mod reanalyze;
mod remounted;
mod replay;
mod resume;
mod rigs;
mod sample_size;
mod scene;
mod selection;
#[path = "../../../notify/tests/it/servers.rs"]
mod servers;
mod shelf;
mod signing;
mod special;
mod starter;
mod stopping;
mod store;
mod strangers;
mod streams;
mod support;
#[cfg(unix)]
mod terminal_picture;
mod tours;
mod tradeoff;
mod trend;
mod twin;
mod variants;
mod watch;
