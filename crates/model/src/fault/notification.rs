//! Why a message was not sent.

use serde::{Deserialize, Serialize};

/// Why a message was not sent. Names servers, programs and variables, never their secrets, and repeats no text of a server.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum NotificationFault {
    /// No connection.
    #[error(
        "expected {server} to accept a connection, found: {found}; check the address and the network of this computer"
    )]
    Unreachable {
        /// Host and port.
        server: String,
        /// Error of the operating system.
        found: String,
    },
    /// No answer in time.
    #[error(
        "expected an answer of {server} within {limit_s} s, found none; check the server, or raise `notify.timeout`"
    )]
    TimedOut {
        /// Host and port.
        server: String,
        /// `notify.timeout`, s.
        limit_s: u64,
    },
    /// TLS failed: certificate, name, or no TLS on this port.
    #[error(
        "expected TLS with a valid certificate from {server}, found none; check the port, `security` and the certificate's name and date"
    )]
    Tls {
        /// Host and port.
        server: String,
    },
    /// The server rejected user name or password.
    #[error("expected {server} to accept the login, found {found}; check {check}")]
    Login {
        /// Host and port.
        server: String,
        /// Reply code, or that it offers no login.
        found: String,
        /// The keys to check.
        check: String,
    },
    /// The server rejected the message for good.
    #[error("expected {server} to accept the message, found code {code}; check {check}")]
    Rejected {
        /// Host and port.
        server: String,
        /// Reply code.
        code: u16,
        /// The keys to check.
        check: String,
    },
    /// The server asks to try again later.
    #[error(
        "expected {server} to accept the message, found code {code} (try again later) each time"
    )]
    Busy {
        /// Host and port.
        server: String,
        /// Reply code.
        code: u16,
    },
    /// The answer is not of this protocol.
    #[error("expected {protocol} from {server}, found something else; check the port")]
    Protocol {
        /// `SMTP` or `HTTP`.
        protocol: String,
        /// Host and port.
        server: String,
    },
    /// The program could not be started.
    #[error("expected to start `{program}`, found: {found}; correct `notify.command.run`")]
    NotStarted {
        /// The program.
        program: String,
        /// Error of the operating system.
        found: String,
    },
    /// The program failed.
    #[error(
        "expected `{program}` to exit with 0, found {found}; run it by hand with the JSON on its standard input"
    )]
    Exit {
        /// The program.
        program: String,
        /// Exit code or signal.
        found: String,
    },
    /// The program ran too long and was ended.
    #[error(
        "expected `{program}` to exit within {limit_s} s, and ended it; make it faster, or raise `notify.timeout`"
    )]
    Slow {
        /// The program.
        program: String,
        /// `notify.timeout`, s.
        limit_s: u64,
    },
    /// The message could not be made.
    #[error("expected a valid {what}, found one that cannot be sent; correct it")]
    Invalid {
        /// Which part.
        what: String,
    },
    /// The grace was over before the last try ended: unknown whether the message was sent.
    #[error(
        "expected a result within the grace of {grace_s} s, found none; check the server, or raise `notify.grace`{}", last_try(.last)
    )]
    GraceOver {
        /// `notify.grace`, s.
        grace_s: u64,
        /// Fault of the last try that ended, if any.
        last: Option<Box<NotificationFault>>,
    },
    /// Too many messages waited for this channel.
    #[error("expected at most {limit} waiting messages, found more; check why the channel is slow")]
    QueueFull {
        /// Room of the queue.
        limit: u32,
    },
}

impl NotificationFault {
    /// Whether another try may succeed.
    #[must_use]
    pub const fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Unreachable { .. }
                | Self::TimedOut { .. }
                | Self::Busy { .. }
                | Self::Exit { .. }
                | Self::Slow { .. }
        )
    }
}

fn last_try(last: &Option<Box<NotificationFault>>) -> String {
    let last = last.as_ref().map(|fault| format!("; last try: {fault}"));
    last.unwrap_or_default()
}
