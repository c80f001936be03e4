//! The nightly suite on the emulated bench: a healthy bench passes, and a fault planted in each device makes the right check fail,
//! with the right verdict, cause and exit code.

mod pairs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use skinrig_emulated_bench::{ArmFault, BenchConfig, BenchError, EmulatedBench, When};
use skinrig_model::{CameraId, RigFault};

use crate::emulated_bench::in_real_time;
use crate::support::{ROOT, only, read_json, text};

const SKINRIG: &str = env!("CARGO_BIN_EXE_skinrig");
const RIG: &str = include_str!("../../../../../hil/rigs/emulated.yaml");

/// Suite of these tests: short checks without repeats.
const SUITE: &str = "\
skinrig_suite: 1
name: planted
budget: 10 min
repeats: {at_most: 0}
checks:
  identity: {differences: {at_most: 0}}
  settings: {differences: {at_most: 0}}
  disk: {amount: 8 MB, write_rate: {at_least: 100 kB/s}, free: {at_least: 1 MB}}
  trigger_loopback: {trains: 6, lost_pulses: {at_most: 0}, extra_pulses: {at_most: 0}, unread_trains: {at_most: 0}}
  noise_dark: {duration: 1 s, hot_above: 100 ev/s, rate: {at_least: 1 ev/s, at_most: 1800 ev/s}, hot_pixels: {at_most: 10}}
  noise_lit: {duration: 1 s, hot_above: 100 ev/s, rate: {at_least: 1800 ev/s, at_most: 10 kev/s}, hot_pixels: {at_most: 10}}
  test_pattern: {duration: 1 s, rate: 500 kev/s, lost: {at_most: 0 B}, gaps: {at_most: 0}}
  robot_state: {faults: {at_most: 0}, creep: {at_most: 0.1 mm}}
  repeatability: {approaches: 2, spread: {at_most: 0.2 mm}, error: {at_most: 0.3 mm}}
  step_response: {steps: 3, settling: {at_most: 500 ms}, error: {at_most: 0.2 mm}}
  depth: {presses: 1, height: {at_least: -0.6 mm, at_most: 0.1 mm}, error: {at_most: 0.2 mm}}
  force_ceiling: {force: 1 N, depth: 2.5 mm, peak: {at_most: 1.5 N}}
  watchdog_drill: {braked_within: {at_most: 10 s}, drop: {at_most: 50 mm}}
  stop_drill: {stopped_within: {at_most: 1 s}, distance: {at_most: 10 mm}}
";

/// A bench and the folder of its nights.
struct Nights {
    bench: EmulatedBench,
    folder: tempfile::TempDir,
}

/// Result of a night.
struct NightResult {
    exit: i32,
    night: Value,
    stderr: String,
}

impl NightResult {
    fn check(&self, name: &str) -> &Value {
        let checks = self.night["checks"].as_array().unwrap();
        let found = checks.iter().find(|c| c["name"] == name);
        found.unwrap_or_else(|| panic!("no {name} in {}", self.stderr))
    }

    /// Asserts exit code, verdict and cause of a check, and evidence of this kind about this device.
    fn assert_check(
        &self,
        exit: i32,
        name: &str,
        verdict: &str,
        cause: &str,
        observed: &[(&str, &str)],
    ) {
        let check = self.check(name);
        let all = format!("{name}: {check:#}\n{}", self.stderr);
        assert_eq!(check["verdict"], verdict, "{all}");
        assert_eq!(check["cause"], cause, "{all}");
        let evidence: Vec<&Value> = check["attempts"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|a| a["evidence"].as_array().unwrap())
            .collect();
        for (kind, subject) in observed {
            let there = evidence
                .iter()
                .any(|e| e["kind"] == *kind && e["subject"] == *subject);
            assert!(there, "expected {kind} of {subject}: {all}");
        }
        assert_eq!(self.exit, exit, "{all}");
    }

    /// Value of a metric of a device.
    fn value(&self, name: &str, subject: &str, metric: &str) -> Option<f64> {
        self.find_measurement(name, subject, metric)?["value"].as_f64()
    }

    /// Verdict on a metric of a device.
    fn metric_verdict(&self, name: &str, subject: &str, metric: &str) -> &str {
        let measured = self.find_measurement(name, subject, metric);
        let verdict = measured.and_then(|m| m["verdict"].as_str());
        verdict.unwrap_or_else(|| panic!("no {metric} of {subject}: {:#}", self.check(name)))
    }

    fn find_measurement(&self, name: &str, subject: &str, metric: &str) -> Option<&Value> {
        let attempts = self.check(name)["attempts"].as_array().unwrap();
        let parts = attempts.last()?["parts"].as_array().unwrap();
        let part = parts.iter().find(|p| p["subject"] == subject)?;
        let measured = part["measurements"].as_array().unwrap();
        measured.iter().find(|m| m["metric"] == metric)
    }
}

impl Nights {
    fn start() -> Option<Self> {
        let bench = match EmulatedBench::start(&BenchConfig::default()) {
            Ok(bench) => bench,
            Err(BenchError::Box(reason)) => {
                eprintln!("skipped: no emulated bench: {reason}");
                return None;
            }
            Err(e) => panic!("{e}"),
        };
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("suite.yaml"), SUITE).unwrap();
        fs::write(folder.path().join("rig.yaml"), RIG).unwrap();
        Some(Self { bench, folder })
    }

    /// Runs these checks of the suite.
    fn night(&self, only: &str) -> NightResult {
        self.night_in(only, &self.folder.path().join("nights"))
    }

    fn night_in(&self, only: &str, out: &Path) -> NightResult {
        let output = self.output(only, out, &[]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let night = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|e| panic!("{e}: {} {stderr}", output.status));
        NightResult {
            exit: output.status.code().unwrap(),
            night,
            stderr,
        }
    }

    fn output(&self, only: &str, out: &Path, more: &[&str]) -> Output {
        let place = |name: &str| self.folder.path().join(name);
        let mut command: Command = self.bench.command(SKINRIG).unwrap();
        command
            .args(["hil", "run", "--json", "--only", only])
            .arg(place("suite.yaml"))
            .arg("--rig")
            .arg(place("rig.yaml"))
            .arg("--out")
            .arg(out)
            .args(more);
        command.output().unwrap()
    }

    fn write_rig(&self, text: &str) {
        fs::write(self.folder.path().join("rig.yaml"), text).unwrap();
    }

    /// Replaces text in the current rig file.
    fn edit_rig(&self, from: &str, to: &str) {
        let text = fs::read_to_string(self.folder.path().join("rig.yaml")).unwrap();
        assert!(text.contains(from), "{from}");
        self.write_rig(&text.replace(from, to));
    }

    /// Replaces the program that switches the lamps off with this one, which switches nothing.
    fn lamps_obey(&self, program: &str) {
        let text = fs::read_to_string(self.folder.path().join("rig.yaml")).unwrap();
        let line = text
            .lines()
            .find(|l| l.trim().starts_with("dark: "))
            .unwrap();
        self.edit_rig(line, &format!("    dark: [\"{program}\"]"));
    }

    fn inject(&mut self, fault: RigFault) {
        self.bench.inject(fault).unwrap();
    }

    /// Injects a fault of the arm at a later time.
    fn arm(&self, when: When, fault: ArmFault) {
        self.bench.arm().inject(when, fault).unwrap();
    }
}

/// A tiny disk, unmounted on drop.
struct TinyDisk(PathBuf);

impl TinyDisk {
    fn mount(at: PathBuf) -> Option<Self> {
        fs::create_dir(&at).unwrap();
        let mut command = Command::new("mount");
        command
            .args(["-t", "tmpfs", "-o", "size=4m", "tiny"])
            .arg(&at);
        let mounted = command.output().is_ok_and(|o| o.status.success());
        mounted.then_some(Self(at))
    }
}

impl Drop for TinyDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_healthy_bench_passes() {
    in_real_time(pass_all_checks);
}

fn pass_all_checks() {
    let Some(nights) = Nights::start() else {
        return;
    };
    let all = "identity,settings,disk,trigger_loopback,noise_dark,noise_lit,test_pattern,robot_state,repeatability,step_response,depth,force_ceiling,\
               watchdog_drill,stop_drill";
    let observed = nights.night(all);
    for name in all.split(',') {
        let verdict = &observed.check(name)["verdict"];
        assert_eq!(
            verdict,
            "PASS",
            "{:#}\n{}",
            observed.check(name),
            observed.stderr
        );
    }
    assert_eq!(observed.exit, 0, "{}", observed.stderr);
    // A touch registers at 0.2 N: 0.4 mm deep in this skin of 500 N/m.
    let height_mm = observed.value("depth", "robot", "height").unwrap();
    assert!((-0.6..-0.2).contains(&height_mm), "{height_mm}");
    let peak_n = observed.value("force_ceiling", "robot", "peak").unwrap();
    assert!((0.9..1.5).contains(&peak_n), "{peak_n}");
    assert!(
        observed
            .value("watchdog_drill", "robot", "braked_within")
            .is_some()
    );
}

/// The night holds the hash that the results file of its golden session holds.
#[test]
fn the_golden_session_is_named_with_its_results_hash() {
    in_real_time(name_the_golden_session);
}

fn name_the_golden_session() {
    let Some(nights) = Nights::start() else {
        return;
    };
    let protocol = Path::new(ROOT).join("protocols/quick-check.yaml");
    let suite = format!(
        "{SUITE}  golden: {{protocol: {}, lost: {{at_most: 0 B}}}}\n",
        text(&protocol)
    );
    fs::write(nights.folder.path().join("suite.yaml"), suite).unwrap();

    let folder = nights.folder.path().join("nights");
    let result = nights.night_in("golden", &folder);
    let golden = &result.night["golden"];
    assert!(golden["report"].is_string(), "{}", result.stderr);
    let results = read_json(&only(&only(&folder, "-planted"), ".results.json"));
    assert!(results["provenance"]["results_hash"].is_string());
    assert_eq!(
        golden["results_sha256"],
        results["provenance"]["results_hash"]
    );
}

/// The campaign of the starter files, a little faster, with a pause to learn in.
#[test]
fn presses_are_felt_and_replayed_to_the_bit() {
    in_real_time(feel_presses);
}

fn feel_presses() {
    let Some(nights) = Nights::start() else {
        return;
    };
    let place = |name: &str| nights.folder.path().join(name);
    let protocol = fs::read_to_string(Path::new(ROOT).join("hil/reaction.yaml")).unwrap();
    fs::write(
        place("reaction.yaml"),
        protocol.replace("period: 2 s", "period: 1.5 s").replace(
            "  count: 3\n\ndepth",
            "  count: 3\n  between: {pause: 10 s}\n\ndepth",
        ),
    )
    .unwrap();
    let suite = format!(
        "{SUITE}  reaction: {{protocol: reaction.yaml, felt: {{at_least: 10 %}}, reaction: {{at_most: 1 s}}, \
         skipped: {{at_most: 1000}}, differences: {{at_most: 0}}}}\n"
    );
    fs::write(place("suite.yaml"), suite).unwrap();
    let observed = nights.night("reaction");
    let all = format!("{:#}\n{}", observed.check("reaction"), observed.stderr);
    // A busy machine may spoil the session, for other metrics: the replay repeats it all the same.
    let differences = observed.value("reaction", "skin", "differences");
    assert_eq!(differences, Some(0.0), "{all}");
    // There learning may also last so long that few presses are left to feel, or none; then the check says so.
    let felt = observed.value("reaction", "skin", "felt");
    let reaction_s = observed.value("reaction", "skin", "reaction");
    assert!(reaction_s.is_none_or(|s| s > 0.0), "{all}");
    if felt.is_none() {
        assert_eq!(observed.check("reaction")["verdict"], "INVALID", "{all}");
    } else {
        let verdict = observed.metric_verdict("reaction", "skin", "felt");
        assert_ne!(verdict, "FAIL", "{all}");
        assert!(verdict != "PASS" || reaction_s.is_some(), "{all}");
    }
    // Other campaigns than the golden one are no golden session.
    assert!(observed.night["golden"].is_null(), "{all}");
}

/// Broken limits without evidence point at the rig.
#[test]
fn unexplained_limit_failures_blame_the_rig() {
    in_real_time(blame_the_rig);
}

fn blame_the_rig() {
    let Some(mut nights) = Nights::start() else {
        return;
    };
    nights.lamps_obey("true");
    nights.inject(RigFault::CameraStorm(CameraId::One));
    nights.inject(RigFault::RobotSlow);
    let observed = nights.night("noise_dark,noise_lit,step_response");
    let metric_verdict = |check, subject, metric| observed.metric_verdict(check, subject, metric);
    for camera in ["camera1", "camera2"] {
        // The lamps stayed on.
        assert_eq!(metric_verdict("noise_dark", camera, "rate"), "FAIL");
    }
    assert_eq!(metric_verdict("noise_lit", "camera1", "hot_pixels"), "FAIL");
    assert_eq!(metric_verdict("noise_lit", "camera2", "hot_pixels"), "PASS");
    let hot = observed.value("noise_lit", "camera1", "hot_pixels");
    assert!(hot >= Some(40.0) && hot <= Some(46.0), "{hot:?}");
    assert_eq!(metric_verdict("step_response", "robot", "settling"), "FAIL");
    assert_eq!(metric_verdict("step_response", "robot", "error"), "PASS");
    for check in ["noise_dark", "noise_lit", "step_response"] {
        observed.assert_check(1, check, "FAIL", "rig", &[]);
    }
}

#[test]
fn a_full_disk_is_the_infrastructure_s() {
    in_real_time(fill_a_disk);
}

fn fill_a_disk() {
    let Some(nights) = Nights::start() else {
        return;
    };
    let Some(tiny) = TinyDisk::mount(nights.folder.path().join("tiny")) else {
        eprintln!("skipped: no full disk: this user may not mount a small one");
        return;
    };
    let observed = nights.night_in("disk", &tiny.0);
    observed.assert_check(3, "disk", "FAIL", "infrastructure", &[("disk", "computer")]);
}

#[test]
fn a_suite_beyond_the_limits_of_the_rig_and_a_history_that_is_none_are_told() {
    in_real_time(contradict_the_rig);
}

fn contradict_the_rig() {
    let Some(nights) = Nights::start() else {
        return;
    };
    let (history, out) = (
        nights.folder.path().join("h.sqlite"),
        nights.folder.path().join("out"),
    );
    fs::write(&history, "no history").unwrap();
    let assert_told = |only: &str, exit: i32, told: &str| {
        let output = nights.output(only, &out, &["--history", history.to_str().unwrap()]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains(told), "{stderr}");
        assert_eq!(output.status.code(), Some(exit), "{stderr}");
    };
    assert_told("robot_state", 3, "no trends for this night");
    // The library of the emulated robot is in a folder of its own each time, which is no other firmware.
    let night = nights.night("robot_state").night;
    let firmware = night["versions"]["firmware"].to_string();
    assert!(
        firmware.contains("SDK 3.") && !firmware.contains('/'),
        "{firmware}"
    );
    nights.edit_rig("max_speed: 100 mm/s", "max_speed: 20 mm/s");
    let told = "checks.repeatability.speed: expected at most 20 mm/s, `limits.max_speed` of";
    assert_told("repeatability", 2, told);
    assert_told("robot_state", 3, "no trends for this night");
}
