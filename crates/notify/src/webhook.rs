//! The channel `webhook`: HTTP POST of the JSON.

use std::io;
use std::time::Duration;

use skinrig_model::{NotificationChannel, NotificationFault};
use ureq::http::{HeaderValue, Uri};
use ureq::{Agent, Error};

use crate::attempt::Channel;
use crate::error::OpenError;
use crate::message::Message;
use crate::secret::SecretText;

/// A webhook.
pub(crate) struct WebhookChannel {
    agent: Agent,
    uri: Uri,
    /// Host and port, for faults.
    server: String,
    authorization: Option<HeaderValue>,
    timeout: Duration,
}

impl WebhookChannel {
    pub(crate) fn open(
        uri: Uri,
        token: Option<SecretText>,
        timeout: Duration,
    ) -> Result<Self, OpenError> {
        let authorization = token.map(|token| {
            let mut value = HeaderValue::try_from(format!("Bearer {}", token.0))
                .map_err(|_| OpenError::Token)?;
            value.set_sensitive(true);
            Ok(value)
        });
        let port = uri.port_u16().unwrap_or(match uri.scheme_str() {
            Some("https") => 443,
            _ => 80,
        });
        let config = Agent::config_builder()
            .timeout_global(Some(timeout))
            .http_status_as_error(false)
            // A redirected POST would lose its body or show the token to another server.
            .max_redirects(0)
            .max_redirects_will_error(false);
        #[cfg(feature = "tls")]
        let config = config.tls_config(crate::tls::of_this_computer());
        Ok(Self {
            agent: config.build().into(),
            server: format!("{}:{port}", uri.host().unwrap_or_default()),
            authorization: authorization.transpose()?,
            uri,
            timeout,
        })
    }

    fn fault(&self, error: &Error) -> NotificationFault {
        let server = self.server.clone();
        let unreachable = |found: &str| NotificationFault::Unreachable {
            server: server.clone(),
            found: found.to_owned(),
        };
        let timed_out = || NotificationFault::TimedOut {
            server: server.clone(),
            limit_s: self.timeout.as_secs(),
        };
        let is_https = self.uri.scheme_str() == Some("https");
        match error {
            Error::Timeout(_) => timed_out(),
            Error::HostNotFound => unreachable("no such host"),
            Error::ConnectionFailed => unreachable("no address of the host answers"),
            Error::Io(e) => match e.kind() {
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => timed_out(),
                io::ErrorKind::InvalidData if is_https => NotificationFault::Tls { server },
                kind => unreachable(&kind.to_string()),
            },
            Error::Tls(_) | Error::TlsRequired => NotificationFault::Tls { server },
            #[cfg(feature = "tls")]
            Error::Rustls(_) => NotificationFault::Tls { server },
            Error::Http(_) | Error::BadUri(_) => NotificationFault::Invalid {
                what: "address of the webhook".to_owned(),
            },
            _ => NotificationFault::Protocol {
                protocol: "HTTP".to_owned(),
                server,
            },
        }
    }
}

impl Channel for WebhookChannel {
    fn name(&self) -> NotificationChannel {
        NotificationChannel::Webhook
    }

    fn send(&mut self, message: &Message) -> Result<(), NotificationFault> {
        let mut request = self
            .agent
            .post(&self.uri)
            .content_type("application/json; charset=utf-8");
        if let Some(value) = &self.authorization {
            request = request.header("Authorization", value);
        }
        let answer = request.send(message.json.to_string());
        let code = answer.map_err(|e| self.fault(&e))?.status().as_u16();
        let server = self.server.clone();
        match code {
            200..=299 => Ok(()),
            401 | 403 => Err(NotificationFault::Login {
                server,
                found: format!("code {code}"),
                check: "the secret that `token` or `secret_url` names".to_owned(),
            }),
            408 | 429 | 500..=599 => Err(NotificationFault::Busy { server, code }),
            _ => Err(NotificationFault::Rejected {
                server,
                code,
                check: "`url` or `secret_url`".to_owned(),
            }),
        }
    }
}
