//! The driver over a real serial port (a pseudo-terminal) against the real firmware on an emulated processor.
#![expect(clippy::unwrap_used, reason = "tests")]

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
use skinrig_trigger_box::greeting::greet;
use skinrig_trigger_box::link::{Link, Patience};
use skinrig_trigger_box::protocol::{
    Counters, Event, EventKind, Events, Outcome, Reply, Request, parse_mark,
};
use skinrig_trigger_box::serial::SerialDial;
use skinrig_trigger_box::{
    Dial, OpenError, PortState, SerialTriggerBox, TriggerBoxConfig, enumerate,
};

/// Long enough for a machine that is busy with other things; a hang still fails.
const PATIENCE: Duration = Duration::from_secs(120);
/// Edges of one train on all three outputs.
const EDGES_PER_TRAIN: usize = 3 * 2 * PULSES_PER_TRAIN as usize;

/// A board, one at a time: a board keeps pace with the clock only while it has a good part of a processor.
struct Board {
    board: EmulatedBox,
    _turn: MutexGuard<'static, ()>,
}

fn start(options: &BoardOptions) -> Option<Board> {
    static TURN: Mutex<()> = Mutex::new(());
    // A test that failed has dropped its board all the same.
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

/// Settings without any limit that a busy machine could break.
fn config(board: &EmulatedBox) -> TriggerBoxConfig {
    TriggerBoxConfig {
        silence_ms: 0,
        command_timeout: PATIENCE,
        hello_timeout: PATIENCE,
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
        press: PressId(k.wrapping_mul(7919) % (1 << 17)),
    }
}

/// Sends a mark as soon as the line is free.
fn send_when_free(device: &mut SerialTriggerBox, mark: Mark) -> Result<SentMark, DeviceError> {
    let end = Instant::now() + PATIENCE;
    loop {
        match device.send(mark) {
            Err(DeviceError::State { found, .. }) if found.contains("busy") => {
                assert!(Instant::now() < end, "busy for ever");
            }
            other => return other,
        }
    }
}

/// Polls until `enough` holds of all reports so far.
fn poll_until(
    device: &mut SerialTriggerBox,
    reports: &mut Vec<BoxReport>,
    enough: impl Fn(&[BoxReport]) -> bool,
) {
    let end = Instant::now() + PATIENCE;
    while !enough(reports) {
        device.poll(reports).unwrap();
        assert!(Instant::now() < end, "never came; so far {reports:?}");
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

/// All three outputs change in the same cycle, always; the edges of one of them.
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

/// The train of `mark`, exact to the cycle.
fn assert_train(edges: &[Edge], mark: Mark) {
    let start = edges[0].cycle;
    let found: Vec<(u64, bool)> = edges.iter().map(|e| (e.cycle - start, e.high)).collect();
    let wanted: Vec<(u64, bool)> = PulseTrain::new(mark)
        .unwrap()
        .pulses()
        .flat_map(|(at, width)| {
            [
                (at * CYCLES_PER_US, true),
                ((at + width) * CYCLES_PER_US, false),
            ]
        })
        .collect();
    assert_eq!(found, wanted, "the train of {mark:?}");
}

fn run_marks(n: u32) {
    let Some(board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut device = open(&board, RealClock::start());
    let mut reports = Vec::new();
    for k in 0..n {
        let sent = send_when_free(&mut device, mark(k)).unwrap();
        assert_eq!(sent.mark, mark(k));
        let train = without_skew(&edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap());
        assert_train(&train, mark(k));
        let seen = decode_marks(&trigger_edges(&train, CAMERA_1));
        assert_eq!((seen.marks.len(), seen.stray_edges), (1, 0));
        assert_eq!(seen.marks[0].mark, mark(k));
        device.poll(&mut reports).unwrap();
    }
    poll_until(&mut device, &mut reports, |r| {
        marks_in(r).len() >= n as usize
    });
    let told: Vec<Mark> = marks_in(&reports).into_iter().map(|(m, _)| m).collect();
    assert_eq!(told, (0..n).map(mark).collect::<Vec<_>>());
    let counters = device.counters().unwrap();
    assert_eq!((counters.marks, counters.late_edges), (n, 0));
    assert_eq!((counters.overruns, counters.dropped_events), (0, 0));
    assert_eq!(
        edges.next(Duration::ZERO).unwrap(),
        None,
        "an edge too many"
    );
}

#[test]
fn trains_are_exact_to_the_cycle_on_all_outputs_at_once() {
    run_marks(313); // 10,016 pulses
}

/// 3,125 trains are 100,000 pulses.
#[test]
#[ignore = "takes most of a minute: cargo test -p skinrig-trigger-box --test emulated -- --ignored"]
fn a_hundred_thousand_pulses_without_loss() {
    run_marks(3_125);
}

#[test]
fn the_contract_holds() {
    // One board for all boxes that the suite asks for.
    let Some(board) = start(&paced()) else {
        return;
    };
    let marks = [mark(3), mark(4), mark(5)];
    contract::trigger_box(
        &mut || {
            let clock = RealClock::start();
            (Box::new(open(&board, clock)), Box::new(clock))
        },
        &marks,
    );
}

fn monotonic_ns() -> i64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    t.tv_sec * 1_000_000_000 + t.tv_nsec
}

/// A clock and its zero on the monotonic clock, which lies between the two numbers.
fn clock_with_origin() -> (RealClock, i64, i64) {
    let before = monotonic_ns();
    let clock = RealClock::start();
    (clock, before, monotonic_ns())
}

#[test]
fn host_times_are_certain_and_box_times_are_those_of_the_edges() {
    let options = BoardOptions {
        ppm: 300.0,
        ..paced()
    };
    let Some(mut board) = start(&options) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let (clock, origin_low, origin_high) = clock_with_origin();
    let mut device = open(&board, clock);
    let mut reports = Vec::new();
    let truth = |cycle: u64, edges: &EdgeStream| {
        let ns = edges.clock().host_ns(cycle);
        (HostTime(ns - origin_high), HostTime(ns - origin_low))
    };
    let mut starts = Vec::new();
    for k in 0..8 {
        let sent = send_when_free(&mut device, mark(k)).unwrap();
        let train = edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap();
        let (earliest, latest) = truth(train[0].cycle, &edges);
        let (low, high) = (
            sent.t.0 - sent.uncertainty_ns,
            sent.t.0 + sent.uncertainty_ns,
        );
        assert!(
            low <= latest.0 && earliest.0 <= high,
            "the edge rose at {earliest}..{latest}, told was {} +- {} ns",
            sent.t,
            sent.uncertainty_ns
        );
        starts.push(train[0].cycle);
    }
    // Two edges of the input, half a millisecond apart.
    let soon = board.input(true).unwrap() + 2_000_000;
    board
        .plan_input(&[(false, soon), (true, soon + 8_000)])
        .unwrap();
    let input = edges.take(2, PATIENCE).unwrap();
    assert!(input.iter().all(|e| e.pin == INPUT));
    poll_until(&mut device, &mut reports, |r| {
        let inputs = r.iter().filter(|r| matches!(r, BoxReport::Input { .. }));
        marks_in(r).len() == starts.len() && inputs.count() == 2
    });
    // The box's zero lies some cycles after the board's: the same for all that it stamped.
    let told = marks_in(&reports);
    let zero = starts[0] - told[0].1.us * CYCLES_PER_US;
    for (start, (_, at)) in starts.iter().zip(&told) {
        assert_eq!(start - zero, at.us * CYCLES_PER_US);
    }
    let inputs: Vec<(bool, u64)> = reports
        .iter()
        .filter_map(|r| match r {
            BoxReport::Input { rising, at } => Some((*rising, at.us)),
            _ => None,
        })
        .collect();
    for (edge, (rising, at_us)) in input.iter().zip(inputs) {
        assert_eq!(rising, edge.high);
        // Stamped by the capture unit, told in whole microseconds.
        assert!(((edge.cycle - zero) / CYCLES_PER_US).abs_diff(at_us) <= 1);
    }
    // Each exchange holds the instant of the host that belongs to its box time.
    let mut exchanges = 0;
    for report in &reports {
        if let BoxReport::Exchange { sent, received, at } = report {
            let (earliest, latest) = truth(at.us * CYCLES_PER_US + zero, &edges);
            // Whole microseconds were cut off.
            assert!(sent.0 <= latest.0 + 1_000 && earliest.0 <= received.0);
            exchanges += 1;
        }
    }
    assert!(exchanges > 0);
    assert_eq!(device.clock_contradictions(), 0);
}

#[test]
fn sync_trains_count_on_among_marks() {
    let Some(board) = start(&paced()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut device = open(&board, RealClock::start());
    device.set_sync(Some(300)).unwrap();
    let mut reports = Vec::new();
    for k in 0..6 {
        send_when_free(&mut device, mark(k)).unwrap();
    }
    poll_until(&mut device, &mut reports, |r| {
        marks_in(r).len() == 6 && syncs_in(r).len() >= 4
    });
    device.set_sync(None).unwrap();
    let end = Instant::now() + PATIENCE;
    while device.counters().unwrap().syncs as usize > syncs_in(&reports).len() {
        device.poll(&mut reports).unwrap();
        assert!(Instant::now() < end, "sync trains were not told");
    }
    let counts: Vec<u32> = syncs_in(&reports).iter().map(|s| s.0).collect();
    assert_eq!(counts, (0..counts.len() as u32).collect::<Vec<_>>());
    let trains = counts.len() + 6;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, PATIENCE).unwrap());
    let seen = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!((seen.stray_edges, seen.lost_edges), (0, 0));
    let marks: Vec<Mark> = seen.marks.iter().map(|m| m.mark).collect();
    assert_eq!(marks, (0..6).map(mark).collect::<Vec<_>>());
    let on_the_line: Vec<u32> = seen.syncs.iter().map(|s| s.count).collect();
    assert_eq!(on_the_line, counts);
}

#[test]
fn a_mark_follows_the_sync_train_under_way() {
    let Some(board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = asker(&board);
    let sync = |period_ms| Request::Sync {
        period_ms,
        first: 1 << 17,
    };
    ask(Request::Arm { silence_ms: 0 });
    assert_eq!(ask(sync(27)).outcome, Outcome::BadArgument);
    assert_eq!(ask(sync(28)).outcome, Outcome::Done);
    // Told instants of first edges, and whether the mark had to wait for longer than the rest after another mark.
    let mut told = Vec::new();
    let end = Instant::now() + PATIENCE;
    while told.len() < 40 || !told.iter().any(|&(_, waited)| waited) {
        let number = told.len() as u32 + 1;
        let m = Request::Mark {
            number,
            mark: mark(number),
        };
        let reply = ask(m);
        if reply.outcome == Outcome::Done {
            let start = parse_mark(&reply.answers).unwrap().0;
            told.push((
                start,
                start.saturating_sub(reply.at.0) > 2_000 * CYCLES_PER_US,
            ));
        }
        assert!(Instant::now() < end, "no mark met a sync train");
    }
    ask(sync(0));
    let mut status = ask(Request::Status);
    while status.flags.train() {
        status = ask(Request::Status);
        assert!(Instant::now() < end, "a train without end");
    }
    let counters = Counters::parse(&status.answers).unwrap();
    let trains = (counters.marks + counters.syncs) as usize;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, PATIENCE).unwrap());
    let seen = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!(counters.late_edges, 0);
    assert_eq!((seen.stray_edges, seen.lost_edges), (0, 0));
    assert_eq!(seen.marks.len(), told.len());
    // The first count was one too many for its 17 bits.
    assert_eq!(seen.syncs[0].count, 0);
    let starts: Vec<u64> = all
        .chunks(2 * PULSES_PER_TRAIN as usize)
        .map(|train| train[0].cycle)
        .collect();
    let train = PulseTrain::DURATION_US * CYCLES_PER_US;
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] >= train));
    let is_mark = |cycle: u64| seen.marks.iter().any(|m| m.t_us == cycle / CYCLES_PER_US);
    let marks: Vec<u64> = starts.iter().copied().filter(|&c| is_mark(c)).collect();
    for (&cycle, (ticks, waited)) in marks.iter().zip(&told) {
        assert_eq!(cycle - marks[0], ticks - told[0].0, "told another instant");
        let before = cycle.checked_sub(train);
        let behind = before.is_some_and(|c| starts.contains(&c) && !is_mark(c));
        assert!(behind || !waited, "it waited for nothing");
    }
}

fn syncs_in(reports: &[BoxReport]) -> Vec<(u32, BoxTime)> {
    let only_syncs = reports.iter().filter_map(|r| match *r {
        BoxReport::Sync { count, at } => Some((count, at)),
        _ => None,
    });
    only_syncs.collect()
}

#[test]
fn on_a_noisy_line_every_mark_is_sent_once_or_named() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut device = SerialTriggerBox::open(
        TriggerBoxConfig {
            reply_timeout: Duration::from_millis(30),
            ..config(&board)
        },
        RealClock::start(),
    )
    .unwrap();
    device.arm().unwrap();
    let noise = NoisePerMillion {
        flip: 3_000,
        drop: 3_000,
        insert: 3_000,
    };
    board.noise(20_260_101, noise).unwrap();
    let mut sent = Vec::new();
    for k in 0..120 {
        match send_when_free(&mut device, mark(k)) {
            Ok(s) => sent.push((s.mark, true)),
            Err(DeviceError::Lost { .. }) => sent.push((mark(k), false)),
            Err(other) => panic!("{other}"),
        }
    }
    let done = board.noise(0, NoisePerMillion::default()).unwrap();
    assert!(
        done.flipped > 5 && done.dropped > 5 && done.inserted > 5,
        "{done:?}: the test tests nothing"
    );
    let counters = device.counters().unwrap();
    assert!(counters.bad_checksums + counters.bad_frames > 0);
    let trains = counters.marks as usize;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, PATIENCE).unwrap());
    let seen = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!(seen.stray_edges, 0);
    // In order and never twice; a mark is missing only where an error said so.
    let mut on_the_line = seen.marks.iter().map(|m| m.mark).peekable();
    for (mark, certain) in sent {
        let there = on_the_line.next_if_eq(&mark).is_some();
        assert!(there || !certain, "{mark:?} was promised and not sent");
    }
    assert_eq!(on_the_line.next(), None, "a train that nobody asked for");
    // The events came through the noise as well.
    let mut reports = Vec::new();
    poll_until(&mut device, &mut reports, |r| marks_in(r).len() >= trains);
    assert_eq!(marks_in(&reports).len(), trains);
}

#[test]
fn a_box_that_was_unplugged_comes_back() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut device = open(&board, RealClock::start());
    send_when_free(&mut device, mark(1)).unwrap();
    edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap();
    board.unplug().unwrap();
    let lost = device.send(mark(2)).unwrap_err();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    let mut reports = Vec::new();
    let lost = device.poll(&mut reports).unwrap_err();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    board.plug().unwrap();
    comes_back(&mut device, &mut reports);
    // Armed again, and with a fresh count of marks.
    send_when_free(&mut device, mark(3)).unwrap();
    let train = without_skew(&edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap());
    assert_train(&train, mark(3));
}

/// Polls through the time in which the box is lost, until it has told one reset.
fn comes_back(device: &mut SerialTriggerBox, reports: &mut Vec<BoxReport>) {
    let end = Instant::now() + PATIENCE;
    loop {
        let answer = device.poll(reports);
        assert!(
            matches!(answer, Ok(()) | Err(DeviceError::Lost { .. })),
            "{answer:?}"
        );
        let resets = reports
            .iter()
            .filter(|r| matches!(r, BoxReport::Reset { .. }));
        if resets.count() == 1 && answer.is_ok() {
            return;
        }
        assert!(Instant::now() < end, "it did not come back");
        std::thread::yield_now();
    }
}

#[test]
fn a_brown_out_is_told_as_a_reset_and_its_cause_is_kept() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut device = open(&board, RealClock::start());
    device.set_sync(Some(300)).unwrap();
    let mut reports = Vec::new();
    poll_until(&mut device, &mut reports, |r| syncs_in(r).len() > 1);
    let before = syncs_in(&reports).last().unwrap().0;
    board.reset(ResetCause::BrownOut).unwrap();
    comes_back(&mut device, &mut reports);
    let reset = reports
        .iter()
        .position(|r| matches!(r, BoxReport::Reset { .. }))
        .unwrap();
    // Sync trains go on by themselves, with counts that were never used.
    poll_until(&mut device, &mut reports, |r| {
        !syncs_in(&r[reset..]).is_empty()
    });
    assert!(syncs_in(&reports[reset..])[0].0 > before + 1);
    let cause = device.counters().unwrap().reset_cause;
    assert_eq!(cause.to_string(), "brown-out");
    send_when_free(&mut device, mark(9)).unwrap();
}

/// Talks to the box without the driver around it.
fn asker(board: &EmulatedBox) -> impl FnMut(Request) -> Reply + use<> {
    let port = board.port().to_str().unwrap();
    let mut link = Link::new(SerialDial::new(port).dial().unwrap(), RealClock::start());
    let greeted = greet(&mut link, port, Some("TB-0001"), PATIENCE).unwrap();
    assert_eq!(greeted.identity.serial, "TB-0001");
    let patience = Patience {
        per_try: Duration::from_millis(60),
        total: PATIENCE,
    };
    move |request| link.ask(&request, patience).unwrap().reply
}

#[test]
fn inputs_shift_no_pulse_and_pulses_shift_no_stamp() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut ask = asker(&board);
    ask(Request::Arm { silence_ms: 0 });
    board.loop_back(1).unwrap();
    let mut edges = board.edges().unwrap();
    let mut zero = None;
    // The input follows the spare output so late that its interrupt meets that of the next edge, in every way.
    for (k, delay_us) in (0..).zip([0, 3, 20, 32, 38, 42, 45, 47, 48, 49, 51, 58, 65, 75, 95, 99]) {
        board.loop_back(1 + delay_us * CYCLES_PER_US).unwrap();
        let from = Events::parse(&ask(Request::Events { from: 0 }).answers)
            .unwrap()
            .next;
        ask(Request::Events { from });
        let m = Request::Mark {
            number: k + 1,
            mark: mark(k),
        };
        let reply = ask(m);
        assert_eq!(reply.outcome, Outcome::Done);
        let start = parse_mark(&reply.answers).unwrap().0;
        let of_both = edges.take(EDGES_PER_TRAIN / 3 * 4, PATIENCE).unwrap();
        let (inputs, outputs): (Vec<Edge>, Vec<Edge>) =
            of_both.into_iter().partition(|e| e.pin == INPUT);
        let train = without_skew(&outputs);
        assert_train(&train, mark(k));
        let zero = *zero.get_or_insert(train[0].cycle - start);
        assert_eq!(train[0].cycle - start, zero, "a train beside its time");
        let mut stamps = Vec::new();
        // The box keeps 48 events before the input is refused: the mark and 47 edges, if nobody asks meanwhile.
        let mut from = from;
        while stamps.len() < 47 {
            let events = Events::parse(&ask(Request::Events { from }).answers).unwrap();
            from = events.first + events.events.len() as u32;
            for event in events.events {
                if let EventKind::Input { rising } = event.kind {
                    stamps.push((rising, event.at.0));
                }
            }
        }
        for (edge, (rising, ticks)) in inputs.iter().zip(stamps) {
            assert_eq!(rising, edge.high);
            // The emulator lets an edge take effect between two instructions, not within one.
            let off = (edge.cycle - zero).abs_diff(ticks);
            assert!(
                off <= 3,
                "stamped {off} cycles off, {delay_us} us after the output"
            );
        }
    }
    let counters = Counters::parse(&ask(Request::Status).answers).unwrap();
    assert_eq!((counters.late_edges, counters.input_glitches), (0, 0));
}

#[test]
fn a_noisy_input_takes_nothing_from_the_trains() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = asker(&board);
    ask(Request::Arm { silence_ms: 0 });
    let (mut marks, mut told, mut from) = (0, Vec::new(), 0);
    // From far more edges than the processor can stamp to fewer than are refused.
    for gap_us in [2, 5, 9, 14, 23, 40, 61] {
        let soon = board.input(true).unwrap() + 8_000_000;
        let noise: Vec<(bool, u64)> = (0..300)
            .map(|k| (k % 2 == 1, soon + k * gap_us * CYCLES_PER_US))
            .collect();
        board.plan_input(&noise).unwrap();
        while board.cycle().unwrap() < soon + 299 * gap_us * CYCLES_PER_US {
            marks += 1;
            let m = Request::Mark {
                number: marks,
                mark: mark(marks),
            };
            while ask(m.clone()).outcome != Outcome::Done {}
            let mut outputs = Vec::new();
            while outputs.len() < EDGES_PER_TRAIN {
                let edge = edges.next(PATIENCE).unwrap().unwrap();
                if edge.pin != INPUT {
                    outputs.push(edge);
                }
            }
            assert_train(&without_skew(&outputs), mark(marks));
            // A slow host takes six events for each mark, while the input would fill all that is free.
            let events = Events::parse(&ask(Request::Events { from }).answers).unwrap();
            from = events.first + events.events.len() as u32;
            told.extend(events.events);
        }
    }
    loop {
        let events = Events::parse(&ask(Request::Events { from }).answers).unwrap();
        from = events.first + events.events.len() as u32;
        told.extend(events.events);
        if from == events.next {
            break;
        }
    }
    let is_mark = |e: &&Event| matches!(e.kind, EventKind::Mark(_));
    assert_eq!(told.iter().filter(is_mark).count(), marks as usize);
    let counters = Counters::parse(&ask(Request::Status).answers).unwrap();
    assert_eq!(counters.marks, marks);
    assert_eq!((counters.late_edges, counters.dropped_events), (0, 0));
    assert!(counters.input_mutes > 0, "{counters:?}");
    assert!(counters.ignored_edges > 0, "{counters:?}");
}

#[test]
fn a_firmware_that_hangs_is_restarted_by_its_watchdog() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut device = open(&board, RealClock::start());
    board.hang().unwrap();
    comes_back(&mut device, &mut Vec::new());
    let cause = device.counters().unwrap().reset_cause;
    assert_eq!(cause.to_string(), "watchdog");
    send_when_free(&mut device, mark(1)).unwrap();
}

#[test]
fn a_silent_host_disarms_the_box() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = asker(&board);
    let sync = |period_ms| Request::Sync {
        period_ms,
        first: 0,
    };
    assert_eq!(ask(sync(50)).outcome, Outcome::NotArmed);
    let m = Request::Mark {
        number: 1,
        mark: mark(0),
    };
    assert_eq!(ask(m.clone()).outcome, Outcome::NotArmed);
    // A second of the box's time is much less of ours, so it may be over before the second request.
    let end = Instant::now() + PATIENCE;
    loop {
        assert_eq!(
            ask(Request::Arm { silence_ms: 1_000 }).outcome,
            Outcome::Done
        );
        if ask(sync(50)).outcome == Outcome::Done {
            break;
        }
        assert!(Instant::now() < end, "disarmed each time");
    }
    edges.take(10 * EDGES_PER_TRAIN, PATIENCE).unwrap();
    // Two more seconds of it.
    let end = board.cycle().unwrap() + 2_000_000 * CYCLES_PER_US;
    while board.cycle().unwrap() < end {
        std::thread::yield_now();
    }
    let reply = ask(Request::Status);
    assert!(reply.flags.disarmed_by_silence() && !reply.flags.armed() && !reply.flags.syncing());
    let counters = Counters::parse(&reply.answers).unwrap();
    assert!((10..=21).contains(&counters.syncs), "{counters:?}");
    assert_eq!(ask(m).outcome, Outcome::NotArmed);
}

#[test]
fn the_box_answers_a_repeated_mark_without_a_second_train() {
    let Some(board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = asker(&board);
    ask(Request::Arm { silence_ms: 0 });
    let m = |number| Request::Mark {
        number,
        mark: mark(number),
    };
    let first = ask(m(1));
    assert_eq!(first.outcome, Outcome::Done);
    edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap();
    assert_eq!(ask(m(1)).answers, first.answers);
    assert_eq!(ask(m(3)).outcome, Outcome::OutOfOrder);
    assert_eq!(ask(m(0)).outcome, Outcome::OutOfOrder);
    assert_eq!(ask(m(2)).outcome, Outcome::Done);
    without_skew(&edges.take(EDGES_PER_TRAIN, PATIENCE).unwrap());
    let counters = Counters::parse(&ask(Request::Status).answers).unwrap();
    assert_eq!(counters.marks, 2);
}

#[test]
fn what_is_behind_a_port_is_told_with_the_next_step() {
    let Some(board) = start(&paced()) else {
        return;
    };
    let port = board.port().to_str().unwrap().to_owned();
    let ports = [port.clone(), "/dev/no-such-port".to_owned()];
    let found = enumerate(&ports, PATIENCE);
    assert!(
        matches!(&found[0].state, PortState::Ready(identity) if identity.serial == "TB-0001"),
        "{}",
        found[0].state
    );
    assert!(found[1].state.to_string().contains("plug the box in"));
    let device = open(&board, RealClock::start());
    let found = enumerate(&ports[..1], PATIENCE);
    assert!(
        matches!(found[0].state, PortState::Closed(OpenError::Busy(_))),
        "{}",
        found[0].state
    );
    drop(device);
    let wrong = TriggerBoxConfig {
        serial: Some("TB-0002".to_owned()),
        ..config(&board)
    };
    let Err(error) = SerialTriggerBox::open(wrong, RealClock::start()) else {
        panic!("took the wrong box");
    };
    assert!(matches!(error, DeviceError::Refused { .. }), "{error}");
}

#[test]
fn a_new_serial_number_is_kept_and_the_self_test_sees_the_outputs() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut device = SerialTriggerBox::open(config(&board), RealClock::start()).unwrap();
    let refused = device.set_serial("with blanks").unwrap_err();
    assert!(matches!(refused, DeviceError::Refused { .. }), "{refused}");
    assert!(matches!(device.self_test(), Err(DeviceError::State { .. })));
    device.set_serial("TB-7").unwrap();
    drop(device);
    board.reset(ResetCause::Button).unwrap();
    let mut device = open(&board, RealClock::start());
    assert_eq!(device.identity().serial, "TB-7");
    let mut edges = board.edges().unwrap();
    let test = device.self_test().unwrap();
    assert!(test.rose && test.fell && !test.input_followed);
    assert_eq!(edges.take(6, PATIENCE).unwrap().len(), 6);
    board.loop_back(100).unwrap();
    assert!(device.self_test().unwrap().input_followed);
}
