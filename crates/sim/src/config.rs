//! Configuration of a simulated rig, with documented defaults.

use skinrig_model::{
    CameraId, CameraModel, LensModel, Point2, Point3, RigidTransform, Robot, SimLevel, Skin,
    SkinOutline, StereoGeometry,
};

use crate::contacts::Contacts;
use crate::faults::{Fault, FaultSizes};
use crate::geometric::GeometricConfig;
use crate::motion::MotionConfig;
use crate::optical::OpticalConfig;
use crate::random::{Purpose, Stream};
use crate::scene::SceneConfig;

/// Camera clocks and trigger inputs. All values are assumptions: none is published for the EVK1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraClockConfig {
    /// Largest clock drift, ppm; the drift is drawn uniformly from -max..=max.
    pub max_drift_ppm: f64,
    /// Largest camera time at the first start, s; drawn uniformly from 0..max.
    pub max_origin_s: f64,
    /// Largest delay of trigger edges, ns; drawn uniformly from 0..max.
    pub trigger_jitter_ns: i64,
    /// Chunk size, bytes; a multiple of 4.
    pub chunk_bytes: usize,
    /// Capacity for bytes that wait for the host; further bytes are lost and counted.
    pub buffer_bytes: usize,
}

impl Default for CameraClockConfig {
    fn default() -> Self {
        Self {
            max_drift_ppm: 40.0,
            max_origin_s: 100.0,
            trigger_jitter_ns: 2_500,
            chunk_bytes: 1 << 20,
            buffer_bytes: 64 << 20,
        }
    }
}

/// The trigger box (assumed values).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriggerBoxConfig {
    /// Shortest delay from the request to the first edge, ns.
    pub min_latency_ns: i64,
    /// Longest delay, ns.
    pub max_latency_ns: i64,
    /// Largest clock drift of a ceramic resonator, ppm; drawn uniformly from -max..=max.
    pub max_drift_ppm: f64,
    /// Largest time of its clock at the beginning, s; drawn uniformly from 0..max.
    pub max_origin_s: f64,
    /// Period of its sync trains on its own clock, ms; 0 for none.
    pub sync_period_ms: u32,
    /// Period of the host's time exchanges, ms; 0 for none.
    pub exchange_period_ms: u32,
    /// Shortest transmission time of a request or reply, µs.
    pub min_delay_us: f64,
    /// Mean of the additional, exponentially distributed transmission time, µs.
    pub mean_delay_us: f64,
    /// Whether its contact input closes while the tip touches the skin.
    pub contact_input: bool,
}

impl Default for TriggerBoxConfig {
    fn default() -> Self {
        Self {
            min_latency_ns: 20_000,
            max_latency_ns: 60_000,
            max_drift_ppm: 500.0,
            max_origin_s: 1_000.0,
            sync_period_ms: 1_000,
            exchange_period_ms: 100,
            min_delay_us: 150.0,
            mean_delay_us: 100.0,
            contact_input: true,
        }
    }
}

/// Deviation of the true camera geometry from the nominal one: half widths of uniform distributions (assumed; the paper's measured and
/// calibrated positions differ by 1 to 6 mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeometryErrors {
    /// Camera positions, per axis, mm.
    pub position_mm: f64,
    /// Skews, degrees.
    pub skew_deg: f64,
    /// Distortion coefficient W, dimensionless.
    pub w: f64,
}

impl Default for GeometryErrors {
    fn default() -> Self {
        Self {
            position_mm: 1.5,
            skew_deg: 1.5,
            w: 0.08,
        }
    }
}

/// Configuration of a simulated rig.
#[derive(Debug, Clone, PartialEq)]
pub struct SimConfig {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Level of detail.
    pub level: SimLevel,
    /// The skin.
    pub outline: SkinOutline,
    /// Nominal geometry, as reported by the rig.
    pub nominal: StereoGeometry,
    /// Deviation of the true geometry from it.
    pub geometry_errors: GeometryErrors,
    /// Pose of the skin in the robot frame.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Smallest and largest reachable coordinates, robot frame, mm (omega3.md: axis extremes reported by users of an omega.3; the true
    /// workspace is smaller off the axes, and in x).
    pub workspace_mm: ([f64; 3], [f64; 3]),
    /// Initial tip position, skin frame.
    pub start: Point3<Skin>,
    /// Rows of each camera that see the skin (public code: 185..=360 and 200..=355).
    pub skin_rows: [(u16, u16); 2],
    /// Side length of the tip's square end, mm. The paper states "cubic tip" without a size (assumed).
    pub tip_side_mm: f64,
    /// Thickness of the skin, mm (paper: 4).
    pub skin_thickness_mm: f64,
    /// The robot.
    pub motion: MotionConfig,
    /// Camera clocks and trigger inputs.
    pub camera_clock: CameraClockConfig,
    /// The trigger box.
    pub trigger_box: TriggerBoxConfig,
    /// Event rates and spreads of the geometric level.
    pub geometric: GeometricConfig,
    /// Constants of the optical level.
    pub optical: OpticalConfig,
    /// The session that the scene was fitted to, if it is a twin.
    pub twin_of: Option<String>,
    /// Earlier contacts, skin frame, for further legs of a run.
    pub pressed_before: Vec<Point2>,
    /// Number of earlier legs. Each leg has its own noise; the devices and the skin stay.
    pub legs_before: u32,
    /// Injected faults.
    pub faults: Vec<Fault>,
    /// Sizes of the injected faults.
    pub fault_sizes: FaultSizes,
}

/// Nominal geometry: cameras at the positions that the public code states as measured, (45, -35) and (45, 46), with an undistorted lens of
/// 120° and no skew.
pub const DRAWN: StereoGeometry = {
    const fn camera(y_mm: f64) -> CameraModel {
        CameraModel {
            position: Point2::new(45.0, y_mm),
            aim: Point2::new(10.0, 2.0),
            skew_deg: 0.0,
            lens: LensModel::Exponential {
                half_fov_deg: 60.0,
                w: 0.0,
            },
        }
    }
    StereoGeometry {
        cameras: [camera(-38.0), camera(42.0)],
    }
};

impl SimConfig {
    /// Default rig with this seed and level.
    #[must_use]
    pub fn new(seed: u64, level: SimLevel) -> Self {
        Self {
            seed,
            level,
            outline: SkinOutline::PAPER,
            nominal: DRAWN,
            geometry_errors: GeometryErrors::default(),
            // The skin is rotated by the angle of the 7-24-25 triangle about z; its centre is near the robot's.
            robot_from_skin: RigidTransform::new(
                [[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]],
                [-6.0, -3.0, -15.0],
            ),
            workspace_mm: ([-90.0, -90.0, -65.0], [90.0, 90.0, 100.0]),
            start: Point3::new(10.0, 2.0, 10.0),
            skin_rows: [(185, 360), (200, 355)],
            tip_side_mm: 10.0,
            skin_thickness_mm: 4.0,
            motion: MotionConfig::default(),
            camera_clock: CameraClockConfig::default(),
            trigger_box: TriggerBoxConfig::default(),
            geometric: GeometricConfig::default(),
            optical: OpticalConfig::default(),
            twin_of: None,
            pressed_before: Vec::new(),
            legs_before: 0,
            faults: Vec::new(),
            fault_sizes: FaultSizes::default(),
        }
    }

    /// The true geometry: the nominal one with the errors of this seed.
    #[must_use]
    pub fn true_geometry(&self) -> StereoGeometry {
        let errors = self.geometry_errors;
        let mut random = Stream::new(self.seed, Purpose::Geometry, 0);
        let mut off = |half: f64| random.between(-half, half);
        let cameras = self.nominal.cameras.map(|drawn| {
            let mut camera = drawn;
            camera.position.x_mm += off(errors.position_mm);
            camera.position.y_mm += off(errors.position_mm);
            camera.skew_deg += off(errors.skew_deg);
            let (half_fov_deg, w) = drawn.lens.coefficients();
            camera.lens = drawn.lens.with(half_fov_deg, w + off(errors.w));
            camera
        });
        StereoGeometry { cameras }
    }

    /// Input of the pixel model of `camera`.
    #[must_use]
    pub fn scene(&self, camera: CameraId) -> SceneConfig {
        SceneConfig {
            seed: crate::random::derive_seed(self.seed, Purpose::Pixels, camera.index() as u64),
            skin_seed: crate::random::derive_seed(self.seed, Purpose::Skin, 0),
            start: u64::from(self.legs_before) << 32,
            outline: self.outline,
            camera_id: camera,
            camera: self.true_geometry().cameras[camera.index()],
            skin_rows: self.skin_rows[camera.index()],
            tip_side_mm: self.tip_side_mm,
            skin_thickness_mm: self.skin_thickness_mm,
            contacts: Contacts::after(&self.pressed_before),
        }
    }
}
