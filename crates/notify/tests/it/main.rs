//! Messages on real sockets of this computer.
#![expect(clippy::unwrap_used, reason = "tests")]

mod attachments;
mod channels;
mod notifier;
mod servers;
mod support;
