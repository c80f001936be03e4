//! The thread that owns the port: carries out commands one at a time, and in between keeps the ties of the clocks, fetches
//! the box's events, and brings a lost line back.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, RealClock};
use skinrig_model::pulse::MAX_MARKED_PRESS;
use skinrig_model::{BoxReport, DeviceRole, Mark, SentMark};

use crate::config::TriggerBoxConfig;
use crate::greeting::{Greeted, GreetingError, greet};
use crate::link::{Answer, Link, LinkError, Patience};
use crate::offset::{Exchange, HostFromBox};
use crate::protocol::{Counters, Event, EventKind, Events, Outcome, Request, SelfTest, parse_mark};
use crate::shared::{Shared, lock};
use crate::wire::Dial;

/// From one attempt to open a lost line to the next.
const DIAL_INTERVAL: Duration = Duration::from_millis(100);
/// How long a hello may take on a line that came back, before commands are looked at again.
const GREETING_SLICE: Duration = Duration::from_millis(450);
/// How many counts of sync trains are passed over whenever the box is told anew where to begin, besides those that it may
/// have used since its last word: no count may mean two trains.
const SYNC_GAP: u32 = 64;

/// What a caller may ask of the thread.
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

/// What the thread answers.
#[derive(Debug)]
pub(crate) enum Done {
    Nothing,
    Sent(SentMark),
    SelfTest(SelfTest),
    Counters(Counters),
}

pub(crate) struct Job {
    pub command: Command,
    pub reply: SyncSender<Result<Done, DeviceError>>,
    /// Not begun later than this.
    pub deadline: Instant,
}

/// What the box should be doing: put back after each reset.
#[derive(Default)]
struct Desired {
    armed: bool,
    sync_ms: u16,
    next_sync: u32,
    /// Period of the trains that the box was last told to send, ms, whether it still does or not.
    told_sync_ms: u16,
}

impl Desired {
    /// The train with this count began. One that is told late, after the box was given a later count, changes nothing.
    fn saw_sync(&mut self, count: u32) {
        let next = count.wrapping_add(1);
        if next.wrapping_sub(self.next_sync) & MAX_MARKED_PRESS <= MAX_MARKED_PRESS / 2 {
            self.next_sync = next & MAX_MARKED_PRESS;
        }
    }

    /// Before the box is told where to begin: the host may have missed as many trains as fit into the silence that the
    /// box bears, and a few more that were not fetched yet.
    fn pass_over_used_counts(&mut self, silence_ms: u16) {
        if let Some(missed) = silence_ms.checked_div(self.told_sync_ms) {
            self.next_sync = (self.next_sync + u32::from(missed) + SYNC_GAP) & MAX_MARKED_PRESS;
        }
        self.told_sync_ms = self.sync_ms;
    }
}

pub(crate) struct Worker {
    config: TriggerBoxConfig,
    dial: Box<dyn Dial>,
    clock: RealClock,
    shared: Arc<Mutex<Shared>>,
    serial: String,
    /// The line on which the box said hello.
    link: Option<Link>,
    /// A line on which it must do so again.
    doubtful: Option<Link>,
    boot: u16,
    desired: Desired,
    mark_number: u32,
    next_event: u32,
    dropped: u16,
    host_from_box: HostFromBox,
    heard: Instant,
    opened: Instant,
    next_exchange: Instant,
    next_events: Instant,
    next_dial: Instant,
}

impl Worker {
    /// Takes over a line on which the box has said hello.
    pub(crate) fn new(
        config: TriggerBoxConfig,
        dial: Box<dyn Dial>,
        clock: RealClock,
        link: Link,
        greeted: &Greeted,
        shared: Arc<Mutex<Shared>>,
    ) -> Self {
        let now = Instant::now();
        Self {
            host_from_box: HostFromBox::new(config.max_drift_ppm),
            config,
            dial,
            clock,
            shared,
            serial: greeted.identity.serial.clone(),
            link: Some(link),
            doubtful: None,
            boot: greeted.boot,
            desired: Desired::default(),
            mark_number: 0,
            next_event: 0,
            dropped: 0,
            heard: now,
            opened: now,
            next_exchange: now,
            next_events: now,
            next_dial: now,
        }
    }

    /// Forgets what the box did before this session.
    pub(crate) fn begin(&mut self) -> Result<(), DeviceError> {
        let answer = self.ask(&Request::Events { from: 0 }, self.patience())?;
        let events = self.expect_events(&answer)?;
        self.next_event = events.next;
        self.dropped = events.dropped;
        Ok(())
    }

    /// Until all callers are gone; then disarms the box.
    pub(crate) fn run(mut self, jobs: &Receiver<Job>) {
        loop {
            let next = if self.link.is_some() {
                self.next_exchange.min(self.next_events)
            } else {
                self.next_dial
            };
            let wait = next.saturating_duration_since(Instant::now());
            if wait.is_zero() {
                self.keep_house();
            }
            match jobs.recv_timeout(wait) {
                Ok(job) => self.take(job),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        if let Some(link) = &mut self.link {
            // On a line that is failing, the box's own watch for silence does it.
            let patience = Patience {
                per_try: self.config.reply_timeout,
                total: self.config.reply_timeout * 3,
            };
            let _ = link.ask(&Request::Disarm, patience);
        }
    }

    fn take(&mut self, job: Job) {
        let answer = if Instant::now() > job.deadline {
            Err(self.lost("the driver was busy for too long; nothing was sent".to_owned()))
        } else {
            self.carry_out(job.command)
        };
        // A caller that no longer waits has been told so.
        let _ = job.reply.try_send(answer);
    }

    fn carry_out(&mut self, command: Command) -> Result<Done, DeviceError> {
        match command {
            Command::Send(mark) => self.send(mark).map(Done::Sent),
            Command::Arm => {
                self.desired.armed = true;
                self.restore().map(|()| Done::Nothing)
            }
            Command::Disarm => {
                self.desired.armed = false;
                let answer = self.ask(&Request::Disarm, self.patience())?;
                self.expect_done("disarm", &answer)
            }
            Command::Sync(period_ms) => {
                self.desired.sync_ms = period_ms;
                self.restore().map(|()| Done::Nothing)
            }
            Command::SelfTest => {
                let answer = self.ask(&Request::SelfTest, self.patience())?;
                self.expect_done("self test", &answer)?;
                let test = SelfTest::parse(&answer.reply.answers);
                test.map(Done::SelfTest)
                    .ok_or_else(|| self.misunderstood("the result of a self test"))
            }
            Command::Counters => {
                let answer = self.ask(&Request::Status, self.patience())?;
                self.expect_done("status", &answer)?;
                let counters = Counters::parse(&answer.reply.answers);
                counters
                    .map(Done::Counters)
                    .ok_or_else(|| self.misunderstood("counters"))
            }
            Command::SetSerial(serial) => {
                let answer = self.ask(&Request::SetSerial(serial.clone()), self.patience())?;
                self.expect_done("set serial", &answer)?;
                self.serial = serial;
                Ok(Done::Nothing)
            }
        }
    }

    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let number = self.mark_number + 1;
        let request = Request::Mark { number, mark };
        let answer = match self.ask(&request, self.patience()) {
            Err(e @ DeviceError::Lost { .. }) if self.link.is_some() => {
                // Whether the box counted this mark is unknown: begin the numbers anew.
                self.give_up("a mark was not answered");
                return Err(e);
            }
            other => other?,
        };
        self.expect_done("mark", &answer)?;
        let Some(start) = parse_mark(&answer.reply.answers) else {
            self.give_up("the answer to a mark was not understood");
            return Err(self.misunderstood("the start of a train"));
        };
        self.mark_number = number;
        let own = exchange(&answer);
        let (t, uncertainty_ns) = self.host_from_box.bounds(own, start).middle();
        lock(&self.shared).contradictions = self.host_from_box.contradictions();
        Ok(SentMark {
            mark,
            t,
            uncertainty_ns,
        })
    }

    /// What is due without being asked.
    fn keep_house(&mut self) {
        let now = Instant::now();
        if self.link.is_none() {
            self.redial();
        } else if now >= self.next_exchange {
            self.next_exchange = now + self.config.exchange_interval;
            self.exchange_time();
        } else {
            self.next_events = now + self.config.events_interval;
            self.fetch_events();
        }
        let silent = self.heard.elapsed() > self.config.command_timeout;
        if self.link.is_some() && silent {
            let ms = self.heard.elapsed().as_millis();
            self.give_up(&format!("no answer for {ms} ms"));
        }
    }

    fn exchange_time(&mut self) {
        if let Ok(answer) = self.ask(&Request::Time, self.patience()) {
            let own = exchange(&answer);
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
        let Ok(answer) = self.ask(&Request::Events { from }, self.patience()) else {
            return; // asked again for the same ones soon
        };
        let events = match self.expect_events(&answer) {
            Ok(events) => events,
            Err(fault) => return self.remember(fault),
        };
        if events.dropped != self.dropped {
            let lost = events.dropped.wrapping_sub(self.dropped);
            self.dropped = events.dropped;
            self.fault(
                "telling every event",
                format!(
                    "missing {lost}: its memory was full (is the input wired to a source of noise?)"
                ),
            );
        }
        for event in &events.events {
            self.tell(*event);
        }
        self.next_event = events.first.wrapping_add(events.events.len() as u32);
        if self.next_event != events.next {
            self.next_events = Instant::now();
        }
    }

    fn tell(&mut self, event: Event) {
        let at = event.at.to_box_time();
        let report = match event.kind {
            EventKind::Mark(mark) => BoxReport::Mark { mark, at },
            EventKind::Sync(count) => {
                self.desired.saw_sync(count);
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
        self.remember(self.state(expected, found));
    }

    /// Keeps a fault for the next poll.
    fn remember(&self, fault: DeviceError) {
        lock(&self.shared).remember(fault);
    }

    /// Asks the box, and notices on the way that it was reset or has disarmed itself.
    fn ask(&mut self, request: &Request, patience: Patience) -> Result<Answer, DeviceError> {
        let Some(link) = &mut self.link else {
            let why = lock(&self.shared).down.clone().unwrap_or_default();
            return Err(self.lost(why));
        };
        let answer = match link.ask(request, patience) {
            Ok(answer) => answer,
            Err(e @ LinkError::Gone(_)) => {
                let why = e.to_string();
                self.give_up(&why);
                self.doubtful = None;
                return Err(self.lost(why));
            }
            Err(e @ LinkError::Silent { .. }) => return Err(self.lost(e.to_string())),
        };
        self.heard = Instant::now();
        if answer.reply.boot != self.boot {
            self.give_up("the box was reset");
            return Err(self.lost(format!(
                "the box was reset; its last `{}` may or may not have been carried out",
                request.name()
            )));
        }
        if self.desired.armed && answer.reply.flags.disarmed_by_silence() {
            let restored = self.restore_on_line();
            self.fault(
                "armed",
                format!(
                    "disarmed: it heard nothing from the host for {} ms; armed again",
                    self.config.silence_ms
                ),
            );
            restored?;
        }
        Ok(answer)
    }

    /// The line is of no use until the box has said hello on it again.
    fn give_up(&mut self, why: &str) {
        // Not opened anew if it need not be: that would reset an Arduino.
        self.doubtful = self.link.take();
        self.next_dial = Instant::now();
        lock(&self.shared).down = Some(why.to_owned());
    }

    /// One attempt to hear a hello, on the line that there is or else on a new one.
    fn redial(&mut self) {
        let why = match self.try_line() {
            Ok((link, greeted)) => {
                self.welcome_back(link, &greeted);
                return;
            }
            Err(why) => why,
        };
        self.next_dial = Instant::now() + DIAL_INTERVAL;
        lock(&self.shared).down = Some(why);
    }

    fn try_line(&mut self) -> Result<(Link, Greeted), String> {
        let mut link = match self.doubtful.take() {
            Some(link) => link,
            None => {
                let wire = self.dial.dial().map_err(|e| e.to_string())?;
                self.opened = Instant::now();
                Link::new(wire, self.clock)
            }
        };
        let serial = Some(self.serial.as_str());
        match greet(&mut link, self.dial.target(), serial, GREETING_SLICE) {
            Ok(greeted) => Ok((link, greeted)),
            Err(e) => {
                let why = e.to_string();
                let silent = matches!(e, GreetingError::Link(LinkError::Silent { .. }));
                let last_heard = self.heard.max(self.opened);
                if silent && last_heard.elapsed() < self.config.hello_timeout {
                    self.doubtful = Some(link); // it may still be starting
                }
                Err(why)
            }
        }
    }

    fn welcome_back(&mut self, link: Link, greeted: &Greeted) {
        self.link = Some(link);
        self.heard = Instant::now();
        self.mark_number = 0;
        if greeted.boot != self.boot {
            self.boot = greeted.boot;
            self.next_event = 0;
            self.dropped = 0;
            self.host_from_box.clear();
            lock(&self.shared).resets += 1;
            self.report(BoxReport::Reset {
                noticed: self.clock.now(),
            });
        }
        if let Err(e) = self.restore() {
            self.give_up(&e.to_string());
            return;
        }
        lock(&self.shared).down = None;
    }

    /// Makes the box do what it should be doing.
    fn restore(&mut self) -> Result<(), DeviceError> {
        if self.link.is_none() {
            return self.ask(&Request::Time, self.patience()).map(|_| ());
        }
        self.restore_on_line()
    }

    fn restore_on_line(&mut self) -> Result<(), DeviceError> {
        if !self.desired.armed {
            return Ok(());
        }
        self.desired.pass_over_used_counts(self.config.silence_ms);
        let arm = Request::Arm {
            silence_ms: self.config.silence_ms,
        };
        let sync = Request::Sync {
            period_ms: self.desired.sync_ms,
            first: self.desired.next_sync,
        };
        for request in [arm, sync] {
            let patience = self.patience();
            let Some(link) = &mut self.link else { break };
            let answer = link.ask(&request, patience);
            let answer = answer.map_err(|e| self.lost(e.to_string()))?;
            self.expect_done(request.name(), &answer)?;
        }
        Ok(())
    }

    fn patience(&self) -> Patience {
        Patience {
            per_try: self.config.reply_timeout,
            total: self.config.command_timeout,
        }
    }

    fn expect_events(&self, answer: &Answer) -> Result<Events, DeviceError> {
        self.expect_done("events", answer)?;
        Events::parse(&answer.reply.answers).ok_or_else(|| self.misunderstood("events"))
    }

    fn expect_done(&self, what: &str, answer: &Answer) -> Result<Done, DeviceError> {
        match answer.reply.outcome {
            Outcome::Done => Ok(Done::Nothing),
            Outcome::Busy => Err(self.state("idle", "busy with a train".to_owned())),
            Outcome::NotArmed => Err(self.state("armed", "disarmed".to_owned())),
            Outcome::Armed => Err(self.state("disarmed", "armed".to_owned())),
            Outcome::BadArgument => Err(DeviceError::Refused {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                expected: format!("arguments of `{what}` that the box accepts"),
                found: "others".to_owned(),
            }),
            other => Err(self.lost(format!("answered `{what}` with {other:?}"))),
        }
    }

    fn misunderstood(&self, what: &str) -> DeviceError {
        self.lost(format!(
            "expected {what}, found an answer of another layout"
        ))
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

fn exchange(answer: &Answer) -> Exchange {
    Exchange {
        sent: answer.sent,
        received: answer.received,
        at: answer.reply.at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_train_that_is_told_late_does_not_bring_its_count_back() {
        let mut desired = Desired {
            sync_ms: 100,
            told_sync_ms: 100,
            next_sync: MAX_MARKED_PRESS - 20,
            ..Desired::default()
        };
        desired.pass_over_used_counts(5_000);
        // 50 trains in the silence and 64 more, beyond the 17 bits.
        assert_eq!(desired.next_sync, 93);
        desired.saw_sync(MAX_MARKED_PRESS - 20);
        assert_eq!(desired.next_sync, 93);
        desired.saw_sync(93);
        assert_eq!(desired.next_sync, 94);
    }
}
