//! Owns the alarms of a running session, the gravest first.

use serde::Serialize;
use skinrig_analysis::Analysis;
use skinrig_model::InterruptionKind;

use super::snapshot::SessionSnapshot;
use crate::lab::RunState;

/// Less free space than this is an alarm, bytes.
const LOW_DISK_BYTES: u64 = 2_000_000_000;
/// So many invalid attempts in a row are an alarm.
const FAILURES: usize = 3;

/// Something that the operator should look at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Alarm {
    /// `bad` or `warn`.
    pub level: &'static str,
    /// Found and expected.
    pub text: String,
}

/// The alarms at this moment.
pub(super) fn alarms(
    is_written: bool,
    run: Option<&RunState>,
    snapshot: &SessionSnapshot,
    analysis: Option<&Analysis>,
    free_bytes: Option<u64>,
) -> Vec<Alarm> {
    let mut all = Vec::new();
    let mut add = |level, text| all.push(Alarm { level, text });
    if is_written && run.is_none() {
        add(
            "bad",
            "the program that writes this session does not answer".to_owned(),
        );
    }
    for (k, file) in snapshot.lost_bytes().into_iter().enumerate() {
        // The run may have lost bytes that are not in the file yet.
        let lost = run.map_or(file, |run| file.max(run.lost_bytes[k]));
        if lost > 0 {
            add("bad", format!("camera {}: {lost} bytes lost", k + 1));
        }
    }
    // What the operator asked for is no alarm.
    let faults = snapshot.interruptions().iter();
    let mut faults = faults.filter(|i| i.kind == InterruptionKind::Fault);
    if let Some(last) = faults.next_back() {
        let t = last.t.as_secs_f64();
        add("warn", format!("fault at {t:.1} s: {}", last.reason));
    }
    let failures = snapshot.failures_in_a_row();
    if failures >= FAILURES {
        add("bad", format!("the last {failures} attempts were invalid"));
    }
    for why in analysis.iter().flat_map(|a| &a.alignment.violations) {
        add("bad", format!("clock certificate: {why}"));
    }
    if let Some(free) = free_bytes.filter(|free| *free < LOW_DISK_BYTES) {
        let gigabytes = free as f64 / 1e9;
        add(
            "bad",
            format!("disk: expected at least 2 GB free, found {gigabytes:.2} GB"),
        );
    }
    all.sort_by_key(|alarm| alarm.level != "bad");
    all
}
