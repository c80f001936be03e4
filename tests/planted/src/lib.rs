//! Sessions created in memory, press by press: inputs of the analysis and events.

pub mod grid;

use skinrig_analysis::result::PressView;
use skinrig_analysis::{EventSource, EventSourceError, SessionInput};
use skinrig_model::{
    AnalysisSettings, AttemptId, CameraId, CdEvent, HostTime, LocationId, Mark, MarkKind,
    PlannedPress, Point2, PressId, PressOutcome, PressRole, PressTiming, PressVerdict, PulseTrain,
    RepetitionId, RigGeometry, SentMark, TriggerEdge,
};

/// Events in memory.
pub struct Memory {
    /// Events of each camera.
    pub events: [Vec<CdEvent>; 2],
    /// Number of events per slice.
    pub slice: usize,
}

impl EventSource for Memory {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        self.events[camera.index()]
            .chunks(self.slice)
            .for_each(each);
        Ok(())
    }
}

/// Sorts events by time; those of one time keep their order. Optimised, unlike the tests that call it.
pub fn sort(events: &mut [CdEvent]) {
    events.sort_by_key(|event| event.t_us);
}

/// A session without presses.
#[must_use]
pub fn session(rig: RigGeometry, settings: AnalysisSettings) -> SessionInput {
    SessionInput {
        planned: Vec::new(),
        outcomes: Vec::new(),
        earlier: Vec::new(),
        stopped: Vec::new(),
        edges: [Vec::new(), Vec::new()],
        marks: Vec::new(),
        gaps: [Vec::new(), Vec::new()],
        recorded: [Vec::new(), Vec::new()],
        box_reports: Vec::new(),
        pose_interval_us: None,
        crossing_se_us: None,
        descents: Vec::new(),
        hold_forces_n: Vec::new(),
        legs: Vec::new(),
        rig,
        settings,
        recorded_settings: None,
    }
}

/// A valid press as planned and measured.
#[derive(Debug, Clone, Copy)]
pub struct PlantedPress {
    /// Role.
    pub role: PressRole,
    /// Index of the repetition, from 0.
    pub repetition: u32,
    /// Index of the location.
    pub location: u32,
    /// Planned position.
    pub at: Point2,
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Measured times.
    pub timing: PressTiming,
    /// Measured position.
    pub measured_at: Point2,
    /// Measured depth, mm; `None` if not measured.
    pub measured_depth_mm: Option<f64>,
    /// True if its times come from a schedule.
    pub scheduled: bool,
}

impl PlantedPress {
    /// A press at its planned position, 2 mm deep.
    #[must_use]
    pub fn new(role: PressRole, repetition: u32, location: u32, at: Point2) -> Self {
        Self {
            role,
            repetition,
            location,
            at,
            depth_mm: 2.0,
            timing: timing(0.0, [0.0; 5]),
            measured_at: at,
            measured_depth_mm: Some(2.0),
            scheduled: false,
        }
    }
}

/// Times of a press with contact at `contact_s` on the host clock, from the durations before contact (approach) and after it
/// (at depth, retract, release, clear), s.
#[must_use]
pub fn timing(
    contact_s: f64,
    [before, at_depth, retract, release, clear]: [f64; 5],
) -> PressTiming {
    let after = |s: f64| HostTime::from_secs_f64(contact_s + s);
    PressTiming {
        approach: HostTime::from_secs_f64(contact_s - before),
        contact: after(0.0),
        at_depth: after(at_depth),
        retract: after(retract),
        release: after(release),
        clear: after(clear),
    }
}

/// What a camera saw of a press: one cluster of all its events, in column `u`.
pub const fn view(u: f64, events: u32) -> Option<PressView> {
    Some(PressView {
        events,
        on_events: events / 2,
        clusters: 1,
        cluster_events: events,
        centroid_u: Some(u),
        centroid_v: Some(270.0),
        rate_per_s: 1e3,
        idle_rate_per_s: 10.0,
        idle_s: 0.5,
        spread_u: None,
        spread_v: None,
        width_u: None,
        core_threshold: None,
    })
}

/// Adds a press to `input` and returns its ID.
pub fn press(input: &mut SessionInput, touch: PlantedPress) -> PressId {
    let id = PressId::from_index(input.planned.len() as u32);
    input.planned.push(PlannedPress {
        id,
        role: touch.role,
        repetition: RepetitionId::from_index(touch.repetition),
        location: LocationId::from_index(touch.location),
        at: touch.at,
        depth_mm: touch.depth_mm,
    });
    input.outcomes.push(Some(PressOutcome {
        attempt: AttemptId {
            press: id,
            number: 1,
        },
        verdict: PressVerdict::Valid,
        timing: Some(touch.timing),
        measured_at: Some(touch.measured_at),
        measured_depth_mm: touch.measured_depth_mm,
        touched_mm: None,
        peak_force_n: None,
        scheduled: touch.scheduled,
    }));
    id
}

/// Sends a mark of `press` at `t`; camera `k` sees its first edge at `seen_us(k)` on its own clock.
pub fn mark(
    input: &mut SessionInput,
    (kind, press): (MarkKind, PressId),
    t: HostTime,
    uncertainty_ns: i64,
    mut seen_us: impl FnMut(usize) -> u64,
) {
    let mark = Mark { kind, press };
    input.marks.push(SentMark {
        mark,
        t,
        uncertainty_ns,
    });
    for (k, edges) in input.edges.iter_mut().enumerate() {
        let begins_us = seen_us(k);
        let pulses = PulseTrain::new(mark).into_iter().flat_map(|p| p.pulses());
        let levels = pulses.flat_map(|(rise, width)| [(rise, true), (rise + width, false)]);
        edges.extend(levels.map(|(after_us, rising)| TriggerEdge {
            t_us: begins_us + after_us,
            channel: 0,
            rising,
        }));
    }
}
