//! Opens the channels of settings: reads their secrets, and rejects what this build or the settings cannot do.

use std::io;
use std::path::PathBuf;

use skinrig_protocol::notify::{Notify, Webhook, is_this_computer};
use ureq::http::Uri;

use crate::attempt::Channel;
use crate::command::Command;
use crate::mail::MailChannel;
use crate::notifier::duration;
use crate::secret;
use crate::webhook::WebhookChannel;

/// Why the channels could not be opened. Nothing was sent.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// A variable is missing.
    #[error(
        "notify.{key}: expected a secret in the environment variable {name}, found none\n  next: export {name}=..."
    )]
    Variable {
        /// Key of the secret.
        key: &'static str,
        /// Name of the variable.
        name: String,
    },
    /// A file cannot be read.
    #[error(
        "notify.{key}: expected a file with the secret, found {}: {source}\n  next: write the secret into this file, readable by you alone", path.display()
    )]
    File {
        /// Key of the secret.
        key: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A file has no secret.
    #[error(
        "notify.{key}: expected the secret in the first line of {}, found an empty line\n  next: write it there", path.display()
    )]
    EmptyFile {
        /// Key of the secret.
        key: &'static str,
        /// Path of the file.
        path: PathBuf,
    },
    /// This build has no TLS.
    #[error(
        "notify.{key}: expected a build of skinrig with TLS, found one without\n  \
         next: cargo build --release -p skinrig --features tls, or use `notify.command`"
    )]
    NeedsTls {
        /// Key that needs it.
        key: &'static str,
    },
    /// The secret address is not one.
    #[error(
        "notify.webhook.secret_url: expected an address that begins with `https://`, or with `http://` for a server on this \
         computer, found something else\n  next: correct the variable or file"
    )]
    SecretUrl,
    /// The token cannot be in a header.
    #[error(
        "notify.webhook.token: expected printable ASCII, found other characters\n  next: correct the variable or file"
    )]
    Token,
    /// A mail address or server name cannot be used.
    #[error("notify.mail.{key}: expected a valid address, found `{found}`\n  next: correct it")]
    Address {
        /// Key of the address.
        key: &'static str,
        /// As in the settings.
        found: String,
    },
}

/// The channels of `settings`, with their secrets.
///
/// # Errors
/// [`OpenError`] for the first channel that cannot be used.
pub fn channels(
    settings: &Notify,
    environment: &dyn Fn(&str) -> Option<String>,
) -> Result<Vec<Box<dyn Channel>>, OpenError> {
    let has_tls = cfg!(feature = "tls");
    let timeout = duration(settings.timeout);
    let mut channels: Vec<Box<dyn Channel>> = Vec::new();
    if let Some(mail) = &settings.mail {
        let password = mail.password.as_ref();
        let password = password
            .map(|at| secret::read(at, "mail.password", environment))
            .transpose()?;
        channels.push(Box::new(MailChannel::open(mail, password, timeout)?));
    }
    if let Some(webhook) = &settings.webhook {
        let uri = uri(webhook, environment)?;
        if uri.scheme_str() == Some("https") && !has_tls {
            let key = match webhook.url {
                Some(_) => "webhook.url",
                None => "webhook.secret_url",
            };
            return Err(OpenError::NeedsTls { key });
        }
        let token = webhook.token.as_ref();
        let token = token
            .map(|at| secret::read(at, "webhook.token", environment))
            .transpose()?;
        channels.push(Box::new(WebhookChannel::open(uri, token, timeout)?));
    }
    if let Some(command) = &settings.command {
        channels.push(Box::new(Command::new(command.run.clone(), timeout)));
    }
    Ok(channels)
}

/// The address of the webhook. A secret one is encrypted, or stays on this computer.
fn uri(webhook: &Webhook, environment: &dyn Fn(&str) -> Option<String>) -> Result<Uri, OpenError> {
    let text = match (&webhook.url, &webhook.secret_url) {
        (Some(url), _) => url.clone(),
        (None, Some(at)) => secret::read(at, "webhook.secret_url", environment)?.0,
        (None, None) => return Err(OpenError::SecretUrl),
    };
    let uri: Uri = text.parse().map_err(|_| OpenError::SecretUrl)?;
    let host = uri.host().filter(|host| !host.is_empty());
    match (uri.scheme_str(), host) {
        (Some("https"), Some(_)) => Ok(uri),
        (Some("http"), Some(host)) if webhook.url.is_some() || is_this_computer(host) => Ok(uri),
        _ => Err(OpenError::SecretUrl),
    }
}
