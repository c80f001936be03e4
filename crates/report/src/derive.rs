//! Owns the summaries per location.
