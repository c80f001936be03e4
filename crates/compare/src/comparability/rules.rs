//! Owns the rules that classify facts by path prefix. The first matching prefix wins.

use super::difference::Severity::{self, Blocking, Confounding, Harmless};

/// Severity of differences in one kind of fact.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Prefix of the fact's path.
    pub prefix: &'static str,
    /// Key for users, as in `--despite KEY`.
    pub key: &'static str,
    /// Severity of a difference.
    pub severity: Severity,
    /// Why.
    pub reason: &'static str,
    /// What to do about a blocking difference.
    pub next: Option<&'static str>,
}

const fn rule(
    prefix: &'static str,
    key: &'static str,
    severity: Severity,
    reason: &'static str,
) -> Rule {
    Rule {
        prefix,
        key,
        severity,
        reason,
        next: None,
    }
}

const fn blocking(
    prefix: &'static str,
    key: &'static str,
    reason: &'static str,
    next: &'static str,
) -> Rule {
    Rule {
        prefix,
        key,
        severity: Blocking,
        reason,
        next: Some(next),
    }
}

/// A key of the protocol that does not affect the compared presses.
const fn harmless(prefix: &'static str, reason: &'static str) -> Rule {
    rule(prefix, "protocol", Harmless, reason)
}

/// A part of the simulated cameras.
const fn camera(prefix: &'static str) -> Rule {
    rule(
        prefix,
        "simulated-cameras",
        Confounding,
        "the simulated cameras differ, not the skin",
    )
}

const SAME_RIG: &str = "compare sessions from the same kind of rig";
const SAME_TIP: &str = "press both skins with the same tip";
const NO_FAULT: &str = "record without --fault";
const PRESS_BY_PRESS: &str = "presses are compared one by one";
const CLOCKS: &str = "alignment and certificate of the clocks are compared";
const ENDS: &str = "ends a run, and does not change a press";

/// All rules, in order of precedence. `docs/reference/comparison.md` documents them.
pub const RULES: &[Rule] = &[
    blocking(
        "rig.kind",
        "rig-kind",
        "different kinds of rig have different error sources",
        SAME_RIG,
    ),
    blocking(
        "rig.level",
        "sim-level",
        "simulation levels omit different errors",
        "simulate both skins at the same --level",
    ),
    rule("rig.", "rig", Harmless, "a name"),
    blocking(
        "protocol.prototype.tip",
        "tip",
        "another tip has another contact area",
        SAME_TIP,
    ),
    blocking(
        "bench.tip",
        "tip",
        "another tip has another contact area",
        SAME_TIP,
    ),
    blocking(
        "simulation.tip",
        "tip",
        "another tip has another contact area",
        SAME_TIP,
    ),
    blocking(
        "protocol.faults",
        "planted-fault",
        "a fault was injected",
        NO_FAULT,
    ),
    blocking(
        "simulation.faults",
        "planted-fault",
        "a fault was injected",
        NO_FAULT,
    ),
    rule(
        "protocol.motion",
        "motion",
        Confounding,
        "speed and duration of presses change the events",
    ),
    harmless("protocol.surface_check", ENDS),
    rule(
        "protocol.surface",
        "surface",
        Confounding,
        "depths are measured from another surface",
    ),
    rule(
        "protocol.roles",
        "evaluation",
        Confounding,
        "different repetitions calibrate or score",
    ),
    rule(
        "protocol.cameras",
        "camera-settings",
        Confounding,
        "cameras were configured differently",
    ),
    rule(
        "protocol.surroundings.outline",
        "outline",
        Confounding,
        "another outline rejects other estimates",
    ),
    rule(
        "protocol.online.react",
        "react",
        Confounding,
        "presses that react to being felt hold shorter, or are less deep",
    ),
    rule(
        "protocol.order",
        "order",
        Confounding,
        "in another order, relaxation and drift meet other locations",
    ),
    rule(
        "protocol.pause_between",
        "pauses",
        Confounding,
        "in longer pauses the skin recovers further",
    ),
    rule(
        "protocol.stop",
        "stop",
        Confounding,
        "a campaign that ends once its error is low enough looks better",
    ),
    harmless("protocol.name", "a name"),
    harmless("protocol.plan", PRESS_BY_PRESS),
    harmless("protocol.path_kind", PRESS_BY_PRESS),
    harmless("protocol.seed", PRESS_BY_PRESS),
    harmless("protocol.shuffle_seed", PRESS_BY_PRESS),
    harmless("protocol.calibrate_at", PRESS_BY_PRESS),
    harmless(
        "protocol.return_to_start",
        "a motion between repetitions, off the skin",
    ),
    harmless("protocol.sync", CLOCKS),
    harmless("protocol.marks", CLOCKS),
    harmless(
        "protocol.surroundings.keep_outs",
        "where the tip may not go",
    ),
    harmless("protocol.limits", ENDS),
    harmless("protocol.max_consecutive_invalid", ENDS),
    harmless("protocol.suspend", "a suspended press is made again"),
    harmless(
        "protocol.retakes",
        "presses are made again when their data are lost, whatever the skin",
    ),
    harmless(
        "protocol.online",
        "the analysis does not use what was felt while recording",
    ),
    rule(
        "protocol.",
        "protocol",
        Confounding,
        "may affect the compared presses",
    ),
    rule(
        "bias.",
        "biases",
        Confounding,
        "biases change the sensitivity of the camera, not of the skin",
    ),
    rule(
        "device.camera1.model",
        "camera-model",
        Confounding,
        "another sensor has another response",
    ),
    rule(
        "device.camera2.model",
        "camera-model",
        Confounding,
        "another sensor has another response",
    ),
    rule(
        "device.indenter.model",
        "robot-model",
        Confounding,
        "another robot has another repeatability",
    ),
    rule(
        "device.",
        "device",
        Harmless,
        "same model; idle noise is measured before each press",
    ),
    rule(
        "simulation.motion",
        "simulated-robot",
        Confounding,
        "the simulated robot moves differently",
    ),
    rule(
        "simulation.true_cameras",
        "camera-locations",
        Harmless,
        "each session's own calibration absorbs it; ray angles are compared",
    ),
    camera("simulation.optical.uneven_pixels"),
    camera("simulation.optical.uneven_noise"),
    camera("simulation.optical.dark_latency"),
    camera("simulation.optical.readout"),
    camera("simulation.optical.threshold"),
    camera("simulation.optical.latency_us"),
    camera("simulation.optical.refractory_us"),
    camera("simulation.optical.shot_hz"),
    camera("simulation.optical.leak_hz"),
    camera("simulation.optical.hot_"),
    camera("simulation.geometric.background_hz"),
    camera("simulation.geometric.hot"),
    rule(
        "simulation.camera_clock",
        "simulated-clocks",
        Harmless,
        CLOCKS,
    ),
    rule(
        "simulation.trigger_box",
        "simulated-clocks",
        Harmless,
        CLOCKS,
    ),
    rule(
        "simulation.drawn_cameras",
        "camera-locations",
        Harmless,
        "ray angles are compared",
    ),
    rule(
        "simulation.",
        "simulated-skin",
        Harmless,
        "the simulated skin itself, which is what is compared",
    ),
    rule(
        "bench.",
        "bench",
        Harmless,
        "describes the bench, not the presses",
    ),
    rule(
        "analysis.bootstrap_resamples",
        "intervals",
        Harmless,
        "affects only the session's own intervals",
    ),
    rule(
        "analysis.seed",
        "intervals",
        Harmless,
        "affects only the session's own intervals",
    ),
    rule(
        "analysis.study_presses",
        "studies",
        Confounding,
        "latencies come from different presses",
    ),
    rule(
        "analysis.latency",
        "latency-settings",
        Confounding,
        "another detector gives other latencies",
    ),
    rule(
        "analysis.within_mm",
        "within",
        Harmless,
        "the comparison uses one limit for all",
    ),
    rule(
        "analysis.failure_penalty_mm",
        "penalty",
        Harmless,
        "not compared",
    ),
    rule("analysis.reduction", "studies", Harmless, "not compared"),
    rule("analysis.cmre", "studies", Harmless, "not compared"),
    rule(
        "analysis.alignment",
        "alignment-limits",
        Harmless,
        "limits for clocks, not for presses",
    ),
    rule(
        "analysis.bits_per_event",
        "bits-per-event",
        Confounding,
        "bytes are counted differently",
    ),
    rule(
        "analysis.",
        "settings",
        Confounding,
        "the analysis may cause the difference; see the causes",
    ),
    rule(
        "calibration.origin",
        "calibration-origin",
        Confounding,
        "the calibrations of the skins come from different presses",
    ),
    rule(
        "calibration.",
        "calibration",
        Confounding,
        "another camera model leaves another bias behind",
    ),
    rule(
        "locator.used",
        "locator",
        Confounding,
        "the skins were judged by different locators; `analysis.locator: geometry` needs the fewest presses and judges both alike",
    ),
    rule(
        "software.recorded",
        "software",
        Harmless,
        "this version analyses all sessions",
    ),
    rule(
        "session.end",
        "incomplete",
        Confounding,
        "presses are missing, and not at random locations",
    ),
    blocking(
        "session.sealed",
        "unsealed",
        "an unsealed session may still change",
        "wait for the run, or `skinrig resume` it",
    ),
    rule(
        "session.lost_bytes",
        "losses",
        Confounding,
        "lost data invalidate presses, whatever the skin",
    ),
];

/// First rule that matches this path.
pub(super) fn rule_of(path: &str) -> Option<&'static Rule> {
    RULES.iter().find(|r| path.starts_with(r.prefix))
}

#[cfg(test)]
mod tests {
    use super::RULES;

    #[test]
    fn no_rule_hides_a_later_one() {
        for (i, rule) in RULES.iter().enumerate() {
            let earlier = RULES[..i]
                .iter()
                .find(|e| rule.prefix.starts_with(e.prefix));
            assert!(
                earlier.is_none(),
                "{} hides {}",
                earlier.unwrap().prefix,
                rule.prefix
            );
        }
    }
}
