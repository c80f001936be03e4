//! Settings, messages and a clock without waits.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use skinrig_model::{NotificationFault, RunEnd, RunFault, SinkFault};
use skinrig_notify::{
    Channel, Clock, Delivery, Event, Message, Notifier, OpenError, Pending, Policy, RunEnded,
    Subject, channels,
};
use skinrig_protocol::{Notify, Suite};

pub(crate) const SECRET: &str = "correct-horse-battery";

/// `notify` with these lines, through the reader of suites.
pub(crate) fn settings(lines: &str) -> Notify {
    let text = format!(
        "skinrig_suite: 1\nname: s\nbudget: 1 min\nchecks: {{identity: {{differences: {{at_most: 0}}}}}}\nnotify:\n{lines}"
    );
    let suite = Suite::parse("suite.yaml", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    suite.notify.unwrap()
}

pub(crate) fn mail(port: u16) -> String {
    format!(
        "  mail: {{server: 127.0.0.1, port: {port}, security: none, from: bench@example.org, to: [a@example.org, b@example.org], username: bench, password: {{variable: SECRET}}}}\n"
    )
}

pub(crate) fn webhook(port: u16) -> String {
    format!(
        "  webhook: {{url: \"http://127.0.0.1:{port}/bench?x=1\", token: {{variable: SECRET}}}}\n"
    )
}

pub(crate) fn open(settings: &Notify) -> Result<Vec<Box<dyn Channel>>, OpenError> {
    channels(settings, &|name| {
        (name == "SECRET").then(|| SECRET.to_owned())
    })
}

/// A fault of a run.
pub(crate) fn message() -> Message {
    let end = RunEnd::fault(RunFault::Sink(SinkFault::Rejected(
        "disk full\nat 5 s".into(),
    )));
    let event = Event {
        rig: "bench 1 (emulated)",
        subject: Subject::Run(RunEnded {
            end: &end,
            protocol: "small.yaml",
            prototype: "skin ä",
            operator: "Ann",
            session: Path::new("/data/a.session.sqlite"),
            presses: [10, 4, 1, 5],
        }),
    };
    Message::new(&event, "pc", "2026-01-02T03:04:05Z")
}

/// Records waits instead of waiting.
#[derive(Default)]
pub(crate) struct TestClock {
    pub(crate) waits: Mutex<Vec<Duration>>,
    /// Whether the grace is over at once; otherwise it lasts until every result is there.
    pub(crate) no_grace: bool,
}

impl Clock for TestClock {
    fn civil_time(&self) -> String {
        "2026-01-02T03:04:06Z".to_owned()
    }

    fn back_off(&self, wait: Duration) {
        self.waits.lock().unwrap().push(wait);
    }

    fn wait(&self, pending: &Pending, _: Duration) {
        if !self.no_grace {
            pending.wait_for(Duration::MAX);
        }
    }
}

/// Sends one message on all channels of `settings`; returns the results and the waits between tries.
pub(crate) fn deliver(settings: &Notify) -> (Vec<Delivery>, Vec<Duration>) {
    let clock = Arc::new(TestClock::default());
    let used: Arc<dyn Clock> = clock.clone();
    let channels = open(settings).unwrap();
    let mut notifier = Notifier::start(&settings.on, channels, Policy::of(settings), used).unwrap();
    notifier.post(message());
    let results = notifier.finish();
    let waits = clock.waits.lock().unwrap().clone();
    (results, waits)
}

/// The fault of the only delivery, and its number of tries.
pub(crate) fn fault(settings: &Notify) -> (u32, NotificationFault) {
    let (results, _) = deliver(settings);
    assert_eq!(results.len(), 1);
    (results[0].tries, results[0].fault.clone().unwrap())
}
