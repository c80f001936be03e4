//! Sound sessions of slow tips and uneven skins: no fault is found in them.

use skinrig_model::HostDuration;

use super::*;

/// Slow tips: each press bursts 0.3 to 0.45 s after its contact, as deep as the camera needs it. No clock is wrong.
#[test]
fn slow_presses_are_silent() {
    let line = SessionOptions {
        line: Some(true),
        ..SessionOptions::default()
    };
    (0..SEEDS).into_par_iter().for_each(|seed| {
        let slow = edit(seed, line, |input| {
            let mut random = Random::new(seed);
            for outcome in input.outcomes.iter_mut().flatten() {
                if let Some(timing) = &mut outcome.timing {
                    let late = HostDuration::from_millis(300 + (150.0 * random.unit()) as i64);
                    timing.contact = timing.contact - late;
                    timing.approach = timing.approach - late;
                }
            }
        });
        let found = run(&slow).findings;
        let of_clock = |f: &Finding| f.fault == Fault::ClockWrong;
        assert!(!found.iter().any(of_clock), "seed {seed}: {found:#?}");
    });
}

/// A skin that bends the columns of several locations beside each other alike sits where it is listed.
#[test]
fn an_uneven_skin_is_not_displaced() {
    let uneven = SessionOptions {
        places: 60,
        wavy_px: 50.0,
        uneven_px: 6.0,
        ..SessionOptions::default()
    };
    let alarms: Vec<(u64, Vec<Finding>)> = (0..60)
        .into_par_iter()
        .map(|seed| (seed, run(&session(seed, uneven)).findings))
        .filter(|(_, found)| found.iter().any(|f| f.fault == Fault::PositionsDisplaced))
        .collect();
    assert!(alarms.len() <= 2, "{} of 60: {alarms:#?}", alarms.len());
}
