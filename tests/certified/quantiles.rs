//! Quantiles, distributions, intervals and tests.

use serde_json::Value;
use skinrig_analysis::metrics::{mean_over_locations, share_over_locations};
use skinrig_model::quantile;
use skinrig_statistics::distributions::{normal_quantile, student_cdf, student_quantile};
use skinrig_statistics::{
    ComparisonError, ComparisonTarget, ImprovementDirection, Interval, Pairing, Sample, Settings,
    compare, estimate,
};

use crate::problem::{Problem, Solution, numbers};

/// Resamples, which intervals of so few locations do not use.
const DRAWS: u32 = 2_000;

pub(crate) fn solve(problem: &Problem) -> Solution {
    let inputs = &problem.inputs;
    if inputs.get("values").is_some() {
        return match quantile(&problem.numbers("values"), problem.number("q")) {
            Some(found) => Solution::Values(vec![("quantile", found)]),
            None => Solution::Refused("undefined".to_owned(), "quantile -> None", Vec::new()),
        };
    }
    if let Some(name) = inputs.get("distribution") {
        return distribution(problem, name == "normal");
    }
    if inputs.get("pairing").is_some() {
        return test(problem);
    }
    if let Some(places) = inputs.get("by_place") {
        let places = places.as_array().unwrap().iter().map(numbers);
        let values: Vec<(u32, f64)> = (0u32..)
            .zip(places)
            .flat_map(|(i, place)| place.into_iter().map(move |v| (i, v)))
            .collect();
        let found = mean_over_locations(&values, DRAWS, 1);
        return limits(found.value, found.low, found.high);
    }
    if let Some(trues) = inputs.get("share") {
        let found = share_over_locations(&outcomes(trues), DRAWS, 1);
        return limits(found.value, found.low, found.high);
    }
    let by_location = |key: &str| (0u32..).zip(problem.numbers(key));
    let sample = if let Some(trues) = inputs.get("score") {
        Sample::share(outcomes(trues))
    } else if inputs.get("mean").is_some() {
        Sample::mean(by_location("mean")).unwrap()
    } else {
        Sample::rms(by_location("rms")).unwrap()
    };
    let Interval { value, low, high } = estimate(&sample, &Settings::default()).unwrap();
    limits(Some(value), low, high)
}

fn outcomes(trues: &Value) -> Vec<(u32, bool)> {
    let trues = trues.as_array().unwrap().iter();
    (0u32..).zip(trues.map(|v| v.as_bool().unwrap())).collect()
}

fn limits(value: Option<f64>, low: Option<f64>, high: Option<f64>) -> Solution {
    let number = |v: Option<f64>| v.unwrap_or(f64::NAN);
    Solution::Values(vec![
        ("value", number(value)),
        ("low", number(low)),
        ("high", number(high)),
    ])
}

fn distribution(problem: &Problem, is_normal: bool) -> Solution {
    let input = |key: &str| problem.inputs.get(key).and_then(Value::as_f64);
    let found = match (input("p"), input("t")) {
        (Some(p), _) if is_normal => ("quantile", normal_quantile(p)),
        (Some(p), _) => ("quantile", student_quantile(p, problem.number("df"))),
        (None, t) => ("probability", student_cdf(t.unwrap(), problem.number("df"))),
    };
    Solution::Values(vec![found])
}

fn test(problem: &Problem) -> Solution {
    let sample = |key: &str| Sample::mean((0u32..).zip(problem.numbers(key))).unwrap();
    let question = ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin: None,
    };
    let pairing = if problem.inputs["pairing"] == "shared" {
        Pairing::SharedLocations
    } else {
        Pairing::Independent
    };
    let settings = Settings {
        pairing,
        ..Settings::default()
    };
    let refused = |outcome: &str, name| Solution::Refused(outcome.to_owned(), name, Vec::new());
    match compare(&sample("a"), &sample("b"), &question, &settings) {
        Ok(found) => Solution::Values(vec![("p", found.p_difference)]),
        Err(ComparisonError::NoSpread { .. }) => refused("no spread", "ComparisonError::NoSpread"),
        Err(ComparisonError::TooFewLocations { .. }) => {
            refused("too few", "ComparisonError::TooFewLocations")
        }
        Err(other) => panic!("{}: {other}", problem.name),
    }
}
