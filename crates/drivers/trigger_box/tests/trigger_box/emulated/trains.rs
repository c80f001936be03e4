//! Trains are exact, whatever else happens on the lines.

use super::*;

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
        let train = without_skew(&edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap());
        assert_train(&train, mark(k));
        let observed = decode_marks(&trigger_edges(&train, CAMERA_1));
        assert_eq!((observed.marks.len(), observed.stray_edges), (1, 0));
        assert_eq!(observed.marks[0].mark, mark(k));
        device.poll(&mut reports).unwrap();
    }
    poll_until(&mut device, &mut reports, |r| {
        marks_in(r).len() >= n as usize
    });
    let reported: Vec<Mark> = marks_in(&reports).into_iter().map(|(m, _)| m).collect();
    assert_eq!(reported, (0..n).map(mark).collect::<Vec<_>>());
    let counters = device.counters().unwrap();
    assert_eq!((counters.marks, counters.late_edges), (n, 0));
    assert_eq!((counters.overruns, counters.dropped_events), (0, 0));
    assert_eq!(edges.next(Duration::ZERO).unwrap(), None, "an extra edge");
}

#[test]
fn trains_are_exact_to_the_cycle_on_all_outputs_at_once() {
    run_marks(313); // 10,016 pulses
}

/// 3,125 trains are 100,000 pulses.
#[test]
#[ignore = "takes most of a minute: cargo test -p skinrig-trigger-box emulated -- --ignored"]
fn a_hundred_thousand_pulses_without_loss() {
    run_marks(3_125);
}

#[test]
fn the_contract_holds() {
    // One board for all boxes of the contract.
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

#[test]
fn inputs_do_not_shift_pulses_and_pulses_do_not_shift_time_stamps() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut ask = requester(&board);
    ask(Request::Arm { silence_ms: 0 });
    board.loop_back(1).unwrap();
    let mut edges = board.edges().unwrap();
    let mut zero = None;
    // The input follows the spare output with delays at which its interrupt collides with that of the next edge.
    for (k, delay_us) in (0..).zip([0, 3, 20, 32, 38, 42, 45, 47, 48, 49, 51, 58, 65, 75, 95, 99]) {
        board.loop_back(1 + delay_us * CYCLES_PER_US).unwrap();
        let from = Events::parse(&ask(Request::Events { from: 0 }).data)
            .unwrap()
            .next;
        ask(Request::Events { from });
        let m = Request::Mark {
            number: k + 1,
            mark: mark(k),
        };
        let reply = ask(m);
        assert_eq!(reply.outcome, Outcome::Done);
        let start = parse_mark(&reply.data).unwrap().0;
        let of_both = edges.take(EDGES_PER_TRAIN / 3 * 4, TIMEOUT).unwrap();
        let (inputs, outputs): (Vec<Edge>, Vec<Edge>) =
            of_both.into_iter().partition(|e| e.pin == INPUT);
        let train = without_skew(&outputs);
        assert_train(&train, mark(k));
        let zero = *zero.get_or_insert(train[0].cycle - start);
        assert_eq!(train[0].cycle - start, zero, "a shifted train");
        let mut stamps = Vec::new();
        // The box stores 48 events before it ignores the input: the mark and 47 edges, if no request comes in between.
        let mut from = from;
        while stamps.len() < 47 {
            let events = Events::parse(&ask(Request::Events { from }).data).unwrap();
            from = events.first + events.events.len() as u32;
            for event in events.events {
                if let EventKind::Input { rising } = event.kind {
                    stamps.push((rising, event.at.0));
                }
            }
        }
        for (edge, (rising, ticks)) in inputs.iter().zip(stamps) {
            assert_eq!(rising, edge.high);
            // In the emulator an edge takes effect between two instructions and never within one.
            let off = (edge.cycle - zero).abs_diff(ticks);
            assert!(
                off <= 3,
                "time stamp {off} cycles off, {delay_us} us after the output"
            );
        }
    }
    let counters = Counters::parse(&ask(Request::Status).data).unwrap();
    assert_eq!((counters.late_edges, counters.input_glitches), (0, 0));
}

#[test]
fn a_noisy_input_does_not_affect_the_trains() {
    let Some(mut board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = requester(&board);
    ask(Request::Arm { silence_ms: 0 });
    let (mut marks, mut reported, mut from) = (0, Vec::new(), 0);
    // From far more edges than the processor can stamp, to fewer than are ignored.
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
                let edge = edges.next(TIMEOUT).unwrap().unwrap();
                if edge.pin != INPUT {
                    outputs.push(edge);
                }
            }
            assert_train(&without_skew(&outputs), mark(marks));
            // A slow host reads six events per mark, while the input would fill all free memory.
            let events = Events::parse(&ask(Request::Events { from }).data).unwrap();
            from = events.first + events.events.len() as u32;
            reported.extend(events.events);
        }
    }
    loop {
        let events = Events::parse(&ask(Request::Events { from }).data).unwrap();
        from = events.first + events.events.len() as u32;
        reported.extend(events.events);
        if from == events.next {
            break;
        }
    }
    let is_mark = |e: &&Event| matches!(e.kind, EventKind::Mark(_));
    assert_eq!(reported.iter().filter(is_mark).count(), marks as usize);
    let counters = Counters::parse(&ask(Request::Status).data).unwrap();
    assert_eq!(counters.marks, marks);
    assert_eq!((counters.late_edges, counters.dropped_events), (0, 0));
    assert!(counters.input_mutes > 0, "{counters:?}");
    assert!(counters.ignored_edges > 0, "{counters:?}");
}
