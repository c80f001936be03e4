//! Synthetic sessions and nights of a lab: three years, five benches, prototypes that come from each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use chrono::{DateTime, SecondsFormat};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_catalogue::{
    AnalysisEntry, AnalysisFigures, CalibrationEntry, ClockEntry, EstimateEntry, LegEntry,
    NoteEntry, PressEntry, ResultsError, SessionEntry,
};
use skinrig_model::{CameraId, Limit, PressRole, Verdict as PressVerdict};
use skinrig_nightly::night::{Attempt, CheckResult, Measurement, Part, Versions};
use skinrig_nightly::{GoldenSession, Night, NightExit, Verdict};
use skinrig_recorder::{Headline, PressTally, SessionTotals};

/// 2024-01-01.
const START_S: i64 = 1_704_067_200;
const YEARS_S: u64 = 3 * 365 * 86_400;
const PROTOTYPES: u64 = 60;

/// The random numbers of a synthetic lab.
struct SyntheticLab(Xoshiro256PlusPlus);

impl SyntheticLab {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    fn below(&mut self, n: u64) -> u64 {
        self.0.next_u64() % n
    }

    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn is(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }

    fn civil(&mut self) -> String {
        let s = START_S + self.below(YEARS_S).cast_signed();
        let time = DateTime::from_timestamp(s, 0).unwrap();
        time.to_rfc3339_opts(SecondsFormat::Secs, true)
    }

    fn hex(&mut self, digits: usize) -> String {
        let words = (0..digits.div_ceil(16)).map(|_| format!("{:016x}", self.0.next_u64()));
        words.collect::<String>()[..digits].to_owned()
    }

    /// A session; some are cut off, not analysed, INVALID, resumed, tagged.
    fn session(&mut self) -> SessionEntry {
        let (started_at, bench) = (self.civil(), self.below(5));
        let prototype = self.below(PROTOTYPES);
        let (planned, ended) = (100 + self.below(400), self.is(95));
        let invalid = self.below(6);
        let missed = if ended { 0 } else { self.below(50) };
        let presses = PressTally {
            planned,
            valid: planned - invalid - missed,
            missed,
            invalid,
            excluded: 0,
        };
        let totals = SessionTotals {
            presses,
            raw_bytes: 1_000_000 * (10 + self.below(500)),
            stored_bytes: 1_000_000 * (5 + self.below(100)),
            lost_bytes: if self.is(3) { self.below(10_000) } else { 0 },
            cd_events: self.below(1 << 30),
            ..SessionTotals::default()
        };
        let legs = 1 + u32::from(self.is(4));
        let leg = |number| LegEntry {
            number,
            operator: format!("operator {}", prototype % 7),
            started_at: started_at.clone(),
            host: format!("bench{bench}"),
            software: format!("0.{}.0", &started_at[..4]),
            ended: ended.then(|| "completed".to_owned()),
        };
        let kinds = ["data_lost", "late", "hold", "surface"];
        let kind = kinds[self.below(4) as usize].to_owned();
        let tags = ["wet", "good-skin", "paper", "drift"];
        let analyses = self.analyses(prototype as f64, bench as f64, planned);
        SessionEntry {
            headline: Headline {
                session_id: self.hex(32),
                started_at: started_at.clone(),
                prototype: format!("mold {prototype}"),
                protocol_name: format!("protocols/p{}.yaml", prototype % 4),
                protocol_sha256: format!("{:064x}", self.below(3)),
                plan_sha256: self.hex(64),
                overrides_json: "[]".into(),
                seed: "1".into(),
                rig_kind: if self.is(80) { "bench" } else { "simulated" }.into(),
                rig_name: format!("bench {bench}"),
            },
            content_sha256: ended.then(|| self.hex(64)),
            legs: (1..=legs).map(leg).collect(),
            duration_s: ended.then_some(planned as f64 * 3.0),
            presses,
            sync: PressTally::default(),
            totals: ended.then_some(totals),
            faults: BTreeMap::from([(kind, invalid)]),
            devices: self.devices(bench),
            analyses,
            tags: tags
                .into_iter()
                .filter(|_| self.is(5))
                .map(str::to_owned)
                .collect(),
            notes: (0..self.below(3))
                .map(|n| NoteEntry {
                    later: (n > 0).then(|| (started_at.clone(), "Ann".to_owned())),
                    text: format!("lamp {} replaced", self.below(100)),
                })
                .collect(),
            tags_problem: None,
        }
    }

    fn devices(&mut self, bench: u64) -> BTreeSet<[String; 4]> {
        let firmware = 1 + self.below(3);
        let roles = ["indenter", "camera1", "camera2", "trigger_box"];
        let device = |role: &str| {
            [
                role.to_owned(),
                format!("model of {role}"),
                format!("{role}-{bench}"),
                format!("1.{firmware}"),
            ]
        };
        roles.into_iter().map(device).collect()
    }

    fn analyses(&mut self, prototype: f64, bench: f64, planned: u64) -> Vec<AnalysisEntry> {
        let rmse = 1.0 + prototype / 100.0 + self.unit();
        let entry = |name: &str, figures| AnalysisEntry {
            name: name.to_owned(),
            figures,
        };
        let mut all = Vec::new();
        if self.is(90) {
            let mut figures = self.figures(rmse, bench);
            figures.presses = (0..planned as u32).map(|n| self.press(n)).collect();
            all.push(entry("official", Ok(figures)));
        } else if self.is(20) {
            all.push(entry("official", Err(ResultsError::OtherVersion(None))));
        }
        if self.is(20) {
            let rmse = rmse - 0.1 * self.unit();
            all.push(entry("locator=direct", Ok(self.figures(rmse, bench))));
        }
        all
    }

    /// Press `n` of repeated presses at 50 places and two depths; some fail.
    fn press(&mut self, n: u32) -> PressEntry {
        let place = n % 50;
        let (x, y) = (f64::from(place % 10) * 5.0, f64::from(place / 10) * 5.0);
        let camera = self.is(50).then_some(CameraId::Two);
        let fails = if place < 5 { 20 } else { 1 };
        let (verdict, cause, camera) = match self.below(100) {
            n if n < fails => {
                let camera = camera.or(Some(CameraId::One));
                (PressVerdict::Excluded, Some("no_response"), camera)
            }
            97 => (PressVerdict::Excluded, Some("by_hand"), None),
            98 => (PressVerdict::Invalid, Some("invalid"), None),
            99 => (PressVerdict::Missed, Some("missed"), None),
            _ => (PressVerdict::Valid, None, None),
        };
        let error = [self.unit(), self.unit()];
        let is_seen = verdict == PressVerdict::Valid;
        PressEntry {
            press: n + 1,
            role: match place {
                0 => PressRole::Sync,
                n if n % 5 == 0 => PressRole::Calibrate,
                _ => PressRole::Score,
            },
            location: place + 1,
            repetition: n / 50 + 1,
            planned_x_mm: x,
            planned_y_mm: y,
            planned_depth_mm: f64::from(1 + n % 2),
            measured_x_mm: Some(x + 0.01),
            measured_y_mm: Some(y),
            verdict,
            cause: cause.map(str::to_owned),
            camera,
            estimate_x_mm: is_seen.then_some(x + 0.01 + error[0]),
            estimate_y_mm: is_seen.then_some(y + error[1]),
            error_mm: is_seen.then(|| libm::hypot(error[0], error[1])),
            region_major_mm: is_seen.then_some(3.0),
            region_minor_mm: is_seen.then_some(2.0),
            region_angle_deg: is_seen.then_some(-45.0),
        }
    }

    fn figures(&mut self, rmse: f64, bench: f64) -> AnalysisFigures {
        let clock = |map: &str, drift_ppm| ClockEntry {
            map: map.to_owned(),
            drift_ppm,
            residual_rms_us: Some(0.3),
            residual_max_us: Some(0.9),
            n: 40,
        };
        let drift = 10.0 * bench + self.unit();
        AnalysisFigures {
            version: 13 + self.below(2) as u32,
            results_hash: self.hex(64),
            is_valid: self.is(97),
            changed: Vec::new(),
            rmse_mm: EstimateEntry {
                value: Some(rmse),
                low: Some(rmse - 0.1),
                high: Some(rmse + 0.1),
                n: 100,
            },
            clocks: vec![
                clock("host_from_box", Some(-300.0)),
                clock("camera1_from_box", Some(drift)),
                clock("camera2_from_box", Some(-drift)),
                clock("camera2_from_camera1", Some(0.0)),
            ],
            calibration: self.is(50).then(|| CalibrationEntry {
                model: "skew".into(),
                rmse_before_mm: Some(4.0),
                rmse_after_mm: Some(rmse),
                n: 25,
                values: vec![
                    ("yaw_1_deg".into(), Some(self.unit()), Some(0.1)),
                    ("yaw_2_deg".into(), Some(self.unit()), None),
                ],
            }),
            left_out_rmse_mm: self.is(90).then_some(1.25 * rmse),
            located_rate: Some(if self.is(95) { 0.97 } else { 0.49 }),
            ..AnalysisFigures::default()
        }
    }
}

/// `count` sessions with the names of their files.
pub(crate) fn sessions(count: u32, seed: u64) -> Vec<(String, SessionEntry)> {
    let mut lab = SyntheticLab::new(seed);
    let one = |n| (format!("{seed}-{n}.session.sqlite"), lab.session());
    (0..count).map(one).collect()
}

/// Writes the prototypes of the lab: each is molded from, repaired from or re-cut from the one before.
pub(crate) fn write_prototypes(folder: &Path) {
    let mut text = "skinrig_prototypes: 1\nprototypes:\n  - {name: mold 0}\n".to_owned();
    for n in 1..PROTOTYPES {
        let relation = ["molded_from", "repaired", "recut"][n as usize % 3];
        text += &format!(
            "  - {{name: mold {n}, relation: {relation}, parent: mold {}}}\n",
            n / 2
        );
    }
    std::fs::write(folder.join("prototypes.yaml"), text).unwrap();
}

/// Writes `count` nights, each with one value per device.
pub(crate) fn write_nights(folder: &Path, count: u32) {
    for n in 0..count {
        let day = DateTime::from_timestamp(START_S + i64::from(n) * 86_400, 0).unwrap();
        let started = day.to_rfc3339_opts(SecondsFormat::Secs, true);
        let own = folder.join(format!("{n:05}"));
        std::fs::create_dir_all(&own).unwrap();
        let text = serde_json::to_string(&night(&started, f64::from(n))).unwrap();
        std::fs::write(own.join("night.json"), text).unwrap();
    }
}

fn night(started: &str, jitter_us: f64) -> Night {
    let part = |subject: &str| Part {
        subject: subject.to_owned(),
        measurements: vec![Measurement {
            metric: "jitter".into(),
            value: Some(jitter_us),
            unit: "us".into(),
            interval: Some([jitter_us - 0.1, jitter_us + 0.2]),
            n: Some(40),
            needs: 10,
            limit: (subject == "camera1").then(|| Limit::at_most(1e6).with_margin(0.3)),
            verdict: Verdict::Pass,
            note: None,
        }],
        verdict: Verdict::Pass,
    };
    let attempt = Attempt {
        began_s: 0.0,
        took_s: 1.0,
        parts: vec![part("camera1"), part("camera2")],
        evidence: Vec::new(),
        verdict: Verdict::Pass,
        cause: None,
        rule: None,
    };
    Night {
        version: 1,
        id: format!("{started}-nightly"),
        suite: "nightly".into(),
        suite_sha256: "0".repeat(64),
        rig: "bench 1".into(),
        rig_kind: "bench".into(),
        rig_sha256: "0".repeat(64),
        versions: Versions {
            firmware: vec![("camera1".into(), "3.9 \"b\"".into())],
            skin: Some("golden skin".into()),
            ..Versions::default()
        },
        started: started.to_owned(),
        took_s: 1.0,
        planned_s: 1.0,
        budget_s: 60.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        checks: vec![CheckResult {
            name: "trigger_loopback".into(),
            title: "trigger loopback".into(),
            planned_s: 1.0,
            attempts: vec![attempt],
            skipped: None,
            verdict: Verdict::Pass,
            repeats: None,
            cause: None,
            rule: None,
            witnesses: Vec::new(),
        }],
        golden: Some(GoldenSession {
            session: "golden.session.sqlite".into(),
            report: None,
            results_sha256: None,
        }),
        verdict: Verdict::Pass,
        exit: NightExit::Pass,
        notifications: Vec::new(),
    }
}
