//! Owns bundles: one folder with a session and everything made from it, which can be verified after a move.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use skinrig_recorder::Problem;

use crate::error::ExportError;

/// Manifest of a bundle, which lists the other files.
pub const MANIFEST: &str = "manifest.json";
/// Added to the name of [`MANIFEST`] or of a crate's description, for its signature.
pub const SIGNATURE_ENDING: &str = ".sig";
/// Value of the manifest's `format` field.
const FORMAT: &str = "skinrig-bundle";
/// Version of the manifest's layout.
const VERSION: u32 = 1;
/// Maximum size of a manifest, bytes.
const MAX_MANIFEST_BYTES: u64 = 1 << 20;

#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    format: String,
    format_version: u32,
    session_id: String,
    prototype: String,
    software: String,
    session: String,
    files: Vec<Entry>,
}

/// A file with its size and hash.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) bytes: u64,
    pub(crate) sha256: String,
}

/// Content of a bundle, and its problems.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BundleReport {
    /// ID of the session.
    pub session_id: String,
    /// File name of the session in the folder.
    pub session: String,
    /// Number of listed files.
    pub files: usize,
    /// Their names.
    pub names: Vec<String>,
    /// Files that differ from the manifest, are missing, or are not listed.
    pub problems: Vec<Problem>,
    /// Number of problems of the session beyond those in `problems`.
    pub more_problems: u64,
}

/// Writes the manifest with the hashes of all files of `folder`, as the last step: a folder without it is not a bundle.
/// `software` is the program that wrote the files.
///
/// # Errors
/// When a file cannot be read, or the manifest cannot be written.
pub fn seal_bundle(
    folder: &Path,
    session_id: &str,
    prototype: &str,
    software: &str,
    session: &str,
    names: &[String],
) -> Result<(), ExportError> {
    let entries = names.iter().map(|name| entry(folder, name));
    let manifest = Manifest {
        format: FORMAT.into(),
        format_version: VERSION,
        session_id: session_id.into(),
        prototype: prototype.into(),
        software: software.into(),
        session: session.into(),
        files: entries.collect::<Result<_, _>>()?,
    };
    let path = folder.join(MANIFEST);
    write_document(&path, &manifest)
}

/// Writes a JSON document; the file is there whole, and on the disk, or not at all.
pub(crate) fn write_document(path: &Path, document: &impl Serialize) -> Result<(), ExportError> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    let text = serde_json::to_string_pretty(document).map_err(ExportError::file(path))?;
    let _ = std::fs::remove_file(&partial);
    File::create_new(&partial)
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.sync_all()
        })
        .and_then(|()| std::fs::rename(&partial, path))
        .map_err(ExportError::file(path))
}

/// Entry of a file in its present state.
pub(crate) fn entry(folder: &Path, name: &str) -> Result<Entry, ExportError> {
    let path = folder.join(name);
    let io_error = ExportError::file(&path);
    let mut file = File::open(&path).map_err(&io_error)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 20];
    let mut bytes = 0;
    loop {
        let read = file.read(&mut buffer).map_err(&io_error)?;
        if read == 0 {
            break;
        }
        bytes += read as u64;
        hasher.update(&buffer[..read]);
    }
    let digest = hasher.finalize();
    Ok(Entry {
        name: name.into(),
        bytes,
        sha256: digest.iter().map(|b| format!("{b:02x}")).collect(),
    })
}

/// Compares every file of the bundle in `folder` with its manifest. The session counts as an ordinary file here;
/// `skinrig_recorder::verify` checks its content.
///
/// # Errors
/// [`ExportError::NotABundle`] for a folder without a manifest of this version; [`ExportError::File`] when it cannot be read.
pub fn verify_bundle(folder: &Path) -> Result<BundleReport, ExportError> {
    let path = folder.join(MANIFEST);
    let not = |found: String| ExportError::NotABundle {
        path: path.clone(),
        found,
    };
    let is_plain = |name: &str| {
        folder
            .join(name)
            .symlink_metadata()
            .is_ok_and(|m| m.is_file())
    };
    if !is_plain(MANIFEST) {
        return Err(not("no such file".into()));
    }
    let mut text = String::new();
    let file = File::open(&path).map_err(ExportError::file(&path))?;
    file.take(MAX_MANIFEST_BYTES)
        .read_to_string(&mut text)
        .map_err(ExportError::file(&path))?;
    let manifest: Manifest = serde_json::from_str(&text).map_err(|e| not(e.to_string()))?;
    if (manifest.format.as_str(), manifest.format_version) != (FORMAT, VERSION) {
        let found = format!("{} of version {}", manifest.format, manifest.format_version);
        return Err(not(found));
    }
    // A name from an untrusted manifest may lead anywhere.
    let leads_out = |name: &str| {
        let mut parts = Path::new(name).components();
        let first = parts.next();
        !matches!(first, Some(std::path::Component::Normal(_))) || parts.next().is_some()
    };
    if let Some(out) = manifest.files.iter().find(|f| leads_out(&f.name)) {
        return Err(not(format!("a file outside the folder: {:?}", out.name)));
    }
    let listed: BTreeSet<&str> = manifest.files.iter().map(|f| f.name.as_str()).collect();
    if !listed.contains(manifest.session.as_str()) {
        return Err(not("no session among its files".into()));
    }
    let mut problems = Vec::new();
    for listed in &manifest.files {
        let name = &listed.name;
        if !is_plain(name) {
            problems.push(Problem::new(name, "a file", "none"));
            continue;
        }
        let found = entry(folder, name)?;
        if found.bytes != listed.bytes {
            problems.push(Problem::new(
                name,
                format_args!("{} bytes", listed.bytes),
                found.bytes,
            ));
        } else if found.sha256 != listed.sha256 {
            problems.push(Problem::new(
                name,
                format_args!("SHA-256 {}", listed.sha256),
                found.sha256,
            ));
        }
    }
    for other in std::fs::read_dir(folder).map_err(ExportError::file(folder))? {
        let name = other.map_err(ExportError::file(folder))?.file_name();
        let name = name.to_string_lossy();
        let is_signature = name.strip_suffix(SIGNATURE_ENDING) == Some(MANIFEST);
        if name != MANIFEST && !is_signature && !listed.contains(&*name) {
            problems.push(Problem::new(
                name,
                "only files listed in the manifest",
                "another file",
            ));
        }
    }
    problems.sort_by(|a, b| a.place.cmp(&b.place));
    Ok(BundleReport {
        session_id: manifest.session_id,
        session: manifest.session,
        files: manifest.files.len(),
        names: manifest.files.into_iter().map(|f| f.name).collect(),
        problems,
        more_problems: 0,
    })
}
