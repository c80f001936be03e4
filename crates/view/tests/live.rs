//! A running session over HTTP: its pages see what the run has received before the file has it.
#![expect(clippy::unwrap_used, reason = "a test without a server must fail")]

use std::collections::HashSet;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::ThreadId;

use serde_json::{Value, json};
use skinrig::library::{ControlHandle, Program, ProtocolSource, Simulation, simulate};
use skinrig_analysis::Analysis;
use skinrig_formats::evt2;
use skinrig_model::{CdEvent, Polarity, Record};
use skinrig_recorder::{SessionReader, SessionWriter};
use skinrig_view::{
    AnalysisEntry, Lab, LabError, NewestBytes, Options, RunState, Server, SettingDifference,
};

/// Pages that are open at the same time.
const PAGES: usize = 10;
/// When the run took its newest bytes, s.
const TAKEN_S: f64 = 1234.5;
/// Protocol of the session whose header the recorded one has.
const PROTOCOL: &str = include_str!("../../../protocols/depth-sweep.yaml");

/// A run that answers; everything else is as in the program.
struct Run {
    bytes: Vec<u8>,
    callers: Arc<Mutex<HashSet<ThreadId>>>,
}

impl Lab for Run {
    fn run(&self, _: &Path) -> Option<RunState> {
        Some(RunState {
            state: "running".to_owned(),
            is_over: false,
            lost_bytes: [0; 2],
            report: json!({ "state": "running" }),
        })
    }

    fn newest(&self, _: &Path) -> Option<[NewestBytes; 2]> {
        let caller = std::thread::current().id();
        self.callers.lock().unwrap().insert(caller);
        let bytes = NewestBytes {
            bytes: self.bytes.clone(),
            unix_s: TAKEN_S,
        };
        Some([bytes.clone(), bytes])
    }

    fn request(&self, session: &Path, request: &str) -> Result<String, LabError> {
        Program.request(session, request)
    }

    fn note(&self, session: &Path, by: &str, text: &str) -> Result<(), LabError> {
        Program.note(session, by, text)
    }

    fn analysis(&self, session: &Path, id: &str, name: Option<&str>) -> Option<Analysis> {
        Program.analysis(session, id, name)
    }

    fn analyses(&self, session: &Path, id: &str) -> Vec<AnalysisEntry> {
        Program.analyses(session, id)
    }

    fn differences(
        &self,
        sides: [(&Path, Option<&str>); 2],
    ) -> Result<(Vec<SettingDifference>, usize), LabError> {
        Program.differences(sides)
    }

    fn prototypes(&self, folder: &Path) -> Result<Value, LabError> {
        Program.prototypes(folder)
    }

    fn nights(&self, folder: &Path) -> Result<Vec<Value>, LabError> {
        Program.nights(folder)
    }

    fn free_bytes(&self, session: &Path) -> Option<u64> {
        Program.free_bytes(session)
    }
}

/// A session that is being recorded and has no camera data yet.
fn recording(folder: &Path) -> SessionWriter {
    let finished = simulate(
        Simulation {
            protocol: ProtocolSource::Text(PROTOCOL.to_owned()),
            overrides: vec!["path.random.count=2".to_owned(), "depths=[2 mm]".to_owned()],
            folder: folder.join("finished"),
            level: Some("kinematic".to_owned()),
            seed: None,
            command_line: "skinrig run".to_owned(),
        },
        ControlHandle::new(),
    );
    let header = SessionReader::open(finished.unwrap()).unwrap().header();
    let mut writer = SessionWriter::create(folder.join("live.session.sqlite")).unwrap();
    let started = Record::Started(Box::new(header.unwrap()));
    writer.accept(started).unwrap();
    writer
}

/// Three events.
fn stream() -> Vec<u8> {
    let mut encoder = evt2::Encoder::new(0);
    let mut bytes = Vec::new();
    for x in 0..3 {
        let event = CdEvent {
            t_us: 100,
            x,
            y: 0,
            polarity: Polarity::On,
        };
        encoder.cd(event, &mut bytes).unwrap();
    }
    bytes
}

/// The first pictures that a page gets.
fn first_pictures(mut page: TcpStream) -> Value {
    let mut text = String::new();
    let mut buffer = [0; 4096];
    loop {
        let found = page.read(&mut buffer).unwrap();
        assert!(found > 0, "the stream ends: {text}");
        text.push_str(&String::from_utf8_lossy(&buffer[..found]));
        let after = text.split_once("event: pictures\ndata: ");
        if let Some((data, _)) = after.and_then(|(_, rest)| rest.split_once("\n\n")) {
            return serde_json::from_str(data).unwrap();
        }
    }
}

#[test]
fn one_follower_asks_the_run_for_all_pages() {
    let folder = tempfile::tempdir().unwrap();
    let writer = recording(folder.path());
    let options = Options {
        folder: folder.path().to_owned(),
        first: None,
        bind: Options::LOOPBACK,
        control: false,
    };
    let callers = Arc::default();
    let run = Run {
        bytes: stream(),
        callers: Arc::clone(&callers),
    };
    let server = Server::open(options, run).unwrap();
    let (to, token) = (server.address(), server.token().to_owned());
    std::thread::spawn(move || server.run_until(std::future::pending()));
    let pages: Vec<TcpStream> = (0..PAGES)
        .map(|_| {
            let mut page = TcpStream::connect(to).unwrap();
            let request = format!("GET /api/live?session=live.session.sqlite HTTP/1.1\r\nHost: {to}\r\nAuthorization: Bearer {token}\r\n\r\n");
            page.write_all(request.as_bytes()).unwrap();
            page
        })
        .collect();
    for page in pages {
        let pictures = first_pictures(page);
        for camera in 0..2 {
            let found = &pictures[camera];
            assert_eq!(
                (&found["events"], &found["unix_s"]),
                (&json!(3), &json!(TAKEN_S)),
                "{pictures}"
            );
        }
    }
    assert_eq!(callers.lock().unwrap().len(), 1);
    drop(writer);
}
