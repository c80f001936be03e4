//! Files and programs that a rig file names: bias files and lamp programs. Checked before anything is opened or moved.

use std::io;
use std::path::{Path, PathBuf};

use skinrig_protocol::CameraRequest;
use skinrig_protocol::rig::RigFile;

use super::bench;
use crate::exit::Failure;

/// A file or program that a rig file names, and whether it is usable.
#[derive(Debug)]
pub struct Input {
    /// The key that names it.
    pub key: String,
    /// What is expected there.
    pub expected: String,
    /// The usable path, or why it is unusable.
    pub found: Result<PathBuf, UnusableInput>,
    /// Next step if it is unusable.
    pub next: String,
}

/// A file or program that a rig file names is unusable.
#[derive(Debug, thiserror::Error)]
pub enum UnusableInput {
    /// The bias file cannot be read.
    #[error("{}", .0.message)]
    BiasFile(Failure),
    /// The rig file names no program.
    #[error("no program")]
    NoProgram,
    /// No folder of `PATH` has the program.
    #[error("`{name}`, which is not in PATH")]
    NotInPath {
        /// Name of the program.
        name: String,
    },
    /// The program is a folder, or something else.
    #[error("`{}`, which is not a file", file.display())]
    NotAFile {
        /// Its path.
        file: PathBuf,
    },
    /// This user may not run the program.
    #[error("`{}`: {source}", file.display())]
    NotRunnable {
        /// Its path.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// Every bias file and every lamp program of `rig`.
#[must_use]
pub fn all(rig: &RigFile) -> Vec<Input> {
    let mut inputs = Vec::new();
    for (setup, name) in rig.cameras.iter().zip(["camera1", "camera2"]) {
        if let Some(file) = &setup.bias_file {
            let read = bench::camera_settings(setup, &CameraRequest::default());
            inputs.push(Input {
                key: format!("cameras.{name}.bias_file"),
                expected: "a readable bias file".to_owned(),
                found: read.map(|_| file.clone()).map_err(UnusableInput::BiasFile),
                next: "correct the path, which is relative to the rig file, or remove the key"
                    .to_owned(),
            });
        }
    }
    if let Some(lamps) = &rig.hil.lamps {
        for (words, key) in [(&lamps.dark, "dark"), (&lamps.lit, "lit")] {
            inputs.push(Input {
                key: format!("hil.light.{key}"),
                expected: "a program that this user may run".to_owned(),
                found: program(words, std::env::var_os("PATH").as_deref()),
                next: "give an existing program, by its path or by a name in PATH, or remove `hil.light`"
                    .to_owned(),
            });
        }
    }
    inputs
}

/// Rejects a rig file that names unusable files or programs.
///
/// # Errors
/// [`Failure::input`] with all of them.
pub fn check(rig: &RigFile) -> Result<(), Failure> {
    let wrong: Vec<String> = all(rig)
        .into_iter()
        .filter_map(|input| {
            let found = input.found.err()?;
            Some(format!(
                "{}: {}: expected {}, found {found}\n  next: {}",
                rig.file_name, input.key, input.expected, input.next
            ))
        })
        .collect();
    if wrong.is_empty() {
        return Ok(());
    }
    Err(Failure::input(wrong.join("\n")))
}

/// The file that running `words` would start, found as the system does: a name with a slash is a path, any other name is
/// searched in the folders of `path`.
pub(crate) fn program(
    words: &[String],
    path: Option<&std::ffi::OsStr>,
) -> Result<PathBuf, UnusableInput> {
    let Some(name) = words.first().filter(|name| !name.is_empty()) else {
        return Err(UnusableInput::NoProgram);
    };
    if name.contains('/') {
        let file = PathBuf::from(name);
        return runnable(&file).map(|()| file);
    }
    let folders = path.map(std::env::split_paths).into_iter().flatten();
    let mut why = UnusableInput::NotInPath { name: name.clone() };
    for folder in folders {
        let file = folder.join(name);
        match runnable(&file) {
            Ok(()) => return Ok(file),
            Err(e) if file.is_file() => why = e,
            Err(_) => {}
        }
    }
    Err(why)
}

#[cfg(unix)]
fn runnable(file: &Path) -> Result<(), UnusableInput> {
    use rustix::fs::{Access, access};

    let unusable = |source| UnusableInput::NotRunnable {
        file: file.to_owned(),
        source,
    };
    match std::fs::metadata(file) {
        Err(e) => Err(unusable(e)),
        Ok(metadata) if !metadata.is_file() => Err(UnusableInput::NotAFile {
            file: file.to_owned(),
        }),
        Ok(_) => access(file, Access::EXEC_OK).map_err(|e| unusable(e.into())),
    }
}

#[cfg(not(unix))]
fn runnable(file: &Path) -> Result<(), UnusableInput> {
    match file.is_file() {
        true => Ok(()),
        false => Err(UnusableInput::NotAFile {
            file: file.to_owned(),
        }),
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    const EXAMPLE: &str = include_str!("../../../../hil/rigs/bench.example.yaml");

    fn words(program: &str) -> Vec<String> {
        vec![program.to_owned(), "off".to_owned()]
    }

    #[test]
    fn a_program_is_found_as_the_system_finds_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lamp");
        let path = Some(folder.path().as_os_str());
        let error = |words: &[String]| program(words, path).unwrap_err().to_string();
        assert!(error(&words("lamp")).contains("PATH"));
        std::fs::write(&file, "#!/bin/sh\n").unwrap();
        set_mode(&file, 0o755);
        assert_eq!(program(&words("lamp"), path).unwrap(), file);
        let full = words(&file.display().to_string());
        assert_eq!(program(&full, None).unwrap(), file);
        set_mode(&file, 0o644);
        assert!(error(&words("lamp")).contains("denied"));
        let folder_path = folder.path().display().to_string();
        assert!(error(&words(&folder_path)).contains("not a file"));
        assert!(program(&[], path).is_err());
    }

    fn set_mode(file: &Path, mode: u32) {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(file, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn every_missing_input_is_named_with_its_key() {
        let text = EXAMPLE.replace("/usr/local/bin/lamp", "/nowhere/lamp");
        let rig = RigFile::parse("rigs/rig.yaml", text.as_bytes(), &|_| None).unwrap();
        let message = check(&rig).unwrap_err().message;
        for word in [
            "rigs/rig.yaml: cameras.camera1.bias_file",
            "camera1.bias",
            "hil.light.dark",
            "hil.light.lit",
            "/nowhere/lamp",
        ] {
            assert!(message.contains(word), "{word} is not in {message}");
        }
    }
}
