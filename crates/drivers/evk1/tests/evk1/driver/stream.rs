//! The stream: words without a time base are held back, losses are counted, faults are named.

use proptest::prelude::*;
use skinrig_device::{CameraSettings, Clock, DeviceError, EventCamera, NoiseFilter, SyncMode};
use skinrig_evk1::inbox::{Block, Inbox, QueuedData};
use skinrig_evk1::registers as r;
use skinrig_evk1::{Evk1Config, UsbError};
use skinrig_model::{HostDuration, HostTime, RawChunk};

use super::model::Bench;

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}

fn all_bytes(chunks: &[RawChunk]) -> usize {
    chunks.iter().map(|c| c.bytes.len()).sum()
}

#[test]
fn a_slave_is_silent_until_its_clock_arrives_and_counts_held_words() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let settings = CameraSettings {
        sync: SyncMode::Slave,
        ..CameraSettings::default()
    };
    camera.configure(&settings).unwrap();
    camera.start().unwrap();
    let mut chunks = Vec::new();
    bench.pass(50);
    camera.flush(&mut chunks).unwrap();
    assert_eq!(chunks, []);
    assert!(!camera.time_runs());
    let held_back = camera.report().discarded_bytes;
    assert!(held_back > 4000, "{held_back}");
    bench.model().sync_clock = true;
    bench.pass(50);
    camera.flush(&mut chunks).unwrap();
    assert!(camera.time_runs());
    assert_eq!(chunks.len(), 1);
    assert_eq!(chunks[0].lost_before, 0);
    assert_eq!(chunks[0].facts.first_us, Some(64));
    assert!(chunks[0].facts.cd_events > 900);
    camera.stop(&mut chunks).unwrap();
    let mut notes = Vec::new();
    camera.take_notes(&mut notes);
    assert!(notes[0].contains("without a time"), "{notes:?}");
}

#[test]
fn pixels_are_silent_for_half_a_second_and_the_filter_is_restored() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let settings = CameraSettings {
        noise_filter: Some(NoiseFilter {
            min_rate_ev_s: 1_000_000,
        }),
        ..CameraSettings::default()
    };
    camera.configure(&settings).unwrap();
    let before = bench.model().word(r::NFL_THRESH);
    assert_eq!(r::NFL_EVT_THRESH.of(before), 1023);
    camera.start().unwrap();
    let mut chunks = Vec::new();
    camera.flush(&mut chunks).unwrap();
    assert!(all_bytes(&chunks) > 100_000, "the time base runs meanwhile");
    assert!(chunks.iter().all(|c| c.facts.cd_events == 0));
    assert_eq!(bench.model().word(r::NFL_THRESH), before);
    assert_eq!(bench.model().get(r::NFL_EN), 1);
}

#[test]
fn a_lagging_reader_loses_whole_words_and_counts_them() {
    let bench = Bench::new();
    let config = Evk1Config {
        chunk_bytes: 128 << 10,
        backlog_bytes: 256 << 10,
        ..Evk1Config::default()
    };
    let mut camera = bench.open_with(config).unwrap();
    camera.start().unwrap();
    let mut chunks = Vec::new();
    camera.flush(&mut chunks).unwrap();
    let sent_before = all_bytes(&chunks);
    // 20 events and 64 TIME_HIGH words every 1.024 ms: 0.33 MB in a second, more than may wait.
    bench.pass(2000);
    camera.flush(&mut chunks).unwrap();
    bench.pass(10);
    camera.flush(&mut chunks).unwrap();
    camera.stop(&mut chunks).unwrap();
    let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
    assert_eq!(lost, camera.report().lost_bytes);
    assert!(lost > 300_000, "{lost}");
    assert_eq!(camera.report().loss_count, 1);
    assert!(camera.report().lost_time.as_secs_f64() > 1.0);
    // After the gap the first word is a TIME_HIGH, so no event carries a time from before it.
    let gap = chunks.iter().position(|c| c.lost_before > 0).unwrap();
    let after = chunks[gap..].iter().find(|c| !c.bytes.is_empty()).unwrap();
    assert_eq!(after.bytes[3] >> 4, 8);
    assert!(sent_before > 0);
    assert_eq!(
        camera.report().jump_count,
        0,
        "a gap on the host is no jump of the camera"
    );
}

#[test]
fn a_disconnect_is_reported_after_the_data_sent_before_it() {
    for (error, gone) in [(UsbError::Gone, true), (UsbError::Stall, false)] {
        let bench = Bench::new();
        let mut camera = bench.open().unwrap();
        camera.start().unwrap();
        bench.pass(30);
        let mut chunks = Vec::new();
        bench.model().faults.error = Some(error);
        bench.pass(2);
        let lost = camera.poll(&mut chunks).unwrap_err();
        assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
        assert!(
            lost.to_string()
                .contains("camera 1 00001621: lost: receiving events"),
            "{lost}"
        );
        assert!(
            all_bytes(&chunks) > 0,
            "what came before must be handed over"
        );
        camera.stop(&mut chunks).unwrap_err();
        camera.stop(&mut chunks).unwrap();
        if gone {
            camera.start().unwrap_err();
        } else {
            bench.model().faults.error = None;
            camera.start().unwrap();
        }
    }
}

#[test]
fn jumps_of_the_time_base_are_reported() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    camera.start().unwrap();
    let mut chunks = Vec::new();
    camera.flush(&mut chunks).unwrap();
    let last = chunks.last().unwrap().facts.last_us.unwrap();
    let high = 0x8000_0000 | (last / 64) as u32;
    // One lost TIME_HIGH period is normal; two are not, nor is a backward step.
    bench
        .model()
        .send(&bytes(&[high + 1, high + 3, high + 2, high + 2]));
    camera.stop(&mut chunks).unwrap();
    assert_eq!(camera.report().jump_count, 2);
    assert!(!camera.report().jumps[0].backwards());
    assert!(camera.report().jumps[1].backwards());
    let mut notes = Vec::new();
    camera.take_notes(&mut notes);
    assert!(
        notes.iter().any(|n| n.contains("time base jumped 2 times")),
        "{notes:?}"
    );
    notes.clear();
    camera.take_notes(&mut notes);
    assert!(notes.is_empty(), "told once");
}

#[test]
fn a_step_of_the_time_base_beyond_the_limit_is_a_loss_before_the_next_chunk() {
    let bench = Bench::new();
    let config = Evk1Config {
        max_time_step_us: Some(640),
        ..Evk1Config::default()
    };
    let mut camera = bench.open_with(config).unwrap();
    camera.start().unwrap();
    let mut before = Vec::new();
    camera.flush(&mut before).unwrap();
    let last = before.last().unwrap().facts.last_us.unwrap();
    let high = 0x8000_0000 | (last / 64) as u32;
    // Ten counts are 640 us and no loss; eleven are, and so is a step back.
    bench
        .model()
        .send(&bytes(&[high + 10, high + 21, high + 22, high + 21]));
    let mut chunks = Vec::new();
    camera.flush(&mut chunks).unwrap();
    let reported: Vec<_> = chunks
        .iter()
        .map(|c| (c.lost_before, c.bytes.len()))
        .collect();
    assert_eq!(reported, [(0, 4), (4, 8), (4, 4)]);
    let seqs: Vec<u64> = chunks.iter().map(|c| c.seq).collect();
    let first = before.last().unwrap().seq + 1;
    assert_eq!(seqs, [first, first + 1, first + 2]);
    let report = camera.report();
    assert_eq!((report.time_gaps, report.lost_bytes), (2, 8));
    assert_eq!(report.jump_count, 3, "each is noted once");
}

#[test]
fn the_overflow_counter_is_read_around_the_stream() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    bench
        .model()
        .registers
        .insert(r::OVERFLOW_HITCOUNT.address, 7);
    camera.start().unwrap();
    bench
        .model()
        .registers
        .insert(r::OVERFLOW_HITCOUNT.address, 9);
    camera.stop(&mut Vec::new()).unwrap();
    assert_eq!(camera.report().overflow_hits, Some((7, 9)));
    let notes = camera.report().notes().join("\n");
    assert!(notes.contains("from 7 to 9"), "{notes}");
}

/// A camera left streaming with nobody reading fills its counter; at its end every press would count as lossy.
#[test]
fn a_full_overflow_counter_is_refused_before_the_stream() {
    let bench = Bench::new();
    let counter = r::OVERFLOW_HITCOUNT.address;
    let mut camera = bench.open().unwrap();
    bench.model().registers.insert(counter, 0xffff);
    let error = camera.start().unwrap_err().to_string();
    assert!(error.contains("at its end (65535): power-cycle"), "{error}");
    bench.model().registers.insert(counter, 0xfffe);
    camera.start().unwrap();
    let mut noted = bench
        .open_with(Evk1Config {
            overflow_is_loss: false,
            ..Evk1Config::default()
        })
        .unwrap();
    bench.model().registers.insert(counter, 0xffff);
    noted.start().unwrap();
}

/// A flush reads the overflow counter; otherwise it is read once a second. The gap starts at the previous reading.
#[test]
fn a_step_of_the_overflow_counter_is_a_gap() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let count = |hits: u32| {
        let counter = r::OVERFLOW_HITCOUNT.address;
        bench.model().registers.insert(counter, hits);
    };
    camera.start().unwrap();
    let mut chunks = Vec::new();
    bench.pass(100);
    camera.flush(&mut chunks).unwrap();
    let good_us = chunks.last().unwrap().facts.last_us;
    assert!(chunks.iter().all(|c| c.lost_before == 0));
    bench.pass(50);
    count(0xfff0);
    bench.pass(50);
    let before = chunks.len();
    camera.poll(&mut chunks).unwrap();
    assert_eq!(chunks.len(), before, "not looked for yet");
    camera.flush(&mut chunks).unwrap();
    let reported = chunks.last().unwrap();
    assert_eq!((reported.lost_before, reported.lost_from_us), (4, good_us));
    let told_at = chunks.len();
    bench.pass(100);
    camera.flush(&mut chunks).unwrap();
    assert_eq!(chunks[told_at].bytes[3] >> 4, 8, "time comes first");
    // It wraps, and is found without a flush.
    count(3);
    bench.pass(1_100);
    camera.poll(&mut chunks).unwrap();
    assert_eq!(chunks.last().unwrap().lost_before, 4);
    count(4);
    camera.stop(&mut chunks).unwrap();
    assert_eq!(camera.report().overflow_gaps, 3);
    assert!(chunks.is_sorted_by_key(|c| c.host_time));
    let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
    assert_eq!(lost, camera.report().lost_bytes);
}

#[test]
fn an_implausible_overflow_counter_is_only_noted() {
    let bench = Bench::new();
    let config = Evk1Config {
        overflow_is_loss: false,
        ..Evk1Config::default()
    };
    let mut camera = bench.open_with(config).unwrap();
    camera.start().unwrap();
    let counter = r::OVERFLOW_HITCOUNT.address;
    bench.model().registers.insert(counter, 9);
    let mut chunks = Vec::new();
    bench.pass(1_100);
    camera.flush(&mut chunks).unwrap();
    camera.stop(&mut chunks).unwrap();
    assert!(chunks.iter().all(|c| c.lost_before == 0));
    let notes = camera.report().notes().join("\n");
    assert!(notes.contains("from 0 to 9"), "{notes}");
}

#[test]
fn words_cut_between_packets_and_at_the_end_are_kept_whole() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    camera.start().unwrap();
    let mut chunks = Vec::new();
    camera.flush(&mut chunks).unwrap();
    let now = bench.now();
    let event = bytes(&[0x1240_5014]);
    bench.model().send(&event[..1]);
    camera.flush(&mut chunks).unwrap();
    bench.model().send(&event[1..3]);
    bench.model().send(&event[3..]);
    bench.model().send(&event[..2]);
    camera.stop(&mut chunks).unwrap();
    let [.., whole, torn] = chunks.as_slice() else {
        panic!("{chunks:?}");
    };
    assert_eq!((&whole.bytes, whole.facts.cd_events), (&event, 1));
    assert_eq!(
        (torn.bytes.len(), torn.lost_before, torn.host_time),
        (0, 2, now)
    );
}

/// Operations on an inbox.
#[derive(Debug, Clone)]
enum Op {
    Push(usize),
    TakeFull,
    TakeAll,
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let op = prop_oneof![
        6 => (1..300_usize).prop_map(Op::Push),
        1 => Just(Op::TakeFull),
        1 => Just(Op::TakeAll),
    ];
    prop::collection::vec(op, 1..200)
}

proptest! {
    /// A stream of numbered words, split anywhere and taken at any time: every word is complete and in its
    /// place, and the gaps equal the reported losses.
    #[test]
    fn an_inbox_loses_whole_words_in_order_and_counts_them(ops in ops()) {
        const CHUNK: usize = 400;
        const BACKLOG: usize = 2000;
        let inbox = Inbox::new(CHUNK, BACKLOG);
        let (mut sent, mut at, mut waiting) = (0_usize, 0, 0);
        let mut got: Vec<Block> = Vec::new();
        for op in ops {
            let taken = match op {
                Op::Push(n) => {
                    at += 1;
                    let stream: Vec<u8> =
                        (sent..sent + n).map(|k| (k as u32 / 4).to_le_bytes()[k % 4]).collect();
                    inbox.push(&stream, HostTime(at));
                    sent += n;
                    continue;
                }
                Op::TakeFull => inbox.take_full(),
                Op::TakeAll => inbox.take_all(),
            };
            got.extend(taken.blocks);
        }
        let QueuedData { blocks, error } = inbox.finish();
        got.extend(blocks);
        prop_assert_eq!(error, None);
        let (mut place, mut last) = (0_u64, HostTime(0));
        for block in &got {
            if let Some(loss) = block.lost_before {
                place += loss.bytes;
                prop_assert!(loss.since <= loss.until && loss.until <= block.arrived);
            }
            prop_assert!(last <= block.arrived && block.arrived <= HostTime(at));
            last = block.arrived;
            prop_assert_eq!(block.bytes.len() % 4, 0);
            prop_assert!(block.bytes.len() <= CHUNK + 3);
            waiting += block.bytes.len();
            for word in block.bytes.chunks_exact(4) {
                prop_assert_eq!(place % 4, 0);
                let number = u32::from_le_bytes(word.try_into().unwrap());
                prop_assert_eq!(u64::from(number), place / 4);
                place += 4;
            }
        }
        prop_assert_eq!(place, sent as u64);
        prop_assert!(waiting <= sent);
    }

    /// Nothing is lost while the waiting data does not exceed the backlog.
    #[test]
    fn an_inbox_that_is_emptied_in_time_loses_nothing(cuts in prop::collection::vec(1..500_usize, 1..100)) {
        let inbox = Inbox::new(600, 1200);
        let mut kept = 0;
        for (k, n) in cuts.iter().enumerate() {
            inbox.push(&vec![0; *n], HostTime(k as i64));
            for block in inbox.take_all().blocks {
                prop_assert_eq!(block.lost_before, None);
                kept += block.bytes.len();
            }
        }
        let sent: usize = cuts.iter().sum();
        prop_assert_eq!(kept, sent - sent % 4);
    }
}

#[test]
fn leftover_data_of_a_stopped_stream_is_discarded_and_reported() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    camera.start().unwrap();
    camera.stop(&mut Vec::new()).unwrap();
    bench.model().left_over = 300_000;
    bench.trace();
    camera.start().unwrap();
    assert_eq!(camera.report().left_over_bytes, 300_000);
    assert_eq!(bench.model().left_over, 0);
    let trace = bench.trace();
    let place = |what: &str| trace.find(what).unwrap();
    assert!(place("bulk read of 0") < place("queue 20 transfers"));
    camera.stop(&mut Vec::new()).unwrap();
    assert!(camera.report().notes()[0].contains("left over"));
}

#[test]
fn a_camera_that_keeps_sending_is_named_at_start_and_ignored_at_close() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    camera.start().unwrap();
    camera.stop(&mut Vec::new()).unwrap();
    bench.model().never_silent = true;
    let before = bench.now();
    let error = camera.start().unwrap_err().to_string();
    assert!(
        error.contains("found it still sending after 80 bytes"),
        "{error}"
    );
    assert_eq!(bench.now() - before, HostDuration::from_millis(2000));
    camera.close().unwrap();
    assert_eq!(bench.now() - before, HostDuration::from_millis(4000));
}

#[test]
fn the_sensor_is_powered_off_even_if_close_fails_otherwise() {
    let pixels = r::ROI_TD_RSTN.register;
    let time_base = r::STEREO_MERGE_ENABLE.register;
    let clock_out = r::CLK_OUT_EN.register;
    let interface = r::SENSOR_CLK_EN.register;
    for (refused, stop_fails, first) in [
        (vec![pixels, time_base], false, pixels.name),
        (vec![time_base, clock_out], false, time_base.name),
        (vec![clock_out, interface], false, clock_out.name),
        (vec![pixels], true, "stopping the stream"),
    ] {
        let bench = Bench::new();
        let mut camera = bench.open().unwrap();
        camera.start().unwrap();
        let faults = bench.model().faults.clone();
        bench.model().faults = super::model::Faults {
            refused: refused.iter().map(|r| r.address).collect(),
            stop_fails,
            ..faults
        };
        let error = camera.close().unwrap_err().to_string();
        assert!(error.contains(first), "{first}: {error}");
        for power in [r::EN_VDDA, r::EN_VDDC, r::EN_VDDD, r::TD_RSTN] {
            assert_eq!(bench.model().get(power), 0, "{first}: {power:?}");
        }
        assert!(bench.trace().contains("clear halt"), "{first}");
    }
}

#[test]
fn a_failed_start_is_undone_and_restores_the_noise_filter() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let settings = CameraSettings {
        noise_filter: Some(NoiseFilter {
            min_rate_ev_s: 1_000_000,
        }),
        ..CameraSettings::default()
    };
    camera.configure(&settings).unwrap();
    let filter = |bench: &Bench| {
        let model = bench.model();
        (model.word(r::NFL_THRESH), model.get(r::NFL_EN))
    };
    let set = filter(&bench);
    let running = r::ROI_TD_RSTN;
    let mask = running.put(0, 1);
    let address = running.register.address;
    bench.model().faults.stuck_at_zero.insert(address, mask);
    camera.start().unwrap_err();
    assert_eq!(filter(&bench), set);
    assert_eq!(bench.model().get(r::STEREO_MERGE_ENABLE), 0);
    bench.model().faults.stuck_at_zero.clear();
    camera.start().unwrap();
    assert_eq!(filter(&bench), set);
}

#[test]
fn a_continuing_loss_counts_its_duration_once() {
    let inbox = Inbox::new(400, 400);
    inbox.push(&[0; 400], HostTime(10));
    inbox.push(&[0; 401], HostTime(20));
    let mut blocks = inbox.take_all().blocks;
    // The rest of the word whose beginning is lost.
    inbox.push(&[0; 11], HostTime(30));
    blocks.extend(inbox.finish().blocks);
    let losses: Vec<_> = blocks.iter().filter_map(|b| b.lost_before).collect();
    let reported: Vec<_> = losses
        .iter()
        .map(|l| (l.bytes, l.since.0, l.until.0))
        .collect();
    assert_eq!(reported, [(401, 10, 20), (3, 20, 30)]);
}

/// A failed transfer: the data before it is whole, a loss is reported, and the data after it begins with a whole word.
#[test]
fn a_failed_transfer_is_a_loss_between_whole_words() {
    let inbox = Inbox::new(400, 4000);
    inbox.push(&[1, 0, 0, 0, 2, 0], HostTime(1));
    inbox.lose_some(HostTime(2));
    inbox.push(&[3, 0, 0, 0], HostTime(3));
    let blocks = inbox.finish().blocks;
    let bytes: Vec<&[u8]> = blocks.iter().map(|b| b.bytes.as_slice()).collect();
    assert_eq!(bytes, [&[1, 0, 0, 0], &[3, 0, 0, 0]]);
    // The incomplete word, and one for the unknown loss.
    assert_eq!(blocks[1].lost_before.map(|l| l.bytes), Some(6));
}
