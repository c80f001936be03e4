//! Header of a session with camera bytes only, and a plain file for comparison.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use skinrig_model::{
    LocationId, PlannedPress, Point2, PressId, PressRole, RepetitionId, RigidTransform, RunHeader,
    StreamFormat,
};

/// A header with one press that is never made.
#[must_use]
pub fn header() -> RunHeader {
    let text = "{}".to_owned();
    // SHA-256 of `{}`.
    let digest = "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a".to_owned();
    RunHeader {
        protocol_text: text.clone(),
        protocol_name: "bench".into(),
        protocol_sha256: digest.clone(),
        overrides: vec![],
        plan_json: text.clone(),
        plan_sha256: digest,
        seed: 1,
        rig_kind: "simulated".into(),
        rig_name: "bench".into(),
        rig_json: text,
        robot_from_skin: RigidTransform::identity(),
        stream_formats: [StreamFormat::Evt2; 2],
        prototype: String::new(),
        operator: String::new(),
        started_at: String::new(),
        host: String::new(),
        software: String::new(),
        command_line: String::new(),
        presses: vec![PlannedPress {
            id: PressId::from_index(0),
            role: PressRole::Score,
            repetition: RepetitionId::default(),
            location: LocationId::default(),
            at: Point2::new(0.0, 0.0),
            depth_mm: 2.0,
        }],
    }
}

/// Writes `chunk` this many times and waits until it is on disk.
///
/// # Errors
/// If the file cannot be written.
pub fn plain_file(path: &Path, chunk: &[u8], times: u64) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    for _ in 0..times {
        file.write_all(chunk)?;
    }
    file.sync_all()
}
