//! Owns the answer with the clusters of one press in both cameras, as the analysis finds them with DBSCAN.

use serde_json::{Value, json};
use skinrig_analysis::dbscan::{Dbscan, NOISE};
use skinrig_analysis::grid::PixelGrid;
use skinrig_analysis::hot_pixels::HotPixelMask;
use skinrig_analysis::segment::windows;
use skinrig_model::{CameraId, PressId};

use crate::open_session::OpenSession;
use crate::problem::Problem;

/// Per camera: rows of the crop, window (s after contact), clusters (events, centroid), and pixels (column, row, events, cluster or -1).
pub(crate) fn document(opened: &OpenSession, press: PressId) -> Result<Value, Problem> {
    let known = &opened.known;
    let Some(analysis) = &known.analysis else {
        return Err(Problem::absent(format!(
            "expected an analysis, found none\n  next: `skinrig analyze {}` makes it",
            opened.path.display()
        )));
    };
    let row = known.presses.iter().position(|(p, _)| p.id == press);
    let timing = row.and_then(|row| {
        let outcome = known.presses[row].1.last()?.outcome.as_ref()?;
        Some((row, outcome.timing?))
    });
    let Some((row, timing)) = timing else {
        return Err(Problem::absent(format!(
            "press {}: expected a press with measured times, found none",
            press.number()
        )));
    };
    let settings = &analysis.settings;
    let mut cameras = Vec::new();
    for camera in CameraId::ALL {
        let k = camera.index();
        let (Some(fit), Some(clock)) = (analysis.clocks[k], &known.clocks[k]) else {
            cameras.push(Value::Null);
            continue;
        };
        let Some(window) = windows(std::iter::once((row, timing)), &[], &fit, settings).pop()
        else {
            cameras.push(Value::Null);
            continue;
        };
        // The window is on the line through all legs; events are as recorded.
        let to_recorded = |us: u64| {
            let host_us = fit.host_us_of_camera(us as f64);
            clock.recorded_us(host_us).max(0.0) as u64
        };
        let (from_us, to_us) = (to_recorded(window.start_us), to_recorded(window.end_us));
        let rows = settings.crop_v[k];
        let mut grid = PixelGrid::new(rows);
        let hot = HotPixelMask::new(&analysis.hot_pixels[k]);
        skinrig_results::events_between(
            &opened.reader,
            &known.indices[k],
            (from_us, to_us.saturating_sub(1)),
            |event| {
                if !hot.holds(&event) {
                    grid.add(event.x, event.y);
                }
            },
        )?;
        let view = analysis.presses.iter().find(|p| p.press == press);
        let own = view.and_then(|p| p.views[k]?.core_threshold);
        let mut search = Dbscan::new(settings.eps_px, own.unwrap_or(settings.min_samples));
        search.run(&grid);
        let clusters: Vec<Value> = search
            .clusters()
            .iter()
            .map(|c| {
                let centroid = c.centroid();
                json!({ "events": c.events, "u": centroid.map(|c| c.0), "v": centroid.map(|c| c.1) })
            })
            .collect();
        let width = PixelGrid::WIDTH as u32;
        let pixels: Vec<Value> = search
            .labels()
            .map(|(index, label)| {
                let cluster = if label == NOISE { -1 } else { i64::from(label) };
                let (u, v) = (index % width, index / width + u32::from(rows.0));
                json!([u, v, grid.count(index), cluster])
            })
            .collect();
        cameras.push(json!({
            "rows": rows,
            "largest": search.largest().map(|(n, _)| n),
            "clusters": clusters,
            "pixels": pixels,
        }));
    }
    Ok(json!({ "press": press.number(), "cameras": cameras }))
}
