//! `skinrig doctor --notify`: sends a test message on every channel.

use std::path::Path;
use std::time::Duration;

use skinrig_notify::{Policy, Subject};

use super::finding::{Finding, check};
use crate::exit::Failure;
use crate::notify;

/// Longer than any single try.
const LONGEST: Duration = Duration::from_secs(300);

/// Sends a test message by the `notify` of `file`, with one try per channel.
///
/// # Errors
/// [`Failure::input`] if the channels cannot be opened.
pub(super) fn findings(file: &Path) -> Result<Vec<Finding>, Failure> {
    let settings = &notify::settings_of(file)?;
    let policy = Policy {
        tries: 1,
        grace: LONGEST,
        ..Policy::of(settings)
    };
    let name = file.display().to_string();
    let mut notifier = notify::with_policy(settings, &name, policy)?;
    notify::post(&mut notifier, &name, Subject::Test);
    let results = notifier.finish().into_iter().map(|result| {
        let check = check(
            "notify",
            result.channel.name(),
            "a test message is accepted",
        );
        match result.fault {
            None => check.ok("accepted; look whether it arrived"),
            Some(fault) => check.problem(
                fault.to_string(),
                format!("correct `notify` of {name}, then repeat this command"),
            ),
        }
    });
    Ok(results.collect())
}
