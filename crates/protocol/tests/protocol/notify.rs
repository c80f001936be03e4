//! `notify` of rig files and suites: values, defaults, and diagnostics with their places.

use std::path::Path;

use skinrig_model::{HostDuration, Occasion};
use skinrig_protocol::Suite;
use skinrig_protocol::notify::{MailSecurity, Notify};
use skinrig_protocol::rig::RigFile;

const RIG: &str = include_str!("../../../../hil/rigs/bench.example.yaml");
const SUITE: &str =
    "skinrig_suite: 1\nname: s\nbudget: 1 min\nchecks: {identity: {differences: {at_most: 0}}}\n";

/// The example's `notify`, which is a comment there.
fn section() -> String {
    let (_, notify) = RIG.split_once("\n# notify:").unwrap();
    let notify = format!("# notify:{notify}");
    let lines = notify.lines().map(|line| line.strip_prefix("# ").unwrap());
    lines.collect::<Vec<_>>().join("\n")
}

/// The example rig file with `notify`.
pub(crate) fn example() -> String {
    format!("{RIG}\n{}\n", section())
}

/// A suite with `notify`.
pub(crate) fn example_suite() -> String {
    format!("{SUITE}{}\n", section())
}

fn rig(text: &str) -> Result<RigFile, String> {
    RigFile::parse("bench/rig.yaml", text.as_bytes(), &|name| {
        (name == "TOKEN").then(|| "a-secret".to_owned())
    })
    .map_err(|found| found.render(false))
}

fn suite(notify: &str) -> Result<Notify, String> {
    let text = format!("{SUITE}{notify}");
    let suite = Suite::parse("suite.yaml", text.as_bytes()).map_err(|found| found.render(false))?;
    Ok(suite.notify.unwrap())
}

#[test]
fn the_example_parses_with_its_comments_removed() {
    let rig = rig(&example()).unwrap_or_else(|e| panic!("{e}"));
    let notify = rig.notify.unwrap();
    let mail = notify.mail.as_ref().unwrap();
    assert_eq!((mail.port, mail.security), (587, MailSecurity::Starttls));
    assert_eq!(mail.attach_up_to_b, 10e6);
    let token = notify.webhook.unwrap().token.unwrap();
    assert_eq!(
        token.file.as_deref(),
        Some(Path::new("bench/webhook-token"))
    );
    assert_eq!(notify.command.unwrap().run, ["/usr/local/bin/notify-lab"]);
}

#[test]
fn an_absent_key_has_the_documented_default() {
    let notify = suite("notify: {command: {run: [x]}}\n").unwrap();
    assert_eq!(
        (notify.timeout, notify.tries, notify.backoff, notify.grace),
        (
            HostDuration::from_millis(5_000),
            3,
            HostDuration::from_millis(1_000),
            HostDuration::from_millis(10_000)
        )
    );
    let quiet = [Occasion::NightPass, Occasion::NightMarginal];
    for occasion in Occasion::ALL {
        assert_eq!(notify.on.contains(occasion), !quiet.contains(occasion));
    }
}

#[test]
fn wrong_settings_are_found_at_their_places() {
    let found = [
        "notify: {}\n",
        "notify: {on: [fault, stop], command: {run: [x]}}\n",
        "notify:\n  on: [night_bad]\n  mail: {server: a, port: 25, from: bench, to: [\"A <a@b>\"], password: hunter2}\n",
        "notify:\n  mail: {server: smtp.example.org, port: 25, security: none, from: a@b, to: [a@b], username: a, password: {variable: P}}\n",
        "notify:\n  mail: {server: a, port: 0, from: a@b, to: [], username: a}\n",
        "notify:\n  webhook: {url: hooks.example.org, token: {}}\n",
        "notify:\n  webhook: {url: \"https://a:b@hooks.example.org\"}\n",
        "notify:\n  webhook: {url: \"https://hooks.example.org/${TOKEN}\"}\n",
        "notify:\n  webhook: {url: \"http://hooks.example.org:80/a\", token: {variable: T}}\n",
        "notify:\n  webhook: {url: \"https://a\", secret_url: {variable: A, file: b}}\n  tries: 0\n  grace: 5 min\n",
    ]
    .map(|text| suite(text).map(|_| ()).unwrap_err());
    insta::assert_snapshot!("wrong-notify", found.join("\n"));
}

#[test]
fn a_login_without_encryption_needs_a_server_on_this_computer() {
    for server in ["localhost", "127.0.0.1", "\"::1\""] {
        let text = format!(
            "notify:\n  mail: {{server: {server}, port: 25, security: none, from: a@b, to: [a@b], username: a, password: {{variable: P}}}}\n  webhook: {{url: \"http://127.0.0.1:1/a\", token: {{variable: T}}}}\n"
        );
        suite(&text).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// A client would take the usual port for one that cannot be.
#[test]
fn a_webhook_has_a_host_and_a_port_that_can_be() {
    let with = |address: &str| suite(&format!("notify:\n  webhook: {{url: \"{address}\"}}\n"));
    for address in [
        "https://hooks.example.org",
        "https://hooks.example.org/bench?a=b:c",
        "http://127.0.0.1:65535/x",
        "http://[::1]:8080/x",
        "http://[::1]/x",
    ] {
        with(address).unwrap_or_else(|e| panic!("{address}: {e}"));
    }
    for address in [
        "http://127.0.0.1:99999/x",
        "http://127.0.0.1:65536",
        "http://127.0.0.1:0/x",
        "http://127.0.0.1:-1/x",
        "http://127.0.0.1:18080x/x",
        "http://127.0.0.1:/x",
        "http://:18080/x",
        "http://[::1]:99999/x",
        "https://",
    ] {
        let refused = with(address).map(|_| ()).unwrap_err();
        assert!(
            refused.contains("address of a webhook"),
            "{address}: {refused}"
        );
    }
}

/// Sessions record the rig file as JSON with the values of its variables: none of them may be a secret.
#[test]
fn the_recorded_rig_file_names_variables_without_their_values() {
    let text = example().replace("SKINRIG_MAIL_PASSWORD", "TOKEN");
    let recorded = serde_json::to_string(&rig(&text).unwrap()).unwrap();
    assert!(recorded.contains("\"variable\":\"TOKEN\""), "{recorded}");
    assert!(!recorded.contains("a-secret"), "{recorded}");
    let with_variable = text.replace("/bench          #", "/${TOKEN} #");
    assert_ne!(with_variable, text);
    assert!(rig(&with_variable).is_err());
}
