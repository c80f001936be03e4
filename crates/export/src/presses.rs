//! The tidy table of presses: one row per planned press, with its last attempt and the views of both cameras.

use skinrig_analysis::result::{ClockFit, PressIndentation, PressResult, PressView, Ranged};
use skinrig_model::{HostTime, PlannedPress, PressTiming};
use skinrig_recorder::AttemptRow;

use crate::error::ExportError;
use crate::source::{Source, TableName};
use crate::table::{Table, Values};

/// A press with all its data.
struct Row<'a> {
    planned: PlannedPress,
    attempts: Vec<AttemptRow>,
    found: Option<&'a PressResult>,
    indentation: Option<&'a PressIndentation>,
    /// Not made yet, in a session without an end.
    is_open: bool,
}

impl Row<'_> {
    fn last(&self) -> Option<&skinrig_model::PressOutcome> {
        self.attempts.last()?.outcome.as_ref()
    }

    fn moment(&self, of: impl Fn(&PressTiming) -> HostTime) -> f64 {
        let timing = self.last().and_then(|o| o.timing);
        timing.map_or(f64::NAN, |t| of(&t).as_secs_f64())
    }

    fn view(&self, camera: usize) -> Option<&PressView> {
        self.found?.views[camera].as_ref()
    }
}

/// Builds columns from rows.
struct Columns<'a> {
    rows: Vec<Row<'a>>,
    columns: Vec<(String, Values)>,
}

impl Columns<'_> {
    fn int(&mut self, name: &str, of: impl Fn(&Row<'_>) -> i64) {
        let values = self.rows.iter().map(of).collect();
        self.columns.push((name.to_owned(), Values::Int(values)));
    }

    fn count(&mut self, name: &str, of: impl Fn(&Row<'_>) -> Option<i64>) {
        let values = self.rows.iter().map(of).collect();
        self.columns.push((name.to_owned(), Values::Count(values)));
    }

    fn real(&mut self, name: &str, of: impl Fn(&Row<'_>) -> Option<f64>) {
        let values = self.rows.iter().map(|row| of(row).unwrap_or(f64::NAN));
        self.columns
            .push((name.to_owned(), Values::Real(values.collect())));
    }

    fn text(&mut self, name: &str, of: impl Fn(&Row<'_>) -> Option<String>) {
        let values = self.rows.iter().map(of).collect();
        self.columns.push((name.to_owned(), Values::Text(values)));
    }
}

/// Builds the table of a session.
pub(crate) fn table(source: &Source<'_>) -> Result<Table, ExportError> {
    let session_id = source.reader.session_id()?;
    let prototype = source.header.prototype.clone();
    let found = source.analysis.map(|(analysis, _)| &analysis.presses);
    let rows = source.reader.presses()?.into_iter().enumerate();
    let indented = source.analysis.and_then(|(a, _)| a.indentation.as_ref());
    let is_under_way = source.reader.end()?.is_none();
    let rows = rows.map(|(i, (planned, attempts))| Row {
        is_open: is_under_way && attempts.last().is_none_or(|a| a.outcome.is_none()),
        indentation: indented.and_then(|all| all.of(planned.id)),
        planned,
        attempts,
        // In plan order, like the presses.
        found: found.and_then(|all| all.get(i)),
    });
    let mut table = Columns {
        rows: rows.collect(),
        columns: Vec::new(),
    };
    table.text("session_id", |_| Some(session_id.clone()));
    table.text("prototype", |_| Some(prototype.clone()));
    journal(&mut table);
    outcome(&mut table);
    for camera in 0..2 {
        view(&mut table, source, camera);
    }
    Ok(Table {
        name: TableName::Presses.name(),
        columns: table.columns,
    })
}

/// Columns on plan and execution.
fn journal(table: &mut Columns<'_>) {
    table.int("press", |r| i64::from(r.planned.id.number()));
    table.text("role", |r| Some(r.planned.role.name().to_owned()));
    table.int("repetition", |r| i64::from(r.planned.repetition.number()));
    table.int("location", |r| i64::from(r.planned.location.number()));
    table.real("x_mm", |r| Some(r.planned.at.x_mm));
    table.real("y_mm", |r| Some(r.planned.at.y_mm));
    table.real("depth_mm", |r| Some(r.planned.depth_mm));
    table.int("attempts", |r| r.attempts.len() as i64);
    // An analysis excludes presses by its own rules.
    table.text("verdict", |r| {
        if r.is_open {
            return Some("open".to_owned());
        }
        let recorded = r.last().map_or("open", |o| o.verdict.name());
        let found = r.found.map_or(recorded, |f| f.verdict.name());
        Some(found.to_owned())
    });
    table.text("reason", |r| match r.found.filter(|_| !r.is_open) {
        Some(found) => found.reason(),
        None => r.last()?.verdict.reason(),
    });
    table.text("truth_source", |r| {
        let scheduled = r.last()?.scheduled;
        Some(if scheduled { "scheduled" } else { "measured" }.to_owned())
    });
    table.real("approach_s", |r| Some(r.moment(|t| t.approach)));
    table.real("contact_s", |r| Some(r.moment(|t| t.contact)));
    table.real("at_depth_s", |r| Some(r.moment(|t| t.at_depth)));
    table.real("retract_s", |r| Some(r.moment(|t| t.retract)));
    table.real("release_s", |r| Some(r.moment(|t| t.release)));
    table.real("clear_s", |r| Some(r.moment(|t| t.clear)));
    table.real("measured_x_mm", |r| Some(r.last()?.measured_at?.x_mm));
    table.real("measured_y_mm", |r| Some(r.last()?.measured_at?.y_mm));
    table.real("measured_depth_mm", |r| r.last()?.measured_depth_mm);
    table.real("touched_mm", |r| r.last()?.touched_mm);
    table.real("peak_force_n", |r| r.last()?.peak_force_n);
}

/// Columns on the estimated location.
fn outcome(table: &mut Columns<'_>) {
    table.text("outcome", |r| {
        Some(r.found?.location_outcome.name().to_owned())
    });
    table.real("estimate_x_mm", |r| Some(r.found?.estimate()?.x_mm));
    table.real("estimate_y_mm", |r| Some(r.found?.estimate()?.y_mm));
    table.real("error_x_mm", |r| Some(r.found?.error_mm()?.0));
    table.real("error_y_mm", |r| Some(r.found?.error_mm()?.1));
    table.real("error_mm", |r| {
        let (x, y) = r.found?.error_mm()?;
        Some(libm::hypot(x, y))
    });
    table.real("ray_sine", |r| r.found?.location_outcome.sine());
    let region = |r: &Row<'_>| r.found?.region;
    table.real("region_major_mm", |r| Some(region(r)?.semi_axes_mm[0]));
    table.real("region_minor_mm", |r| Some(region(r)?.semi_axes_mm[1]));
    table.real("region_angle_deg", |r| Some(region(r)?.angle_deg));
    table.count("extrapolated", |r| {
        let found = r.found.filter(|f| f.estimate().is_some())?;
        Some(i64::from(found.extrapolated))
    });
    ranged(table, "estimate_depth", "mm", |p| p.depth_mm);
    ranged(table, "estimate_force", "n", |p| p.force_n);
    table.real("rest_mm", |r| r.indentation?.rest_mm);
}

/// An estimate and its 95 % interval.
fn ranged(
    table: &mut Columns<'_>,
    name: &str,
    unit: &str,
    of: impl Fn(&PressIndentation) -> Option<Ranged>,
) {
    let own = |r: &Row<'_>| of(r.indentation?);
    table.real(&format!("{name}_{unit}"), |r| Some(own(r)?.value));
    let ends = |r: &Row<'_>| own(r)?.interval;
    table.real(&format!("{name}_low_{unit}"), |r| Some(ends(r)?[0]));
    table.real(&format!("{name}_high_{unit}"), |r| Some(ends(r)?[1]));
}

/// Columns on the view of a camera.
fn view(table: &mut Columns<'_>, source: &Source<'_>, camera: usize) {
    let name = |what: &str| format!("camera{}_{what}", camera + 1);
    let clock = source
        .analysis
        .and_then(|(analysis, _)| analysis.clocks[camera]);
    let on_camera = |r: &Row<'_>, of: fn(&PressTiming) -> HostTime| {
        let t = of(&r.last()?.timing?);
        Some(recorded_us(source, &clock?, camera, t))
    };
    table.real(&name("contact_us"), |r| on_camera(r, |t| t.contact));
    table.real(&name("release_us"), |r| on_camera(r, |t| t.release));
    let count = |r: &Row<'_>, of: fn(&PressView) -> u32| r.view(camera).map(|v| i64::from(of(v)));
    table.count(&name("events"), |r| count(r, |v| v.events));
    table.count(&name("on_events"), |r| count(r, |v| v.on_events));
    table.count(&name("clusters"), |r| count(r, |v| v.clusters));
    table.count(&name("cluster_events"), |r| count(r, |v| v.cluster_events));
    table.real(&name("centroid_u_px"), |r| r.view(camera)?.centroid_u);
    table.real(&name("centroid_v_px"), |r| r.view(camera)?.centroid_v);
    table.real(&name("rate_per_s"), |r| Some(r.view(camera)?.rate_per_s));
    // Without idle time before the press there is no idle rate.
    table.real(&name("idle_rate_per_s"), |r| {
        let view = r.view(camera)?;
        (view.idle_s > 0.0).then_some(view.idle_rate_per_s)
    });
}

/// Converts a host time to the recorded clock of `camera`. The analysis shifts later legs onto the
/// clock of the first, which this undoes.
pub(crate) fn recorded_us(
    source: &Source<'_>,
    clock: &ClockFit,
    camera: usize,
    t: HostTime,
) -> f64 {
    let legs = source.analysis.map_or(&[][..], |(_, legs)| legs);
    let leg = legs.iter().rev().find(|leg| leg.origin <= t);
    let moved_us = leg.map_or(0, |leg| leg.moved_us[camera]);
    clock.camera_us_of_host(t) - moved_us as f64
}
