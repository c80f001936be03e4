//! Tests of several crates together.

mod audit;
mod bench_files;
mod contract;
mod counts;
mod faults;
mod indentation;
mod level_bias;
mod multi_touch;
mod numerics;
mod online;
mod overflow;
mod paper_scene;
mod retakes;
mod scene_prediction;
mod session_intervals;
mod simulated;
mod unusual;
