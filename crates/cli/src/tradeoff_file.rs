//! The file of a tradeoff beside a session.

use std::path::Path;

use serde::Deserialize;
use skinrig_analysis::tradeoff::Tradeoff;

use crate::analyses::tradeoff_path;

/// Values of the document's `format` and `format_version`.
pub const FORMAT: (&str, u32) = ("skinrig-tradeoff", 1);

/// The tradeoff that an earlier `skinrig tradeoff` left beside a session: `None` where there is none, and why it cannot be read.
pub(crate) fn beside_session(session: &Path) -> Option<Result<Tradeoff, String>> {
    let path = tradeoff_path(session, None).with_extension("json");
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return None,
        Err(e) => return Some(Err(format!("{}: {e}", path.display()))),
    };
    let parsed = serde_json::from_str::<Document>(&text).map_err(|e| e.to_string());
    let fits = parsed.and_then(|d| {
        if (d.format.as_str(), d.format_version) == FORMAT {
            Ok(d.tradeoff)
        } else {
            Err(format!("found {} version {}", d.format, d.format_version))
        }
    });
    Some(fits.map_err(|found| {
        format!(
            "{}: expected {} version {}, {found}; next: `skinrig tradeoff` writes it anew",
            path.display(),
            FORMAT.0,
            FORMAT.1
        )
    }))
}

/// What is read of the document again.
#[derive(Deserialize)]
struct Document {
    format: String,
    format_version: u32,
    tradeoff: Tradeoff,
}
