//! Owns the test of one candidate against another in a choice by cross-validation.

use serde::{Deserialize, Serialize};

/// Test of a candidate `T` against the current one: errors paired by location, and bounded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairedTest<T> {
    /// The current candidate: the first, or the last accepted one.
    pub against: T,
    /// Bounded error of the current candidate minus that of this one, mm. Positive: this one is better.
    pub gain_mm: f64,
    /// Standard error of the gain over locations, mm.
    pub standard_error_mm: f64,
    /// Gain divided by its standard error; 0 if the gain is below 1e-6 mm.
    pub ratio: f64,
    /// Ratio required to replace the current candidate: Student's t with locations - 1 degrees of freedom, at a level shared
    /// by all comparisons (0.3 for models, 0.1 for locators).
    pub needed: f64,
}
