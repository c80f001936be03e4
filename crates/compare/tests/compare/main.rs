//! Tests of comparisons: causes of differences, skins with several sessions, table and map.

mod causes;
mod facts;
mod sessions;
mod table;
