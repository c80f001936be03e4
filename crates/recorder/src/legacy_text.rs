//! Causes of sessions before schema 11, which hold only their text. The only code that reads messages: those below are
//! frozen as these sessions contain them, whatever skinrig writes today.

use skinrig_model::{
    ExcludedReason, InterruptionKind, InterruptionReason, InvalidReason, MissedReason,
    PressFaultKind, RunEnd, RunFault, StopReason,
};

const CUT_OFF: &str = "cut off: ";
const LEG: &str = "leg ";
const LEG_ENDED: &str = " of the session ended without its outcome";
const STOP: &str = "operator: stop";
const ABORT: &str = "operator: abort";
const HALT: &str =
    "operator: halt; the tip stayed where it was: check it before you power the robot again";

/// Why an attempt is invalid.
pub(crate) fn invalid(text: String, kinds: Vec<PressFaultKind>) -> InvalidReason {
    let unfinished = text.strip_prefix(CUT_OFF);
    let leg = unfinished
        .and_then(|rest| rest.strip_prefix(LEG)?.strip_suffix(LEG_ENDED))
        .and_then(|number| {
            let leg = number.parse::<u32>().ok()?;
            (leg.to_string() == number).then_some(leg)
        });
    match leg {
        Some(leg) => InvalidReason::LegEnded { leg },
        None => InvalidReason::Recorded {
            is_cut_off: unfinished.is_some(),
            text,
            kinds,
        },
    }
}

/// Why a press was never attempted.
pub(crate) const fn missed(text: String) -> MissedReason {
    MissedReason::Recorded { text }
}

/// Why a press that was done does not count.
pub(crate) const fn excluded(text: String) -> ExcludedReason {
    ExcludedReason::Recorded { text }
}

/// Why a run stopped.
pub(crate) fn stopped(text: String) -> StopReason {
    match text.as_str() {
        STOP => StopReason::Stop,
        ABORT => StopReason::Abort,
        HALT => StopReason::Halt,
        _ => StopReason::Recorded { text },
    }
}

/// How a run failed.
pub(crate) fn faulted(text: String) -> RunEnd {
    RunEnd::fault(RunFault::Recorded { text })
}

/// Why a run was interrupted. An interruption that ended the run has the same text as its end.
pub(crate) fn interruption(kind: InterruptionKind, text: String) -> InterruptionReason {
    use InterruptionKind as K;
    match kind {
        K::Fault => InterruptionReason::End(faulted(text)),
        K::Stop | K::Abort | K::Halt => InterruptionReason::End(RunEnd::Stopped(stopped(text))),
        K::Pause | K::PauseNow | K::Resume => InterruptionReason::Recorded { text },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn cut_off_attempts_are_recognised() {
        let read = |text: &str| invalid(text.to_owned(), Vec::new());
        assert_eq!(
            read("cut off: leg 12 of the session ended without its outcome"),
            InvalidReason::LegEnded { leg: 12 }
        );
        for (text, is_cut_off) in [
            ("cut off: operator: abort; camera 1 sent no bytes", true),
            (
                "cut off: leg 012 of the session ended without its outcome",
                true,
            ),
            (
                "cut off: leg 1 of the session ended without its outcome; more",
                true,
            ),
            ("cut off: ", true),
            ("camera 1 lost 64 bytes; cut off: x", false),
            ("", false),
        ] {
            assert_eq!(read(text).is_cut_off(), is_cut_off, "{text}");
            assert!(
                !matches!(read(text), InvalidReason::LegEnded { .. }),
                "{text}"
            );
        }
        for (text, reason) in [
            (STOP, StopReason::Stop),
            (ABORT, StopReason::Abort),
            (HALT, StopReason::Halt),
        ] {
            assert_eq!(stopped(text.to_owned()), reason);
        }
    }

    proptest! {
        #[test]
        fn every_text_is_kept(
            text in "(cut off: ?)?(leg [0-9]{1,12})?( of the session ended without its outcome)?.{0,20}",
            stop in "(operator: )?(stop|abort|halt|.{0,9})",
        ) {
            prop_assert_eq!(invalid(text.clone(), Vec::new()).to_string(), text.clone());
            prop_assert_eq!(faulted(text.clone()).reason(), Some(text.clone()));
            prop_assert_eq!(interruption(InterruptionKind::Fault, text.clone()).to_string(), text);
            prop_assert_eq!(stopped(stop.clone()).to_string(), stop);
        }
    }
}
