//! Tests of comparisons: causes of differences.

mod causes;
