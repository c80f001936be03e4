//! The `skinrig` command line.
fn main() {}
