//! Maps each collected failure of the public code to a named test.
//!
//! The case names come from a collection made by running the public code. The checks verify that the named tests exist, and
//! that the fixtures of geometry and clusters contain the listed cases; the tests themselves assert the results.

/// (group, case, file under the workspace's root, test).
const CASES: &[(&str, &str, &str, &str)] = &[
    ("geometry", "second_root", GEOMETRY, SOLVER),
    ("geometry", "root_flip_edge", GEOMETRY, SOLVER),
    ("geometry", "guess_side", GEOMETRY, SOLVER),
    ("geometry", "theta_zero", GEOMETRY, SOLVER),
    ("geometry", "theta_small", GEOMETRY, SOLVER),
    ("geometry", "tan_clamp", GEOMETRY, SOLVER),
    ("geometry", "vertical_ray", GEOMETRY, SOLVER),
    ("geometry", "parallel", GEOMETRY, SOLVER),
    (
        "geometry",
        "parallel",
        RAYS,
        "rays_from_a_right_angle_to_a_millionth_of_a_millionth_of_a_degree_apart",
    ),
    ("geometry", "baseline", GEOMETRY, SOLVER),
    (
        "geometry",
        "baseline",
        RAYS,
        "a_contact_near_the_baseline_is_as_good_as_its_sine_or_parallel",
    ),
    ("geometry", "behind", GEOMETRY, SOLVER),
    (
        "geometry",
        "behind",
        RAYS,
        "behind_and_in_front_are_distinguished_up_to_rounding",
    ),
    (
        "geometry",
        "nan",
        GEOMETRY,
        "missing_views_and_impossible_cameras_are_missing",
    ),
    (
        "geometry",
        "nan",
        RAYS,
        "estimates_of_extreme_geometry_are_finite_or_missing",
    ),
    (
        "grid",
        "46 of 289 points moved",
        GEOMETRY,
        "grid_points_that_the_public_solver_moves_stay_fixed",
    ),
    (
        "grid",
        "all 289 points",
        GEOMETRY,
        "the_complete_grid_is_located_exactly",
    ),
    (
        "bounds",
        "parameters anywhere in the optimiser's box",
        GEOMETRY,
        "rays_through_a_point_intersect_at_it",
    ),
    (
        "calibration",
        "presses outside are dropped",
        CALIBRATION,
        "outliers_and_presses_without_a_fix_pull_little",
    ),
    (
        "lens",
        "slope 0 at W = 1, s = 1",
        LENS,
        "columns_and_angles_are_inverse_while_the_angle_grows",
    ),
    (
        "outline",
        "box and outline differ",
        "crates/model/src/skin.rs",
        "corners_of_the_box_are_outside_the_outline",
    ),
    ("cluster", "all_noise", CLUSTERING, SCIKIT),
    ("cluster", "border_a_first", CLUSTERING, SCIKIT),
    ("cluster", "border_b_first", CLUSTERING, SCIKIT),
    ("cluster", "border_not_bridge", CLUSTERING, SCIKIT),
    ("cluster", "empty", CLUSTERING, SCIKIT),
    ("cluster", "eps_exclusive", CLUSTERING, SCIKIT),
    ("cluster", "eps_inclusive", CLUSTERING, SCIKIT),
    ("cluster", "hot_pixel", CLUSTERING, SCIKIT),
    ("cluster", "min1", CLUSTERING, SCIKIT),
    ("cluster", "nine_and_ten", CLUSTERING, SCIKIT),
    ("cluster", "tie", CLUSTERING, SCIKIT),
    (
        "cluster",
        "memory grows with neighbours",
        PRESSES,
        "none_one_two_and_ten_million_events",
    ),
    ("cmre", "exact_centre", COVERAGE, CONTACT_MAPS),
    ("cmre", "same_cell", COVERAGE, CONTACT_MAPS),
    ("cmre", "on_edge", COVERAGE, CONTACT_MAPS),
    ("cmre", "one_cell", COVERAGE, CONTACT_MAPS),
    ("cmre", "two_cells", COVERAGE, CONTACT_MAPS),
    ("cmre", "far_outside", COVERAGE, CONTACT_MAPS),
    ("cmre", "gt_outside", COVERAGE, CONTACT_MAPS),
    ("cmre", "gt_on_edge", COVERAGE, CONTACT_MAPS),
    ("passrate", "same", REFERENCE, PASS_RATE),
    ("passrate", "none_found", REFERENCE, PASS_RATE),
    ("passrate", "one_found", REFERENCE, PASS_RATE),
    ("passrate", "half_missing", REFERENCE, PASS_RATE),
    (
        "latency",
        "normal",
        LATENCY,
        "a_planted_step_is_found_in_its_bin",
    ),
    ("latency", "bg_none", LATENCY, BACKGROUND),
    ("latency", "bg_one", LATENCY, BACKGROUND),
    ("latency", "bg_two_close", LATENCY, BACKGROUND),
    ("latency", "bg_identical", LATENCY, BACKGROUND),
    ("latency", "short_trial", LATENCY, NO_ANSWER),
    ("latency", "single_event_at_zero", LATENCY, NO_ANSWER),
    (
        "latency",
        "nothing_detected",
        LATENCY,
        "onsets_count_about_their_median",
    ),
    (
        "latency",
        "two_far_apart",
        LATENCY,
        "onsets_count_about_their_median",
    ),
    ("latency", "no_bg_at_all", LATENCY, BACKGROUND),
    (
        "latency",
        "select_all_nan",
        LATENCY,
        "the_threshold_has_the_fewest_false_alarms_among_those_that_detect_enough",
    ),
    (
        "latency",
        "kernel",
        LATENCY,
        "the_kernel_is_the_published_one_and_keeps_a_constant",
    ),
    (
        "latency",
        "bins_0.6 bins_1.7 bins_0.3 bins_1.0 bins_0.0002 bins_0.00021",
        "tests/analysis/latency/binning.rs",
        "windows_of_published_length_hold_the_published_bins",
    ),
    (
        "bimvee",
        "time_inclusive time_exact_span time_almost_span time_nonzero_false",
        ACCUMULATE,
        WINDOWS,
    ),
    (
        "bimvee",
        "time_none_left time_all_zero",
        "tests/tests/system/numerics/rates.rs",
        "without_background_and_without_events_everything_has_its_row",
    ),
    (
        "bimvee",
        "time_unsorted",
        CLOCKS,
        "disorder_within_ten_milliseconds_changes_nothing",
    ),
    (
        "bimvee",
        "time_negative_start",
        "crates/analysis/src/segment.rs",
        "a_window_before_the_camera_clock_is_empty",
    ),
    (
        "bimvee",
        "space_inclusive space_none_left",
        CLUSTERING,
        "the_grid_takes_only_its_crop",
    ),
];

const GEOMETRY: &str = "tests/analysis/geometry.rs";
const CLUSTERING: &str = "tests/analysis/clustering.rs";
const CALIBRATION: &str = "tests/analysis/calibration.rs";
const COVERAGE: &str = "tests/analysis/coverage.rs";
const LATENCY: &str = "tests/analysis/latency/detecting.rs";
const ACCUMULATE: &str = "crates/analysis/src/accumulate/tests.rs";
const REFERENCE: &str = "crates/analysis/src/reference_code.rs";
const RAYS: &str = "tests/tests/system/numerics/rays.rs";
const LENS: &str = "tests/tests/system/numerics/lens.rs";
const PRESSES: &str = "tests/tests/system/numerics/presses.rs";
const CLOCKS: &str = "tests/tests/system/numerics/clocks.rs";
const SOLVER: &str = "every_case_of_the_public_solver_comes_out_right";
const SCIKIT: &str = "the_labels_are_those_of_scikit_learn";
const CONTACT_MAPS: &str = "contact_maps_score_as_in_the_public_code_but_for_its_two_faults";
const BACKGROUND: &str = "every_background_has_a_rate";
const NO_ANSWER: &str = "trials_without_an_answer_are_answered_with_none";
const PASS_RATE: &str = "a_missing_press_passes_under_the_published_rule_and_fails_under_ours";
const WINDOWS: &str =
    "windows_include_their_start_and_exclude_their_end_in_any_order_within_the_slack";

#[test]
fn every_case_names_a_test_that_exists() {
    for (group, case, file, test) in CASES {
        let path = format!("{}/../{file}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap();
        let found = text.contains(&format!("fn {test}("));
        assert!(found, "{group}, {case}: no test `{test}` in {file}");
    }
}

#[test]
fn the_fixtures_hold_the_cases_that_the_table_counts_on() {
    let kinds = |text: &str| -> std::collections::BTreeSet<String> {
        let value: serde_json::Value = serde_json::from_str(text).unwrap();
        let cases = value["cases"].as_array().unwrap().iter();
        cases
            .map(|c| c["case"].as_str().unwrap().to_owned())
            .collect()
    };
    let geometry = kinds(include_str!("../../../analysis/fixtures/geometry.json"));
    let clusters = kinds(include_str!("../../../analysis/fixtures/clusters.json"));
    for (group, case, file, _) in CASES {
        let held = match *file {
            GEOMETRY if *group == "geometry" => &geometry,
            CLUSTERING if *group == "cluster" => &clusters,
            _ => continue,
        };
        let known = held
            .iter()
            .any(|kind| kind.replace([' ', '-'], "_").contains(case));
        assert!(known, "{group}: no `{case}` among {held:?}");
    }
}
