//! Addresses of objects: `s3://BUCKET/KEY`.

use std::fmt;

/// Address of an object, or of all objects whose keys begin alike.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObjectUrl {
    /// Name of the bucket.
    pub bucket: String,
    /// Key in the bucket, without a slash at either end.
    pub key: String,
}

/// Text that is no address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected an address s3://BUCKET/KEY, found `{0}`")]
pub struct AddressError(String);

impl ObjectUrl {
    /// Parses `s3://BUCKET/KEY`.
    ///
    /// # Errors
    /// [`AddressError`] for any other text, an empty key, and parts that are empty, `.` or `..`.
    pub fn parse(text: &str) -> Result<Self, AddressError> {
        let refused = || AddressError(text.escape_debug().to_string());
        let rest = text.strip_prefix("s3://").ok_or_else(refused)?;
        let (bucket, key) = rest.split_once('/').ok_or_else(refused)?;
        let key = key.trim_end_matches('/');
        // Names of buckets: docs.aws.amazon.com/AmazonS3/latest/userguide/bucketnamingrules.html
        let is_bucket = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-.".contains(c);
        let is_part =
            |part: &str| !matches!(part, "" | "." | "..") && !part.contains(char::is_control);
        if bucket.is_empty() || !bucket.chars().all(is_bucket) || !key.split('/').all(is_part) {
            return Err(refused());
        }
        Ok(Self {
            bucket: bucket.to_owned(),
            key: key.to_owned(),
        })
    }

    /// The object of this name below this key.
    #[must_use]
    pub fn join(&self, name: &str) -> Self {
        Self {
            bucket: self.bucket.clone(),
            key: format!("{}/{name}", self.key),
        }
    }

    /// Last part of the key.
    #[must_use]
    pub fn name(&self) -> &str {
        self.key.rsplit('/').next().unwrap_or_default()
    }
}

impl fmt::Display for ObjectUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s3://{}/{}", self.bucket, self.key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_back_as_written() {
        let url = ObjectUrl::parse("s3://lab.skins/mold 3/a.session.sqlite").unwrap();
        assert_eq!(
            (url.bucket.as_str(), url.name()),
            ("lab.skins", "a.session.sqlite")
        );
        assert_eq!(ObjectUrl::parse(&url.to_string()), Ok(url));
        let folder = ObjectUrl::parse("s3://lab/2026/").unwrap();
        assert_eq!(folder.join("b").to_string(), "s3://lab/2026/b");
        for wrong in [
            "",
            "lab/a",
            "s3://lab",
            "s3://lab/",
            "s3:///a",
            "s3://Lab/a",
            "s3://lab/a//b",
            "s3://lab/../a",
            "s3://lab/a\n",
        ] {
            let refused = ObjectUrl::parse(wrong).unwrap_err();
            assert!(refused.to_string().contains("s3://BUCKET/KEY"), "{wrong}");
        }
    }
}
