//! Sessions in an S3-compatible store, a server of the Python package moto: they read like their files, by ranges, and nothing is
//! taken for the session that it is not.
//!
//! `SKINRIG_PYTHON` names an interpreter with the packages of `tests/python/requirements.txt`.
#![expect(clippy::unwrap_used, reason = "a failing test may panic")]
#![expect(clippy::print_stderr, reason = "says what was skipped")]

#[path = "../../../recorder/tests/session/common.rs"]
#[expect(dead_code, reason = "only part of it is used here")]
mod common;

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, OnceLock};

use skinrig_model::CameraId;
use skinrig_objects::{ObjectUrl, Objects, Store, StoreError, connect};
use skinrig_recorder::{
    RecorderError, SessionReader, SessionReference, copy_session, reference_to, salvage,
    use_object_store, verify,
};
use tempfile::TempDir;

/// The server of all tests; it ends with this process, whose pipe is its input.
struct Server {
    address: String,
    process: Mutex<(Child, BufReader<ChildStdout>)>,
}

static SERVER: OnceLock<Option<Server>> = OnceLock::new();

impl Server {
    fn start() -> Option<Self> {
        let Ok(python) = std::env::var("SKINRIG_PYTHON") else {
            eprintln!(
                "skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt"
            );
            return None;
        };
        let script = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/python/s3_server.py"
        );
        let mut child = Command::new(python)
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut address = String::new();
        out.read_line(&mut address).unwrap();
        Some(Self {
            address: address.trim().to_owned(),
            process: Mutex::new((child, out)),
        })
    }

    /// Replaces an object.
    fn replace(&self, key: &str, content: &str) {
        let mut process = self.process.lock().unwrap();
        let (child, out) = &mut *process;
        writeln!(child.stdin.as_mut().unwrap(), "{key} {content}").unwrap();
        let mut done = String::new();
        out.read_line(&mut done).unwrap();
        assert_eq!(done.trim(), "done");
    }
}

fn variables(address: &str) -> Vec<(String, String)> {
    [
        ("AWS_ENDPOINT_URL", address),
        ("AWS_ACCESS_KEY_ID", "test"),
        ("AWS_SECRET_ACCESS_KEY", "test"),
        ("AWS_DEFAULT_REGION", "us-east-1"),
    ]
    .map(|(name, value)| (name.to_owned(), value.to_owned()))
    .into()
}

/// The server, and the store of this process; `None` without an interpreter.
fn store() -> Option<(&'static Server, Arc<Store>)> {
    let server = SERVER.get_or_init(Server::start).as_ref()?;
    use_object_store(|| {
        let address = &SERVER.get().unwrap().as_ref().unwrap().address;
        Ok(Box::new(Objects(connect(variables(address))?)))
    });
    let store = connect(variables(&server.address)).unwrap();
    Some((server, store))
}

/// A folder with a sealed session, and the address of an object.
fn recorded(name: &str, presses: u32) -> (TempDir, ObjectUrl) {
    let folder = tempfile::tempdir().unwrap();
    common::sealed(&folder.path().join("a.session.sqlite"), presses);
    let url = ObjectUrl::parse(&format!("s3://lab/{name}/a.session.sqlite")).unwrap();
    (folder, url)
}

/// Puts a reference to the object beside the session; returns its path.
fn refer(folder: &Path, url: &ObjectUrl) -> std::path::PathBuf {
    let path = folder.join("b.session.sqlite");
    let reference = reference_to(&url.to_string()).unwrap();
    std::fs::write(&path, reference.text().unwrap()).unwrap();
    path
}

#[test]
fn a_session_in_a_store_reads_like_its_file() {
    let Some((_, store)) = store() else { return };
    let (folder, url) = recorded("like", 5);
    let file = folder.path().join("a.session.sqlite");
    let mut sent = 0;
    store.send(&file, &url, &mut |bytes| sent += bytes).unwrap();
    let bytes = std::fs::metadata(&file).unwrap().len();
    assert_eq!(sent, 2 * bytes, "sent and read back");
    let reference = refer(folder.path(), &url);
    let of = |path: &Path| {
        let reader = SessionReader::open(path).unwrap();
        let index = reader.chunk_index(CameraId::One).unwrap();
        let bytes = index
            .iter()
            .map(|chunk| reader.chunk_bytes(CameraId::One, chunk.seq).unwrap());
        let chunks: Vec<Vec<u8>> = bytes.collect();
        (
            reader.session_id().unwrap(),
            reader.header().unwrap(),
            reader.presses().unwrap(),
            reader.seal().unwrap().unwrap().content_sha256(),
            chunks,
        )
    };
    assert_eq!(of(&file), of(&reference));
    let report = verify::<common::Evt2>(&reference).unwrap();
    assert!(report.is_sound(), "{report:?}");

    // There and back, and sent again.
    let copy = folder.path().join("c.session.sqlite");
    copy_session(&reference, &copy).unwrap();
    assert!(std::fs::read(&copy).unwrap() == std::fs::read(&file).unwrap());
    store.send(&copy, &url, &mut |_| {}).unwrap();
    let listed = store
        .list(&ObjectUrl::parse("s3://lab/like").unwrap())
        .unwrap();
    assert_eq!(listed.len(), 1);
    assert_eq!((&listed[0].url, listed[0].bytes), (&url, bytes));
    let refused = salvage(&reference, &folder.path().join("d")).unwrap_err();
    assert!(
        matches!(refused, RecorderError::Referred { .. }),
        "{refused}"
    );
}

#[test]
fn a_headline_takes_a_small_part_of_the_object() {
    let Some((_, store)) = store() else { return };
    let (folder, url) = recorded("part", 2_000);
    let file = folder.path().join("a.session.sqlite");
    store.send(&file, &url, &mut |_| {}).unwrap();
    let reference = refer(folder.path(), &url);
    let bytes = std::fs::metadata(&file).unwrap().len();
    let before = store.bytes_read();
    let reader = SessionReader::open(&reference).unwrap();
    reader.seal().unwrap().unwrap();
    let read = store.bytes_read() - before;
    assert!(bytes > 2_000_000, "{bytes}");
    assert!(20 * read < bytes, "{read} of {bytes} bytes");
}

#[test]
fn another_object_is_never_taken_for_the_session() {
    let Some((server, store)) = store() else {
        return;
    };
    let (folder, url) = recorded("other", 4);
    let file = folder.path().join("a.session.sqlite");
    store.send(&file, &url, &mut |_| {}).unwrap();
    let path = refer(folder.path(), &url);
    let reference = SessionReference::of(&path).unwrap().unwrap();
    let open = |reference: &SessionReference| {
        std::fs::write(&path, reference.text().unwrap()).unwrap();
        SessionReader::open(&path).unwrap_err()
    };
    // Another session of the same size, another seal, another size.
    let (other, other_url) = recorded("other-too", 4);
    let other = other.path().join("a.session.sqlite");
    store.send(&other, &other_url, &mut |_| {}).unwrap();
    for wrong in [
        SessionReference {
            url: other_url.to_string(),
            ..reference.clone()
        },
        SessionReference {
            content_sha256: "0".repeat(64),
            ..reference.clone()
        },
        SessionReference {
            session_id: "0".repeat(32),
            ..reference.clone()
        },
        SessionReference {
            bytes: reference.bytes + 1,
            ..reference.clone()
        },
    ] {
        let refused = open(&wrong);
        assert!(
            matches!(refused, RecorderError::OtherObject { .. }),
            "{refused}"
        );
        assert!(refused.to_string().contains(&wrong.url), "{refused}");
        let copied = copy_session(&path, &folder.path().join("copy"));
        assert!(
            matches!(copied, Err(RecorderError::OtherObject { .. })),
            "{copied:?}"
        );
        assert!(!folder.path().join("copy").exists());
    }
    // Nothing there, something else there, a file that is another session.
    let missing = SessionReference {
        url: "s3://lab/none".to_owned(),
        ..reference.clone()
    };
    let refused = open(&missing).to_string();
    assert!(
        refused.contains("s3://lab/none: expected an object, found none"),
        "{refused}"
    );
    let refused = store.send(&other, &url, &mut |_| {}).unwrap_err();
    assert!(matches!(refused, StoreError::Exists { .. }), "{refused}");
    server.replace("notes", "no session");
    let refused = reference_to("s3://lab/notes").unwrap_err().to_string();
    assert!(refused.contains("s3://lab/notes"), "{refused}");

    // Replaced while it is read.
    std::fs::write(&path, reference.text().unwrap()).unwrap();
    let (large, large_url) = recorded("replaced", 2_000);
    let large = large.path().join("a.session.sqlite");
    store.send(&large, &large_url, &mut |_| {}).unwrap();
    let path = refer(folder.path(), &large_url);
    let reader = SessionReader::open(&path).unwrap();
    server.replace(&large_url.key, "something else");
    let refused = reader.presses().unwrap_err().to_string();
    assert!(
        refused.contains("was replaced while it was read"),
        "{refused}"
    );
}

#[test]
fn a_store_that_does_not_answer_is_named_with_what_describes_it() {
    let store = Store::new(variables("http://127.0.0.1:9")).unwrap();
    let url = ObjectUrl::parse("s3://lab/a").unwrap();
    let refused = store.list(&url).unwrap_err().to_string();
    assert!(
        refused.starts_with("s3://lab/a: ") && refused.contains("AWS_ENDPOINT_URL"),
        "{refused}"
    );
}
