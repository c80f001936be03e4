//! The computer's clocks: the time of day by which nights are told apart, and the counter by which events are stamped.

use super::case::Case;
use super::finding::{Finding, check};

const AREA: &str = "clock";
const SOURCE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";

/// All findings about clocks.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    vec![time_of_day(case), counter(case)]
}

/// What can be told without the network: systemd-timesyncd leaves a file when it has synchronised; of other daemons only that they
/// run.
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
                format!("{daemon} runs; it alone knows whether it has synchronised"),
                ask,
            );
        }
    }
    if !has("/run") {
        return check.not_checked("there is no /run");
    }
    check.warning(
        "no sign of it",
        "sudo timedatectl set-ntp true; `timedatectl` shows whether it worked",
    )
}

/// Slow counters cost microseconds at every look, and some jump.
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
                "the kernel distrusts the processor's counter: `journalctl -k | grep -i clocksource` says why; update the BIOS",
            )
        }
        Ok(source) => check.ok(source),
    }
}
