//! Errors of a catalogue.

use std::path::PathBuf;

use skinrig_nightly::trend::NoSuchNights;
use skinrig_recorder::SESSION_SUFFIX;
use skinrig_settings::Diagnostics;

/// A catalogue could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogueError {
    /// An operation of the file system failed.
    #[error("{}: {doing}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The failed operation.
        doing: &'static str,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not called like a session: lists of its folder do not find it.
    #[error(
        "{}: expected a name that ends with `{SESSION_SUFFIX}`, found another, which lists of its folder leave out; rename the file", path.display()
    )]
    OtherName {
        /// The file.
        path: PathBuf,
    },
    /// A query failed.
    #[error("{place}: {doing}: {source}")]
    Sql {
        /// The catalogue, without a password.
        place: String,
        /// The failed operation.
        doing: &'static str,
        /// Error of the database.
        source: Box<sqlx::Error>,
    },
    /// A server did not let this user in.
    #[error("{place}: connecting to it: {source}; {next}")]
    Connection {
        /// The catalogue, without a password.
        place: String,
        /// Error of the connection.
        source: Box<sqlx::Error>,
        /// What to do.
        next: &'static str,
    },
    /// Another program is writing the catalogue.
    #[error("{place}: {doing}: another program is writing the catalogue; try again")]
    Busy {
        /// The catalogue.
        place: String,
        /// The operation that waited.
        doing: &'static str,
    },
    /// The user of a server may not do this.
    #[error(
        "{place}: {doing}: {found}; ask an administrator for the role that allows it; `skinrig catalogue roles --help` lists the roles"
    )]
    Denied {
        /// The catalogue, without a password.
        place: String,
        /// The operation.
        doing: &'static str,
        /// The server's words.
        found: String,
    },
    /// There is no catalogue.
    #[error("{place}: expected a catalogue, found none; `skinrig catalogue rebuild` creates one")]
    Missing {
        /// The catalogue.
        place: String,
    },
    /// The file is not a catalogue.
    #[error(
        "{place}: expected a catalogue, found {found}; move it away, then `skinrig catalogue rebuild`"
    )]
    Foreign {
        /// The file.
        place: String,
        /// Kind of file.
        found: String,
    },
    /// The file is damaged. It holds nothing that is not in other files.
    #[error("{place}: damaged: {found}; delete it, then `skinrig catalogue rebuild`")]
    Damaged {
        /// The file.
        place: String,
        /// Description of the damage.
        found: String,
    },
    /// Another version of skinrig wrote it.
    #[error("{place}: expected schema {supported}, found {found}; {next}")]
    OtherSchema {
        /// The catalogue.
        place: String,
        /// Its schema version.
        found: i64,
        /// That of this build.
        supported: i64,
        /// What to do.
        next: &'static str,
    },
    /// The address of a server cannot be used.
    #[error("{place}: expected {expected}, found {found}")]
    Address {
        /// The address, without a password.
        place: String,
        /// What is valid.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The file of prototypes is wrong.
    #[error("{}", .0.render(false).trim_end())]
    Prototypes(Diagnostics),
    /// The file is not the JSON of a night.
    #[error("{}: expected the JSON of a finished night, found {found}", path.display())]
    InvalidNight {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// The catalogue has no such nights.
    #[error("{place}: {found}; `skinrig catalogue register --nights FOLDER` registers nights")]
    NoNights {
        /// The catalogue, without a password.
        place: String,
        /// What was expected and found.
        found: NoSuchNights,
    },
    /// A column has a value that skinrig does not write.
    #[error(
        "catalogue: column `{column}`: expected what skinrig writes, found {found}; `skinrig catalogue rebuild` repairs it"
    )]
    InvalidColumn {
        /// The column.
        column: &'static str,
        /// What was found.
        found: String,
    },
    /// A value for a question is missing or invalid.
    #[error("{question}: expected {expected}, found {found}")]
    Parameter {
        /// Name of the question.
        question: &'static str,
        /// What is valid.
        expected: String,
        /// What was found.
        found: String,
    },
}

/// SQLSTATE of a missing right (PostgreSQL manual, appendix A).
const INSUFFICIENT_PRIVILEGE: &str = "42501";

/// What helps after a failed connection.
#[cfg(feature = "postgres")]
fn next_to_connect(error: &sqlx::Error) -> &'static str {
    let code = error.as_database_error().and_then(|e| e.code());
    match (error, code.as_deref()) {
        (sqlx::Error::Tls(_), _) => {
            "an encrypted connection needs `ssl = on` in the server's postgresql.conf and skinrig built with `--features tls`; \
             `sslmode=` in the address says what is demanded"
        }
        // So are broken certificates reported, of either side.
        (sqlx::Error::Io(e), _) if e.kind() == std::io::ErrorKind::InvalidData => {
            "the server's certificate must name the host of the address, and be signed by an authority that this computer knows or \
             that `sslrootcert=FILE` in the address holds"
        }
        (sqlx::Error::Io(e), _) if e.kind() == std::io::ErrorKind::NotFound => {
            "check the paths in the address: `sslrootcert=FILE`, or `host=FOLDER` of the server's socket"
        }
        (sqlx::Error::Io(_), _) => {
            "check host and port of the address, and whether the server runs"
        }
        (_, Some("28000")) => {
            "the server's pg_hba.conf must admit this user from this computer, perhaps only with `sslmode=require` in the address"
        }
        (_, Some("28P01")) => "check user and password",
        (_, Some("3D000")) => "`createdb` of PostgreSQL creates it",
        _ => "check the address",
    }
}

impl CatalogueError {
    /// A failed connection to the server at `place`.
    #[cfg(feature = "postgres")]
    pub(crate) fn connection(place: &str, source: sqlx::Error) -> Self {
        Self::Connection {
            place: place.to_owned(),
            next: next_to_connect(&source),
            source: Box::new(source),
        }
    }

    /// A failed query at `place`.
    pub(crate) fn sql(place: &str, doing: &'static str, source: sqlx::Error) -> Self {
        let place = place.to_owned();
        // Result codes: <https://www.sqlite.org/rescode.html>.
        let code = match &source {
            sqlx::Error::Database(e) => e.code(),
            _ => None,
        };
        if is_of_server(&source) && code.as_deref() == Some(INSUFFICIENT_PRIVILEGE) {
            return Self::Denied {
                place,
                doing,
                found: source.to_string(),
            };
        }
        let code = code.and_then(|c| c.parse::<i32>().ok());
        match code.filter(|_| !is_of_server(&source)).map(|c| c & 0xff) {
            Some(5 | 6) => Self::Busy { place, doing },
            Some(11 | 26) => Self::Damaged {
                place,
                found: source.to_string(),
            },
            _ => Self::Sql {
                place,
                doing,
                source: Box::new(source),
            },
        }
    }
}

/// True for an error of PostgreSQL, whose codes have another meaning.
fn is_of_server(error: &sqlx::Error) -> bool {
    let sqlx::Error::Database(error) = error else {
        return false;
    };
    error
        .try_downcast_ref::<sqlx::sqlite::SqliteError>()
        .is_none()
}
