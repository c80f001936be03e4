//! Connects to a mail server in a build without TLS.

use std::time::Duration;

use lettre::transport::smtp::Error;
use lettre::transport::smtp::client::SmtpConnection;
use lettre::transport::smtp::extension::ClientId;
use skinrig_protocol::notify::{Mail, MailSecurity};

use crate::error::OpenError;

/// No encryption.
pub(crate) struct Encryption;

impl Encryption {
    pub(crate) fn of(mail: &Mail) -> Result<Self, OpenError> {
        match mail.security {
            MailSecurity::None => Ok(Self),
            MailSecurity::Starttls | MailSecurity::Tls => Err(OpenError::NeedsTls {
                key: "mail.security",
            }),
        }
    }

    pub(crate) const fn is_none(&self) -> bool {
        true
    }

    /// Connects.
    pub(crate) fn connect(
        &self,
        address: (&str, u16),
        timeout: Duration,
    ) -> Result<Option<SmtpConnection>, Error> {
        let hello = ClientId::default();
        SmtpConnection::connect(address, Some(timeout), &hello, None, None).map(Some)
    }
}
