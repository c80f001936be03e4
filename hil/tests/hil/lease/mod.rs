//! Tests of a bench's lease across processes: one holder at a time, and release at exit or death.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up must fail")]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use skinrig_hil::lease::{Lease, LeaseError, LeaseState, LeaseTiming, Owner, inspect, path_of};

/// Environment variable that passes the lease's path to a child process.
const LEASE: &str = "SKINRIG_TEST_LEASE";
/// Time limit of every wait.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Short intervals for tests; the tests poll for a heartbeat and never sleep.
const TIMING: LeaseTiming = LeaseTiming {
    heartbeat: Duration::from_millis(20),
    expiry: Duration::from_millis(500),
    lock_wait: Duration::from_millis(50),
};

fn owner(host: &str, what: &str) -> Owner {
    Owner::this_process("somebody".to_owned(), host.to_owned(), what.to_owned())
}

fn take(path: &Path, what: &str) -> Result<Lease, LeaseError> {
    Lease::take(path, owner("here", what), TIMING)
}

/// The content of the lease file.
fn entry(path: &Path) -> serde_json::Value {
    let until = Instant::now() + TIMEOUT;
    loop {
        // A heartbeat may be writing it.
        let text = std::fs::read_to_string(path).unwrap();
        match serde_json::from_str(&text) {
            Ok(value) => return value,
            Err(e) => assert!(Instant::now() < until, "{e}: {text}"),
        }
    }
}

fn rewrite(path: &Path, change: impl Fn(&mut serde_json::Value)) {
    let mut value = entry(path);
    change(&mut value);
    // In place, as holders write it: never empty in between.
    let text = value.to_string();
    let mut file = std::fs::OpenOptions::new().write(true).open(path).unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file.set_len(text.len() as u64).unwrap();
}

/// Waits for the holder's next heartbeat.
fn await_heartbeat(path: &Path) {
    let before = entry(path)["beats"].clone();
    let until = Instant::now() + TIMEOUT;
    while entry(path)["beats"] == before {
        assert!(Instant::now() < until, "no beat");
        std::thread::yield_now();
    }
}

#[test]
fn a_held_lease_is_refused_with_its_holder_and_free_after_release() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    assert_eq!(inspect(&path).unwrap(), LeaseState::Free { last: None });
    let lease = take(&path, "hil run nightly").unwrap();
    assert_eq!(lease.note(), None);
    let refused = take(&path, "run paper").unwrap_err().to_string();
    for phrase in [
        "`skinrig hil run nightly` of somebody on here",
        &format!("kill {}", std::process::id()),
        "next: ",
    ] {
        assert!(refused.contains(phrase), "{refused}");
    }
    assert!(
        matches!(inspect(&path).unwrap(), LeaseState::Held { owner: Some(o), .. } if o.what == "hil run nightly")
    );
    await_heartbeat(&path);
    drop(lease);
    assert!(
        matches!(inspect(&path).unwrap(), LeaseState::Free { last: Some(o) } if o.what == "hil run nightly")
    );
    // Released, so there is no takeover to report.
    assert_eq!(take(&path, "jog").unwrap().note(), None);
    // Another robot has its own lease.
    let _one = take(&path, "jog").unwrap();
    take(&path_of(folder.path(), "omega3-8"), "jog").unwrap();
}

#[test]
fn clocks_do_not_matter_on_one_computer() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    for beat_at in ["1970-01-01T00:00:00.000Z", "2999-01-01T00:00:00.000Z"] {
        // The holder's clock was changed, but it still has the lock and therefore the lease.
        let lease = take(&path, "hil run nightly").unwrap();
        rewrite(&path, |e| e["beat_at"] = beat_at.into());
        assert!(matches!(take(&path, "jog"), Err(LeaseError::Held { .. })));
        assert!(!lease.is_lost());
        drop(lease);
        // After the holder's death the bench is free at once, whatever the time of its last heartbeat, and the next holder reports the takeover.
        rewrite(&path, |e| {
            e["released"] = false.into();
            e["beat_at"] = beat_at.into();
        });
        let lease = take(&path, "jog").unwrap();
        let note = lease.note().unwrap().to_owned();
        assert!(
            note.contains(beat_at) && note.contains("hil run nightly"),
            "{note}"
        );
        let log = std::fs::read_to_string(path.with_extension("log")).unwrap();
        assert!(log.contains("skinrig jog") && log.contains(&note), "{log}");
    }
}

/// Locks of another computer may be invisible here. In that case its heartbeat decides.
#[test]
fn a_holder_on_another_computer_keeps_the_lease_while_it_sends_heartbeats() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    drop(Lease::take(&path, owner("there", "hil run nightly"), TIMING).unwrap());
    rewrite(&path, |e| e["released"] = false.into());
    // A free lock and a running counter, as on a file server without shared locks.
    let (stop, stopped) = channel::<()>();
    let beating = {
        let path = path.clone();
        std::thread::spawn(move || {
            let mut beats = 1u64;
            while stopped.try_recv().is_err() {
                // Shorter and longer in turn: between writing and cutting off the rest, the entry cannot be read.
                rewrite(&path, |e| {
                    e["beats"] = (beats + beats % 2 * 1_000_000_000_000).into()
                });
                beats += 1;
                std::thread::yield_now();
            }
        })
    };
    let patient = LeaseTiming {
        expiry: TIMEOUT,
        ..TIMING
    };
    for _ in 0..200 {
        let refused = Lease::take(&path, owner("here", "jog"), patient).unwrap_err();
        assert!(refused.to_string().contains("on there"), "{refused}");
    }
    stop.send(()).unwrap();
    beating.join().unwrap();
    // The heartbeat has stopped, so the holder has ended.
    let lease = take(&path, "jog").unwrap();
    assert!(lease.note().unwrap().contains("on there"));
}

#[test]
fn a_holder_notices_that_its_lease_was_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    let lease = take(&path, "hil run nightly").unwrap();
    rewrite(&path, |e| e["token"] = "another".into());
    let until = Instant::now() + TIMEOUT;
    while !lease.is_lost() {
        assert!(Instant::now() < until, "not noticed");
        // A heartbeat may have overwritten the change of this test.
        rewrite(&path, |e| e["token"] = "another".into());
        std::thread::yield_now();
    }
    drop(lease);
    assert_eq!(
        entry(&path)["token"],
        "another",
        "a lease taken by another program is not released"
    );
}

#[test]
fn an_unusable_lease_file_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(&folder.path().join("not made"), "omega3-7");
    let refused = take(&path, "jog").unwrap_err().to_string();
    assert!(refused.contains("SKINRIG_LEASES"), "{refused}");
    // A damaged file names no holder.
    let path = path_of(folder.path(), "omega3-7");
    std::fs::write(&path, "{\"owner\": 12").unwrap();
    assert_eq!(inspect(&path).unwrap(), LeaseState::Free { last: None });
    assert_eq!(take(&path, "jog").unwrap().note(), None);
}

/// Another process that tries to take the lease.
struct CompetingProcess {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
}

impl CompetingProcess {
    /// Starts the process, which waits for `go`.
    fn start(path: &Path) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "lease::rival", "--ignored", "--nocapture"])
            .env(LEASE, path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // Skip lines printed by the test harness.
                if let Some(word) = line.split("rival: ").nth(1) {
                    let _ = sender.send(word.to_owned());
                }
            }
        });
        let rival = Self {
            child,
            stdin,
            lines,
        };
        assert_eq!(rival.read_line(), "ready");
        rival
    }

    fn go(&mut self) {
        writeln!(self.stdin, "go").unwrap();
    }

    fn read_line(&self) -> String {
        self.lines.recv_timeout(TIMEOUT).unwrap()
    }

    fn end(mut self) {
        drop(self.stdin);
        assert!(self.child.wait().unwrap().success());
    }
}

/// The process that [`CompetingProcess`] starts; not a test.
#[test]
#[ignore = "not a test: other tests start it as their second process"]
fn rival() {
    let Some(path) = std::env::var_os(LEASE) else {
        return;
    };
    let mut lines = std::io::stdin().lines();
    println!("rival: ready");
    lines.next();
    let lease = take(Path::new(&path), "rival");
    println!("rival: {}", if lease.is_ok() { "taken" } else { "refused" });
    // Wait until the parent closes the pipe or kills this process.
    lines.next();
}

#[test]
fn exactly_one_of_several_processes_gets_the_lease() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    for _ in 0..3 {
        let mut rivals: Vec<CompetingProcess> =
            (0..4).map(|_| CompetingProcess::start(&path)).collect();
        for rival in &mut rivals {
            rival.go();
        }
        let answers: Vec<String> = rivals.iter().map(CompetingProcess::read_line).collect();
        let taken = answers.iter().filter(|h| *h == "taken").count();
        assert_eq!(taken, 1, "{answers:?}");
        rivals.into_iter().for_each(CompetingProcess::end);
    }
}

#[test]
fn the_lease_of_a_killed_holder_is_free_and_the_next_holder_notes_the_takeover() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    let mut rival = CompetingProcess::start(&path);
    rival.go();
    assert_eq!(rival.read_line(), "taken");
    assert!(matches!(take(&path, "jog"), Err(LeaseError::Held { .. })));
    let pid = rival.child.id();
    rival.child.kill().unwrap();
    rival.child.wait().unwrap();
    let standing = inspect(&path).unwrap();
    let LeaseState::Abandoned { owner, .. } = &standing else {
        panic!("{standing:?}");
    };
    assert_eq!((owner.pid, owner.is_running("here")), (pid, Some(false)));
    let lease = take(&path, "jog").unwrap();
    assert!(lease.note().unwrap().contains(&format!("process {pid}")));
}
