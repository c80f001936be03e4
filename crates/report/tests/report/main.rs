//! Tests of the pages and texts that people read.

mod night;
mod page;
mod support;
mod texts;
mod trend;
