//! Tests of all formats through the public API.

mod containers;
mod gaps;
mod inspection;
mod instructions;
mod position_tables;
mod raw_files;
mod streams;
mod vectors;
