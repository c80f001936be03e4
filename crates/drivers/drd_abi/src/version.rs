//! Versions of the SDK.

use std::fmt;

/// Version of the SDK: major, minor, release, revision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SdkVersion {
    /// First number.
    pub major: i32,
    /// Second number.
    pub minor: i32,
    /// Third number.
    pub release: i32,
    /// Fourth number.
    pub revision: i32,
}

impl SdkVersion {
    /// Oldest accepted version: earlier ones have functions with other arguments under the same names.
    pub const OLDEST: Self = Self::new(3, 7, 1);
    /// Oldest recommended version: it distinguishes why a move was rejected
    /// ([`ErrorCode::NO_REGULATION`](crate::ErrorCode::NO_REGULATION)).
    pub const ADVISED: Self = Self::new(3, 10, 0);

    /// The version `major.minor.release`, revision 0.
    #[must_use]
    pub const fn new(major: i32, minor: i32, release: i32) -> Self {
        Self {
            major,
            minor,
            release,
            revision: 0,
        }
    }

    /// Reads the version of a library.
    ///
    /// # Safety
    /// `get` must be the `dhdGetSDKVersion` of a loaded library.
    #[must_use]
    pub unsafe fn query(get: crate::fns::dhdGetSDKVersion) -> Self {
        let mut version = Self::new(0, 0, 0);
        let Self {
            major,
            minor,
            release,
            revision,
        } = &mut version;
        // SAFETY: the function has this signature in every SDK; the four places outlive the call.
        unsafe { get(major, minor, release, revision) };
        version
    }
}

impl fmt::Display for SdkVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.release)?;
        if self.revision == 0 {
            Ok(())
        } else {
            write!(f, ".{}", self.revision)
        }
    }
}
