//! Why channels cannot be opened.

use std::io;
use std::path::PathBuf;

/// Why the channels could not be opened. Nothing was sent.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// A variable is missing.
    #[error(
        "notify.{key}: expected a secret in the environment variable {name}, found none\n  next: export {name}=..."
    )]
    Variable {
        /// Key of the secret.
        key: &'static str,
        /// Name of the variable.
        name: String,
    },
    /// A file cannot be read.
    #[error(
        "notify.{key}: expected a file with the secret, found {}: {source}\n  next: write the secret into this file, readable by you alone", path.display()
    )]
    File {
        /// Key of the secret.
        key: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A file has no secret.
    #[error(
        "notify.{key}: expected the secret in the first line of {}, found an empty line\n  next: write it there", path.display()
    )]
    EmptyFile {
        /// Key of the secret.
        key: &'static str,
        /// Path of the file.
        path: PathBuf,
    },
    /// This build has no TLS.
    #[error(
        "notify.{key}: expected a build of skinrig with TLS, found one without\n  \
         next: cargo build --release -p skinrig --features tls, or use `notify.command`"
    )]
    NeedsTls {
        /// Key that needs it.
        key: &'static str,
    },
    /// The address of the webhook is not one.
    #[error(
        "notify.webhook.url: expected an address such as `https://hooks.example.org/bench`, found something else\n  next: correct it"
    )]
    Url,
    /// The secret address is not one.
    #[error(
        "notify.webhook.secret_url: expected an address that begins with `https://`, or with `http://` for a server on this \
         computer, and a port from 1 to 65535 if it has one, found something else\n  next: correct the variable or file"
    )]
    SecretUrl,
    /// The token cannot be in a header.
    #[error(
        "notify.webhook.token: expected printable ASCII, found other characters\n  next: correct the variable or file"
    )]
    Token,
    /// A mail address or server name cannot be used.
    #[error("notify.mail.{key}: expected a valid address, found `{found}`\n  next: correct it")]
    Address {
        /// Key of the address.
        key: &'static str,
        /// As in the settings.
        found: String,
    },
}
