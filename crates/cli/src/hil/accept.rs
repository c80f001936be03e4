//! `skinrig hil accept`: records that an operator accepts a change, with a reason.

use std::path::Path;

use chrono::{SecondsFormat, Utc};
use skinrig_hil::history;
use skinrig_nightly::trend::{Acceptance, Filter};

use super::args::HilAcceptArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::host::user_name;

/// `skinrig hil accept`.
///
/// # Errors
/// [`Failure::input`] for a series or a night that the history does not have, or without a reason.
pub(crate) fn accept(args: &HilAcceptArgs, json: bool) -> Outcome {
    if args.reason.trim().is_empty() {
        return Err(Failure::input("--reason: expected a reason, found nothing"));
    }
    let filter = Filter {
        rig: args.rig.clone(),
        suite: args.suite.clone(),
        ..Filter::default()
    };
    let history = history::load(&args.history, &filter).map_err(Failure::input)?;
    let acceptance = Acceptance {
        series: args.series.clone(),
        night: args.night.clone(),
        reason: args.reason.trim().to_owned(),
        by: args.by.clone().unwrap_or_else(user_name),
        at: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
    };
    history::accept(&args.history, &history, &acceptance).map_err(Failure::input)?;
    if json {
        crate::terminal::print_json(&serde_json::to_value(&acceptance).map_err(Failure::internal)?);
    } else {
        outln!(
            "{}: the reference restarts at night {}",
            acceptance.series.as_deref().unwrap_or("all series"),
            acceptance.night
        );
    }
    if std::env::var_os("SKINRIG_CATALOGUE").is_some_and(|a| !a.is_empty()) {
        let folder = args.history.parent().filter(|f| !f.as_os_str().is_empty());
        errln!(
            "note: this is in {}; a catalogue knows of it after `skinrig catalogue register --nights {}`",
            args.history.display(),
            folder.unwrap_or(Path::new(".")).display()
        );
    }
    Ok(Exit::Ok)
}
