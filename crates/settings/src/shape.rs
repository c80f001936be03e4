//! The form of an input: tables of keys, which `#[derive(Settings)]` makes.
//!
//! A [`Table`] lists the keys of a mapping with their documentation, [`Shape`] and default. The reader turns a node into a
//! [`Field`](crate::Field) by its shape, so a key outside the table cannot be read, and every key is in the schema.

use crate::quantity::Dimension;
use crate::range::ValueRange;

/// The keys of one kind of mapping.
pub struct Table {
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
pub struct Key {
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// An error when missing.
    Required,
    /// Has no value when missing.
    Optional,
    /// Has this value when missing: a text that the key's shape reads.
    Default(&'static str),
}

/// A word that may stand for a value, and what it means.
pub type Word = (&'static str, &'static str);

/// What a value looks like.
pub enum Shape {
    /// A text that is not blank.
    Text,
    /// A bare whole number.
    Whole {
        /// Smallest.
        min: i64,
        /// Largest.
        max: i64,
    },
    /// A bare number without a dimension.
    Number(ValueRange),
    /// `true` or `false`.
    Flag,
    /// A number with a unit of one of these dimensions; the range holds for each.
    Quantity(&'static [Dimension], ValueRange),
    /// One of some words.
    Choice(&'static [Word]),
    /// A list of exactly these, for example x and y.
    Tuple(&'static Shape, &'static [&'static str]),
    /// A list.
    List {
        /// Each item.
        of: &'static Shape,
        /// Fewest items.
        min: usize,
        /// Most items.
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

impl Shape {
    /// A whole number in a range of whole numbers; above 2^53 the end is open.
    #[must_use]
    pub const fn whole(range: ValueRange) -> Self {
        Self::Whole {
            min: range.min as i64,
            max: range.max as i64,
        }
    }
}
