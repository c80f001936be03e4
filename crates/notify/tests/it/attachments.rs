//! Mails about nights: the golden session is attached up to the limit, and always named.

use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use skinrig_nightly::Night;
use skinrig_notify::{Event, Message, Notifier, Policy, Subject};

use crate::servers::{ReceivedMail, smtp};
use crate::support::{TestClock, mail, open, settings};

fn night() -> Night {
    let night = json!({
        "version": 1, "id": "2026-11-20T02-00-00Z-nightly", "suite": "nightly", "suite_sha256": "5", "rig": "bench 1",
        "rig_kind": "bench", "rig_sha256": "6", "started": "2026-11-20T02:00:00Z", "took_s": 1.0, "planned_s": 1.0,
        "budget_s": 2.0, "finished": true, "checks": [], "verdict": "FAIL", "exit": "Fail",
        "versions": {"software": "0.1.0", "analysis": 9, "firmware": []},
    });
    serde_json::from_value(night).unwrap()
}

/// The mail about a night whose golden session has 1000 bytes.
fn mail_with(limit: &str, golden: &Path) -> ReceivedMail {
    let server = smtp(|_| None);
    let lines =
        mail(server.port).replace("username:", &format!("attach_up_to: {limit}, username:"));
    let settings = settings(&lines);
    let clock = Arc::new(TestClock::default());
    let channels = open(&settings).unwrap();
    let mut notifier =
        Notifier::start(&settings.on, channels, Policy::of(&settings), clock).unwrap();
    let event = Event {
        rig: "bench 1",
        subject: Subject::Night {
            night: &night(),
            page: Path::new("/nights/night.html"),
            golden: Some(golden),
        },
    };
    notifier.post(Message::new(&event, "pc", "2026-11-20T02:20:00Z"));
    assert_eq!(notifier.finish()[0].fault, None);
    server.received().remove(0)
}

#[test]
fn a_golden_session_is_attached_up_to_the_limit_and_always_named() {
    let folder = tempfile::tempdir().unwrap();
    let golden = folder.path().join("golden.session.sqlite");
    std::fs::write(&golden, [7; 1000]).unwrap();
    let attached = "filename=\"golden.session.sqlite\"";
    for (limit, path, is_attached) in [
        ("1 kB", golden.clone(), true),
        ("999 B", golden.clone(), false),
        ("1 MB", folder.path().join("gone.session.sqlite"), false),
    ] {
        let mail = mail_with(limit, &path);
        assert_eq!(mail.data.contains(attached), is_attached, "{limit}");
        // 1000 bytes of 7 in Base64.
        assert_eq!(
            mail.data.contains("BwcHBwcHBwcHBwcH"),
            is_attached,
            "{limit}"
        );
        let text = mail.data.replace("=\n", "");
        assert!(text.contains(&path.display().to_string()), "{text}");
        assert!(mail.data.contains("night FAIL of nightly"), "{}", mail.data);
    }
}
