//! Verification of legs: each starts after the previous one on every clock and contains only its own records.

use skinrig_model::{BoxReport, CameraId, HostTime};

use super::report::VerifyReport;
use crate::error::RecorderError;
use crate::reader::SessionReader;
use crate::rows::LegRow;

/// Checks the order of the legs, and that attempts and chunks lie within their leg.
pub(super) fn check(reader: &SessionReader, report: &mut VerifyReport) {
    // Another check reports a missing header.
    let Ok(legs) = reader.legs() else { return };
    if legs.len() == 1 {
        return;
    }
    let result = order(&legs, report)
        .and_then(|()| chunks(reader, &legs, report))
        .and_then(|()| attempts(reader, &legs, report))
        .and_then(|()| resets(reader, &legs, report));
    report.ok_or_add(result);
}

fn order(legs: &[LegRow], report: &mut VerifyReport) -> Result<(), RecorderError> {
    for (number, pair) in (2u32..).zip(legs.windows(2)) {
        let [before, leg] = pair else { continue };
        let place = format!("leg {}", leg.number);
        report.expect_equal("leg", &number, &leg.number);
        let end = before.end.as_ref().map_or(before.origin, |(t, _)| *t);
        if leg.origin <= end.max(before.origin) {
            report.mismatch(&place, format!("it to begin after {end}"), leg.origin);
        }
        let earlier = |before: [u64; 2], now: [u64; 2]| before[0] > now[0] || before[1] > now[1];
        if earlier(before.camera_origin_us, leg.camera_origin_us)
            || earlier(before.first_seq, leg.first_seq)
            || before.devices_before > leg.devices_before
            || before.preflight_before > leg.preflight_before
        {
            report.mismatch(
                place,
                "origins at or after those of the previous leg",
                "earlier ones",
            );
        }
    }
    Ok(())
}

fn chunks(
    reader: &SessionReader,
    legs: &[LegRow],
    report: &mut VerifyReport,
) -> Result<(), RecorderError> {
    for camera in CameraId::ALL {
        let k = camera.index();
        for meta in reader.chunk_index(camera)? {
            let after = legs.partition_point(|leg| leg.first_seq[k] <= meta.seq);
            let Some(leg) = legs.get(after - 1) else {
                continue;
            };
            let next = legs.get(after);
            let host =
                leg.origin <= meta.host_time && next.is_none_or(|n| meta.host_time < n.origin);
            let camera_time = [meta.facts.first_us, meta.facts.last_us]
                .into_iter()
                .flatten()
                .all(|t| {
                    leg.camera_origin_us[k] <= t && next.is_none_or(|n| t < n.camera_origin_us[k])
                });
            if !host || !camera_time {
                report.mismatch(
                    format!("{camera} chunk {}", meta.seq),
                    format!("times within leg {}", leg.number),
                    "times outside",
                );
            }
        }
    }
    Ok(())
}

/// Each attempt belongs to one leg, which is never earlier than that of the previous attempt.
fn attempts(
    reader: &SessionReader,
    legs: &[LegRow],
    report: &mut VerifyReport,
) -> Result<(), RecorderError> {
    let leg_at = |t: HostTime| legs.partition_point(|leg| leg.origin <= t);
    for (_, attempts) in reader.presses()? {
        let mut last = None;
        for attempt in attempts {
            let timing = attempt.outcome.as_ref().and_then(|o| o.timing);
            if let (Some(intent), Some(timing)) = (attempt.intent, timing)
                && leg_at(intent) != leg_at(timing.clear)
            {
                let leg = leg_at(intent);
                report.mismatch(
                    attempt.id,
                    format!("phase times within leg {leg}"),
                    "times outside",
                );
            }
            if attempt.intent < last && attempt.intent.is_some() {
                report.mismatch(
                    attempt.id,
                    "it to begin after the previous attempt",
                    "earlier",
                );
            }
            last = attempt.intent.or(last);
        }
    }
    Ok(())
}

/// The box's clock restarts with each leg. Without a reset between legs, the time base would join the two clocks.
fn resets(
    reader: &SessionReader,
    legs: &[LegRow],
    report: &mut VerifyReport,
) -> Result<(), RecorderError> {
    let reports = reader.box_reports()?;
    for leg in &legs[1..] {
        let reset = BoxReport::Reset {
            noticed: leg.origin,
        };
        if !reports.iter().any(|(_, output)| *output == reset) {
            report.mismatch(
                format!("leg {}", leg.number),
                "a reset of the box's clock at its origin",
                "none",
            );
        }
    }
    Ok(())
}
