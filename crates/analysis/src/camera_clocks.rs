//! Owns the clocks of the cameras before segmentation: from the time base, from marks, or from the presses in the event
//! rates.

use skinrig_model::CameraId;

use crate::accumulate::{Accumulator, PassRequest, pass};
use crate::clock::{MarksError, align_by_rates, fit_marks};
use crate::error::AnalysisError;
use crate::event_cache::EventCache;
use crate::hot_pixels::PixelCounts;
use crate::input::{EventSource, SessionInput};
use crate::press_spans::{spans, timings};
use crate::rates::CameraRates;
use crate::result::{
    Activity, AlignmentViolation, ClockFit, OffSensor, RatesDetections, RatesEvidence,
    ReadoutFault, WarningCause,
};
use crate::segment::windows;
use crate::tie::{Tie, UntimedPress};
use crate::timebase::TimeBase;
use crate::untimed;

/// Largest share of events that equal the one before; a camera sends none, since a pixel is blind after an event.
const MOST_REPEATED: f64 = 0.1;

/// Clock of a camera, and by-products of finding it.
pub(crate) struct CameraClock {
    pub clock: Option<ClockFit>,
    pub rates: Option<CameraRates>,
    pub activity: Option<Activity>,
    pub cache: Option<EventCache>,
    /// Counts per pixel; `None` if the clock was not known before the events.
    pub pixels: Option<PixelCounts>,
    /// Per row of the plan: why the clock does not time it.
    pub untimed: Vec<Option<UntimedPress>>,
    pub off_sensor: OffSensor,
    pub warnings: Vec<WarningCause>,
}

/// Clocks of both cameras.
pub(crate) struct CameraClocks {
    pub cameras: [CameraClock; 2],
    /// Certainty of the alignment by event rates; `None` if no camera was aligned by them.
    pub evidence: Option<RatesEvidence>,
    /// Reasons why that alignment cannot be used.
    pub violations: Vec<AlignmentViolation>,
}

impl CameraClocks {
    /// Reads the events and finds the clocks; cameras in parallel if the pool has several threads.
    pub(crate) fn new(
        input: &SessionInput,
        source: &dyn EventSource,
        base: Option<&TimeBase>,
    ) -> Result<Self, AnalysisError> {
        let read = |camera: CameraId| CameraClock::new(input, source, camera, base);
        let (one, two) = rayon::join(|| read(CameraId::One), || read(CameraId::Two));
        let mut readings = Self {
            cameras: [one?, two?],
            evidence: None,
            violations: Vec::new(),
        };
        readings.align(input);
        Ok(readings)
    }

    /// Finds missing clocks from the event rates of all cameras without one.
    fn align(&mut self, input: &SessionInput) {
        let spans = spans(input);
        let rates = [0, 1].map(|k| {
            let reading = &self.cameras[k];
            reading
                .rates
                .as_ref()
                .filter(|_| reading.clock.is_none())
                .map(CameraRates::fixed)
        });
        if spans.is_empty() || rates.iter().all(Option::is_none) {
            return;
        }
        let found = align_by_rates(rates, &spans);
        self.evidence = found.evidence;
        for (k, fit) in found.cameras.into_iter().enumerate() {
            let reading = &mut self.cameras[k];
            match fit {
                Some(Ok(fit)) => {
                    reading.clock = Some(fit.fit);
                    reading.warnings.extend(fit.warnings);
                }
                Some(Err(why)) => {
                    let camera = CameraId::ALL[k];
                    self.violations
                        .push(AlignmentViolation::NoRatesClock { camera, why });
                    reading.warnings.push(WarningCause::NoRatesClock { why });
                }
                None => {}
            }
        }
        let limits = &input.settings.alignment;
        let sights = self.evidence.iter().flat_map(|e| e.cameras);
        for (camera, sights) in CameraId::ALL.into_iter().zip(sights) {
            let beyond = sights.and_then(|s| unexplained(camera, &s, limits.min_explained));
            self.violations.extend(beyond);
        }
        let least = limits.min_log_odds;
        if let Some(evidence) = self.evidence.filter(|e| e.log_odds < least) {
            self.violations.push(doubt(&evidence, least));
        }
    }
}

impl CameraClock {
    fn new(
        input: &SessionInput,
        source: &dyn EventSource,
        camera: CameraId,
        base: Option<&TimeBase>,
    ) -> Result<Self, AnalysisError> {
        let k = camera.index();
        let base_clock = base.and_then(|b| b.clocks[k]);
        let by_marks = || {
            let channel = input.rig.trigger_channel.ok_or(MarksError::NoChannel)?;
            fit_marks(&input.edges[k], channel, &input.marks)
        };
        let (marks, why) = match base_clock.is_none().then(by_marks) {
            Some(Ok(fit)) => (Some(fit), None),
            Some(Err(why)) => (None, Some(why)),
            None => (None, None),
        };
        let mut reading = Self {
            clock: base_clock.or(marks.as_ref().map(|m| m.fit)),
            rates: None,
            activity: None,
            cache: None,
            pixels: None,
            untimed: untimed::rows(input, camera, base, marks.as_ref()),
            off_sensor: OffSensor::default(),
            warnings: Vec::new(),
        };
        let by_marks = |u: &&UntimedPress| u.tie == Tie::Mark;
        let far = reading.untimed.iter().flatten().filter(by_marks).count();
        if far > 0 {
            reading.warnings.push(WarningCause::PressesFarFromMarks {
                presses: far,
                limit_s: input.settings.alignment.max_tie_distance_us * 1e-6,
            });
        }
        reading
            .warnings
            .extend(marks.into_iter().flat_map(|m| m.warnings));
        if let Some(why) = why.filter(|_| !input.marks.is_empty()) {
            reading.warnings.push(WarningCause::NoMarksClock {
                sent: input.marks.len(),
                edges: input.edges[k].len(),
                why,
            });
        }
        let settings = &input.settings;
        let pixels = reading.clock.map(|clock| {
            let windows = windows(timings(input), &input.earlier, &clock, settings);
            PixelCounts::new(settings.crop_v[k], &windows)
        });
        let wanted = PassRequest {
            rates: Some(CameraRates::new(settings)),
            cache: Some(EventCache::default()),
            pixels,
            ..PassRequest::default()
        };
        let first = pass(source, camera, Accumulator::new(camera, settings, wanted))?;
        let (repeated, events) = (first.repeated, first.off_sensor.of);
        if repeated as f64 > MOST_REPEATED * events as f64 {
            let cause = ReadoutFault::EventsTwice { repeated, events };
            reading.warnings.push(WarningCause::Readout(cause));
        }
        Ok(Self {
            rates: first.rates,
            activity: first.activity,
            cache: first.cache,
            pixels: first.pixels,
            off_sensor: first.off_sensor,
            ..reading
        })
    }
}

/// Why the plan does not match the recording of a camera.
fn unexplained(
    camera: CameraId,
    sights: &RatesDetections,
    least: f64,
) -> Option<AlignmentViolation> {
    let share = |n: u32, of: u32| f64::from(n) / f64::from(of.max(1));
    let (found, bursts) = (sights.found, sights.found + sights.strays);
    let least_percent = 100.0 * least;
    if share(found, sights.expected) < least {
        return Some(AlignmentViolation::PressesWithoutBursts {
            camera,
            least_percent,
            presses: sights.expected,
            found,
        });
    }
    (share(found, bursts) < least).then_some(AlignmentViolation::BurstsWithoutPresses {
        camera,
        least_percent,
        bursts,
        found,
    })
}

/// Why an alignment by event rates is not certain enough.
fn doubt(evidence: &RatesEvidence, least: f64) -> AlignmentViolation {
    let aligned = evidence.cameras.map(|sights| sights.is_some());
    AlignmentViolation::UncertainRates {
        least_log_odds: least,
        log_odds: evidence.log_odds,
        runner_up_s: evidence
            .runner_up_s
            .map(|shifts_s| [0, 1].map(|k| aligned[k].then_some(shifts_s[k]))),
        period_s: evidence.period_s,
    }
}
