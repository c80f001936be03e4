//! Owns the figures.
