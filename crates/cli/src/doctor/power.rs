//! Checks power saving: sleep and processor frequency.

use std::collections::BTreeMap;
use std::path::Path;

use super::case::Case;
use super::finding::{Finding, check};

const AREA: &str = "power";
const CPUS: &str = "/sys/devices/system/cpu";

/// All findings about power.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    vec![sleep(case), governor(case)]
}

/// Every kind of sleep goes through `sleep.target` (systemd); masked, it is a link to `/dev/null`.
fn sleep(case: &Case<'_>) -> Finding {
    let check = check(AREA, "sleep", "the computer never sleeps by itself");
    let kinds = match case.machine.text("/sys/power/state") {
        Ok(kinds) => kinds,
        Err(why) => return check.not_checked(why),
    };
    if kinds.is_empty() {
        return check.ok("it cannot sleep");
    }
    let masked = ["/etc", "/run"].into_iter().any(|top| {
        let target = format!("{top}/systemd/system/sleep.target");
        case.machine.link(&target).as_deref() == Some(Path::new("/dev/null"))
    });
    if masked {
        check.ok("sleep.target is masked")
    } else if !case.machine.has("/run/systemd/system") {
        check.not_checked("no systemd: check what your system does after an idle hour")
    } else {
        check.warning(
            format!("it can ({kinds}), and sleep.target is not masked"),
            "sudo systemctl mask sleep.target; or run through hil/systemd, whose unit prevents sleep while it runs",
        )
    }
}

fn governor(case: &Case<'_>) -> Finding {
    let check = check(AREA, "processors", "governor `performance` on all of them");
    let names = match case.machine.names(CPUS) {
        Ok(names) => names,
        Err(why) => return check.not_checked(why),
    };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for name in names {
        let number = name.strip_prefix("cpu").unwrap_or("");
        if number.is_empty() || !number.bytes().all(|b| b.is_ascii_digit()) {
            continue;
        }
        let file = format!("{CPUS}/{name}/cpufreq/scaling_governor");
        if let Ok(governor) = case.machine.text(&file) {
            *counts.entry(governor).or_default() += 1;
        }
    }
    let found: Vec<String> = counts.iter().map(|(g, n)| format!("{g} on {n}")).collect();
    match counts.keys().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => check.not_checked("this kernel does not control the processor frequency"),
        ["performance"] => check
            .ok(found.join(", "))
            .means("no slow wake-up"),
        _ => check.warning(
            found.join(", "),
            "sudo cpupower frequency-set -g performance; permanently: your distribution's power profile",
        ),
    }
}
