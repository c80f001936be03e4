//! Tests of comparisons: their statistics, and causes of differences.

mod causes;
mod statistics;
