//! Every evidence of an audit finding: its JSON, and its text.

use serde_json::{Value, json};

use super::Evidence;
use super::other_reading::{FrameChange, OtherPlan, OtherReading};
use super::tests::check;

#[test]
fn every_evidence_has_fields_and_a_text_with_expected_and_found() {
    let rows: Vec<(Value, &str)> = of_journal_and_streams()
        .into_iter()
        .chain(of_presses())
        .chain(of_positions())
        .collect();
    for (_, text) in &rows {
        assert!(
            text.starts_with("expected") && text.contains("found"),
            "{text}"
        );
    }
    check::<Evidence>(&rows);
}

fn of_journal_and_streams() -> Vec<(Value, &'static str)> {
    vec![
        (
            json!({"kind": "journal_contradictory", "presses": 20, "disordered": 1, "negative": 2, "overlapping": 3,
                "doubled": 4}),
            "expected each press once, its moments in order and after the last press's, found 1 of 20 presses with moments \
             out of order, 2 before the session, 3 overlapping another, 4 listed twice",
        ),
        (
            json!({"kind": "no_events_of_either"}),
            "expected events of two cameras, found none of either (the kinematic simulation makes none)",
        ),
        (
            json!({"kind": "no_events", "camera": "camera1"}),
            "expected events of camera 1, found none in the whole recording",
        ),
        (
            json!({"kind": "no_events_in_crop", "camera": "camera1", "first_row": 3, "last_row": 9, "elsewhere": 70}),
            "expected events of camera 1 in rows 3 to 9, found none there and 70 elsewhere",
        ),
        (
            json!({"kind": "no_truth", "presses": 20, "without_position": 7, "without_times": 8}),
            "expected a measured time and position of each press done, found 7 of 20 without a position and 8 of 20 without \
             times",
        ),
        (
            json!({"kind": "no_planned_press"}),
            "expected presses other than sync presses in the plan, found none",
        ),
        (
            json!({"kind": "presses_missed", "planned": 20, "missed": 12}),
            "expected 20 presses, found 12 never attempted",
        ),
        (
            json!({"kind": "marks_lost", "sent": 20, "channel": 0, "seen": [
                {"camera": "camera1", "edges": 3, "usable_marks": 0},
                {"camera": "camera2", "edges": 40, "usable_marks": 2}]}),
            "expected the 20 marks sent on trigger channel 0, found 3 edges and 0 usable marks (camera 1) and 40 edges and 2 \
             usable marks (camera 2)",
        ),
        (
            json!({"kind": "silence", "presses": 5, "silences": [
                {"from_s": null, "to_s": 1.25}, {"from_s": 3.0, "to_s": 4.0}, {"from_s": 9.5, "to_s": null}]}),
            "expected events at all times, noise as before, found none before 1.2 s, from 3.0 s to 4.0 s, from 9.5 s on: 5 \
             presses are not recorded",
        ),
        (
            json!({"kind": "events_out_of_order", "camera": "camera1", "late": 300, "events": 700, "limit_ms": 10}),
            "expected the events of camera 1 in the order of their times, found 300 of 700 more than 10 ms late",
        ),
        (
            json!({"kind": "no_alignment", "presses": 20, "camera": "camera2"}),
            "expected 20 presses to show in the events of camera 2, found no alignment of the clocks in which they do",
        ),
        (
            json!({"kind": "clock_drift", "camera": "camera2", "limit_ppm": 100.0, "drift_ppm": -312.4,
                "error_ppm": 0.2, "n": 2500}),
            "expected the clock of camera 2 within 100 ppm of the host's, found -312.4 ± 0.2 ppm (n 2500)",
        ),
    ]
}

fn of_presses() -> Vec<(Value, &'static str)> {
    let responses = json!([{"sigmas": 0.12, "presses": 20}, {"sigmas": -0.31, "presses": 19}]);
    vec![
        (
            json!({"kind": "no_response_of_either", "responses": responses, "burst_elsewhere": true,
                "noise_per_s": null, "force": null}),
            "expected events to burst in presses, found 0.1 standard errors above idle in the median of 20 (camera 1) and \
             -0.3 of 19 (camera 2); both cameras burst at other times",
        ),
        (
            json!({"kind": "no_response_of_either", "responses": responses, "burst_elsewhere": false,
                "noise_per_s": [1000.0, 2000.0], "force": {"median_n": 0.02, "presses": 20}}),
            "expected events to burst in presses, found 0.1 standard errors above idle in the median of 20 (camera 1) and \
             -0.3 of 19 (camera 2); both cameras send noise (1000 and 2000 events/s); largest force of a press 0.02 N in the \
             median (n 20)",
        ),
        (
            json!({"kind": "no_response", "camera": "camera2", "response": {"sigmas": 0.12, "presses": 20},
                "rates_per_s": [900.0, 1000.0]}),
            "expected events to burst in presses, found 0.1 standard errors above idle in the median of 20 (camera 2); median \
             rate 900 events/s in presses, 1000 before them",
        ),
        (
            json!({"kind": "no_bursts_of_either", "first": 4, "last": 9, "noise_per_s": [1000.0, 2000.0]}),
            "expected a burst of events in each press, found none in either camera from press 4 to press 9; both cameras send \
             noise (1000 and 2000 events/s)",
        ),
        (
            json!({"kind": "no_bursts", "camera": "camera1", "first": 4, "last": 9}),
            "expected a burst of events in each press, found none of camera 1 from press 4 to press 9",
        ),
        (
            json!({"kind": "shifted_bursts", "camera": "camera1", "presses": 20, "here": 3, "there": 19,
                "shift_s": 2.0, "log_odds": 40.0, "bursts": 22}),
            "expected the bursts of camera 1 at the presses, found 3 of 20 presses with one, and 19 of them +2.00 s later: \
             odds of e^40 (22 bursts)",
        ),
        (
            json!({"kind": "sync_times", "planned_s": [-8.0, -6.0], "found_s": []}),
            "expected sync presses at -8.0, -6.0 s from the first press of the path, found presses at no s",
        ),
        (
            json!({"kind": "unlisted", "listed": 20, "more": 5, "from_s": 40.0, "to_s": 48.0}),
            "expected the 20 presses of the list, found 5 more in both cameras, from 40 s to 48 s of the schedule",
        ),
        (
            json!({"kind": "unequal_times", "wrong": 9, "presses": 20, "factor": 2.0}),
            "expected indentations of equal depth to take equal time, found 9 of 20 off by more than a factor of 2",
        ),
        (
            json!({"kind": "journal_invalid", "wrong": 9, "presses": 20, "first": {"leg_ended": {"leg": 2}}}),
            "expected presses as planned, found 9 of 20 that the journal calls invalid, the first one: cut off: leg 2 of the \
             session ended without its outcome",
        ),
        (
            json!({"kind": "early_events", "heights": [
                {"n": 20, "median_mm": 0.5, "low_mm": 0.4, "high_mm": 0.6, "before_ms": 25.0},
                {"n": 19, "median_mm": 0.25, "low_mm": 0.2, "high_mm": 0.3, "before_ms": 12.0}]}),
            "expected events to begin when the tip reaches the surface, found them begin above it in the median: 0.50 mm (95 \
             %: 0.40 to 0.60), 25 ms before the contact, n 20 (camera 1), 0.25 mm (95 %: 0.20 to 0.30), 12 ms before the \
             contact, n 19 (camera 2). Presses were that much deeper than is stated: the robot reports its tip higher than it \
             is, or the surface lies higher than z = 0 of the skin's frame",
        ),
        (
            json!({"kind": "off_depth", "limit_mm": 0.25, "wrong": 9, "presses": 20, "off_mm": -0.5}),
            "expected the commanded depths within 0.25 mm, found 9 of 20 off, -0.50 mm in the median",
        ),
    ]
}

fn of_positions() -> Vec<(Value, &'static str)> {
    vec![
        (
            json!({"kind": "extent", "skin_mm": 60.0, "extent_mm": 0.05, "beside": 0, "presses": 20}),
            "expected measured positions on a skin of 60 mm, found them 0.050 mm wide with 0 of 20 beside it",
        ),
        (
            json!({"kind": "off_plan", "limit_mm": 1.0, "off_mm": 8.5, "presses": 20, "fits": {"off_mm": 0.01,
                "plan": {"kind": "shifted", "rows": -1}}}),
            "expected measured positions within 1 mm of the planned ones, found them 8.50 mm off in the median, and 0.010 mm \
             of the planned ones -1 rows on (n 20)",
        ),
        (
            json!({"kind": "off_plan", "limit_mm": 1.0, "off_mm": 8.5, "presses": 20, "fits": null}),
            "expected measured positions within 1 mm of the planned ones, found them 8.50 mm off in the median (n 20)",
        ),
        (
            json!({"kind": "same_columns", "within_px": 0.5, "same": 20, "presses": 20}),
            "expected different columns in the two cameras, found the same column, within 0.5 px, in 20 of 20 presses",
        ),
        (
            json!({"kind": "other_reading", "off_deg": [14.0, null], "other_off_deg": [1.0, null],
                "reading": {"kind": "cameras_exchanged"}, "log_odds": 80.0, "places": 25}),
            "expected columns on the viewing angles of the presses, found them 14.0 and - degrees (cameras 1 and 2) off as \
             the session is and 1.0 and - degrees (cameras 1 and 2) off with cameras exchanged: odds of e^80 (n 25 places)",
        ),
        (
            json!({"kind": "shifted_rest", "from": 7, "rows": 2, "log_odds": 30.0, "presses": 18}),
            "expected columns on the viewing angles of their own presses, found those of 18 presses from press 7 on at the \
             position +2 rows later: odds of e^30",
        ),
        (
            json!({"kind": "rearranged_rows", "from": 6, "to": 15, "rows": 10, "log_odds": 80.0}),
            "expected columns on the viewing angles of their own presses, found 10 presses between press 6 and press 15 at \
             the positions of other rows of the list: odds of e^80",
        ),
        (
            json!({"kind": "random_order", "off_deg": [14.0, 13.0], "places": 25}),
            "expected columns on the viewing angles of the presses, found them 14.0 and 13.0 degrees (cameras 1 and 2) off, \
             no better than in random order, while the located presses cover the area of the list (n 25 locations)",
        ),
        (
            json!({"kind": "unrelated", "camera": "camera1", "off_deg": 14.0, "guess_deg": 13.5, "places": 25}),
            "expected columns on the viewing angles of the presses, found them 14.0 degrees off where a blind guess gives \
             13.5 (camera 1, n 25 locations), and no other reading of the session explains them",
        ),
        (
            json!({"kind": "camera_far", "camera": "camera1", "limit_mm": 20.0, "limit_deg": 10.0,
                "off_mm": [30.0, -5.0], "skew_deg": 2.0}),
            "expected camera 1 within 20 mm and 10 degrees of its position in the rig description, found it about (+30, -5) \
             mm and +2 degrees off",
        ),
        (
            json!({"kind": "fixed_column", "camera": "camera1", "within_px": 0.2, "column_px": 320.0,
                "angle_deg": 12.0, "both": true}),
            "expected columns that move with the presses, found them within 0.2 px of column 320 in the median while the \
             viewing angle scatters by 12 degrees (camera 1; the other camera likewise)",
        ),
        (
            json!({"kind": "fixed_stretch", "camera": "camera1", "first": 11, "last": 30, "column_px": 320.0,
                "angle_deg": 12.0, "presses": 20}),
            "expected columns that move with the presses, found them at column 320 from press 11 to press 30 while the \
             viewing angle scatters by 12 degrees (camera 1, n 20 presses)",
        ),
        (
            json!({"kind": "clock_step", "camera": "camera1", "both": true, "last": 10, "first": 11, "at_s": 432.1,
                "step_s": -0.6, "explained": 118, "one_offset": 71, "presses": 125}),
            "expected the clock of camera 1 to run evenly, found it step by about -0.6 s between press 10 and press 11, at \
             432 s: with the step 118 of 125 presses have a burst, without it 71; the other camera likewise",
        ),
        (
            json!({"kind": "marks_step", "camera": "camera2", "step_ms": 450.0, "from_s": 10.0, "to_s": 11.5, "marks": 40}),
            "expected the clock of camera 2 to run evenly, found it step by +450.0 ms between the trigger marks at \
             10.0 s and 11.5 s (n 40 marks)",
        ),
        (
            json!({"kind": "repetition_moved", "repetition": 2, "moved_px": 3.0, "error_px": 0.2, "zoom_percent": null,
                "camera": "camera1", "pairs": 25}),
            "expected centroids at the same columns in each repetition, found repetition 2 moved by 3.0 ± 0.2 px (camera 1, n \
             25)",
        ),
        (
            json!({"kind": "repetition_moved", "repetition": 2, "moved_px": 12.0, "error_px": 0.8, "zoom_percent": -6.0,
                "camera": "camera2", "pairs": 30}),
            "expected centroids at the same columns in each repetition, found repetition 2 moved by 12.0 ± 0.8 px at an edge, by a zoom \
             of -6.0 % (camera 2, n 30)",
        ),
        (
            json!({"kind": "repetition_elsewhere", "repetition": 2, "off_px": 60.0, "between_px": 80.0,
                "camera": "camera1", "pairs": 25}),
            "expected repetitions of a location to agree, found repetition 2 off by 60.0 px in the median, where locations \
             differ by 80.0 px from their middle (camera 1, n 25)",
        ),
        (
            json!({"kind": "same_position", "off_px": 60.0, "all_px": 80.0, "camera": "camera1", "presses": 25}),
            "expected presses at the same position to agree, found their columns 60.0 px from their middle (median), where those of \
             all presses are 80.0 px from theirs (camera 1, n 25)",
        ),
        (
            json!({"kind": "no_better_than_guess", "rmse_mm": 20.0, "guess_mm": 18.5, "presses": 25}),
            "expected an RMSE of at most 70 % of a constant guess, found 20.0 mm where guessing the mean position gives 18.5 mm \
             (n 25)",
        ),
    ]
}

#[test]
fn every_other_reading_has_fields_and_a_text() {
    let frames = [
        (
            json!({"kind": "turned", "turn": "exchanged_mirrored", "about": "centre"}),
            "x and y exchanged and both mirrored about the skin's centre",
        ),
        (
            json!({"kind": "turned", "turn": "quarter_back", "about": "zero"}),
            "x and y turned by -90 degrees about 0",
        ),
        (
            json!({"kind": "scaled", "factor": 25.4}),
            "all multiplied by 25.400",
        ),
        (
            json!({"kind": "stretched", "factors": [2.0, 1.0], "about": "table"}),
            "x multiplied by 2.00 and y by 1.00 about the middle of the table",
        ),
        (
            json!({"kind": "other_origin", "origin": "lower_left", "is_added": false}),
            "the skin's lower left corner subtracted",
        ),
        (
            json!({"kind": "displaced", "by_mm": [1.25, -3.0]}),
            "(+1.2, -3.0) mm added",
        ),
    ];
    for (row, text) in frames {
        let frame: FrameChange = serde_json::from_value(row.clone()).unwrap();
        assert_eq!(frame.to_string(), text);
        assert_eq!(serde_json::to_value(frame).unwrap(), row);
        assert_eq!(
            OtherPlan::Frame { frame }.to_string(),
            format!("with {text}")
        );
        let reading = OtherReading::Frame { frame };
        assert_eq!(reading.to_string(), format!("the positions with {text}"));
    }
    let readings = [
        (json!({"kind": "as_recorded"}), "as recorded"),
        (
            json!({"kind": "both_streams", "camera": "camera2"}),
            "both streams of camera 2",
        ),
        (
            json!({"kind": "picture_mirrored", "camera": "camera1"}),
            "the picture of camera 1 mirrored",
        ),
        (
            json!({"kind": "pictures_mirrored"}),
            "the pictures of both cameras mirrored",
        ),
        (
            json!({"kind": "displaced", "by_mm": [3.4, -12.0]}),
            "the positions with (+3, -12) mm added",
        ),
        (
            json!({"kind": "as_planned"}),
            "the planned positions instead of the measured ones",
        ),
        (
            json!({"kind": "list_shifted", "rows": -2}),
            "the press list shifted by -2 rows",
        ),
        (
            json!({"kind": "streams_shifted", "presses": [1, -1]}),
            "the streams shifted by +1 and -1 presses (cameras 1 and 2)",
        ),
        (json!({"kind": "list_reversed"}), "the press list reversed"),
        (
            json!({"kind": "lines_reversed"}),
            "every second line of the press list reversed",
        ),
    ];
    for (row, text) in readings {
        let reading: OtherReading = serde_json::from_value(row.clone()).unwrap();
        assert_eq!(reading.to_string(), text);
        assert_eq!(serde_json::to_value(reading).unwrap(), row);
    }
}
