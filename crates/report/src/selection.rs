//! Texts about the selection behind a result: what it excludes, and the RMSE without it.

use std::collections::BTreeSet;

use skinrig_analysis::result::Estimate;

use crate::format::{interval, number};
use crate::input::ReportInput;

/// The selection and what it excludes, in words; `None` for a result without one.
pub(crate) fn headline(input: &ReportInput<'_>) -> Option<String> {
    let name = input.provenance.variant.as_ref()?.selection.as_ref()?;
    let out = &input.analysis.settings.selected_out;
    let people: BTreeSet<&str> = out.iter().map(|s| s.why.decided_by.as_str()).collect();
    let people: Vec<&str> = people.into_iter().collect();
    Some(match out.len() {
        0 => format!("{name} excludes no press"),
        1 => format!("{name} excludes 1 press, decided by {}", people.join(", ")),
        n => format!(
            "{name} excludes {n} presses, decided by {}",
            people.join(", ")
        ),
    })
}

/// RMSE of the scored presses without the selection.
pub(crate) fn rmse_without<'a>(input: &'a ReportInput<'_>) -> Option<&'a Estimate> {
    let effect = input.provenance.selection.as_ref()?;
    input.analysis.is_valid().then_some(&effect.rmse_without_mm)
}

/// The same in words.
pub(crate) fn without(input: &ReportInput<'_>) -> Option<String> {
    let rmse = rmse_without(input)?;
    Some(format!(
        "{} mm without the selection, 95 % interval {}, n {} presses",
        number(rmse.value, 2),
        interval(rmse, 1.0, 2),
        rmse.n
    ))
}
