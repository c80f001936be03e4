//! The sense of touch of a run: learns in a second process and feels through the online estimator; a replay repeats the recorded touches.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use skinrig_controller::{SenseAnswer, SenseFault, SensedTouch, TouchSense};
use skinrig_model::{CameraId, HostTime, StreamFormat, TouchEstimate, TouchKind, TouchRegion};
use skinrig_online::{Detection, Estimate, Felt, News, Position, SkinModel, Worker};
use skinrig_protocol::Online;

use crate::args::LearnSkinArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::subprocess::{AnswerMode, NoAnswer, Subprocess, lower_priority};

/// The hidden command that learns.
const LEARN_SKIN: &str = "learn-skin";

/// How a run feels touches.
pub(crate) type SenseMode = AnswerMode<Vec<TouchEstimate>>;

impl SenseMode {
    /// Feels the skin while the session at `path` is recorded.
    ///
    /// # Errors
    /// If no thread can be started.
    pub(crate) fn at(
        &self,
        path: &Path,
        online: Online,
        formats: [StreamFormat; 2],
    ) -> std::io::Result<Box<dyn TouchSense>> {
        let every_us = online.position_every.0 / 1_000;
        let (worker, waits) = match self {
            Self::Recorded(touches) => {
                return Ok(Box::new(RecordedTouches(touches.clone().into())));
            }
            Self::Waiting => (Worker::here(formats, every_us), true),
            Self::Background => (Worker::on_a_thread(formats, every_us)?, false),
        };
        Ok(Box::new(SessionSense {
            session: path.to_owned(),
            false_alarms_hz: online.false_alarms_hz,
            waits,
            process: None,
            worker,
            answers: VecDeque::new(),
        }))
    }
}

/// The touches of a recorded run, at their times.
struct RecordedTouches(VecDeque<TouchEstimate>);

impl TouchSense for RecordedTouches {
    fn learn(&mut self) {}

    fn feed(&mut self, _: CameraId, _: u64, _: &[u8]) {}

    fn poll(&mut self, now: HostTime) -> Option<SenseAnswer> {
        loop {
            let touch = self.0.pop_front_if(|touch| touch.t <= now)?;
            // The replayed run reacts by itself.
            if matches!(touch.kind, TouchKind::Stopped | TouchKind::Lifted) {
                continue;
            }
            return Some(SenseAnswer::Felt(SensedTouch {
                until: touch.until,
                until_sd_ns: touch.until_sd_ns,
                kind: touch.kind,
                at_mm: touch.at_mm,
                region: touch.region,
                depth: touch.depth,
                llr: touch.llr,
            }));
        }
    }
}

/// Feels touches in the bytes of a session, once a second process has learnt from its calibration presses.
struct SessionSense {
    session: PathBuf,
    false_alarms_hz: f64,
    waits: bool,
    process: Option<Subprocess>,
    worker: Worker,
    answers: VecDeque<SenseAnswer>,
}

impl SessionSense {
    fn learnt(&mut self, answer: Result<SkinModel, NoAnswer>) {
        match answer {
            Ok(skin) => {
                self.answers.push_back(SenseAnswer::Ready {
                    places: skin.places(),
                    has_regions: skin.has_regions(),
                    has_depths: skin.has_depths(),
                    has_depths_elsewhere: skin.has_depths_elsewhere(),
                });
                self.worker.start(skin);
            }
            Err(e) => {
                let fault = SenseFault::NotLearnt(e.to_string());
                self.answers.push_back(SenseAnswer::Off(fault));
            }
        }
    }
}

impl TouchSense for SessionSense {
    fn learn(&mut self) {
        let rate = self.false_alarms_hz.to_string();
        let session = self.session.as_os_str();
        let arguments = [
            LEARN_SKIN.as_ref(),
            session,
            "--false-alarms".as_ref(),
            rate.as_ref(),
        ];
        match Subprocess::start(arguments) {
            Ok(process) if self.waits => self.learnt(process.finish()),
            Ok(process) => self.process = Some(process),
            Err(e) => self.learnt(Err(e)),
        }
    }

    fn feed(&mut self, camera: CameraId, lost: u64, bytes: &[u8]) {
        self.worker.feed(camera, lost, bytes);
    }

    fn poll(&mut self, _: HostTime) -> Option<SenseAnswer> {
        if let Some(mut process) = self.process.take() {
            if process.is_running() {
                self.process = Some(process);
            } else {
                self.learnt(process.finish());
            }
        }
        if let Some(answer) = self.answers.pop_front() {
            return Some(answer);
        }
        loop {
            match self.worker.news()? {
                News::Started => {}
                News::Failed(e) => {
                    return Some(SenseAnswer::Off(SenseFault::Failed(e.to_string())));
                }
                News::Estimate(estimate, sd_us) => {
                    return Some(SenseAnswer::Felt(sensed(&estimate, sd_us)));
                }
                News::Skipped { until_us } => {
                    return Some(SenseAnswer::Felt(SensedTouch {
                        until: time(until_us),
                        until_sd_ns: 0,
                        kind: TouchKind::Skipped,
                        at_mm: None,
                        region: None,
                        depth: None,
                        llr: None,
                    }));
                }
            }
        }
    }
}

const fn time(us: i64) -> HostTime {
    HostTime(us * 1_000)
}

fn sensed(estimate: &Estimate, sd_us: f64) -> SensedTouch {
    let until_sd_ns = (sd_us * 1e3) as i64;
    match estimate {
        Estimate::Felt(d) => felt(d, until_sd_ns),
        Estimate::Position { host_us, position } => located(*host_us, position, until_sd_ns),
    }
}

fn felt(d: &Detection, until_sd_ns: i64) -> SensedTouch {
    let (kind, is_onset) = match d.felt {
        Felt::Onset => (TouchKind::Onset, true),
        Felt::Withdrawn => (TouchKind::Withdrawn, false),
        Felt::Release => (TouchKind::Release, false),
    };
    SensedTouch {
        until: time(d.host_us),
        until_sd_ns,
        kind,
        at_mm: is_onset.then_some(d.near_mm),
        region: None,
        depth: None,
        llr: is_onset.then_some(d.llr),
    }
}

fn located(host_us: i64, position: &Position, until_sd_ns: i64) -> SensedTouch {
    let at = position.location;
    SensedTouch {
        until: time(host_us),
        until_sd_ns,
        kind: TouchKind::Position,
        at_mm: at.map(|l| l.at),
        region: at.and(position.region).map(|r| TouchRegion {
            semi_axes_mm: r.semi_axes_mm,
            angle_deg: r.angle_deg,
        }),
        depth: position.depth,
        llr: None,
    }
}

/// `skinrig learn-skin`: learns a [`SkinModel`] from the calibration presses of a session and prints it as JSON.
///
/// # Errors
/// [`Failure`] if the presses are unusable or too few.
pub(crate) fn learn_skin(args: &LearnSkinArgs) -> Outcome {
    lower_priority();
    let skin = skinrig_results::learn_skin(&args.session, args.false_alarms)?;
    outln!(
        "{}",
        serde_json::to_string(&skin).map_err(Failure::internal)?
    );
    Ok(Exit::Ok)
}
