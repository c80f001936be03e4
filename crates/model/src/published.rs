//! Published figures of the skin, with their sources.
//!
//! "The paper" is Koolani et al., "An Event-Based Opto-Tactile Skin" (Frontiers); table and figure names are its own.

/// Localisation RMSE without reduction, mm (section 3.1).
pub const RMSE_MM: f64 = 4.66;
/// Localisation RMSE along x, mm (section 3.1).
pub const RMSE_X_MM: f64 = 4.17;
/// Localisation RMSE along y, mm (section 3.1).
pub const RMSE_Y_MM: f64 = 3.28;
/// Mean standard deviation between repetitions, mm (section 3.1).
pub const REPEAT_STD_MM: f64 = 2.85;
/// Share of presses localised (abstract).
pub const LOCATED_RATE: f64 = 0.95;
/// RMSE at 1024-fold reduction, mm (abstract).
pub const RMSE_1024_MM: f64 = 9.33;
/// Pass rate without reduction (section 3.1), and at 1024-fold reduction (abstract).
pub const PASS_RATE: (f64, f64) = (0.95, 0.85);
/// Width of the 5-95 % interval of the detections, ms: without reduction, and at 1024-fold reduction (section 3.2).
pub const LATENCY_WIDTH_MS: (f64, f64) = (31.0, 113.0);
/// False alarms per second: without reduction, and at 1024-fold reduction (section 3.2).
pub const FALSE_ALARMS_PER_S: (f64, f64) = (0.13, 1.86);
/// Share of trials detected, at the same reductions: target without reduction, result at 1024 (section 3.2).
pub const DETECTED_RATE: (f64, f64) = (0.95, 0.88);
/// Bytes per second of both cameras: during a press, and while idle (table "MSOWS").
pub const BYTES_PER_S: (f64, f64) = (75e3, 24e3);
/// Bits of an event in these (table "MSOWS").
pub const BITS_PER_EVENT: f64 = 21.0;
