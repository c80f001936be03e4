//! Owns the file of answers: the positions of the scored presses, and how they are scored.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use skinrig_model::SkinOutline;

use super::FORMAT;
use super::error::ChallengeError;

/// The sealed part of a challenge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    /// Version of the layout.
    pub format: u32,
    /// Random bytes in hexadecimal, which keep others from guessing the file from its hash; empty in older files.
    #[serde(default)]
    pub salt: String,
    /// Session behind the challenge.
    pub session_id: String,
    /// Outline of the skin.
    pub outline: SkinOutline,
    /// Distance of the within rate, mm.
    pub within_mm: f64,
    /// Bootstrap samples of the intervals.
    pub bootstrap_resamples: u32,
    /// Their seed.
    pub seed: u64,
    /// The selection behind the challenge; its excluded presses are not part of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<ChallengeSelection>,
    /// Scored presses by number.
    pub presses: Vec<Answer>,
}

/// A selection that excludes presses from a challenge.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChallengeSelection {
    /// Its name.
    pub name: String,
    /// SHA-256 of its file.
    pub sha256: String,
    /// Number of presses that it excludes from the session.
    pub excluded: u32,
}

/// Where a press was made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Number in the challenge.
    pub press: u32,
    /// Number in the session.
    pub session_press: u32,
    /// Number of its location, for intervals.
    pub location: u32,
    /// Planned depth, or the measured one if the press ended before it, mm.
    pub depth_mm: f64,
    /// Measured position, mm.
    pub x_mm: f64,
    /// Measured position, mm.
    pub y_mm: f64,
}

/// SHA-256 of bytes, in hexadecimal.
pub(super) fn hash(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Bytes in hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    let mut text = String::with_capacity(2 * bytes.len());
    for byte in bytes {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}

impl Answers {
    /// Reads the file, which must have this hash.
    ///
    /// # Errors
    /// [`ChallengeError::NotAChallenge`] and [`ChallengeError::OtherAnswers`].
    pub fn read(path: &Path, sha256: &str) -> Result<Self, ChallengeError> {
        let refused = |found: String| ChallengeError::NotAChallenge {
            path: path.to_owned(),
            expected: "the answers of a challenge",
            found,
        };
        let bytes = std::fs::read(path).map_err(|e| refused(e.to_string()))?;
        let answers: Self = serde_json::from_slice(&bytes).map_err(|e| refused(e.to_string()))?;
        if answers.format != FORMAT {
            return Err(refused(format!("format {}", answers.format)));
        }
        let found = hash(&bytes);
        if found == sha256 {
            Ok(answers)
        } else {
            Err(ChallengeError::OtherAnswers {
                path: path.to_owned(),
                expected: sha256.to_owned(),
                found,
            })
        }
    }
}
