//! The trackers that follow the pose stream: the press in progress, the surface search, and the current motion.

use skinrig_device::Clock;
use skinrig_model::{HostTime, PoseSample, RunFault};

use crate::guard::GuardedIndenter;
use crate::open_press::OpenPress;
use crate::press_tracker::{PressTracker, Settling};
use crate::touch::TouchDetector;

/// The current trackers, each of which sees every sample.
#[derive(Default)]
pub(crate) struct PoseTrackers {
    press: Option<OpenPress>,
    touch: Option<TouchDetector>,
    settling: Option<Settling>,
    /// Samples of the last poll.
    fresh: Vec<PoseSample>,
}

impl PoseTrackers {
    /// Polls the indenter and passes the samples on, including those before a failure.
    pub(crate) fn poll(
        &mut self,
        indenter: &mut GuardedIndenter<'_>,
        clock: &dyn Clock,
    ) -> Result<(), RunFault> {
        self.fresh.clear();
        let answer = indenter.poll(clock, &mut self.fresh);
        for sample in &self.fresh {
            if let Some(press) = &mut self.press {
                press.feed(sample);
            }
            if let Some(touch) = &mut self.touch {
                touch.feed(sample);
            }
            if let Some(settling) = &mut self.settling {
                settling.feed(sample);
            }
        }
        answer
    }

    /// Samples of the last poll.
    pub(crate) fn fresh(&self) -> &[PoseSample] {
        &self.fresh
    }

    /// Starts an attempt at a press; an earlier surface search is over.
    pub(crate) fn begin_press(&mut self, press: OpenPress) {
        self.press = Some(press);
        self.touch = None;
    }

    /// Ends the press in progress.
    pub(crate) fn end_press(&mut self) {
        self.press = None;
    }

    /// The press in progress.
    pub(crate) const fn press(&self) -> Option<&OpenPress> {
        self.press.as_ref()
    }

    /// The press in progress.
    pub(crate) const fn press_mut(&mut self) -> Option<&mut OpenPress> {
        self.press.as_mut()
    }

    /// Phases of the press in progress, once the tip goes down.
    pub(crate) fn phases(&self) -> Option<&PressTracker> {
        self.press.as_ref().and_then(OpenPress::tracker)
    }

    /// Phases of the press in progress, once the tip goes down.
    pub(crate) fn phases_mut(&mut self) -> Option<&mut PressTracker> {
        self.press.as_mut().and_then(OpenPress::tracker_mut)
    }

    /// Starts a surface search.
    pub(crate) fn begin_touch(&mut self, detector: TouchDetector) {
        self.touch = Some(detector);
    }

    /// Sets the time of the command for the slow motion of the search.
    pub(crate) const fn search_from(&mut self, t: HostTime) {
        if let Some(touch) = &mut self.touch {
            touch.search_from(t);
        }
    }

    /// The surface search.
    pub(crate) const fn touch(&self) -> Option<&TouchDetector> {
        self.touch.as_ref()
    }

    /// Ends the surface search.
    pub(crate) fn end_touch(&mut self) {
        self.touch = None;
    }

    /// Waits for a motion to settle; replaces an earlier wait.
    pub(crate) fn settle(&mut self, settling: Settling) {
        self.settling = Some(settling);
    }

    /// True until the motion has settled.
    pub(crate) fn is_settling(&self) -> bool {
        self.settling
            .as_ref()
            .is_some_and(|s| s.settled().is_none())
    }

    /// True once the motion has settled.
    pub(crate) fn has_settled(&self) -> bool {
        self.settling
            .as_ref()
            .is_some_and(|s| s.settled().is_some())
    }

    /// Ends the wait for a motion.
    pub(crate) fn stop_settling(&mut self) {
        self.settling = None;
    }
}
