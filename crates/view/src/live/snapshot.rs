//! Owns what the file of a growing session shows: presses, notes, losses and the newest events.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde_json::json;
use skinrig_analysis::Analysis;
use skinrig_model::{CameraId, HostTime, PlannedPress, StereoGeometry, StreamFormat, Verdict};
use skinrig_recorder::{AttemptRow, InterruptionRow, RecorderError, SessionReader};
use skinrig_results::RigDocument;

use super::parts::{Sender, publish};
use super::picture;
use crate::document;
use crate::folder::name_of;

/// Newest pose samples are looked for this far back, ns.
const POSES_NS: i64 = 2_000_000_000;

/// Constant data, read once.
struct FixedData {
    formats: [StreamFormat; 2],
    nominal: StereoGeometry,
}

/// The session as last seen.
pub(super) struct SessionSnapshot {
    path: PathBuf,
    head: Option<FixedData>,
    stamp: Option<[Option<(u64, SystemTime)>; 2]>,
    rows: Vec<(PlannedPress, Vec<AttemptRow>)>,
    /// Presses with an outcome.
    outcomes: usize,
    /// Outcomes and analysed presses that were published.
    published: Option<(usize, usize)>,
    interruptions: Vec<InterruptionRow>,
    lost_bytes: [u64; 2],
    /// Number of the newest chunk of each camera whose losses are counted.
    counted: [Option<u64>; 2],
}

impl SessionSnapshot {
    pub(super) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            head: None,
            stamp: None,
            rows: Vec::new(),
            outcomes: 0,
            published: None,
            interruptions: Vec::new(),
            lost_bytes: [0; 2],
            counted: [None; 2],
        }
    }

    /// Presses with an outcome so far.
    pub(super) const fn outcomes(&self) -> usize {
        self.outcomes
    }

    /// Deviations from the planned course so far.
    pub(super) fn interruptions(&self) -> &[InterruptionRow] {
        &self.interruptions
    }

    /// Bytes lost in the file so far, all legs.
    pub(super) const fn lost_bytes(&self) -> [u64; 2] {
        self.lost_bytes
    }

    /// The last attempts in a row, newest first, that ended invalid.
    pub(super) fn failures_in_a_row(&self) -> usize {
        let attempts = self.rows.iter().flat_map(|(_, attempts)| attempts);
        // A failed attempt may have no other time than its start.
        let mut ended: Vec<(HostTime, Verdict)> = attempts
            .filter_map(|a| Some((a.intent?, a.outcome.as_ref()?.verdict.kind())))
            .collect();
        ended.sort_by_key(|(t, _)| *t);
        let newest = ended.iter().rev();
        newest
            .take_while(|(_, verdict)| *verdict == Verdict::Invalid)
            .count()
    }

    /// Publishes new data of the file; does not open an unchanged one. `has_pictures`: the run itself publishes pictures.
    pub(super) fn refresh(
        &mut self,
        analysis: Option<&Analysis>,
        has_pictures: bool,
        to: &Sender,
    ) -> Result<(), RecorderError> {
        let stamp = stamp(&self.path);
        if self.stamp != Some(stamp) {
            let reader = SessionReader::open(&self.path)?;
            self.read(&reader, has_pictures, to)?;
            // A file that grew since has another stamp next time.
            self.stamp = Some(stamp);
        }
        let analysed = analysis.map_or(0, |a| {
            a.presses.iter().filter(|p| p.timing.is_some()).count()
        });
        let state = (self.outcomes, analysed);
        if let Some(head) = &self.head
            && self.published != Some(state)
        {
            let geometry = analysis.map_or(&head.nominal, |a| &a.geometry);
            publish(
                to,
                "presses",
                &document::presses(&self.rows, analysis, geometry),
            );
            self.published = Some(state);
        }
        Ok(())
    }

    fn read(
        &mut self,
        reader: &SessionReader,
        has_pictures: bool,
        to: &Sender,
    ) -> Result<(), RecorderError> {
        let head = match &self.head {
            Some(head) => head,
            None => {
                let header = reader.header()?;
                let rig: RigDocument =
                    serde_json::from_str(&header.rig_json).map_err(|e| RecorderError::Damaged {
                        path: self.path.clone(),
                        place: "session".to_owned(),
                        expected: "the description of a rig".to_owned(),
                        found: e.to_string(),
                    })?;
                self.head.insert(FixedData {
                    formats: header.stream_formats,
                    nominal: rig.geometry.nominal,
                })
            }
        };
        let (tally, sync) = reader.tallies()?;
        let ended = (tally.planned - tally.open() + sync.planned - sync.open()) as usize;
        self.rows = reader.presses()?;
        self.outcomes = ended;
        self.interruptions = reader.interruptions()?;
        let notes = reader.notes()?.into_iter();
        publish(
            to,
            "journal",
            &json!({
                "tally": tally,
                "notes": notes.map(|n| json!([n.t.as_secs_f64(), n.text])).collect::<Vec<_>>(),
                "interruptions": self.interruptions.iter()
                    .map(|i| json!([i.t.as_secs_f64(), i.kind.name(), i.reason.to_string()])).collect::<Vec<_>>(),
                "sealed": reader.seal()?.is_some(),
                "end": reader.end()?.map(|(_, end)| end.name()),
            }),
        );
        let mut newest = HostTime::ZERO;
        let mut pictures = Vec::new();
        for camera in CameraId::ALL {
            let k = camera.index();
            let chunks = reader.last_chunks(camera, picture::CHUNKS)?;
            for chunk in &chunks {
                if self.counted[k].is_none_or(|seq| chunk.seq > seq) {
                    self.lost_bytes[k] += chunk.lost_before;
                    self.counted[k] = Some(chunk.seq);
                }
                newest = newest.max(chunk.host_time);
            }
            if !has_pictures {
                pictures.push(picture::picture(reader, head.formats[k], &chunks)?);
            }
        }
        if !has_pictures {
            publish(to, "pictures", &pictures);
        }
        let poses = reader.poses(HostTime(newest.0 - POSES_NS), HostTime(i64::MAX))?;
        let tip = poses.last().map(|p| {
            let m = p.measured;
            json!([p.t.as_secs_f64(), m.x_mm, m.y_mm, m.z_mm, p.force_n])
        });
        publish(
            to,
            "newest",
            &json!({ "t_s": newest.as_secs_f64(), "tip": tip, "lost_bytes": self.lost_bytes }),
        );
        Ok(())
    }
}

/// Size and time of change of the file and its log.
fn stamp(path: &Path) -> [Option<(u64, SystemTime)>; 2] {
    let log = path.with_file_name(format!("{}-wal", name_of(path)));
    [path, &log].map(|file| {
        let found = std::fs::metadata(file).ok()?;
        Some((found.len(), found.modified().ok()?))
    })
}
