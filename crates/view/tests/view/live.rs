//! A running session over HTTP: its pages see what the run has received before the file has it.
#![expect(clippy::unwrap_used, reason = "a test without a server must fail")]

use std::collections::HashSet;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use skinrig::library::{ControlHandle, Program, ProtocolSource, Simulation, simulate};
use skinrig_analysis::Analysis;
use skinrig_formats::evt2;
use skinrig_model::{
    AttemptId, CameraId, CdEvent, ChunkFacts, HostTime, Polarity, PressId, RawChunk, Record,
    RunHeader, TouchEstimate, TouchKind,
};
use skinrig_recorder::{SessionReader, SessionWriter};
use skinrig_view::{
    AnalysisEntry, Lab, LabError, NewestBytes, Options, RunState, Server, SettingDifference,
    ShelfSession,
};

/// Pages that are open at the same time.
const PAGES: usize = 10;
/// Chunks of 1 MiB that a measured session holds.
const CHUNKS: u64 = 256;
/// Measured sessions without pages, and as many with them.
const ROUNDS: usize = 7;
/// Time after which a test without an answer fails.
const PATIENCE: Duration = Duration::from_secs(60);
/// When the run took its newest bytes, s.
const TAKEN_S: f64 = 1234.5;
/// Protocol of the session whose header the recorded one has.
const PROTOCOL: &str = include_str!("../../../../protocols/depth-sweep.yaml");

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

    fn shelf(&self, folder: &Path) -> Result<Vec<ShelfSession>, LabError> {
        Program.shelf(folder)
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

/// Header of a recorded session.
fn header(folder: &Path) -> RunHeader {
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
    let reader = SessionReader::open(finished.unwrap()).unwrap();
    reader.header().unwrap()
}

/// A session that is being recorded and has no camera data yet.
fn recording(folder: &Path, name: &str, header: &RunHeader) -> SessionWriter {
    let mut writer = SessionWriter::create(folder.join(name)).unwrap();
    let started = Record::Started(Box::new(header.clone()));
    writer.accept(started).unwrap();
    writer
}

/// Events, one per microsecond.
fn stream(events: u64) -> Vec<u8> {
    let mut encoder = evt2::Encoder::new(0);
    let mut bytes = Vec::new();
    for n in 0..events {
        let event = CdEvent {
            t_us: 100 + n,
            x: (n * 211 % 640) as u16,
            y: (n * 97 % 480) as u16,
            polarity: Polarity::On,
        };
        encoder.cd(event, &mut bytes).unwrap();
    }
    bytes
}

/// The first pictures that a page gets from the run. Until the run answers they come from the file, which has none yet.
fn first_pictures(mut page: TcpStream) -> Value {
    let mut text = String::new();
    let mut buffer = [0; 4096];
    let began = Instant::now();
    page.set_read_timeout(Some(PATIENCE)).unwrap();
    loop {
        assert!(began.elapsed() < PATIENCE, "none from the run: {text}");
        let found = page.read(&mut buffer).unwrap();
        assert!(found > 0, "the stream ends: {text}");
        text.push_str(&String::from_utf8_lossy(&buffer[..found]));
        let messages = text.split("event: pictures\ndata: ").skip(1);
        let whole = messages.filter_map(|m| Some(m.split_once("\n\n")?.0));
        let mut pictures = whole.map(|data| serde_json::from_str::<Value>(data).unwrap());
        if let Some(found) = pictures.find(|p| !p[0].is_null()) {
            return found;
        }
    }
}

/// A server whose runs answer with `bytes`, and the threads that ask them.
fn serve(folder: &Path, bytes: Vec<u8>) -> (Access, Arc<Mutex<HashSet<ThreadId>>>) {
    let options = Options {
        folder: folder.to_owned(),
        first: None,
        bind: Options::LOOPBACK,
        control: false,
    };
    let callers = Arc::default();
    let run = Run {
        bytes,
        callers: Arc::clone(&callers),
    };
    let server = Server::open(options, run).unwrap();
    let access = (server.address(), server.token().to_owned());
    std::thread::spawn(move || server.run_until(std::future::pending()));
    (access, callers)
}

/// Address and token.
type Access = (SocketAddr, String);

/// Open live pages of a session.
fn pages((to, token): &Access, name: &str) -> Vec<TcpStream> {
    let open = |_| {
        let mut page = TcpStream::connect(to).unwrap();
        let request = format!(
            "GET /api/live?session={name} HTTP/1.1\r\nHost: {to}\r\nAuthorization: Bearer {token}\r\n\r\n"
        );
        page.write_all(request.as_bytes()).unwrap();
        page
    };
    (0..PAGES).map(open).collect()
}

#[test]
fn one_follower_asks_the_run_for_all_pages() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(folder.path());
    let name = "live.session.sqlite";
    let writer = recording(folder.path(), name, &header);
    let (access, callers) = serve(folder.path(), stream(3));
    for page in pages(&access, name) {
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

/// What the server answers to a request for `what` of a session.
fn answer((to, token): &Access, what: &str, name: &str) -> Value {
    let mut page = TcpStream::connect(to).unwrap();
    let request = format!(
        "GET /api/{what}?session={name} HTTP/1.1\r\nHost: {to}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\r\n"
    );
    page.write_all(request.as_bytes()).unwrap();
    let mut text = String::new();
    page.read_to_string(&mut text).unwrap();
    let (_, body) = text.split_once("\r\n\r\n").unwrap();
    serde_json::from_str(body).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn a_page_gets_the_touches_that_were_felt() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(folder.path());
    let name = "felt.session.sqlite";
    let mut writer = recording(folder.path(), name, &header);
    for (ms, kind, at_mm) in [
        (1_500, TouchKind::Onset, Some([4.0, 5.0])),
        (1_750, TouchKind::Release, None),
    ] {
        let t = HostTime(ms * 1_000_000);
        let touch = TouchEstimate {
            t,
            until: t,
            until_sd_ns: 0,
            kind,
            attempt: None,
            at_mm,
            region: None,
            depth: None,
            llr: None,
        };
        writer.accept(Record::Touch(touch)).unwrap();
    }
    // Durable, because the writer waits before an attempt begins.
    let attempt = AttemptId {
        press: PressId::from_index(0),
        number: 1,
    };
    let t = HostTime(2_000_000_000);
    writer.accept(Record::Intent { attempt, t }).unwrap();
    let (access, _) = serve(folder.path(), Vec::new());
    let found = answer(&access, "session", name);
    assert_eq!(
        found["touches"],
        json!([
            [1.5, "onset", [4.0, 5.0], null, null],
            [1.75, "release", null, null, null]
        ]),
        "{found}"
    );
}

/// Records `CHUNKS` chunks of 1 MiB; how long it takes until they are durable, s.
fn record(mut writer: SessionWriter, chunk: &[u8]) -> f64 {
    let began = Instant::now();
    for n in 0..CHUNKS {
        let chunk = RawChunk {
            camera: CameraId::ALL[(n % 2) as usize],
            seq: n / 2,
            host_time: HostTime(n as i64),
            lost_before: 0,
            lost_from_us: None,
            bytes: chunk.to_vec(),
            facts: ChunkFacts::default(),
            triggers: Vec::new(),
        };
        writer.accept(Record::Chunk(chunk)).unwrap();
    }
    let attempt = AttemptId {
        press: PressId::from_index(0),
        number: 1,
    };
    let t = HostTime(CHUNKS as i64);
    writer.accept(Record::Intent { attempt, t }).unwrap();
    began.elapsed().as_secs_f64()
}

/// Two busy cameras, in turn without and with ten pages: every chunk is in the file. Prints what the pages cost.
#[test]
#[ignore = "writes 4 GB: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-view live -- --ignored --nocapture"]
fn ten_pages_beside_a_busy_recorder() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(folder.path());
    let chunk: Vec<u8> = stream(1 << 18).into_iter().take(1 << 20).collect();
    let (access, _) = serve(folder.path(), chunk[..1 << 17].to_vec());
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..2 * ROUNDS {
        let name = format!("{round}.session.sqlite");
        let writer = recording(folder.path(), &name, &header);
        let with_pages = round % 2 == 1;
        let open = if with_pages {
            pages(&access, &name)
        } else {
            Vec::new()
        };
        let readers: Vec<_> = open
            .into_iter()
            .map(|mut page| {
                let mut first = [0; 1];
                // The follower is at work.
                page.read_exact(&mut first).unwrap();
                let twin = page.try_clone().unwrap();
                let read =
                    std::thread::spawn(move || std::io::copy(&mut page, &mut std::io::sink()));
                (twin, read)
            })
            .collect();
        times[usize::from(with_pages)].push(record(writer, &chunk));
        for (page, read) in readers {
            page.shutdown(std::net::Shutdown::Both).unwrap();
            let _ = read.join().unwrap();
        }
        let path = folder.path().join(name);
        let reader = SessionReader::open(&path).unwrap();
        let chunks = CameraId::ALL.map(|camera| reader.chunk_index(camera).unwrap());
        assert_eq!(chunks.each_ref().map(Vec::len), [CHUNKS as usize / 2; 2]);
        assert!(chunks.iter().flatten().all(|c| c.lost_before == 0));
        drop(reader);
        std::fs::remove_file(path).unwrap();
    }
    let [without, with] = times.map(|mut all| {
        all.sort_by(f64::total_cmp);
        [all[0], all[all.len() / 2]]
    });
    let slower = |k: usize| 100.0 * (with[k] / without[k] - 1.0);
    println!(
        "{ROUNDS} rounds of {CHUNKS} MiB: best {:.0} MB/s, with {PAGES} pages {:+.1} % time; median {:+.1} %",
        CHUNKS as f64 * 1.048_576 / without[0],
        slower(0),
        slower(1),
    );
}
