//! Builds firmware and board program, once per version of their sources.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs, io};

/// Why this computer cannot emulate the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unavailable(pub String);

impl std::fmt::Display for Unavailable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} (Debian: apt-get install gcc-avr avr-libc simavr libsimavr-dev libelf-dev make)",
            self.0
        )
    }
}

impl std::error::Error for Unavailable {}

/// Build results.
#[derive(Debug, Clone)]
pub struct BuildOutput {
    /// The firmware image.
    pub firmware: PathBuf,
    /// The board program.
    pub board: PathBuf,
}

/// Builds both next to the running program, unless they exist.
///
/// # Errors
/// [`Unavailable`] if a tool is missing.
///
/// # Panics
/// When the tools exist but the sources do not compile.
pub fn build() -> Result<BuildOutput, Unavailable> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let firmware_dir = folder.join("../../trigger_box");
    check_tools()?;
    let (cache, scratch) = places(&sources(folder, &firmware_dir)).unwrap_or_else(|e| {
        panic!("the emulated trigger box needs a place to build in: {e}");
    });
    let built = BuildOutput {
        firmware: cache.join("trigger_box.elf"),
        board: cache.join("board"),
    };
    if cache.exists() {
        return Ok(built);
    }
    run_make(&firmware_dir, scratch.path(), "trigger_box.elf");
    run_make(folder, scratch.path(), "board");
    // Of concurrent builds the first one wins; the results are equal.
    let created = scratch.keep();
    if fs::rename(&created, &cache).is_err() {
        assert!(
            cache.exists(),
            "cannot keep the build in {}",
            cache.display()
        );
        // Failure only costs disk space.
        let _ = fs::remove_dir_all(created);
    }
    Ok(built)
}

fn run_make(sources: &Path, into: &Path, what: &str) {
    let target = into.join(what);
    let output = Command::new("make")
        .arg("-C")
        .arg(sources)
        .arg(format!("BUILD={}", into.display()))
        .arg(&target)
        .output();
    let output = output.unwrap_or_else(|e| panic!("make does not start: {e}"));
    assert!(
        output.status.success(),
        "{what} does not build:\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

fn check_tools() -> Result<(), Unavailable> {
    for tool in ["avr-gcc", "make", "cc"] {
        let found = Command::new(tool)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if !found.is_ok_and(|s| s.success()) {
            return Err(Unavailable(format!("{tool} is not installed")));
        }
    }
    for (compiler, headers) in [
        ("avr-gcc -mmcu=atmega328p", "avr/io.h"),
        ("cc", "simavr/sim_avr.h"),
        ("cc", "libelf.h"),
    ] {
        if !has_header(compiler, headers).unwrap_or(false) {
            return Err(Unavailable(format!("{headers} is not installed")));
        }
    }
    Ok(())
}

fn has_header(compiler: &str, header: &str) -> io::Result<bool> {
    let mut words = compiler.split(' ');
    let mut child = Command::new(words.next().unwrap_or_default())
        .args(words)
        .args(["-E", "-x", "c", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    if let Some(mut stdin) = child.stdin.take() {
        writeln!(stdin, "#include <{header}>")?;
    }
    Ok(child.wait()?.success())
}

/// All sources, in a fixed order.
fn sources(folder: &Path, firmware: &Path) -> Vec<PathBuf> {
    let mut files = vec![folder.join("board.c"), folder.join("Makefile")];
    let mut of_firmware: Vec<PathBuf> = fs::read_dir(firmware)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "c" || e == "h") || p.ends_with("Makefile"))
        .collect();
    of_firmware.sort();
    files.append(&mut of_firmware);
    files
}

/// Folder of the build of these sources, and a temporary folder next to it.
fn places(sources: &[PathBuf]) -> io::Result<(PathBuf, tempfile::TempDir)> {
    let mut hash = DefaultHasher::new();
    for source in sources {
        fs::read(source)?.hash(&mut hash);
    }
    let program = env::current_exe()?;
    let parent = program.parent().unwrap_or(Path::new("."));
    let root = if parent.ends_with("deps") {
        parent.parent().unwrap_or(parent)
    } else {
        parent
    };
    let root = root.join("emulated-trigger-box");
    fs::create_dir_all(&root)?;
    let scratch = tempfile::tempdir_in(&root)?;
    Ok((root.join(format!("{:016x}", hash.finish())), scratch))
}
