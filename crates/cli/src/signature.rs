//! Signatures of bundles and crates: the file that lists all hashes is signed and verified by `ssh-keygen -Y`.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde::Serialize;
use skinrig_export::SIGNATURE_ENDING;

use crate::exit::Failure;
use crate::paths::file_name;

/// The program; part of OpenSSH.
const PROGRAM: &str = "ssh-keygen";
/// Namespace of the signatures: one made for another purpose does not count.
const NAMESPACE: &str = "skinrig";
/// Largest signature, bytes.
const MAX_BYTES: u64 = 64 << 10;

/// A bundle or crate could not be signed, or its signature does not count.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SignatureError {
    /// The program is missing.
    #[error(
        "signature: expected the program `{PROGRAM}`, found none\n  next: install OpenSSH's client (Debian: `apt install openssh-client`)"
    )]
    NoProgram,
    /// The program cannot be run, or a file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The program or file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The key does not sign.
    #[error(
        "--sign {}: expected a private key of `{PROGRAM}`, found: {says}\n  next: name one, for example ~/.ssh/id_ed25519",
        key.display()
    )]
    Key {
        /// The key.
        key: PathBuf,
        /// What the program says.
        says: String,
    },
    /// A signature is required, and there is none.
    #[error("{}: expected a signature, found none\n  next: ask the sender for a signed copy", path.display())]
    Missing {
        /// Where it would be.
        path: PathBuf,
    },
    /// The signature does not belong to the content.
    #[error(
        "{}: expected a signature of {signed}, found another: {says}\n  next: do not use these files; ask the sender for another copy",
        path.display()
    )]
    Invalid {
        /// The signature.
        path: PathBuf,
        /// Name of the signed file.
        signed: String,
        /// What the program says.
        says: String,
    },
    /// The key is not among the signers.
    #[error(
        "{}: expected a signature of a person in {}, found: {says}\n  next: if you know that the key is the sender's, add a line \
         `NAME KEY` with their public key there",
        path.display(),
        signers.display()
    )]
    Unknown {
        /// The signature.
        path: PathBuf,
        /// The file of signers.
        signers: PathBuf,
        /// What the program says.
        says: String,
    },
}

impl SignatureError {
    /// True for a signature that does not count; false if that could not be found out.
    pub(crate) const fn is_verdict(&self) -> bool {
        matches!(
            self,
            Self::Missing { .. } | Self::Invalid { .. } | Self::Unknown { .. }
        )
    }
}

impl From<SignatureError> for Failure {
    fn from(error: SignatureError) -> Self {
        match &error {
            SignatureError::NoProgram => Self::internal(error),
            SignatureError::Io { .. } | SignatureError::Key { .. } => Self::input(error),
            SignatureError::Missing { .. }
            | SignatureError::Invalid { .. }
            | SignatureError::Unknown { .. } => Self::limit(error),
        }
    }
}

/// A signature that belongs to the content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Signature {
    /// The person in the file of signers; `None` if the key was not compared.
    pub signer: Option<String>,
    /// Kind and fingerprint of the key, as the program says them.
    pub says: String,
}

impl std::fmt::Display for Signature {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.signer {
            Some(signer) => write!(f, "signed by {signer}: {}", self.says),
            None => write!(
                f,
                "signed with a key that was not checked: {}; --signers FILE checks it",
                self.says
            ),
        }
    }
}

/// Signs `file`; returns the path of the signature, beside it. Replaces an older one.
///
/// # Errors
/// [`SignatureError`] without the program, or if the key does not sign.
pub(crate) fn sign(key: &Path, file: &Path) -> Result<PathBuf, SignatureError> {
    let path = beside(file);
    // The program would ask before it replaces a file.
    match std::fs::remove_file(&path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            return Err(SignatureError::Io { path, source });
        }
        _ => {}
    }
    let mut command = Command::new(PROGRAM);
    command
        .args(["-Y", "sign", "-n", NAMESPACE, "-f"])
        .arg(key)
        .arg("--")
        .arg(file);
    let output = run(command.stdin(Stdio::null()))?;
    if output.status.success() && path.is_file() {
        return Ok(path);
    }
    Err(SignatureError::Key {
        key: key.to_owned(),
        says: said(&output),
    })
}

/// Checks the signature beside `file`; `None` if there is none and none is required. `signers` is a file of allowed signers.
///
/// # Errors
/// [`SignatureError`] for a signature that does not count, or that is missing although `signers` is given.
pub(crate) fn verify(
    file: &Path,
    signers: Option<&Path>,
) -> Result<Option<Signature>, SignatureError> {
    let path = beside(file);
    let is_there = path.symlink_metadata();
    if is_there.is_err() && signers.is_none() {
        return Ok(None);
    }
    if !is_there.is_ok_and(|m| m.is_file() && m.len() <= MAX_BYTES) {
        return Err(SignatureError::Missing { path });
    }
    let check = |command: &mut Command| {
        let content = File::open(file).map_err(|source| SignatureError::Io {
            path: file.to_owned(),
            source,
        })?;
        run(command
            .arg("-n")
            .arg(NAMESPACE)
            .arg("-s")
            .arg(&path)
            .stdin(content))
    };
    let any = check(Command::new(PROGRAM).args(["-Y", "check-novalidate"]))?;
    if !any.status.success() {
        return Err(SignatureError::Invalid {
            path,
            signed: file_name(file),
            says: said(&any),
        });
    }
    let says = said(&any);
    let Some(signers) = signers else {
        return Ok(Some(Signature { signer: None, says }));
    };
    readable(signers)?;
    let mut find = Command::new(PROGRAM);
    find.args(["-Y", "find-principals", "-s"])
        .arg(&path)
        .arg("-f")
        .arg(signers);
    let found = run(find.stdin(Stdio::null()))?;
    let names = String::from_utf8_lossy(&found.stdout).into_owned();
    for name in names.lines().filter(|_| found.status.success()) {
        let verified = check(
            Command::new(PROGRAM)
                .args(["-Y", "verify", "-I", name, "-f"])
                .arg(signers),
        )?;
        if verified.status.success() {
            return Ok(Some(Signature {
                signer: Some(name.to_owned()),
                says,
            }));
        }
    }
    Err(SignatureError::Unknown {
        path,
        signers: signers.to_owned(),
        says,
    })
}

/// The signature's path: that of the file and an ending.
fn beside(file: &Path) -> PathBuf {
    let mut path = file.as_os_str().to_owned();
    path.push(SIGNATURE_ENDING);
    path.into()
}

fn readable(path: &Path) -> Result<(), SignatureError> {
    let read = File::open(path).and_then(|mut file| file.read(&mut [0]));
    read.map(drop).map_err(|source| SignatureError::Io {
        path: path.to_owned(),
        source,
    })
}

fn run(command: &mut Command) -> Result<Output, SignatureError> {
    command.output().map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => SignatureError::NoProgram,
        _ => SignatureError::Io {
            path: PROGRAM.into(),
            source,
        },
    })
}

/// What the program says, in one line.
fn said(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|l| !l.is_empty())
        .collect();
    lines
        .join("; ")
        .chars()
        .filter(|c| !c.is_control())
        .take(300)
        .collect()
}
