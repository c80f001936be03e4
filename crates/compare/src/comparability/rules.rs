//! Owns the table of rules: which fact is worth what, and why. The first rule whose prefix fits a fact's path holds.

use super::difference::Weight::{self, Blocking, Confounding, Harmless};

/// What a difference of a kind of fact is worth.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Of the fact's path.
    pub prefix: &'static str,
    /// Names the rule.
    pub key: &'static str,
    /// What it is worth.
    pub weight: Weight,
    /// Why.
    pub reason: &'static str,
    /// What to do.
    pub next: Option<&'static str>,
}

const fn rule(
    prefix: &'static str,
    key: &'static str,
    weight: Weight,
    reason: &'static str,
) -> Rule {
    Rule {
        prefix,
        key,
        weight,
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
        weight: Blocking,
        reason,
        next: Some(next),
    }
}

const SAME_RIG: &str = "compare sessions of one kind of rig";
const SAME_TIP: &str = "press both skins with the same tip";
const NO_FAULT: &str = "record without --fault";

/// The rules. `docs/reference/comparison.md` shows them to users.
pub const RULES: &[Rule] = &[
    blocking(
        "rig.kind",
        "rig-kind",
        "numbers of different kinds of rig have different causes",
        SAME_RIG,
    ),
    blocking(
        "rig.level",
        "sim-level",
        "levels of the simulation leave different errors out",
        "simulate both at one --level",
    ),
    rule("rig.", "rig", Harmless, "a name"),
    blocking(
        "protocol.prototype.tip",
        "tip",
        "another tip touches another area",
        SAME_TIP,
    ),
    blocking(
        "bench.tip",
        "tip",
        "another tip touches another area",
        SAME_TIP,
    ),
    blocking(
        "simulation.tip",
        "tip",
        "another tip touches another area",
        SAME_TIP,
    ),
    blocking(
        "protocol.faults",
        "planted-fault",
        "a fault was made on purpose",
        NO_FAULT,
    ),
    blocking(
        "simulation.faults",
        "planted-fault",
        "a fault was made on purpose",
        NO_FAULT,
    ),
    rule(
        "protocol.motion",
        "motion",
        Confounding,
        "faster or longer presses make other events",
    ),
    rule(
        "protocol.surface",
        "surface",
        Confounding,
        "depths count from another surface",
    ),
    rule(
        "protocol.roles",
        "evaluation",
        Confounding,
        "other repetitions calibrate or score",
    ),
    rule(
        "protocol.cameras",
        "camera-settings",
        Confounding,
        "the cameras were set to see otherwise",
    ),
    rule(
        "protocol.surroundings.outline",
        "outline",
        Confounding,
        "another outline leaves other estimates out",
    ),
    rule(
        "protocol.",
        "protocol",
        Harmless,
        "does not touch the presses that are compared",
    ),
    rule(
        "bias.",
        "biases",
        Confounding,
        "another bias is another sensitivity of the camera, not of the skin",
    ),
    rule(
        "device.camera1.model",
        "camera-model",
        Confounding,
        "another sensor sees otherwise",
    ),
    rule(
        "device.camera2.model",
        "camera-model",
        Confounding,
        "another sensor sees otherwise",
    ),
    rule(
        "device.indenter.model",
        "robot-model",
        Confounding,
        "another robot repeats otherwise",
    ),
    rule(
        "device.",
        "device",
        Harmless,
        "the same model; its own noise is measured before each press",
    ),
    rule(
        "simulation.motion",
        "simulated-robot",
        Confounding,
        "the simulated robot moves otherwise",
    ),
    rule(
        "simulation.true_cameras",
        "camera-places",
        Harmless,
        "each session's own calibration takes it up",
    ),
    rule(
        "simulation.",
        "simulated-skin",
        Harmless,
        "the skin that was simulated: what is compared",
    ),
    rule(
        "bench.",
        "bench",
        Harmless,
        "of the bench, not of the presses",
    ),
    rule(
        "analysis.bootstrap_resamples",
        "intervals",
        Harmless,
        "only of the session's own intervals",
    ),
    rule(
        "analysis.seed",
        "intervals",
        Harmless,
        "only of the session's own intervals",
    ),
    rule(
        "analysis.study_presses",
        "studies",
        Confounding,
        "latencies stand on other presses",
    ),
    rule(
        "analysis.latency",
        "latency-settings",
        Confounding,
        "another detector has other latencies",
    ),
    rule(
        "analysis.within_mm",
        "within",
        Harmless,
        "one X is asked of all",
    ),
    rule(
        "analysis.failure_penalty_mm",
        "penalty",
        Harmless,
        "not part of a comparison",
    ),
    rule(
        "analysis.reduction",
        "studies",
        Harmless,
        "not part of a comparison",
    ),
    rule(
        "analysis.cmre",
        "studies",
        Harmless,
        "not part of a comparison",
    ),
    rule(
        "analysis.alignment",
        "alignment-limits",
        Harmless,
        "limits of the clocks, not of the presses",
    ),
    rule(
        "analysis.bits_per_event",
        "bits-per-event",
        Confounding,
        "bytes are counted otherwise",
    ),
    rule(
        "analysis.",
        "settings",
        Confounding,
        "the difference may be the analysis's: see the causes",
    ),
    rule(
        "calibration.origin",
        "calibration-origin",
        Confounding,
        "one skin was calibrated, the other was not",
    ),
    rule(
        "calibration.",
        "calibration",
        Confounding,
        "another camera model leaves another bias",
    ),
    rule(
        "software.recorded",
        "software",
        Harmless,
        "all are analysed by this version",
    ),
    rule(
        "session.end",
        "incomplete",
        Confounding,
        "presses are missing, and not at random places",
    ),
    blocking(
        "session.sealed",
        "unsealed",
        "a session that is not sealed may still change",
        "wait for the run, or `skinrig resume` it",
    ),
    rule(
        "session.lost_bytes",
        "losses",
        Confounding,
        "presses with lost data are invalid, whatever the skin",
    ),
];

/// The rule for the fact with this path; `None` for one that no rule speaks of.
pub(super) fn rule_of(path: &str) -> Option<&'static Rule> {
    RULES.iter().find(|r| path.starts_with(r.prefix))
}
