//! The lease of a bench between processes: only one ever holds it, and whoever dies lets go.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up must fail")]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use skinrig_hil::lease::{Lease, LeaseError, Owner, Pace, Standing, look, path_of};

/// Tells a child of these tests where the lease is.
const LEASE: &str = "SKINRIG_TEST_LEASE";
/// So long may anything take that must happen.
const PATIENCE: Duration = Duration::from_secs(60);

/// Fast enough for tests; a beat is awaited by looking, never by sleeping.
const PACE: Pace = Pace {
    beat: Duration::from_millis(20),
    expiry: Duration::from_millis(500),
    glance: Duration::from_millis(50),
};

fn owner(host: &str, what: &str) -> Owner {
    Owner::this_process("somebody".to_owned(), host.to_owned(), what.to_owned())
}

fn take(path: &Path, what: &str) -> Result<Lease, LeaseError> {
    Lease::take(path, owner("here", what), PACE)
}

/// What stands in the lease's file.
fn entry(path: &Path) -> serde_json::Value {
    let until = Instant::now() + PATIENCE;
    loop {
        // A beat may just be written.
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
    std::fs::write(path, value.to_string()).unwrap();
}

/// Waits until the holder's heart has beaten once more.
fn await_beat(path: &Path) {
    let before = entry(path)["beats"].clone();
    let until = Instant::now() + PATIENCE;
    while entry(path)["beats"] == before {
        assert!(Instant::now() < until, "no beat");
        std::thread::yield_now();
    }
}

#[test]
fn a_held_bench_is_refused_with_its_holder_and_free_when_released() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    assert_eq!(look(&path).unwrap(), Standing::Free { last: None });
    let lease = take(&path, "hil run nightly").unwrap();
    assert_eq!(lease.note(), None);
    let refused = take(&path, "run paper").unwrap_err().to_string();
    for said in [
        "`skinrig hil run nightly` of somebody on here",
        &format!("kill {}", std::process::id()),
        "next: ",
    ] {
        assert!(refused.contains(said), "{refused}");
    }
    assert!(
        matches!(look(&path).unwrap(), Standing::Held { owner: Some(o), .. } if o.what == "hil run nightly")
    );
    await_beat(&path);
    drop(lease);
    assert!(
        matches!(look(&path).unwrap(), Standing::Free { last: Some(o) } if o.what == "hil run nightly")
    );
    // Released, so there is nothing to tell.
    assert_eq!(take(&path, "jog").unwrap().note(), None);
    // Another robot's is another lease.
    let _one = take(&path, "jog").unwrap();
    take(&path_of(folder.path(), "omega3-8"), "jog").unwrap();
}

#[test]
fn no_clock_decides_on_one_computer() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    for beat_at in ["1970-01-01T00:00:00.000Z", "2999-01-01T00:00:00.000Z"] {
        // The holder's clock was set back, or forward: it holds the lock, and so the bench.
        let lease = take(&path, "hil run nightly").unwrap();
        rewrite(&path, |e| e["beat_at"] = beat_at.into());
        assert!(matches!(take(&path, "jog"), Err(LeaseError::Held { .. })));
        assert!(!lease.is_lost());
        drop(lease);
        // It died, and its last sign of life lies anywhere: the bench is free at once, and that is told.
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

/// Locks of another computer may not be seen here: then its heart decides.
#[test]
fn an_owner_on_another_computer_is_left_alone_while_its_heart_beats() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    drop(Lease::take(&path, owner("there", "hil run nightly"), PACE).unwrap());
    rewrite(&path, |e| e["released"] = false.into());
    // A file whose lock is free and whose counter counts: as a file server shows it that does not share locks.
    let (stop, stopped) = channel::<()>();
    let beating = {
        let path = path.clone();
        std::thread::spawn(move || {
            let mut beats = 1u64;
            while stopped.try_recv().is_err() {
                rewrite(&path, |e| e["beats"] = beats.into());
                beats += 1;
                std::thread::yield_now();
            }
        })
    };
    let patient = Pace {
        expiry: PATIENCE,
        ..PACE
    };
    let refused = Lease::take(&path, owner("here", "jog"), patient).unwrap_err();
    assert!(refused.to_string().contains("on there"), "{refused}");
    stop.send(()).unwrap();
    beating.join().unwrap();
    // Its heart stands still: it is gone.
    let lease = take(&path, "jog").unwrap();
    assert!(lease.note().unwrap().contains("on there"));
}

#[test]
fn an_owner_sees_that_its_bench_was_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    let lease = take(&path, "hil run nightly").unwrap();
    rewrite(&path, |e| e["token"] = "another".into());
    let until = Instant::now() + PATIENCE;
    while !lease.is_lost() {
        assert!(Instant::now() < until, "not noticed");
        // The heart may have overwritten what this test wrote while it was beating.
        rewrite(&path, |e| e["token"] = "another".into());
        std::thread::yield_now();
    }
    drop(lease);
    assert_eq!(
        entry(&path)["token"],
        "another",
        "what is not ours is not released"
    );
}

#[test]
fn a_file_that_cannot_be_a_lease_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(&folder.path().join("not made"), "omega3-7");
    let refused = take(&path, "jog").unwrap_err().to_string();
    assert!(refused.contains("SKINRIG_LEASES"), "{refused}");
    // Rubbish in it is nobody's.
    let path = path_of(folder.path(), "omega3-7");
    std::fs::write(&path, "{\"owner\": 12").unwrap();
    assert_eq!(look(&path).unwrap(), Standing::Free { last: None });
    assert_eq!(take(&path, "jog").unwrap().note(), None);
}

/// A process of its own that wants the lease.
struct Rival {
    child: Child,
    stdin: ChildStdin,
    said: Receiver<String>,
}

impl Rival {
    /// Starts it; it waits to be told to `go`.
    fn start(path: &Path) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "rival", "--ignored", "--nocapture"])
            .env(LEASE, path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (tell, said) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // The test's harness writes lines of its own.
                if let Some(word) = line.split("rival: ").nth(1) {
                    let _ = tell.send(word.to_owned());
                }
            }
        });
        let rival = Self { child, stdin, said };
        assert_eq!(rival.hear(), "ready");
        rival
    }

    fn go(&mut self) {
        writeln!(self.stdin, "go").unwrap();
    }

    fn hear(&self) -> String {
        self.said.recv_timeout(PATIENCE).unwrap()
    }

    fn end(mut self) {
        drop(self.stdin);
        assert!(self.child.wait().unwrap().success());
    }
}

/// Not a test by itself: the process that [`Rival`] starts.
#[test]
#[ignore = "no test by itself: the tests here start it as their other process"]
fn rival() {
    let Some(path) = std::env::var_os(LEASE) else {
        return;
    };
    let mut lines = std::io::stdin().lines();
    println!("rival: ready");
    lines.next();
    let lease = take(Path::new(&path), "rival");
    println!("rival: {}", if lease.is_ok() { "taken" } else { "refused" });
    // Until the parent lets go, or kills.
    lines.next();
}

#[test]
fn of_several_processes_at_once_exactly_one_gets_the_bench() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    for _ in 0..3 {
        let mut rivals: Vec<Rival> = (0..4).map(|_| Rival::start(&path)).collect();
        for rival in &mut rivals {
            rival.go();
        }
        let heard: Vec<String> = rivals.iter().map(Rival::hear).collect();
        let taken = heard.iter().filter(|h| *h == "taken").count();
        assert_eq!(taken, 1, "{heard:?}");
        rivals.into_iter().for_each(Rival::end);
    }
}

#[test]
fn a_killed_owner_lets_go_and_the_next_one_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = path_of(folder.path(), "omega3-7");
    let mut rival = Rival::start(&path);
    rival.go();
    assert_eq!(rival.hear(), "taken");
    assert!(matches!(take(&path, "jog"), Err(LeaseError::Held { .. })));
    let pid = rival.child.id();
    rival.child.kill().unwrap();
    rival.child.wait().unwrap();
    let standing = look(&path).unwrap();
    let Standing::Left { owner, .. } = &standing else {
        panic!("{standing:?}");
    };
    assert_eq!((owner.pid, owner.lives("here")), (pid, Some(false)));
    let lease = take(&path, "jog").unwrap();
    assert!(lease.note().unwrap().contains(&format!("process {pid}")));
}
