//! Owns the data tables of clocks, robot and tradeoff, for download from their figures.

use serde_json::{Value, json};
use skinrig_analysis::result::{ClockResiduals, Motion};
use skinrig_analysis::tradeoff::Tradeoff;

use super::table::{Table, rounded};
use crate::choices::label;
use crate::input::ReportInput;

/// All tables, by name.
pub(super) fn all(input: &ReportInput<'_>) -> Vec<(&'static str, Table)> {
    let a = input.analysis;
    let clocks = &a.alignment.residuals;
    let measured = input.tradeoff.as_ref().and_then(|t| t.as_ref().ok());
    let tables = [
        (
            "clock_residuals",
            (!clocks.is_empty()).then(|| residuals(clocks)),
        ),
        ("pose_course", a.motion.as_ref().map(course)),
        ("pose_presses", a.motion.as_ref().map(presses)),
        ("tradeoff", measured.map(|t| tradeoff(t))),
    ];
    let there = tables.into_iter();
    there.filter_map(|(name, t)| Some((name, t?))).collect()
}

fn residuals(maps: &[ClockResiduals]) -> Table {
    let points = || {
        maps.iter()
            .flat_map(|m| m.points.iter().map(move |p| (m, p)))
    };
    Table::new()
        .column("map", points().map(|(m, _)| json!(m.map.name())))
        .column("host_s", points().map(|(_, p)| rounded(Some(p.host_s), 3)))
        .column(
            "residual_us",
            points().map(|(_, p)| rounded(Some(p.residual_us), 3)),
        )
        .column("used", points().map(|(_, p)| json!(u8::from(p.used))))
}

fn course(motion: &Motion) -> Table {
    let bins = || motion.course.iter();
    Table::new()
        .column("bin_start_s", bins().map(|b| rounded(Some(b.start_s), 3)))
        .column("rms_mm", bins().map(|b| rounded(Some(b.rms_mm), 4)))
        .column("max_mm", bins().map(|b| rounded(Some(b.max_mm), 4)))
}

fn presses(motion: &Motion) -> Table {
    let samples = || {
        let presses = motion.presses.iter();
        presses.flat_map(|p| p.samples.iter().map(move |s| (p.press, s)))
    };
    let mut table = Table::new()
        .column("press", samples().map(|(p, _)| json!(p)))
        .column(
            "since_contact_s",
            samples().map(|(_, s)| rounded(Some(s.since_contact_s), 4)),
        );
    for (axis, name) in ["commanded_x_mm", "commanded_y_mm", "commanded_z_mm"]
        .into_iter()
        .enumerate()
    {
        table = table.column(
            name,
            samples().map(|(_, s)| rounded(Some(s.commanded_mm[axis]), 4)),
        );
    }
    for (axis, name) in ["measured_x_mm", "measured_y_mm", "measured_z_mm"]
        .into_iter()
        .enumerate()
    {
        table = table.column(
            name,
            samples().map(|(_, s)| rounded(Some(s.measured_mm[axis]), 4)),
        );
    }
    table
}

fn tradeoff(result: &Tradeoff) -> Table {
    let rows = || result.rows.iter();
    let flag = |yes: bool| -> Value { json!(u8::from(yes)) };
    Table::new()
        .column("choice", rows().map(|r| json!(label(&r.choice))))
        .column("rmse_mm", rows().map(|r| rounded(r.rmse_mm.value, 4)))
        .column("rmse_low_mm", rows().map(|r| rounded(r.rmse_mm.low, 4)))
        .column("rmse_high_mm", rows().map(|r| rounded(r.rmse_mm.high, 4)))
        .column(
            "located_rate",
            rows().map(|r| rounded(r.located_rate.value, 4)),
        )
        .column(
            "cpu_us_per_press",
            rows().map(|r| rounded(Some(r.cpu_us), 2)),
        )
        .column(
            "bytes_per_s",
            rows().map(|r| rounded(Some(r.bytes_per_s), 0)),
        )
        .column("delay_ms", rows().map(|r| rounded(Some(r.delay_ms), 2)))
        .column("competes", rows().map(|r| flag(r.competes)))
}
