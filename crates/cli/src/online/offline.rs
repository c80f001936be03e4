//! Online = offline: the position at the end of each press window against the stored analysis, bit by bit.

use skinrig_analysis::locator::LocatorModelError;
use skinrig_analysis::segment::{Window, windows};
use skinrig_analysis::{Analysis, SessionInput};
use skinrig_model::{CameraId, CdEvent};
use skinrig_online::{Opening, PositionEstimator};

/// Presses whose windows both cameras have, in order of time.
pub(super) struct Comparison<'a> {
    analysis: &'a Analysis,
    positions: PositionEstimator,
    windows: std::iter::Peekable<std::vec::IntoIter<[Window; 2]>>,
    open: Option<[Window; 2]>,
    newest_us: [u64; 2],
    compared: Compared,
}

/// Press windows of a replay against the analysis.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Compared {
    /// Windows compared,
    pub(crate) windows: usize,
    /// and how many gave the bits of the analysis.
    pub(crate) equal: usize,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(
        analysis: &'a Analysis,
        input: &SessionInput,
    ) -> Result<Self, LocatorModelError> {
        let timings = || {
            let rows = analysis.presses.iter().enumerate();
            rows.filter_map(|(row, p)| Some((row, p.timing?)))
        };
        let of_camera = |k: usize| {
            let clock = analysis.clocks[k];
            clock.map_or_else(Vec::new, |clock| {
                windows(timings(), &input.earlier, &clock, &analysis.settings)
            })
        };
        let pairs = of_camera(0).into_iter().zip(of_camera(1));
        let both: Vec<[Window; 2]> = pairs.map(|(one, two)| [one, two]).collect();
        Ok(Self {
            analysis,
            positions: PositionEstimator::of(analysis)?,
            windows: both.into_iter().peekable(),
            open: None,
            newest_us: [0; 2],
            compared: Compared::default(),
        })
    }

    /// Adds a packet of a camera.
    pub(super) fn push(&mut self, camera: CameraId, events: &[CdEvent]) {
        self.positions.push(camera, events);
        let newest = events.iter().map(|e| e.t_us).max();
        let own = &mut self.newest_us[camera.index()];
        *own = (*own).max(newest.unwrap_or(0));
        self.advance();
    }

    fn advance(&mut self) {
        let passed = |newest: [u64; 2], of: [u64; 2]| (0..2).all(|k| newest[k] > of[k]);
        if let Some(open) = self.open
            && passed(self.newest_us, open.map(|w| w.end_us))
        {
            self.compare(open);
            self.open = None;
        }
        if self.open.is_none()
            && let Some(next) = self
                .windows
                .next_if(|w| passed(self.newest_us, w.map(|w| w.start_us)))
        {
            self.positions.open(next.map(Opening::from));
            self.open = Some(next);
        }
    }

    fn compare(&mut self, window: [Window; 2]) {
        let online = self.positions.position(window.map(|w| w.end_us));
        self.positions.close();
        let offline = &self.analysis.presses[window[0].row];
        let region = online.location.and_then(|l| l.region);
        let extrapolated = online.location.is_some_and(|l| l.extrapolated);
        let equal = online.complete
            && online.outcome == offline.location_outcome
            && region == offline.region
            && extrapolated == offline.extrapolated;
        self.compared.windows += 1;
        self.compared.equal += usize::from(equal);
    }

    /// Result so far.
    pub(super) const fn result(&self) -> Compared {
        self.compared
    }
}
