//! Readers of single parts.
use skinrig_model::{CameraModel, HostDuration, Point2};
use skinrig_settings::{Collector, Field, Setting};
use std::collections::BTreeMap;

pub(crate) use crate::file::hex;
use crate::keys::{NominalCamera, Roi};

pub(crate) fn seconds(s: f64) -> HostDuration {
    HostDuration::from_secs_f64(s)
}
pub(crate) fn biases(f: &Field) -> BTreeMap<String, i64> {
    f.entries()
        .iter()
        .filter_map(|(name, v)| Some((name.clone(), v.as_whole()?)))
        .collect()
}
pub(crate) fn roi(r: &Field, out: &mut Collector) -> Option<[u16; 4]> {
    Roi::read(r, out)
}
pub(crate) fn nominal_camera(f: &Field, aim: Point2) -> Option<CameraModel> {
    let mut out = Collector::new(skinrig_settings::Sources::default());
    NominalCamera::from_field(f, &mut out).map(|c| c.model(aim))
}
