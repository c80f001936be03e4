//! Messages about runs and nights, sent by mail, webhook or command without delaying a run.
//!
//! Each [`Event`] becomes one [`Message`]. A [`Notifier`] has one thread and one bounded queue per channel, tries each message a
//! limited number of times, and waits for results at the end for a limited time. Every result is a record without secrets.

mod attempt;
mod clock;
mod command;
mod error;
mod event;
mod mail;
mod message;
mod notifier;
mod open;
mod policy;
mod secret;
#[cfg(feature = "tls")]
mod smtp;
#[cfg(not(feature = "tls"))]
#[path = "smtp_plain.rs"]
mod smtp;
#[cfg(feature = "tls")]
mod tls;
mod webhook;

pub use attempt::Channel;
pub use clock::{Clock, Pending};
pub use error::OpenError;
pub use event::{Event, RaisedAlarms, RunEnded, Subject};
pub use message::{JSON_VERSION, Message};
pub use notifier::{Delivery, Notifier};
pub use open::channels;
pub use policy::Policy;
