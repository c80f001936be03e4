//! Every command that reads a file rejects pipes, devices and folders at once, by name.

use std::process::{Command, Output, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

use crate::support::{Lab, ROOT, SMALL, program};

/// Every command line that reads a file, marked `?`.
const READING: [&str; 32] = [
    "check ?",
    "plan ?",
    "run ?",
    "run --rig ? PROTOCOL",
    "run --replay ?",
    "resume ?",
    "resume --rig ? SESSION",
    "status ?",
    "control ? pause",
    "note ? text",
    "doctor --rig ?",
    "devices --rig ?",
    "hil run hil/nightly.yaml --rig ?",
    "hil run ? --rig hil/rigs/emulated.yaml",
    "hil trend ?",
    "hil accept --history ? --by me --reason new",
    "watch ?",
    "tag ? good",
    "show ?",
    "analyze ?",
    "report ?",
    "compare ? ?",
    "compare SESSION SESSION --limits ?",
    "tradeoff ?",
    "verify ?",
    "salvage ?",
    "import --camera1 ? --camera2 ? --presses ? --schedule ?",
    "import --camera1 README.md --camera2 README.md --presses README.md --schedule ?",
    "import --camera1 README.md --camera2 README.md --presses ? --schedule protocols/ten-presses.schedule.yaml",
    "export ? --to csv",
    "inspect ?",
    "inspect --json ?",
];

/// Output of a command; `None` if it hangs and had to be killed.
fn run_with_timeout(arguments: &[&str]) -> Option<Output> {
    let child = program(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (id, (done, wait)) = (child.id(), channel());
    std::thread::spawn(move || done.send(child.wait_with_output()));
    match wait.recv_timeout(Duration::from_secs(60)) {
        Ok(output) => Some(output.unwrap()),
        Err(_) => {
            let _ = Command::new("kill")
                .args(["-KILL", &id.to_string()])
                .status();
            None
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn pipes_and_devices_are_refused() {
    let lab = Lab::new();
    let session = lab.record("sessions", &[]).display().to_string();
    let pipe = lab.text("pipe");
    let created = Command::new("mkfifo").arg(&pipe).status();
    assert!(created.unwrap().success());
    // A pipe beside a session, where its lock would be.
    let beside = lab.text("beside.session.sqlite");
    std::fs::copy(std::path::Path::new(ROOT).join(&session), &beside).unwrap();
    let lock = Command::new("mkfifo")
        .arg(format!("{beside}-lock"))
        .status();
    assert!(lock.unwrap().success());
    let mut wrong = Vec::new();
    for line in READING {
        for file in ["/dev/zero", &pipe, &beside] {
            let words: Vec<&str> = line
                .split(' ')
                .map(|word| match word {
                    "?" => file,
                    "SESSION" => &session,
                    "PROTOCOL" => SMALL,
                    word => word,
                })
                .collect();
            match run_with_timeout(&words) {
                Some(output) if output.status.code() == Some(2) => {}
                // Reads a session and no lock.
                Some(output) if file == beside && output.status.code() == Some(0) => {}
                other => wrong.push(format!("{words:?}: {other:?}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
