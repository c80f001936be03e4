//! Version and build of skinrig, as stored in sessions, nights and reports, and shown by `skinrig --version`.

/// Version, commit and, if the sources were changed since, a digest of the changes: `0.1.0 (commit 0123abcd)`.
pub(crate) const VERSION: &str =
    concat!(env!("CARGO_PKG_VERSION"), " (", env!("SKINRIG_BUILD"), ")");

/// The same with the program's name.
pub(crate) const SOFTWARE: &str = concat!(
    "skinrig ",
    env!("CARGO_PKG_VERSION"),
    " (",
    env!("SKINRIG_BUILD"),
    ")"
);
