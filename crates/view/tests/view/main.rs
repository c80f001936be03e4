//! Tests of the server over HTTP.

mod access;
mod live;
