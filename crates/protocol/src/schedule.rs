//! Schedules: when and where a recording that was made without skinrig was pressed.

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::{
    AnalysisSettings, HostTime, LocationId, PlannedPress, Point2, PressId, PressRole, RepetitionId,
    RigGeometry, StereoGeometry,
};
use skinrig_settings::{Collector, Diagnostics, Field, Settings, open};

use crate::file::hex;
use crate::keys::{
    NominalCamera, PressRoleKeys, ScheduleKeys, calibration_possible, rays_meet, roles,
};
use crate::phases::PressPhases;
use crate::protocol::Prototype;

/// Schedule of a recording made without skinrig, for `skinrig import`.
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
    /// Contents of the recording.
    pub description: Option<String>,
    /// Operator of the recording.
    pub operator: String,
    /// The skin that was pressed.
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
    /// One unit of the CSV's columns in mm.
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
    /// Number of repetitions.
    #[must_use]
    pub fn repetitions(&self) -> u32 {
        match self {
            Self::Repetitions(roles) => roles.len() as u32,
            Self::Alternate { repetitions, .. } => *repetitions,
        }
    }

    /// Role of the press at `location` in `repetition`.
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
    /// Number in the schedule.
    pub expected: u32,
    /// Number in the recording.
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

    /// Reads the schedule of a recording, which may contain keys that are invalid in a new one (`analysis.exclude_presses`).
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
        let (mut out, root) = open(name, bytes, overrides, ScheduleKeys::TABLE)?;
        out.recorded = recorded;
        let schedule = root.and_then(|root| {
            let text = String::from_utf8_lossy(bytes).into_owned();
            assemble(&root, &mut out).map(|schedule| Self {
                file_name: name.to_owned(),
                sha256: hex(&Sha256::digest(bytes)),
                text,
                ..schedule
            })
        });
        match schedule {
            Some(schedule) if out.is_clean() => Ok(schedule),
            _ => Err(out.finish()),
        }
    }

    /// Whether the schedule uses the press; always true for sync presses.
    #[must_use]
    pub fn is_used(&self, press: &PlannedPress) -> bool {
        press.role == PressRole::Sync || press.location.index() < self.presses_used
    }

    /// Every planned press in order, sync presses first, with its press time. `positions` are the rows of the CSV
    /// in mm, skin frame. Time 0 is the start of the first press's downward motion.
    ///
    /// Press `i` of repetition `r` comes at `first + r * (presses_per_repetition * period + pause) + i * period`
    /// (times of the published recording: public code); `first` is `sync.pause_after` after the last sync press.
    /// Recorded but unused presses are planned too (see [`Schedule::is_used`]), because the clock alignment needs them.
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

/// Reads every part even if another one failed, so that all findings appear at once.
fn assemble(root: &Field, out: &mut Collector) -> Option<Schedule> {
    let keys = ScheduleKeys::read_parts(root, out);
    if let (Some(used), Some(count)) = (keys.presses_used.flatten(), keys.presses_per_repetition)
        && used > count
    {
        out.error(
            root.at("presses_used").span,
            "presses_used",
            "more presses than were recorded",
        )
        .expected(format!("at most {count}, `presses_per_repetition`"))
        .found(used.to_string());
    }
    let evaluation = keys.evaluation.as_ref().zip(keys.repetitions);
    let roles = evaluation.and_then(|(e, n)| scheduled_roles(e, n, root.at("evaluation"), out));
    if let (Some(ScheduledRoles::Repetitions(roles)), Some(analysis)) = (&roles, &keys.analysis) {
        let by = root.at("evaluation.repetitions");
        calibration_possible(roles, analysis, by, out);
    }
    if let Some(field) = root.get("phases") {
        PressPhases::check_order(field, out);
    }
    if let Some(phases) = &keys.phases {
        let sync = keys.sync.as_ref().and_then(Option::as_ref);
        for (key, time_s) in [
            ("period", keys.period_s),
            ("sync.interval", sync.map(|s| s.interval_s)),
            ("sync.pause_after", sync.map(|s| s.pause_after_s)),
        ] {
            if let Some(time_s) = time_s.filter(|time_s| *time_s < phases.length_s()) {
                overlap(root.at(key), phases.length_s(), time_s, out);
            }
        }
    }
    let depth_mm = keys.depth_mm?;
    let rig = keys.rig?;
    let csv = keys.csv?;
    let presses_per_repetition = keys.presses_per_repetition?;
    let field = root.at("rig");
    let centre = rig.outline.centre;
    let camera = |camera: &NominalCamera, key: &str, out: &mut Collector| {
        camera.checked(centre, field.at(key), out)
    };
    let cameras = [
        camera(&rig.camera1, "camera1", out)?,
        camera(&rig.camera2, "camera2", out)?,
    ];
    let quarter_mm = 0.25 * rig.outline.width_mm.min(rig.outline.height_mm);
    let around = [
        (0.0, 0.0),
        (1.0, 1.0),
        (1.0, -1.0),
        (-1.0, 1.0),
        (-1.0, -1.0),
    ];
    let points = around
        .map(|(x, y)| Point2::new(centre.x_mm + x * quarter_mm, centre.y_mm + y * quarter_mm));
    let least = keys.analysis.as_ref().map_or(0.0, |a| a.min_ray_sine);
    rays_meet(cameras.each_ref(), &points, least, field, out);
    Some(Schedule {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        name: keys.name?,
        description: keys.description?,
        operator: keys.operator?,
        prototype: keys.prototype?,
        sync: keys.sync?.map(|sync| ScheduledSync {
            count: sync.count,
            interval_s: sync.interval_s,
            pause_after_s: sync.pause_after_s,
            at: sync.at,
            depth_mm: sync.depth_mm.unwrap_or(depth_mm),
        }),
        period_s: keys.period_s?,
        presses_per_repetition,
        presses_used: keys.presses_used?.unwrap_or(presses_per_repetition),
        pause_between_s: keys.pause_between_repetitions_s?,
        depth_mm,
        phases: keys.phases?,
        csv_unit_mm: csv.unit.in_mm(),
        csv_skip_blank_rows: csv.skip_blank_rows,
        roles: roles?,
        rig: RigGeometry {
            outline: rig.outline,
            nominal: StereoGeometry { cameras },
            trigger_channel: rig.trigger_channel,
            trigger_delay_us: [0; 2],
        },
        analysis: keys.analysis?,
    })
}

fn overlap(field: &Field, least_s: f64, found_s: f64, out: &mut Collector) {
    out.error(field.span, field.path.as_str(), "the presses overlap")
        .expected(format!(
            "at least {least_s} s, from `phases.approach` to `phases.clear`"
        ))
        .found(format!("{found_s} s"));
}

fn scheduled_roles(
    evaluate: &PressRoleKeys,
    repetitions: u32,
    field: &Field,
    out: &mut Collector,
) -> Option<ScheduledRoles> {
    if evaluate.repetitions.is_some() {
        let roles = roles(field.at("repetitions"), repetitions, out);
        return roles.map(ScheduledRoles::Repetitions);
    }
    let alternate = evaluate.alternate.as_ref()?;
    let (every, first) = (alternate.calibrate_every, alternate.first);
    if first > every {
        let field = field.at("alternate.first");
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
