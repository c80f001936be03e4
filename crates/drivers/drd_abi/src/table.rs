//! The table of libdrd functions in use, and of those never used.

/// Passes the table of functions to the macro `$callback`, after the tokens in `[...]`.
///
/// The table is a sequence of blocks `Group required|optional { /** doc */ name(arg: Type, ...) -> Type; ... }`.
/// *Required*: exists in every SDK since 3.7.1 and is needed to control the arm safely. *Optional*: newer than 3.7.1, or needed only by
/// some rigs.
///
/// Units are metres, newtons, kilograms and seconds unless stated otherwise; angles as in the name. `id` is the device's
/// [`DeviceId`](crate::DeviceId). "0/-1" means success or failure.
#[macro_export]
macro_rules! drd_symbols {
    ($callback:ident [$($prefix:tt)*]) => { $callback! { $($prefix)*

Library required {
    /// The code of the calling thread's last failure, see [`ErrorCode`](crate::ErrorCode).
    dhdErrorGetLast() -> i32;
    /// The library's text for an error code.
    dhdErrorGetStr(code: i32) -> *const ::core::ffi::c_char;
    /// Version of the SDK. Has the same signature in every version: call it first.
    dhdGetSDKVersion(major: *mut i32, minor: *mut i32, release: *mut i32, revision: *mut i32) -> ();
    /// Monotonic time of unspecified epoch, s.
    dhdGetTime() -> f64;
}
Library optional {
    /// Version of the SDK as a string (after 3.10).
    dhdGetSDKVersionStr() -> *const ::core::ffi::c_char;
}

Open required {
    /// Number of connected devices, including those open in other processes; -1 on failure.
    dhdGetDeviceCount() -> i32;
    /// Number of connected devices not open in other processes; -1 on failure.
    dhdGetAvailableCount() -> i32;
    /// Opens the first device and makes it the default. Returns its ID, or -1.
    drdOpen() -> i32;
    /// Opens the device with this index in the enumeration. Returns its ID (the same if already open), or -1.
    drdOpenID(id: i8) -> i32;
    /// Closes a device. 0/-1.
    drdClose(id: i8) -> i32;
}

Identify required {
    /// Type of the device ([`DEVICE_OMEGA3`](crate::DEVICE_OMEGA3) ...), or -1.
    dhdGetSystemType(id: i8) -> i32;
    /// Name of the device's model; NULL on failure.
    dhdGetSystemName(id: i8) -> *const ::core::ffi::c_char;
    /// Serial number; some devices give 65535. 0/-1.
    dhdGetSerialNumber(serial: *mut u16, id: i8) -> i32;
    /// Version of the controller's firmware as a decimal number. 0/-1.
    dhdGetVersion(version: *mut f64, id: i8) -> i32;
    /// Communication mode of the device ([`COM_MODE_ASYNC`](crate::COM_MODE_ASYNC) ...), or -1.
    dhdGetComMode(id: i8) -> i32;
}
Identify optional {
    /// Version of the controller's firmware as a string in `buffer` of `size` bytes (after 3.10). 0/-1.
    dhdGetVersionStr(buffer: *mut ::core::ffi::c_char, size: usize, id: i8) -> i32;
    /// Revision of the device's model (after 3.10), or -1.
    dhdGetSystemRev(id: i8) -> i32;
    /// Tests the controller's memory (after 3.7.1). 0, -1, or the **positive** failure
    /// [`ErrorCode::CONFIGURATION`](crate::ErrorCode::CONFIGURATION).
    dhdCheckControllerMemory(id: i8) -> i32;
}

Initialise required {
    /// Whether the library has regulation gains for this model. A C++ `bool`.
    drdIsSupported(id: i8) -> u8;
    /// Whether the device has been calibrated since power-up. A C++ `bool`.
    drdIsInitialized(id: i8) -> u8;
    /// Calibrates. **Moves the arm**, blocks, and leaves regulation running. 0/-1.
    drdAutoInit(id: i8) -> i32;
    /// Compares the end stops with stored values. **Sweeps the whole workspace**, blocks. 0/-1.
    drdCheckInit(id: i8) -> i32;
}

Settings required {
    /// Tilt of the base about the inverted y axis, degrees. 0/-1.
    dhdGetDeviceAngleDeg(angle_deg: *mut f64, id: i8) -> i32;
    /// Sets the tilt of the base about the inverted y axis, degrees; gravity compensation follows. 0/-1.
    dhdSetDeviceAngleDeg(angle_deg: f64, id: i8) -> i32;
    /// Mass that gravity compensation assumes at the effector, kg. 0/-1.
    dhdGetEffectorMass(mass_kg: *mut f64, id: i8) -> i32;
    /// Sets the mass that gravity compensation assumes at the effector, kg. 0/-1.
    dhdSetEffectorMass(mass_kg: f64, id: i8) -> i32;
    /// Gravity compensation on (1) or off (0). 0/-1.
    dhdSetGravityCompensation(on: i32, id: i8) -> i32;
}
Settings optional {
    /// Rotation of the base about x, degrees. 0/-1.
    dhdGetBaseAngleXDeg(angle_deg: *mut f64, id: i8) -> i32;
    /// Sets the rotation of the base about x, degrees. 0/-1.
    dhdSetBaseAngleXDeg(angle_deg: f64, id: i8) -> i32;
    /// Rotation of the base about z, degrees. 0/-1.
    dhdGetBaseAngleZDeg(angle_deg: *mut f64, id: i8) -> i32;
    /// Sets the rotation of the base about z, degrees. 0/-1.
    dhdSetBaseAngleZDeg(angle_deg: f64, id: i8) -> i32;
    /// Largest force of the haptic calls, N, negative for none (after 3.7.1); -1 on failure.
    dhdGetMaxForce(id: i8) -> f64;
    /// Sets the largest force of the haptic calls, N (after 3.7.1). It is not documented whether regulation respects it. 0/-1.
    dhdSetMaxForce(force_n: f64, id: i8) -> i32;
}

Regulation required {
    /// Starts the regulation thread; the device must be initialised. 0/-1.
    drdStart(id: i8) -> i32;
    /// Stops the regulation thread; then brakes, or stays powered when `keep_force`. 0/-1.
    drdStop(keep_force: bool, id: i8) -> i32;
    /// Whether the regulation thread is running. A C++ `bool`.
    drdIsRunning(id: i8) -> u8;
    /// Whether a move or a tracked target is in progress. A C++ `bool`.
    drdIsMoving(id: i8) -> u8;
    /// Whether the filter of tracked targets is on. A C++ `bool`.
    drdIsFiltering(id: i8) -> u8;
    /// Turns the filter of tracked targets on or off. 0/-1.
    drdEnableFilter(on: bool, id: i8) -> i32;
    /// Regulates the translations (the default) or leaves them free. 0/-1.
    drdRegulatePos(on: bool, id: i8) -> i32;
    /// Regulates the rotations or leaves them free. 0/-1.
    drdRegulateRot(on: bool, id: i8) -> i32;
    /// Regulates the gripper or leaves it free. 0/-1.
    drdRegulateGrip(on: bool, id: i8) -> i32;
    /// Stops any motion and holds the position. 0/-1.
    drdHold(id: i8) -> i32;
    /// Moves in a straight, smooth line to a position, m. With `block`, returns only on arrival. 0/-1.
    drdMoveToPos(x_m: f64, y_m: f64, z_m: f64, block: bool, id: i8) -> i32;
    /// Tracks a target position, m, each axis through the filter; may be called at any rate. 0/-1.
    drdTrackPos(x_m: f64, y_m: f64, z_m: f64, id: i8) -> i32;
    /// Acceleration, speed and jerk of moves: m/s^2, m/s, m/s^3, in this order. 0/-1.
    drdGetPosMoveParam(amax: *mut f64, vmax: *mut f64, jerk: *mut f64, id: i8) -> i32;
    /// Sets acceleration, speed and jerk of moves: m/s^2, m/s, m/s^3. The library's default is (1, 1, 1). 0/-1.
    drdSetPosMoveParam(amax: f64, vmax: f64, jerk: f64, id: i8) -> i32;
    /// Acceleration, speed and jerk of tracking: m/s^2, m/s, m/s^3, in this order. 0/-1.
    drdGetPosTrackParam(amax: *mut f64, vmax: *mut f64, jerk: *mut f64, id: i8) -> i32;
    /// Sets acceleration, speed and jerk of tracking: m/s^2, m/s, m/s^3. The library's default is (1, 1, 1). 0/-1.
    drdSetPosTrackParam(amax: f64, vmax: f64, jerk: f64, id: i8) -> i32;
    /// Largest fraction of each joint's torque that regulation may use, 0 to 1; negative on failure.
    drdGetMotRatioMax(id: i8) -> f64;
    /// Sets the largest fraction of each joint's torque that regulation may use, 0 to 1. 0/-1.
    drdSetMotRatioMax(ratio: f64, id: i8) -> i32;
    /// Proportional gain of the base's joints; negative on failure. Units are not documented.
    drdGetEncPGain(id: i8) -> f64;
    /// Sets the proportional gain of the base's joints. 0/-1.
    drdSetEncPGain(gain: f64, id: i8) -> i32;
    /// Integral gain of the base's joints; negative on failure. Units are not documented.
    drdGetEncIGain(id: i8) -> f64;
    /// Sets the integral gain of the base's joints; 0 prevents the force on an obstacle from growing. 0/-1.
    drdSetEncIGain(gain: f64, id: i8) -> i32;
    /// Derivative gain of the base's joints; negative on failure. Units are not documented.
    drdGetEncDGain(id: i8) -> f64;
    /// Sets the derivative gain of the base's joints. 0/-1.
    drdSetEncDGain(gain: f64, id: i8) -> i32;
    /// Priorities of the calling thread and of the regulation thread. 0/-1.
    drdGetPriorities(calling: *mut i32, regulation: *mut i32, id: i8) -> i32;
    /// Sets the priorities of the **calling** thread (also on failure) and of the regulation thread. 0/-1.
    drdSetPriorities(calling: i32, regulation: i32, id: i8) -> i32;
    /// Sleeps until the regulation loop's next iteration.
    drdWaitForTick(id: i8) -> ();
}

Read required {
    /// Pose in the regulation loop's buffer: position in m, orientation in rad, gripper in m, and the
    /// orientation as nine numbers, row by row. 0/1/-1.
    drdGetPositionAndOrientation(
        x_m: *mut f64, y_m: *mut f64, z_m: *mut f64, oa_rad: *mut f64, ob_rad: *mut f64, og_rad: *mut f64,
        gap_m: *mut f64, matrix: *mut [f64; 9], id: i8
    ) -> i32;
    /// Velocity in the regulation loop's buffer: m/s, rad/s, m/s. 0/-1.
    drdGetVelocity(
        vx_m_s: *mut f64, vy_m_s: *mut f64, vz_m_s: *mut f64, wx_rad_s: *mut f64, wy_rad_s: *mut f64,
        wz_rad_s: *mut f64, gap_m_s: *mut f64, id: i8
    ) -> i32;
    /// Mean rate of the regulation loop since the previous call, kHz; -1 on failure. Call it from one place only.
    drdGetCtrlFreq(id: i8) -> f64;
    /// Position, m, read from the device (works without regulation). 0/1/-1.
    dhdGetPosition(x_m: *mut f64, y_m: *mut f64, z_m: *mut f64, id: i8) -> i32;
    /// Commanded motor force without the gravity term, N; there is no force sensor. 0/-1.
    dhdGetForce(fx_n: *mut f64, fy_n: *mut f64, fz_n: *mut f64, id: i8) -> i32;
    /// Writes the status vector, see [`StatusVector`](crate::StatusVector). 0/-1.
    dhdGetStatus(status: *mut i32, id: i8) -> i32;
    /// Rate of force commands, kHz; negative on failure.
    dhdGetComFreq(id: i8) -> f64;
}
Read optional {
    /// Pressed buttons of the effector, one bit each.
    dhdGetButtonMask(id: i8) -> u32;
}

Emergency required {
    /// Motors off, then electromagnetic brake. 0/-1.
    dhdStop(id: i8) -> i32;
    /// Motor power on (1) or off (0). 0/-1.
    dhdEnableForce(on: u8, id: i8) -> i32;
    /// Electromagnetic brake on (1) or off (0). 0/-1.
    dhdSetBrakes(on: i32, id: i8) -> i32;
}

Expert required {
    /// Enables the calls of this group for the whole process. 0/-1.
    dhdEnableExpertMode() -> i32;
    /// Disables the calls of this group. 0/-1.
    dhdDisableExpertMode() -> i32;
    /// The controller's watchdog in units of [`WATCHDOG_UNIT_US`](crate::WATCHDOG_UNIT_US), 0 for off. 0/-1.
    dhdGetWatchdog(units: *mut u8, id: i8) -> i32;
    /// Sets the controller's watchdog in units of [`WATCHDOG_UNIT_US`](crate::WATCHDOG_UNIT_US), 0 for off: without a command for this time
    /// it switches the force off and brakes. 0/-1.
    dhdSetWatchdog(units: u8, id: i8) -> i32;
    /// The controller's velocity threshold in device units. 0/-1.
    dhdGetVelocityThreshold(threshold: *mut u32, id: i8) -> i32;
}

    } };
}

/// Functions of libdrd that are never used, and why.
pub const NEVER_USED: &[(&str, &str)] = &[
    (
        "dhdEnableSimulator",
        "would accept a network device as the arm",
    ),
    ("dhdSetForce", "interferes with the regulation thread"),
    (
        "dhdSetForceAndTorqueAndGripperForce",
        "interferes with the regulation thread",
    ),
    (
        "dhdSetVelocityThreshold",
        "the vendor advises against changing it",
    ),
    ("dhdSetTimeGuard", "changes the meaning of cached readings"),
    ("dhdPreset", "overwrites the calibration"),
    ("dhdReset", "discards the calibration"),
    ("dhdStartThread", "this program starts its own threads"),
    ("dhdKbHit", "changes the terminal's mode"),
    ("drdPrecisionInit", "sweeps every axis, slowly"),
    ("drdLock", "the omega.3 has no locks"),
    ("drdMoveTo", "moves axes that the omega.3 does not have"),
];
