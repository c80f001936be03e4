//! Connects to a mail server with the encryption of the settings.

use std::time::Duration;

use lettre::transport::smtp::Error;
use lettre::transport::smtp::client::{SmtpConnection, TlsParameters};
use lettre::transport::smtp::extension::ClientId;
use skinrig_protocol::notify::{Mail, MailSecurity};

use crate::error::OpenError;

/// Encryption of the connection.
pub(crate) enum Encryption {
    None,
    /// Begins unencrypted.
    Starttls(TlsParameters),
    /// From the first byte.
    Tls(TlsParameters),
}

impl Encryption {
    pub(crate) fn of(mail: &Mail) -> Result<Self, OpenError> {
        let parameters = || {
            TlsParameters::new_rustls(mail.server.clone()).map_err(|_| OpenError::Address {
                key: "server",
                found: mail.server.clone(),
            })
        };
        Ok(match mail.security {
            MailSecurity::None => Self::None,
            MailSecurity::Starttls => Self::Starttls(parameters()?),
            MailSecurity::Tls => Self::Tls(parameters()?),
        })
    }

    pub(crate) const fn is_none(&self) -> bool {
        matches!(self, Self::None)
    }

    /// Connects; `None` if the server does not offer TLS.
    pub(crate) fn connect(
        &self,
        address: (&str, u16),
        timeout: Duration,
    ) -> Result<Option<SmtpConnection>, Error> {
        let hello = ClientId::default();
        let at_once = match self {
            Self::Tls(parameters) => Some(parameters),
            Self::None | Self::Starttls(_) => None,
        };
        let mut connection =
            SmtpConnection::connect(address, Some(timeout), &hello, at_once, None)?;
        if let Self::Starttls(parameters) = self {
            if !connection.can_starttls() {
                connection.abort();
                return Ok(None);
            }
            connection.starttls(parameters, &hello)?;
        }
        Ok(Some(connection))
    }
}
