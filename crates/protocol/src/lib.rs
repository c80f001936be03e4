//! YAML to plan (being written).
pub mod plan;
