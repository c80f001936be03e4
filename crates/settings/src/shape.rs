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

impl Table {
    /// The keys of which at least one must be given.
    pub fn at_least_one(&self) -> impl Iterator<Item = &'static str> + use<> {
        let keys = self.keys.iter();
        keys.filter(|k| k.need == Need::AtLeastOne).map(|k| k.name)
    }
}

/// One key of a mapping.
#[derive(Clone, Copy)]
pub struct Key {
    /// As typed.
    pub name: &'static str,
    /// What it means, for the schema and for people.
    pub doc: &'static str,
    /// What its value looks like.
    pub shape: Shape,
    /// Whether it must be there.
    pub need: Need,
    /// A value for the help when it is missing; `None`: one that fits the shape.
    pub example: Option<&'static str>,
}

/// Whether a key must be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// An error when missing.
    Required,
    /// Has no value when missing.
    Optional,
    /// Has no value when missing, but of the keys of a mapping with this need at least one must be there.
    AtLeastOne,
    /// Has this value when missing: a text that the key's shape reads.
    Default(&'static str),
}

/// A word that may stand for a value, and what it means.
pub type Word = (&'static str, &'static str);

/// What a value looks like.
#[derive(Clone, Copy)]
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

/// How many keys there are in several mappings.
#[doc(hidden)]
#[must_use]
pub const fn count_keys(parts: &[&[Key]]) -> usize {
    let (mut part, mut count) = (0, 0);
    while part < parts.len() {
        count += parts[part].len();
        part += 1;
    }
    count
}

/// The keys of several mappings in one, `N` altogether.
#[doc(hidden)]
#[must_use]
pub const fn join_keys<const N: usize>(parts: &[&[Key]]) -> [Key; N] {
    let mut keys = [Key {
        name: "",
        doc: "",
        shape: Shape::Flag,
        need: Need::Optional,
        example: None,
    }; N];
    let (mut part, mut at) = (0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            keys[at] = parts[part][i];
            i += 1;
            at += 1;
        }
        part += 1;
    }
    keys
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
