//! Parsed values, each with its location.

use crate::quantity::Dimension;
use crate::source::Span;

/// A parsed value with its location.
#[derive(Debug, Clone)]
pub struct Field {
    /// Location in the text.
    pub span: Span,
    /// Key path, for example `path.meander.pitch`.
    pub path: String,
    /// The value.
    pub value: Value,
}

/// A parsed value; its shape and range match the declaration of its key.
#[derive(Debug, Clone)]
pub enum Value {
    /// A text.
    Text(String),
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// `true` or `false`.
    Flag(bool),
    /// In the unit that the dimension's variant names.
    Quantity(f64, Dimension),
    /// One of the words of a choice.
    Word(&'static str),
    /// The items of a list or tuple.
    List(Vec<Field>),
    /// First and last number, each with the location of its text.
    Numbers(Vec<(u32, u32, Span)>),
    /// The entries of a mapping.
    Map(Vec<(String, Field)>),
}

impl Field {
    /// The value of `key`, if given and readable.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Self> {
        self.entries()
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, f)| f)
    }

    /// The field at a key path below this one, or the innermost mapping around it, as the location of a finding.
    #[must_use]
    pub fn at(&self, path: &str) -> &Self {
        let mut field = self;
        for key in path.split('.') {
            match field.get(key) {
                Some(inner) => field = inner,
                None => break,
            }
        }
        field
    }

    /// The entries of a mapping.
    #[must_use]
    pub fn entries(&self) -> &[(String, Self)] {
        match &self.value {
            Value::Map(entries) => entries,
            _ => &[],
        }
    }

    /// The items of a list.
    #[must_use]
    pub fn items(&self) -> &[Self] {
        match &self.value {
            Value::List(items) => items,
            _ => &[],
        }
    }

    /// The text.
    #[must_use]
    pub fn as_text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The word of a choice.
    #[must_use]
    pub fn as_word(&self) -> Option<&'static str> {
        match self.value {
            Value::Word(word) => Some(word),
            _ => None,
        }
    }

    /// The whole number.
    #[must_use]
    pub fn as_whole(&self) -> Option<i64> {
        match self.value {
            Value::Whole(n) => Some(n),
            _ => None,
        }
    }

    /// The number without a unit.
    #[must_use]
    pub fn as_number(&self) -> Option<f64> {
        match self.value {
            Value::Number(n) => Some(n),
            _ => None,
        }
    }

    /// The flag.
    #[must_use]
    pub(crate) fn as_flag(&self) -> Option<bool> {
        match self.value {
            Value::Flag(flag) => Some(flag),
            _ => None,
        }
    }

    /// The quantity, in the unit of its dimension.
    #[must_use]
    pub fn as_quantity(&self) -> Option<f64> {
        match self.value {
            Value::Quantity(value, _) => Some(value),
            _ => None,
        }
    }

    /// A tuple of `N` quantities.
    #[must_use]
    pub fn as_quantities<const N: usize>(&self) -> Option<[f64; N]> {
        let values: Option<Vec<f64>> = self.items().iter().map(Self::as_quantity).collect();
        values?.try_into().ok()
    }
}
