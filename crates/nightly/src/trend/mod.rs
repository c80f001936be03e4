//! Trends: what moved over the nights, since when, and what probably moved it.

pub mod history;

pub use history::{Acceptance, History, NightHead, Point, Series};
