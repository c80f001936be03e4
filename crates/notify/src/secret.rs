//! Secrets: read from the environment or a file, shown nowhere.

use std::fmt;

use skinrig_protocol::notify::Secret;

use crate::error::OpenError;

/// A password, token or address that must not be shown or recorded.
pub(crate) struct SecretText(pub(crate) String);

impl fmt::Debug for SecretText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("...")
    }
}

/// Reads the secret at the key `key` of `notify`.
///
/// # Errors
/// [`OpenError`] if the variable or file is missing or empty.
pub(crate) fn read(
    secret: &Secret,
    key: &'static str,
    environment: &dyn Fn(&str) -> Option<String>,
) -> Result<SecretText, OpenError> {
    if let Some(name) = &secret.variable {
        let value = environment(name).filter(|value| !value.is_empty());
        return value.map(SecretText).ok_or_else(|| OpenError::Variable {
            key,
            name: name.clone(),
        });
    }
    let path = secret.file.clone().unwrap_or_default();
    let text = std::fs::read_to_string(&path).map_err(|source| OpenError::File {
        key,
        path: path.clone(),
        source,
    })?;
    match text.lines().next().map(str::trim) {
        Some(line) if !line.is_empty() => Ok(SecretText(line.to_owned())),
        _ => Err(OpenError::EmptyFile { key, path }),
    }
}
