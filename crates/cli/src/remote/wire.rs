//! Requests to a run from another terminal, and its replies: one line of JSON each, of bounded length.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use skinrig_controller::{Progress, State, TouchProgress};
use skinrig_model::{CameraId, TouchDepth, TouchKind, TouchRegion};

use super::newest::CameraTail;
use super::touches::TouchLine;

/// Longest request, bytes.
pub(crate) const MOST_REQUEST_BYTES: usize = 16 * 1024;
/// Longest reply, bytes.
pub(crate) const MOST_REPLY_BYTES: usize = 512 * 1024;
/// Longest note, characters.
pub(crate) const MOST_NOTE_CHARS: usize = 2_000;
/// Longest name of an operator, characters.
pub(crate) const MOST_NAME_CHARS: usize = 64;

/// A request of the operator; `docs/reference/runs.md` describes each one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub(crate) enum RunRequest {
    /// Wait after the current press.
    Pause,
    /// Abort the current press, leave the skin, and wait.
    PauseNow,
    /// Continue after a pause.
    Resume,
    /// End after the current press.
    Stop,
    /// Leave the skin now, disarm, keep the data.
    Abort,
    /// Motors off now, wherever the tip is.
    Halt,
}

/// A request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Request {
    /// Ask for the state of the run.
    Status,
    /// Ask for the newest bytes of both cameras.
    Newest,
    /// Ask for every touch that is felt from now on, a [`Reply::Touch`] each, until the run ends.
    Touches,
    /// Control the run.
    Control(RunRequest),
    /// Add a note.
    Note {
        /// Its author.
        by: String,
        /// Its text.
        text: String,
    },
}

/// A reply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Reply {
    /// The state of the run.
    Live(Box<RunSnapshot>),
    /// The newest bytes of camera 1 and camera 2.
    Newest([NewestEvents; 2]),
    /// A touch.
    Touch(TouchLine),
    /// No more touches: the run has ended. Without it the connection was lost, or the run was killed.
    TouchesEnded,
    /// Accepted; the number of the request or note.
    Handed(u64),
    /// Refused, with the reason.
    Refused(String),
}

/// Newest bytes of a camera, with the beginning of older words cut off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct NewestEvents {
    /// In base64.
    pub bytes: String,
    /// When the run took them, s since 1970; 0 for none yet.
    pub unix_s: f64,
}

impl From<CameraTail> for NewestEvents {
    fn from(tail: CameraTail) -> Self {
        Self {
            bytes: STANDARD.encode(&tail.bytes),
            unix_s: tail.unix_s,
        }
    }
}

impl NewestEvents {
    /// The bytes; `None` for a reply that is no base64.
    pub(crate) fn bytes(&self) -> Option<Vec<u8>> {
        STANDARD.decode(&self.bytes).ok()
    }
}

/// A run at one instant, as reported by the run itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunSnapshot {
    /// Name of its [`State`].
    pub state: String,
    /// Requests made so far, by ctrl-C or from another terminal.
    pub asked: u64,
    /// How many of them the controller has acknowledged.
    pub heard: u64,
    /// Notes written.
    pub noted: u64,
    /// Presses of the plan.
    pub planned: usize,
    /// Presses that have ended.
    pub done: usize,
    /// How many of them are valid.
    pub valid: usize,
    /// How many of them are invalid.
    pub invalid: usize,
    /// How many of them were missed.
    pub missed: usize,
    /// How many of them a rule excludes.
    #[serde(default)]
    pub excluded: usize,
    /// Attempts beyond the first at a press, in this leg.
    pub retaken: usize,
    /// The press under way, or the last one.
    pub press: Option<LivePress>,
    /// The measured tip, skin frame, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// Rig time of this leg so far, s.
    pub elapsed_s: f64,
    /// Rig time still to go, s.
    pub eta_s: Option<f64>,
    /// Wall time since the leg began, s.
    pub waited_s: f64,
    /// Marks that the trigger box sent.
    pub marks_sent: u64,
    /// What was felt; `None` until the run feels touches.
    #[serde(default)]
    pub touch: Option<LiveTouch>,
    /// Both cameras.
    pub cameras: [LiveCamera; 2],
}

/// A press in a [`RunSnapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LivePress {
    /// Its number in the plan, from 1.
    pub number: u32,
    /// `sync`, `calibrate` or `score`.
    pub role: skinrig_model::PressRole,
    /// Its repetition, from 1.
    pub repetition: u32,
    /// Its location, skin frame, mm.
    pub at_mm: [f64; 2],
}

/// Touches of a run, in a [`RunSnapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LiveTouch {
    /// Whether a touch is being felt.
    pub touching: bool,
    /// The newest estimate or reaction.
    pub kind: TouchKind,
    /// When the run received it, s of rig time.
    pub t_s: f64,
    /// Age of its newest events at that time, ms.
    pub lag_ms: f64,
    /// Its position, skin frame, mm.
    pub at_mm: Option<[f64; 2]>,
    /// Its 95 % region.
    pub region: Option<TouchRegion>,
    /// Depth that the touch has reached.
    pub depth: Option<TouchDepth>,
    /// Attempts at scored presses since the run feels touches.
    pub presses: usize,
    /// How many of them were felt.
    pub felt: usize,
    /// Touches felt between presses.
    pub between: usize,
    /// How often bytes were skipped because the estimator could not keep up.
    pub skipped: usize,
}

impl LiveTouch {
    fn of(touch: &TouchProgress) -> Self {
        let latest = &touch.latest;
        Self {
            touching: touch.touching,
            kind: latest.kind,
            t_s: latest.t.as_secs_f64(),
            lag_ms: (latest.t - latest.until).as_secs_f64() * 1e3,
            at_mm: latest.at_mm,
            region: latest.region,
            depth: latest.depth,
            presses: touch.presses,
            felt: touch.felt,
            between: touch.between,
            skipped: touch.skipped,
        }
    }
}

/// A camera in a [`RunSnapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LiveCamera {
    /// CD events per second of rig time over about the last second.
    pub events_per_s: Option<f64>,
    /// CD events in this leg.
    pub events: u64,
    /// Bytes known to be lost in this leg.
    pub lost_bytes: u64,
    /// Complete marks on its trigger input.
    pub marks_seen: u64,
}

/// Invalid request.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RequestError {
    /// The caller sent nothing in time.
    #[error("expected a request at once, found none")]
    Late,
    /// The line does not end.
    #[error(
        "expected one line of at most {MOST_REQUEST_BYTES} bytes, found {found} without an end"
    )]
    Endless {
        /// Bytes received.
        found: usize,
    },
    /// The line does not parse.
    #[error("expected a request of `skinrig`, found other bytes: {0}")]
    Foreign(#[from] serde_json::Error),
    /// A text of a note is empty or too long.
    #[error("expected a {part} of 1 to {most} characters, found {found}")]
    Length {
        /// `name` or `note`.
        part: &'static str,
        /// Maximum, characters.
        most: usize,
        /// Length, characters.
        found: usize,
    },
    /// A text of a note has control characters.
    #[error("expected a {part} without control characters, found one")]
    Control {
        /// `name` or `note`.
        part: &'static str,
    },
}

impl Request {
    /// Parses a request from untrusted bytes.
    ///
    /// # Errors
    /// [`RequestError`].
    pub(crate) fn parse(line: &[u8]) -> Result<Self, RequestError> {
        let request: Self = serde_json::from_slice(line)?;
        if let Self::Note { by, text } = &request {
            for (part, words, most) in [
                ("name", by, MOST_NAME_CHARS),
                ("note", text, MOST_NOTE_CHARS),
            ] {
                let found = words.chars().count();
                if !(1..=most).contains(&found) {
                    return Err(RequestError::Length { part, most, found });
                }
                if words.chars().any(char::is_control) {
                    return Err(RequestError::Control { part });
                }
            }
        }
        Ok(request)
    }
}

impl RunSnapshot {
    /// The reply for a run with this progress.
    #[must_use]
    pub(crate) fn of(p: &Progress, state: State, counts: [u64; 3], waited_s: f64) -> Self {
        let [asked, heard, noted] = counts;
        Self {
            state: state.name().to_owned(),
            asked,
            heard,
            noted,
            planned: p.planned,
            done: p.done,
            valid: p.valid,
            invalid: p.invalid,
            missed: p.missed,
            excluded: p.excluded,
            retaken: p.retaken,
            press: p.press.map(|press| LivePress {
                number: press.id.number(),
                role: press.role,
                repetition: press.repetition.number(),
                at_mm: [press.at.x_mm, press.at.y_mm],
            }),
            tip_mm: p.tip.map(|(at, z_mm)| [at.x_mm, at.y_mm, z_mm]),
            elapsed_s: p.elapsed.as_secs_f64(),
            eta_s: p.eta.map(|t| t.as_secs_f64()),
            waited_s,
            marks_sent: p.marks_sent,
            touch: p.touch.as_ref().map(LiveTouch::of),
            cameras: CameraId::ALL.map(|c| {
                let camera = p.cameras[c.index()];
                LiveCamera {
                    events_per_s: camera.events_per_s,
                    events: camera.events,
                    lost_bytes: camera.lost_bytes,
                    marks_seen: camera.marks_seen,
                }
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_reads_back_as_written() {
        let note = |by: &str, text: &str| Request::Note {
            by: by.into(),
            text: text.into(),
        };
        for request in [
            Request::Status,
            Request::Newest,
            Request::Touches,
            Request::Control(RunRequest::PauseNow),
            note("Ann", "the lamp flickers: \"40 %\""),
        ] {
            let line = serde_json::to_vec(&request).unwrap();
            assert_eq!(Request::parse(&line).unwrap(), request);
        }
    }

    #[test]
    fn invalid_requests_are_rejected() {
        let long = format!(
            r#"{{"note":{{"by":"Ann","text":"{}"}}}}"#,
            "x".repeat(MOST_NOTE_CHARS + 1)
        );
        for bytes in [
            b"".as_slice(),
            b"\0\xff\xfe",
            b"GET / HTTP/1.1",
            b"null",
            b"[]",
            b"\"launch\"",
            br#"{"control":"jump"}"#,
            br#"{"note":{"by":"","text":"a"}}"#,
            br#"{"note":{"by":"Ann","text":""}}"#,
            br#"{"note":{"by":"Ann","text":"a\nb"}}"#,
            br#"{"note":{"by":"Ann\u001b[2J","text":"a"}}"#,
            br#"{"note":{"by":"Ann","text":"a","more":1}}"#,
            long.as_bytes(),
            &[b'['; MOST_REQUEST_BYTES],
        ] {
            let found = Request::parse(bytes);
            assert!(found.is_err(), "{}", String::from_utf8_lossy(bytes));
        }
    }
}
