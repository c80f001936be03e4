//! Opens the channels of settings: reads their secrets, and rejects what this build or the settings cannot do.

use skinrig_protocol::notify::{Notify, Webhook, is_this_computer};
use ureq::http::Uri;

use crate::attempt::Channel;
use crate::command::Command;
use crate::error::OpenError;
use crate::mail::MailChannel;
use crate::policy::duration;
use crate::secret;
use crate::webhook::WebhookChannel;

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
    let wrong = || match &webhook.url {
        Some(_) => OpenError::Url,
        None => OpenError::SecretUrl,
    };
    let uri: Uri = text.parse().map_err(|_| wrong())?;
    let host = uri
        .host()
        .filter(|host| !host.is_empty() && has_valid_port(&uri));
    match (uri.scheme_str(), host) {
        (Some("https"), Some(_)) => Ok(uri),
        (Some("http"), Some(host)) if webhook.url.is_some() || is_this_computer(host) => Ok(uri),
        _ => Err(wrong()),
    }
}

/// False for a port beyond 65535, or one that is no number: the client would use that of the scheme.
fn has_valid_port(uri: &Uri) -> bool {
    let authority = uri.authority().map_or("", |authority| authority.as_str());
    let server = authority.rsplit('@').next().unwrap_or_default();
    let after_host = server.rsplit(']').next().unwrap_or_default();
    !after_host.contains(':') || uri.port_u16().is_some_and(|port| port > 0)
}
