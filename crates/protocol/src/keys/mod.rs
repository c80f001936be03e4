//! Declarations of protocols and schedules: each key once, with its unit, range, default and meaning.

mod camera;
mod evaluation;
mod frame;
mod motion;
mod path;
mod protocol;
mod ranges;
mod scene;
mod schedule;

pub(crate) use camera::{NominalCamera, Roi, rays_meet};
pub(crate) use evaluation::{calibration_possible, roles};
pub(crate) use frame::SyncKeys;
pub(crate) use motion::{LimitKeys, MotionKeys, MotionParts};
pub(crate) use path::{Circles, Csv, LineDirection, Meander, Order, Path, Random};
pub(crate) use protocol::ProtocolKeys;
pub(crate) use ranges::MOST_POINTS;
pub(crate) use schedule::{PressRoleKeys, ScheduleKeys};
