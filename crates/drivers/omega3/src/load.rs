//! Finds and loads the vendor's library.
#![expect(unsafe_code, reason = "loads a foreign library")]

use std::ffi::{OsString, c_void};
use std::fmt;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;

use skinrig_drd_abi::{Functions, MissingFunctions, SdkVersion, fns};

use crate::library::Library;

/// Environment variable with the path of the library.
pub const LIBRARY_VARIABLE: &str = "SKINRIG_LIBDRD";

/// Environment variables with the root of an unpacked SDK, by precedence.
pub(crate) const SDK_VARIABLES: [&str; 2] = ["FDSDK", "FORCEDIM_SDK"];

/// File names of the library, the one with the interface version first.
const NAMES: &[&str] = if cfg!(target_os = "windows") {
    &["drd64.dll"]
} else if cfg!(target_os = "macos") {
    &["libdrd.dylib"]
} else {
    &["libdrd.so.3", "libdrd.so"]
};

/// A loaded library and its origin.
#[derive(Debug, Clone)]
pub struct LoadedLibrary {
    /// The calls.
    pub library: Library,
    /// Requested path, or name that the system resolved.
    pub requested: PathBuf,
    /// File that was loaded, if the system reports it; otherwise as requested.
    pub path: PathBuf,
    /// Its version.
    pub version: SdkVersion,
    /// Recommendation about that version for the operator.
    pub advice: Option<String>,
}

/// A failed attempt to load a library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attempt {
    /// Path or name.
    pub path: PathBuf,
    /// Error of the loader.
    pub error: String,
}

/// No usable library.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// No candidate could be loaded.
    #[error("expected Force Dimension's libdrd, found none; tried{}; install the SDK, then set the path of libdrd in the rig file or in {LIBRARY_VARIABLE}, or the SDK directory in FDSDK", list(.0))]
    Absent(Vec<Attempt>),
    /// The SDK is too old: its functions have the same names but other arguments.
    #[error("{}: expected SDK {} or newer, found {found}: install a newer SDK ({} or newer is recommended)", path.display(), SdkVersion::OLDEST, SdkVersion::ADVISED)]
    TooOld {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: SdkVersion,
    },
    /// Functions are missing.
    #[error("{}: SDK {found}: {missing}: expected a complete libdrd", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: SdkVersion,
        /// The missing function.
        missing: MissingFunctions,
    },
    /// Another library.
    #[error("{}: expected Force Dimension's libdrd, found a library without dhdGetSDKVersion", path.display())]
    NotLibdrd {
        /// The file.
        path: PathBuf,
    },
}

fn list(attempts: &[Attempt]) -> String {
    attempts
        .iter()
        .map(|a| format!("\n  {}: {}", a.path.display(), a.error))
        .collect()
}

/// Candidate paths in order. An explicit path (`configured`, then `SKINRIG_LIBDRD`) is the only candidate, so that the result does not
/// depend on other installed files. Otherwise: SDK directories from the environment, common directories, and names for the system's
/// own search.
#[must_use]
pub(crate) fn search_paths(
    configured: Option<&Path>,
    variable: impl Fn(&str) -> Option<OsString>,
) -> Vec<PathBuf> {
    let set = |name: &str| variable(name).filter(|value| !value.is_empty());
    if let Some(path) = configured {
        return vec![path.to_owned()];
    }
    if let Some(path) = set(LIBRARY_VARIABLE) {
        return vec![PathBuf::from(path)];
    }
    let mut directories: Vec<PathBuf> = SDK_VARIABLES
        .iter()
        .filter_map(|name| set(name))
        .flat_map(|root| sdk_directories(Path::new(&root)))
        .collect();
    if cfg!(unix) {
        directories.extend(set("HOME").map(|home| Path::new(&home).join(".local/lib")));
        directories.push(PathBuf::from("/usr/local/lib"));
    }
    directories
        .iter()
        .flat_map(|directory| NAMES.iter().map(move |name| directory.join(name)))
        .chain(NAMES.iter().map(PathBuf::from))
        .collect()
}

/// Library directories of an unpacked SDK: `lib/release/<system>-<machine>-<compiler>`.
fn sdk_directories(root: &Path) -> Vec<PathBuf> {
    let machine = match std::env::consts::ARCH {
        "aarch64" if cfg!(target_os = "macos") => "arm64",
        other => other,
    };
    if cfg!(target_os = "windows") {
        return vec![root.join("bin")];
    }
    let system = if cfg!(target_os = "macos") {
        "mac"
    } else {
        "lin"
    };
    ["gcc", "clang"]
        .map(|compiler| root.join(format!("lib/release/{system}-{machine}-{compiler}")))
        .to_vec()
}

/// Loads the first library in `search_paths`. It is never unloaded.
///
/// # Errors
/// [`LoadError`]. A library that exists but cannot be used ends the search, so that no other version is loaded by accident.
pub fn load(configured: Option<&Path>) -> Result<LoadedLibrary, LoadError> {
    load_from(search_paths(configured, |name| std::env::var_os(name)))
}

fn load_from(paths: Vec<PathBuf>) -> Result<LoadedLibrary, LoadError> {
    let mut attempts = Vec::new();
    for path in paths {
        // SAFETY: the operator chose the library; its initialisers are the vendor's.
        match unsafe { libloading::Library::new(&path) } {
            Ok(library) => return check_library(path, library),
            Err(e) => attempts.push(Attempt {
                path,
                error: with_sources(&e),
            }),
        }
    }
    Err(LoadError::Absent(attempts))
}

/// The error with all its sources: only they contain the loader's message.
fn with_sources(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(next) = cause {
        text = format!("{text}: {next}");
        cause = next.source();
    }
    text
}

fn check_library(
    requested: PathBuf,
    library: libloading::Library,
) -> Result<LoadedLibrary, LoadError> {
    let path = loaded_file(&requested);
    // SAFETY: the name has this type in every version of the SDK.
    let version = match unsafe { library.get::<fns::dhdGetSDKVersion>("dhdGetSDKVersion") } {
        // SAFETY: found in a loaded library under its own name.
        Ok(ask) => unsafe { SdkVersion::query(*ask) },
        Err(_) => return Err(LoadError::NotLibdrd { path }),
    };
    // Its code may have started threads by now: never unload it.
    let library: &'static libloading::Library = Box::leak(Box::new(library));
    if version < SdkVersion::OLDEST {
        return Err(LoadError::TooOld {
            path,
            found: version,
        });
    }
    let look_up = |name: &'static std::ffi::CStr| {
        // SAFETY: only the address is taken.
        unsafe { library.get::<*mut c_void>(name) }
            .ok()
            .and_then(|symbol| NonNull::new(*symbol))
    };
    // SAFETY: the library is an SDK new enough, its functions are found by their names, and it is never unloaded.
    let functions = unsafe { Functions::resolve(look_up) };
    let functions = functions.map_err(|missing| LoadError::Incomplete {
        path: path.clone(),
        found: version,
        missing,
    })?;
    let advice = (version < SdkVersion::ADVISED).then(|| {
        format!(
            "SDK {version} works, but {} or newer reports failures in more detail",
            SdkVersion::ADVISED
        )
    });
    Ok(LoadedLibrary {
        library: Library::new(functions, version),
        requested,
        path,
        version,
        advice,
    })
}

/// Resolves a name that the system looked up to a file, where possible (Linux: /proc/self/maps).
fn loaded_file(requested: &Path) -> PathBuf {
    let by_name = requested.components().count() == 1;
    let maps = by_name
        .then(|| std::fs::read_to_string("/proc/self/maps").ok())
        .flatten();
    let found = maps.as_deref().and_then(|maps| {
        maps.lines()
            .filter_map(|line| line.find('/').map(|at| Path::new(&line[at..])))
            .find(|file| {
                let name = file.file_name().map(|n| n.to_string_lossy().into_owned());
                name.is_some_and(|n| n.starts_with(&*requested.to_string_lossy()))
            })
            .map(Path::to_owned)
    });
    found.unwrap_or_else(|| requested.to_owned())
}

impl fmt::Display for LoadedLibrary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SDK {} ({})", self.version, self.path.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment<'a>(
        pairs: &'a [(&'a str, &'a str)],
    ) -> impl Fn(&str) -> Option<OsString> + use<'a> {
        |name| {
            let found = pairs.iter().find(|(n, _)| *n == name);
            found.map(|(_, value)| OsString::from(value))
        }
    }

    #[test]
    fn an_explicit_path_is_the_only_candidate() {
        let all = [(LIBRARY_VARIABLE, "/v/libdrd.so"), ("FDSDK", "/sdk")];
        let named = search_paths(Some(Path::new("/c/libdrd.so")), environment(&all));
        assert_eq!(named, [PathBuf::from("/c/libdrd.so")]);
        let named = search_paths(None, environment(&all));
        assert_eq!(named, [PathBuf::from("/v/libdrd.so")]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn otherwise_the_sdk_then_common_directories_then_names() {
        let found = search_paths(
            None,
            environment(&[("FORCEDIM_SDK", "/sdk"), ("HOME", "/h")]),
        );
        let machine = std::env::consts::ARCH;
        let first = format!("/sdk/lib/release/lin-{machine}-gcc/libdrd.so.3");
        assert_eq!(found[0], PathBuf::from(first));
        assert!(found.contains(&PathBuf::from("/h/.local/lib/libdrd.so.3")));
        let [.., a, b] = found.as_slice() else {
            panic!("{found:?}")
        };
        assert_eq!((a, b), (&"libdrd.so.3".into(), &"libdrd.so".into()));
    }

    #[test]
    fn a_failure_lists_every_candidate_with_the_loaders_message() {
        let directory = tempfile::tempdir().unwrap();
        let torn = directory.path().join("libdrd.so");
        std::fs::write(&torn, b"not a library").unwrap();
        let absent = directory.path().join("absent.so");
        let error = load_from(vec![torn.clone(), absent.clone()]).unwrap_err();
        let text = error.to_string();
        for part in [
            torn.to_str().unwrap(),
            absent.to_str().unwrap(),
            LIBRARY_VARIABLE,
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        let LoadError::Absent(attempts) = error else {
            panic!("{text}")
        };
        let cause = attempts[1].error.strip_prefix("dlopen failed: ");
        assert!(
            cfg!(not(unix)) || cause.is_some_and(|c| !c.is_empty()),
            "{text}"
        );
    }
}
