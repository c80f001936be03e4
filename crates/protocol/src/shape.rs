//! What inputs look like: one table of keys drives the reader, the JSON Schema and `--set`.
//!
//! A [`Table`] lists the keys of a mapping with their documentation, their [`Shape`] and whether they are
//! needed. The reader turns a node into a [`Field`] by its shape, so a key that is not in a table cannot be read,
//! and a key in a table is always in the schema.

pub(crate) use skinrig_model::ValueRange as Range;

use crate::quantity::Dimension;
use crate::source::Span;

/// The keys of one kind of mapping.
pub(crate) struct Table {
    /// Name in the schema.
    pub name: &'static str,
    /// What the mapping is, for the schema.
    pub doc: &'static str,
    /// Its keys, in the order in which people should meet them.
    pub keys: &'static [Key],
    /// Groups of keys of which exactly one must be given.
    pub exactly_one: &'static [&'static [&'static str]],
}

/// One key of a mapping.
pub(crate) struct Key {
    /// As typed.
    pub name: &'static str,
    /// What it means, for the schema and for people.
    pub doc: &'static str,
    /// What its value looks like.
    pub shape: Shape,
    /// Whether it must be there.
    pub need: Need,
}

/// Whether a key must be there.
#[derive(Clone, Copy)]
pub(crate) enum Need {
    /// An error when missing.
    Required,
    /// Has no value when missing.
    Optional,
    /// Has this value when missing: a text that the key's shape reads.
    Default(&'static str),
}

/// A word that may stand for a value, and what it means.
pub(crate) type Word = (&'static str, &'static str);

/// What a value looks like.
pub(crate) enum Shape {
    /// A text that is not blank.
    Text,
    /// A bare whole number.
    Whole { min: i64, max: i64 },
    /// A bare number without a dimension.
    Number(Range),
    /// `true` or `false`.
    Flag,
    /// A number with a unit of one of these dimensions; the range holds for each.
    Quantity(&'static [Dimension], Range),
    /// One of some words.
    Choice(&'static [Word]),
    /// A list of exactly these, for example x and y.
    Tuple(&'static Shape, &'static [&'static str]),
    /// A list.
    List {
        of: &'static Shape,
        min: usize,
        max: usize,
    },
    /// A mapping.
    Map(&'static Table),
    /// One of some words, or a mapping.
    WordOr(&'static [Word], &'static Table),
    /// A mapping from free names to values.
    Named(&'static Shape),
    /// A list of numbers from 1 and of spans such as `2-10`.
    Numbers,
}

/// A value that was read, and where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    pub span: Span,
    pub path: String,
    pub value: Value,
}

/// A value that was read; its shape and range are as its key says.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Text(String),
    Whole(i64),
    Number(f64),
    Flag(bool),
    Quantity(f64, Dimension),
    Word(&'static str),
    List(Vec<Field>),
    /// First and last number, each with the place of the text that named it.
    Numbers(Vec<(u32, u32, Span)>),
    Map(Vec<(String, Field)>),
}

impl Field {
    /// The value of `key` when it is there and could be read.
    pub fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Map(entries) => entries.iter().find(|(k, _)| k == key).map(|(_, f)| f),
            _ => None,
        }
    }

    /// The entries of a mapping.
    pub fn entries(&self) -> &[(String, Self)] {
        match &self.value {
            Value::Map(entries) => entries,
            _ => &[],
        }
    }

    /// The items of a list.
    pub fn items(&self) -> &[Self] {
        match &self.value {
            Value::List(items) => items,
            _ => &[],
        }
    }

    /// The text of `key`.
    pub fn text(&self, key: &str) -> Option<String> {
        match &self.get(key)?.value {
            Value::Text(t) => Some(t.clone()),
            _ => None,
        }
    }

    /// The word chosen for `key`.
    pub fn word(&self, key: &str) -> Option<&'static str> {
        self.get(key)?.as_word()
    }

    /// The word that this is.
    pub fn as_word(&self) -> Option<&'static str> {
        match self.value {
            Value::Word(w) => Some(w),
            _ => None,
        }
    }

    /// The whole number of `key`.
    pub fn whole(&self, key: &str) -> Option<i64> {
        match self.get(key)?.value {
            Value::Whole(n) => Some(n),
            _ => None,
        }
    }

    /// The whole number of `key` as a count.
    pub fn count(&self, key: &str) -> Option<u32> {
        self.whole(key).and_then(|n| u32::try_from(n).ok())
    }

    /// The number of `key`.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.get(key)?.value {
            Value::Number(n) => Some(n),
            _ => None,
        }
    }

    /// The flag of `key`.
    pub fn flag(&self, key: &str) -> Option<bool> {
        match self.get(key)?.value {
            Value::Flag(b) => Some(b),
            _ => None,
        }
    }

    /// The quantity of `key`, in the unit of its dimension.
    pub fn quantity(&self, key: &str) -> Option<f64> {
        self.get(key)?.as_quantity()
    }

    /// The quantity that this is.
    pub fn as_quantity(&self) -> Option<f64> {
        match self.value {
            Value::Quantity(v, _) => Some(v),
            _ => None,
        }
    }

    /// A tuple of two quantities.
    pub fn pair(&self) -> Option<[f64; 2]> {
        match self.items() {
            [a, b] => Some([a.as_quantity()?, b.as_quantity()?]),
            _ => None,
        }
    }

    /// A tuple of three quantities.
    pub fn triple(&self) -> Option<[f64; 3]> {
        match self.items() {
            [a, b, c] => Some([a.as_quantity()?, b.as_quantity()?, c.as_quantity()?]),
            _ => None,
        }
    }
}
