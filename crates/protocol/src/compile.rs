//! Protocol to plan: depths unrolled, orders shuffled, times and deadlines computed.
//!
//! The order of a repetition is drawn by a Fisher-Yates shuffle from xoshiro256++ seeded with the order's seed and
//! jumped once (2^128 draws), so that it shares nothing with random locations of the same seed. All repetitions
//! draw from the one stream, so each has its own order. An index below `n` is `(draw * n) >> 64` of a 64-bit draw.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_model::{
    HostDuration, LocationId, Places, PlannedPress, Point2, Point3, PressId, PressRole,
    RepetitionId, Skin,
};

use crate::plan::{Plan, PressStep, Step};
use crate::protocol::Protocol;
use crate::surface::Surface;
use crate::surface_check::SurfaceCheck;
use crate::timing;

/// Version of the plan's layout.
pub(crate) const PLAN_VERSION: u32 = 1;

/// See [`Protocol::compile`].
fn compile(protocol: &Protocol) -> Plan {
    let mut writer = Writer {
        protocol,
        position: protocol.motion.home,
        presses: Vec::new(),
        steps: Vec::new(),
    };
    if let Some(sync) = &protocol.sync {
        writer.travel(sync.at);
        writer.steps.push(Step::Begin { repetition: None });
        for k in 0..sync.count {
            let planned = PlannedPress {
                id: PressId::from_index(0),
                role: PressRole::Sync,
                repetition: RepetitionId::default(),
                location: LocationId::default(),
                at: sync.at,
                depth_mm: sync.depth_mm,
            };
            writer.press(planned, Some(f64::from(k) * sync.interval_s));
        }
        writer.pause(sync.pause_after);
    }
    // A position that the path lists again is the same location.
    let mut places = Places::default();
    let places: Vec<u32> = protocol
        .locations
        .iter()
        .map(|at| places.add(*at))
        .collect();
    let visits: Vec<(usize, f64)> = protocol
        .depths_mm
        .iter()
        .flat_map(|d| (0..protocol.locations.len()).map(move |l| (l, *d)))
        .collect();
    let mut shuffle = protocol.shuffle_seed.map(|seed| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        rng.jump();
        rng
    });
    for (index, role) in (0u32..).zip(&protocol.roles) {
        let repetition = RepetitionId::from_index(index);
        let mut visits = visits.clone();
        if let (Some(at), PressRole::Calibrate) = (&protocol.calibrate_at, role) {
            visits.retain(|(location, _)| at.binary_search(location).is_ok());
        }
        if let Some(rng) = &mut shuffle {
            for i in (1..visits.len()).rev() {
                let j = (u128::from(rng.next_u64()) * (i as u128 + 1)) >> 64;
                visits.swap(i, j as usize);
            }
        }
        writer.learn_before(index as usize);
        let first = visits.first().and_then(|(l, _)| protocol.locations.get(*l));
        if index > 0 {
            if let Some(first) = first.filter(|_| protocol.return_to_start) {
                writer.travel(*first);
            }
            writer.pause(protocol.pause_between);
        }
        if let Some(first) = first {
            writer.travel(*first);
        }
        writer.steps.push(Step::Begin {
            repetition: Some(repetition),
        });
        for (k, (location, depth_mm)) in visits.into_iter().enumerate() {
            let (Some(&at), Some(&place)) =
                (protocol.locations.get(location), places.get(location))
            else {
                continue;
            };
            let planned = PlannedPress {
                id: PressId::from_index(0),
                role: *role,
                repetition,
                location: LocationId::from_index(place),
                at,
                depth_mm,
            };
            writer.travel(at);
            writer.press(planned, protocol.motion.period_s.map(|p| p * k as f64));
        }
        writer.look_after(repetition);
    }
    Plan {
        version: PLAN_VERSION,
        name: protocol.name.clone(),
        seed: protocol.seed,
        limits: protocol.limits,
        surroundings: Some(protocol.surroundings.clone()),
        retakes: protocol.retakes,
        max_consecutive_invalid: protocol.max_consecutive_invalid,
        surface_check: protocol.surface_check.clone().map(|check| SurfaceCheck {
            // A rig file may say how to touch when the protocol does not.
            search: match protocol.surface {
                Some(Surface::Touch(search)) => search,
                _ => check.search,
            },
            ..check
        }),
        suspend: protocol.suspend,
        stop: protocol.stop.as_ref().map(|stop| stop.rule),
        online: protocol.online,
        presses: writer.presses,
        steps: writer.steps,
    }
}

impl Protocol {
    /// The plan of this protocol: a pure function of the protocol's text, overrides and named files.
    #[must_use]
    pub fn compile(&self) -> Plan {
        compile(self)
    }
}

struct Writer<'a> {
    protocol: &'a Protocol,
    position: Point3<Skin>,
    presses: Vec<PlannedPress>,
    steps: Vec<Step>,
}

impl Writer<'_> {
    /// Moves above `to` unless the tip is known to be there. The first travel is always written: the plan does not contain
    /// the robot's position before the run.
    fn travel(&mut self, to: Point2) {
        let to = to.at_height(self.protocol.limits.clearance_mm);
        if to == self.position && !self.steps.is_empty() {
            return;
        }
        let speed_mm_s = self.protocol.motion.travel_mm_s;
        let distance = if self.steps.is_empty() {
            // From anywhere in the workspace.
            let limits = &self.protocol.limits;
            let min: Point3<Skin> = point(limits.workspace_min_mm);
            min.distance_mm(point(limits.workspace_max_mm))
        } else {
            self.position.distance_mm(to)
        };
        let estimate = timing::travel_s(&self.protocol.limits, distance, speed_mm_s);
        self.steps.push(Step::Travel {
            to,
            speed_mm_s,
            deadline: timing::deadline(estimate),
        });
        self.position = to;
    }

    fn pause(&mut self, duration: HostDuration) {
        if duration > HostDuration::ZERO {
            self.steps.push(Step::Pause { duration });
        }
    }

    /// The declared look after `repetition`, if there is one.
    fn look_after(&mut self, repetition: RepetitionId) {
        let declared = self.protocol.stop.iter().flat_map(|stop| &stop.after);
        if let Some((number, _)) = (1u32..).zip(declared).find(|(_, r)| **r == repetition) {
            self.steps.push(Step::Look { number, repetition });
        }
    }

    /// What is felt is learnt before the first scored repetition.
    fn learn_before(&mut self, repetition: usize) {
        let is_scored = |role: &PressRole| *role == PressRole::Score;
        let first = self.protocol.roles.iter().position(is_scored);
        if self.protocol.online.is_some() && first == Some(repetition) {
            self.steps.push(Step::Learn);
        }
    }

    fn press(&mut self, planned: PlannedPress, start_s: Option<f64>) {
        let id = PressId::from_index(self.presses.len() as u32);
        let (limits, motion) = (&self.protocol.limits, &self.protocol.motion);
        let depth_mm = planned.depth_mm;
        let mut step = PressStep {
            press: id,
            at: planned.at,
            depth_mm,
            surface: self.protocol.surface.unwrap_or_default(),
            start_after_begin: start_s.map(HostDuration::from_secs_f64),
            approach_speed_mm_s: motion.approach.speed_mm_s(limits.clearance_mm),
            indent_speed_mm_s: motion.indent.speed_mm_s(depth_mm),
            hold: motion.hold,
            react: self
                .protocol
                .online
                .and_then(|o| o.react)
                .filter(|_| planned.role == PressRole::Score),
            retract_speed_mm_s: motion.retract.speed_mm_s(limits.clearance_mm + depth_mm),
            marks: self.protocol.marks.clone(),
            deadline: HostDuration::ZERO,
        };
        let (moving, still) = timing::press_s(limits, &step);
        step.deadline = timing::deadline(moving + still);
        self.presses.push(PlannedPress { id, ..planned });
        self.steps.push(Step::Press(step));
    }
}

fn point(c: [f64; 3]) -> Point3<Skin> {
    Point3::new(c[0], c[1], c[2])
}
