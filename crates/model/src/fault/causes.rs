//! A list of causes that is never empty.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One or more causes, in order. Their text joins them with `; `.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<F>", bound(deserialize = "F: Deserialize<'de>"))]
pub struct Causes<F>(Vec<F>);

impl<F> Causes<F> {
    /// A single cause.
    #[must_use]
    pub fn one(cause: F) -> Self {
        Self(vec![cause])
    }

    /// Adds a cause at the end.
    pub fn push(&mut self, cause: F) {
        self.0.push(cause);
    }

    /// All causes; not empty.
    #[must_use]
    pub fn as_slice(&self) -> &[F] {
        &self.0
    }

    /// All causes, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, F> {
        self.0.iter()
    }
}

/// An empty list of causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected at least one cause, found none")]
pub struct NoCause;

impl<F> TryFrom<Vec<F>> for Causes<F> {
    type Error = NoCause;

    fn try_from(causes: Vec<F>) -> Result<Self, NoCause> {
        if causes.is_empty() {
            Err(NoCause)
        } else {
            Ok(Self(causes))
        }
    }
}

impl<F: fmt::Display> fmt::Display for Causes<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&joined(&self.0))
    }
}

/// The parts with `; ` between two.
pub(super) fn joined(parts: &[impl fmt::Display]) -> String {
    let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
    parts.join("; ")
}
