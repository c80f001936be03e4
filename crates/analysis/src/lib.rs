//! Numbers in, numbers out (being written).
pub mod input;
pub mod result;
