//! The sense of touch of a run: the bytes fed to it, and the current touch.

use skinrig_model::{HostTime, RawChunk, TouchKind};
use skinrig_protocol::React;

use crate::overrun::Overruns;
use crate::touch_sense::{Fed, SensedTouch, TouchSense};

/// The sense, the bytes fed to it, and the current touch.
pub(crate) struct Feeling {
    pub(crate) sense: Box<dyn TouchSense>,
    pub(crate) fed: [Fed; 2],
    /// Set once learning has begun: only then are the newest bytes needed.
    pub(crate) learning: bool,
    pub(crate) touch: Option<FeltTouch>,
    /// Touch for which the tip is about to be lifted.
    pub(crate) lifting: Option<SensedTouch>,
    pub(crate) overruns: Overruns,
}

/// The current touch.
#[derive(Clone, Copy)]
pub(crate) struct FeltTouch {
    /// Time of its onset.
    onset: HostTime,
    /// Its onset or newest position.
    newest: SensedTouch,
}

impl Feeling {
    pub(crate) fn new(sense: Box<dyn TouchSense>) -> Self {
        Self {
            sense,
            fed: [Fed::default(); 2],
            learning: false,
            touch: None,
            lifting: None,
            overruns: Overruns::default(),
        }
    }

    /// Feeds a complete chunk.
    pub(crate) fn complete(&mut self, chunk: &RawChunk) {
        if self.sense.is_on() {
            self.fed[chunk.camera.index()].complete(chunk, self.sense.as_mut());
        }
    }

    pub(crate) fn felt(&mut self, touch: SensedTouch) {
        self.touch = match (touch.kind, self.touch) {
            (TouchKind::Onset, _) => Some(FeltTouch {
                onset: touch.until,
                newest: touch,
            }),
            (TouchKind::Position, Some(felt)) => Some(FeltTouch {
                newest: touch,
                ..felt
            }),
            _ => None,
        };
    }

    /// What is felt, if that began after `since`.
    pub(crate) fn since(&self, since: HostTime) -> Option<SensedTouch> {
        Some(self.touch.filter(|t| t.onset > since)?.newest)
    }

    /// The touch that fulfils `react`, if one is felt that began after `since`: an older one is none of this press.
    pub(crate) fn fulfilled(&self, react: React, since: HostTime) -> Option<SensedTouch> {
        let touch = self.since(since)?;
        let within = |most: f64| touch.region.is_some_and(|r| r.semi_axes_mm[0] <= most);
        let as_deep = |least: f64| touch.depth.is_some_and(|depth| depth.mm >= least);
        let met = react.region_mm.is_none_or(within) && react.depth_mm.is_none_or(as_deep);
        met.then_some(touch)
    }
}
