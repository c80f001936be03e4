//! Owns the section of the session itself: clocks, alignment, robot, devices, preflight, settings.

use skinrig_analysis::result::{Analysis, ClockFit};

use super::alignment;
use super::cells::missing;
use crate::document::{Block, Fact, Group, Row, Section, Table, Text, soft};
use crate::format::{NONE, digits_of_error, number, phrase};
use crate::input::ReportInput;
use crate::provenance::Provenance;
use crate::terminal::clock_method;
use crate::{figures, tables};

/// The section; an invalid session has it in full, because it explains why.
pub(super) fn session(input: &ReportInput<'_>) -> Section {
    let (a, p) = (input.analysis, &input.provenance);
    let residuals = figures::clock_residuals(input).map(Block::from);
    let residuals = residuals.unwrap_or_else(|| {
        let why =
            "No clock residuals: the session has no trigger box reports, or none that a map fits.";
        missing("no-clock-residuals", why)
    });
    let pose = figures::pose_course(input).map(Block::from);
    let pose = pose
        .unwrap_or_else(|| missing("no-pose", "No robot poses: the session has no pose stream."));
    let preflight = (!p.preflight.is_empty()).then(|| {
        let n = p.preflight.len();
        Group::folded(format!(
            "Preflight: {n} checks before the robot was powered"
        ))
        .with(preflight(p))
    });
    let settings = tables::settings(a)
        .into_iter()
        .map(|(key, value, doc)| Fact::new(key, Text::new().code(value)).title(doc));
    let settings = Group::folded("Analysis settings").with(Block::Facts(settings.collect()));
    let about = Group::card()
        .with_all((!p.devices.is_empty()).then(|| devices(p)))
        .with_all(preflight)
        .with(settings);
    Section::new("session", "Session")
        .test_id("session")
        .with(Group::two().with(clocks(a)))
        .with_all(alignment::maps(a).map(Table::card))
        .with(residuals)
        .with_all(alignment::lines(a).map(Table::card))
        .with(pose)
        .with_all(figures::pose_presses(input))
        .with(about)
}

fn clocks(a: &Analysis) -> Group {
    let columns: Vec<String> = (1..=a.clocks.len())
        .map(|k| format!("#camera {k}"))
        .collect();
    let columns: Vec<&str> = [""]
        .into_iter()
        .chain(columns.iter().map(String::as_str))
        .collect();
    let row = |name: &str, missing: &str, cell: &dyn Fn(&ClockFit) -> String| {
        let cells = a.clocks.iter();
        let cells = cells.map(|fit| fit.as_ref().map_or_else(|| missing.to_owned(), cell));
        Row::new([name.to_owned()].into_iter().chain(cells))
    };
    let drift = |c: &ClockFit| {
        let digits = digits_of_error(c.drift_se_ppm);
        let [drift, error] = [c.drift_ppm, c.drift_se_ppm].map(|v| number(Some(v), digits));
        format!("{drift} ± {error}")
    };
    let rows = [
        row("found from", "not aligned", &|c| {
            clock_method(c.method).to_owned()
        }),
        row("drift (ppm)", NONE, &drift),
        row("offset (µs)", NONE, &|c| number(Some(c.offset_us), 1)),
        row("residual, rms (µs)", NONE, &|c| {
            number(Some(c.residual_rms_us), 2)
        }),
        row("residual, largest (µs)", NONE, &|c| {
            number(Some(c.residual_max_us), 2)
        }),
        row("points used (rejected)", NONE, &|c| {
            format!("{} ({})", c.n, c.rejected)
        }),
    ];
    let caption = "Clock fit of each camera against the host clock";
    let table = Table::new("clock-fits", caption, &columns).with(rows);
    Group::titled("Clock fits")
        .test_id("clocks")
        .download("clock-fits", "clocks", "the clock fits")
        .with(table)
        .with(soft(
            "camera time = offset + (1 + drift) × host time; ± is one standard error.",
        ))
}

fn devices(p: &Provenance) -> Table {
    let columns = ["Role", "Model", "Serial", "Firmware"];
    let rows = p.devices.iter().map(|d| {
        Row::new([
            phrase(&d.role).into(),
            Text::from(&*d.model),
            Text::new().code(&*d.serial),
            d.firmware.clone().into(),
        ])
    });
    let table = Table::new("devices", "Devices", &columns);
    table.class("devices").with(rows)
}

fn preflight(p: &Provenance) -> Table {
    let columns = ["Check", "Expected", "Found", "Verdict"];
    let rows = p.preflight.iter().map(|c| {
        let found = match &*c.next_step {
            "" => c.found.clone(),
            next => format!("{}; {next}", c.found),
        };
        let verdict = c.verdict.name().to_owned();
        Row::new([c.check.clone(), c.expected.clone(), found, verdict])
    });
    let table = Table::new("preflight", "Preflight", &columns);
    table.class("devices").with(rows)
}
