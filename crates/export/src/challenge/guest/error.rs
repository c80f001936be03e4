//! Why a guest could not be examined.

use std::time::Duration;

/// A guest did not do its part.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GuestError {
    /// It could not be started.
    #[error("{program}: {reason}\n  next: name a program and its arguments after `--`")]
    Start {
        /// The program.
        program: String,
        /// What the system said.
        reason: String,
    },
    /// It ended, or closed its standard output.
    #[error("the guest ended before its answer to {to}: {how}")]
    Ended {
        /// The unanswered line.
        to: String,
        /// Exit status, or what the system said.
        how: String,
    },
    /// It gave no answer in time.
    #[error(
        "expected an answer to {to} within {} s, found none\n  next: flush standard output after every line, or allow more time with --timeout",
        within.as_secs_f64()
    )]
    Silent {
        /// The unanswered line.
        to: String,
        /// The time it had.
        within: Duration,
    },
    /// Its answer is not what it should be.
    #[error(
        "answer to {to}: expected {expected}, found {found}\n  next: print nothing else on standard output; standard error is free for messages"
    )]
    Unexpected {
        /// The answered line.
        to: String,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// It answered after the last press.
    #[error("expected no line after the last press, found `{found}`")]
    TooMuch {
        /// The line.
        found: String,
    },
    /// A position is far from the skin.
    #[error(
        "press {press}: ({x_mm}, {y_mm}) mm is {away_mm:.0} mm from the centre of the skin, expected at most {most_mm:.0} mm\n  \
        next: answer in mm in the skin frame, as in the `learn` lines"
    )]
    FarAway {
        /// The press.
        press: u32,
        /// The estimate.
        x_mm: f64,
        /// The estimate.
        y_mm: f64,
        /// Its distance.
        away_mm: f64,
        /// The largest allowed one.
        most_mm: f64,
    },
    /// All positions together are near zero: probably metres.
    #[error(
        "all positions are within {extent_mm} mm of zero, expected millimetres (metres times 1000)"
    )]
    Tiny {
        /// Largest distance from zero.
        extent_mm: f64,
    },
    /// Some answers state a region and others none.
    #[error(
        "{without} of {located} positions state no region, the first is press {first}\n  next: state a region with every position or with none"
    )]
    SomeRegions {
        /// Positions without a region.
        without: usize,
        /// All positions.
        located: usize,
        /// The first one without.
        first: u32,
    },
}
