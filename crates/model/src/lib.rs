//! The vocabulary shared by all of skinrig: units, frames, ids, clocks, events and session records.
//!
//! Plain values: no files, wall clocks or devices, and no other skinrig crate but `skinrig-settings`.
//! Every quantity names its unit in its type or its name: `*_mm`, `*_us`, `*_n` (newton),
//! `*_hz`, `*_deg`.

pub mod camera;
mod device_role;
pub mod event;
pub mod fault;
pub mod frame;
pub mod id;
pub mod lens;
pub mod level_bias;
pub mod limit;
pub mod notification;
mod number;
mod places;
pub mod pose;
pub mod preflight;
pub mod press;
mod press_fault;
pub mod published;
pub mod pulse;
pub mod quantile;
pub mod reason;
pub mod record;
mod remount;
mod rig_fault;
mod rig_geometry;
pub mod run_end;
pub mod scene;
pub mod selection;
pub mod settings;
pub mod skin;
pub mod stopping;
pub mod stream;
pub mod text;
pub mod time;
pub mod touch;
pub mod trigger_box;

pub use camera::{CameraModel, SENSOR_HEIGHT, SENSOR_WIDTH, StereoGeometry};
pub use device_role::DeviceRole;
pub use event::{CdEvent, Polarity, TriggerEdge};
pub use fault::{
    Causes, DeviceError, GuardError, NoCause, NotArrived, NotAtRest, NotificationFault, PressFault,
    PressMoment, RunFault, SinkFault, SurfaceFault, SurfaceFinding, Suspension, TimingFault,
    TouchFault, TouchPhase, WatchdogTrip, WatchedQuantity,
};
pub use frame::{Point2, Point3, RigidTransform, Robot, Skin};
pub use id::{AttemptId, CameraId, LocationId, PressId, RepetitionId, as_index};
pub use lens::{LensAngle, LensKind, LensModel};
pub use limit::{Limit, Side};
pub use notification::{Notification, NotificationChannel, Occasion};
pub use places::{Places, SAME_PLACE_MM, merge_places};
pub use pose::PoseSample;
pub use preflight::{CheckKind, CheckVerdict, PreflightCheck};
pub use press::{
    PlannedPress, PressHistory, PressOutcome, PressRole, PressTiming, PressVerdict, Verdict,
};
pub use press_fault::PressFaultKind;
pub use pulse::{DecodedMark, DecodedSync, Label, Mark, MarkKind, PulseTrain, SentMark};
pub use quantile::quantile;
pub use reason::{ExcludedReason, InterruptionReason, InvalidReason, MissedReason, ReasonRef};
pub use record::{
    DeviceIdentity, InterruptionKind, MotionCommand, Record, ResumeHeader, RunHeader, Setting,
};
pub use remount::RemountSettings;
pub use rig_fault::{RigFault, UnsupportedFault};
pub use rig_geometry::RigGeometry;
pub use run_end::{RunEnd, StopReason};
pub use scene::{SceneNeed, ScenePart, SimLevel};
pub use selection::{SelectedOut, SelectionReason};
pub use settings::{
    AlignmentSettings, AnalysisSettings, Background, CalibrationModel, CentroidRule, CmreSettings,
    Estimator, LatencySettings, Locator, Precision, ReducedLatencySettings, ReducedThresholdGrid,
    ReductionSettings, ThresholdGrid, ThresholdRule, WindowAnchor,
};
pub use skin::{OUTLINE_SHAPE, SkinOutline};
pub use stopping::{Look, StopAnswer, StopMetric, StopQuestion};
pub use stream::{ChunkFacts, LostTime, RawChunk, StreamFormat};
pub use text::UnknownName;
pub use time::{HostDuration, HostTime};
pub use touch::{
    LEAST_PRESSES_OF_DEPTHS, LEAST_PRESSES_OF_REGIONS, Reaction, TouchDepth, TouchEstimate,
    TouchKind, TouchRegion,
};
pub use trigger_box::{BoxReport, BoxTime};
