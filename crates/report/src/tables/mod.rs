//! Owns the data tables of the page (press table, tooltips, CSV downloads) and the small tables of settings and calibration.

mod packing;
mod studies;
mod table;
mod traces;

use serde_json::{Map, Value, json};
use skinrig_analysis::result::{Analysis, CalibrationResult};
use skinrig_model::PressId;
use skinrig_settings::Settings;

use crate::derive;
use crate::input::ReportInput;
use table::{Table, rounded};

/// Data for the script: session ID and named tables.
pub(crate) fn script_data(input: &ReportInput<'_>) -> Value {
    let a = input.analysis;
    let mut tables = Map::new();
    let mut put = |name: &str, table: Table| {
        tables.insert(name.to_owned(), table.finish());
    };
    put("presses", presses(a));
    put("locations", locations(a));
    put("errors", errors(a));
    put("rates", rates(a));
    put("press_rates", press_rates(a));
    put("pictures", pictures(a));
    put("clocks", clocks(a));
    if let Some(c) = &a.calibration {
        let rows = calibration(c);
        let table = Table::new()
            .column("parameter", rows.iter().map(|r| json!(r.name)))
            .column("before", rows.iter().map(|r| rounded(r.before, 6)))
            .column("after", rows.iter().map(|r| rounded(r.after, 6)))
            .column(
                "standard_error",
                rows.iter().map(|r| rounded(r.standard_error, 6)),
            )
            .column(
                "low_95",
                rows.iter().map(|r| rounded(r.interval.map(|i| i.0), 6)),
            )
            .column(
                "high_95",
                rows.iter().map(|r| rounded(r.interval.map(|i| i.1), 6)),
            );
        put("calibration", table);
    }
    for (name, table) in studies::all(a).into_iter().chain(traces::all(input)) {
        tables.insert(name.to_owned(), table.finish());
    }
    json!({ "session": input.provenance.session_id, "tables": tables })
}

fn presses(a: &Analysis) -> Table {
    let rows = &a.presses;
    let mm = |f: fn(&skinrig_analysis::result::PressResult) -> Option<f64>| {
        rows.iter().map(move |p| rounded(f(p), 3))
    };
    let mut table = Table::new()
        .column("press", rows.iter().map(|p| json!(p.press)))
        .column("role", rows.iter().map(|p| json!(p.role)))
        .column("repetition", rows.iter().map(|p| json!(p.repetition)))
        .column("location", rows.iter().map(|p| json!(p.location)))
        .column("verdict", rows.iter().map(|p| json!(p.verdict)))
        .column(
            "outcome",
            rows.iter().map(|p| json!(p.location_outcome.name())),
        )
        .column("planned_x_mm", mm(|p| Some(p.planned.x_mm)))
        .column("planned_y_mm", mm(|p| Some(p.planned.y_mm)))
        .column("depth_mm", mm(|p| Some(p.depth_mm)))
        .column("truth_x_mm", mm(|p| p.truth.map(|t| t.x_mm)))
        .column("truth_y_mm", mm(|p| p.truth.map(|t| t.y_mm)))
        .column("estimate_x_mm", mm(|p| p.estimate().map(|t| t.x_mm)))
        .column("estimate_y_mm", mm(|p| p.estimate().map(|t| t.y_mm)))
        .column("error_x_mm", mm(|p| p.error_mm().map(|e| e.0)))
        .column("error_y_mm", mm(|p| p.error_mm().map(|e| e.1)))
        .column("error_mm", mm(derive::error_norm_mm))
        .column(
            "contact_s",
            rows.iter()
                .map(|p| rounded(p.timing.map(|t| t.contact.as_secs_f64()), 4)),
        );
    let names: [[&'static str; 5]; 2] = [
        [
            "camera1_events",
            "camera1_on_events",
            "camera1_clusters",
            "camera1_centroid_u_px",
            "camera1_centroid_v_px",
        ],
        [
            "camera2_events",
            "camera2_on_events",
            "camera2_clusters",
            "camera2_centroid_u_px",
            "camera2_centroid_v_px",
        ],
    ];
    for (camera, [events, on, clusters, u, v]) in names.into_iter().enumerate() {
        let view = move |p: &skinrig_analysis::result::PressResult| p.views[camera];
        table = table
            .column(
                events,
                rows.iter().map(|p| json!(view(p).map(|v| v.events))),
            )
            .column(on, rows.iter().map(|p| json!(view(p).map(|v| v.on_events))))
            .column(
                clusters,
                rows.iter().map(|p| json!(view(p).map(|v| v.clusters))),
            )
            .column(
                u,
                rows.iter()
                    .map(|p| rounded(view(p).and_then(|v| v.centroid_u), 2)),
            )
            .column(
                v,
                rows.iter()
                    .map(|p| rounded(view(p).and_then(|v| v.centroid_v), 2)),
            );
    }
    table
        .column(
            "counted",
            rows.iter().map(|p| json!(u8::from(derive::is_counted(p)))),
        )
        .column("rule", rows.iter().map(|p| json!(p.rule)))
        .column("reason", rows.iter().map(|p| json!(p.reason)))
}

/// The errors behind the distribution, ascending.
fn errors(a: &Analysis) -> Table {
    let counted = a.presses.iter().filter(|p| derive::is_counted(p));
    let mut rows: Vec<(f64, PressId)> = counted
        .filter_map(|p| Some((derive::error_norm_mm(p)?, p.press)))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    Table::new()
        .column("press", rows.iter().map(|r| json!(r.1)))
        .column("error_mm", rows.iter().map(|r| rounded(Some(r.0), 4)))
}

fn locations(a: &Analysis) -> Table {
    let rows = derive::locations(a);
    Table::new()
        .column("location", rows.iter().map(|l| json!(l.location)))
        .column(
            "planned_x_mm",
            rows.iter().map(|l| rounded(Some(l.planned.x_mm), 3)),
        )
        .column(
            "planned_y_mm",
            rows.iter().map(|l| rounded(Some(l.planned.y_mm), 3)),
        )
        .column("presses", rows.iter().map(|l| json!(l.n)))
        .column(
            "mean_error_mm",
            rows.iter().map(|l| rounded(Some(l.mean_error_mm), 4)),
        )
        .column(
            "std_between_repetitions_mm",
            rows.iter().map(|l| rounded(l.std_mm, 4)),
        )
}

fn rates(a: &Analysis) -> Table {
    let (mut camera, mut start, mut mean, mut peak) = (vec![], vec![], vec![], vec![]);
    for (i, s) in a.rates.iter().enumerate() {
        for (k, m) in s.mean_per_s.iter().enumerate() {
            camera.push(json!(i + 1));
            start.push(rounded(Some(s.start_s + s.bin_s * k as f64), 3));
            mean.push(rounded(Some(f64::from(*m)), 0));
            peak.push(rounded(s.peak_per_s.get(k).map(|p| f64::from(*p)), 0));
        }
    }
    Table::new()
        .column("camera", camera)
        .column("bin_start_s", start)
        .column("mean_events_per_s", mean)
        .column("peak_events_per_s", peak)
}

fn press_rates(a: &Analysis) -> Table {
    let bins = || {
        a.zooms
            .iter()
            .flat_map(|z| (0..z.on_per_s.len().max(z.off_per_s.len())).map(move |k| (z, k)))
    };
    let at = |v: &[f32], k: usize| rounded(v.get(k).map(|r| f64::from(*r)), 0);
    Table::new()
        .column("press", bins().map(|(z, _)| json!(z.press)))
        .column("camera", bins().map(|(z, _)| json!(z.camera.number())))
        .column(
            "since_contact_s",
            bins().map(|(z, k)| rounded(Some(z.start_s + z.bin_s * k as f64), 4)),
        )
        .column("on_events_per_s", bins().map(|(z, k)| at(&z.on_per_s, k)))
        .column("off_events_per_s", bins().map(|(z, k)| at(&z.off_per_s, k)))
}

/// Maximum number of presses shown as images.
pub(crate) const PICTURED_PRESSES: usize = 6;

fn pictures(a: &Analysis) -> Table {
    let shown = pictured(a);
    let pixels = || {
        a.pictures
            .iter()
            .filter(|p| shown.contains(&p.press))
            .flat_map(|p| p.pixels.iter().map(move |q| (p, q)))
    };
    Table::new()
        .column("press", pixels().map(|(p, _)| json!(p.press)))
        .column("camera", pixels().map(|(p, _)| json!(p.camera.number())))
        .column("u_px", pixels().map(|(_, q)| json!(q.u)))
        .column("v_px", pixels().map(|(_, q)| json!(q.v)))
        .column("on_events", pixels().map(|(_, q)| json!(q.on)))
        .column("off_events", pixels().map(|(_, q)| json!(q.off)))
        .column(
            "in_cluster",
            pixels().map(|(_, q)| json!(u8::from(q.clustered))),
        )
}

/// The first presses (by number) with images.
pub(crate) fn pictured(a: &Analysis) -> Vec<PressId> {
    let mut presses: Vec<PressId> = a.pictures.iter().map(|p| p.press).collect();
    presses.sort_unstable();
    presses.dedup();
    presses.truncate(PICTURED_PRESSES);
    presses
}

fn clocks(a: &Analysis) -> Table {
    let fits = || {
        a.clocks
            .iter()
            .enumerate()
            .filter_map(|(i, c)| c.map(|c| (i + 1, c)))
    };
    Table::new()
        .column("camera", fits().map(|(i, _)| json!(i)))
        .column("method", fits().map(|(_, c)| json!(c.method)))
        .column(
            "offset_us",
            fits().map(|(_, c)| rounded(Some(c.offset_us), 3)),
        )
        .column(
            "drift_ppm",
            fits().map(|(_, c)| rounded(Some(c.drift_ppm), 6)),
        )
        .column(
            "drift_se_ppm",
            fits().map(|(_, c)| rounded(Some(c.drift_se_ppm), 6)),
        )
        .column(
            "residual_rms_us",
            fits().map(|(_, c)| rounded(Some(c.residual_rms_us), 4)),
        )
        .column(
            "residual_max_us",
            fits().map(|(_, c)| rounded(Some(c.residual_max_us), 4)),
        )
        .column("n", fits().map(|(_, c)| json!(c.n)))
        .column("rejected", fits().map(|(_, c)| json!(c.rejected)))
}

/// A calibrated parameter.
pub(crate) struct ParameterRow {
    pub(crate) name: String,
    pub(crate) before: Option<f64>,
    pub(crate) after: Option<f64>,
    pub(crate) standard_error: Option<f64>,
    /// 95 % interval: 1.96 standard errors to either side.
    pub(crate) interval: Option<(f64, f64)>,
}

/// Calibrated parameters with their start values.
pub(crate) fn calibration(c: &CalibrationResult) -> Vec<ParameterRow> {
    let row = |(i, name): (usize, &String)| {
        let after = c.values.get(i).copied();
        let standard_error = c.standard_errors.get(i).copied().flatten();
        ParameterRow {
            name: name.clone(),
            before: c.start_values.get(i).copied(),
            after,
            standard_error,
            interval: after
                .zip(standard_error)
                .map(|(v, se)| derive::interval_95(v, se)),
        }
    };
    c.names.iter().enumerate().map(row).collect()
}

/// Analysis settings as (key, value as in a protocol, meaning).
pub(crate) fn settings(a: &Analysis) -> Vec<(String, String, &'static str)> {
    let given = a.settings.rows().into_iter();
    let given = given.filter(|row| !row.value.is_empty());
    given.map(|row| (row.key, row.value, row.doc)).collect()
}
