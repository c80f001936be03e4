//! Messages about runs: delivered once, recorded without secrets, and never a reason to wait for longer than the grace.

use std::path::PathBuf;

use serde_json::Value;
use skinrig_model::{Notification, NotificationChannel as Channel, NotificationFault, Occasion};
use skinrig_recorder::SessionReader;

use crate::servers::{closed_port, http, silent, smtp};
use crate::support::{Lab, ProgramOutput, SMALL, files, only, program, run_to_end, text};

const SECRET: &str = "correct-horse-battery";
const RIG: &str = include_str!("../../../../hil/rigs/bench.example.yaml");

/// Writes the example rig file with this `notify` into the lab; returns its path.
fn rig_file(lab: &Lab, notify: &str) -> String {
    let path = lab.path("rig.yaml");
    std::fs::write(&path, format!("{RIG}\nnotify:\n{notify}")).unwrap();
    text(&path)
}

fn mail(port: u16) -> String {
    format!(
        "  mail: {{server: 127.0.0.1, port: {port}, security: none, from: bench@example.org, to: [a@example.org], username: bench, password: {{variable: NOTIFY_SECRET}}}}\n"
    )
}

fn webhook(port: u16) -> String {
    format!(
        "  webhook: {{url: \"http://127.0.0.1:{port}/\", token: {{variable: NOTIFY_SECRET}}}}\n"
    )
}

/// Runs the program with the secret in its environment, and without a proxy.
fn skinrig(arguments: &[&str]) -> ProgramOutput {
    let mut command = program(arguments);
    command.env("NOTIFY_SECRET", SECRET);
    for name in ["http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"] {
        command.env_remove(name);
    }
    run_to_end(command)
}

/// Runs the small campaign with these settings and arguments.
fn run(lab: &Lab, notify: &str, more: &[&str]) -> ProgramOutput {
    let (file, sessions) = (rig_file(lab, notify), lab.text("sessions"));
    let mut arguments = vec!["run", SMALL, "--no-analysis", "--sessions", &sessions];
    arguments.extend(["--notify", &file]);
    arguments.extend(more);
    skinrig(&arguments)
}

const FAULT: [&str; 2] = ["--fault", "camera1-unplugged@hold:3"];

fn session(lab: &Lab) -> PathBuf {
    only(&lab.path("sessions"), ".session.sqlite")
}

/// The messages that the session records; it must be sealed and sound.
fn recorded(lab: &Lab) -> Vec<Notification> {
    let session = session(lab);
    crate::support::skinrig(&["verify", &text(&session)]).code(0);
    let reader = SessionReader::open(&session).unwrap();
    assert!(reader.seal().unwrap().is_some());
    reader.notifications().unwrap()
}

#[test]
fn a_faulted_run_tells_each_channel_once_and_records_it_without_secrets() {
    let plain = Lab::new();
    let without = skinrig(
        &[
            &[
                "run",
                SMALL,
                "--no-analysis",
                "--sessions",
                &plain.text("s"),
            ],
            &FAULT[..],
        ]
        .concat(),
    );

    let lab = Lab::new();
    let (mails, hooks) = (smtp(|_| None), http(&[200]));
    let notify = mail(mails.port) + &webhook(hooks.port);
    let output = run(&lab, &notify, &FAULT)
        .code(3)
        .expect_stderr(&["note: mail: fault: sent", "note: webhook: fault: sent"]);
    assert_eq!(output.code, without.code);

    let session = session(&lab);
    let (mails, requests) = (mails.received(), hooks.received());
    assert_eq!((mails.len(), requests.len()), (1, 1));
    let json: Value = serde_json::from_str(&requests[0].body).unwrap();
    assert_eq!(json["occasion"], "fault");
    assert_eq!(json["run"]["session"], text(&session));
    assert_eq!(json["run"]["end"], "faulted");
    assert!(mails[0].data.contains("Subject: skinrig: "));

    let records = recorded(&lab);
    let sent: Vec<_> = records
        .iter()
        .map(|n| (n.channel, n.occasion, n.tries, &n.fault))
        .collect();
    assert_eq!(
        sent,
        [
            (Channel::Mail, Occasion::Fault, 1, &None),
            (Channel::Webhook, Occasion::Fault, 1, &None)
        ]
    );
    let shown = crate::support::show(&session);
    assert_eq!(shown["notifications"].as_array().unwrap().len(), 2);
    for file in files(&lab.path("sessions"), "") {
        let bytes = std::fs::read(&file).unwrap();
        let has = |needle: &str| bytes.windows(needle.len()).any(|w| w == needle.as_bytes());
        assert!(!has(SECRET), "{}", file.display());
    }
    assert!(!format!("{output:?}").contains(SECRET));
}

#[test]
fn a_dead_server_costs_the_grace_and_nothing_else() {
    let lab = Lab::new();
    let (dead, hooks) = (silent(), http(&[200]));
    let notify = format!(
        "{}{}  timeout: 60 s\n  grace: 1 s\n",
        mail(dead.port),
        webhook(hooks.port)
    );
    run(&lab, &notify, &FAULT).code(3).expect_stderr(&[
        "warning: mail: fault: unknown whether it was sent (0 tries): expected a result within the grace of 1 s",
        "note: webhook: fault: sent",
    ]);
    assert_eq!(hooks.received().len(), 1);
    let records = recorded(&lab);
    let over = NotificationFault::GraceOver {
        grace_s: 1,
        last: None,
    };
    assert_eq!((records[0].tries, &records[0].fault), (0, &Some(over)));
    assert_eq!(records[1].fault, None);
}

#[test]
fn an_unreachable_server_does_not_change_a_completed_run() {
    let lab = Lab::new();
    let notify = format!("{}  tries: 2\n  backoff: 0.1 s\n", webhook(closed_port()));
    run(&lab, &notify, &[])
        .code(0)
        .expect_stderr(&["warning: webhook: completed: not sent (2 tries)"]);
    let records = recorded(&lab);
    assert_eq!((records.len(), records[0].tries), (1, 2));
    let fault = records[0].fault.as_ref();
    assert!(matches!(fault, Some(NotificationFault::Unreachable { .. })));
}

#[test]
fn only_chosen_occasions_are_told() {
    let lab = Lab::new();
    let hooks = http(&[200]);
    let notify = format!("{}  on: [fault, stop]\n", webhook(hooks.port));
    run(&lab, &notify, &[]).code(0);
    assert_eq!(recorded(&lab), []);
    assert_eq!(hooks.received(), []);
}

#[test]
fn a_further_leg_tells_of_its_own_end() {
    let lab = Lab::new();
    let hooks = http(&[200]);
    let file = rig_file(&lab, &webhook(hooks.port));
    run(&lab, &webhook(hooks.port), &FAULT).code(3);
    let session = text(&session(&lab));
    let resume = ["resume", &session, "--no-analysis", "--notify", &file];
    skinrig(&resume).code(0);
    let occasions: Vec<Occasion> = recorded(&lab).iter().map(|n| n.occasion).collect();
    assert_eq!(occasions, [Occasion::Fault, Occasion::Completed]);
    assert_eq!(hooks.received().len(), 2);
}

#[test]
fn a_missing_secret_ends_the_command_before_the_run() {
    let lab = Lab::new();
    let notify = webhook(1).replace("NOTIFY_SECRET", "NOTIFY_OTHER");
    run(&lab, &notify, &[]).code(2).expect_stderr(&[
        "rig.yaml: notify.webhook.token: expected a secret in the environment variable NOTIFY_OTHER, found none",
        "next: export NOTIFY_OTHER=",
    ]);
    assert!(files(&lab.path("sessions"), "").is_empty());
    run(&lab, "  command: {run: [/nowhere/notify]}\n", &[])
        .code(2)
        .expect_stderr(&["rig.yaml: notify.command.run: expected a program"]);
    let (rig, sessions) = (lab.text("without.yaml"), lab.text("sessions"));
    std::fs::write(&rig, RIG).unwrap();
    skinrig(&["run", SMALL, "--sessions", &sessions, "--notify", &rig])
        .code(2)
        .expect_stderr(&["expected `notify`, found none"]);
}

#[test]
fn the_doctor_sends_a_test_message() {
    let lab = Lab::new();
    let (mails, hooks) = (smtp(|_| None), http(&[403]));
    let file = rig_file(&lab, &(mail(mails.port) + &webhook(hooks.port)));
    let sessions = lab.text("sessions");
    let output = skinrig(&[
        "doctor",
        "--json",
        "--notify",
        &file,
        "--sessions",
        &sessions,
    ])
    .code(3);
    let findings = output.json()["findings"].as_array().unwrap().clone();
    let verdict = |name: &str| {
        let found = findings
            .iter()
            .find(|f| f["area"] == "notify" && f["check"] == name);
        found.unwrap()["verdict"].clone()
    };
    assert_eq!(
        (verdict("mail"), verdict("webhook")),
        ("ok".into(), "problem".into())
    );
    assert!(mails.received()[0].data.contains("test message"));
    let json: Value = serde_json::from_str(&hooks.received()[0].body).unwrap();
    assert_eq!(json["occasion"], "test");
}
