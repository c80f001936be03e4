//! Checks the computer's clocks: the time of day, which dates nights, and the counter, which timestamps events.

use super::case::Case;
use super::finding::{Finding, check};

const AREA: &str = "clock";
const SOURCE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";

/// All findings about clocks.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    vec![time_of_day(case), counter(case)]
}

/// Checks synchronisation without using the network: systemd-timesyncd creates a file when it has synchronised; other daemons only
/// show that they run.
fn time_of_day(case: &Case<'_>) -> Finding {
    let check = check(AREA, "time of day", "synchronised (NTP)");
    let has = |path: &str| case.machine.has(path);
    if has("/run/systemd/timesync/synchronized") {
        return check.ok("synchronised by systemd-timesyncd");
    }
    for (daemon, files, ask) in [
        (
            "chronyd",
            ["/run/chrony/chronyd.pid", "/run/chronyd.pid"],
            "chronyc tracking",
        ),
        ("ntpd", ["/run/ntpd.pid", "/var/run/ntpd.pid"], "ntpq -p"),
    ] {
        if files.into_iter().any(has) {
            return check.not_checked_yet(
                format!("{daemon} runs; skinrig cannot see whether it has synchronised"),
                ask,
            );
        }
    }
    if !has("/run") {
        return check.not_checked("there is no /run");
    }
    check.warning(
        "no sign of synchronisation",
        "sudo timedatectl set-ntp true; `timedatectl` shows whether it worked",
    )
}

/// Reading a slow counter takes microseconds, and some counters jump.
fn counter(case: &Case<'_>) -> Finding {
    let check = check(
        AREA,
        "counter",
        "a fast one (tsc, arch_sys_counter, kvm-clock)",
    );
    match case.machine.text(SOURCE) {
        Err(why) => check.not_checked(why),
        Ok(source) if ["hpet", "acpi_pm", "jiffies", "refined-jiffies"].contains(&source.as_str()) => {
            check.warning(
                source,
                "the kernel distrusts the processor's counter: `journalctl -k | grep -i clocksource` shows why; update the BIOS",
            )
        }
        Ok(source) => check.ok(source),
    }
}
