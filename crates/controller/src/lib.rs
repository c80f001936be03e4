//! Executes plans (being written).
pub mod sink;
