//! Violations of a plan as findings in the protocol: one for each limit and key, at the key's own place.

use std::collections::BTreeMap;

use crate::check::{Violation, check};
use crate::plan::Plan;
use crate::protocol::Protocol;
use skinrig_settings::Field;
use skinrig_settings::{Diagnostic, Diagnostics};
use skinrig_settings::{Location, Sources};

/// Every key that a [`Violation`] may name.
const KEYS: &[&str] = &[
    "depth",
    "depths",
    "limits.max_depth",
    "limits.max_force",
    "limits.max_speed",
    "limits.workspace",
    "motion",
    "motion.approach",
    "motion.clearance",
    "motion.hold",
    "motion.home",
    "motion.indent",
    "motion.retract",
    "motion.settle.tolerance",
    "motion.travel",
    "path",
    "press.band",
    "press.speed",
    "press.threshold",
    "repetitions.between.pause",
    "surface_check.points",
    "sync.at",
    "sync.depth",
];

/// Examples listed in one finding.
const MOST_EXAMPLES: usize = 3;

/// Locations of the keys; a missing key has that of the nearest mapping around it.
pub(crate) fn places(root: &Field, sources: &Sources) -> BTreeMap<&'static str, Location> {
    KEYS.iter()
        .map(|key| {
            let mut field = root;
            for part in key.split('.') {
                match field.get(part) {
                    Some(inner) => field = inner,
                    None => break,
                }
            }
            (*key, sources.locate(field.span))
        })
        .collect()
}

impl Protocol {
    /// Checks every segment of `plan`, the plan of this protocol, against the limits; see [`check()`].
    ///
    /// # Errors
    /// [`Diagnostics`] with one finding for each limit and key: number of violations, the worst case and a few
    /// examples.
    pub fn check(&self, plan: &Plan) -> Result<(), Diagnostics> {
        let violations = check(plan, &self.surroundings, Some(self.motion.home));
        if violations.is_empty() {
            return Ok(());
        }
        Err(self.findings(&violations))
    }

    /// Violations grouped by limit and key, in the order in which the plan meets them.
    #[must_use]
    pub fn findings(&self, violations: &[Violation]) -> Diagnostics {
        let mut groups: Vec<Vec<&Violation>> = Vec::new();
        for violation in violations {
            let same = |group: &&mut Vec<&Violation>| {
                group
                    .first()
                    .is_some_and(|v| v.rule == violation.rule && v.key == violation.key)
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.push(violation),
                None => groups.push(vec![violation]),
            }
        }
        Diagnostics::new(groups.iter().filter_map(|g| self.finding(g)).collect())
    }

    fn finding(&self, group: &[&Violation]) -> Option<Diagnostic> {
        let worst = group.iter().copied().reduce(|a, b| {
            if b.excess.total_cmp(&a.excess).is_gt() {
                b
            } else {
                a
            }
        })?;
        let key = if worst.key == "depth" && self.depths_mm.len() > 1 {
            "depths"
        } else {
            worst.key
        };
        let mut examples: Vec<String> = Vec::new();
        for v in group {
            let example = place(v);
            if examples.len() < MOST_EXAMPLES && !examples.contains(&example) {
                examples.push(example);
            }
        }
        let found = match group.len() {
            1 => format!("{}: {}", place(worst), worst.found),
            n => format!(
                "{n} segments of the plan ({}, ...); the worst, {}: {}",
                examples.join("; "),
                place(worst),
                worst.found
            ),
        };
        Some(Diagnostic {
            message: worst.rule.to_string(),
            path: key.to_owned(),
            location: self.key_places.get(key)?.clone(),
            expected: Some(worst.expected.clone()),
            found: Some(found),
            help: Some(format!("change `{key}`")),
        })
    }
}

fn place(v: &Violation) -> String {
    match v.press {
        Some(press) => format!("{press}, {}", v.segment.name()),
        None => format!("step {}, {}", v.step, v.segment.name()),
    }
}
