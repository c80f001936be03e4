//! Noise, unplugging, resets, hangs, and a silent host.

use super::*;

#[test]
fn on_a_noisy_line_every_mark_is_sent_once_or_reported() {
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
        "{done:?}: no fault occurred, so this tests nothing"
    );
    let counters = device.counters().unwrap();
    assert!(counters.bad_checksums + counters.bad_frames > 0);
    let trains = counters.marks as usize;
    let all = without_skew(&edges.take(trains * EDGES_PER_TRAIN, TIMEOUT).unwrap());
    let observed = decode_marks(&trigger_edges(&all, CAMERA_1));
    assert_eq!(observed.stray_edges, 0);
    // In order and never twice; a mark may be missing only after an error.
    let mut on_the_line = observed.marks.iter().map(|m| m.mark).peekable();
    for (mark, certain) in sent {
        let is_sent = on_the_line.next_if_eq(&mark).is_some();
        assert!(is_sent || !certain, "{mark:?} was confirmed but not sent");
    }
    assert_eq!(on_the_line.next(), None, "an unrequested train");
    // The events arrived despite the noise too.
    let mut reports = Vec::new();
    poll_until(&mut device, &mut reports, |r| marks_in(r).len() >= trains);
    assert_eq!(marks_in(&reports).len(), trains);
}

#[test]
fn an_unplugged_box_is_reconnected() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut device = open(&board, RealClock::start());
    send_when_free(&mut device, mark(1)).unwrap();
    edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap();
    board.unplug().unwrap();
    let lost = device.send(mark(2)).unwrap_err();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    let mut reports = Vec::new();
    let lost = device.poll(&mut reports).unwrap_err();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    board.plug().unwrap();
    comes_back(&mut device, &mut reports);
    // Rearmed, with new mark numbers.
    send_when_free(&mut device, mark(3)).unwrap();
    let train = without_skew(&edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap());
    assert_train(&train, mark(3));
}

/// Polls while the box is lost, until it reports one reset.
fn comes_back(device: &mut SerialTriggerBox, reports: &mut Vec<BoxReport>) {
    let end = Instant::now() + TIMEOUT;
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
        assert!(Instant::now() < end, "the box did not recover");
        std::thread::yield_now();
    }
}

#[test]
fn a_brown_out_is_reported_as_a_reset_with_its_cause() {
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
    // Sync trains resume by themselves with new counts.
    poll_until(&mut device, &mut reports, |r| {
        !syncs_in(&r[reset..]).is_empty()
    });
    assert!(syncs_in(&reports[reset..])[0].0 > before + 1);
    let cause = device.counters().unwrap().reset_cause;
    assert_eq!(cause.to_string(), "brown-out");
    send_when_free(&mut device, mark(9)).unwrap();
}

#[test]
fn a_hanging_firmware_is_restarted_by_its_watchdog() {
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
    let mut ask = requester(&board);
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
    // A second of box time is much shorter for the host, so it may be over before the second request.
    let end = Instant::now() + TIMEOUT;
    loop {
        assert_eq!(
            ask(Request::Arm { silence_ms: 1_000 }).outcome,
            Outcome::Done
        );
        if ask(sync(50)).outcome == Outcome::Done {
            break;
        }
        assert!(Instant::now() < end, "disarmed repeatedly");
    }
    edges.take(10 * EDGES_PER_TRAIN, TIMEOUT).unwrap();
    // Two more seconds of box time.
    let end = board.cycle().unwrap() + 2_000_000 * CYCLES_PER_US;
    while board.cycle().unwrap() < end {
        std::thread::yield_now();
    }
    let reply = ask(Request::Status);
    assert!(reply.flags.disarmed_by_silence() && !reply.flags.armed() && !reply.flags.syncing());
    let counters = Counters::parse(&reply.data).unwrap();
    assert!((10..=21).contains(&counters.syncs), "{counters:?}");
    assert_eq!(ask(m).outcome, Outcome::NotArmed);
}
