//! What sound sessions of slow tips and uneven skins look like, and a recording that repeats itself.

use skinrig_model::{CdEvent, HostDuration};

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

/// A skin that bends the columns, over distances of several locations, sits where it is listed.
#[test]
fn an_uneven_skin_is_not_displaced() {
    let uneven = SessionOptions {
        places: 60,
        bent_px: 25.0,
        uneven_px: 12.0,
        ..SessionOptions::default()
    };
    let alarms: Vec<(u64, Vec<Finding>)> = (0..60)
        .into_par_iter()
        .map(|seed| (seed, run(&session(seed, uneven)).findings))
        .filter(|(_, found)| found.iter().any(|f| f.fault == Fault::PositionsDisplaced))
        .collect();
    assert!(alarms.is_empty(), "{} of 60: {alarms:#?}", alarms.len());
}

/// A driver sends a third of the recording of a camera once more, in place of what the camera saw.
#[test]
fn a_recording_that_repeats_itself_is_named() {
    let repeats = |s: &Session| -> Vec<Warning> {
        let all = run(s).warnings.into_iter();
        all.filter(|w| matches!(w.cause, WarningCause::RepeatedEvents(_)))
            .collect()
    };
    (0..SEEDS).into_par_iter().for_each(|seed| {
        let mut s = session(seed, SessionOptions::default());
        assert_eq!(repeats(&s), [], "seed {seed}");
        let events = &mut s.events.events[1];
        let third = events.len() / 3;
        let later_us = events[third].t_us - events[0].t_us;
        let again = events[..third].to_vec();
        events.truncate(third);
        events.extend(again.into_iter().map(|e| CdEvent {
            t_us: e.t_us + later_us,
            ..e
        }));
        let found = repeats(&s);
        assert!(
            found.iter().all(|w| w.cause.is_grave()) && found.len() == 1,
            "seed {seed}: {found:?}"
        );
    });
}
