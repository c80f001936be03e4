//! Tests of the analysis through its public API.

mod audit;
mod calibration;
mod clocks;
mod clustering;
mod coverage;
mod digits;
mod geometry;
mod intervals;
mod latency;
mod locator;
mod metrics;
mod models;
mod reduction;
mod relations;
mod sample;
mod session;
mod timebase;
mod unused;
