//! The driver on a pseudo-terminal with the real firmware on an emulated processor.
#![expect(clippy::unwrap_used, reason = "tests")]

mod clock;
mod talk;
mod trains;
mod trouble;

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, RealClock, TriggerBox, contract};
use skinrig_emulated_trigger_box::{
    BoardOptions, CAMERA_1, CAMERA_2, CYCLES_PER_US, Edge, EdgeStream, EmulatedBox, INPUT,
    NoisePerMillion, ResetCause, SPARE, trigger_edges,
};
use skinrig_model::pulse::{PULSES_PER_TRAIN, PulseTrain, decode_marks};
use skinrig_model::{BoxReport, BoxTime, HostTime, Mark, MarkKind, PressId, SentMark};
use skinrig_trigger_box::handshake::run_handshake;
use skinrig_trigger_box::link::{Link, RequestTimeouts};
use skinrig_trigger_box::protocol::{
    Counters, Event, EventKind, Events, Outcome, Reply, Request, parse_mark,
};
use skinrig_trigger_box::serial::SerialConnector;
use skinrig_trigger_box::{
    Connector, OpenError, PortState, SerialTriggerBox, TriggerBoxConfig, enumerate,
};

/// Long enough for a busy machine; a hang still fails.
const TIMEOUT: Duration = Duration::from_secs(120);

/// Edges per train on all three outputs.
const EDGES_PER_TRAIN: usize = 3 * 2 * PULSES_PER_TRAIN as usize;

/// An emulated board. Boards run one at a time, because each needs a good part of a processor to keep real time.
struct Board {
    board: EmulatedBox,
    _turn: MutexGuard<'static, ()>,
}

fn start(options: &BoardOptions) -> Option<Board> {
    static TURN: Mutex<()> = Mutex::new(());
    // A test that failed has dropped its board anyway.
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let board = EmulatedBox::start_or_skip(options)?;
    Some(Board { board, _turn: turn })
}

impl Deref for Board {
    type Target = EmulatedBox;
    fn deref(&self) -> &EmulatedBox {
        &self.board
    }
}

impl DerefMut for Board {
    fn deref_mut(&mut self) -> &mut EmulatedBox {
        &mut self.board
    }
}

fn paced() -> BoardOptions {
    BoardOptions {
        serial: Some("TB-0001".to_owned()),
        ..BoardOptions::default()
    }
}

fn free_running() -> BoardOptions {
    BoardOptions {
        free_running: true,
        ..paced()
    }
}

/// Configuration without time limits that a busy machine could exceed.
fn config(board: &EmulatedBox) -> TriggerBoxConfig {
    TriggerBoxConfig {
        silence_ms: 0,
        command_timeout: TIMEOUT,
        hello_timeout: TIMEOUT,
        ..TriggerBoxConfig::new(board.port().to_str().unwrap())
    }
}

fn open(board: &EmulatedBox, clock: RealClock) -> SerialTriggerBox {
    let mut device = SerialTriggerBox::open(config(board), clock).unwrap();
    device.arm().unwrap();
    device
}

fn mark(k: u32) -> Mark {
    Mark {
        kind: MarkKind::ALL[k as usize % 5],
        press: PressId::from_index(k.wrapping_mul(7919) % (1 << 17)),
    }
}

/// Sends a mark as soon as the line is free.
fn send_when_free(device: &mut SerialTriggerBox, mark: Mark) -> Result<SentMark, DeviceError> {
    let end = Instant::now() + TIMEOUT;
    loop {
        match device.send(mark) {
            Err(DeviceError::State { found, .. }) if found.contains("busy") => {
                assert!(Instant::now() < end, "still busy");
            }
            other => return other,
        }
    }
}

/// Polls until `enough` is true for all reports so far.
fn poll_until(
    device: &mut SerialTriggerBox,
    reports: &mut Vec<BoxReport>,
    enough: impl Fn(&[BoxReport]) -> bool,
) {
    let end = Instant::now() + TIMEOUT;
    while !enough(reports) {
        device.poll(reports).unwrap();
        assert!(Instant::now() < end, "timed out after {reports:?}");
        std::thread::yield_now();
    }
}

fn marks_in(reports: &[BoxReport]) -> Vec<(Mark, BoxTime)> {
    let only_marks = reports.iter().filter_map(|r| match *r {
        BoxReport::Mark { mark, at } => Some((mark, at)),
        _ => None,
    });
    only_marks.collect()
}

/// Edges of one output, after checking that all three outputs always change in the same cycle.
fn without_skew(edges: &[Edge]) -> Vec<Edge> {
    for together in edges.chunks(3) {
        let pins: Vec<u8> = together.iter().map(|e| e.pin).collect();
        assert_eq!(pins, [CAMERA_1, CAMERA_2, SPARE]);
        assert!(
            together
                .iter()
                .all(|e| e.cycle == together[0].cycle && e.high == together[0].high),
            "skew: {together:?}"
        );
    }
    edges
        .iter()
        .copied()
        .filter(|e| e.pin == CAMERA_1)
        .collect()
}

/// Verifies the train of `mark` cycle by cycle.
fn assert_train(edges: &[Edge], mark: Mark) {
    let start = edges[0].cycle;
    let found: Vec<(u64, bool)> = edges.iter().map(|e| (e.cycle - start, e.high)).collect();
    let expected: Vec<(u64, bool)> = PulseTrain::new(mark)
        .unwrap()
        .pulses()
        .flat_map(|(at, width)| {
            [
                (at * CYCLES_PER_US, true),
                ((at + width) * CYCLES_PER_US, false),
            ]
        })
        .collect();
    assert_eq!(found, expected, "the train of {mark:?}");
}

fn syncs_in(reports: &[BoxReport]) -> Vec<(u32, BoxTime)> {
    let only_syncs = reports.iter().filter_map(|r| match *r {
        BoxReport::Sync { count, at } => Some((count, at)),
        _ => None,
    });
    only_syncs.collect()
}

/// Sends requests to the box without the driver.
fn requester(board: &EmulatedBox) -> impl FnMut(Request) -> Reply + use<> {
    let port = board.port().to_str().unwrap();
    let mut link = Link::new(
        SerialConnector::new(port).connect().unwrap(),
        RealClock::start(),
    );
    let handshake = run_handshake(&mut link, port, Some("TB-0001"), TIMEOUT).unwrap();
    assert_eq!(handshake.identity.serial, "TB-0001");
    let patience = RequestTimeouts {
        per_try: Duration::from_millis(60),
        total: TIMEOUT,
    };
    move |request| link.request(&request, patience).unwrap().reply
}
