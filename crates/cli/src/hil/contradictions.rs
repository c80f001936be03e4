//! A suite against the rig that it is to run on: values of checks that the limits of the rig rule out.

use skinrig_protocol::rig::{BenchLimits, RigFile};
use skinrig_protocol::suite::{Check, Measure, Suite};

use crate::exit::Failure;

/// A value of a check beyond a limit of the rig.
#[derive(Debug, PartialEq)]
struct Contradiction {
    /// Key of the check.
    key: &'static str,
    unit: &'static str,
    asked: f64,
    /// Key of the limit.
    limit: &'static str,
    allowed: f64,
}

/// Rejects values of the selected checks that the limits of the rig rule out: no check may measure anything else than it says.
///
/// # Errors
/// [`Failure::input`] with all of them.
pub(super) fn refuse(suite: &Suite, rig: &RigFile, only: Option<&[String]>) -> Result<(), Failure> {
    let runs = |c: &&Check| c.skip.is_none() && only.is_none_or(|o| o.iter().any(|w| w == c.name));
    let found = suite.checks.iter().filter(runs).flat_map(|check| {
        let each = of(&check.measure, &rig.limits).into_iter();
        each.map(|c| {
            format!(
                "{}: checks.{}.{}: expected at most {} {}, `limits.{}` of {}, found {} {}",
                suite.file_name,
                check.name,
                c.key,
                c.allowed,
                c.unit,
                c.limit,
                rig.file_name,
                c.asked,
                c.unit
            )
        })
    });
    let found: Vec<String> = found.collect();
    if found.is_empty() {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}\n  next: lower the value of the check, raise the limit if the robot and the skin bear it, or `skip` the check",
        found.join("\n")
    )))
}

/// What the limits rule out.
fn of(measure: &Measure, limits: &BenchLimits) -> Vec<Contradiction> {
    let beyond = |key, unit, asked: f64, limit, allowed: f64| {
        (asked > allowed).then_some(Contradiction {
            key,
            unit,
            asked,
            limit,
            allowed,
        })
    };
    let speed = |mm_s| beyond("speed", "mm/s", mm_s, "max_speed", limits.max_speed_mm_s);
    let depth = |mm| beyond("depth", "mm", mm, "max_depth", limits.max_depth_mm);
    let force = |n| beyond("force", "N", n, "max_force", limits.max_force_n);
    let found = match measure {
        Measure::Repeatability { speed_mm_s, .. } => [speed(*speed_mm_s), None],
        Measure::Depth { depth_mm, .. } => [depth(*depth_mm), None],
        Measure::ForceCeiling { force_n, depth_mm } => [force(*force_n), depth(*depth_mm)],
        _ => [None, None],
    };
    found.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use skinrig_protocol::rig::Workspace;

    use super::*;

    #[test]
    fn only_values_beyond_their_limits_are_named() {
        let limits = BenchLimits {
            workspace: Workspace {
                min_mm: [-50.0; 3],
                max_mm: [50.0; 3],
            },
            max_speed_mm_s: 40.0,
            max_force_n: 1.0,
            max_lead_mm: 2.0,
            max_depth_mm: 3.0,
        };
        let keys = |measure: &Measure| -> Vec<_> {
            let found = of(measure, &limits).into_iter();
            found.map(|c| (c.key, c.limit)).collect()
        };
        let speed = |speed_mm_s| Measure::Repeatability {
            approaches: 2,
            speed_mm_s,
        };
        let force = |force_n, depth_mm| Measure::ForceCeiling { force_n, depth_mm };
        let depth = |depth_mm| Measure::Depth {
            depth_mm,
            presses: 1,
        };
        for within in [
            speed(40.0),
            force(1.0, 3.0),
            depth(3.0),
            Measure::RobotState,
        ] {
            assert_eq!(keys(&within), [], "{within:?}");
        }
        assert_eq!(keys(&speed(40.1)), [("speed", "max_speed")]);
        assert_eq!(keys(&depth(3.1)), [("depth", "max_depth")]);
        let both = [("force", "max_force"), ("depth", "max_depth")];
        assert_eq!(keys(&force(1.1, 3.1)), both);
    }
}
