//! The seam between the skin world and what the pixels of a camera make of it.
//!
//! The world moves the tip; a [`PixelModel`] turns the tip's path into the events of one camera. Both live on
//! *world time*: nanoseconds of the rig's host clock. A camera's own clock is added later.

use skinrig_model::{CameraId, CameraModel, Point3, Polarity, Skin, SkinOutline};

/// Where the tip was. Samples lie on a grid of [`GRID_NS`]; the tip moves linearly between two of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipSample {
    /// World time, ns.
    pub t_ns: i64,
    /// Where the flat end of the tip truly was (without measurement noise), skin frame, mm. Below the surface
    /// when `z_mm < 0`.
    pub position: Point3<Skin>,
}

/// Distance of two tip samples, ns: the 1 kHz of the robot.
pub const GRID_NS: i64 = 1_000_000;

/// An event of one pixel on world time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelEvent {
    /// World time, ns.
    pub t_ns: i64,
    /// Column, 0..640.
    pub x: u16,
    /// Row, 0..480.
    pub y: u16,
    /// Sign of the change.
    pub polarity: Polarity,
}

/// The pixels of one camera.
pub trait PixelModel: Send {
    /// Goes on to the last of `tips` (in time order, strictly increasing, on the grid) and appends the events
    /// from the end of the previous call (at the first call: from the first of `tips`) up to, not including,
    /// `tips.last().t_ns`, sorted by time.
    ///
    /// Equal seeds and tips give equal events on every machine, however the tips are divided among calls.
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>);
}

/// What a pixel model is told about its camera and skin.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneConfig {
    /// Seed of everything random in this camera's pixels.
    pub seed: u64,
    /// The skin.
    pub outline: SkinOutline,
    /// Which camera.
    pub camera_id: CameraId,
    /// The camera's true geometry (what a calibration is looking for).
    pub camera: CameraModel,
    /// Rows that see the skin's edge from inside, both ends included (public code: camera 1 185..=360, camera 2
    /// 200..=355). Other rows see the mould.
    pub skin_rows: (u16, u16),
    /// Side of the tip's square end, mm. The paper says "cubic tip" and no size: configuration.
    pub tip_side_mm: f64,
    /// Thickness of the skin, mm (paper: 4).
    pub skin_thickness_mm: f64,
}
