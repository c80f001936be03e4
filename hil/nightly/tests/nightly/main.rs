//! Tests of verdicts and trends of nights.

mod judging;
mod trend;
