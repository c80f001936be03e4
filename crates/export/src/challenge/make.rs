//! Makes a challenge: events, table of presses and description in one folder, the answers in a file outside it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use skinrig_analysis::result::PressResult;
use skinrig_model::{CameraId, CdEvent, Point2, PressRole, PressTiming, Verdict};
use skinrig_recorder::{ChunkMeta, RecorderError};

use super::answers::{Answer, Answers, ChallengeSelection, hash, hex};
use super::error::ChallengeError;
use super::{DESCRIPTION, FORMAT, STEM};
use crate::csv_files::CsvFiles;
use crate::error::ExportError;
use crate::folder::Folder;
use crate::parquet_files::ParquetFiles;
use crate::presses::recorded_us;
use crate::source::{Source, TableName};
use crate::table::{Column, Kind, Layout, Table, TableWriter, Values};

/// Events from this long before the contact to this long after the release, µs; less if a press has less of its own. All presses have the
/// same margin: events that two presses share, and margins that follow from pauses, would tell their order, and with it their places.
const MARGIN_US: f64 = 500_000.0;
/// A press that ended this far above its planned depth was stopped, mm.
const STOPPED_MM: f64 = 0.1;

/// Description of a challenge, for people and programs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Description {
    format: u32,
    /// What to do.
    task: String,
    /// What the events come from: `simulated`, `emulated`, `bench` or `imported`; missing if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<String>,
    /// The selection behind it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    selection: Option<ChallengeSelection>,
    /// Presses whose position is given.
    pub calibrating: u32,
    /// Presses to locate.
    pub scored: u32,
    /// SHA-256 of the file of answers.
    pub answers_sha256: String,
}

const TASK: &str = "Locate the presses with role `score`, in mm in the skin frame, from the events of both cameras. Events are \
    those from 0.5 s before the contact to 0.5 s after the release, or, for all presses alike, half the shortest pause; t_us counts from the contact. Write a CSV file with the \
    columns press, x_mm, y_mm, one row for each of these presses, cells empty if not located; optionally the 95 % region as \
    region_major_mm, region_minor_mm (semi-axes) and region_angle_deg (of the longer one, counter-clockwise from x).";

impl Description {
    /// Reads the description of the challenge in `folder`.
    pub(super) fn read(folder: &Path) -> Result<Self, ChallengeError> {
        let path = folder.join(DESCRIPTION);
        let refused = |found: String| ChallengeError::NotAChallenge {
            path: path.clone(),
            expected: "the description of a challenge",
            found,
        };
        let bytes = std::fs::read(&path).map_err(|e| refused(e.to_string()))?;
        let found: Self = serde_json::from_slice(&bytes).map_err(|e| refused(e.to_string()))?;
        match found.format {
            FORMAT => Ok(found),
            other => Err(refused(format!("format {other}"))),
        }
    }
}

/// How to make a challenge.
#[derive(Debug, Clone)]
pub struct ChallengeOptions {
    /// Whether to replace existing files.
    pub overwrite: bool,
    /// What the events come from, for the description.
    pub origin: Option<&'static str>,
    /// The selection with which the session was analysed.
    pub selection: Option<ChallengeSelection>,
    /// Random bytes. They decide the order of the presses and are part of the sealed answers, so that nobody who knows the
    /// positions of a plan can find out which press is which by trying.
    pub salt: [u8; 32],
}

/// A challenge that was made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChallengeFiles {
    /// Files to give away.
    pub files: Vec<PathBuf>,
    /// The file to keep.
    pub answers: PathBuf,
    /// Presses whose position is given.
    pub calibrating: u32,
    /// Presses to locate.
    pub scored: u32,
}

/// A press of the challenge.
pub(super) struct Press<'a> {
    pub row: &'a PressResult,
    timing: PressTiming,
    /// Planned depth, or the measured one if the press ended before it, mm.
    depth_mm: f64,
    /// Before the contact and after the release, µs; the same for all.
    margin_us: f64,
    pub truth: Point2,
}

impl Press<'_> {
    pub(super) fn is_scored(&self) -> bool {
        self.row.role == PressRole::Score
    }

    /// Recorded time of the contact on a camera's clock, µs, and the events about the press; none without a clock.
    pub(super) fn events(
        &self,
        source: &Source<'_>,
        camera: CameraId,
        events: &mut EventQuery<'_>,
    ) -> Result<(f64, Vec<CdEvent>), ExportError> {
        let Some(clock) = source
            .analysis
            .and_then(|(a, _)| a.clocks[camera.index()].as_ref())
        else {
            return Ok((0.0, Vec::new()));
        };
        let us = |t| recorded_us(source, clock, camera.index(), t);
        let contact = us(self.timing.contact);
        let from = (contact - self.margin_us).ceil().max(0.0) as u64;
        let to = (us(self.timing.release) + self.margin_us).max(1.0) as u64 - 1;
        Ok((contact, events(camera, (from, to))?))
    }
}

/// Events of a camera between two recorded times, µs.
pub type EventQuery<'a> =
    dyn FnMut(CameraId, (u64, u64)) -> Result<Vec<CdEvent>, RecorderError> + 'a;

/// Writes the challenge of an analysed session into `folder`, and its answers to `answers`. `events` reads the events of a
/// camera between two times of its recorded clock.
///
/// Scored presses that the analysis excludes for what the cameras saw stay in: not to locate them costs the located rate.
///
/// # Errors
/// [`ChallengeError`] when the session is INVALID, too few presses are usable, or a file cannot be written.
pub fn make(
    source: &Source<'_>,
    folder: &Path,
    answers: &Path,
    making: &ChallengeOptions,
    events: &mut EventQuery<'_>,
) -> Result<ChallengeFiles, ChallengeError> {
    let presses = chosen(source, making.salt)?;
    let scored = presses.iter().filter(|p| p.is_scored()).count();
    let calibrating = presses.len() - scored;
    let out = Folder::new(folder, STEM, making.overwrite)?;
    for entry in std::fs::read_dir(folder).map_err(ExportError::file(folder))? {
        let path = entry.map_err(ExportError::file(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if !name.starts_with(STEM) {
            return Err(ChallengeError::NotAlone { path });
        }
    }
    let resolved = |path: &Path| std::fs::canonicalize(path).map_err(ExportError::file(path));
    let parent = answers.parent().filter(|p| !p.as_os_str().is_empty());
    let parent = parent.unwrap_or_else(|| Path::new("."));
    if resolved(parent)?.starts_with(resolved(folder)?) {
        return Err(ChallengeError::Unsealed {
            path: answers.to_owned(),
        });
    }
    if let Ok(found) = std::fs::read(answers) {
        let replaced = Description::read(folder).ok();
        let is_its_own = replaced.is_some_and(|old| old.answers_sha256 == hash(&found));
        if !making.overwrite || !is_its_own {
            return Err(ChallengeError::AnswersOfAnother {
                path: answers.to_owned(),
                folder: folder.to_owned(),
            });
        }
    }
    let stem = answers.file_name().unwrap_or_default().to_string_lossy();
    let sealed = Folder::new(parent, &stem, making.overwrite)?;
    let numbered = (1..).zip(&presses).filter(|(_, p)| p.is_scored());
    let numbered: Vec<(u32, &Press<'_>)> = numbered.collect();
    let answers_of = Answers {
        selection: making.selection.clone(),
        ..answers_about(source, &numbered, making.salt)?
    };
    let text = json(&answers_of);
    let answers = write(&sealed, "", &text)?;
    let description = json(&Description {
        format: FORMAT,
        task: TASK.to_owned(),
        origin: making.origin.map(str::to_owned),
        selection: making.selection.clone(),
        calibrating: calibrating as u32,
        scored: scored as u32,
        answers_sha256: hash(text.as_bytes()),
    });
    let mut files = vec![write(&out, ".json", &description)?];
    let mut tables = CsvFiles::new(out.clone());
    press_table(&presses).write(&mut tables)?;
    files.extend(tables.into_paths());
    let mut tables = ParquetFiles::new(out);
    for camera in CameraId::ALL {
        event_table(source, camera, &presses, events, &mut tables)?;
    }
    files.extend(tables.into_paths());
    Ok(ChallengeFiles {
        files,
        answers,
        calibrating: calibrating as u32,
        scored: scored as u32,
    })
}

/// The presses of a challenge in an order that follows from the salt.
///
/// # Errors
/// [`ChallengeError`] when the session is INVALID, or too few presses are usable.
pub(super) fn chosen<'a>(
    source: &Source<'a>,
    salt: [u8; 32],
) -> Result<Vec<Press<'a>>, ChallengeError> {
    let Some((analysis, _)) = source.analysis else {
        return Err(ChallengeError::TooFew {
            calibrating: 0,
            scored: 0,
        });
    };
    if !analysis.is_valid() {
        return Err(ChallengeError::InvalidSession {
            because: analysis.invalid_because(),
        });
    }
    let mut presses = shuffled(&analysis.presses, salt);
    let scored = presses.iter().filter(|p| p.is_scored()).count();
    let calibrating = presses.len() - scored;
    if scored == 0 || calibrating == 0 {
        return Err(ChallengeError::TooFew {
            calibrating,
            scored,
        });
    }
    let journal = source.reader.presses().map_err(ExportError::from)?;
    for press in &mut presses {
        let attempts = journal
            .iter()
            .find(|(planned, _)| planned.id == press.row.press);
        let last = attempts.and_then(|(_, attempts)| attempts.last());
        let measured_mm = last.and_then(|a| a.outcome.as_ref()?.measured_depth_mm);
        if let Some(mm) = measured_mm.filter(|mm| *mm < press.depth_mm - STOPPED_MM) {
            press.depth_mm = mm;
        }
    }
    let margin_us = margin_us(source, &presses, &analysis.presses)?;
    for press in &mut presses {
        press.margin_us = margin_us;
    }
    Ok(presses)
}

/// Where numbered presses were made, and how they are scored.
pub(super) fn answers_about(
    source: &Source<'_>,
    presses: &[(u32, &Press<'_>)],
    salt: [u8; 32],
) -> Result<Answers, ChallengeError> {
    let Some((analysis, _)) = source.analysis else {
        return Err(ChallengeError::TooFew {
            calibrating: 0,
            scored: 0,
        });
    };
    let settings = &analysis.settings;
    Ok(Answers {
        format: FORMAT,
        salt: hex(&salt),
        session_id: source.reader.session_id().map_err(ExportError::from)?,
        outline: analysis.rig.outline,
        within_mm: settings.within_mm,
        bootstrap_resamples: settings.bootstrap_resamples,
        seed: settings.seed,
        selection: None,
        presses: presses
            .iter()
            .map(|(press, p)| Answer {
                press: *press,
                session_press: p.row.press.number(),
                location: p.row.location.index(),
                depth_mm: p.depth_mm,
                x_mm: p.truth.x_mm,
                y_mm: p.truth.y_mm,
            })
            .collect(),
    })
}

/// Usable presses in an order that follows from the salt.
fn shuffled(rows: &[PressResult], salt: [u8; 32]) -> Vec<Press<'_>> {
    let usable = |row: &PressResult| match row.role {
        PressRole::Sync => false,
        PressRole::Calibrate => row.verdict == Verdict::Valid,
        PressRole::Score => {
            row.verdict == Verdict::Valid || row.rule().is_some_and(|r| r.is_on_data())
        }
    };
    let presses = rows.iter().filter(|row| usable(row)).filter_map(|row| {
        let timing = row.timing?;
        Some(Press {
            row,
            timing,
            depth_mm: row.depth_mm,
            margin_us: MARGIN_US,
            truth: row.truth?,
        })
    });
    let mut presses: Vec<Press<'_>> = presses.collect();
    let salted = Sha256::new().chain_update(salt);
    presses.sort_by_cached_key(|p| {
        let own = salted.clone();
        own.chain_update(p.row.press.index().to_le_bytes())
            .finalize()
    });
    presses
}

/// The margin of all presses: half the shortest pause beside one of them, and no more than what was recorded about each.
fn margin_us(
    source: &Source<'_>,
    presses: &[Press<'_>],
    rows: &[PressResult],
) -> Result<f64, ExportError> {
    let all: Vec<PressTiming> = rows.iter().filter_map(|row| row.timing).collect();
    let pauses = presses.iter().map(|p| half_pause_us(&p.timing, &all));
    let mut margin_us = pauses.fold(MARGIN_US, f64::min);
    for camera in CameraId::ALL {
        let clock = source
            .analysis
            .and_then(|(a, _)| a.clocks[camera.index()].as_ref());
        let Some(clock) = clock else { continue };
        let legs = recorded(&source.reader.chunk_index(camera)?);
        for p in presses {
            let us = |t| recorded_us(source, clock, camera.index(), t);
            let (contact, release) = (us(p.timing.contact), us(p.timing.release));
            let own = legs
                .iter()
                .find(|(first, last)| (*first..=*last).contains(&contact));
            let recorded_us =
                own.map_or(0.0, |(first, last)| (contact - first).min(last - release));
            margin_us = margin_us.min(recorded_us.max(0.0));
        }
    }
    Ok(margin_us)
}

/// First and last time of each leg of a camera's stream, µs.
fn recorded(chunks: &[ChunkMeta]) -> Vec<(f64, f64)> {
    let mut legs: Vec<(f64, f64)> = Vec::new();
    for chunk in chunks {
        let Some((first, last)) = chunk.facts.first_us.zip(chunk.facts.last_us) else {
            continue;
        };
        let (first, last) = (first as f64, last as f64);
        match legs.last_mut() {
            Some(leg) if chunk.restart_us.is_none() => leg.1 = last,
            _ => legs.push((first, last)),
        }
    }
    legs
}

/// Half the shorter pause between a press and those before and after it among `all`.
fn half_pause_us(own: &PressTiming, all: &[PressTiming]) -> f64 {
    let ends = all.iter().map(|t| t.release);
    let before = ends.filter(|t| *t <= own.contact).max();
    let begins = all.iter().map(|t| t.contact);
    let after = begins.filter(|t| *t >= own.release).min();
    let pauses = [
        before.map(|t| own.contact - t),
        after.map(|t| t - own.release),
    ];
    let halves = pauses.into_iter().flatten();
    halves
        .map(|pause| 0.5e-3 * pause.0 as f64)
        .fold(f64::INFINITY, f64::min)
}

fn press_table(presses: &[Press<'_>]) -> Table {
    let given = |p: &Press<'_>| p.row.role == PressRole::Calibrate;
    let real = |of: &dyn Fn(&Press<'_>) -> Option<f64>| {
        Values::Real(presses.iter().map(|p| of(p).unwrap_or(f64::NAN)).collect())
    };
    let names = presses.iter().map(|p| Some(p.row.role.name().to_owned()));
    let location = |p: &Press<'_>| given(p).then(|| i64::from(p.row.location.number()));
    let columns = [
        ("press", Values::Int((1..=presses.len() as i64).collect())),
        ("role", Values::Text(names.collect())),
        ("depth_mm", real(&|p| Some(p.depth_mm))),
        (
            "release_s",
            real(&|p| Some((p.timing.release.0 - p.timing.contact.0) as f64 * 1e-9)),
        ),
        (
            "location",
            Values::Count(presses.iter().map(location).collect()),
        ),
        ("x_mm", real(&|p| given(p).then_some(p.truth.x_mm))),
        ("y_mm", real(&|p| given(p).then_some(p.truth.y_mm))),
    ];
    Table {
        name: TableName::Presses.name(),
        columns: columns.map(|(name, v)| (name.to_owned(), v)).into(),
    }
}

/// Writes the events of a camera, press by press.
fn event_table(
    source: &Source<'_>,
    camera: CameraId,
    presses: &[Press<'_>],
    events: &mut EventQuery<'_>,
    to: &mut dyn TableWriter,
) -> Result<(), ExportError> {
    let column = |(name, kind): (&str, Kind)| Column {
        name: name.to_owned(),
        kind,
    };
    let columns = [
        ("press", Kind::Int),
        ("t_us", Kind::Int),
        ("x_px", Kind::Pixel),
        ("y_px", Kind::Pixel),
        ("on", Kind::Flag),
    ];
    let layout = Layout {
        name: TableName::Events(camera).name(),
        columns: columns.map(column).into(),
    };
    let mut total = 0;
    for p in presses {
        total += p.events(source, camera, events)?.1.len() as u64;
    }
    to.begin(&layout, total)?;
    for (number, p) in (1..).zip(presses) {
        let (contact, events) = p.events(source, camera, events)?;
        to.append(&[
            Values::Int(vec![number; events.len()]),
            Values::Int(
                events
                    .iter()
                    .map(|e| (e.t_us as f64 - contact).round() as i64)
                    .collect(),
            ),
            Values::Pixel(events.iter().map(|e| e.x).collect()),
            Values::Pixel(events.iter().map(|e| e.y).collect()),
            Values::Flag(
                events
                    .iter()
                    .map(|e| e.polarity == skinrig_model::Polarity::On)
                    .collect(),
            ),
        ])?;
    }
    to.end()
}

fn json(of: &impl Serialize) -> String {
    // Finite numbers and text always serialise.
    let mut text = serde_json::to_string_pretty(of).unwrap_or_default();
    text.push('\n');
    text
}

fn write(folder: &Folder, suffix: &str, text: &str) -> Result<PathBuf, ExportError> {
    folder.write_atomic(suffix, |to| {
        std::fs::write(to, text).map_err(ExportError::file(to))
    })
}

#[cfg(test)]
mod tests {
    use skinrig_model::{ChunkFacts, HostTime};
    use skinrig_recorder::Codec;

    use super::*;

    fn press(contact_ms: i64, release_ms: i64) -> PressTiming {
        let at = |ms: i64| HostTime(ms * 1_000_000);
        PressTiming {
            approach: at(contact_ms - 100),
            contact: at(contact_ms),
            at_depth: at(contact_ms + 10),
            retract: at(release_ms - 10),
            release: at(release_ms),
            clear: at(release_ms + 100),
        }
    }

    /// Presses that share events could be put into their order.
    #[test]
    fn no_event_is_in_two_presses() {
        let all = [press(0, 200), press(500, 700), press(5_000, 5_200)];
        let halves = all.map(|own| half_pause_us(&own, &all));
        assert_eq!(halves, [150_000.0, 150_000.0, 2_150_000.0]);
    }

    #[test]
    fn every_leg_has_its_own_ends() {
        let chunk = |first_us, last_us, restart_us| ChunkMeta {
            camera: CameraId::One,
            seq: 0,
            host_time: HostTime::ZERO,
            lost_before: 0,
            lost_time: None,
            codec: Codec::None,
            raw_bytes: 0,
            stored_bytes: 0,
            raw_crc32: 0,
            facts: ChunkFacts {
                first_us: Some(first_us),
                last_us: Some(last_us),
                ..ChunkFacts::default()
            },
            restart_us,
        };
        let chunks = [
            chunk(10, 20, None),
            chunk(21, 30, None),
            chunk(90, 99, Some(80)),
        ];
        assert_eq!(recorded(&chunks), [(10.0, 30.0), (90.0, 99.0)]);
    }
}
