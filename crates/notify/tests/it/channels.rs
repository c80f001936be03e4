//! Each channel: what its receiver gets, and its faults.

use skinrig_model::NotificationFault as Fault;

use crate::servers::{closed_port, http, silent, smtp};
use crate::support::{SECRET, deliver, fault, mail, open, settings, webhook};

#[test]
fn a_mail_arrives_once_with_its_text() {
    let server = smtp(|_| None);
    let (results, waits) = deliver(&settings(&mail(server.port)));
    assert_eq!((results[0].tries, &results[0].fault), (1, &None));
    assert!(waits.is_empty());
    let received = server.received();
    let [mail] = received.as_slice() else {
        panic!("{received:?}")
    };
    let has = |line: &str| mail.commands.iter().any(|c| c.starts_with(line));
    for command in [
        "AUTH PLAIN ",
        "MAIL FROM:<bench@example.org>",
        "RCPT TO:<a@example.org>",
        "RCPT TO:<b@example.org>",
    ] {
        assert!(has(command), "{command}: {:?}", mail.commands);
    }
    for part in [
        "Subject: skinrig: small.yaml faulted on bench 1 (emulated)",
        "Message-ID: <2026-01-02T03-04-05Z.",
        "/data/a.session.sqlite",
        "4 of 10 valid, 1 invalid, 5 missed",
        "disk full",
    ] {
        assert!(mail.data.contains(part), "{part}: {}", mail.data);
    }
    assert!(!mail.data.contains(SECRET));
}

#[test]
fn a_webhook_gets_versioned_json_once() {
    let server = http(&[204]);
    let (results, _) = deliver(&settings(&webhook(server.port)));
    assert_eq!((results[0].tries, &results[0].fault), (1, &None));
    let received = server.received();
    let [request] = received.as_slice() else {
        panic!("{received:?}")
    };
    assert!(request.head.starts_with("POST /bench?x=1 HTTP/1.1\r\n"));
    let head = request.head.to_lowercase();
    assert!(head.contains("content-type: application/json; charset=utf-8\r\n"));
    assert!(head.contains(&format!("authorization: bearer {SECRET}\r\n")));
    let json: serde_json::Value = serde_json::from_str(&request.body).unwrap();
    assert_eq!(json["skinrig_notification"], 1);
    assert_eq!(json["occasion"], "fault");
    assert_eq!(json["run"]["prototype"], "skin ä");
    assert_eq!(json["run"]["session"], "/data/a.session.sqlite");
    assert_eq!(
        json["run"]["cause"][0]["recorder"]["rejected"],
        "disk full\nat 5 s"
    );
    assert!(!json["subject"].as_str().unwrap().contains('\n'));
}

#[cfg(unix)]
#[test]
fn a_command_gets_the_json_and_its_exit_code_counts() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("got.json");
    let command = |script: &str| {
        settings(&format!(
            "  command: {{run: [sh, -c, '{script}', sh, {}]}}\n",
            file.display()
        ))
    };
    let (results, _) = deliver(&command("cat > \"$1\""));
    assert_eq!(results[0].fault, None);
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(json["run"]["valid"], 4);
    // A program that leaves its input unread succeeds too.
    assert_eq!(deliver(&command("exit 0")).0[0].fault, None);
    let (tries, failed) = fault(&command("exit 7"));
    assert!(
        matches!(&failed, Fault::Exit { program, found } if program == "sh" && found.contains('7')),
        "{failed:?}"
    );
    assert_eq!(tries, 3);
    let (tries, failed) = fault(&settings("  command: {run: [/nowhere/notify]}\n"));
    assert!(matches!(failed, Fault::NotStarted { .. }), "{failed:?}");
    assert_eq!(tries, 1);
    let slow = "  command: {run: [sleep, \"600\"]}\n  timeout: 1 s\n  tries: 1\n";
    let (_, failed) = fault(&settings(slow));
    assert!(
        matches!(failed, Fault::Slow { limit_s: 1, .. }),
        "{failed:?}"
    );
    // What a slow program has started ends with it.
    let script = "sleep 600 & echo $! > \"$1\"; wait";
    let (_, failed) = fault(&settings(&format!(
        "  command: {{run: [sh, -c, '{script}', sh, {}]}}\n  timeout: 1 s\n  tries: 1\n",
        file.display()
    )));
    assert!(
        matches!(failed, Fault::Slow { limit_s: 1, .. }),
        "{failed:?}"
    );
    let started = std::fs::read_to_string(&file).unwrap();
    let stat = format!("/proc/{}/stat", started.trim());
    // Gone, or a zombie whose new parent has not looked after it yet; killed, it is so once it gets the processor.
    let is_over = || std::fs::read_to_string(&stat).map_or(true, |line| line.contains(") Z "));
    let until = std::time::Instant::now() + std::time::Duration::from_secs(60);
    while !is_over() {
        assert!(std::time::Instant::now() < until, "still runs");
        std::thread::yield_now();
    }
}

#[test]
fn a_fault_has_its_type_and_only_a_passing_one_is_tried_again() {
    let code = |command: &'static str, reply: &'static str| {
        mail(smtp(move |line| line.starts_with(command).then_some(reply)).port)
    };
    let of_mail = |port: u16| format!("127.0.0.1:{port}");
    for (lines, tries, expected) in [
        (code("AUTH", "535 no"), 1, "code 535; check `username`"),
        (code("EHLO", "250 test"), 1, "no login offered"),
        (
            code("RCPT", "550 unknown"),
            1,
            "found code 550; check `from`, `to`",
        ),
        (code("MAIL", "451 later"), 3, "code 451 (try again later)"),
        (code(".", "452 full"), 3, "code 452"),
        (code("EHLO", "what?"), 1, "expected SMTP"),
        (webhook(http(&[401]).port), 1, "code 401; check the secret"),
        (webhook(http(&[404]).port), 1, "code 404; check `url`"),
        (webhook(http(&[302]).port), 1, "code 302"),
        (webhook(http(&[503]).port), 3, "code 503 (try again later)"),
        (webhook(http(&[429]).port), 3, "code 429"),
        (webhook(smtp(|_| Some("500 what")).port), 1, "expected HTTP"),
        (webhook(closed_port()), 3, "connection refused"),
        (mail(closed_port()), 3, "connection refused"),
    ] {
        let (found, fault) = fault(&settings(&lines));
        let text = fault.to_string();
        assert!(text.contains(expected), "{expected}: {text}");
        assert!(text.contains(&of_mail(0)[..10]), "{text}");
        assert!(
            !text.contains(SECRET) && !text.contains("bench?x"),
            "{text}"
        );
        assert_eq!(found, tries, "{text}");
    }
    for lines in [mail(silent().port), webhook(silent().port)] {
        let lines = format!("{lines}  timeout: 1 s\n  tries: 1\n");
        let (_, fault) = fault(&settings(&lines));
        assert!(
            matches!(fault, Fault::TimedOut { limit_s: 1, .. }),
            "{fault:?}"
        );
    }
}

#[test]
fn a_message_is_sent_when_the_receiver_recovers() {
    let server = http(&[503, 503, 200]);
    let lines = format!("{}  backoff: 2 s\n", webhook(server.port));
    let (results, waits) = deliver(&settings(&lines));
    assert_eq!((results[0].tries, &results[0].fault), (3, &None));
    let waits: Vec<u64> = waits.iter().map(std::time::Duration::as_secs).collect();
    assert_eq!(waits, [2, 4]);
    let ids: Vec<String> = server
        .received()
        .iter()
        .map(|request| {
            let json: serde_json::Value = serde_json::from_str(&request.body).unwrap();
            json["id"].as_str().unwrap().to_owned()
        })
        .collect();
    assert_eq!(ids.len(), 3);
    assert!(ids.iter().all(|id| *id == ids[0]), "{ids:?}");
}

#[test]
fn secrets_are_checked_before_anything_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("secret");
    let with = |secret: &str| {
        let lines = mail(25).replace("{variable: SECRET}", secret);
        open(&settings(&lines))
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    let of_file = format!("{{file: {}}}", file.display());
    let error = with("{variable: OTHER}").unwrap_err();
    assert!(
        error.contains("notify.mail.password") && error.contains("export OTHER="),
        "{error}"
    );
    assert!(
        with(&of_file)
            .unwrap_err()
            .contains("readable by you alone")
    );
    std::fs::write(&file, "\n").unwrap();
    assert!(with(&of_file).unwrap_err().contains("empty line"));
    std::fs::write(&file, format!("{SECRET}\nmore\n")).unwrap();
    with(&of_file).unwrap();
    for wrong in [
        "hooks.example.org",
        "http://hooks.example.org/",
        "https://",
        "https://hooks.example.org:99999/",
        "https://hooks.example.org:1x/",
        "http://127.0.0.1:0/",
        "https://[::1]:99999/",
    ] {
        std::fs::write(&file, wrong).unwrap();
        let lines = format!("  webhook: {{secret_url: {of_file}}}\n");
        let error = open(&settings(&lines)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("secret_url"), "{error}");
        assert!(!error.contains("hooks"), "{error}");
    }
    let server = http(&[200]);
    std::fs::write(&file, format!("http://127.0.0.1:{}/{SECRET}", server.port)).unwrap();
    let lines = format!("  webhook: {{secret_url: {of_file}}}\n");
    assert_eq!(deliver(&settings(&lines)).0[0].fault, None);
    assert!(server.received()[0].head.contains(SECRET));
}

#[cfg(not(feature = "tls"))]
#[test]
fn a_build_without_tls_says_so_before_anything_is_sent() {
    for lines in [
        mail(587).replace("security: none", "security: starttls"),
        mail(465).replace("security: none", "security: tls"),
        "  webhook: {url: \"https://hooks.example.org/\"}\n".to_owned(),
    ] {
        let error = open(&settings(&lines)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("--features tls"), "{error}");
    }
}

#[cfg(feature = "tls")]
#[test]
fn a_server_without_valid_tls_is_a_fault_of_tls() {
    let https = |port: u16| webhook(port).replace("http://", "https://");
    for lines in [
        mail(smtp(|_| None).port).replace("security: none", "security: starttls"),
        mail(smtp(|_| None).port).replace("security: none", "security: tls"),
        https(smtp(|_| None).port),
    ] {
        let (tries, fault) = fault(&settings(&lines));
        assert!(matches!(fault, Fault::Tls { .. }), "{fault:?}: {lines}");
        assert_eq!(tries, 1);
    }
}
