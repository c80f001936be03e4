//! The text header of a RAW file.

use std::path::Path;

use skinrig_model::StreamFormat;

use super::problem::{FormatProblem, HeaderProblem, ValueMismatch};
use crate::error::FormatsError;
use crate::stream::Geometry;

/// Longest header line, bytes.
pub(super) const MAX_LINE: usize = 1024;
/// Most header lines.
pub(super) const MAX_LINES: usize = 255;
/// Longest header, bytes.
pub(super) const MAX_HEADER: usize = (MAX_LINES + 1) * (MAX_LINE + 2);

/// A parsed header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawHeader {
    /// All keys and values in file order, unknown ones included. Runs of spaces in values are single spaces.
    pub entries: Vec<(String, String)>,
    /// True when the header ends with `% end`.
    pub has_end: bool,
    /// Length of the header in bytes: the offset of the first word.
    pub length: u64,
    /// Word format.
    pub format: StreamFormat,
    /// The sensor's size: as stated, or known from the camera's system ID; `None` without either.
    pub geometry: Option<Geometry>,
}

/// State while reading a header.
#[derive(Default)]
struct ParsedKeys {
    format: Option<String>,
    evt: Option<String>,
    legacy_order: Option<bool>,
    width: Option<u16>,
    height: Option<u16>,
    system_id: Option<u32>,
    prophesee: bool,
}

impl RawHeader {
    /// Parses the header at the beginning of `bytes`, which must contain all of it, or the whole file.
    ///
    /// # Errors
    /// [`FormatsError::Header`] with byte offset and key: no header, text that is not UTF-8, invalid
    /// numbers, contradictory keys, or a missing format.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, FormatsError> {
        let mut entries = Vec::new();
        let mut keys = ParsedKeys::default();
        let (mut at, mut has_end) = (0, false);
        while !has_end && bytes[at..].starts_with(b"% ") {
            let error = |key: &str, problem| FormatsError::Header {
                path: path.into(),
                offset: at as u64,
                key: key.into(),
                problem,
            };
            let line = &bytes[at + 2..];
            let line = &line[..line.len().min(MAX_LINE)];
            let Some(length) = line.iter().position(|b| *b == b'\n') else {
                return Err(error("", HeaderProblem::LongLine));
            };
            let Ok(text) = std::str::from_utf8(&line[..length]) else {
                let found = String::from_utf8_lossy(&line[..length.min(40)]).into_owned();
                return Err(error("", HeaderProblem::NotUtf8 { found }));
            };
            let mut tokens = text.split_whitespace();
            let Some(key) = tokens.next() else {
                return Err(error("", HeaderProblem::NoKey));
            };
            let value = tokens.collect::<Vec<_>>().join(" ");
            has_end = key == "end";
            if !has_end {
                if entries.len() == MAX_LINES {
                    return Err(error(key, HeaderProblem::ManyLines));
                }
                keys.take(key, &value).map_err(|mismatch| {
                    let found = value.clone();
                    error(key, HeaderProblem::Value { mismatch, found })
                })?;
                entries.push((key.to_owned(), value));
            }
            at += 2 + length + 1;
        }
        let error = |key: &str, problem| FormatsError::Header {
            path: path.into(),
            offset: at as u64,
            key: key.into(),
            problem,
        };
        if at == 0 {
            let start = String::from_utf8_lossy(&bytes[..bytes.len().min(8)]).into_owned();
            return Err(error("", HeaderProblem::Missing { start }));
        }
        let format = keys
            .stream_format()
            .map_err(|why| error("format", HeaderProblem::Format(why)))?;
        Ok(Self {
            geometry: keys.geometry(),
            entries,
            has_end,
            length: at as u64,
            format,
        })
    }

    /// The value of `key`, the last one if it occurs twice.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        let found = self.entries.iter().rev().find(|(k, _)| k == key);
        found.map(|(_, value)| value.as_str())
    }

    /// The camera's serial number.
    #[must_use]
    pub fn serial_number(&self) -> Option<&str> {
        self.get("serial_number")
    }
}

impl ParsedKeys {
    /// Processes one entry; the error states the expected value.
    fn take(&mut self, key: &str, value: &str) -> Result<(), ValueMismatch> {
        match key {
            "format" => {
                let mut parts = value.split(';').map(str::trim);
                self.format = parts.next().map(ToOwned::to_owned);
                for option in parts.filter(|o| !o.is_empty()) {
                    match option.split_once('=') {
                        Some(("width", n)) => set_size(&mut self.width, n, "width")?,
                        Some(("height", n)) => set_size(&mut self.height, n, "height")?,
                        Some(("endianness", order)) => self.set_order(order)?,
                        Some(_) => {}
                        None => return Err(ValueMismatch::Options),
                    }
                }
            }
            "evt" => self.evt = Some(value.to_owned()),
            "endianness" => self.set_order(value)?,
            "geometry" => {
                let Some((width, height)) = value.split_once('x') else {
                    return Err(ValueMismatch::Geometry);
                };
                set_size(&mut self.width, width, "width")?;
                set_size(&mut self.height, height, "height")?;
            }
            "system_ID" => {
                let id = value.parse().map_err(|_| ValueMismatch::Number)?;
                self.system_id = Some(id);
            }
            "integrator_name" | "camera_integrator_name" => {
                self.prophesee |= value.eq_ignore_ascii_case("prophesee");
            }
            _ => {}
        }
        Ok(())
    }

    fn set_order(&mut self, order: &str) -> Result<(), ValueMismatch> {
        let legacy = match order {
            "legacy" => true,
            "little" => false,
            _ => return Err(ValueMismatch::Endianness),
        };
        if self.legacy_order.is_some_and(|stated| stated != legacy) {
            return Err(ValueMismatch::OtherEndianness);
        }
        self.legacy_order = Some(legacy);
        Ok(())
    }

    fn stream_format(&self) -> Result<StreamFormat, FormatProblem> {
        // System IDs (EVK1 reference, sections 1.1 and 4.4): 28 EVK1 Gen3.1, 35 and 40 EVK3 Gen3.1.
        let by_camera = match self.system_id {
            Some(28 | 35) => Some("2.0"),
            Some(40) => Some("3.0"),
            _ => None,
        };
        let by_format = match self.format.as_deref() {
            None => None,
            Some("EVT2") => Some("2.0"),
            Some("EVT21") => Some("2.1"),
            Some("EVT3") => Some("3.0"),
            Some(other) => {
                let format = other.to_owned();
                return Err(FormatProblem::Format { format });
            }
        };
        let version = match (by_format, self.evt.as_deref()) {
            (Some(format), Some(evt)) if format != evt => {
                return Err(FormatProblem::Contradiction {
                    format: self.format.clone().unwrap_or_default(),
                    evt: evt.to_owned(),
                });
            }
            (Some(version), _) | (None, Some(version)) => Some(version),
            (None, None) => by_camera,
        };
        match version {
            Some("2.0") => Ok(StreamFormat::Evt2),
            Some("3.0") => Ok(StreamFormat::Evt3),
            Some("2.1") => {
                // Without a statement, the vendor's cameras below this system ID used the older order.
                let old_camera = self.prophesee && self.system_id.is_some_and(|id| id < 0x37);
                Ok(if self.legacy_order.unwrap_or(old_camera) {
                    StreamFormat::Evt21Legacy
                } else {
                    StreamFormat::Evt21
                })
            }
            Some(other) => Err(FormatProblem::Evt {
                evt: other.to_owned(),
            }),
            None => Err(FormatProblem::Unstated),
        }
    }

    fn geometry(&self) -> Option<Geometry> {
        match (self.width, self.height, self.system_id) {
            (Some(width), Some(height), _) => Some(Geometry { width, height }),
            // Cameras with a Gen3.0 or Gen3.1 VGA sensor (EVK1 reference, section 1.1).
            (None, None, Some(21 | 28 | 35 | 40 | 41)) => Some(Geometry::EVK1),
            _ => None,
        }
    }
}

/// Stores a stated size, which must not contradict an earlier one.
fn set_size(size: &mut Option<u16>, text: &str, side: &'static str) -> Result<(), ValueMismatch> {
    let value = text
        .trim()
        .parse()
        .ok()
        .filter(|v| (1..=2048).contains(v))
        .ok_or(ValueMismatch::Size { side })?;
    match size.replace(value) {
        Some(stated) if stated != value => Err(ValueMismatch::OtherSize { side, stated }),
        _ => Ok(()),
    }
}
