//! `skinrig store`: a session in an S3-compatible store (a server of the Python package moto) is used like its file, and nothing is
//! lost on the way there and back.
//!
//! `SKINRIG_PYTHON` names an interpreter with the packages of `tests/python/requirements.txt`.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::support::{Lab, ProgramOutput, ROOT, files, only, program, run_to_end, text};

/// A store with the bucket `lab`; it ends with this.
struct Store {
    server: Child,
    address: String,
}

impl Store {
    /// `None`, with the reason on standard error, without an interpreter.
    fn start() -> Option<Self> {
        let Ok(python) = std::env::var("SKINRIG_PYTHON") else {
            eprintln!(
                "skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt"
            );
            return None;
        };
        let mut server = Command::new(python)
            .arg(Path::new(ROOT).join("tests/python/s3_server.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut address = String::new();
        let out = server.stdout.take().unwrap();
        BufReader::new(out).read_line(&mut address).unwrap();
        let address = address.trim().to_owned();
        Some(Self { server, address })
    }

    /// Runs skinrig as a user of the store.
    fn skinrig(&self, arguments: &[&str]) -> ProgramOutput {
        let mut command = program(arguments);
        command
            .env("AWS_ENDPOINT_URL", &self.address)
            .env("AWS_ACCESS_KEY_ID", "test")
            .env("AWS_SECRET_ACCESS_KEY", "test")
            .env("AWS_DEFAULT_REGION", "us-east-1");
        run_to_end(command)
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        drop(self.server.stdin.take());
        let _ = self.server.wait();
    }
}

/// A session, with a copy in `original`.
fn recorded(lab: &Lab) -> PathBuf {
    let session = lab.record("s", &[]);
    let original = lab.path("original");
    std::fs::copy(&session, &original).unwrap();
    session
}

#[test]
fn a_session_in_a_store_is_used_like_its_file_and_comes_back() {
    let Some(store) = Store::start() else { return };
    let lab = Lab::new();
    let session = recorded(&lab);
    let file = text(&session);
    store.skinrig(&["analyze", &file]).code(0);
    let results = only(&lab.path("s"), ".results.json");
    let before = std::fs::read(&results).unwrap();
    let commands: [&[&str]; 3] = [
        &["show", &file, "--json"],
        &["verify", &file, "--json"],
        &["sessions", "--json", &lab.text("s")],
    ];
    let answers = || commands.map(|command| store.skinrig(command).code(0).json());
    let of_file = answers();

    let put = store
        .skinrig(&["store", "put", &file, "--to", "s3://lab/2026"])
        .code(0);
    let name = session.file_name().unwrap().to_str().unwrap();
    assert!(
        put.out.contains(&format!("s3://lab/2026/{name}")),
        "{}",
        put.out
    );
    assert!(
        std::fs::metadata(&session).unwrap().len() < 1000,
        "a reference"
    );
    assert_eq!(answers(), of_file);
    let status = store
        .skinrig(&["catalogue", "status", &lab.text("s")])
        .code(0);
    assert!(status.out.contains("1 current, 0 stale"), "{}", status.out);
    store.skinrig(&["analyze", &file]).code(0);
    assert!(std::fs::read(&results).unwrap() == before, "other results");
    let bundle = lab.text("x.bundle");
    store
        .skinrig(&["export", &file, "--to", "bundle", "--out", &bundle])
        .code(0);
    store.skinrig(&["verify", &bundle]).code(0);

    // Sent again, and linked from another folder.
    let again = store
        .skinrig(&["store", "put", &file, "--to", "s3://lab/2026"])
        .code(0);
    assert!(again.out.contains("(unchanged)"), "{}", again.out);
    let other = lab.text("other");
    let link = ["store", "link", "s3://lab/2026", "--to", &other];
    store.skinrig(&link).code(0);
    let linked = only(&lab.path("other"), ".session.sqlite");
    assert_eq!(
        std::fs::read(&linked).unwrap(),
        std::fs::read(&session).unwrap()
    );
    let again = store.skinrig(&link).code(0);
    assert!(again.out.contains("(unchanged)"), "{}", again.out);
    let show = store
        .skinrig(&["show", &text(&linked), "--json"])
        .code(0)
        .json();
    assert_eq!(show["session_id"], of_file[0]["session_id"]);

    store.skinrig(&["store", "get", &file]).code(0);
    assert!(std::fs::read(&session).unwrap() == std::fs::read(lab.path("original")).unwrap());
    assert!(
        std::fs::metadata(&session)
            .unwrap()
            .permissions()
            .readonly()
    );
    assert!(files(&lab.path("s"), ".fetched").is_empty());
}

#[test]
fn what_cannot_be_moved_stays_and_says_what_to_do() {
    let Some(store) = Store::start() else { return };
    let lab = Lab::new();
    let session = recorded(&lab);
    let file = text(&session);
    let stays = || {
        assert!(std::fs::read(&session).unwrap() == std::fs::read(lab.path("original")).unwrap())
    };
    let put = |to| store.skinrig(&["store", "put", &file, "--to", to]);
    put("lab/2026")
        .code(2)
        .expect_stderr(&["expected an address s3://BUCKET/KEY, found `lab/2026`"]);
    put("s3://nobody/2026")
        .code(2)
        .expect_stderr(&["expected a bucket `nobody`, found none", "stay as they are"]);
    stays();
    // Another session of this name is there.
    let folder = lab.path("t");
    std::fs::create_dir(&folder).unwrap();
    let other = folder.join(session.file_name().unwrap());
    std::fs::copy(lab.record("u", &["--seed", "9"]), &other).unwrap();
    store
        .skinrig(&[
            "store",
            "put",
            &text(&other),
            "--to",
            "s3://lab/2026",
            "--keep",
        ])
        .code(0);
    assert!(std::fs::metadata(&other).unwrap().len() > 10_000, "--keep");
    put("s3://lab/2026")
        .code(2)
        .expect_stderr(&["found another; choose another address"]);
    stays();
    // A damaged one could not be fetched back.
    let mut bytes = std::fs::read(&session).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 64].fill(0x55);
    let damaged = lab.text("t/damaged.session.sqlite");
    std::fs::write(&damaged, &bytes).unwrap();
    store
        .skinrig(&["store", "put", &damaged, "--to", "s3://lab/else"])
        .code(2)
        .expect_stderr(&["damaged", "next:"]);
    assert!(std::fs::read(&damaged).unwrap() == bytes);
    // One failure leaves the others.
    let missing = lab.text("s/none.session.sqlite");
    let both = ["store", "put", &missing, &file, "--to", "s3://lab/else"];
    store
        .skinrig(&both)
        .code(2)
        .expect_stderr(&["no such session file", "1 of 2 sessions stay as they are"]);
    assert!(std::fs::metadata(&session).unwrap().len() < 1000);

    // It is where it is, not elsewhere.
    store
        .skinrig(&["store", "put", &file, "--to", "s3://lab/third"])
        .code(2)
        .expect_stderr(&[
            "a reference to s3://lab/else/",
            "not to s3://lab/third/",
            "`skinrig store get",
        ]);

    // What is salvaged is the object.
    let copy = lab.text("t/copy.session.sqlite");
    store.skinrig(&["salvage", &file, "--out", &copy]).code(0);
    store.skinrig(&["verify", &copy]).code(0);
    assert_eq!(
        std::fs::read_dir(lab.path("t"))
            .unwrap()
            .filter(|e| {
                e.as_ref()
                    .unwrap()
                    .file_name()
                    .to_string_lossy()
                    .contains(".fetched")
            })
            .count(),
        0
    );

    // The object is not the session, the store is gone.
    let reference = std::fs::read_to_string(&session).unwrap();
    std::fs::write(&session, reference.replace("lab/else", "lab/2026")).unwrap();
    for command in [
        &["show", &file][..],
        &["analyze", &file],
        &["store", "get", &file],
    ] {
        store
            .skinrig(command)
            .code(2)
            .expect_stderr(&["s3://lab/2026/", "sealed as", "found"]);
    }
    std::fs::write(&session, &reference).unwrap();
    store
        .skinrig(&["store", "link", "s3://lab/none", "--to", &lab.text("v")])
        .code(2)
        .expect_stderr(&["expected sessions, found none"]);
    let mut command = program(&["verify", &file]);
    command
        .env("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
        .env("AWS_ACCESS_KEY_ID", "test")
        .env("AWS_SECRET_ACCESS_KEY", "test");
    run_to_end(command)
        .code(1)
        .expect_stderr(&["s3://lab/else/", "AWS_ENDPOINT_URL"]);
    store.skinrig(&["verify", &file]).code(0);
}
