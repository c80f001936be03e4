//! `notify`: where to send messages about runs and nights, and on which occasions.

use std::path::{Path, PathBuf};

use serde::Serialize;
use skinrig_model::{HostDuration, Occasion};
use skinrig_settings::{Choice, Collector, Field, Settings};

/// Messages about runs and nights.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(name = "notify")]
pub struct Notify {
    /// Occasions. Runs have `fault`, `stop` and `completed`, nights the others.
    #[setting(
        default = "[fault, stop, completed, night_inconclusive, night_fail, night_invalid, night_skipped, trend_alarm]",
        value = default_occasions(),
        items = 1..=10
    )]
    pub on: Vec<Occasion>,
    /// Mail by SMTP.
    #[setting(at_least_one)]
    pub mail: Option<Mail>,
    /// HTTP POST of JSON.
    #[setting(at_least_one)]
    pub webhook: Option<Webhook>,
    /// A program that gets the JSON on its standard input.
    #[setting(at_least_one)]
    pub command: Option<NotifyCommand>,
    /// Longest wait for an answer: of a webhook or a program as a whole, of a mail server at each step.
    #[setting(default = "5 s", value = HostDuration::from_millis(5_000), min = 1, max = 60)]
    pub timeout: HostDuration,
    /// Most tries per message and channel. There is no second try after a final rejection.
    #[setting(default = "3", min = 1, max = 10)]
    pub tries: u32,
    /// Wait before the second try; doubled before each further one.
    #[setting(default = "1 s", value = HostDuration::from_millis(1_000), min = 0.1, max = 60)]
    pub backoff: HostDuration,
    /// How long the end of a run or night waits for results. A message without a result is then reported and recorded as such.
    #[setting(default = "10 s", value = HostDuration::from_millis(10_000), min = 1, max = 60)]
    pub grace: HostDuration,
}

/// Mail by SMTP.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(name = "notify_mail", finish = Self::login_is_safe)]
pub struct Mail {
    /// Host name or address of the mail server.
    #[setting(read = plain, example = "smtp.example.org")]
    pub server: String,
    /// Port of the mail server: usually 587 for `starttls`, 465 for `tls`, 25 for `none`.
    #[setting(min = 1, example = "587")]
    pub port: u16,
    /// Encryption of the connection.
    #[setting(default = "starttls")]
    pub security: MailSecurity,
    /// Sender.
    #[setting(read = address, example = "bench@example.org")]
    pub from: String,
    /// Recipients.
    #[setting(items = 1..=20, read = addresses, example = "[you@example.org]")]
    pub to: Vec<String>,
    /// User name for the login; absent: no login.
    #[setting(read = plain)]
    pub username: Option<String>,
    /// Password for the login.
    pub password: Option<Secret>,
    /// Largest golden session attached to mails about a night; a larger one, and any other session, is named by its path.
    #[setting(default = "10 MB", min = 0, max = 1e8)]
    pub attach_up_to_b: f64,
}

/// Encryption of the connection to a mail server.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum MailSecurity {
    /// Begins unencrypted and must change to TLS.
    Starttls,
    /// TLS from the first byte.
    Tls,
    /// None. A login then needs a server on this computer.
    None,
}

/// HTTP POST of JSON.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(
    name = "notify_webhook",
    exactly_one("url", "secret_url"),
    finish = Self::token_is_safe
)]
pub struct Webhook {
    /// Address; sessions record it.
    #[setting(read = url, example = "https://hooks.example.org/bench")]
    pub url: Option<String>,
    /// Address that is itself a secret.
    pub secret_url: Option<Secret>,
    /// Token, sent as `Authorization: Bearer TOKEN`.
    pub token: Option<Secret>,
}

/// A program that gets the JSON on its standard input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "notify_command")]
pub struct NotifyCommand {
    /// The program and its arguments, without a shell; sessions record them. It must exit with 0 within `timeout`.
    #[setting(items = 1..=20, read = plains, example = "[/usr/local/bin/notify-lab]")]
    pub run: Vec<String>,
}

/// Where a secret is kept. Sessions record the name of the variable or file, never the secret.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "secret", exactly_one("variable", "file"))]
pub struct Secret {
    /// Environment variable with the secret.
    #[setting(read = plain, example = "SKINRIG_MAIL_PASSWORD")]
    pub variable: Option<String>,
    /// File whose first line is the secret, relative to the folder of this file.
    #[setting(example = "mail-password")]
    pub file: Option<PathBuf>,
}

fn default_occasions() -> Vec<Occasion> {
    let quiet = [Occasion::NightPass, Occasion::NightMarginal];
    let all = Occasion::ALL.iter().copied();
    all.filter(|occasion| !quiet.contains(occasion)).collect()
}

impl Notify {
    /// Resolves paths against the folder of the file.
    pub(crate) fn in_folder(&mut self, folder: &Path) {
        let password = self.mail.as_mut().and_then(|mail| mail.password.as_mut());
        let (url, token) = match &mut self.webhook {
            Some(webhook) => (webhook.secret_url.as_mut(), webhook.token.as_mut()),
            None => (None, None),
        };
        for secret in [password, url, token].into_iter().flatten() {
            if let Some(file) = &mut secret.file {
                *file = folder.join(&file);
            }
        }
    }
}

impl Mail {
    fn login_is_safe(self, field: &Field, out: &mut Collector) -> Option<Self> {
        if self.username.is_some() != self.password.is_some() {
            out.error(field.span, field.path.as_str(), "the login is incomplete")
                .expected("both `username` and `password`, or neither")
                .found("only one of them");
        }
        let at = field.at("password");
        if self.password.is_some()
            && self.security == MailSecurity::None
            && !is_this_computer(&self.server)
        {
            let message = "the password would be sent unencrypted";
            out.error(at.span, at.path.as_str(), message)
                .expected("`security: starttls` or `security: tls`")
                .found("`security: none`, and a server on another computer");
        }
        Some(self)
    }
}

impl Webhook {
    fn token_is_safe(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let host = self.url.as_deref().and_then(|url| {
            let rest = url.strip_prefix("http://")?;
            rest.split(['/', '?']).next()
        });
        let host = host.map(|host| match host.rsplit_once(':') {
            Some((name, port)) if port.parse::<u16>().is_ok() => name,
            _ => host,
        });
        if self.token.is_some() && host.is_some_and(|host| !is_this_computer(host)) {
            let at = field.at("token");
            let message = "the token would be sent unencrypted";
            out.error(at.span, at.path.as_str(), message)
                .expected("a `url` that begins with `https://`")
                .found("`http://`, and a server on another computer");
        }
        Some(self)
    }
}

/// Whether a host name or address always means this computer.
#[must_use]
pub fn is_this_computer(host: &str) -> bool {
    let address = host.trim_matches(['[', ']']).parse::<std::net::IpAddr>();
    host == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

/// A text without variables: their values would be recorded.
fn plain(f: &Field, out: &mut Collector) -> Option<String> {
    let text = f.as_text()?;
    if text.contains("${") {
        out.error(f.span, f.path.as_str(), "variables are not replaced here")
            .expected("a text without `${`")
            .found(format!("`{text}`"))
            .help("a secret belongs in `password`, `token` or `secret_url`; a program inherits the environment");
        return None;
    }
    Some(text.to_owned())
}

fn plains(f: &Field, out: &mut Collector) -> Option<Vec<String>> {
    f.items().iter().map(|item| plain(item, out)).collect()
}

/// A mail address: one `@` between a name and a domain, in ASCII without blanks.
fn address(f: &Field, out: &mut Collector) -> Option<String> {
    let text = plain(f, out)?;
    let is_valid = text.split_once('@').is_some_and(|(name, domain)| {
        let wrong = |c: char| !c.is_ascii_graphic() || "<>(),;:\\\"[]@".contains(c);
        let is_bad = |part: &str| {
            part.is_empty()
                || part.contains(wrong)
                || part.starts_with('.')
                || part.ends_with('.')
                || part.contains("..")
        };
        !is_bad(name) && !is_bad(domain)
    });
    if !is_valid {
        out.error(f.span, f.path.as_str(), "this is not a mail address")
            .expected("an address such as `you@example.org`, without a name around it")
            .found(format!("`{text}`"));
        return None;
    }
    Some(text)
}

fn addresses(f: &Field, out: &mut Collector) -> Option<Vec<String>> {
    f.items().iter().map(|item| address(item, out)).collect()
}

/// True for a host, with or without a port.
fn is_server(text: &str) -> bool {
    // An address of IPv6 is in brackets, since it has colons of its own.
    let (host, port) = match text.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, Some(port)),
        _ => (text, None),
    };
    let is_host = !host.is_empty() && (host.starts_with('[') || !host.contains(':'));
    is_host && port.is_none_or(|port| port.parse().is_ok_and(|port: u16| port > 0))
}

/// The address of a webhook, without a password in it.
fn url(f: &Field, out: &mut Collector) -> Option<String> {
    let text = plain(f, out)?;
    let rest = text
        .strip_prefix("https://")
        .or_else(|| text.strip_prefix("http://"));
    let host = rest.and_then(|rest| rest.split(['/', '?', '#']).next());
    let is_plain = text.chars().all(|c| c.is_ascii_graphic());
    let host = host.filter(|host| is_plain && (host.contains('@') || is_server(host)));
    let Some(host) = host else {
        out.error(
            f.span,
            f.path.as_str(),
            "this is not the address of a webhook",
        )
        .expected("an address such as `https://hooks.example.org/bench`")
        .found(format!("`{text}`"));
        return None;
    };
    if host.contains('@') {
        let message = "the address has a password, which would be recorded";
        out.error(f.span, f.path.as_str(), message)
            .expected("an address without `USER:PASSWORD@`")
            .found("one with it")
            .help("use `secret_url` or `token`");
        return None;
    }
    Some(text)
}
