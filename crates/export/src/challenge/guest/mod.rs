//! Examines a guest: another program that learns from the calibration presses of a session and locates its scored ones.
//!
//! The guest never receives the position, planned depth or session number of a scored press, and the order of the presses is random.
//! Its answers are scored with the metrics and intervals of an analysis, beside the session's own locator on the same presses. Scored
//! presses mostly repeat the places of the calibration presses, which rewards a guest that memorises them: it is therefore also
//! examined on calibration presses at places that it did not learn.

mod error;
mod message;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde::Serialize;
use skinrig_analysis::locator::CameraFeatures;
use skinrig_analysis::metrics::mean_over_locations;
use skinrig_analysis::result::Estimate;
use skinrig_model::{CameraId, Verdict};

pub use self::error::GuestError;
use self::message::{CameraLine, Introduction, Message, PROTOCOL, introduction, position};
use super::answers::Answers;
use super::error::ChallengeError;
use super::estimates::{Estimates, Implausible, Position};
use super::make::{EventQuery, Press, answers_about, chosen};
use super::score::{Judgement, judge};
use crate::source::Source;

/// A program at the other end of a line.
pub trait Guest {
    /// Sends a line, without its end. Returns before the guest has read it.
    fn tell(&mut self, line: String);
    /// The guest's next line; `to`: what it answers, for errors.
    ///
    /// # Errors
    /// [`GuestError::Ended`] and [`GuestError::Silent`].
    fn answer(&mut self, to: &str, within: Duration) -> Result<String, GuestError>;
    /// No more lines will be sent: waits for the guest's end.
    ///
    /// # Errors
    /// [`GuestError`] if it sends more lines, or does not end successfully within this time.
    fn end(&mut self, within: Duration) -> Result<(), GuestError>;
}

/// How long a guest may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// To learn.
    pub fit: Duration,
    /// For one press, and to end.
    pub press: Duration,
}

/// How good a guest is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Examination {
    /// Name that the guest gave.
    pub name: String,
    /// Version that the guest gave.
    pub version: String,
    /// Presses it learnt from.
    pub calibrating: u32,
    /// Time from `fit` to its answer, s.
    pub fit_s: f64,
    /// Time from sending a press to its answer, µs: median, and the slowest of 100.
    pub locate_us: [f64; 2],
    /// The guest on the scored presses.
    pub guest: Judgement,
    /// The session's own locator on the same presses; what the analysis excludes counts as not located.
    pub own: Judgement,
    /// Mean difference in error, guest minus own, mm, over presses that both locate.
    pub difference_mm: Estimate,
    /// Both at places that they did not learn; `None` for fewer than five calibration locations.
    pub left_out: Option<LeftOut>,
}

/// Calibration presses, each located by what was learnt at other places.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The guest, which learnt four fifths of the places each time.
    pub guest: Judgement,
    /// RMSE of the session's own locator at left-out places, mm, as in its report; `None` if it was not compared.
    pub own_rmse_mm: Option<Estimate>,
}

/// Parts of the calibration locations that are left out in turn.
const PARTS: usize = 5;

/// A press with its number.
type Numbered<'a> = (u32, &'a Press<'a>);

/// Examines a guest on an analysed session. `start` starts it anew for every set of presses to learn from. `events` reads the
/// events of a camera between two times of its recorded clock; with `None` the guest sees columns, spreads and counts alone.
/// `salt`: random bytes that decide the order of the presses.
///
/// # Errors
/// [`ChallengeError`] when the session is INVALID, too few presses are usable, or the guest does not do its part.
pub fn examine<G: Guest>(
    source: &Source<'_>,
    salt: [u8; 32],
    timeouts: Timeouts,
    mut events: Option<&mut EventQuery<'_>>,
    mut start: impl FnMut() -> Result<G, GuestError>,
) -> Result<Examination, ChallengeError> {
    let presses = chosen(source, salt)?;
    let numbered = (1..).zip(&presses);
    let (scored, known): (Vec<Numbered<'_>>, Vec<Numbered<'_>>) =
        numbered.partition(|(_, p)| p.is_scored());
    let mut sit = |learnt: &[Numbered<'_>], asked: &[Numbered<'_>]| {
        let mut sitting = Sitting {
            guest: start()?,
            source,
            events: events.as_deref_mut(),
            timeouts,
        };
        sitting.run(learnt, asked)
    };
    let sitting = sit(&known, &scored)?;
    let answers = answers_about(source, &scored, salt)?;
    let found = checked(sitting.found, &answers)?;
    let own: BTreeMap<_, _> = scored.iter().map(|(n, p)| (*n, own_position(p))).collect();
    let own = Estimates {
        has_regions: own.values().flatten().any(|p| p.region.is_some()),
        presses: own,
    };
    let mut places: Vec<u32> = known.iter().map(|(_, p)| p.row.location.index()).collect();
    places.sort_unstable();
    places.dedup();
    let left_out = if places.len() < PARTS {
        None
    } else {
        let mut found = BTreeMap::new();
        for part in 0..PARTS {
            let is_asked = |(_, p): &Numbered<'_>| {
                places.binary_search(&p.row.location.index()).unwrap_or(0) % PARTS == part
            };
            let (asked, learnt): (Vec<_>, Vec<_>) = known.iter().copied().partition(is_asked);
            found.extend(sit(&learnt, &asked)?.found);
        }
        let answers = answers_about(source, &known, salt)?;
        Some(LeftOut {
            guest: judge(&answers, &checked(found, &answers)?),
            own_rmse_mm: own_left_out(source),
        })
    };
    let mut took_us = sitting.took_us;
    took_us.sort_by(f64::total_cmp);
    let at = |share: f64| took_us[((took_us.len() - 1) as f64 * share).round() as usize];
    Ok(Examination {
        name: sitting.about.name,
        version: sitting.about.version,
        calibrating: known.len() as u32,
        fit_s: sitting.fit_s,
        locate_us: [at(0.5), at(0.99)],
        difference_mm: difference(&answers, &found, &own),
        guest: judge(&answers, &found),
        own: judge(&answers, &own),
        left_out,
    })
}

/// One run of a guest.
struct Sitting<'a, 'e, G> {
    guest: G,
    source: &'a Source<'a>,
    events: Option<&'a mut EventQuery<'e>>,
    timeouts: Timeouts,
}

/// Answers of a guest.
struct Heard {
    about: Introduction,
    fit_s: f64,
    took_us: Vec<f64>,
    found: BTreeMap<u32, Option<Position>>,
}

impl<G: Guest> Sitting<'_, '_, G> {
    fn run(
        &mut self,
        learnt: &[Numbered<'_>],
        asked: &[Numbered<'_>],
    ) -> Result<Heard, ChallengeError> {
        let outline = self.source.analysis.map(|(a, _)| a.rig.outline);
        self.guest.tell(line(&Message::Begin {
            protocol: PROTOCOL,
            outline: outline.as_ref(),
            calibrating: learnt.len(),
            scored: asked.len(),
        }));
        for (number, press) in learnt {
            let cameras = self.cameras(press)?;
            self.guest.tell(line(&Message::Learn {
                press: *number,
                location: press.row.location.number(),
                x_mm: press.truth.x_mm,
                y_mm: press.truth.y_mm,
                cameras,
            }));
        }
        let begun = Instant::now();
        self.guest.tell(line(&Message::Fit));
        let about = introduction(&self.guest.answer("`fit`", self.timeouts.fit)?)?;
        let fit_s = begun.elapsed().as_secs_f64();
        let (mut found, mut took_us) = (BTreeMap::new(), Vec::new());
        for (number, press) in asked {
            let message = line(&Message::Locate {
                press: *number,
                cameras: self.cameras(press)?,
            });
            let begun = Instant::now();
            self.guest.tell(message);
            let to = format!("`locate` of press {number}");
            let answer = self.guest.answer(&to, self.timeouts.press)?;
            took_us.push(begun.elapsed().as_secs_f64() * 1e6);
            found.insert(*number, position(&answer, *number)?);
        }
        self.guest.end(self.timeouts.press)?;
        Ok(Heard {
            about,
            fit_s,
            took_us,
            found,
        })
    }

    fn cameras(&mut self, press: &Press<'_>) -> Result<[CameraLine; 2], ChallengeError> {
        let features = CameraFeatures::of_press(press.row);
        let mut line = |camera: CameraId| -> Result<CameraLine, ChallengeError> {
            let events = match &mut self.events {
                Some(events) => Some(press.events(self.source, camera, &mut **events)?),
                None => None,
            };
            Ok(CameraLine::new(&features[camera.index()], events))
        };
        let [one, two] = CameraId::ALL;
        Ok([line(one)?, line(two)?])
    }
}

/// RMSE of the session's own locator at left-out places.
fn own_left_out(source: &Source<'_>) -> Option<Estimate> {
    let (analysis, _) = source.analysis?;
    let compared = &analysis.locator.as_ref()?.compared;
    compared.iter().find(|c| c.chosen).map(|c| c.rmse_mm)
}

fn line(message: &Message<'_>) -> String {
    // Numbers and text always serialise.
    serde_json::to_string(message).unwrap_or_default()
}

/// Result of the analysis for a press; empty for an excluded one.
fn own_position(press: &Press<'_>) -> Option<Position> {
    let at = press.row.location_outcome.estimate()?;
    let valid = press.row.verdict == Verdict::Valid;
    valid.then_some(Position {
        at: [at.x_mm, at.y_mm],
        region: press.row.region,
    })
}

/// The guest's answers, if they can be positions in mm, and if all or none state regions.
fn checked(
    presses: BTreeMap<u32, Option<Position>>,
    answers: &Answers,
) -> Result<Estimates, GuestError> {
    let located = presses.values().flatten().count();
    let without = presses
        .iter()
        .filter(|(_, p)| p.is_some_and(|p| p.region.is_none()));
    let without: Vec<u32> = without.map(|(press, _)| *press).collect();
    let estimates = Estimates {
        presses,
        has_regions: located > without.len(),
    };
    match estimates.implausible(&answers.outline) {
        Some(Implausible::FarAway {
            press,
            at: [x_mm, y_mm],
            away_mm,
            most_mm,
        }) => Err(GuestError::FarAway {
            press,
            x_mm,
            y_mm,
            away_mm,
            most_mm,
        }),
        Some(Implausible::Tiny { extent_mm }) => Err(GuestError::Tiny { extent_mm }),
        None => match without[..] {
            [first, ..] if estimates.has_regions => Err(GuestError::SomeRegions {
                without: without.len(),
                located,
                first,
            }),
            _ => Ok(estimates),
        },
    }
}

/// Mean difference in error over the presses that both locate, mm.
fn difference(answers: &Answers, guest: &Estimates, own: &Estimates) -> Estimate {
    let differences: Vec<(u32, f64)> = answers
        .presses
        .iter()
        .filter_map(|answer| {
            let error = |of: &Estimates| {
                let position = of.presses.get(&answer.press).copied().flatten()?;
                let [x, y] = position.at;
                Some(libm::hypot(x - answer.x_mm, y - answer.y_mm))
            };
            Some((answer.location, error(guest)? - error(own)?))
        })
        .collect();
    mean_over_locations(&differences, answers.bootstrap_resamples, answers.seed)
}
