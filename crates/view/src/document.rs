//! Owns the answer that describes one session: everything the page needs but events and poses.

use serde_json::{Value, json};
use skinrig_analysis::result::{Analysis, PressResult};
use skinrig_model::{CameraId, PlannedPress, PressOutcome, PressTiming, StereoGeometry};
use skinrig_recorder::{AttemptRow, ChunkMeta, writer_of};
use skinrig_results::Origin;

use crate::folder::name_of;
use crate::lab::Lab;
use crate::open_session::OpenSession;
use crate::problem::Problem;

/// Segments of each arc of the outline.
const ARC_SEGMENTS: u32 = 12;
/// Bins of the event rates under the time slider.
const RATE_BINS: usize = 240;

/// The session, its presses, marks, notes and losses, and its analysis as far as there is one.
pub(crate) fn document(lab: &dyn Lab, opened: &OpenSession) -> Result<Value, Problem> {
    let known = &opened.known;
    let header = &known.header;
    let reader = &opened.reader;
    let analysis = known.analysis.as_ref();
    let (from_s, to_s) = known.span_s();
    let outline = known.rig.geometry.outline.polygon(ARC_SEGMENTS);
    let geometry = analysis.map_or(&known.rig.geometry.nominal, |a| &a.geometry);
    let end = reader.end()?;
    let notes = reader.notes()?.into_iter();
    let interruptions = reader.interruptions()?.into_iter();
    let marks = reader.marks_sent()?.into_iter();
    let touches = reader.touches()?.into_iter();
    let devices = reader.devices()?.into_iter().map(|d| {
        json!({
            "role": d.role.name(), "model": d.identity.model, "serial": d.identity.serial,
            "firmware": d.identity.firmware,
        })
    });
    let losses: Vec<u64> = known
        .chunks
        .iter()
        .map(|chunks| chunks.iter().map(|c| c.lost_before).sum())
        .collect();
    let (tally, _) = reader.tallies()?;
    Ok(json!({
        "name": name_of(&opened.path),
        "path": opened.path,
        "session_id": known.session_id,
        "started_at": header.started_at,
        "prototype": header.prototype,
        "operator": header.operator,
        "protocol": header.protocol_name,
        "overrides": header.overrides,
        "rig": header.rig_name,
        "origin": Origin::of(header).map(Origin::name),
        "software": header.software,
        "sealed": known.is_sealed,
        "writer": writer_of(&opened.path),
        "end": end.as_ref().map(|(_, end)| end.name()),
        "end_reason": end.as_ref().and_then(|(_, end)| end.reason()),
        "legs": known.legs.iter().map(|leg| leg.origin.as_secs_f64()).collect::<Vec<_>>(),
        "span_s": [from_s, to_s],
        "tally": tally,
        "outline_mm": outline.iter().map(|p| [p.x_mm, p.y_mm]).collect::<Vec<_>>(),
        "cameras": cameras(geometry),
        "clocks_measured": known.clocks.each_ref().map(|c| c.as_ref().is_some_and(|c| c.is_measured())),
        "presses": presses(&known.presses, analysis, geometry),
        "marks": marks.map(|m| json!([m.t.as_secs_f64(), m.mark.kind.name(), m.mark.press.number()])).collect::<Vec<_>>(),
        "touches": touches.map(|t| json!([t.t.as_secs_f64(), t.kind, t.at_mm, t.region, t.depth])).collect::<Vec<_>>(),
        "notes": notes.map(|n| json!([n.t.as_secs_f64(), n.text])).collect::<Vec<_>>(),
        "interruptions": interruptions.map(|i| json!([i.t.as_secs_f64(), i.kind.name(), i.reason.to_string()])).collect::<Vec<_>>(),
        "devices": devices.collect::<Vec<_>>(),
        "lost_bytes": losses,
        "rates": known.chunks.each_ref().map(|chunks| rates(chunks, to_s)),
        "analyses": lab.analyses(&opened.path, &known.session_id),
        "analysis": analysis.map(summary),
    }))
}

/// Position of each camera, skin frame, mm.
fn cameras(geometry: &StereoGeometry) -> Value {
    let each = geometry.cameras.each_ref();
    json!(each.map(|c| [c.position.x_mm, c.position.y_mm]))
}

/// The analysis in short.
pub(crate) fn summary(analysis: &Analysis) -> Value {
    let e = analysis.scored.rmse_mm;
    let findings = analysis.findings.iter();
    json!({
        "valid": analysis.is_valid(),
        "invalid_because": analysis.invalid_because(),
        "rmse_mm": [e.value, e.low, e.high],
        "n": e.n,
        "calibrated": analysis.calibration.is_some(),
        "within_mm": analysis.settings.within_mm,
        "certificate": {
            "status": analysis.alignment.status,
            "violations": analysis.alignment.violations,
            "maps": analysis.alignment.maps,
        },
        "findings": findings.map(|f| serde_json::to_value(f).unwrap_or_default()).collect::<Vec<_>>(),
        "warnings": analysis.warnings,
    })
}

/// One row per planned press, with the views and rays of its analysis.
pub(crate) fn presses(
    rows: &[(PlannedPress, Vec<AttemptRow>)],
    analysis: Option<&Analysis>,
    geometry: &StereoGeometry,
) -> Vec<Value> {
    // Results have one row per planned press, in the same order; those of a growing session may be older than the row.
    let found = |n: usize, planned: &PlannedPress, attempts: &[AttemptRow]| {
        let row = analysis?.presses.get(n)?;
        let timing = attempts.last()?.outcome.as_ref()?.timing;
        (row.press == planned.id && row.timing == timing).then_some(row)
    };
    let rows = rows.iter().enumerate();
    rows.map(|(n, (planned, attempts))| {
        press(planned, attempts, found(n, planned, attempts), geometry)
    })
    .collect()
}

fn press(
    planned: &PlannedPress,
    attempts: &[AttemptRow],
    found: Option<&PressResult>,
    geometry: &StereoGeometry,
) -> Value {
    let outcome = attempts.last().and_then(|a| a.outcome.as_ref());
    let timing = |t: &PressTiming| {
        [
            t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
        ]
        .map(|t| t.as_secs_f64())
    };
    let measured = outcome.and_then(|o: &PressOutcome| o.measured_at);
    let recorded = outcome.map(|o| (o.verdict.name(), o.verdict.reason()));
    let verdict = found.map(|f| f.verdict.name());
    let mut value = json!({
        "press": planned.id.number(),
        "role": planned.role.name(),
        "repetition": planned.repetition.number(),
        "location": planned.location.number(),
        "at_mm": [planned.at.x_mm, planned.at.y_mm],
        "depth_mm": planned.depth_mm,
        "attempts": attempts.len(),
        "verdict": verdict.or(recorded.as_ref().map(|r| r.0)),
        "reason": found.and_then(|f| f.reason()).or(recorded.and_then(|r| r.1)),
        "times_s": outcome.and_then(|o| o.timing.as_ref().map(timing)),
        "truth_mm": measured.map(|p| [p.x_mm, p.y_mm]),
        "peak_force_n": outcome.and_then(|o| o.peak_force_n),
    });
    if let (Some(found), Some(map)) = (found, value.as_object_mut()) {
        let error = found.error_mm();
        map.insert("outcome".into(), found.location_outcome.name().into());
        map.insert(
            "estimate_mm".into(),
            json!(found.estimate().map(|p| [p.x_mm, p.y_mm])),
        );
        map.insert(
            "error_mm".into(),
            json!(error.map(|(x, y)| libm::hypot(x, y))),
        );
        map.insert("views".into(), views(found, geometry));
    }
    value
}

/// View of each camera, with the direction of its ray in the skin's plane.
fn views(found: &PressResult, geometry: &StereoGeometry) -> Value {
    let view = |camera: CameraId| {
        let view = found.views[camera.index()].as_ref()?;
        let model = &geometry.cameras[camera.index()];
        let ray = view
            .centroid_u
            .map(|u| model.direction(model.angle_of_column_deg(u)));
        Some(json!({
            "events": view.events, "clusters": view.clusters, "cluster_events": view.cluster_events,
            "u": view.centroid_u, "v": view.centroid_v, "spread_u": view.spread_u, "ray": ray,
        }))
    };
    json!(CameraId::ALL.map(view))
}

/// Events per second of a camera over the session, from the chunks and their arrival.
fn rates(chunks: &[ChunkMeta], to_s: f64) -> Vec<f64> {
    let mut bins = vec![0.0; RATE_BINS];
    let width_s = to_s / RATE_BINS as f64;
    if width_s <= 0.0 {
        return bins;
    }
    let mut from_s = 0.0;
    for chunk in chunks {
        let until_s = chunk.host_time.as_secs_f64().min(to_s);
        // A chunk spans its own camera time, at most back to the one before.
        let length = match (chunk.facts.first_us, chunk.facts.last_us) {
            (Some(first), Some(last)) => last.saturating_sub(first) as f64 * 1e-6,
            _ => 0.0,
        };
        let begin_s = (until_s - length).max(from_s).min(until_s);
        spread(
            &mut bins,
            width_s,
            (begin_s, until_s),
            chunk.facts.cd_events as f64,
        );
        from_s = until_s;
    }
    bins.iter_mut().for_each(|events| *events /= width_s);
    bins
}

/// Adds `events` evenly to the bins that the interval covers.
fn spread(bins: &mut [f64], width_s: f64, (from_s, to_s): (f64, f64), events: f64) {
    let bin = |t: f64| ((t / width_s).max(0.0) as usize).min(bins.len() - 1);
    let (first, last) = (bin(from_s), bin(to_s));
    if first == last || to_s <= from_s {
        bins[last] += events;
        return;
    }
    for (n, sum) in bins.iter_mut().enumerate().take(last + 1).skip(first) {
        let (low, high) = (n as f64 * width_s, (n + 1) as f64 * width_s);
        let covered = high.min(to_s) - low.max(from_s);
        *sum += events * covered.max(0.0) / (to_s - from_s);
    }
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn spreading_keeps_the_number_of_events() {
        let mut bins = vec![0.0; 4];
        spread(&mut bins, 1.0, (0.5, 3.5), 30.0);
        assert_eq!(bins, [5.0, 10.0, 10.0, 5.0]);
        spread(&mut bins, 1.0, (4.0, 4.0), 1.0);
        assert_eq!(bins[3], 6.0);
    }
}
