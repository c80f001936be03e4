//! Where a catalogue is: a file, or a database of a PostgreSQL server.

use std::ffi::OsStr;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::error::CatalogueError;

/// Name of the embedded catalogue in a folder of sessions.
pub const CATALOGUE_FILE: &str = "catalogue.sqlite";

/// Where a catalogue is. Displays without password and options.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// An SQLite file.
    File(PathBuf),
    /// A database of a PostgreSQL server, `postgres://USER@HOST/DATABASE`.
    Server(ServerUrl),
}

/// Address of a database; may contain a password, which is never displayed.
#[derive(Clone, PartialEq, Eq)]
pub struct ServerUrl(String);

impl ServerUrl {
    /// The whole address.
    #[cfg(feature = "postgres")]
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for ServerUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for ServerUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scheme, rest) = self.0.split_once("://").unwrap_or(("postgres", ""));
        let rest = rest.split(['?', '#']).next().unwrap_or_default();
        match rest.rsplit_once('@') {
            Some((user, host)) => {
                let user = user.split(':').next().unwrap_or_default();
                write!(f, "{scheme}://{user}@{host}")
            }
            None => write!(f, "{scheme}://{rest}"),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Server(url) => url.fmt(f),
        }
    }
}

impl Address {
    /// The embedded catalogue of a folder of sessions.
    #[must_use]
    pub fn of_folder(folder: &Path) -> Self {
        Self::File(folder.join(CATALOGUE_FILE))
    }

    /// Parses an address: a URL of PostgreSQL, or the path of a file.
    #[must_use]
    pub fn parse(text: &OsStr) -> Self {
        match text.to_str() {
            Some(url) if url.starts_with("postgres://") || url.starts_with("postgresql://") => {
                Self::Server(ServerUrl(url.to_owned()))
            }
            _ => Self::File(text.into()),
        }
    }

    /// Name of a folder of sessions in this catalogue: empty for the folder of the file itself, so that both can be moved together.
    pub(crate) fn store_of(&self, folder: &Path) -> Result<String, CatalogueError> {
        let full = |path: &Path| {
            let path = if path.as_os_str().is_empty() {
                Path::new(".")
            } else {
                path
            };
            path.canonicalize().map_err(|source| CatalogueError::Io {
                path: path.to_owned(),
                doing: "finding its place",
                source,
            })
        };
        let folder = full(folder)?;
        match self {
            Self::File(file) if full(file.parent().unwrap_or(Path::new("")))? == folder => {
                Ok(String::new())
            }
            Self::File(_) => Ok(folder.display().to_string()),
            Self::Server(_) => Ok(format!("{}:{}", computer(), folder.display())),
        }
    }

    /// The computer in a name that [`store_of`](Self::store_of) gave; `None` in a file, which is of one computer.
    pub(crate) fn computer_of<'a>(&self, store: &'a str) -> Option<&'a str> {
        match self {
            Self::File(_) => None,
            Self::Server(_) => store.split_once(':').map(|(computer, _)| computer),
        }
    }

    /// The folder that [`store_of`](Self::store_of) called `store`, if it is on this computer.
    pub(crate) fn folder_of(&self, store: &str) -> Option<PathBuf> {
        match self {
            Self::File(file) if store.is_empty() => file.parent().map(Path::to_owned),
            Self::File(_) => Some(store.into()),
            Self::Server(_) => {
                let path = store.strip_prefix(&computer())?.strip_prefix(':')?;
                Some(path.into())
            }
        }
    }
}

/// Name of this computer with a part of its identifier: two benches may have the same name.
fn computer() -> String {
    use sha2::{Digest, Sha256};
    let line = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let name = line("/proc/sys/kernel/hostname");
    let identifier = line("/etc/machine-id");
    let digest = Sha256::digest(identifier.trim());
    format!(
        "{}-{:02x}{:02x}{:02x}",
        name.trim(),
        digest[0],
        digest[1],
        digest[2]
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_never_displayed() {
        for (url, shown) in [
            (
                "postgres://ann:secret@db.lab:5432/skins?sslmode=verify-full",
                "postgres://ann@db.lab:5432/skins",
            ),
            (
                "postgresql://db/skins?password=secret",
                "postgresql://db/skins",
            ),
            ("postgres://ann:sec@ret@db/skins", "postgres://ann@db/skins"),
        ] {
            let address = Address::parse(OsStr::new(url));
            assert_eq!(address.to_string(), shown);
            assert!(!format!("{address:?}").contains("sec"));
        }
        let file = Address::parse(OsStr::new("lab/catalogue.sqlite"));
        assert_eq!(file, Address::of_folder(Path::new("lab")));
    }
}
