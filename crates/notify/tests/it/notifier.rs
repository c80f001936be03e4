//! Queue, grace and occasions, with channels that a test controls.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use skinrig_model::{NotificationChannel, NotificationFault as Fault, Occasion};
use skinrig_notify::{Channel, Event, Message, Notifier, Policy, Subject};

use crate::support::{TestClock, message};

const POLICY: Policy = Policy {
    tries: 3,
    backoff: Duration::from_secs(1),
    grace: Duration::from_secs(10),
};

/// A channel that waits for permission before each try.
struct Gate {
    entered: Sender<()>,
    open: Receiver<()>,
    sent: Arc<AtomicUsize>,
}

impl Channel for Gate {
    fn name(&self) -> NotificationChannel {
        NotificationChannel::Command
    }

    fn send(&mut self, _: &Message) -> Result<(), Fault> {
        self.entered.send(()).unwrap();
        if self.open.recv().is_ok() {
            self.sent.fetch_add(1, Ordering::SeqCst);
        }
        Ok(())
    }
}

struct Controlled {
    channel: Box<dyn Channel>,
    entered: Receiver<()>,
    open: Sender<()>,
    sent: Arc<AtomicUsize>,
}

fn controlled() -> Controlled {
    let ((entered, was_entered), (open, is_open)) = (channel(), channel());
    let sent = Arc::new(AtomicUsize::new(0));
    let gate = Gate {
        entered,
        open: is_open,
        sent: sent.clone(),
    };
    Controlled {
        channel: Box::new(gate),
        entered: was_entered,
        open,
        sent,
    }
}

fn clock(no_grace: bool) -> Arc<TestClock> {
    Arc::new(TestClock {
        no_grace,
        ..TestClock::default()
    })
}

#[test]
fn a_full_queue_rejects_instead_of_waiting() {
    let gate = controlled();
    let on = [Occasion::Fault];
    let mut notifier = Notifier::start(&on, vec![gate.channel], POLICY, clock(false)).unwrap();
    notifier.post(message());
    // The thread holds the first message: the queue is empty, and has room for 8.
    gate.entered.recv().unwrap();
    for _ in 0..10 {
        notifier.post(message());
    }
    for _ in 0..9 {
        gate.open.send(()).unwrap();
    }
    let results = notifier.finish();
    assert_eq!(results.len(), 11);
    assert_eq!(gate.sent.load(Ordering::SeqCst), 9);
    assert!(results[..9].iter().all(|r| r.fault.is_none()));
    let full = Some(Fault::QueueFull { limit: 8 });
    assert!(results[9..].iter().all(|r| r.fault == full && r.tries == 0));
}

#[test]
fn a_message_without_result_at_the_end_of_the_grace_is_reported_as_such() {
    let (dead, good) = (controlled(), controlled());
    let on = [Occasion::Fault];
    let channels = vec![dead.channel, good.channel];
    let mut notifier = Notifier::start(&on, channels, POLICY, clock(true)).unwrap();
    notifier.post(message());
    dead.entered.recv().unwrap();
    good.entered.recv().unwrap();
    let results = notifier.finish();
    let over = Some(Fault::GraceOver {
        grace_s: 10,
        last: None,
    });
    assert_eq!(results.len(), 2);
    assert!(results.iter().all(|r| r.fault == over));
    let record = results[0].notification().unwrap();
    assert_eq!(record.occasion, Occasion::Fault);
    assert_eq!(
        record.to_string(),
        "command: fault: unknown whether it was sent (0 tries): expected a result within the grace of 10 s, found none; check the server, or raise `notify.grace`"
    );
}

/// After the grace, no further try begins.
#[test]
fn nothing_is_tried_after_the_end() {
    let gate = controlled();
    let on = [Occasion::Fault];
    let mut notifier = Notifier::start(&on, vec![gate.channel], POLICY, clock(true)).unwrap();
    notifier.post(message());
    notifier.post(message());
    gate.entered.recv().unwrap();
    drop(notifier.finish());
    gate.open.send(()).unwrap();
    // The thread ends, and drops its channel, without a second message.
    assert!(gate.entered.recv().is_err());
}

#[test]
fn only_chosen_occasions_are_sent_and_tests_always() {
    let gate = controlled();
    let on = [Occasion::Completed];
    let mut notifier = Notifier::start(&on, vec![gate.channel], POLICY, clock(false)).unwrap();
    notifier.post(message());
    let test = Event {
        rig: "bench",
        subject: Subject::Test,
    };
    gate.open.send(()).unwrap();
    notifier.post(Message::new(&test, "pc", "2026-01-02T03:04:05Z"));
    let results = notifier.finish();
    assert_eq!(results.len(), 1);
    assert_eq!(results[0].fault, None);
    assert_eq!(results[0].notification(), None);
}

/// A channel whose first try fails and whose second one does not end before the grace.
struct Failing {
    gate: Gate,
    tries: u32,
}

impl Channel for Failing {
    fn name(&self) -> NotificationChannel {
        NotificationChannel::Webhook
    }

    fn send(&mut self, message: &Message) -> Result<(), Fault> {
        self.tries += 1;
        if self.tries == 1 {
            return Err(busy());
        }
        self.gate.send(message)
    }
}

fn busy() -> Fault {
    Fault::Busy {
        server: "hooks.example.org:443".to_owned(),
        code: 503,
    }
}

#[test]
fn a_result_after_the_grace_still_counts_the_tries_that_ended() {
    let ((entered, was_entered), (open, is_open)) = (channel(), channel());
    let gate = Gate {
        entered,
        open: is_open,
        sent: Arc::default(),
    };
    let failing = Box::new(Failing { gate, tries: 0 });
    let on = [Occasion::Fault];
    let mut notifier = Notifier::start(&on, vec![failing], POLICY, clock(true)).unwrap();
    notifier.post(message());
    was_entered.recv().unwrap();
    let results = notifier.finish();
    open.send(()).unwrap();
    let last = Some(Box::new(busy()));
    let over = Fault::GraceOver { grace_s: 10, last };
    assert_eq!((results[0].tries, &results[0].fault), (1, &Some(over)));
}
