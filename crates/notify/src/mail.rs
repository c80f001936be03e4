//! The channel `mail`: SMTP, stage by stage, so that each stage has its own fault.

use std::error::Error as _;
use std::io;
use std::time::Duration;

use lettre::address::Envelope;
use lettre::message::header::ContentType;
use lettre::message::{Attachment, Mailbox, MultiPart, SinglePart};
use lettre::transport::smtp::Error;
use lettre::transport::smtp::authentication::{Credentials, DEFAULT_MECHANISMS};
use lettre::transport::smtp::client::SmtpConnection;
use skinrig_model::{NotificationChannel, NotificationFault};
use skinrig_protocol::notify::Mail;

use crate::attempt::Channel;
use crate::error::OpenError;
use crate::message::Message;
use crate::secret::SecretText;
use crate::smtp::Encryption;

/// A mail server, and the mail's sender and recipients.
pub(crate) struct MailChannel {
    host: String,
    port: u16,
    /// For faults.
    server: String,
    encryption: Encryption,
    credentials: Option<Credentials>,
    from: Mailbox,
    to: Vec<Mailbox>,
    envelope: Envelope,
    attach_up_to_bytes: u64,
    timeout: Duration,
}

impl MailChannel {
    pub(crate) fn open(
        mail: &Mail,
        password: Option<SecretText>,
        timeout: Duration,
    ) -> Result<Self, OpenError> {
        let mailbox = |key: &'static str, text: &str| -> Result<Mailbox, OpenError> {
            text.parse().map_err(|_| OpenError::Address {
                key,
                found: text.to_owned(),
            })
        };
        let from = mailbox("from", &mail.from)?;
        let to = mail.to.iter().map(|to| mailbox("to", to));
        let to = to.collect::<Result<Vec<Mailbox>, _>>()?;
        let recipients = to.iter().map(|to| to.email.clone()).collect();
        let envelope = Envelope::new(Some(from.email.clone()), recipients).map_err(|_| {
            OpenError::Address {
                key: "to",
                found: mail.to.join(", "),
            }
        })?;
        let credentials = mail.username.clone().zip(password);
        Ok(Self {
            host: mail.server.clone(),
            port: mail.port,
            server: format!("{}:{}", mail.server, mail.port),
            encryption: Encryption::of(mail)?,
            credentials: credentials.map(|(name, password)| Credentials::new(name, password.0)),
            from,
            to,
            envelope,
            attach_up_to_bytes: mail.attach_up_to_b as u64,
            timeout,
        })
    }

    /// The mail as sent. The same message has the same id at each try, so that mail programs drop duplicates.
    fn compose(&self, message: &Message) -> Result<Vec<u8>, NotificationFault> {
        let mut mail = lettre::Message::builder()
            .from(self.from.clone())
            .subject(&message.subject)
            .message_id(Some(format!("<{}>", message.id)));
        for to in &self.to {
            mail = mail.to(to.clone());
        }
        let text = SinglePart::plain(message.text.clone());
        let made = match self.attachment(message) {
            None => mail.singlepart(text),
            Some(file) => mail.multipart(MultiPart::mixed().singlepart(text).singlepart(file)),
        };
        let made = made.map_err(|_| NotificationFault::Invalid {
            what: "mail".to_owned(),
        })?;
        Ok(made.formatted())
    }

    /// The session of the message, if it is small enough and can be read; the text names its path in any case.
    fn attachment(&self, message: &Message) -> Option<SinglePart> {
        let path = message.attachment.as_ref()?;
        let size = std::fs::metadata(path).ok()?.len();
        if size > self.attach_up_to_bytes {
            return None;
        }
        let bytes = std::fs::read(path).ok()?;
        let kind = ContentType::parse("application/vnd.sqlite3").ok()?;
        let name = path.file_name()?.to_string_lossy().into_owned();
        Some(Attachment::new(name).body(bytes, kind))
    }

    fn connect(&self) -> Result<SmtpConnection, NotificationFault> {
        let address = (self.host.as_str(), self.port);
        let connected = self.encryption.connect(address, self.timeout);
        connected
            .map_err(|e| self.fault(&e))?
            .ok_or_else(|| NotificationFault::Tls {
                server: self.server.clone(),
            })
    }

    fn log_in(&self, connection: &mut SmtpConnection) -> Result<(), NotificationFault> {
        let Some(credentials) = &self.credentials else {
            return Ok(());
        };
        let refused = |found: String| NotificationFault::Login {
            server: self.server.clone(),
            found,
            check: "`username` and the secret that `password` names".to_owned(),
        };
        match connection.auth(DEFAULT_MECHANISMS, credentials) {
            Ok(_) => Ok(()),
            Err(e) if e.is_permanent() => {
                let code = e.status().map(u16::from).unwrap_or_default();
                Err(refused(format!("code {code}")))
            }
            Err(e) if e.is_client() => Err(refused("no login offered".to_owned())),
            Err(e) => Err(self.fault(&e)),
        }
    }

    /// The fault of a stage other than the login.
    fn fault(&self, error: &Error) -> NotificationFault {
        let server = self.server.clone();
        if let Some(code) = error.status() {
            let code = u16::from(code);
            if error.is_transient() {
                return NotificationFault::Busy { server, code };
            }
            let check = "`from`, `to` and whether the server needs a login".to_owned();
            return NotificationFault::Rejected {
                server,
                code,
                check,
            };
        }
        let is_encrypted = !self.encryption.is_none();
        #[cfg(feature = "tls")]
        if error.is_tls() {
            return NotificationFault::Tls { server };
        }
        let mut source = error.source();
        while let Some(inner) = source {
            if let Some(io) = inner.downcast_ref::<io::Error>() {
                return match io.kind() {
                    io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => {
                        let limit_s = self.timeout.as_secs();
                        NotificationFault::TimedOut { server, limit_s }
                    }
                    io::ErrorKind::InvalidData if is_encrypted => NotificationFault::Tls { server },
                    kind => NotificationFault::Unreachable {
                        server,
                        found: kind.to_string(),
                    },
                };
            }
            source = inner.source();
        }
        NotificationFault::Protocol {
            protocol: "SMTP".to_owned(),
            server,
        }
    }
}

impl Channel for MailChannel {
    fn name(&self) -> NotificationChannel {
        NotificationChannel::Mail
    }

    fn send(&mut self, message: &Message) -> Result<(), NotificationFault> {
        let mail = self.compose(message)?;
        let mut connection = self.connect()?;
        if let Err(fault) = self.log_in(&mut connection) {
            connection.abort();
            return Err(fault);
        }
        let sent = connection.send(&self.envelope, &mail);
        sent.map_err(|e| self.fault(&e))?;
        // The server has the mail, however the connection ends.
        let _ = connection.quit();
        Ok(())
    }
}
