//! Checks that the program makes before a run: disk, frame, recorder, devices expected by the rig file.

use std::io;
use std::path::Path;

use chrono::Utc;
use skinrig_controller::{ExpectedDevice, Loopback, Preflight};
use skinrig_device::Rig;
use skinrig_model::{CheckKind, CheckVerdict, HostDuration, PreflightCheck};
use skinrig_protocol::rig::{Frame, PreflightLimits, RigFile, RigKind};
use skinrig_text::{Column, Table, widest};

/// Free disk space required after a session of the simulated rig, bytes.
const SIMULATED_RESERVE_B: f64 = 200e6;
/// Disk space required for a simulated session, as a multiple of the expected size.
const SIMULATED_ROOM: f64 = 2.0;
/// Time limit for clocks to advance and marks to come back on the simulated rig.
const SIMULATED_WITHIN: HostDuration = HostDuration::from_millis(2_000);

/// The preflight of a bench.
#[must_use]
pub(crate) fn of_bench(file: &RigFile, rig: &Rig, folder: &Path, expected_s: f64) -> Preflight {
    let limits = &file.preflight;
    let mut checks = vec![disk(
        folder,
        limits.data_rate_b_s * expected_s,
        limits.min_free_disk_b,
    )];
    checks.extend(match file.kind {
        RigKind::Bench => frame(&file.frame, limits),
        RigKind::Emulated => vec![PreflightCheck::skipped(
            "frame",
            "touched points",
            "the emulated skin is where the rig file states",
        )],
    });
    if file.cameras.iter().any(|c| c.tolerant) {
        checks.push(PreflightCheck::skipped(
            "mismatches",
            "every camera mismatch rejected",
            "--tolerant accepts them; the devices' settings list each one with the key that accepts it",
        ));
    }
    Preflight {
        caller_checks: checks,
        expected: ExpectedDevice::of_rig(file),
        clocks_within: Some(limits.clocks_within),
        loopback: loopback(rig, limits.loopback_within),
    }
}

/// The preflight of the simulated rig.
#[must_use]
pub fn of_simulated(rig: &Rig, folder: &Path, expected_b: f64) -> Preflight {
    let size_b = SIMULATED_ROOM * expected_b;
    Preflight {
        caller_checks: vec![
            disk(folder, size_b, SIMULATED_RESERVE_B),
            PreflightCheck::skipped(
                "frame",
                "touched points",
                "the simulated skin is at its nominal position",
            ),
        ],
        expected: Vec::new(),
        clocks_within: Some(SIMULATED_WITHIN),
        loopback: loopback(rig, SIMULATED_WITHIN),
    }
}

/// The recorder's line of the table: `session` was created and holds the run's header.
#[must_use]
pub fn recorder(session: &Path) -> PreflightCheck {
    PreflightCheck::new(
        "recorder",
        "a new, writable session file",
        session.display().to_string(),
        true,
        "",
    )
    .about(CheckKind::Recorder)
}

fn loopback(rig: &Rig, within: HostDuration) -> Option<Loopback> {
    rig.trigger_box.as_ref()?;
    let channel = rig.geometry.trigger_channel?;
    Some(Loopback {
        channels: [channel; 2],
        within,
    })
}

/// Checks the free space: the session plus a reserve.
fn disk(folder: &Path, session_b: f64, reserve_b: f64) -> PreflightCheck {
    let need_b = session_b + reserve_b;
    let expected = format!(
        "{} free: about {} for the session, {} in reserve",
        size(need_b),
        size(session_b),
        size(reserve_b)
    );
    let next = "free some space, or choose another folder with --sessions";
    // The folder may not exist yet: check the nearest one that does.
    let existing = folder
        .ancestors()
        .find(|f| f.exists())
        .filter(|f| !f.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    match free_bytes(existing) {
        Ok(free_b) => PreflightCheck::new("disk", expected, size(free_b), free_b >= need_b, next),
        Err(e) => PreflightCheck::new("disk", expected, e.to_string(), false, next),
    }
    .about(CheckKind::Disk)
}

#[cfg(unix)]
/// Free bytes in `folder` for ordinary users.
///
/// # Errors
/// The error of the system.
pub fn free_bytes(folder: &Path) -> io::Result<f64> {
    let room = rustix::fs::statvfs(folder)?;
    Ok(room.f_bavail as f64 * room.f_frsize as f64)
}

#[cfg(not(unix))]
/// Not supported on this system.
///
/// # Errors
/// Always.
pub fn free_bytes(_folder: &Path) -> io::Result<f64> {
    Err(io::Error::new(
        io::ErrorKind::Unsupported,
        "free space cannot be determined on this system",
    ))
}

/// `1.5 GB`.
#[must_use]
pub fn size(bytes: f64) -> String {
    match bytes {
        b if b >= 1e9 => format!("{:.1} GB", b / 1e9),
        b => format!("{:.0} MB", b / 1e6),
    }
}

/// Checks the age of the frame and the fit of the touched points.
fn frame(frame: &Frame, limits: &PreflightLimits) -> Vec<PreflightCheck> {
    let days = Utc::now().timestamp().div_euclid(86_400) - frame.date.days_since_1970();
    let max_h = limits.touch_off_max_age.as_secs_f64() / 3600.0;
    let age = PreflightCheck::new(
        "frame: age",
        format!("measured at most {max_h:.0} h ago"),
        match days {
            0 => format!("{}, today", frame.date),
            d if d < 0 => format!("{}, in the future", frame.date),
            d => format!("{}, {d} days ago", frame.date),
        },
        // A date has no hour: a day counts from its start, and tomorrow may be today in another time zone.
        (-1..=(max_h / 24.0).ceil() as i64).contains(&days),
        "touch the skin again with `skinrig jog`, and copy the block that it prints into the rig file",
    );
    let fit = match &frame.touch_off {
        Some(touched) => PreflightCheck::new(
            "frame: residual",
            format!("at most {} mm", touched.max_residual_mm),
            format!(
                "{:.3} mm at worst, {:.3} mm root mean square, {} points",
                touched.worst_mm,
                touched.rms_mm,
                touched.points.len()
            ),
            touched.worst_mm <= touched.max_residual_mm,
            "touch the points again with `skinrig jog`",
        ),
        None => PreflightCheck::skipped("frame: residual", "touched points", "the frame is given"),
    };
    [age, fit].map(|c| c.about(CheckKind::Frame)).into()
}

/// The preflight as shown by a run: one line if no check failed, else [`table`].
#[must_use]
pub(crate) fn report(checks: &[PreflightCheck]) -> String {
    if checks.iter().any(PreflightCheck::failed) {
        return table(checks);
    }
    let of = |verdict| checks.iter().filter(move |c| c.verdict == verdict);
    let mut line = format!("preflight {} passed", of(CheckVerdict::Passed).count());
    let skipped: Vec<&str> = of(CheckVerdict::Skipped)
        .map(|c| c.check.as_str())
        .collect();
    if !skipped.is_empty() {
        line += &format!(", not checked: {}", skipped.join("; "));
    }
    line + "; `skinrig show SESSION` lists them"
}

/// The table for the terminal: verdict, check, expected, found, and the next step below a failed check.
#[must_use]
pub fn table(checks: &[PreflightCheck]) -> String {
    let column = |of: fn(&PreflightCheck) -> &str| {
        let widest = widest(checks.iter().map(of));
        Column::left(widest.min(60))
    };
    let (check, expected) = (column(|c| &c.check), column(|c| &c.expected));
    let table = Table::new([Column::left(7), check, expected]).indent(2);
    let mut out = String::from("preflight\n");
    for c in checks {
        out += &table.row([c.verdict.name(), &c.check, &c.expected, &c.found]);
        out.push('\n');
        if c.failed() {
            out.push_str(&format!("           next: {}\n", c.next_step));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_protocol::rig::Date;

    #[test]
    fn a_preflight_without_a_failure_takes_one_line() {
        let passed = PreflightCheck::new("disk", "1 GB", "2 GB", true, "");
        let skipped = PreflightCheck::skipped("frame", "touched points", "simulated");
        let failed = PreflightCheck::new("camera 1: clock", "advancing", "no time", false, "x");
        assert_eq!(
            report(&[passed.clone(), skipped]),
            "preflight 1 passed, not checked: frame; `skinrig show SESSION` lists them"
        );
        let all = [passed, failed];
        assert_eq!(report(&all), table(&all));
    }

    #[test]
    fn a_session_that_does_not_fit_fails() {
        let base = Path::new(".");
        assert!(!disk(base, 1.0, 1.0).failed());
        let full = disk(base, 1e18, 0.0);
        assert!(
            full.failed() && full.next_step.contains("--sessions"),
            "{full:?}"
        );
        // A folder that does not exist yet is on the disk of its nearest existing parent.
        assert!(!disk(Path::new("no/such/folder"), 1.0, 1.0).failed());
    }

    #[test]
    fn an_old_frame_and_one_of_the_future_fail() {
        let text = include_str!("../../../../hil/rigs/bench.example.yaml");
        let mut file = RigFile::parse("rig.yaml", text.as_bytes(), &|_| None).unwrap();
        let verdicts = |file: &RigFile| -> Vec<CheckVerdict> {
            let checks = frame(&file.frame, &file.preflight);
            checks.iter().map(|c| c.verdict).collect()
        };
        let passed = CheckVerdict::Passed;
        let today = Utc::now().format("%Y-%m-%d").to_string();
        file.frame.date = Date::parse(&today).unwrap();
        assert_eq!(verdicts(&file), [passed; 2]);
        for wrong in ["2001-01-01", "2999-01-01"] {
            file.frame.date = Date::parse(wrong).unwrap();
            assert_eq!(verdicts(&file), [CheckVerdict::Failed, passed], "{wrong}");
        }
        file.frame.touch_off = None;
        assert_eq!(verdicts(&file)[1], CheckVerdict::Skipped);
    }

    #[test]
    fn the_table_has_a_next_step_for_a_failed_check() {
        let checks = [
            PreflightCheck::new("disk", "1 GB", "2 GB", true, "make room"),
            PreflightCheck::new(
                "camera 1: clock",
                "advancing",
                "no time",
                false,
                "power-cycle it",
            ),
        ];
        assert_eq!(
            table(&checks),
            "preflight\n  passed   disk             1 GB       2 GB\n  failed   camera 1: clock  advancing  no time\n           next: power-cycle it\n"
        );
    }
    #[test]
    fn wide_and_combining_characters_keep_the_table_aligned() {
        let check = |name: &str| PreflightCheck::new(name, "free", "found", true, "");
        let checks = ["disk", "カメラ1", "cle\u{301}"].map(check);
        let shown = table(&checks);
        for line in shown.lines().skip(1) {
            let before = line.strip_suffix("found").unwrap();
            assert_eq!(skinrig_text::width(before), 26, "{shown}");
        }
    }
}
