//! Identifiers of cameras, planned presses, locations, repetitions and attempts.

use std::fmt;

use serde::de::{Error as _, Unexpected};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use skinrig_settings::{Collector, Field, Setting, Shape};

/// One of the two event cameras. The paper's camera 1 sits at negative y, camera 2 at positive y of the
/// skin's right edge (paper, section "Geometric Triangulation").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum CameraId {
    /// Camera 1.
    #[serde(rename = "camera1")]
    One,
    /// Camera 2.
    #[serde(rename = "camera2")]
    Two,
}

impl CameraId {
    /// Both cameras, in order.
    pub const ALL: [Self; 2] = [Self::One, Self::Two];

    /// 0 for camera 1, 1 for camera 2: the position in per-camera arrays.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::One => 0,
            Self::Two => 1,
        }
    }

    /// The number for display: 1 or 2.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.index() as u8 + 1
    }

    /// The camera with the number 1 or 2.
    #[must_use]
    pub const fn from_number(number: i64) -> Option<Self> {
        match number {
            1 => Some(Self::One),
            2 => Some(Self::Two),
            _ => None,
        }
    }
}

impl fmt::Display for CameraId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "camera {}", self.number())
    }
}

/// Defines an identifier that is displayed counted from 1 and is an index from 0 inside.
macro_rules! numbered {
    ($(#[$doc:meta])* $name:ident, $word:literal) => {
        $(#[$doc])*
        ///
        /// Displayed and serialized with its number, from 1. Fields of stored formats with the index instead use
        /// with [`as_index`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        pub struct $name(u32);

        impl $name {
            /// The identifier with this index, counted from 0.
            #[must_use]
            pub const fn from_index(index: u32) -> Self {
                Self(index)
            }

            /// The identifier with this number, counted from 1; `None` for 0.
            #[must_use]
            pub const fn from_number(number: u32) -> Option<Self> {
                match number.checked_sub(1) {
                    Some(index) => Some(Self(index)),
                    None => None,
                }
            }

            /// Counted from 0: the position in lists, and the number in session files.
            #[must_use]
            pub const fn index(self) -> u32 {
                self.0
            }

            /// Counted from 1: the number for display.
            #[must_use]
            pub const fn number(self) -> u32 {
                self.0.saturating_add(1)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($word, " {}"), self.number())
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_u32(self.number())
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let number = u32::deserialize(from)?;
                Self::from_number(number).ok_or_else(|| {
                    D::Error::invalid_value(Unexpected::Unsigned(0), &"a number from 1")
                })
            }
        }

        impl Indexed for $name {
            fn from_index(index: u32) -> Self {
                Self(index)
            }

            fn index(self) -> u32 {
                self.0
            }
        }
    };
}

numbered! {
    /// A planned press: its position in the plan, sync presses included.
    PressId, "press"
}

numbered! {
    /// A repetition of the path.
    RepetitionId, "repetition"
}

numbered! {
    /// A location of the path, the same in every repetition and depth.
    LocationId, "location"
}

/// An identifier that can be stored as an index, counted from 0.
pub trait Indexed: Copy {
    /// The identifier with this index, counted from 0.
    fn from_index(index: u32) -> Self;
    /// Counted from 0.
    fn index(self) -> u32;
}

/// For `#[serde(with = "as_index")]`: stores a field as an index, counted from 0, as in plans.
pub mod as_index {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::Indexed;

    /// Writes the index.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<T: Indexed, S: Serializer>(id: &T, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u32(id.index())
    }

    /// Reads an index.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, T: Indexed, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
        u32::deserialize(from).map(T::from_index)
    }

    /// The same for an optional identifier.
    pub mod option {
        use serde::{Deserialize, Deserializer, Serialize, Serializer};

        use super::Indexed;

        /// Writes the index, or none.
        ///
        /// # Errors
        /// Those of the serializer.
        pub fn serialize<T: Indexed, S: Serializer>(
            id: &Option<T>,
            to: S,
        ) -> Result<S::Ok, S::Error> {
            id.map(T::index).serialize(to)
        }

        /// Reads an index, or none.
        ///
        /// # Errors
        /// Those of the deserializer.
        pub fn deserialize<'de, T: Indexed, D: Deserializer<'de>>(
            from: D,
        ) -> Result<Option<T>, D::Error> {
            Ok(Option::<u32>::deserialize(from)?.map(T::from_index))
        }
    }
}

/// One attempt at a planned press. The first is number 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AttemptId {
    /// The planned press.
    pub press: PressId,
    /// 1 for the first attempt.
    pub number: u32,
}

impl fmt::Display for AttemptId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (attempt {})", self.press, self.number)
    }
}

impl Setting for PressId {
    const SHAPE: Shape = Shape::Whole {
        min: 1,
        max: 10_000_000,
    };

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        let number = u32::try_from(field.as_whole()?).ok()?;
        Self::from_number(number)
    }

    fn text(&self) -> String {
        self.number().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_people_read_count_from_one() {
        let press = PressId::from_index(0);
        assert_eq!(press.to_string(), "press 1");
        assert_eq!(LocationId::from_index(4).to_string(), "location 5");
        assert_eq!(RepetitionId::from_index(1).to_string(), "repetition 2");
        assert_eq!(PressId::from_number(1), Some(press));
        assert_eq!(PressId::from_number(0), None);
        assert_eq!(serde_json::to_string(&press).unwrap(), "1");
        assert_eq!(serde_json::from_str::<PressId>("1").unwrap(), press);
        assert!(serde_json::from_str::<PressId>("0").is_err());
    }

    #[test]
    fn a_stored_index_counts_from_zero() {
        #[derive(Serialize, Deserialize, PartialEq, Debug)]
        struct Stored {
            #[serde(with = "as_index")]
            press: PressId,
            #[serde(with = "as_index::option")]
            repetition: Option<RepetitionId>,
        }
        let stored = Stored {
            press: PressId::from_index(6),
            repetition: Some(RepetitionId::from_index(0)),
        };
        let text = r#"{"press":6,"repetition":0}"#;
        assert_eq!(serde_json::to_string(&stored).unwrap(), text);
        assert_eq!(serde_json::from_str::<Stored>(text).unwrap(), stored);
    }
}
