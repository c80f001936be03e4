//! Lists of presses of which a part is wrong.

use super::*;

/// A row too many and later one too few: the ends of the list are right.
#[test]
fn a_part_of_the_press_list_is_shifted() {
    let wishes = SessionOptions {
        places: 25,
        ..SessionOptions::default()
    };
    for by in [1, -1] {
        names(Fault::IndexShifted, |seed| {
            edit(seed, wishes, |input| {
                reorder(input, 6..20, &|i: usize| i.wrapping_add_signed(by))
            })
        });
    }
}

/// Camera 2 loses one period, without a gap. The errors of this skin hide a step of the path from its residuals, not from neighbours.
#[test]
fn a_stream_that_is_a_press_early_from_some_press_on() {
    let bent = SessionOptions {
        places: 121,
        repetitions: 2,
        bent_px: 30.0,
        ..SessionOptions::default()
    };
    for share in [0.2, 0.5, 0.8] {
        let early = SessionOptions {
            early_from: Some(share),
            ..bent
        };
        // Of the other rigs, camera 2 looks along the lines: a step of the path hardly moves its columns.
        names(Fault::ClockWrong, |seed| {
            let rig = Some((seed % 2) as usize);
            session(seed, SessionOptions { rig, ..early })
        });
    }
    let accused: Vec<u64> = (0..SEEDS)
        .into_par_iter()
        .filter(|seed| {
            let findings = run(&session(*seed, bent)).findings;
            named(&findings).contains(&Fault::ClockWrong)
        })
        .collect();
    assert!(accused.is_empty(), "{accused:?}");
}

/// The calibration would move the cameras with the positions, and find a smaller error.
#[test]
fn positions_in_a_scale_of_no_unit() {
    let wishes = SessionOptions {
        places: 25,
        ..SessionOptions::default()
    };
    for (factors, about_middle) in [
        ([0.6, 0.6], false),
        ([0.5, 1.0], false),
        ([1.7, 1.7], false),
        ([0.1, 0.1], true),
        ([0.04, 0.04], true),
        ([0.1, 0.25], true),
        ([6.0, 6.0], true),
    ] {
        names(Fault::UnitOfPositions, |seed| {
            edit(seed, wishes, |input| {
                let n = input.planned.len() as f64;
                let middle = if about_middle {
                    let mean = |of: fn(Point2) -> f64| {
                        input.planned.iter().map(|p| of(p.at)).sum::<f64>() / n
                    };
                    Point2::new(mean(|p| p.x_mm), mean(|p| p.y_mm))
                } else {
                    Point2::default()
                };
                let scaled = |p: Point2| {
                    Point2::new(
                        middle.x_mm + factors[0] * (p.x_mm - middle.x_mm),
                        middle.y_mm + factors[1] * (p.y_mm - middle.y_mm),
                    )
                };
                for (planned, outcome) in input.planned.iter_mut().zip(&mut input.outcomes) {
                    planned.at = scaled(planned.at);
                    let at = outcome.as_mut().unwrap();
                    at.measured_at = at.measured_at.map(scaled);
                }
            })
        });
    }
}

/// Rows with one coordinate have the positions of others.
#[test]
fn a_coordinate_that_is_the_same_in_all_rows() {
    let wishes = SessionOptions {
        places: 25,
        ..SessionOptions::default()
    };
    names(Fault::Unknown, |seed| {
        edit(seed, wishes, |input| {
            for (planned, outcome) in input.planned.iter_mut().zip(&mut input.outcomes) {
                planned.at.y_mm = 2.0;
                let at = outcome.as_mut().unwrap();
                at.measured_at = at.measured_at.map(|p| Point2::new(p.x_mm, 2.0));
            }
        })
    });
}

/// The other rows agree with the cameras: valid sessions with a large error, but for the law.
#[test]
fn a_part_of_the_press_list_in_another_order() {
    let wishes = SessionOptions {
        places: 20,
        ..SessionOptions::default()
    };
    // Two lines of the meander exchanged; ten rows in reverse.
    let exchanged = |i: usize| if i < 10 { i + 5 } else { i - 5 };
    let reversed = |i: usize| 19 - i;
    for order in [&exchanged as &(dyn Fn(usize) -> usize + Sync), &reversed] {
        names(Fault::OrderOfPresses, |seed| {
            edit(seed, wishes, |input| reorder(input, 5..15, order))
        });
    }
}

/// Rows in any order within blocks: no single row looks wrong, since all residuals are wide.
#[test]
fn a_press_list_in_a_random_order_within_blocks() {
    let wishes = SessionOptions {
        places: 81,
        ..SessionOptions::default()
    };
    for block in [4, 8, 20] {
        names(Fault::OrderOfPresses, |seed| {
            let mut random = Random::new(seed + 100);
            let mut order: Vec<usize> = (0..81).collect();
            for rows in order.chunks_mut(block) {
                for i in (1..rows.len()).rev() {
                    rows.swap(i, random.below(i + 1));
                }
            }
            edit(seed, wishes, |input| reorder(input, 0..81, &|i| order[i]))
        });
    }
}

/// The other rows agree with the cameras, and far more of them than there are wrong ones.
#[test]
fn rows_exchanged_here_and_there() {
    let wishes = SessionOptions {
        places: 81,
        ..SessionOptions::default()
    };
    for exchanged in [10, 20, 30] {
        names(Fault::OrderOfPresses, |seed| {
            let mut random = Random::new(seed + 200);
            let mut rows: Vec<usize> = (0..81).collect();
            for i in (1..rows.len()).rev() {
                rows.swap(i, random.below(i + 1));
            }
            rows.truncate(exchanged);
            let mut order: Vec<usize> = (0..81).collect();
            for (i, row) in rows.iter().enumerate() {
                order[*row] = rows[(i + 1) % exchanged];
            }
            edit(seed, wishes, |input| reorder(input, 0..81, &|i| order[i]))
        });
    }
}

/// Gives each row in `rows` of every repetition the position of row `from` of it.
fn reorder(
    input: &mut SessionInput,
    rows: std::ops::Range<usize>,
    from: &(dyn Fn(usize) -> usize + Sync),
) {
    let before = input.planned.clone();
    for (i, press) in before.iter().enumerate() {
        let row = press.location.index() as usize;
        if press.role == PressRole::Sync || !rows.contains(&row) {
            continue;
        }
        let at = before[i + from(row) - row].at;
        input.planned[i].at = at;
        input.outcomes[i].as_mut().unwrap().measured_at = Some(at);
    }
}
