//! Schedules: when and where a recording that was made without skinrig was pressed.

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::{
    AnalysisSettings, HostDuration, HostTime, LocationId, PlannedPress, Point2, PressId, PressRole,
    PressTiming, RepetitionId, RigGeometry, StereoGeometry,
};
use skinrig_settings::{Settings, open};

use crate::build::{calibration_possible, nominal_camera, outline, roles, seconds};
use crate::keys::schedule::SCHEDULE;
use crate::protocol::Prototype;
use crate::shape::{Field, Keys};
use skinrig_settings::{Collector, Diagnostics};

/// A recording that was made without skinrig: what `skinrig import` needs to know about it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Schedule {
    /// The file's name as given to [`Schedule::parse`].
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    pub sha256: String,
    /// Short name of the recording.
    pub name: String,
    /// What was recorded.
    pub description: Option<String>,
    /// Who recorded it.
    pub operator: String,
    /// Which skin was pressed.
    pub prototype: Prototype,
    /// Sync presses at the start.
    pub sync: Option<ScheduledSync>,
    /// From press to press, s.
    pub period_s: f64,
    /// Presses recorded in each repetition: rows of the CSV.
    pub presses_per_repetition: u32,
    /// Presses used of each repetition, from the first; at most `presses_per_repetition`.
    pub presses_used: u32,
    /// Pause between two repetitions, s.
    pub pause_between_s: f64,
    /// Indentation depth, mm.
    pub depth_mm: f64,
    /// The moments of a press relative to its press time.
    pub phases: PressPhases,
    /// What one unit of the CSV's columns is in mm.
    pub csv_unit_mm: f64,
    /// Whether blank rows of the CSV are skipped.
    pub csv_skip_blank_rows: bool,
    /// Which presses calibrate and which are scored.
    pub roles: ScheduledRoles,
    /// The rig.
    pub rig: RigGeometry,
    /// Settings of the analysis.
    pub analysis: AnalysisSettings,
}

/// Sync presses of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScheduledSync {
    /// How many.
    pub count: u32,
    /// From one to the next, s.
    pub interval_s: f64,
    /// From the last one to the first press of the path, s.
    pub pause_after_s: f64,
    /// Where.
    pub at: Point2,
    /// How deep, mm.
    pub depth_mm: f64,
}

/// The moments of a press relative to its press time, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct PressPhases {
    /// The downward motion begins.
    pub approach: HostDuration,
    /// The tip reaches the surface.
    pub contact: HostDuration,
    /// The tip settled at its depth.
    pub at_depth: HostDuration,
    /// The upward motion begins.
    pub retract: HostDuration,
    /// The tip leaves the surface.
    pub release: HostDuration,
    /// The tip is back at clearance height.
    pub clear: HostDuration,
}

impl PressPhases {
    /// The moments of a press since the begin of its downward motion, as host times from 0.
    #[must_use]
    pub fn since_approach(&self) -> PressTiming {
        let at = |moment: HostDuration| HostTime(moment.0 - self.approach.0);
        PressTiming {
            approach: at(self.approach),
            contact: at(self.contact),
            at_depth: at(self.at_depth),
            retract: at(self.retract),
            release: at(self.release),
            clear: at(self.clear),
        }
    }

    /// From the begin of the downward motion to the return to clearance height, s.
    fn length_s(&self) -> f64 {
        self.clear.as_secs_f64() - self.approach.as_secs_f64()
    }

    /// The moments of the press at `t`.
    #[must_use]
    pub fn at(&self, t: HostTime) -> PressTiming {
        PressTiming {
            approach: t + self.approach,
            contact: t + self.contact,
            at_depth: t + self.at_depth,
            retract: t + self.retract,
            release: t + self.release,
            clear: t + self.clear,
        }
    }
}

/// Which presses calibrate and which are scored.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ScheduledRoles {
    /// By repetition; one role for each, at least one.
    Repetitions(Vec<PressRole>),
    /// Within each of `repetitions` repetitions.
    Alternate {
        /// How many repetitions.
        repetitions: u32,
        /// Every n-th press calibrates.
        every: u32,
        /// Index from 0 of the first press that does; below `every`.
        first: u32,
    },
}

impl ScheduledRoles {
    /// How many repetitions there are.
    #[must_use]
    pub fn repetitions(&self) -> u32 {
        match self {
            Self::Repetitions(roles) => roles.len() as u32,
            Self::Alternate { repetitions, .. } => *repetitions,
        }
    }

    /// What the press at `location` in `repetition` is for.
    #[must_use]
    pub fn role(&self, repetition: RepetitionId, location: LocationId) -> PressRole {
        match self {
            Self::Repetitions(roles) => roles
                .get(repetition.index() as usize)
                .copied()
                .unwrap_or(PressRole::Score),
            Self::Alternate { every, first, .. } if location.index() % every == *first => {
                PressRole::Calibrate
            }
            Self::Alternate { .. } => PressRole::Score,
        }
    }
}

/// A list of positions does not fit a schedule.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected {expected} press positions, `presses_per_repetition` of {schedule}, found {found}; correct the key or use the recording's own CSV"
)]
pub struct PositionCount {
    /// As the schedule says.
    pub expected: u32,
    /// What was given.
    pub found: usize,
    /// The schedule's file.
    pub schedule: String,
}

impl Schedule {
    /// Reads a schedule from the bytes of a file; `name` and `overrides` as for a protocol.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8], overrides: &[String]) -> Result<Self, Diagnostics> {
        Self::read(name, bytes, overrides, false)
    }

    /// Reads the schedule of a recording, which may use keys that a new one may not (`analysis.exclude_presses`).
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse_recorded(
        name: &str,
        bytes: &[u8],
        overrides: &[String],
    ) -> Result<Self, Diagnostics> {
        Self::read(name, bytes, overrides, true)
    }

    fn read(
        name: &str,
        bytes: &[u8],
        overrides: &[String],
        recorded: bool,
    ) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, overrides, &SCHEDULE)?;
        out.recorded = recorded;
        let schedule = root.and_then(|root| {
            let text = String::from_utf8_lossy(bytes).into_owned();
            assemble(&root, &mut out).map(|schedule| Self {
                file_name: name.to_owned(),
                sha256: crate::build::hex(&Sha256::digest(bytes)),
                text,
                ..schedule
            })
        });
        match schedule {
            Some(schedule) if out.is_clean() => Ok(schedule),
            _ => Err(out.finish()),
        }
    }

    /// Whether the press is one of those that the schedule uses; sync presses always are.
    #[must_use]
    pub fn is_used(&self, press: &PlannedPress) -> bool {
        press.role == PressRole::Sync || press.location.index() < self.presses_used
    }

    /// Every planned press in order, sync presses first, with its press time. `positions` are the rows of the CSV
    /// in mm, skin frame. Time 0 is the moment at which the first press's downward motion begins.
    ///
    /// Press `i` of repetition `r` comes at `first + r * (presses_per_repetition * period + pause) + i * period`
    /// (times of the published recording: public code); `first` is `sync.pause_after` after the last sync press.
    /// Presses that are recorded but not used are planned too (see [`Schedule::is_used`]): they are in the
    /// recording, and the clock alignment needs them.
    ///
    /// # Errors
    /// [`PositionCount`] when the number of positions is not `presses_per_repetition`.
    pub fn planned(
        &self,
        positions: &[Point2],
    ) -> Result<(Vec<PlannedPress>, Vec<HostTime>), PositionCount> {
        if positions.len() != self.presses_per_repetition as usize {
            return Err(PositionCount {
                expected: self.presses_per_repetition,
                found: positions.len(),
                schedule: self.file_name.clone(),
            });
        }
        let (mut presses, mut times) = (Vec::new(), Vec::new());
        let mut add = |role, repetition, location, at, depth_mm, time_s: f64| {
            let id = PressId::from_index(presses.len() as u32);
            presses.push(PlannedPress {
                id,
                role,
                repetition,
                location,
                at,
                depth_mm,
            });
            times.push(HostTime::from_secs_f64(time_s));
        };
        let zero = -self.phases.approach.as_secs_f64();
        let mut first = zero;
        if let Some(sync) = &self.sync {
            for k in 0..sync.count {
                let time = zero + f64::from(k) * sync.interval_s;
                let (repetition, location) = Default::default();
                add(
                    PressRole::Sync,
                    repetition,
                    location,
                    sync.at,
                    sync.depth_mm,
                    time,
                );
                first = time + sync.pause_after_s;
            }
        }
        let repetition_s =
            f64::from(self.presses_per_repetition) * self.period_s + self.pause_between_s;
        for repetition in 0..self.roles.repetitions() {
            for (location, at) in (0u32..).zip(positions) {
                let time = first
                    + f64::from(repetition) * repetition_s
                    + f64::from(location) * self.period_s;
                let repetition = RepetitionId::from_index(repetition);
                let location = LocationId::from_index(location);
                let role = self.roles.role(repetition, location);
                add(role, repetition, location, *at, self.depth_mm, time);
            }
        }
        Ok((presses, times))
    }
}

fn assemble(root: &Field, out: &mut Collector) -> Option<Schedule> {
    let phases = root.get("phases").and_then(|f| phases(f, out));
    let count = root.count("presses_per_repetition");
    let used = match (root.get("presses_used"), count) {
        (Some(field), Some(count)) => {
            let used = root.count("presses_used")?;
            if used > count {
                out.error(
                    field.span,
                    "presses_used",
                    "more presses than were recorded",
                )
                .expected(format!("at most {count}, `presses_per_repetition`"))
                .found(used.to_string());
            }
            Some(used)
        }
        (None, count) => count,
        _ => None,
    };
    let repetitions = root.count("repetitions");
    let evaluation = root.get("evaluation");
    let roles = evaluation
        .zip(repetitions)
        .and_then(|(e, n)| scheduled_roles(e, n, out));
    let rig = root.get("rig").and_then(|f| rig(f, out));
    let analysis = root
        .get("analysis")
        .and_then(|f| AnalysisSettings::from_mapping(f, out));
    if let (Some(ScheduledRoles::Repetitions(roles)), Some(analysis)) = (&roles, &analysis)
        && let Some(by) = evaluation.and_then(|e| e.get("repetitions"))
    {
        calibration_possible(roles, analysis, by, out);
    }
    let depth = root.quantity("depth");
    let sync = match root.get("sync") {
        None => Some(None),
        Some(f) => (|| {
            Some(Some(ScheduledSync {
                count: f.count("count")?,
                interval_s: f.quantity("interval")?,
                pause_after_s: f.quantity("pause_after")?,
                at: f.get("at")?.pair().map(|[x, y]| Point2::new(x, y))?,
                depth_mm: f.quantity("depth").or(depth)?,
            }))
        })(),
    };
    if let (Some(phases), Some(field)) = (&phases, root.get("period"))
        && let Some(period) = field.as_quantity()
    {
        let length = phases.length_s();
        if length > period {
            overlap(field, length, period, out);
        }
    }
    for key in ["interval", "pause_after"] {
        if let (Some(phases), Some(field)) = (&phases, root.get("sync").and_then(|s| s.get(key)))
            && let Some(time) = field.as_quantity()
            && time < phases.length_s()
        {
            overlap(field, phases.length_s(), time, out);
        }
    }
    let csv = root.get("csv")?;
    let prototype = root.get("prototype")?;
    Some(Schedule {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        name: root.text("name")?,
        description: root.text("description"),
        operator: root.text("operator")?,
        prototype: Prototype {
            id: prototype.text("id")?,
            description: prototype.text("description"),
            tip: prototype.text("tip"),
        },
        sync: sync?,
        period_s: root.quantity("period")?,
        presses_per_repetition: count?,
        presses_used: used?,
        pause_between_s: root.quantity("pause_between_repetitions")?,
        depth_mm: depth?,
        phases: phases?,
        csv_unit_mm: match csv.word("unit")? {
            "m" => 1000.0,
            "cm" => 10.0,
            _ => 1.0,
        },
        csv_skip_blank_rows: csv.flag("skip_blank_rows")?,
        roles: roles?,
        rig: rig?,
        analysis: analysis?,
    })
}

fn overlap(field: &Field, least_s: f64, found_s: f64, out: &mut Collector) {
    out.error(field.span, field.path.as_str(), "the presses overlap")
        .expected(format!(
            "at least {least_s} s, from `phases.approach` to `phases.clear`"
        ))
        .found(format!("{found_s} s"));
}

fn phases(f: &Field, out: &mut Collector) -> Option<PressPhases> {
    let names = [
        "approach", "contact", "at_depth", "retract", "release", "clear",
    ];
    for pair in names.windows(2) {
        if let [earlier, later] = pair
            && let (Some(a), Some(b)) = (f.quantity(earlier), f.quantity(later))
            && a >= b
            && let Some(field) = f.get(later)
        {
            out.error(
                field.span,
                field.path.as_str(),
                "the moments of a press are out of order",
            )
            .expected(format!("after `{earlier}`, {a} s"))
            .found(format!("{b} s"));
        }
    }
    let moment = |name| f.quantity(name).map(seconds);
    Some(PressPhases {
        approach: moment("approach")?,
        contact: moment("contact")?,
        at_depth: moment("at_depth")?,
        retract: moment("retract")?,
        release: moment("release")?,
        clear: moment("clear")?,
    })
}

fn scheduled_roles(f: &Field, repetitions: u32, out: &mut Collector) -> Option<ScheduledRoles> {
    if let Some(by) = f.get("repetitions") {
        return roles(by, repetitions, out).map(ScheduledRoles::Repetitions);
    }
    let alternate = f.get("alternate")?;
    let (every, first) = (
        alternate.count("calibrate_every")?,
        alternate.count("first")?,
    );
    if first > every {
        let field = alternate.get("first")?;
        out.error(
            field.span,
            field.path.as_str(),
            "the first press comes too late",
        )
        .expected(format!("1 to {every}, `calibrate_every`"))
        .found(first.to_string());
        return None;
    }
    Some(ScheduledRoles::Alternate {
        repetitions,
        every,
        first: first - 1,
    })
}

fn rig(f: &Field, out: &mut Collector) -> Option<RigGeometry> {
    let outline = outline(f.get("outline")?, out)?;
    let camera = |key| nominal_camera(f.get(key)?, outline.centre);
    Some(RigGeometry {
        outline,
        nominal: StereoGeometry {
            cameras: [camera("camera1")?, camera("camera2")?],
        },
        trigger_channel: f
            .count("trigger_channel")
            .and_then(|n| u8::try_from(n).ok()),
        trigger_delay_us: [0; 2],
    })
}
