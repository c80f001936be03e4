//! Every warning, violation and reason: its JSON, and its text.

use std::collections::BTreeSet;
use std::fmt::Display;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::{AlignmentViolation, LocatorFallback, Warning};
use crate::locator::FitError;

/// Reads each JSON, and compares its text and the JSON written again. Every kind of `T` needs a row.
pub(super) fn check<T: Serialize + DeserializeOwned + Display>(rows: &[(Value, &str)]) {
    for (row, text) in rows {
        let cause: T = serde_json::from_value(row.clone()).unwrap_or_else(|e| panic!("{row}: {e}"));
        assert_eq!(cause.to_string(), *text);
        let mut expected = row.clone();
        expected["text"] = json!(text);
        let written = serde_json::to_value(&cause).unwrap();
        assert_eq!(written, expected);
        // The text is for people: programs that read it back get the same cause with any.
        let mut reworded = written.clone();
        reworded["text"] = json!("other words");
        let read: T = serde_json::from_value(reworded).unwrap();
        assert_eq!(serde_json::to_value(&read).unwrap(), written);
    }
    let kinds = rows.iter().map(|(row, _)| row["kind"].as_str().unwrap());
    let unknown = serde_json::from_value::<T>(json!({ "kind": "?" }));
    let known = unknown.err().unwrap().to_string();
    // serde lists the kinds that it knows, each between backticks.
    let known = known.split('`').skip(1).step_by(2).filter(|k| *k != "?");
    assert_eq!(
        kinds.collect::<BTreeSet<_>>(),
        known.collect::<BTreeSet<_>>()
    );
}

#[test]
fn every_violation_has_fields_and_a_text_with_expected_and_found() {
    let rows = [
        (
            json!({"kind": "no_exchanges"}),
            "host from box: expected time exchanges, found none",
        ),
        (
            json!({"kind": "exchanges_fit_no_clock", "exchanges": 7}),
            "host from box: expected time exchanges that fit a clock, found 7 that do not",
        ),
        (
            json!({"kind": "exchanges_inconsistent"}),
            "host from box: expected consistent time exchanges, found some that exclude each other",
        ),
        (
            json!({"kind": "no_trains_clock", "camera": "camera2", "why": {"kind": "no_train"}}),
            "camera 2 from box: expected a clock, found none: the box reported no train",
        ),
        (
            json!({"kind": "no_trains_clock", "camera": "camera1",
                "why": {"kind": "unidentified", "sent": 12, "edges": 3}}),
            "camera 1 from box: expected a clock, found none: none of 12 sent trains can be identified among 3 edges",
        ),
        (
            json!({"kind": "no_map", "camera": "camera1", "at_s": 1.25}),
            "camera 1 from host: expected a map at 1.250 s, found none",
        ),
        (
            json!({"kind": "far_from_ties", "camera": "camera2", "tie_limit_s": 60.0,
                "limit_percent": 100.0 * 0.07, "found_percent": 12.345}),
            "camera 2 from host, contacts and releases without a tie within 60 s: expected at most 7 %, found 12.3 %",
        ),
        (
            json!({"kind": "clock_drifts", "clock": "trigger_box", "camera": "camera1", "near_us": 25.0,
                "off_line": 9, "sent": 10, "furthest_us": 812.4}),
            "trigger box, clock drift: expected the trains that camera 1 saw within 25 µs of a clock's line, found 9 of \
             10 up to 812 µs off it: they arrived, but this clock drifts faster than plausible, or jumps",
        ),
        (
            json!({"kind": "residuals", "map": "camera1_from_box", "limit_us": 5.0, "found_us": 6.25}),
            "camera 1 from box, residual rms: expected at most 5 µs, found 6.2 µs",
        ),
        (
            json!({"kind": "interval", "map": "camera2_from_camera1", "limit_us": 10.0, "found_us": 11.0}),
            "camera 2 from camera 1, 95 % interval at the presses plus systematic bound: expected at most 10 µs, found \
             11.0 µs",
        ),
        (
            json!({"kind": "coverage", "map": "camera2_from_box", "limit_percent": 12.3456, "found_percent": 40.0}),
            "camera 2 from box, share outside the stated interval: expected at most 12.346 %, found 40.0 %",
        ),
        (
            json!({"kind": "bound", "map": "host_from_box", "limit_us": 1000.0, "found_us": 1500.0}),
            "host from box, bound at the presses: expected at most 1000 µs, found 1500.0 µs",
        ),
        (
            json!({"kind": "drift", "map": "camera1_from_host", "limit_ppm": 200.0, "found_ppm": 250.0}),
            "camera 1 from host, drift: expected at most 200 ppm, found 250.0 ppm",
        ),
        (
            json!({"kind": "lost_edges", "camera": "camera1", "limit_percent": 5.0, "found_percent": 50.0}),
            "camera 1, trigger input, lost edges: expected at most 5 %, found 50.0 %",
        ),
        (
            json!({"kind": "extra_edges", "camera": "camera2", "limit_percent": 5.0, "found_percent": 6.0}),
            "camera 2, trigger input, doubled and spurious edges: expected at most 5 %, found 6.0 %",
        ),
        (
            json!({"kind": "no_rates_clock", "camera": "camera1", "why": {"kind": "few_presses", "found": 3}}),
            "camera 1: no clock alignment: expected at least 4 presses with known times to align the clock by event \
             rates, found 3",
        ),
        (
            json!({"kind": "presses_without_bursts", "camera": "camera1", "least_percent": 50.0, "presses": 20,
                "found": 4}),
            "camera 1: expected bursts of events at 50 % or more of the 20 planned presses, found 4",
        ),
        (
            json!({"kind": "bursts_without_presses", "camera": "camera2", "least_percent": 50.0, "bursts": 40,
                "found": 4}),
            "camera 2: expected 50 % or more of the 40 bursts of events during the plan to be planned presses, found 4: \
             the recording has more presses than the schedule",
        ),
        (
            json!({"kind": "uncertain_rates", "least_log_odds": 10.0, "log_odds": 1.25, "runner_up_s": [null, -4.0],
                "period_s": 2.0}),
            "alignment by event rates: expected log-odds of at least 10 (natural logarithm) against all other \
             alignments, found 1.2: presses later by camera 2 -4.0 s (-2.0 presses) fit about as well or better; check \
             the schedule (presses, sync presses, period) against the recordings, or lower \
             analysis.alignment.min_log_odds",
        ),
        (
            json!({"kind": "uncertain_rates", "least_log_odds": 10.0, "log_odds": 1.25, "runner_up_s": null,
                "period_s": 2.0}),
            "alignment by event rates: expected log-odds of at least 10 (natural logarithm) against all other \
             alignments, found 1.2: the plan may not belong to these recordings at all; check the schedule (presses, \
             sync presses, period) against the recordings, or lower analysis.alignment.min_log_odds",
        ),
        (
            json!({"kind": "uncertain_rates", "least_log_odds": 10.0, "log_odds": 1.25, "runner_up_s": [null, null],
                "period_s": 2.0}),
            "alignment by event rates: expected log-odds of at least 10 (natural logarithm) against all other \
             alignments, found 1.2: the plan may not belong to these recordings at all; check the schedule (presses, \
             sync presses, period) against the recordings, or lower analysis.alignment.min_log_odds",
        ),
    ];
    for (_, text) in &rows {
        assert!(
            text.contains("expected") && text.contains("found"),
            "{text}"
        );
    }
    check::<AlignmentViolation>(&rows);
}

#[test]
fn every_warning_has_fields_and_a_text() {
    let all = clocks_and_events().into_iter().chain(of_results());
    check::<Warning>(&all.collect::<Vec<_>>());
}

fn clocks_and_events() -> Vec<(Value, &'static str)> {
    vec![
        (
            json!({"camera": "camera1", "kind": "presses_far_from_marks", "presses": 3, "limit_s": 60.0}),
            "camera 1: 3 presses are not timed: they are more than 60 s from the nearest trigger mark seen",
        ),
        (
            json!({"camera": "camera2", "kind": "presses_far_from_ties", "instants": 3, "of": 20, "limit_s": 60.0}),
            "camera 2: 3 of 20 contacts and releases are more than 60 s from the nearest train seen or the nearest \
             exchange with the box; their presses are not timed",
        ),
        (
            json!({"leg": 2, "camera": "camera2", "kind": "nominal_start"}),
            "leg 2, camera 2: expected trains or marks to fit its clock, found too few: it is aligned to the other legs \
             by its nominal start alone",
        ),
        (
            json!({"camera": "camera1", "kind": "marks_scatter", "rms_us": 123.4}),
            "camera 1: trigger marks fit the clock only to 123 µs rms (expected a few µs); check the trigger line",
        ),
        (
            json!({"camera": "camera1", "kind": "marks_rejected", "rejected": 2, "of": 20}),
            "camera 1: 2 of 20 trigger marks do not fit the clock and were rejected",
        ),
        (
            json!({"camera": "camera1", "kind": "marks_unseen", "unseen": 2, "of": 20}),
            "camera 1: 2 of 20 trigger marks were not seen",
        ),
        (
            json!({"camera": "camera1", "kind": "stray_edges", "edges": 5, "channel": 0}),
            "camera 1: 5 edges on trigger channel 0 do not belong to a complete mark",
        ),
        (
            json!({"camera": "camera1", "kind": "no_marks_clock", "sent": 2, "edges": 9, "why": {"kind": "line", "line": {"kind": "few_pairs", "found": 2}}}),
            "camera 1: no clock from trigger marks (2 sent, 9 edges seen): expected at least 3 times seen on both clocks, found 2; using event rates instead",
        ),
        (
            json!({"camera": "camera1", "kind": "no_rates_clock", "why": {"kind": "no_bursts"}}),
            "camera 1: no clock alignment: expected bursts in the event rates, found none",
        ),
        (
            json!({"camera": "camera1", "kind": "drift_unknown", "drift_ppm": 12.3, "standard_error_ppm": 99.9}),
            "camera 1: the session is too short to find the clock drift from event rates (12 ± 100 ppm): assuming 0",
        ),
        (
            json!({"camera": "camera1", "kind": "presses_scatter", "rms_ms": 45.2}),
            "camera 1: presses found in the event rates scatter by 45 ms rms about the clock fit",
        ),
        (
            json!({"kind": "remount_unusual", "chance": 0.02}),
            "the presses fit the calibration of the earlier session badly: 2.0 % of remounts disagree as much; calibrate in \
             full if the numbers matter",
        ),
        (
            json!({"kind": "remount_outliers", "presses": [3, 7], "of": 5}),
            "2 of 5 presses that correct the earlier calibration are outliers and count less: press 3, press 7",
        ),
        (
            json!({"camera": "camera1", "kind": "windows_overlap"}),
            "camera 1: press windows overlap: events in the overlap count in both presses",
        ),
        (
            json!({"camera": "camera1", "kind": "events_out_of_order", "events": 5, "limit_ms": 10}),
            "camera 1: 5 events are more than 10 ms out of order; presses may miss them",
        ),
        (
            json!({"camera": "camera1", "kind": "events_days_away", "events": 5}),
            "camera 1: 5 events have timestamps days away from all others and are not in the event rates",
        ),
        (
            json!({"camera": "camera1", "kind": "readout", "fault": "events_twice", "repeated": 500, "events": 1000}),
            "camera 1: 500 of 1000 events equal the one before them (pixel, time, polarity): the recording holds events twice, \
             and event rates are too high; convert the camera's file again",
        ),
        (
            json!({"camera": "camera1", "kind": "events_off_sensor", "events": 5, "of": 1000}),
            "camera 1: 5 of 1000 events are outside the sensor and ignored: the recording may be damaged, or from \
             another sensor",
        ),
        (
            json!({"camera": "camera2", "kind": "dense_background", "neighbours": 8.26, "eps_px": 10.0,
                "min_samples": 10, "advised_min_samples": 21.0}),
            "camera 2: noise joins the clusters; `--set analysis.min_samples=21` prevents this: in a press window the background \
             alone puts 8.3 events within eps (10 px) of an event, and 10 make a cluster",
        ),
        (
            json!({"camera": "camera1", "kind": "hot_pixels", "pixels": 20, "of": 112_640, "highest_per_s": 1003.4, "idle_share": 0.91}),
            "camera 1: 20 hot pixels are left out (0.02 % of the crop): they fire without presses, up to 1003 times a second, \
             91 % of the idle events; look for reflections and flickering lamps",
        ),
        (
            json!({"camera": "camera2", "kind": "hot_pixels", "pixels": 1, "of": 112_640, "highest_per_s": 38.0, "idle_share": 0.02}),
            "camera 2: 1 hot pixels are left out: they fire without presses, up to 38 times a second, 2 % of the idle events; look \
             for reflections and flickering lamps",
        ),
        (
            json!({"kind": "nothing_counts", "planned": 20, "missed": 12, "invalid": 3, "excluded": 5}),
            "expected at least one of 20 presses to count, found none: 12 missed, 3 invalid, 5 excluded",
        ),
        (
            json!({"kind": "unsuitable_settings", "fault": "clock_wrong"}),
            "the analysis settings do not suit this recording: with them it looks faulty (clock wrong), with the usual windows and \
             clusters it does not",
        ),
        (
            json!({"kind": "unused_setting", "key": "analysis.forget", "because": "analysis.estimator=dbscan"}),
            "analysis.forget changes no estimate: analysis.estimator=dbscan does not use it",
        ),
        (
            json!({"kind": "no_scored_press"}),
            "no scored press was attempted, so there are no metrics",
        ),
        (
            json!({"kind": "not_sealed"}),
            "not sealed: the run was cut off, or the seal removed, and not every changed row would show; `skinrig resume` \
             continues it",
        ),
        (
            json!({"kind": "sequential_looks", "looks": 2, "declared": 5}),
            "the looks decided when to end: 95 % intervals do not allow for that, those of the looks do (2 of 5 taken)",
        ),
        (
            json!({"kind": "undecided_looks", "looks": 4, "declared": 5, "question": {"narrower_than": 0.3}}),
            "no look found an interval narrower than 0.3 mm (4 of 5 taken): the question of this campaign is open",
        ),
        (
            json!({"kind": "stopped_when_felt", "presses": 162, "depth_mm": 0.45}),
            "162 scored presses stopped when they were felt, at 0.45 mm in the median: the planned depth was not reached",
        ),
        (
            json!({"kind": "scheduled"}),
            "press times and positions come from a schedule, not from a measurement",
        ),
        (
            json!({"kind": "study_presses_left_out", "left_out": 4, "chosen": 100, "used": 96}),
            "4 of 100 presses chosen for the studies did not fit into memory; the studies use only the first 96",
        ),
    ]
}

fn of_results() -> Vec<(Value, &'static str)> {
    let estimate =
        |value: f64| json!({"value": value, "low": value - 0.5, "high": value + 0.5, "n": 100});
    let example = json!({"few_cluster_events": {"camera": "camera2", "found": 5, "least": 10}});
    vec![
        (
            json!({"kind": "exclusions_matter", "excluded": 10, "located": 100,
                "most_common": {"presses": 8, "example": example},
                "rmse_of_all_mm": 5.43, "rmse_mm": 0.17, "beyond_interval": true}),
            "the RMSE depends on the exclusions: excluding 10 of 100 located presses (most often, 8 times: too few \
             cluster events (camera 2)) changes it from 5.43 mm to 0.17 mm, more than its 95 % interval",
        ),
        (
            json!({"kind": "exclusions_matter", "excluded": 100, "located": 100, "most_common": null,
                "rmse_of_all_mm": 5.43, "rmse_mm": null, "beyond_interval": false}),
            "the RMSE depends on the exclusions: excluding 100 of 100 located presses changes it from 5.43 mm to nothing",
        ),
        (
            json!({"kind": "no_calibration_press"}),
            "no usable calibration press: using the nominal camera geometry",
        ),
        (
            json!({"kind": "few_locations_for_model", "wanted": "full_scale", "used": "positions"}),
            "the calibration presses cover too few locations for the calibration `full_scale`: using `positions`",
        ),
        (
            json!({"kind": "few_locations_to_compare", "locations": 4, "used": "positions"}),
            "too few calibration locations (4) to compare calibrations by cross-validation: using `positions`, the \
             largest that they determine",
        ),
        (
            json!({"kind": "implausible_model", "wanted": "full", "used": "positions_skews"}),
            "the fit of the calibration `full` found no plausible geometry: using `positions_skews`, the next smaller \
             one that fits",
        ),
        (
            json!({"kind": "few_locations_for_any", "locations": 2}),
            "2 calibration locations are too few for any calibration: using the nominal camera geometry",
        ),
        (
            json!({"kind": "undetermined"}),
            "the calibration presses determine no calibration: using the nominal camera geometry",
        ),
        (
            json!({"kind": "no_plausible_geometry"}),
            "no calibration found a plausible geometry: using the nominal camera geometry",
        ),
        (
            json!({"kind": "worse_model", "used": "positions", "better": "full", "rmse_mm": 2.0,
                "better_rmse_mm": 1.0, "bound_mm": 5.25, "difference_mm": 1.0, "standard_error_mm": 0.1}),
            "the calibration `positions` is significantly worse than `full`: 2.00 mm against 1.00 mm at held-out \
             locations (errors bounded at 5.2 mm), a paired difference of 1.00 ± 0.10 mm (standard error)",
        ),
        (
            json!({"kind": "open_parameters", "determined": 6, "parameters": 8, "model": "full",
                "open": ["W1", "W2"]}),
            "the calibration presses determine 6 of the 8 parameters of the calibration `full`: the values of W1, W2 are \
             one of many equally good solutions; calibrate at more locations, spread over the skin",
        ),
        (
            json!({"kind": "no_improvement", "before_mm": 1.0, "after_mm": 1.5}),
            "the calibration does not lower the error of its own presses (1.00 mm before, 1.50 mm after); check for \
             outliers",
        ),
        (
            json!({"kind": "no_better_than_mean", "rmse_mm": 30.0, "spread_mm": 25.0}),
            "the calibrated geometry locates its own presses no better than their mean position would (30.00 mm against \
             25.00 mm); check for swapped cameras, a wrong unit or a shifted order of presses",
        ),
        (
            json!({"kind": "without_reaction", "wanted": "stop", "reacted": 11, "presses": 27}),
            "the protocol asks presses to stop when they are felt: 11 of 27 valid scored presses did, and the numbers include all of \
             them; the run's notes (`skinrig show`) may say why",
        ),
        (
            json!({"kind": "locator_unfit", "wanted": "direct",
                "why": {"kind": "line",
                    "text": "the calibration locations lie on a line or a curve; spread them over the skin"}}),
            "the locator `direct` cannot learn: the calibration locations lie on a line or a curve; spread them over the \
             skin; using `geometry`",
        ),
        (
            json!({"camera": "camera2", "kind": "event_storms", "presses": [4, 20], "times": 21.4}),
            "camera 2: event storm in press 4, press 20: up to 21 times the events of other presses at that depth, which hide the \
             touch; find what flickers, leave the press out with `skinrig select`, and set `suspend.event_rate` in the protocol",
        ),
        (
            json!({"kind": "calibration_disagrees", "scored_rmse_mm": estimate(3.0), "held_out_rmse_mm": estimate(1.0)}),
            "the RMSE of the scored presses, 3.00 mm [2.50, 3.50], and that of held-out calibration locations, 1.00 mm \
             [0.50, 1.50], disagree: a few presses dominate one of them, or the rig changed in between",
        ),
        (
            json!({"kind": "fewer_events_better", "factor": 4, "rmse_mm": estimate(1.0), "rmse_of_all_mm": estimate(3.0)}),
            "a random 1/4 of the events locates better than all of them: RMSE 1.00 mm [0.50, 1.50] against 3.00 mm \
             [2.50, 3.50]; the clustering settings do not suit these event rates",
        ),
        (
            json!({"kind": "repeated_positions", "first": 50, "last": 58}),
            "press 50 to press 58 have the same recorded position to the last digit, unlike the others: if missing rows of a table were \
             filled in, their errors say nothing about the skin; leave these presses out with `skinrig select`",
        ),
        (
            json!({"kind": "few_decide", "presses": [12, 40], "limit_mm": 8.6, "rmse_mm": 5.24, "without_mm": 2.21}),
            "few presses decide the RMSE: it is 5.24 mm, 2.21 mm without press 12, press 40, off by more than 9 mm; look \
             whether their rows of the press list are right, and at their events",
        ),
        (
            json!({"camera": "camera1", "kind": "readout", "fault": "events_again", "share": 0.24, "from_s": 112.4}),
            "camera 1: 24 % of the events are those of an earlier time once more, pixel by pixel and to the microsecond, first 112 s \
             into the camera's time: no press repeats another one so, and the scatter between repetitions is too small; find out whether \
             driver, buffer or converter sent data twice, and record again",
        ),
        (
            json!({"camera": "camera2", "kind": "readout", "fault": "coarse_stamps", "step_ms": 20.0}),
            "camera 2: timestamps come in steps of 20 ms, many events to each: no latency, onset or depth is known better; find out which \
             driver or converter rounded them",
        ),
        (
            json!({"camera": "camera2", "kind": "readout", "fault": "crowded_column", "column": 400, "times": 93.4}),
            "camera 2: column 400 has 93 times the events of those beside it: a driver or converter may have written other columns as this \
             one (expected 0 to 639), or its readout is broken",
        ),
        (
            json!({"camera": "camera2", "kind": "readout", "fault": "crowded_row", "row": 300, "times": 93.4}),
            "camera 2: row 300 has 93 times the events of those beside it: a driver or converter may have written other rows as this one \
             (expected 0 to 479), or its readout is broken",
        ),
        (
            json!({"camera": "camera2", "kind": "readout", "fault": "ceiling", "per_ms": 8.0, "presses": 18, "first": 64}),
            "camera 2: the event rate stops at 8 events per ms in 18 presses, first press 64: readout or cable carry no more, and events were \
             lost; lower the rate by a region of interest or the biases, and record again",
        ),
        (
            json!({"camera": "camera1", "kind": "camera_changed", "what": "events", "from": 64, "before": 812.4, "after": 120.2, "places": 25}),
            "camera 1: a press gives 120 events instead of 812 from about press 64 on (median of 25 places): find out what changed there, \
             such as light, lens, bias, clock or skin, and record these presses again",
        ),
        (
            json!({"camera": "camera1", "kind": "camera_changed", "what": "on_share", "from": 64, "before": 0.66, "after": 0.34, "places": 25}),
            "camera 1: 34 % of the events of a press are ON instead of 66 % from about press 64 on (median of 25 places): find out what changed there, \
             such as light, lens, bias, clock or skin, and record these presses again",
        ),
        (
            json!({"camera": "camera1", "kind": "camera_changed", "what": "delay_ms", "from": 64, "before": 61.0, "after": 112.6, "places": 25}),
            "camera 1: the middle event of a press comes 113 instead of 61 ms after the contact from about press 64 on (median of 25 \
             places): find out what changed there, such as light, lens, bias, clock or skin, and record these presses again",
        ),
        (
            json!({"camera": "camera1", "kind": "quiet_part", "columns": [320, 639], "rows": null, "polarity": null,
                   "presses": [64, 127], "share": 0.0}),
            "camera 1: events of columns 320 to 639 fall to 0 % of their usual number between presses, from press 64 to press 127: find \
             out what changed there, such as light, lens, cable or bias, and record these presses again",
        ),
        (
            json!({"camera": "camera2", "kind": "quiet_part", "columns": null, "rows": null, "polarity": "on",
                   "presses": [64, 127], "share": 0.04}),
            "camera 2: ON events of the whole picture fall to 4 % of their usual number between presses, from press 64 to press 127: find \
             out what changed there, such as light, lens, cable or bias, and record these presses again",
        ),
        (
            json!({"camera": "camera1", "kind": "quiet_part", "columns": null, "rows": null, "polarity": "off",
                   "presses": null, "share": 0.0}),
            "camera 1: OFF events of the whole picture are missing throughout: look at the biases, and at what converted the recording",
        ),
        (
            json!({"camera": "camera1", "kind": "quiet_part", "columns": null, "rows": [262, 360], "polarity": null,
                   "presses": null, "share": 0.0}),
            "camera 1: events of rows 262 to 360 are missing throughout, although those beside them are there: a mask, a region of \
             interest or dead pixels hide a part of the skin, or events were lost",
        ),
        (
            json!({"kind": "left_out_unknown", "rmse_mm": estimate(26.0), "extent_mm": 0.9}),
            "the RMSE where no press calibrated, 26.00 mm [25.50, 26.50], is unknown: its interval is wider than the pressed area \
             (1 mm); rays that are nearly parallel there send some estimates far off",
        ),
    ]
}

#[test]
fn every_reason_for_the_geometry_has_fields_and_a_text() {
    let few = json!({"kind": "locations", "needed": 6, "found": 5,
        "text": "it needs 6 calibration locations, found 5"});
    check::<LocatorFallback>(&[
        (
            json!({"kind": "cannot_learn", "wanted": "field", "why": few}),
            "the locator `field` cannot learn: it needs 6 calibration locations, found 5; using `geometry`",
        ),
        (
            json!({"kind": "nominal_geometry"}),
            "the nominal geometry is used as it is (`calibration: none`)",
        ),
        (
            json!({"kind": "few_locations", "locations": 3}),
            "3 calibration locations are too few to compare locators by cross-validation",
        ),
        (
            json!({"kind": "none_compared", "why": few}),
            "no field could be compared: it needs 6 calibration locations, found 5",
        ),
        (
            json!({"kind": "none_compared", "why": null}),
            "no field could be compared: a fit without some of the locations failed",
        ),
        (
            json!({"kind": "none_better"}),
            "no field is better at held-out locations by more than noise explains",
        ),
    ]);
    check::<FitError>(&[
        (
            json!({"kind": "locations", "needed": 6, "found": 5}),
            "it needs 6 calibration locations, found 5",
        ),
        (
            json!({"kind": "line"}),
            "the calibration locations lie on a line or a curve; spread them over the skin",
        ),
        (
            json!({"kind": "degenerate"}),
            "the residuals of the calibration presses determine no field",
        ),
    ]);
}
