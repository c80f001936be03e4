//! Keys of the evaluation: the purpose of each repetition.

use skinrig_model::{AnalysisSettings, CalibrationModel, PressRole};
use skinrig_settings::{Collector, Field, Numbers, Settings};

/// Purpose of each repetition. Repetitions are counted from 1; each one is in exactly one list.
#[derive(Settings)]
#[settings(parts = EvaluationParts)]
pub(crate) struct Evaluation {
    /// Repetitions whose ground truth may be used to fit the camera geometry. The first repetition is 1.
    calibrate: Numbers,
    /// Repetitions whose ground truth is used only for scoring. The first repetition is 1; `2-10` is a span.
    score: Numbers,
}

/// The role of each of `count` repetitions, from a mapping of [`Evaluation`].
pub(crate) fn roles(field: &Field, count: u32, out: &mut Collector) -> Option<Vec<PressRole>> {
    let lists = Evaluation::read_parts(field, &mut Collector::default());
    let mut roles = vec![None; count as usize];
    let mut clean = true;
    for (key, numbers, role) in [
        ("calibrate", &lists.calibrate, PressRole::Calibrate),
        ("score", &lists.score, PressRole::Score),
    ] {
        let Some(numbers) = numbers else {
            clean = false;
            continue;
        };
        let path = field.at(key).path.as_str();
        for numbers in &numbers.0 {
            if numbers.last > count {
                out.error(numbers.span, path, "there is no such repetition")
                    .expected(match count {
                        1 => "1: there is one repetition".to_owned(),
                        _ => format!("1 to {count}: there are {count} repetitions, counted from 1"),
                    })
                    .found(numbers.last.to_string());
                clean = false;
            }
            for number in numbers.first..=numbers.last.min(count) {
                if let Some(slot) = roles.get_mut(number as usize - 1) {
                    if slot.is_some() {
                        out.error(numbers.span, path, "the repetition is given twice")
                            .expected("each repetition once: presses that calibrate never score")
                            .found(format!("repetition {number}"));
                        clean = false;
                        break;
                    }
                    *slot = Some(role);
                }
            }
        }
    }
    if !clean {
        return None;
    }
    let missing: Vec<String> = (1u32..)
        .zip(&roles)
        .filter(|(_, role)| role.is_none())
        .map(|(number, _)| number.to_string())
        .take(10)
        .collect();
    let score = field.at("score");
    if !missing.is_empty() {
        out.error(
            score.span,
            field.path.as_str(),
            "repetitions without a purpose",
        )
        .expected("every repetition in `calibrate` or `score`")
        .found(format!("no purpose for repetition {}", missing.join(", ")));
        return None;
    }
    if !roles.contains(&Some(PressRole::Score)) {
        out.error(score.span, score.path.as_str(), "nothing is scored")
            .expected("at least one repetition")
            .found("none");
        return None;
    }
    roles.into_iter().collect()
}

/// Checks that a calibration has presses to use.
pub(crate) fn calibration_possible(
    roles: &[PressRole],
    analysis: &AnalysisSettings,
    evaluation: &Field,
    out: &mut Collector,
) {
    if roles.contains(&PressRole::Calibrate) || analysis.calibration == CalibrationModel::None {
        return;
    }
    let field = evaluation.at("calibrate");
    out.error(field.span, field.path.as_str(), "nothing to calibrate with")
        .expected("at least one repetition, or `analysis.calibration: none`")
        .found("no repetition")
        .help("give a repetition to `calibrate`, or write `analysis: {calibration: none}`");
}
