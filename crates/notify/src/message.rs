//! A message: text for people and JSON for programs, made once from an event.

use std::path::PathBuf;

use serde_json::{Value, json};
use skinrig_model::Occasion;
use skinrig_model::text::visible;

use crate::event::{Event, Subject};

/// Version of the JSON. It changes when a key changes its meaning or disappears, not when one is added.
pub const JSON_VERSION: u32 = 1;

/// Most characters of a subject line.
const MOST_SUBJECT_CHARS: usize = 200;

/// A message, ready to be sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// The same for all tries and channels; receivers drop duplicates by it.
    pub(crate) id: String,
    /// `None`: a test.
    pub(crate) occasion: Option<Occasion>,
    /// One line.
    pub(crate) subject: String,
    pub(crate) text: String,
    pub(crate) json: Value,
    /// A session that a mail may attach. The text names its path.
    pub(crate) attachment: Option<PathBuf>,
    /// Civil time of the occasion, RFC 3339.
    pub(crate) raised_at: String,
}

impl Message {
    /// The message of `event`, raised at the civil time `raised_at` (RFC 3339) on the computer `host`.
    #[must_use]
    pub fn new(event: &Event<'_>, host: &str, raised_at: &str) -> Self {
        let occasion = event.occasion();
        let word = occasion.map_or("test", Occasion::name);
        let subject = one_line(&format!("skinrig: {}", event.subject()));
        let text = format!(
            "{}\nhost      {host}\ntime      {raised_at}\n",
            event.text()
        );
        let part = |text: &str| -> String {
            let safe = |c: char| c.is_ascii_alphanumeric() || c == '-';
            text.chars()
                .map(|c| if safe(c) { c } else { '-' })
                .collect()
        };
        let id = format!(
            "{}.{}.{word}@{}.skinrig",
            part(raised_at),
            std::process::id(),
            part(host)
        );
        let mut json = json!({
            "skinrig_notification": JSON_VERSION,
            "id": id,
            "occasion": word,
            "raised_at": raised_at,
            "host": host,
            "rig": event.rig,
            "subject": subject,
            "text": text,
        });
        let (key, value) = event.details();
        if let Some(key) = key {
            json[key] = value;
        }
        Self {
            id,
            occasion,
            subject,
            text,
            json,
            attachment: match &event.subject {
                Subject::Night { golden, .. } => golden.map(Into::into),
                Subject::Alarms(raised) => raised.session.map(Into::into),
                Subject::Run(_) | Subject::Test => None,
            },
            raised_at: raised_at.to_owned(),
        }
    }
}

/// `text` as one visible line of limited length.
fn one_line(text: &str) -> String {
    let line: Vec<&str> = text.split_whitespace().collect();
    let line = visible(&line.join(" ")).into_owned();
    if line.chars().count() <= MOST_SUBJECT_CHARS {
        return line;
    }
    let start: String = line.chars().take(MOST_SUBJECT_CHARS - 3).collect();
    start + "..."
}
