//! Owns the data tables of the page (press table, tooltips, CSV downloads) and the small tables of settings and calibration.

mod events;
mod packing;
mod prediction;
mod studies;
mod table;
mod traces;
mod twin;

use serde_json::{Map, Value, json};
use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::{Analysis, CalibrationResult, PressResult, PressView};
use skinrig_analysis::tradeoff::Tradeoff;
use skinrig_model::PressId;
use skinrig_settings::Settings;

use crate::derive;
use crate::input::ReportInput;
pub(crate) use events::of_events;
pub(crate) use prediction::of_prediction;
pub(crate) use table::Table;
pub(crate) use twin::of_twin;

/// Data for the script: session ID and named tables.
pub(crate) fn script_data(input: &ReportInput<'_>) -> Value {
    let a = input.analysis;
    let own = [
        ("presses", presses(a)),
        ("locations", locations(a)),
        ("errors", errors(a)),
        ("rates", rates(a)),
        ("press_rates", press_rates(a)),
        ("pictures", pictures(a)),
        ("clocks", clocks(a)),
    ];
    let fit = a
        .calibration
        .as_ref()
        .map(|c| ("calibration", parameters(c)));
    let tables = own.into_iter().chain(fit).chain(studies::all(a));
    let tables = tables.chain(traces::all(input));
    let tables: Map<String, Value> = tables.map(|(name, t)| (name.to_owned(), t)).collect();
    json!({ "session": input.provenance.session_id, "tables": tables })
}

/// Data for the script of a tradeoff.
pub(crate) fn of_tradeoff(result: &Tradeoff, session: &str) -> Value {
    json!({ "session": session, "tables": { "tradeoff": traces::tradeoff(result) } })
}

fn parameters(c: &CalibrationResult) -> Value {
    Table::of(calibration(c))
        .any("parameter", |r| r.name.clone())
        .number("before", 6, |r| r.before)
        .number("after", 6, |r| r.after)
        .number("standard_error", 6, |r| r.standard_error)
        .number("low_95", 6, |r| r.interval.map(|i| i.0))
        .number("high_95", 6, |r| r.interval.map(|i| i.1))
        .finish()
}

/// Columns of one camera: events, ON events, clusters, centroid.
const VIEWS: [[&str; 5]; 2] = [
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

fn presses(a: &Analysis) -> Value {
    let mut table = Table::of(&a.presses)
        .any("press", |p| p.press)
        .any("role", |p| p.role)
        .any("repetition", |p| p.repetition)
        .any("location", |p| p.location)
        .any("verdict", |p| p.verdict)
        .any("outcome", |p| p.location_outcome.name())
        .number("planned_x_mm", 3, |p| p.planned.x_mm)
        .number("planned_y_mm", 3, |p| p.planned.y_mm)
        .number("depth_mm", 3, |p| p.depth_mm)
        .number("truth_x_mm", 3, |p| p.truth.map(|t| t.x_mm))
        .number("truth_y_mm", 3, |p| p.truth.map(|t| t.y_mm))
        .number("estimate_x_mm", 3, |p| p.estimate().map(|t| t.x_mm))
        .number("estimate_y_mm", 3, |p| p.estimate().map(|t| t.y_mm))
        .number("error_x_mm", 3, |p| p.error_mm().map(|e| e.0))
        .number("error_y_mm", 3, |p| p.error_mm().map(|e| e.1))
        .number("error_mm", 3, |p| derive::error_norm_mm(p))
        .number("contact_s", 4, |p| {
            p.timing.map(|t| t.contact.as_secs_f64())
        });
    for (camera, [events, on, clusters, u, v]) in VIEWS.into_iter().enumerate() {
        let view = |p: &&PressResult| -> Option<PressView> { p.views[camera] };
        table = table
            .any(events, |p| view(p).map(|v| v.events))
            .any(on, |p| view(p).map(|v| v.on_events))
            .any(clusters, |p| view(p).map(|v| v.clusters))
            .number(u, 2, |p| view(p).and_then(|v| v.centroid_u))
            .number(v, 2, |p| view(p).and_then(|v| v.centroid_v));
    }
    table
        .flag("counted", |p| derive::is_counted(p))
        .any("rule", |p| p.cause.as_ref().map(Exclusion::label))
        .any("reason", |p| p.reason())
        .finish()
}

/// The errors behind the distribution, ascending.
fn errors(a: &Analysis) -> Value {
    let counted = a.presses.iter().filter(|p| derive::is_counted(p));
    let mut rows: Vec<(f64, PressId)> = counted
        .filter_map(|p| Some((derive::error_norm_mm(p)?, p.press)))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    Table::of(rows)
        .any("press", |(_, press)| *press)
        .number("error_mm", 4, |(error, _)| *error)
        .finish()
}

fn locations(a: &Analysis) -> Value {
    Table::of(derive::locations(a))
        .any("location", |l| l.location)
        .number("planned_x_mm", 3, |l| l.planned.x_mm)
        .number("planned_y_mm", 3, |l| l.planned.y_mm)
        .any("presses", |l| l.n)
        .number("mean_error_mm", 4, |l| l.mean_error_mm)
        .number("std_between_repetitions_mm", 4, |l| l.std_mm)
        .finish()
}

fn rates(a: &Analysis) -> Value {
    let series = a.rates.iter().enumerate();
    let bins = series.flat_map(|(i, s)| (0..s.mean_per_s.len()).map(move |k| (i + 1, s, k)));
    Table::of(bins)
        .any("camera", |(camera, ..)| *camera)
        .number("bin_start_s", 3, |(_, s, k)| {
            s.start_s + s.bin_s * *k as f64
        })
        .number("mean_events_per_s", 0, |(_, s, k)| {
            f64::from(s.mean_per_s[*k])
        })
        .number("peak_events_per_s", 0, |(_, s, k)| {
            s.peak_per_s.get(*k).map(|p| f64::from(*p))
        })
        .finish()
}

fn press_rates(a: &Analysis) -> Value {
    let bins = a.zooms.iter().flat_map(|z| {
        let bins = z.on_per_s.len().max(z.off_per_s.len());
        (0..bins).map(move |k| (z, k))
    });
    let at = |v: &[f32], k: usize| v.get(k).map(|r| f64::from(*r));
    Table::of(bins)
        .any("press", |(z, _)| z.press)
        .any("camera", |(z, _)| z.camera.number())
        .number("since_contact_s", 4, |(z, k)| {
            z.start_s + z.bin_s * *k as f64
        })
        .number("on_events_per_s", 0, |(z, k)| at(&z.on_per_s, *k))
        .number("off_events_per_s", 0, |(z, k)| at(&z.off_per_s, *k))
        .finish()
}

/// Maximum number of presses shown as images.
pub(crate) const PICTURED_PRESSES: usize = 6;

fn pictures(a: &Analysis) -> Value {
    let shown = pictured(a);
    let pictures = a.pictures.iter().filter(|p| shown.contains(&p.press));
    Table::of(pictures.flat_map(|p| p.pixels.iter().map(move |q| (p, q))))
        .any("press", |(p, _)| p.press)
        .any("camera", |(p, _)| p.camera.number())
        .any("u_px", |(_, q)| q.u)
        .any("v_px", |(_, q)| q.v)
        .any("on_events", |(_, q)| q.on)
        .any("off_events", |(_, q)| q.off)
        .flag("in_cluster", |(_, q)| q.clustered)
        .finish()
}

/// The first presses (by number) with images.
pub(crate) fn pictured(a: &Analysis) -> Vec<PressId> {
    let mut presses: Vec<PressId> = a.pictures.iter().map(|p| p.press).collect();
    presses.sort_unstable();
    presses.dedup();
    presses.truncate(PICTURED_PRESSES);
    presses
}

fn clocks(a: &Analysis) -> Value {
    let fits = a.clocks.iter().enumerate();
    Table::of(fits.filter_map(|(i, c)| Some((i + 1, (*c)?))))
        .any("camera", |(camera, _)| *camera)
        .any("method", |(_, c)| c.method)
        .number("offset_us", 3, |(_, c)| c.offset_us)
        .number("drift_ppm", 6, |(_, c)| c.drift_ppm)
        .number("drift_se_ppm", 6, |(_, c)| c.drift_se_ppm)
        .number("residual_rms_us", 4, |(_, c)| c.residual_rms_us)
        .number("residual_max_us", 4, |(_, c)| c.residual_max_us)
        .any("n", |(_, c)| c.n)
        .any("rejected", |(_, c)| c.rejected)
        .finish()
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
