//! The thread that owns the port: executes commands one at a time; in between it exchanges times, fetches the box's events, and
//! reconnects a lost line.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, RealClock};
use skinrig_model::pulse::MAX_MARKED_PRESS;
use skinrig_model::{BoxReport, DeviceRole, Mark, SentMark};

use crate::config::TriggerBoxConfig;
use crate::handshake::{Handshake, HandshakeError, run_handshake};
use crate::link::{Link, LinkError, RequestTimeouts, TimedReply};
use crate::offset::{Exchange, HostFromBox};
use crate::protocol::{Counters, Event, EventKind, Events, Outcome, Request, SelfTest, parse_mark};
use crate::shared::{Shared, lock};
use crate::wire::{Connector, OpenError};

/// Interval of attempts to reopen a lost line.
const RECONNECT_INTERVAL: Duration = Duration::from_millis(100);
/// Time limit of one handshake attempt on a reopened line, after which commands are checked again.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_millis(450);
/// Additional sync counts that are skipped whenever the sync trains are set up again, besides those that the box may have used since
/// its last report: no count may denote two trains.
const SYNC_GAP: u32 = 64;

/// A command for the thread.
pub(crate) enum Command {
    Send(Mark),
    Arm,
    Disarm,
    /// Period in ms, 0 for none.
    Sync(u16),
    SelfTest,
    Counters,
    SetSerial(String),
}

/// Result of a command.
#[derive(Debug)]
pub(crate) enum CommandResult {
    Nothing,
    Sent(SentMark),
    SelfTest(SelfTest),
    Counters(Counters),
}

pub(crate) struct Job {
    pub command: Command,
    pub reply: SyncSender<Result<CommandResult, DeviceError>>,
    /// Latest start of the execution.
    pub deadline: Instant,
}

/// DesiredState state of the box, restored after each reset.
#[derive(Default)]
struct DesiredState {
    armed: bool,
    sync_ms: u16,
    next_sync: u32,
    /// Period of the sync trains last sent to the box, ms, whether they still run or not.
    sent_sync_ms: u16,
}

impl DesiredState {
    /// Records that the train with this count started. A late report, after a later count was sent, has no effect.
    fn record_sync(&mut self, count: u32) {
        let next = count.wrapping_add(1);
        if next.wrapping_sub(self.next_sync) & MAX_MARKED_PRESS <= MAX_MARKED_PRESS / 2 {
            self.next_sync = next & MAX_MARKED_PRESS;
        }
    }

    /// Skips counts that the box may have used: as many trains as fit into the silence after which it disarms itself, plus some that were
    /// not fetched yet.
    fn skip_used_counts(&mut self, silence_ms: u16) {
        if let Some(missed) = silence_ms.checked_div(self.sent_sync_ms) {
            self.next_sync = (self.next_sync + u32::from(missed) + SYNC_GAP) & MAX_MARKED_PRESS;
        }
        self.sent_sync_ms = self.sync_ms;
    }
}

/// Why an attempt to reconnect failed.
#[derive(Debug, thiserror::Error)]
enum ReconnectError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
}

pub(crate) struct Worker {
    config: TriggerBoxConfig,
    connector: Box<dyn Connector>,
    clock: RealClock,
    shared: Arc<Mutex<Shared>>,
    serial: String,
    /// A line after a successful handshake.
    link: Option<Link>,
    /// A line that needs a new handshake.
    unverified: Option<Link>,
    boot: u16,
    desired: DesiredState,
    mark_number: u32,
    next_event: u32,
    dropped: u16,
    host_from_box: HostFromBox,
    last_reply: Instant,
    opened: Instant,
    next_exchange: Instant,
    next_events: Instant,
    next_reconnect: Instant,
}

impl Worker {
    /// Takes over a line after a successful handshake.
    pub(crate) fn new(
        config: TriggerBoxConfig,
        connector: Box<dyn Connector>,
        clock: RealClock,
        link: Link,
        handshake: &Handshake,
        shared: Arc<Mutex<Shared>>,
    ) -> Self {
        let now = Instant::now();
        Self {
            host_from_box: HostFromBox::new(config.max_drift_ppm),
            config,
            connector,
            clock,
            shared,
            serial: handshake.identity.serial.clone(),
            link: Some(link),
            unverified: None,
            boot: handshake.boot,
            desired: DesiredState::default(),
            mark_number: 0,
            next_event: 0,
            dropped: 0,
            last_reply: now,
            opened: now,
            next_exchange: now,
            next_events: now,
            next_reconnect: now,
        }
    }

    /// Skips events from before this session.
    pub(crate) fn begin(&mut self) -> Result<(), DeviceError> {
        let reply = self.request(&Request::Events { from: 0 }, self.timeouts())?;
        let events = self.expect_events(&reply)?;
        self.next_event = events.next;
        self.dropped = events.dropped;
        Ok(())
    }

    /// Runs until all callers are gone, then disarms the box.
    pub(crate) fn run(mut self, jobs: &Receiver<Job>) {
        loop {
            let next = if self.link.is_some() {
                self.next_exchange.min(self.next_events)
            } else {
                self.next_reconnect
            };
            let wait = next.saturating_duration_since(Instant::now());
            if wait.is_zero() {
                self.run_due_tasks();
            }
            match jobs.recv_timeout(wait) {
                Ok(job) => self.handle(job),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        if let Some(link) = &mut self.link {
            // If the line fails, the box's silence timeout disarms it.
            let timeouts = RequestTimeouts {
                per_try: self.config.reply_timeout,
                total: self.config.reply_timeout * 3,
            };
            let _ = link.request(&Request::Disarm, timeouts);
        }
    }

    fn handle(&mut self, job: Job) {
        let reply = if Instant::now() > job.deadline {
            Err(self.lost("the driver was busy for too long; nothing was sent".to_owned()))
        } else {
            self.execute(job.command)
        };
        // The caller may have given up waiting.
        let _ = job.reply.try_send(reply);
    }

    fn execute(&mut self, command: Command) -> Result<CommandResult, DeviceError> {
        match command {
            Command::Send(mark) => self.send(mark).map(CommandResult::Sent),
            Command::Arm => {
                self.desired.armed = true;
                self.restore().map(|()| CommandResult::Nothing)
            }
            Command::Disarm => {
                self.desired.armed = false;
                let reply = self.request(&Request::Disarm, self.timeouts())?;
                self.expect_done("disarm", &reply)
            }
            Command::Sync(period_ms) => {
                self.desired.sync_ms = period_ms;
                self.restore().map(|()| CommandResult::Nothing)
            }
            Command::SelfTest => {
                let reply = self.request(&Request::SelfTest, self.timeouts())?;
                self.expect_done("self test", &reply)?;
                let test = SelfTest::parse(&reply.reply.data);
                test.map(CommandResult::SelfTest)
                    .ok_or_else(|| self.malformed("the result of a self test"))
            }
            Command::Counters => {
                let reply = self.request(&Request::Status, self.timeouts())?;
                self.expect_done("status", &reply)?;
                let counters = Counters::parse(&reply.reply.data);
                counters
                    .map(CommandResult::Counters)
                    .ok_or_else(|| self.malformed("counters"))
            }
            Command::SetSerial(serial) => {
                let reply = self.request(&Request::SetSerial(serial.clone()), self.timeouts())?;
                self.expect_done("set serial", &reply)?;
                self.serial = serial;
                Ok(CommandResult::Nothing)
            }
        }
    }

    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let number = self.mark_number + 1;
        let request = Request::Mark { number, mark };
        let reply = match self.request(&request, self.timeouts()) {
            Err(e @ DeviceError::Lost { .. }) if self.link.is_some() => {
                // It is unknown whether the box executed this mark: restart the numbering.
                self.drop_link("a mark got no reply");
                return Err(e);
            }
            other => other?,
        };
        self.expect_done("mark", &reply)?;
        let Some(start) = parse_mark(&reply.reply.data) else {
            self.drop_link("the reply to a mark was malformed");
            return Err(self.malformed("the start of a train"));
        };
        self.mark_number = number;
        let own = exchange(&reply);
        let (t, uncertainty_ns) = self.host_from_box.bounds(own, start).middle();
        lock(&self.shared).contradictions = self.host_from_box.contradictions();
        Ok(SentMark {
            mark,
            t,
            uncertainty_ns,
        })
    }

    /// Runs periodic tasks that are due.
    fn run_due_tasks(&mut self) {
        let now = Instant::now();
        if self.link.is_none() {
            self.reconnect();
        } else if now >= self.next_exchange {
            self.next_exchange = now + self.config.exchange_interval;
            self.exchange_time();
        } else {
            self.next_events = now + self.config.events_interval;
            self.fetch_events();
        }
        let silent = self.last_reply.elapsed() > self.config.command_timeout;
        if self.link.is_some() && silent {
            let ms = self.last_reply.elapsed().as_millis();
            self.drop_link(&format!("no reply for {ms} ms"));
        }
    }

    fn exchange_time(&mut self) {
        if let Ok(reply) = self.request(&Request::Time, self.timeouts()) {
            let own = exchange(&reply);
            self.host_from_box.add(own);
            self.report(BoxReport::Exchange {
                sent: own.sent,
                received: own.received,
                at: own.at.to_box_time(),
            });
        }
    }

    fn fetch_events(&mut self) {
        let from = self.next_event;
        let Ok(reply) = self.request(&Request::Events { from }, self.timeouts()) else {
            return; // requested again soon
        };
        let events = match self.expect_events(&reply) {
            Ok(events) => events,
            Err(fault) => return self.add_fault(fault),
        };
        if events.dropped != self.dropped {
            let lost = events.dropped.wrapping_sub(self.dropped);
            self.dropped = events.dropped;
            self.fault(
                "complete events",
                format!(
                    "{lost} dropped events: its memory was full (is the input connected to a noise source?)"
                ),
            );
        }
        for event in &events.events {
            self.report_event(*event);
        }
        self.next_event = events.first.wrapping_add(events.events.len() as u32);
        if self.next_event != events.next {
            self.next_events = Instant::now();
        }
    }

    fn report_event(&mut self, event: Event) {
        let at = event.at.to_box_time();
        let report = match event.kind {
            EventKind::Mark(mark) => BoxReport::Mark { mark, at },
            EventKind::Sync(count) => {
                self.desired.record_sync(count);
                BoxReport::Sync { count, at }
            }
            EventKind::Input { rising } => BoxReport::Input { rising, at },
        };
        self.report(report);
    }

    fn report(&self, report: BoxReport) {
        lock(&self.shared).report(report);
    }

    fn fault(&self, expected: &str, found: String) {
        self.add_fault(self.state(expected, found));
    }

    /// Queues a fault for the next poll.
    fn add_fault(&self, fault: DeviceError) {
        lock(&self.shared).add_fault(fault);
    }

    /// Sends a request. Detects resets of the box, and rearms a box that disarmed itself.
    fn request(
        &mut self,
        request: &Request,
        timeouts: RequestTimeouts,
    ) -> Result<TimedReply, DeviceError> {
        let Some(link) = &mut self.link else {
            let reason = lock(&self.shared).down.clone().unwrap_or_default();
            return Err(self.lost(reason));
        };
        let reply = match link.request(request, timeouts) {
            Ok(reply) => reply,
            Err(e @ LinkError::Disconnected(_)) => {
                let reason = e.to_string();
                self.drop_link(&reason);
                self.unverified = None;
                return Err(self.lost(reason));
            }
            Err(e @ LinkError::NoReply { .. }) => return Err(self.lost(e.to_string())),
        };
        self.last_reply = Instant::now();
        if reply.reply.boot != self.boot {
            self.drop_link("the box was reset");
            return Err(self.lost(format!(
                "the box was reset; its last `{}` may or may not have been executed",
                request.name()
            )));
        }
        if self.desired.armed && reply.reply.flags.disarmed_by_silence() {
            let restored = self.restore_on_line();
            self.fault(
                "armed",
                format!(
                    "disarmed after {} ms without a request from the host; armed again",
                    self.config.silence_ms
                ),
            );
            restored?;
        }
        Ok(reply)
    }

    /// Stops using the line until the next successful handshake.
    fn drop_link(&mut self, reason: &str) {
        // Keep it open if possible: reopening would reset an Arduino.
        self.unverified = self.link.take();
        self.next_reconnect = Instant::now();
        lock(&self.shared).down = Some(reason.to_owned());
    }

    /// Tries one handshake, on the existing line or a new one.
    fn reconnect(&mut self) {
        let error = match self.try_line() {
            Ok((link, handshake)) => {
                self.resume(link, &handshake);
                return;
            }
            Err(error) => error,
        };
        self.next_reconnect = Instant::now() + RECONNECT_INTERVAL;
        lock(&self.shared).down = Some(error.to_string());
    }

    fn try_line(&mut self) -> Result<(Link, Handshake), ReconnectError> {
        let mut link = match self.unverified.take() {
            Some(link) => link,
            None => {
                let wire = self.connector.connect()?;
                self.opened = Instant::now();
                Link::new(wire, self.clock)
            }
        };
        let serial = Some(self.serial.as_str());
        match run_handshake(
            &mut link,
            self.connector.target(),
            serial,
            HANDSHAKE_TIMEOUT,
        ) {
            Ok(handshake) => Ok((link, handshake)),
            Err(e) => {
                let silent = matches!(e, HandshakeError::Link(LinkError::NoReply { .. }));
                let last_activity = self.last_reply.max(self.opened);
                if silent && last_activity.elapsed() < self.config.hello_timeout {
                    self.unverified = Some(link); // the box may still be starting
                }
                Err(e.into())
            }
        }
    }

    fn resume(&mut self, link: Link, handshake: &Handshake) {
        self.link = Some(link);
        self.last_reply = Instant::now();
        self.mark_number = 0;
        if handshake.boot != self.boot {
            self.boot = handshake.boot;
            self.next_event = 0;
            self.dropped = 0;
            self.host_from_box.clear();
            lock(&self.shared).resets += 1;
            self.report(BoxReport::Reset {
                noticed: self.clock.now(),
            });
        }
        if let Err(e) = self.restore() {
            self.drop_link(&e.to_string());
            return;
        }
        lock(&self.shared).down = None;
    }

    /// Restores the desired state of the box.
    fn restore(&mut self) -> Result<(), DeviceError> {
        if self.link.is_none() {
            return self.request(&Request::Time, self.timeouts()).map(|_| ());
        }
        self.restore_on_line()
    }

    fn restore_on_line(&mut self) -> Result<(), DeviceError> {
        if !self.desired.armed {
            return Ok(());
        }
        self.desired.skip_used_counts(self.config.silence_ms);
        let arm = Request::Arm {
            silence_ms: self.config.silence_ms,
        };
        let sync = Request::Sync {
            period_ms: self.desired.sync_ms,
            first: self.desired.next_sync,
        };
        for request in [arm, sync] {
            let timeouts = self.timeouts();
            let Some(link) = &mut self.link else { break };
            let reply = link.request(&request, timeouts);
            let reply = reply.map_err(|e| self.lost(e.to_string()))?;
            self.expect_done(request.name(), &reply)?;
        }
        Ok(())
    }

    fn timeouts(&self) -> RequestTimeouts {
        RequestTimeouts {
            per_try: self.config.reply_timeout,
            total: self.config.command_timeout,
        }
    }

    fn expect_events(&self, reply: &TimedReply) -> Result<Events, DeviceError> {
        self.expect_done("events", reply)?;
        Events::parse(&reply.reply.data).ok_or_else(|| self.malformed("events"))
    }

    fn expect_done(&self, what: &str, reply: &TimedReply) -> Result<CommandResult, DeviceError> {
        match reply.reply.outcome {
            Outcome::Done => Ok(CommandResult::Nothing),
            Outcome::Busy => Err(self.state("idle", "busy with a train".to_owned())),
            Outcome::NotArmed => Err(self.state("armed", "disarmed".to_owned())),
            Outcome::Armed => Err(self.state("disarmed", "armed".to_owned())),
            Outcome::BadArgument => Err(DeviceError::Refused {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                expected: format!("arguments of `{what}` that the box accepts"),
                found: "rejected arguments".to_owned(),
            }),
            other => Err(self.lost(format!("replied to `{what}` with {other:?}"))),
        }
    }

    fn malformed(&self, what: &str) -> DeviceError {
        self.lost(format!("expected {what}, found a malformed reply"))
    }

    fn lost(&self, detail: String) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::TriggerBox,
            serial: self.serial.clone(),
            detail,
        }
    }

    fn state(&self, expected: &str, found: String) -> DeviceError {
        DeviceError::State {
            role: DeviceRole::TriggerBox,
            serial: self.serial.clone(),
            expected: expected.to_owned(),
            found,
        }
    }
}

fn exchange(reply: &TimedReply) -> Exchange {
    Exchange {
        sent: reply.sent,
        received: reply.received,
        at: reply.reply.at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_report_of_a_sync_train_does_not_reuse_its_count() {
        let mut desired = DesiredState {
            sync_ms: 100,
            sent_sync_ms: 100,
            next_sync: MAX_MARKED_PRESS - 20,
            ..DesiredState::default()
        };
        desired.skip_used_counts(5_000);
        // 50 trains during the silence plus 64, beyond the 17 bits.
        assert_eq!(desired.next_sync, 93);
        desired.record_sync(MAX_MARKED_PRESS - 20);
        assert_eq!(desired.next_sync, 93);
        desired.record_sync(93);
        assert_eq!(desired.next_sync, 94);
    }
}
