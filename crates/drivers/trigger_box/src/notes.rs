//! Notes about the losses that the box counted, with the next step.

use crate::protocol::Counters;

/// The box's counters of lost or damaged data at some time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Losses {
    late_edges: u16,
    input_glitches: u16,
    dropped_events: u16,
    bad_checksums: u16,
    bad_frames: u16,
    overruns: u16,
    ignored_edges: u16,
    input_mutes: u16,
}

impl From<Counters> for Losses {
    fn from(c: Counters) -> Self {
        Self {
            late_edges: c.late_edges,
            input_glitches: c.input_glitches,
            dropped_events: c.dropped_events,
            bad_checksums: c.bad_checksums,
            bad_frames: c.bad_frames,
            overruns: c.overruns,
            ignored_edges: c.ignored_edges,
            input_mutes: c.input_mutes,
        }
    }
}

/// Describes losses between `before` and `now`, and contradictions between the clocks; `None` if there were none. `since` describes the
/// time of `before`.
pub(crate) fn describe_losses(
    since: &str,
    before: Losses,
    now: Losses,
    contradictions: u64,
) -> Option<String> {
    let mut parts = Vec::new();
    let mut part = |before: u16, now: u16, what: &str| {
        let n = now.saturating_sub(before);
        if n > 0 {
            // The box's counters saturate.
            let at_least = if now == u16::MAX { "at least " } else { "" };
            parts.push(format!("{at_least}{n} {what}"));
        }
    };
    part(
        before.late_edges,
        now.late_edges,
        "train edges were late (mark times may be off by up to 4.1 ms: check the alignment certificate)",
    );
    part(
        before.input_glitches,
        now.input_glitches,
        "input pulses were too short for a time stamp (check the wiring and shield of the input)",
    );
    part(
        before.dropped_events,
        now.dropped_events,
        "events were dropped because the box's memory was full (the host was too slow, or the USB cable is bad)",
    );
    part(
        before.ignored_edges,
        now.ignored_edges,
        "input edges were ignored to keep memory for marks (does the contact bounce permanently?)",
    );
    part(
        before.input_mutes,
        now.input_mutes,
        "times the input changed so often that it was ignored for up to 4 ms (check the wiring and shield of the input)",
    );
    part(
        before.bad_checksums,
        now.bad_checksums,
        "requests had a wrong checksum (they were repeated: check the USB cable)",
    );
    part(
        before.bad_frames,
        now.bad_frames,
        "requests were damaged (they were repeated: check the USB cable)",
    );
    part(
        before.overruns,
        now.overruns,
        "bytes from the host were lost (requests were repeated: check the USB cable)",
    );
    if contradictions > 0 {
        parts.push(format!(
            "{contradictions} time exchanges contradicted earlier ones (the clock drifts by more than `max_drift_ppm`: increase it \
            in the rig file)"
        ));
    }
    (!parts.is_empty()).then(|| format!("since {since}: {}", parts.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_losses_since_the_given_time_are_reported() {
        let before = Losses {
            input_glitches: 4,
            bad_frames: 9,
            ..Losses::default()
        };
        assert_eq!(describe_losses("it was armed", before, before, 0), None);
        let now = Losses {
            late_edges: 2,
            bad_frames: u16::MAX,
            ..before
        };
        let text = describe_losses("it was armed", before, now, 0).unwrap_or_default();
        assert!(
            text.starts_with("since it was armed: 2 train edges were late"),
            "{text}"
        );
        assert!(
            text.contains("4.1 ms: check the alignment certificate"),
            "{text}"
        );
        assert!(
            text.contains("at least 65526 requests were damaged"),
            "{text}"
        );
        assert!(!text.contains("input"), "{text}");
        let drift = describe_losses("it was armed", now, now, 3).unwrap_or_default();
        assert!(drift.contains("3 time exchanges"), "{drift}");
    }
}
