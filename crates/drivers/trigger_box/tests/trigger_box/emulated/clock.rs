//! The box's clock: accuracy of times, and counts of sync trains.

use super::*;

fn monotonic_ns() -> i64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    t.tv_sec * 1_000_000_000 + t.tv_nsec
}

/// A clock and two monotonic times that enclose its zero.
fn clock_with_origin() -> (RealClock, i64, i64) {
    let before = monotonic_ns();
    let clock = RealClock::start();
    (clock, before, monotonic_ns())
}

#[test]
fn host_times_are_within_their_bounds_and_box_times_match_the_edges() {
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
        let train = edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap();
        let (earliest, latest) = truth(train[0].cycle, &edges);
        let (low, high) = (
            sent.t.0 - sent.uncertainty_ns,
            sent.t.0 + sent.uncertainty_ns,
        );
        assert!(
            low <= latest.0 && earliest.0 <= high,
            "the edge rose at {earliest}..{latest}, reported was {} +- {} ns",
            sent.t,
            sent.uncertainty_ns
        );
        starts.push(train[0].cycle);
    }
    // Two input edges, half a millisecond apart.
    let soon = board.input(true).unwrap() + 2_000_000;
    board
        .plan_input(&[(false, soon), (true, soon + 8_000)])
        .unwrap();
    let input = edges.take(2, TIMEOUT).unwrap();
    assert!(input.iter().all(|e| e.pin == INPUT));
    poll_until(&mut device, &mut reports, |r| {
        let inputs = r.iter().filter(|r| matches!(r, BoxReport::Input { .. }));
        marks_in(r).len() == starts.len() && inputs.count() == 2
    });
    // The box's zero is some cycles after the board's, the same for all time stamps.
    let reported = marks_in(&reports);
    let zero = starts[0] - reported[0].1.us * CYCLES_PER_US;
    for (start, (_, at)) in starts.iter().zip(&reported) {
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
        // Stamped by the capture unit, reported in whole microseconds.
        assert!(((edge.cycle - zero) / CYCLES_PER_US).abs_diff(at_us) <= 1);
    }
    // Each exchange encloses the host time of its box time.
    let mut exchanges = 0;
    for report in &reports {
        if let BoxReport::Exchange { sent, received, at } = report {
            let (earliest, latest) = truth(at.us * CYCLES_PER_US + zero, &edges);
            // Rounded down to whole microseconds.
            assert!(sent.0 <= latest.0 + 1_000 && earliest.0 <= received.0);
            exchanges += 1;
        }
    }
    assert!(exchanges > 0);
    assert_eq!(device.clock_contradictions(), 0);
}

#[test]
fn sync_trains_keep_counting_between_marks() {
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
    let end = Instant::now() + TIMEOUT;
    while device.counters().unwrap().syncs as usize > syncs_in(&reports).len() {
        device.poll(&mut reports).unwrap();
        assert!(Instant::now() < end, "sync trains were not reported");
    }
    let counts: Vec<u32> = syncs_in(&reports).iter().map(|s| s.0).collect();
    assert_eq!(counts, (0..counts.len() as u32).collect::<Vec<_>>());
    let trains = counts.len() + 6;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, TIMEOUT).unwrap());
    let observed = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!((observed.stray_edges, observed.lost_edges), (0, 0));
    let marks: Vec<Mark> = observed.marks.iter().map(|m| m.mark).collect();
    assert_eq!(marks, (0..6).map(mark).collect::<Vec<_>>());
    let on_the_line: Vec<u32> = observed.syncs.iter().map(|s| s.count).collect();
    assert_eq!(on_the_line, counts);
}

#[test]
fn a_mark_waits_for_a_running_sync_train() {
    let Some(board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = requester(&board);
    let sync = |period_ms| Request::Sync {
        period_ms,
        first: 1 << 17,
    };
    ask(Request::Arm { silence_ms: 0 });
    assert_eq!(ask(sync(27)).outcome, Outcome::BadArgument);
    assert_eq!(ask(sync(28)).outcome, Outcome::Done);
    // Reported first edges, and whether the mark waited longer than the pause after another mark.
    let mut reported = Vec::new();
    let end = Instant::now() + TIMEOUT;
    while reported.len() < 40 || !reported.iter().any(|&(_, waited)| waited) {
        let number = reported.len() as u32 + 1;
        let m = Request::Mark {
            number,
            mark: mark(number),
        };
        let reply = ask(m);
        if reply.outcome == Outcome::Done {
            let start = parse_mark(&reply.data).unwrap().0;
            reported.push((
                start,
                start.saturating_sub(reply.at.0) > 2_000 * CYCLES_PER_US,
            ));
        }
        assert!(Instant::now() < end, "no mark coincided with a sync train");
    }
    ask(sync(0));
    let mut status = ask(Request::Status);
    while status.flags.train() {
        status = ask(Request::Status);
        assert!(Instant::now() < end, "an endless train");
    }
    let counters = Counters::parse(&status.data).unwrap();
    let trains = (counters.marks + counters.syncs) as usize;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, TIMEOUT).unwrap());
    let observed = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!(counters.late_edges, 0);
    assert_eq!((observed.stray_edges, observed.lost_edges), (0, 0));
    assert_eq!(observed.marks.len(), reported.len());
    // The first count exceeded 17 bits by one.
    assert_eq!(observed.syncs[0].count, 0);
    let starts: Vec<u64> = all
        .chunks(2 * PULSES_PER_TRAIN as usize)
        .map(|train| train[0].cycle)
        .collect();
    let train = PulseTrain::DURATION_US * CYCLES_PER_US;
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] >= train));
    let is_mark = |cycle: u64| {
        observed
            .marks
            .iter()
            .any(|m| m.t_us == cycle / CYCLES_PER_US)
    };
    let marks: Vec<u64> = starts.iter().copied().filter(|&c| is_mark(c)).collect();
    for (&cycle, (ticks, waited)) in marks.iter().zip(&reported) {
        assert_eq!(
            cycle - marks[0],
            ticks - reported[0].0,
            "reported time differs"
        );
        let before = cycle.checked_sub(train);
        let behind = before.is_some_and(|c| starts.contains(&c) && !is_mark(c));
        assert!(behind || !waited, "waited without a reason");
    }
}
