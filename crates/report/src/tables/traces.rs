//! Owns the data tables of clocks, robot and tradeoff, for download from their figures.

use serde_json::Value;
use skinrig_analysis::result::{ClockResiduals, Motion};
use skinrig_analysis::tradeoff::Tradeoff;

use super::table::Table;
use crate::choices::label;
use crate::input::ReportInput;

/// All tables, by name.
pub(super) fn all(input: &ReportInput<'_>) -> Vec<(&'static str, Value)> {
    let a = input.analysis;
    let clocks = Some(&a.alignment.residuals).filter(|maps| !maps.is_empty());
    let measured = input.tradeoff.as_ref().and_then(|t| t.as_ref().ok());
    let tables = [
        ("clock_residuals", clocks.map(|maps| residuals(maps))),
        ("pose_course", a.motion.as_ref().map(course)),
        ("pose_presses", a.motion.as_ref().map(presses)),
        ("tradeoff", measured.map(|t| tradeoff(t))),
    ];
    let there = tables.into_iter();
    there.filter_map(|(name, t)| Some((name, t?))).collect()
}

fn residuals(maps: &[ClockResiduals]) -> Value {
    let points = maps
        .iter()
        .flat_map(|m| m.points.iter().map(move |p| (m, p)));
    Table::of(points)
        .any("map", |(m, _)| m.map.name())
        .number("host_s", 3, |(_, p)| p.host_s)
        .number("residual_us", 3, |(_, p)| p.residual_us)
        .flag("used", |(_, p)| p.used)
        .finish()
}

fn course(motion: &Motion) -> Value {
    Table::of(&motion.course)
        .number("bin_start_s", 3, |b| b.start_s)
        .number("rms_mm", 4, |b| b.rms_mm)
        .number("max_mm", 4, |b| b.max_mm)
        .finish()
}

fn presses(motion: &Motion) -> Value {
    let presses = motion.presses.iter();
    let samples = presses.flat_map(|p| p.samples.iter().map(move |s| (p.press, s)));
    Table::of(samples)
        .any("press", |(p, _)| *p)
        .number("since_contact_s", 4, |(_, s)| s.since_contact_s)
        .number("commanded_x_mm", 4, |(_, s)| s.commanded_mm[0])
        .number("commanded_y_mm", 4, |(_, s)| s.commanded_mm[1])
        .number("commanded_z_mm", 4, |(_, s)| s.commanded_mm[2])
        .number("measured_x_mm", 4, |(_, s)| s.measured_mm[0])
        .number("measured_y_mm", 4, |(_, s)| s.measured_mm[1])
        .number("measured_z_mm", 4, |(_, s)| s.measured_mm[2])
        .finish()
}

pub(super) fn tradeoff(result: &Tradeoff) -> Value {
    Table::of(&result.rows)
        .any("choice", |r| label(&r.choice))
        .estimate(["rmse_mm", "rmse_low_mm", "rmse_high_mm"], 4, |r| {
            &r.rmse_mm
        })
        .number("located_rate", 4, |r| r.located_rate.value)
        .number("cpu_us_per_press", 2, |r| r.cpu_us)
        .number("bytes_per_s", 0, |r| r.bytes_per_s)
        .number("delay_ms", 2, |r| r.delay_ms)
        .number("pixels", 0, |r| f64::from(r.pixels))
        .flag("competes", |r| r.competes)
        .finish()
}
