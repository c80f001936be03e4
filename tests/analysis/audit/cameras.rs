//! Cameras that change in the course of a session, or lose a part of their picture, and faults of readout, driver or converter: named, and never in a sound session.

use skinrig_analysis::result::{CameraChange, Changed, PressView, QuietPart, ReadoutFault};
use skinrig_model::{CameraId, CdEvent, Polarity};

use super::*;

/// What is said of cameras, but for parts of their pictures.
fn said(s: &Session) -> Vec<(CameraId, WarningCause)> {
    let of_camera = |w: Warning| {
        let told = matches!(
            w.cause,
            WarningCause::CameraChanged(_) | WarningCause::Readout(_)
        );
        assert!(!told || w.cause.is_grave(), "{w}");
        Some((w.camera?, w.cause)).filter(|_| told)
    };
    run(s).warnings.into_iter().filter_map(of_camera).collect()
}

/// Sessions of three repetitions with a trigger line, whose camera 2 sends this instead of its events from `share` of its time on.
fn from_then_on(seed: u64, share: f64, other: impl Fn(CdEvent) -> Option<CdEvent>) -> Session {
    let mut s = session(
        seed,
        SessionOptions {
            line: Some(true),
            repetitions: 3,
            places: 40,
            ..SessionOptions::default()
        },
    );
    let events = &mut s.events.events[1];
    let (first, last) = (events[0].t_us, events[events.len() - 1].t_us);
    let from_us = first + (share * (last - first) as f64) as u64;
    let changed = |e: CdEvent| if e.t_us < from_us { Some(e) } else { other(e) };
    *events = events.drain(..).filter_map(changed).collect();
    s
}

/// One warning, about camera 2.
fn only(s: &Session, seed: u64) -> WarningCause {
    let said = said(s);
    let [(CameraId::Two, cause)] = &said[..] else {
        panic!("seed {seed}: {said:#?}");
    };
    cause.clone()
}

/// Share of noise in the events of camera 2's presses.
fn noise(s: &Session) -> f64 {
    let presses = run(s).presses;
    let views = || presses.iter().filter_map(|p| p.views[1]);
    let events: f64 = views().map(|v| f64::from(v.events)).sum();
    let of_noise = |v: PressView| v.idle_rate_per_s * f64::from(v.events) / v.rate_per_s;
    views().filter(|v| v.events > 0).map(of_noise).sum::<f64>() / events
}

#[test]
fn cameras_of_sound_sessions_do_not_change() {
    (0..3 * SEEDS).into_par_iter().for_each(|seed| {
        assert_eq!(said(&sound(seed)), [], "seed {seed}");
    });
}

#[test]
fn a_camera_that_changes_is_named_with_what_and_when() {
    type Other = fn(CdEvent) -> Option<CdEvent>;
    let fewer: Other = |e| Some(e).filter(|e| (e.t_us ^ u64::from(e.x)) % 10 < 3);
    let exchanged: Other = |e| {
        let polarity = Polarity::from_bit(e.polarity == Polarity::Off);
        Some(CdEvent { polarity, ..e })
    };
    let later: Other = |e| {
        Some(CdEvent {
            t_us: e.t_us + 60_000,
            ..e
        })
    };
    for (what, other, ratio) in [
        (Changed::Events, fewer, 0.2..0.5),
        (Changed::OnShare, exchanged, 1.3..2.5),
        (Changed::DelayMs, later, 1.3..3.0),
    ] {
        (0..SEEDS).into_par_iter().for_each(|seed| {
            let s = from_then_on(seed, 0.55, other);
            // Much noise hides it.
            if noise(&s) > 0.4 {
                return;
            }
            let cause = only(&s, seed);
            let WarningCause::CameraChanged(CameraChange {
                what: found,
                from,
                before,
                after,
                ..
            }) = cause
            else {
                panic!("seed {seed}: {cause}");
            };
            let share = f64::from(from.index()) / s.input.planned.len() as f64;
            assert!(
                found == what && (0.45..0.65).contains(&share) && ratio.contains(&(after / before)),
                "seed {seed}: {cause}, {share}"
            );
        });
    }
}

/// A lens that turns between two repetitions spreads the picture about its middle: the median column stays.
#[test]
fn a_camera_that_zooms_has_moved() {
    names(Fault::RigMoved, |seed| {
        from_then_on(seed, 0.4, |e| {
            let x = 320.0 + 1.2 * (f64::from(e.x) - 320.0);
            let x = x.round().clamp(0.0, 639.0) as u16;
            Some(CdEvent { x, ..e })
        })
    });
}

#[test]
fn faults_of_readout_and_converter_are_named() {
    (0..SEEDS).into_par_iter().for_each(|seed| {
        let rounded = from_then_on(seed, 0.0, |e| {
            let t_us = e.t_us / 20_000 * 20_000;
            Some(CdEvent { t_us, ..e })
        });
        let coarse = WarningCause::Readout(ReadoutFault::CoarseStamps { step_ms: 20.0 });
        // As late as that, the events of a press are 10 ms early on average.
        let said = said(&rounded);
        assert!(
            said.contains(&(CameraId::Two, coarse)),
            "seed {seed}: {said:#?}"
        );
        let clamped = from_then_on(seed, 0.0, |e| {
            Some(CdEvent {
                x: e.x.min(300),
                ..e
            })
        });
        let cause = only(&clamped, seed);
        let of_column = |cause: &WarningCause| {
            matches!(
                cause,
                WarningCause::Readout(ReadoutFault::CrowdedColumn { column: 300, .. })
            )
        };
        assert!(of_column(&cause), "seed {seed}: {cause}");
    });
}

/// A driver sends a third of the recording of a camera once more, in place of what the camera saw.
#[test]
fn a_recording_that_repeats_itself_is_named() {
    (0..SEEDS).into_par_iter().for_each(|seed| {
        let mut s = session(seed, SessionOptions::default());
        let events = &mut s.events.events[1];
        let third = events.len() / 3;
        let later_us = events[third].t_us - events[0].t_us;
        let again = events[..third].to_vec();
        events.truncate(third);
        events.extend(again.into_iter().map(|e| CdEvent {
            t_us: e.t_us + later_us,
            ..e
        }));
        let said = said(&s);
        let again = |(camera, cause): &(CameraId, WarningCause)| {
            let again = matches!(
                cause,
                WarningCause::Readout(ReadoutFault::EventsAgain { .. })
            );
            *camera == CameraId::Two && again
        };
        assert!(said.iter().any(again), "seed {seed}: {said:#?}");
    });
}

/// A part of a camera's picture dies half-way. No sound session is said to have such a part.
#[test]
fn a_part_of_the_picture_that_dies_is_named() {
    let long = SessionOptions {
        places: 20,
        ..SessionOptions::default()
    };
    let part = |w: Warning| match w.cause {
        WarningCause::QuietPart(part) => Some(part),
        _ => None,
    };
    let quiet =
        |s: &Session| -> Vec<QuietPart> { run(s).warnings.into_iter().filter_map(part).collect() };
    (0..SEEDS).into_par_iter().for_each(|seed| {
        let mut s = session(seed, long);
        assert_eq!(quiet(&s), [], "seed {seed}");
        let events = &mut s.events.events[0];
        let half_us = events[events.len() / 2].t_us;
        events.retain(|e| e.t_us < half_us || e.x < 320);
        let found = quiet(&s);
        let is_named = |q: &QuietPart| q.columns == Some((320, 639)) && q.presses.is_some();
        assert!(found.iter().any(is_named), "seed {seed}: {found:?}");
    });
}
