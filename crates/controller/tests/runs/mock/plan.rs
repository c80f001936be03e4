//! Plan, header and sink of the small rig.

use super::*;

/// Three presses at two locations.
pub(crate) fn plan() -> Plan {
    let places = [(10.0, 2.0), (10.0, 2.0), (14.0, -6.0)];
    let presses: Vec<PlannedPress> = places
        .iter()
        .enumerate()
        .map(|(i, (x, y))| PlannedPress {
            id: PressId::from_index(i as u32),
            role: PressRole::Score,
            repetition: RepetitionId::default(),
            location: LocationId::from_index(i as u32),
            at: Point2::new(*x, *y),
            depth_mm: 2.0,
        })
        .collect();
    let mut steps = vec![Step::Begin {
        repetition: Some(RepetitionId::default()),
    }];
    for (i, p) in presses.iter().enumerate() {
        steps.push(Step::Travel {
            to: p.at.at_height(5.0),
            speed_mm_s: 100.0,
            deadline: HostDuration::from_millis(2000),
        });
        steps.push(Step::Press(PressStep {
            press: p.id,
            at: p.at,
            depth_mm: 2.0,
            surface: Surface::Known,
            start_after_begin: Some(HostDuration::from_millis(300 + 503 * i as i64)),
            approach_speed_mm_s: 50.0,
            indent_speed_mm_s: 20.0,
            react: None,
            hold: HostDuration::from_millis(30),
            retract_speed_mm_s: 70.0,
            marks: vec![MarkKind::Contact, MarkKind::AtDepth, MarkKind::Release],
            deadline: HostDuration::from_millis(1000),
        }));
    }
    steps.push(Step::Pause {
        duration: HostDuration::from_millis(52),
    });
    Plan {
        version: 1,
        name: "mock".into(),
        seed: 1,
        limits: LIMITS,
        surroundings: Some(Surroundings::of(SkinOutline::PAPER)),
        retakes: Retakes::NONE,
        max_consecutive_invalid: 0,
        surface_check: None,
        suspend: Suspend::default(),
        stop: None,
        online: None,
        presses,
        steps,
    }
}

pub(crate) fn header(plan: &Plan) -> RunHeader {
    RunHeader {
        protocol_text: String::new(),
        protocol_name: "mock".into(),
        protocol_sha256: String::new(),
        overrides: vec![],
        plan_json: "{}".into(),
        plan_sha256: String::new(),
        seed: 1,
        rig_kind: "simulated".into(),
        rig_name: "mock".into(),
        rig_json: "{}".into(),
        robot_from_skin: robot_from_skin(),
        stream_formats: [StreamFormat::Evt2; 2],
        prototype: "p".into(),
        operator: "o".into(),
        started_at: String::new(),
        host: String::new(),
        software: String::new(),
        command_line: String::new(),
        presses: plan.presses.clone(),
    }
}

/// How a sink fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SinkFailure {
    Once,
    Forever,
    Panic,
    /// Accepts the record, but reports it as delayed.
    Late,
}

/// Stores records; can fail at the record with this number (from 0).
#[derive(Default)]
pub(crate) struct Sink {
    pub records: Vec<Record>,
    pub fail: Option<(usize, SinkFailure)>,
    pub offered: usize,
    /// Time taken for every record but poses, ms of the rig's clock.
    pub slow: Option<(Shared, i64)>,
}

impl RecordSink for Sink {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        let n = self.offered;
        self.offered += 1;
        if let Some((world, ms)) = &self.slow
            && !matches!(record, Record::Poses(_))
        {
            lock(world).t += ms * MS;
        }
        match self.fail {
            Some((k, SinkFailure::Once)) if n == k => Err(SinkFault::Rejected("disk full".into())),
            Some((k, SinkFailure::Forever)) if n >= k => {
                Err(SinkFault::Rejected("disk full".into()))
            }
            Some((k, SinkFailure::Panic)) if n == k => {
                std::panic::panic_any("sink panics".to_owned())
            }
            Some((k, SinkFailure::Late)) if n == k => {
                self.records.push(record);
                Err(SinkFault::Delayed("disk slow".into()))
            }
            _ => {
                self.records.push(record);
                Ok(())
            }
        }
    }
}
