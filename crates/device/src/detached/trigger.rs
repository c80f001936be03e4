//! A trigger box on a separate thread.

use skinrig_model::{BoxReport, DeviceIdentity, DeviceRole, Mark, SentMark};

use super::{Call, Calls, Timeouts, Worker};
use crate::{Clock, DeviceError, TriggerBox, TriggerCapabilities};

type Device = Box<dyn TriggerBox>;
type Answer<T> = Result<T, DeviceError>;

/// A [`TriggerBox`] whose calls run on a separate thread. Each poll returns the reports fetched by the previous one.
pub struct DetachedBox {
    capabilities: TriggerCapabilities,
    worker: Worker<Device>,
    sending: Option<Call<(Mark, Answer<SentMark>)>>,
    poll: Option<Call<(Vec<BoxReport>, Answer<()>)>>,
}

impl DetachedBox {
    /// Moves a box to a separate thread.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] if the thread cannot be started.
    pub fn new(
        device: Device,
        clock: Box<dyn Clock>,
        timeouts: Timeouts,
    ) -> Result<Self, DeviceError> {
        let (role, identity) = (DeviceRole::TriggerBox, device.identity());
        Ok(Self {
            capabilities: device.capabilities(),
            worker: Worker::start(role, identity, device, clock, timeouts)?,
            sending: None,
            poll: None,
        })
    }

    /// Number of unfinished calls.
    #[must_use]
    pub fn calls(&self) -> Calls {
        self.worker.calls.clone()
    }
}

impl TriggerBox for DetachedBox {
    fn identity(&self) -> DeviceIdentity {
        self.worker.identity.clone()
    }

    fn capabilities(&self) -> TriggerCapabilities {
        self.capabilities
    }

    fn send(&mut self, mark: Mark) -> Answer<SentMark> {
        match self.worker.answer(&mut self.sending)? {
            Some((asked, answer)) if asked == mark => return answer,
            // Reply to a mark whose caller has stopped waiting; the box reports that train anyway.
            Some(_) | None => {}
        }
        if self.sending.is_none() {
            let within = self.worker.timeouts.running;
            let call = move |d: &mut Device| (mark, d.send(mark));
            self.sending = Some(self.worker.request("send", within, call)?);
        }
        Err(self.worker.pending("send"))
    }

    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Answer<()> {
        let answer = self.worker.answer(&mut self.poll)?;
        if self.poll.is_none() {
            let within = self.worker.timeouts.running;
            let call = |d: &mut Device| {
                let mut reports = Vec::new();
                let answer = d.poll(&mut reports);
                (reports, answer)
            };
            self.poll = Some(self.worker.request("report", within, call)?);
        }
        let Some((fresh, answer)) = answer else {
            return Ok(());
        };
        reports.extend(fresh);
        answer
    }

    fn take_notes(&mut self) -> Vec<String> {
        let notes = self.worker.wait("notes", |d| d.take_notes());
        notes.unwrap_or_else(|e| {
            vec![format!(
                "its losses are unknown ({e}): check the alignment certificate"
            )]
        })
    }
}
