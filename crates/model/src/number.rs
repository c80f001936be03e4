//! Numbers in JSON, with those that JSON lacks: `"NaN"`, `"inf"` and `"-inf"`. For `#[serde(with = "crate::number")]`.

use serde::{Deserialize, Deserializer, Serializer, de};

/// Writes a number, or the name of one that is not finite.
///
/// # Errors
/// Those of the serializer.
pub(crate) fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() {
        to.serialize_f64(*value)
    } else {
        to.collect_str(value)
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Stored {
    Finite(f64),
    Name(String),
}

/// Reads a number, or the name of one that is not finite.
///
/// # Errors
/// Those of the deserializer; any other name.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    match Stored::deserialize(from)? {
        Stored::Finite(value) => Ok(value),
        Stored::Name(name) => match name.parse() {
            Ok(value) => Ok(value),
            Err(_) => Err(de::Error::custom(format_args!(
                "expected a number, found `{name}`"
            ))),
        },
    }
}
