//! Tests of comparisons: comparability, causes of differences, skins with several sessions, table and map.

mod causes;
mod comparability;
mod facts;
mod sessions;
mod table;
