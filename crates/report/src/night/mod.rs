//! Owns the presentation of a night of checks: the tree on a terminal, and the page for the morning.

mod bars;
mod page;
mod tree;
mod trends;
mod words;

pub use page::html;
pub use tree::{Colour, line, tree};
pub use trends::Trends;
pub use words::span;
