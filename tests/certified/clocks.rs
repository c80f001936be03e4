//! Lines through simultaneous times, times mapped by them, and marks on a trigger line.

use skinrig_analysis::clock::{LineError, MarksError, Pair, fit_line, fit_marks};
use skinrig_analysis::result::{ClockFit, ClockMethod};
use skinrig_model::{HostTime, Mark, MarkKind, PressId, PulseTrain, SentMark, TriggerEdge};

use crate::problem::{Problem, Solution};

pub(crate) fn solve(problem: &Problem) -> Solution {
    if problem.inputs.get("marks_us").is_some() {
        return marks(problem);
    }
    if problem.inputs.get("offset_us").is_some() {
        let map = ClockFit {
            method: ClockMethod::TriggerMarks,
            offset_us: problem.number("offset_us"),
            drift_ppm: problem.number("drift_ppm"),
            drift_se_ppm: 0.0,
            residual_rms_us: 0.0,
            residual_max_us: 0.0,
            n: 3,
            rejected: 0,
        };
        let host_us = problem.number("host_us");
        return Solution::Values(vec![
            ("camera", map.camera_us(host_us)),
            ("host", map.host_us_of_camera(host_us)),
        ]);
    }
    let pairs: Vec<Pair> = problem
        .rows("pairs_us")
        .iter()
        .map(|row| Pair {
            host_us: row[0],
            camera_us: row[1],
        })
        .collect();
    let line = match fit_line(&pairs, problem.number("floor_us")) {
        Ok(line) => line,
        Err(why) => return refused(&MarksError::Line { line: why }),
    };
    assert_eq!(line.n(), pairs.len(), "{}: outliers", problem.name);
    Solution::Values(vec![
        ("offset", line.offset_us),
        ("drift", line.drift),
        ("drift_se", line.drift_se),
        ("rms", line.rms_us),
        ("largest", line.max_us),
    ])
}

/// The reason in the words of the data, and the type that says so.
fn refused(why: &MarksError) -> Solution {
    let (outcome, name) = match why {
        MarksError::Line {
            line: LineError::FewPairs { .. },
        } => ("too few", "LineError::FewPairs"),
        MarksError::Line {
            line: LineError::NoSpread,
        } => ("no spread", "LineError::NoSpread"),
        MarksError::BrokenTimeBase { .. } => ("broken", "MarksError::BrokenTimeBase"),
        MarksError::Drift { .. } => ("no clock", "MarksError::Drift"),
        MarksError::NoChannel | MarksError::NoneSeen => ("no marks", "MarksError::NoneSeen"),
    };
    Solution::Refused(outcome.to_owned(), name, Vec::new())
}

/// Marks sent and seen as pulse trains.
fn marks(problem: &Problem) -> Solution {
    let (mut sent, mut edges) = (Vec::new(), Vec::new());
    let rows = problem.inputs["marks_us"].as_array().unwrap();
    for (i, row) in (0u32..).zip(rows) {
        let mark = Mark {
            kind: if i.is_multiple_of(2) {
                MarkKind::Contact
            } else {
                MarkKind::Release
            },
            press: PressId::from_index(i / 2),
        };
        sent.push(SentMark {
            mark,
            t: HostTime(row[0].as_i64().unwrap() * 1000),
            uncertainty_ns: 500,
        });
        let start_us = row[1].as_u64().unwrap();
        let train = PulseTrain::new(mark).unwrap();
        edges.extend(train.edges().map(|(after, rising)| TriggerEdge {
            t_us: start_us + after,
            channel: 0,
            rising,
        }));
    }
    let found = match fit_marks(&edges, 0, &sent) {
        Ok(found) => found,
        Err(why) => return refused(&why),
    };
    let fit = found.fit;
    assert_eq!(fit.n as usize, sent.len(), "{}: outliers", problem.name);
    Solution::Values(vec![
        ("offset", fit.offset_us),
        ("drift", fit.drift_ppm * 1e-6),
        ("rms", fit.residual_rms_us),
        ("largest", fit.residual_max_us),
    ])
}
