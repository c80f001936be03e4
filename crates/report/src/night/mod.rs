//! Owns the presentation of a nightly run: terminal tree and HTML page.

mod bars;
mod page;
mod text;
mod tree;
mod trends;

pub use page::html;
pub use text::span;
pub use tree::{line, tree};
pub use trends::Trends;
