//! True digits of a planted session.

use skinrig_analysis::digits::{MOST, digits};
use skinrig_planted::grid::session;

#[test]
fn the_metrics_of_a_planted_session_keep_most_of_their_digits() {
    let (mut input, source) = session();
    input.settings.reduction.max_power = 1;
    let study = digits(&input, &source, 4, &|_| {}).unwrap();
    assert_eq!(study.changed, [""; 0]);
    let of = |path: &str| study.of(path).unwrap();
    // The calibration ends with some digits less than its inputs have.
    let rmse = of("scored.rmse_mm.value");
    assert!((8.0..MOST).contains(&rmse.digits), "{rmse:?}");
    // What comes from events and times alone does not move.
    let rate = of("bit_rates.press_events_per_s.value");
    assert_eq!(rate.digits, MOST);
    assert!(study.of("settings.eps_px").is_none());
}

/// A share whose limit one error meets to the last bit.
#[test]
fn a_count_on_the_edge_has_few_digits() {
    let (mut input, source) = session();
    input.settings.reduction.max_power = 0;
    let errors = |input: &skinrig_analysis::SessionInput| {
        let analysis = skinrig_analysis::analyze(input, &source).unwrap();
        let mut errors: Vec<f64> = analysis
            .presses
            .iter()
            .filter(|p| p.role == skinrig_model::PressRole::Score)
            .filter_map(|p| p.error_mm())
            .map(|(x, y)| libm::hypot(x, y))
            .collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    let errors = errors(&input);
    input.settings.within_mm = errors[errors.len() / 2];
    let study = digits(&input, &source, 6, &|_| {}).unwrap();
    let within = study.of("scored.within_rate.value").unwrap();
    assert!(within.digits < 2.0, "{within:?}");
}
