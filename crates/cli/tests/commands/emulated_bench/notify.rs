//! The `notify` of a rig file: used without any option, and recorded with the rig file without its secrets.

use std::fs;

use skinrig_model::{NotificationFault, Occasion};
use skinrig_recorder::SessionReader;

use super::{SKINRIG, all_output, in_real_time, only_file, run, start, workspace_root};
use crate::servers::http;

const SECRET: &str = "correct-horse-battery";

/// The preflight fails at once: the disk has less than a petabyte.
#[test]
fn a_run_on_a_bench_tells_by_its_rig_file_and_records_no_secret() {
    in_real_time(tell_by_the_rig_file);
}

fn tell_by_the_rig_file() {
    let Some(bench) = start() else {
        return;
    };
    let server = http(&[200]);
    let folder = tempfile::tempdir().unwrap();
    let rig = folder.path().join("rig.yaml");
    let text = fs::read_to_string(workspace_root().join("hil/rigs/emulated.yaml")).unwrap();
    let notify = format!(
        "notify:\n  webhook: {{url: \"http://127.0.0.1:{}/\", token: {{variable: NOTIFY_SECRET}}}}\n",
        server.port
    );
    let text = text.replace("min_free_disk: 200 MB", "min_free_disk: 1000 TB");
    assert!(text.contains("1000 TB"));
    fs::write(&rig, format!("{text}\n{notify}")).unwrap();
    let mut command = bench.command(SKINRIG).unwrap();
    command.env("NOTIFY_SECRET", SECRET);
    let sessions = folder.path().join("sessions");
    let output = run(command, &["--rig", rig.to_str().unwrap()], &sessions);
    let said = all_output(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("note: webhook: fault: sent"), "{said}");
    let requests = server.received();
    assert_eq!(requests.len(), 1);
    assert!(requests[0].head.contains(SECRET));

    let session = only_file(&sessions, ".session.sqlite");
    let reader = SessionReader::open(&session).unwrap();
    let told = reader.notifications().unwrap();
    let told: Vec<(Occasion, Option<NotificationFault>)> =
        told.into_iter().map(|n| (n.occasion, n.fault)).collect();
    assert_eq!(told, [(Occasion::Fault, None)]);
    let recorded = reader.header().unwrap().rig_json;
    assert!(recorded.contains("NOTIFY_SECRET"), "{recorded}");
    for file in fs::read_dir(&sessions).unwrap() {
        let bytes = fs::read(file.unwrap().path()).unwrap();
        let has = |needle: &str| bytes.windows(needle.len()).any(|w| w == needle.as_bytes());
        assert!(!has(SECRET));
    }
}
