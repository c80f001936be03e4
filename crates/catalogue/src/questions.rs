//! The list of questions.

use crate::question::{Parameter, ParameterKind, Question};
use crate::results::OFFICIAL;

const fn required(name: &'static str) -> Parameter {
    Parameter {
        name,
        kind: ParameterKind::Text,
        default: None,
    }
}

const fn optional(name: &'static str, kind: ParameterKind, default: &'static str) -> Parameter {
    Parameter {
        name,
        kind,
        default: Some(default),
    }
}

const PROTOTYPE: Parameter = required("prototype");
const MIN_SESSIONS: Parameter = optional("min_sessions", ParameterKind::Count, "3");
const ANALYSIS: Parameter = optional("analysis", ParameterKind::Text, OFFICIAL);
const CAMERA: Parameter = optional(
    "camera",
    ParameterKind::Choice(&["camera1", "camera2"]),
    "camera1",
);
const ROLE: Parameter = optional(
    "role",
    ParameterKind::Choice(&["indenter", "camera1", "camera2", "trigger_box"]),
    "camera1",
);
const RELATION: Parameter = optional(
    "relation",
    ParameterKind::Choice(&["molded_from", "repaired", "recut"]),
    "repaired",
);
const SINCE: Parameter = optional("since", ParameterKind::Day, "1970-01-01");
const UNTIL: Parameter = optional("until", ParameterKind::LastDay, "9999-12-31");
const LIMIT: Parameter = optional("limit", ParameterKind::Count, "50");

/// A question whose statement is in `questions/`.
macro_rules! question {
    ($name:literal, $about:literal, [$($parameter:expr),*]) => {
        Question {
            name: $name,
            about: $about,
            parameters: &[$($parameter),*],
            sql: include_str!(concat!("../questions/", $name, ".sql")),
        }
    };
}

/// Every question.
const QUESTIONS: &[Question] = &[
    question!(
        "best-prototypes",
        "Which prototypes have the lowest RMSE where no press calibrated?",
        [MIN_SESSIONS, ANALYSIS]
    ),
    question!(
        "prototype-trend",
        "How did the RMSE of a prototype change from session to session?",
        [PROTOTYPE, ANALYSIS]
    ),
    question!(
        "clock-drift",
        "How did the clock of a camera drift against the trigger box, by month?",
        [CAMERA, SINCE, UNTIL]
    ),
    question!(
        "calibration-drift",
        "How did a fitted parameter of the cameras move, by month?",
        [required("parameter"), SINCE, UNTIL]
    ),
    question!("press-faults", "Which faults cost presses?", [SINCE, UNTIL]),
    question!(
        "failing-places",
        "Which places of a prototype fail most often?",
        [PROTOTYPE, LIMIT]
    ),
    question!(
        "failure-causes",
        "Why do presses of a prototype fail?",
        [PROTOTYPE]
    ),
    question!(
        "place-errors",
        "How did the error at each place of a prototype change, by month?",
        [PROTOTYPE, SINCE, UNTIL]
    ),
    question!(
        "depth-errors",
        "How does the error of a prototype depend on the depth?",
        [PROTOTYPE]
    ),
    question!(
        "operators",
        "Who recorded how much, and which share of the presses is valid?",
        [SINCE, UNTIL]
    ),
    question!("rigs", "Which rigs recorded how much?", [SINCE, UNTIL]),
    question!(
        "presses-per-day",
        "How many presses were made on each day?",
        [SINCE, UNTIL]
    ),
    question!(
        "unfinished",
        "Which sessions are not sealed or not completed?",
        [LIMIT]
    ),
    question!("invalid", "Which official analyses are INVALID?", [LIMIT]),
    question!(
        "not-analyzed",
        "Which sessions have no official results, unusable ones, or those of an older analysis?",
        [LIMIT]
    ),
    question!(
        "tagged",
        "Which sessions have a tag?",
        [required("tag"), LIMIT]
    ),
    question!("tags", "Which tags are in use?", []),
    question!(
        "notes",
        "Which notes contain a text?",
        [required("text"), LIMIT]
    ),
    question!("devices", "Which devices took part, and when?", []),
    question!(
        "firmware",
        "Did another firmware of a device change the RMSE?",
        [ROLE]
    ),
    question!(
        "software",
        "Did another version of skinrig change the RMSE?",
        []
    ),
    question!(
        "lineage",
        "What precedes a prototype, and what was made from it?",
        [PROTOTYPE]
    ),
    question!(
        "repairs",
        "Did a repair, a new mold or a re-cut change the RMSE?",
        [RELATION]
    ),
    question!(
        "variant-gain",
        "What does a variant of the analysis gain over the official one, by prototype?",
        [required("analysis")]
    ),
    question!("variants", "Which analyses are there?", []),
    question!("protocols", "Which versions of each protocol were run?", []),
    question!(
        "losses",
        "Which sessions lost camera bytes?",
        [SINCE, UNTIL, LIMIT]
    ),
    question!(
        "storage",
        "How much disk space do the sessions of each month take?",
        []
    ),
    question!("resumed", "Which sessions have several legs?", [LIMIT]),
    question!("copies", "Which sessions have several files?", [LIMIT]),
    question!(
        "night-verdicts",
        "How often did each suite of checks end with which verdict?",
        [SINCE, UNTIL]
    ),
    question!(
        "night-values",
        "How did a metric of the nights change?",
        [
            required("check"),
            required("subject"),
            required("metric"),
            SINCE,
            UNTIL
        ]
    ),
];

impl Question {
    /// Every question, by name.
    #[must_use]
    pub const fn all() -> &'static [Self] {
        QUESTIONS
    }

    /// The question called `name`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        QUESTIONS.iter().find(|q| q.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Questions whose averages are of one analysis or one prototype's comparison each.
    const EACH_ALONE: [&str; 1] = ["variants"];

    #[test]
    fn every_statement_is_a_question_and_uses_its_parameters() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/questions");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        let mut names: Vec<String> = QUESTIONS
            .iter()
            .map(|q| format!("{}.sql", q.name))
            .collect();
        files.sort();
        names.sort();
        assert_eq!(files, names);
        for question in QUESTIONS {
            let is_valid = question.sql.contains("is_valid = 1");
            let results = ["rmse_mm", " press ", "clock_fit", "calibration_value"];
            assert!(
                is_valid || !results.iter().any(|of| question.sql.contains(of)),
                "{}: numbers of an INVALID analysis are not to be read",
                question.name
            );
            assert!(
                question.sql.contains("located_rate >= 0.5")
                    || !(question.sql.contains("avg(") && question.sql.contains("rmse_mm")),
                "{}: the RMSE of few presses is that of the easy ones",
                question.name
            );
            let groups = question.sql.rsplit("GROUP BY").next().unwrap_or_default();
            let is_grouped = ["rig_kind", "protocol_name"]
                .iter()
                .all(|by| groups.contains(by));
            let compares = ["rmse_mm", "error_mm"]
                .iter()
                .any(|of| question.sql.contains(&format!(".{of})")));
            assert!(
                is_grouped
                    || !(question.sql.contains("avg(") && compares)
                    || EACH_ALONE.contains(&question.name),
                "{}: errors of different protocols or kinds of rig are averaged",
                question.name
            );
            let count = question.parameters.len();
            for n in 1..=9 {
                let used = question.sql.contains(&format!("${n}"));
                assert_eq!(used, n <= count, "{}: ${n}", question.name);
            }
        }
    }
}
