//! Windows: the interval of camera time that belongs to each press.

use skinrig_model::{AnalysisSettings, CameraId, PressTiming, WindowAnchor};

use crate::background::Background;
use crate::input::EarlierAttempt;
use crate::result::ClockFit;

/// Maximum idle time before a press, µs.
pub const IDLE_US: u64 = 500_000;
/// Minimum idle time for a rate, µs.
pub const MIN_IDLE_US: u64 = 20_000;

/// Window of one press in camera time. All intervals are half-open, µs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Row of the press in the plan.
    pub row: usize,
    /// `window_before_ms` before the contact (or before the middle of the press).
    pub start_us: u64,
    /// `window_after_ms` after the release (or after the middle); at most `window_after_contact_ms` after the contact
    /// and, with anchor `touch`, `window_after_depth_ms` after the tip reached its depth.
    pub end_us: u64,
    /// Start of the idle time before it: at most 0.5 s, back to the end of any earlier window or attempt. Equal to
    /// `start_us` if less than 20 ms is free, or if the end of a directly preceding attempt is unknown.
    pub idle_start_us: u64,
}

impl Window {
    /// Length of the window, s.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        (self.end_us - self.start_us) as f64 * 1e-6
    }

    /// Length of the idle time, s.
    #[must_use]
    pub fn idle_s(&self) -> f64 {
        (self.start_us - self.idle_start_us) as f64 * 1e-6
    }

    /// Core threshold of DBSCAN in this window of a camera, after this many events in its idle time.
    pub(crate) fn core_threshold(
        &self,
        settings: &AnalysisSettings,
        camera: CameraId,
        idle_events: u64,
    ) -> u32 {
        let background = Background {
            events: idle_events,
            idle_us: self.start_us - self.idle_start_us,
        };
        background.core_threshold(settings, camera, self.end_us - self.start_us)
    }

    /// True if bytes were lost within the window.
    #[must_use]
    pub fn overlaps(&self, gaps: &[(u64, u64)]) -> bool {
        gaps.iter()
            .any(|(from, to)| *from < self.end_us && *to >= self.start_us)
    }
}

/// Windows of all presses with known timing, in order of their start. Superseded attempts have no window, but their events
/// are not idle time: `earlier` has all of them, in any order.
///
/// Windows of a valid session do not overlap. If they do, each keeps all of its events, so shared events count in both
/// presses.
#[must_use]
pub fn windows(
    timings: impl Iterator<Item = (usize, PressTiming)>,
    earlier: &[EarlierAttempt],
    clock: &ClockFit,
    settings: &AnalysisSettings,
) -> Vec<Window> {
    // There are no events before the camera's zero, so a window may begin there.
    let tick = |us: f64| us.ceil().max(0.0) as u64;
    let mut windows: Vec<(Window, u64)> = timings
        .map(|(row, timing)| {
            let contact = clock.camera_us_of_host(timing.contact);
            let release = clock.camera_us_of_host(timing.release);
            let (first, last) = match settings.window_anchor {
                WindowAnchor::Touch => (contact, release),
                WindowAnchor::Middle => (0.5 * (contact + release), 0.5 * (contact + release)),
            };
            let start_us = tick(first - settings.window_before_ms * 1e3);
            let end_us = tick(last + settings.window_after_ms * 1e3).max(start_us);
            let after_contact_us = settings
                .window_after_contact_ms
                .map_or(u64::MAX, |ms| tick(contact + ms * 1e3));
            let after_depth_us = match settings.window_anchor {
                WindowAnchor::Touch => tick(
                    clock.camera_us_of_host(timing.at_depth) + settings.window_after_depth_ms * 1e3,
                ),
                WindowAnchor::Middle => u64::MAX,
            };
            let cut_us = after_contact_us.min(after_depth_us);
            let window = Window {
                row,
                start_us,
                end_us,
                idle_start_us: start_us,
            };
            (window, cut_us)
        })
        .collect();
    windows.sort_by_key(|(w, _)| (w.start_us, w.row));
    let mut repeated: Vec<(u64, Option<u64>)> = earlier
        .iter()
        .map(|attempt| {
            let us = |t| tick(clock.camera_us_of_host(t));
            (us(attempt.begun), attempt.clear.map(us))
        })
        .collect();
    repeated.sort_unstable();
    let mut repeated = repeated.into_iter().peekable();
    let mut earlier_end = 0;
    for (window, cut_us) in &mut windows {
        while let Some((_, clear_us)) =
            repeated.next_if(|(begun_us, _)| *begun_us <= window.start_us)
        {
            // Without a known end it lasts until the window.
            earlier_end = earlier_end.max(clear_us.unwrap_or(window.start_us));
        }
        let from = window.start_us.saturating_sub(IDLE_US).max(earlier_end);
        if window.start_us.saturating_sub(from) >= MIN_IDLE_US {
            window.idle_start_us = from;
        }
        // The rest of a press after a truncated window is not idle time.
        earlier_end = earlier_end.max(window.end_us);
        window.end_us = window.end_us.min(*cut_us).max(window.start_us);
    }
    windows.into_iter().map(|(window, _)| window).collect()
}

#[cfg(test)]
mod tests {
    use skinrig_model::{HostDuration, HostTime};

    use super::*;
    use crate::result::ClockMethod;

    fn timing(contact_s: f64, release_s: f64) -> PressTiming {
        let t = HostTime::from_secs_f64;
        PressTiming {
            approach: t(contact_s) - HostDuration::from_millis(100),
            contact: t(contact_s),
            at_depth: t(contact_s) + HostDuration::from_millis(100),
            retract: t(release_s) - HostDuration::from_millis(100),
            release: t(release_s),
            clear: t(release_s) + HostDuration::from_millis(100),
        }
    }

    fn clock(offset_us: f64) -> ClockFit {
        ClockFit {
            method: ClockMethod::TriggerMarks,
            offset_us,
            drift_ppm: 0.0,
            drift_se_ppm: 0.0,
            residual_rms_us: 0.0,
            residual_max_us: 0.0,
            n: 3,
            rejected: 0,
        }
    }

    #[test]
    fn windows_follow_measured_times_and_leave_idle_time_alone() {
        let settings = AnalysisSettings::default();
        let presses = [
            (0, timing(1.0, 1.5)),
            (1, timing(1.7, 2.2)),
            (2, timing(2.31, 2.8)),
        ];
        let w = windows(presses.into_iter(), &[], &clock(250.0), &settings);
        assert_eq!(
            (w[0].start_us, w[0].end_us, w[0].idle_start_us),
            (950_250, 1_550_250, 450_250)
        );
        assert_eq!((w[1].start_us, w[1].idle_start_us), (1_650_250, 1_550_250));
        // 10 ms are free before the third: too little for a rate.
        assert_eq!((w[2].start_us, w[2].idle_start_us), (2_260_250, 2_260_250));
    }

    #[test]
    fn a_long_hold_ends_its_window_a_second_after_the_depth_was_reached() {
        let settings = AnalysisSettings::default();
        // 20 s of hold; the next press begins 300 ms after its release.
        let presses = [(0, timing(1.0, 21.2)), (1, timing(21.5, 22.0))];
        let w = windows(presses.into_iter(), &[], &clock(0.0), &settings);
        assert_eq!((w[0].start_us, w[0].end_us), (950_000, 2_100_000));
        // The rest of the hold is not idle time.
        assert_eq!(
            (w[1].idle_start_us, w[1].start_us),
            (21_250_000, 21_450_000)
        );
    }

    #[test]
    fn an_attempt_that_was_repeated_is_no_idle_time() {
        let settings = AnalysisSettings::default();
        let t = HostTime::from_secs_f64;
        let presses = [
            (0, timing(1.0, 1.5)),
            (1, timing(4.0, 4.5)),
            (2, timing(5.0, 5.5)),
        ];
        let idle = |earlier: &[EarlierAttempt]| {
            windows(presses.into_iter(), earlier, &clock(0.0), &settings)
                .iter()
                .map(|w| (w.start_us, w.idle_start_us))
                .collect::<Vec<_>>()
        };
        let free = [
            (950_000, 450_000),
            (3_950_000, 3_450_000),
            (4_950_000, 4_550_000),
        ];
        assert_eq!(idle(&[]), free);
        // Retaken after its tip was clear at 3.8 s; a finished retake of the third changes nothing.
        let timed = EarlierAttempt {
            begun: t(3.0),
            clear: Some(t(3.8)),
        };
        let long_over = EarlierAttempt {
            begun: t(2.0),
            clear: Some(t(2.6)),
        };
        let [first, _, third] = free;
        assert_eq!(
            idle(&[timed, long_over]),
            [first, (3_950_000, 3_800_000), third]
        );
        // The clearing time is unknown: no idle time before the following press, and only there.
        let unknown = EarlierAttempt {
            clear: None,
            ..timed
        };
        assert_eq!(
            idle(&[unknown, long_over]),
            [first, (3_950_000, 3_950_000), third]
        );
        // Clear within the window of its retake.
        let late = EarlierAttempt {
            clear: Some(t(3.99)),
            ..timed
        };
        assert_eq!(idle(&[late]), [first, (3_950_000, 3_950_000), third]);
    }

    #[test]
    fn a_centred_window_has_its_configured_length() {
        let settings = AnalysisSettings {
            window_anchor: WindowAnchor::Middle,
            window_before_ms: 1500.0,
            window_after_ms: 1400.0,
            ..AnalysisSettings::default()
        };
        let w = windows(
            [(0, timing(4.0, 4.5))].into_iter(),
            &[],
            &clock(0.0),
            &settings,
        )[0];
        assert_eq!((w.start_us, w.end_us), (2_750_000, 5_650_000));
    }

    #[test]
    fn a_window_cut_after_the_contact_leaves_the_idle_time_as_it_was() {
        let presses = || [(0, timing(1.0, 1.5)), (1, timing(1.7, 1.75))].into_iter();
        let whole = windows(presses(), &[], &clock(0.0), &AnalysisSettings::default());
        let settings = AnalysisSettings {
            window_after_contact_ms: Some(200.0),
            ..AnalysisSettings::default()
        };
        let cut = windows(presses(), &[], &clock(0.0), &settings);
        assert_eq!(cut[0].end_us, 1_200_000);
        assert_eq!((cut[0].start_us, cut[1]), (whole[0].start_us, whole[1]));
    }

    #[test]
    fn a_window_before_the_camera_clock_is_empty() {
        let settings = AnalysisSettings::default();
        let w = windows(
            [(0, timing(1.0, 1.5))].into_iter(),
            &[],
            &clock(-9e6),
            &settings,
        );
        assert_eq!((w[0].start_us, w[0].end_us, w[0].idle_start_us), (0, 0, 0));
    }

    #[test]
    fn gaps_touch_the_windows_that_they_reach_into() {
        let settings = AnalysisSettings::default();
        let w = windows(
            [(0, timing(1.0, 1.5))].into_iter(),
            &[],
            &clock(0.0),
            &settings,
        )[0];
        for (gap, touches) in [
            ((900_000, 949_999), false),
            ((900_000, 950_000), true),
            ((1_000_000, 1_000_001), true),
            ((1_549_999, 1_600_000), true),
            ((1_550_000, 1_600_000), false),
            ((0, 9_000_000), true),
        ] {
            assert_eq!(w.overlaps(&[gap]), touches, "{gap:?}");
        }
    }
}
