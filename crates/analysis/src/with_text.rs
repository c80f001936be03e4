//! How results hold causes: kind and fields for programs, and `text` for people, which is never read back.

/// Implements `Serialize` and `Deserialize` for a type whose derived versions are its own (`#[serde(remote = "Self")]`):
/// the derived fields, and `text`, its `Display`.
macro_rules! with_text {
    ($cause:ident) => {
        impl serde::Serialize for $cause {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                #[derive(serde::Serialize)]
                struct Written<'a> {
                    #[serde(flatten, serialize_with = "fields")]
                    cause: &'a $cause,
                    text: String,
                }
                fn fields<S: serde::Serializer>(cause: &&$cause, to: S) -> Result<S::Ok, S::Error> {
                    // The derived one, not that of the trait.
                    $cause::serialize(cause, to)
                }
                let written = Written {
                    cause: self,
                    text: self.to_string(),
                };
                serde::Serialize::serialize(&written, to)
            }
        }

        impl<'de> serde::Deserialize<'de> for $cause {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                Self::deserialize(from)
            }
        }
    };
}

pub(crate) use with_text;
