//! Tests of comparisons: causes of differences, skins with several sessions.

mod causes;
mod sessions;
