//! Settings files. Each key is declared once, by the struct that contains it; text is parsed with locations and help.
//!
//! A struct with `#[derive(Settings)]` is a mapping of a YAML file: a field gives the key's name, unit, range, default and
//! documentation. This one declaration yields the reader ([`open`]), `--set`, the JSON Schema (by [`Settings::TABLE`]), the
//! `Default` of the struct, the check of a value built in code ([`Settings::out_of_range`]) and
//! its rows for display ([`Settings::rows`]). An enum with `#[derive(Choice)]` is a key with a choice of words.
//!
//! ```
//! use skinrig_settings::{Choice, Settings};
//!
//! /// When a pose counts as settled.
//! #[derive(Debug, PartialEq, Settings)]
//! #[settings(name = "settle")]
//! struct Settle {
//!     /// Largest distance from the target.
//!     #[setting(default = "0.05 mm", above = 0.0, max = 10.0)]
//!     tolerance_mm: f64,
//!     /// Samples in a row.
//!     #[setting(default = "3", min = 1, max = 100)]
//!     samples: u32,
//! }
//!
//! assert_eq!(Settle::default(), Settle { tolerance_mm: 0.05, samples: 3 });
//! ```
//!
//! The name of a field ends in its unit, and the key is the name without it: `tolerance_mm` is the key `tolerance`, a length in
//! mm. Units: `mm`, `s`, `ms`, `us`, `mm_s`, `mm_s2`, `mm_s3`, `n`, `deg`, `hz`, `px`, `kg`, `ev_s`, `b`, `b_s`, `percent`,
//! `deg_c`, `ppm`. A range is in the unit of the field.

mod diagnostic;
mod field;
mod given;
mod language;
mod overrides;
pub mod quantity;
mod range;
mod read;
mod rewrite;
mod scalar;
mod setting;
mod shape;
mod source;
mod wording;
mod yaml;

pub use diagnostic::{Collector, Diagnostic, Diagnostics, Finding, closest, did_you_mean, one_of};
pub use field::{Field, Value};
pub use given::given;
pub use language::open;
pub use quantity::Dimension;
pub use range::ValueRange;
pub use rewrite::rewrite;
pub use setting::{
    Choice, NumberSpan, Numbers, OutOfRange, Row, Setting, Settings, in_unit, key_path, whole_units,
};
pub use shape::{Key, Need, Shape, Table, Word, count_keys, join_keys};
pub use skinrig_settings_derive::{Choice, Settings};
pub use source::{Location, Sources, Span};
pub use wording::{example, expectation};
pub use yaml::{LARGEST_TEXT, decode, quote};
