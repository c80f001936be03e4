//! What the box's counters say about a run, in a sentence with what to do.

use crate::protocol::Counters;

/// The counters that stand for something lost, as they were at some instant.
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

/// What was counted from `before` to `now`, and the contradictions of the clocks in the meantime; `None` when nothing was.
/// `since` says when `before` was.
pub(crate) fn note(
    since: &str,
    before: Losses,
    now: Losses,
    contradictions: u64,
) -> Option<String> {
    let mut parts = Vec::new();
    let mut part = |before: u16, now: u16, what: &str| {
        let n = now.saturating_sub(before);
        if n > 0 {
            // The box's counters stop at their end.
            let at_least = if now == u16::MAX { "at least " } else { "" };
            parts.push(format!("{at_least}{n} {what}"));
        }
    };
    part(
        before.late_edges,
        now.late_edges,
        "edges of trains were late (times of marks may be off by up to 4.1 ms: look at the alignment certificate)",
    );
    part(
        before.input_glitches,
        now.input_glitches,
        "pulses at its input were too short to be stamped (check the input's wiring and shield)",
    );
    part(
        before.dropped_events,
        now.dropped_events,
        "events found its memory full (the host was too slow, or the usb cable is bad)",
    );
    part(
        before.ignored_edges,
        now.ignored_edges,
        "edges of its input were ignored to leave memory to marks (does the contact bounce without end?)",
    );
    part(
        before.input_mutes,
        now.input_mutes,
        "times its input changed so often that it was not looked at for up to 4 ms (check the input's wiring and shield)",
    );
    part(
        before.bad_checksums,
        now.bad_checksums,
        "requests came with a wrong checksum (they were repeated: check the usb cable)",
    );
    part(
        before.bad_frames,
        now.bad_frames,
        "requests came damaged (they were repeated: check the usb cable)",
    );
    part(
        before.overruns,
        now.overruns,
        "bytes from the host were lost (requests were repeated: check the usb cable)",
    );
    if contradictions > 0 {
        parts.push(format!(
            "{contradictions} exchanges of time excluded the earlier ones (its clock drifts by more than \
             `max_drift_ppm`: raise it in the rig file)"
        ));
    }
    (!parts.is_empty()).then(|| format!("since {since}: {}", parts.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_counted_since_is_told() {
        let before = Losses {
            input_glitches: 4,
            bad_frames: 9,
            ..Losses::default()
        };
        assert_eq!(note("it was armed", before, before, 0), None);
        let now = Losses {
            late_edges: 2,
            bad_frames: u16::MAX,
            ..before
        };
        let text = note("it was armed", before, now, 0).unwrap_or_default();
        assert!(
            text.starts_with("since it was armed: 2 edges of trains were late"),
            "{text}"
        );
        assert!(
            text.contains("4.1 ms: look at the alignment certificate"),
            "{text}"
        );
        assert!(
            text.contains("at least 65526 requests came damaged"),
            "{text}"
        );
        assert!(!text.contains("input"), "{text}");
        let drift = note("it was armed", now, now, 3).unwrap_or_default();
        assert!(drift.contains("3 exchanges of time"), "{drift}");
    }
}
