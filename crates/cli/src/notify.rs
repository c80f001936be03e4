//! Messages about runs and nights: opens the channels of a rig file or suite, and reports what was sent.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chrono::{SecondsFormat, Utc};
use skinrig_controller::RunReport;
use skinrig_formats::regular::read_text;
use skinrig_model::{Notification, RunHeader};
use skinrig_notify::{Clock, Delivery, Event, Message, Notifier, Policy, RunEnded, Subject};
use skinrig_protocol::notify::Notify;
use skinrig_protocol::suite::Suite;

use crate::exit::Failure;
use crate::host::host_name;
use crate::rig::{bench, inputs};

/// The clock of this computer.
struct SystemClock;

impl Clock for SystemClock {
    fn civil_time(&self) -> String {
        now()
    }
}

fn now() -> String {
    Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true)
}

/// Opens the channels of `settings`, which are in `file`, before anything else is opened.
///
/// # Errors
/// [`Failure::input`] if a secret or program is missing, or this build lacks what a channel needs.
pub(crate) fn open(settings: &Notify, file: &str) -> Result<Notifier, Failure> {
    with_policy(settings, file, Policy::of(settings))
}

/// Like [`open`], with other limits than those of the settings.
pub(crate) fn with_policy(
    settings: &Notify,
    file: &str,
    policy: Policy,
) -> Result<Notifier, Failure> {
    if let Some(command) = &settings.command {
        let found = inputs::program(&command.run, std::env::var_os("PATH").as_deref());
        found.map_err(|why| {
            Failure::input(format!(
                "{file}: notify.command.run: expected a program that this user may run, found {why}\n  \
                 next: give an existing program, by its path or by a name in PATH"
            ))
        })?;
    }
    let environment = |name: &str| std::env::var(name).ok();
    let channels = skinrig_notify::channels(settings, &environment)
        .map_err(|e| Failure::input(format!("{file}: {e}")))?;
    Notifier::start(&settings.on, channels, policy, Arc::new(SystemClock))
        .map_err(|e| Failure::internal(format!("cannot start a thread for messages: {e}")))
}

/// The `notify` of a rig file or suite.
///
/// # Errors
/// [`Failure::input`] if the file cannot be read, or has none.
pub(crate) fn settings_of(file: &Path) -> Result<Notify, Failure> {
    let bytes = read_text(file)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", file.display())))?;
    let name = file.display().to_string();
    let is_suite = bytes.split(|b| *b == b'\n');
    let is_suite = is_suite
        .into_iter()
        .any(|line| line.starts_with(b"skinrig_suite:"));
    let found = if is_suite {
        Suite::parse(&name, &bytes)
            .map_err(|found| Failure::findings(&found))?
            .notify
    } else {
        bench::load(file)?.notify
    };
    found.ok_or_else(|| {
        Failure::input(format!(
            "{name}: expected `notify`, found none\n  next: add it as hil/rigs/bench.example.yaml shows"
        ))
    })
}

/// Opens the channels for a run: of the file `chosen`, else of the rig file's `notify`.
///
/// # Errors
/// See [`settings_of`] and [`open`].
pub(crate) fn for_run(
    chosen: Option<&Path>,
    rig_file: Option<(&str, Option<&Notify>)>,
) -> Result<Option<Notifier>, Failure> {
    match (chosen, rig_file) {
        (Some(file), _) => open(&settings_of(file)?, &file.display().to_string()).map(Some),
        (None, Some((name, Some(settings)))) => open(settings, name).map(Some),
        (None, _) => Ok(None),
    }
}

/// Messages about the end of a run.
pub(crate) struct RunMessages {
    notifier: Notifier,
    protocol: String,
    prototype: String,
    operator: String,
    rig: String,
}

impl RunMessages {
    /// Messages about the run with this header.
    pub(crate) fn new(notifier: Notifier, header: &RunHeader) -> Self {
        Self {
            notifier,
            protocol: header.protocol_name.clone(),
            prototype: header.prototype.clone(),
            operator: header.operator.clone(),
            rig: header.rig_name.clone(),
        }
    }

    /// Sends the messages about the end of the run and waits for results, at most for the grace.
    pub(crate) fn send(mut self, report: &RunReport, session: &Path) -> Vec<Notification> {
        let session = absolute(session);
        let ended = RunEnded {
            end: &report.end,
            protocol: &self.protocol,
            prototype: &self.prototype,
            operator: &self.operator,
            session: &session,
            presses: [report.planned, report.valid, report.invalid, report.missed],
        };
        post(&mut self.notifier, &self.rig, Subject::Run(ended));
        finish(self.notifier)
    }
}

/// Posts a message about `subject`.
pub(crate) fn post(notifier: &mut Notifier, rig: &str, subject: Subject<'_>) {
    notifier.post(Message::new(&Event { rig, subject }, &host_name(), &now()));
}

/// Waits for the results of what was posted.
pub(crate) fn finish(notifier: Notifier) -> Vec<Notification> {
    let results = notifier.finish();
    results.iter().filter_map(Delivery::notification).collect()
}

/// The line that reports a result.
pub(crate) fn line(notification: &Notification) -> String {
    match notification.fault {
        None => format!("note: {notification}"),
        Some(_) => format!("warning: {notification}"),
    }
}

/// `path` as seen from everywhere on this computer.
pub(crate) fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}
