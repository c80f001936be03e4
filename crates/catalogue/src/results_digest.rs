//! Owns the digest of a results file: its last member, `sha256`, over every byte before that member.
//!
//! It shows that a file was changed after skinrig wrote it, by hand or by a broken disk. It is not a signature: whoever wants to
//! deceive can compute it anew.

use sha2::{Digest, Sha256};

/// Precedes the digest. A JSON string holds no line break, so that no text of the document looks like it.
const MEMBER: &str = ",\n  \"sha256\": \"";
/// Follows the digest.
const END: &str = "\"\n}";
/// Length of a digest in hexadecimal characters.
const DIGITS: usize = 64;

/// Why the digest of a results file does not vouch for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DigestError {
    /// The file does not end with a digest.
    #[error(
        "results without a digest at their end, of an older skinrig or changed: analyze the session again"
    )]
    Missing,
    /// The digest is that of another content.
    #[error("the results were changed after they were written: analyze the session again")]
    Differs,
}

/// Adds the digest to a document, an indented JSON object with at least one member. A document that is none stays as it is, and
/// [`check`] rejects it.
#[must_use]
pub fn with_digest(document: &str) -> String {
    let Some(body) = document.trim_end().strip_suffix("\n}") else {
        return document.to_owned();
    };
    format!("{body}{MEMBER}{}{END}", hex(body.as_bytes()))
}

/// Checks the digest of a results file.
///
/// # Errors
/// [`DigestError`] if it is missing or that of another content.
pub fn check(file: &[u8]) -> Result<(), DigestError> {
    let end = file.trim_ascii_end();
    let parts = || {
        let rest = end.strip_suffix(END.as_bytes())?;
        let (rest, digest) = rest.split_at_checked(rest.len().checked_sub(DIGITS)?)?;
        Some((rest.strip_suffix(MEMBER.as_bytes())?, digest))
    };
    let (body, digest) = parts().ok_or(DigestError::Missing)?;
    if hex(body).as_bytes() == digest {
        Ok(())
    } else {
        Err(DigestError::Differs)
    }
}

fn hex(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = "{\n  \"rmse_mm\": 2.5,\n  \"valid\": true\n}";

    #[test]
    fn a_document_with_its_digest_is_the_same_json_with_one_member_more() {
        let text = with_digest(DOCUMENT);
        assert_eq!(check(text.as_bytes()), Ok(()));
        assert_eq!(check(format!("{text}\n").as_bytes()), Ok(()));
        let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
        value.as_object_mut().unwrap().remove("sha256");
        assert_eq!(
            value,
            serde_json::from_str::<serde_json::Value>(DOCUMENT).unwrap()
        );
    }

    #[test]
    fn every_changed_byte_is_noticed() {
        let text = with_digest(DOCUMENT);
        for at in 0..text.len() {
            let mut changed = text.clone().into_bytes();
            changed[at] ^= 1;
            assert!(check(&changed).is_err(), "byte {at}");
        }
        for length in 0..text.len() {
            assert!(
                check(&text.as_bytes()[..length]).is_err(),
                "first {length} bytes"
            );
        }
        assert_eq!(check(DOCUMENT.as_bytes()), Err(DigestError::Missing));
        assert_eq!(
            check(text.replace("2.5", "0.5").as_bytes()),
            Err(DigestError::Differs)
        );
    }
}
