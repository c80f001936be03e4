//! Converts rows to plain values and checks each of them.

use skinrig_model::{
    AttemptId, CameraId, ChunkFacts, HostTime, LocationId, PlannedPress, Point2, PoseSample,
    PressFaultKind, PressId, PressOutcome, PressTiming, RepetitionId, RigidTransform, RunHeader,
    StreamFormat, UnknownName, press::PressRole,
};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

use crate::cause::verdict_from;
use crate::pose;
use crate::query::{
    Fault, enum_value, int, num, opt_int, opt_num, opt_real, real, real_if_present, sha, text,
    text_if_present,
};
use crate::rows::{AttemptRow, ChunkMeta};
use skinrig_formats::codec::Codec;

pub(crate) fn header_from(row: &SqliteRow) -> Result<RunHeader, Fault> {
    let format = |column: &str| -> Result<StreamFormat, Fault> {
        text(row, column)?
            .parse()
            .map_err(|e: UnknownName| Fault::bad(column, "a stream format", e))
    };
    let overrides = text(row, "overrides_json")?;
    let seed = text(row, "seed")?;
    Ok(RunHeader {
        protocol_text: text(row, "protocol_text")?,
        protocol_name: text(row, "protocol_name")?,
        protocol_sha256: text(row, "protocol_sha256")?,
        overrides: serde_json::from_str(&overrides)
            .map_err(|e| Fault::bad("overrides_json", "a JSON array of text", e))?,
        plan_json: text(row, "plan_json")?,
        plan_sha256: text(row, "plan_sha256")?,
        seed: seed
            .parse()
            .map_err(|_| Fault::bad("seed", "a decimal number", &seed))?,
        rig_kind: text(row, "rig_kind")?,
        rig_name: text(row, "rig_name")?,
        rig_json: text(row, "rig_json")?,
        robot_from_skin: RigidTransform::identity(),
        stream_formats: [format("stream_format_1")?, format("stream_format_2")?],
        prototype: text(row, "prototype")?,
        operator: text(row, "operator")?,
        started_at: text(row, "started_at")?,
        host: text(row, "host")?,
        software: text(row, "software")?,
        command_line: text(row, "command_line")?,
        presses: Vec::new(),
    })
}

pub(crate) fn planned_from(row: &SqliteRow) -> Result<PlannedPress, Fault> {
    const ROLES: [PressRole; 3] = [PressRole::Sync, PressRole::Calibrate, PressRole::Score];
    Ok(PlannedPress {
        id: PressId::from_index(num(row, "id")?),
        role: enum_value(row, "role", &ROLES, PressRole::name)?,
        repetition: RepetitionId::from_index(num(row, "repetition")?),
        location: LocationId::from_index(num(row, "location")?),
        at: Point2::new(real(row, "x_mm")?, real(row, "y_mm")?),
        depth_mm: real(row, "depth_mm")?,
    })
}

pub(crate) fn attempt_from(row: &SqliteRow) -> Result<AttemptRow, Fault> {
    let id = AttemptId {
        press: PressId::from_index(num(row, "press")?),
        number: num(row, "number")?,
    };
    let verdict = verdict_from(row, fault_kinds(id, row)?)?;
    let at = |column: &str| Ok::<_, Fault>(opt_int(row, column)?.map(HostTime));
    let moments = (
        at("approach_ns")?,
        at("contact_ns")?,
        at("at_depth_ns")?,
        at("retract_ns")?,
        at("release_ns")?,
        at("clear_ns")?,
    );
    let timing = match moments {
        (
            Some(approach),
            Some(contact),
            Some(at_depth),
            Some(retract),
            Some(release),
            Some(clear),
        ) => Some(PressTiming {
            approach,
            contact,
            at_depth,
            retract,
            release,
            clear,
        }),
        (None, None, None, None, None, None) => None,
        _ => return Err(Fault::bad(id, "all six phase times or none", "only some")),
    };
    let measured = (
        opt_real(row, "measured_x_mm")?,
        opt_real(row, "measured_y_mm")?,
    );
    let outcome = match verdict {
        None => None,
        Some(verdict) => Some(PressOutcome {
            attempt: id,
            verdict,
            timing,
            measured_at: measured.0.zip(measured.1).map(|(x, y)| Point2::new(x, y)),
            measured_depth_mm: opt_real(row, "measured_depth_mm")?,
            touched_mm: real_if_present(row, "touched_mm")?,
            peak_force_n: opt_real(row, "peak_force_n")?,
            scheduled: int(row, "scheduled")? != 0,
        }),
    };
    Ok(AttemptRow {
        id,
        previous: opt_num(row, "previous")?,
        intent: at("intent_ns")?,
        outcome,
    })
}

/// Fault kinds of an attempt; empty in sessions of an older schema.
fn fault_kinds(id: AttemptId, row: &SqliteRow) -> Result<Vec<PressFaultKind>, Fault> {
    let kinds = text_if_present(row, "faults")?.unwrap_or_default();
    kinds
        .split_whitespace()
        .map(|name| {
            name.parse()
                .map_err(|e| Fault::bad(id, "kinds of faults", e))
        })
        .collect::<Result<_, Fault>>()
}

pub(crate) fn chunk_from(row: &SqliteRow) -> Result<ChunkMeta, Fault> {
    let camera = int(row, "camera")?;
    Ok(ChunkMeta {
        camera: CameraId::from_number(camera)
            .ok_or_else(|| Fault::bad("chunk", "camera 1 or 2", camera))?,
        seq: num(row, "seq")?,
        host_time: HostTime(int(row, "host_ns")?),
        lost_before: num(row, "lost_before")?,
        lost_time: None,
        codec: enum_value(
            row,
            "codec",
            &[Codec::None, Codec::TimeHighRuns],
            Codec::name,
        )?,
        raw_bytes: num(row, "raw_bytes")?,
        stored_bytes: num(row, "stored_bytes")?,
        raw_crc32: num(row, "raw_crc32")?,
        facts: ChunkFacts {
            cd_events: num(row, "cd_events")?,
            on_events: num(row, "on_events")?,
            trigger_edges: num(row, "trigger_edges")?,
            first_us: opt_num(row, "first_us")?,
            last_us: opt_num(row, "last_us")?,
        },
        restart_us: None,
    })
}

pub(crate) fn pose_block_from(row: &SqliteRow) -> Result<(i64, Vec<PoseSample>), Fault> {
    use sha2::Digest;
    let id = int(row, "id")?;
    let place = || format!("pose block {id}");
    let data: &[u8] = row.try_get("data")?;
    if sha2::Sha256::digest(data).as_slice() != sha(row, "sha256")? {
        return Err(Fault::bad(
            place(),
            "data with the recorded SHA-256",
            "different data",
        ));
    }
    let samples = pose::decode(data);
    let count: usize = num(row, "samples")?;
    if samples.len() != count || data.len() != count * pose::SAMPLE_BYTES {
        return Err(Fault::bad(
            place(),
            format!("{count} samples"),
            format!("{} bytes", data.len()),
        ));
    }
    let span = (int(row, "first_ns")?, int(row, "last_ns")?);
    let found = (
        samples.first().map(|s| s.t.0),
        samples.last().map(|s| s.t.0),
    );
    if found != (Some(span.0), Some(span.1)) || !samples.is_sorted_by_key(|s| s.t) {
        return Err(Fault::bad(
            place(),
            format!("times from {} to {} ns", span.0, span.1),
            "different times",
        ));
    }
    Ok((id, samples))
}
