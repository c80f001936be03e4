//! The data behind the figures of `skinrig scene check`.

use serde_json::{Value, json};
use skinrig_analysis::event_statistics::{Bin, EventStatistics};

use super::table::Table;

/// Data for the script of the page: a row per camera and bin, or ring. Cameras with their names.
pub(crate) fn of_events(cameras: &[(String, &EventStatistics)]) -> Value {
    let binned = |of: fn(&EventStatistics) -> &[Bin], names: [&'static str; 3]| {
        let rows = cameras
            .iter()
            .flat_map(|(name, camera)| of(camera).iter().map(move |bin| (name, bin)));
        Table::of(rows)
            .any("camera", |row| row.0.clone())
            .number(names[0], 3, |row| row.1.from)
            .number(names[1], 3, |row| row.1.to)
            .any(names[2], |row| row.1.n)
            .finish()
    };
    let rings = cameras.iter().flat_map(|(name, camera)| {
        let chance = camera.correlation_by_chance;
        camera
            .correlation
            .iter()
            .map(move |ring| (name, ring, chance))
    });
    let rings = Table::of(rings)
        .any("camera", |row| row.0.clone())
        .number("distance_px", 0, |row| row.1.distance_px)
        .number("active_share", 6, |row| row.1.active)
        .number("by_chance", 6, |row| row.2)
        .finish();
    let intervals = binned(|c| &c.interval_bins, ["from_us", "to_us", "intervals"]);
    let pixels = binned(|c| &c.pixels, ["from_events", "to_events", "pixels"]);
    json!({ "session": "events", "tables": { "intervals": intervals, "distances": rings, "pixels": pixels } })
}
