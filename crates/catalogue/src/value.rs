//! Values of columns and parameters, the same for both databases.

use serde::Serialize;

/// A value of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// None.
    Null,
    /// An integer.
    Integer(i64),
    /// A finite number.
    Real(f64),
    /// Text.
    Text(String),
}

impl Value {
    /// The integer; `None` for any other value.
    #[must_use]
    pub const fn as_integer(&self) -> Option<i64> {
        match self {
            Self::Integer(value) => Some(*value),
            _ => None,
        }
    }

    /// The text; `None` for any other value.
    #[must_use]
    pub fn as_text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// Value of a parameter. Its type is fixed, even when it is missing: PostgreSQL checks it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Bound {
    Integer(Option<i64>),
    Real(Option<f64>),
    Text(Option<String>),
}

impl Bound {
    /// The number, if it is whole.
    pub(crate) const fn integer(&self) -> Option<i64> {
        match self {
            Self::Integer(n) => *n,
            Self::Real(_) | Self::Text(_) => None,
        }
    }

    /// A missing value of the same type.
    pub(crate) const fn missing(&self) -> Self {
        match self {
            Self::Integer(_) => Self::Integer(None),
            Self::Real(_) => Self::Real(None),
            Self::Text(_) => Self::Text(None),
        }
    }
}

impl From<i64> for Bound {
    fn from(value: i64) -> Self {
        Self::Integer(Some(value))
    }
}

impl From<Option<i64>> for Bound {
    fn from(value: Option<i64>) -> Self {
        Self::Integer(value)
    }
}

/// Counts never reach 2^63.
impl From<u64> for Bound {
    fn from(value: u64) -> Self {
        Self::Integer(Some(i64::try_from(value).unwrap_or(i64::MAX)))
    }
}

impl From<Option<u64>> for Bound {
    fn from(value: Option<u64>) -> Self {
        Self::Integer(value.map(|v| i64::try_from(v).unwrap_or(i64::MAX)))
    }
}

impl From<u32> for Bound {
    fn from(value: u32) -> Self {
        Self::Integer(Some(value.into()))
    }
}

impl From<bool> for Bound {
    fn from(value: bool) -> Self {
        Self::Integer(Some(value.into()))
    }
}

/// SQLite has no NaN; infinity is no measurement.
impl From<Option<f64>> for Bound {
    fn from(value: Option<f64>) -> Self {
        Self::Real(value.filter(|v| v.is_finite()))
    }
}

/// PostgreSQL has no zero character: it becomes U+FFFD, the replacement character.
impl From<&str> for Bound {
    fn from(value: &str) -> Self {
        Self::Text(Some(value.replace('\0', "\u{fffd}")))
    }
}

impl From<&String> for Bound {
    fn from(value: &String) -> Self {
        value.as_str().into()
    }
}

impl From<Option<&str>> for Bound {
    fn from(value: Option<&str>) -> Self {
        value.map_or(Self::Text(None), Self::from)
    }
}

impl From<&Option<String>> for Bound {
    fn from(value: &Option<String>) -> Self {
        value.as_deref().into()
    }
}
