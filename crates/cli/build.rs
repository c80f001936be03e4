//! Says what a build was made from, as `SKINRIG_BUILD`: the commit, and a digest of the sources where they differ from it.

use std::path::{Path, PathBuf};
use std::process::Command;

use sha2::{Digest, Sha256};

/// What makes the program, seen from the root of the workspace.
const SOURCES: [&str; 5] = ["crates", "hil", "migrations", "Cargo.toml", "Cargo.lock"];
/// Hexadecimal digits of a digest that are shown.
const DIGITS: usize = 8;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for source in SOURCES {
        println!("cargo:rerun-if-changed={}", root.join(source).display());
    }
    let build = commit(&root).unwrap_or_else(|| "commit unknown".to_owned());
    println!("cargo:rustc-env=SKINRIG_BUILD={build}");
}

/// `commit 0123abcd`, or `commit 0123abcd, changed: 89ef4567`; `None` when the sources are not from a repository of their own.
fn commit(root: &Path) -> Option<String> {
    let top = PathBuf::from(line(git(root, &["rev-parse", "--show-toplevel"])?)?);
    if top.canonicalize().ok()? != root.canonicalize().ok()? {
        return None;
    }
    // Written with every commit, checkout and rebase.
    let log = line(git(root, &["rev-parse", "--git-path", "logs/HEAD"])?)?;
    println!("cargo:rerun-if-changed={}", root.join(log).display());
    let head = line(git(root, &["rev-parse", "--short=8", "HEAD"])?)?;
    let mut changes = git(
        root,
        &[&["diff", "--binary", "HEAD", "--"], &SOURCES[..]].concat(),
    )?;
    let unknown = [
        &["ls-files", "--others", "--exclude-standard", "--"],
        &SOURCES[..],
    ]
    .concat();
    for name in String::from_utf8(git(root, &unknown)?).ok()?.lines() {
        changes.extend_from_slice(name.as_bytes());
        changes.extend(std::fs::read(root.join(name)).unwrap_or_default());
    }
    if changes.is_empty() {
        return Some(format!("commit {head}"));
    }
    let digest: String = Sha256::digest(&changes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Some(format!("commit {head}, changed: {}", &digest[..DIGITS]))
}

fn line(output: Vec<u8>) -> Option<String> {
    Some(String::from_utf8(output).ok()?.trim_end().to_owned())
}

/// What git prints; `None` without git, or when it fails.
fn git(root: &Path, words: &[&str]) -> Option<Vec<u8>> {
    let output = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(words)
        .output()
        .ok()?;
    output.status.success().then_some(output.stdout)
}
