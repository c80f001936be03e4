//! Loads the library like a driver, with calls that every test makes.

use std::ffi::c_void;
use std::path::Path;
use std::ptr::NonNull;
use std::time::Duration;

use drd::{ArmConfig, EmulatedArm};
use skinrig_drd_abi::{DeviceId, Functions, StatusVector};

/// Time limit of waits, longer than anything takes on a busy computer.
pub const WITHIN: Duration = Duration::from_secs(30);

/// The functions of the library at `path`, loaded for the rest of the process.
pub fn load(path: &Path) -> Functions {
    // SAFETY: the stand-in runs no code of its own when it is loaded, unless told to be a firmware.
    let library = Box::leak(Box::new(unsafe { libloading::Library::new(path) }.unwrap()));
    // SAFETY: the stand-in's exports have the table's signatures, and it is never unloaded.
    unsafe {
        Functions::resolve(|name| {
            let symbol = library.get::<*mut c_void>(name.to_bytes_with_nul()).ok()?;
            NonNull::new(*symbol)
        })
    }
    .unwrap()
}

/// Opens and starts with a slow motion of 50 mm/s.
pub fn start(sdk: &Functions) {
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.drdOpenID)(0), 0);
        assert_eq!((sdk.drdStart)(ID), 0);
        assert_eq!((sdk.drdSetPosMoveParam)(0.5, 0.05, 10.0, ID), 0);
        assert_eq!((sdk.drdSetPosTrackParam)(0.5, 0.05, 10.0, ID), 0);
        assert_eq!((sdk.drdEnableFilter)(true, ID), 0);
    }
}

/// An arm and a library that drives it.
pub struct Bench {
    pub arm: EmulatedArm,
    pub sdk: Functions,
}

impl Bench {
    pub fn new(config: &ArmConfig) -> Self {
        let arm = EmulatedArm::spawn(config).unwrap();
        let sdk = load(&arm.library());
        Self { arm, sdk }
    }

    /// Open and started, with slow motion.
    pub fn started(config: &ArmConfig) -> Self {
        let bench = Self::new(config);
        start(&bench.sdk);
        bench
    }

    pub fn position(&self) -> (i32, [f64; 3]) {
        let [mut x, mut y, mut z] = [0.0; 3];
        // SAFETY: a function of the table; the places live through the call.
        let rc = unsafe { (self.sdk.dhdGetPosition)(&raw mut x, &raw mut y, &raw mut z, ID) };
        (rc, [x, y, z])
    }

    pub fn force(&self) -> [f64; 3] {
        let [mut x, mut y, mut z] = [0.0; 3];
        // SAFETY: a function of the table; the places live through the call.
        let rc = unsafe { (self.sdk.dhdGetForce)(&raw mut x, &raw mut y, &raw mut z, ID) };
        assert_eq!(rc, 0);
        [x, y, z]
    }

    pub fn status(&self) -> StatusVector {
        let mut status = StatusVector::new();
        // SAFETY: a function of the table; the vector takes every version's words.
        let rc = unsafe { (self.sdk.dhdGetStatus)(status.as_mut_ptr(), ID) };
        assert_eq!(rc, 0);
        status
    }

    pub fn move_to(&self, [x, y, z]: [f64; 3]) -> i32 {
        // SAFETY: a function of the table.
        unsafe { (self.sdk.drdMoveToPos)(x, y, z, false, ID) }
    }

    pub fn last_error(&self) -> i32 {
        // SAFETY: a function of the table.
        unsafe { (self.sdk.dhdErrorGetLast)() }
    }
}

/// The default device.
pub const ID: DeviceId = -1;
