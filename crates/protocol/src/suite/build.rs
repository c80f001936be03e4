//! From fields to a suite: what single keys cannot say, checked across keys.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use skinrig_model::HostDuration;

use super::keys::{CATALOGUE, Entry, SUITE};
use super::{Check, Light, Measure, Repeats, Suite, limits};
use crate::build::hex;
use crate::shape::{Field, Keys};
use skinrig_settings::open;
use skinrig_settings::{Collector, Diagnostics, one_of};

/// Reads a suite; see [`Suite::parse`].
pub(super) fn suite(name: &str, bytes: &[u8]) -> Result<Suite, Diagnostics> {
    let (mut out, root) = open(name, bytes, &[], &SUITE)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let suite = root.and_then(|root| assemble(&root, folder, &mut out));
    match suite {
        Some(suite) if out.is_clean() => Ok(Suite {
            file_name: name.to_owned(),
            text: String::from_utf8_lossy(bytes).into_owned(),
            sha256: hex(&Sha256::digest(bytes)),
            ..suite
        }),
        _ => Err(out.finish()),
    }
}

fn assemble(root: &Field, folder: &Path, out: &mut Collector) -> Option<Suite> {
    let listed = root.get("checks")?;
    if listed.entries().is_empty() {
        out.error(listed.span, "checks", "a suite without checks")
            .expected(one_of(CATALOGUE.iter().map(|e| e.name)))
            .found("none");
    }
    // Every check is read even when another one failed, so that all findings appear at once.
    let checks: Vec<Option<Check>> = CATALOGUE
        .iter()
        .filter_map(|entry| Some(check(entry, listed.get(entry.name)?, folder, out)))
        .collect();
    let repeats = root.get("repeats")?;
    Some(Suite {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        name: root.text("name")?,
        description: root.text("description"),
        budget: HostDuration::from_secs_f64(root.quantity("budget")?),
        repeats: Repeats {
            at_most: repeats.count("at_most")?,
            must_pass: repeats.count("must_pass")?,
        },
        checks: checks.into_iter().collect::<Option<_>>()?,
    })
}

fn check(entry: &Entry, field: &Field, folder: &Path, out: &mut Collector) -> Option<Check> {
    let stated = entry
        .metrics
        .iter()
        .filter_map(|m| Some((m.name, field.get(m.name)?)));
    let limits: Vec<_> = stated
        .map(|(name, f)| Some((name, limits::read(f, out)?)))
        .collect();
    if limits.is_empty() {
        let names = entry.metrics.iter().map(|m| m.name);
        out.error(field.span, field.path.as_str(), "a check that cannot fail")
            .expected(format!("a limit of at least one of {}", one_of(names)))
            .found("none");
        return None;
    }
    Some(Check {
        name: entry.name,
        title: entry.title,
        measure: measure(entry.name, field, folder)?,
        skip: field.text("skip"),
        metrics: entry.metrics,
        limits: limits.into_iter().collect::<Option<_>>()?,
    })
}

/// What the check called `name` measures. `None` when a key could not be read, which was told.
fn measure(name: &str, f: &Field, folder: &Path) -> Option<Measure> {
    let span = |key| f.quantity(key).map(HostDuration::from_secs_f64);
    let noise = |light| {
        Some(Measure::Noise {
            light,
            duration: span("duration")?,
            hot_above_ev_s: f.quantity("hot_above")?,
        })
    };
    Some(match name {
        "identity" => Measure::Identity,
        "settings" => Measure::Settings,
        "disk" => Measure::Disk {
            amount_b: f.quantity("amount")?,
        },
        "trigger_loopback" => Measure::TriggerLoopback {
            trains: f.count("trains")?,
        },
        "clocks" => Measure::Clocks {
            duration: span("duration")?,
        },
        "idle" => Measure::Idle {
            duration: span("duration")?,
        },
        "noise_dark" => noise(Light::Dark)?,
        "noise_lit" => noise(Light::Lit)?,
        "test_pattern" => Measure::TestPattern {
            duration: span("duration")?,
            rate_ev_s: f.quantity("rate")?,
        },
        "robot_state" => Measure::RobotState,
        "repeatability" => Measure::Repeatability {
            approaches: f.count("approaches")?,
            speed_mm_s: f.quantity("speed")?,
        },
        "step_response" => Measure::StepResponse {
            distance_mm: f.quantity("distance")?,
            steps: f.count("steps")?,
        },
        "depth" => Measure::Depth {
            depth_mm: f.quantity("depth")?,
            presses: f.count("presses")?,
        },
        "force_ceiling" => Measure::ForceCeiling {
            force_n: f.quantity("force")?,
            depth_mm: f.quantity("depth")?,
        },
        "golden" => Measure::Golden {
            protocol: golden(f, folder)?,
        },
        "watchdog_drill" => Measure::WatchdogDrill,
        "stop_drill" => Measure::StopDrill,
        _ => return None,
    })
}

fn golden(f: &Field, folder: &Path) -> Option<PathBuf> {
    Some(folder.join(f.text("protocol")?))
}
