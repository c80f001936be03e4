//! Bytes: complete, in order and unchanged; losses are counted.

use skinrig_device::{CameraSettings, EventCamera, RealClock};
use skinrig_emulated_camera::Evk1Config as Emulated;
use skinrig_emulated_camera::config::{Content, Pacing};
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_evk1::{Evk1, Evk1Config};
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{CameraId, RawChunk, StreamFormat};

use crate::bus::bench::{FIRST, bytes, events, noise, open, until};

/// Checks that chunks without loss form the stream and that their facts equal those of a scan from its beginning.
fn check_facts(chunks: &[RawChunk]) {
    let mut scanner = Scanner::new(StreamFormat::Evt2);
    for chunk in chunks {
        let (facts, triggers) = scanner.push(&chunk.bytes);
        assert_eq!((facts, &triggers), (chunk.facts, &chunk.triggers));
        assert_eq!(chunk.bytes.len() % 4, 0);
    }
}

#[test]
fn chunks_hold_exactly_the_sent_bytes() {
    let dense = Emulated {
        content: Content::Dense { mev_per_s: 10.0 },
        pacing: Pacing::HostTime,
        ..Emulated::new(FIRST)
    };
    let test = "bus::stream::chunks_hold_exactly_the_sent_bytes";
    on_bus(test, vec![dense.into()], |remote| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 5_000_000).unwrap();
        camera.stop(&mut chunks).unwrap();
        let delivered = remote.observe(FIRST).unwrap().delivered;
        assert_eq!(camera.report().lost_bytes, 0);
        assert_eq!(camera.report().discarded_bytes, 0);
        assert_eq!(camera.report().jump_count, 0);
        let all = bytes(&chunks);
        assert_eq!(delivered.bytes, all.len() as u64);
        assert_eq!(delivered.crc32, crc32fast::hash(&all));
        check_facts(&chunks);
    });
}

#[test]
fn transfers_that_end_within_a_word_lose_nothing() {
    let test = "bus::stream::transfers_that_end_within_a_word_lose_nothing";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        for cut in [1, 2, 3, 1] {
            remote.order(FIRST, DeviceCommand::Cut(cut)).unwrap();
            let before = chunks.len();
            until(&mut camera, &mut chunks, |c| c.len() > before + 20).unwrap();
        }
        camera.stop(&mut chunks).unwrap();
        let all = bytes(&chunks);
        let mut decoder = Decoder::new(StreamFormat::Evt2);
        decoder.for_each_slice(&all, |_| {});
        assert_eq!(decoder.stats().skipped_words(), 0, "no word may be torn");
        assert_eq!(camera.report().jump_count, 0);
        let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
        let delivered = remote.observe(FIRST).unwrap().delivered;
        assert_eq!(delivered.bytes, all.len() as u64 + lost);
        assert!(lost < 4, "at most the beginning of the last word");
        check_facts(&chunks);
    });
}

#[test]
fn garbage_is_kept_unchanged() {
    let test = "bus::stream::garbage_is_kept_unchanged";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        let garbage = vec![0x2bad_cafe, 0xb000_0001, 0xf123_4567, 0x7fff_ffff];
        remote
            .order(FIRST, DeviceCommand::Garbage(garbage.clone()))
            .unwrap();
        let expected: Vec<u8> = garbage.iter().flat_map(|w| w.to_le_bytes()).collect();
        until(&mut camera, &mut chunks, |c| {
            bytes(c).windows(expected.len()).any(|w| w == expected)
        })
        .unwrap();
        camera.stop(&mut chunks).unwrap();
        check_facts(&chunks);
    });
}

/// The owner of the driver does not poll: transfers continue, so that the camera itself loses nothing, and the host counts
/// its own losses.
#[test]
fn an_unpolled_driver_never_blocks_transfers() {
    let test = "bus::stream::an_unpolled_driver_never_blocks_transfers";
    let camera = Emulated {
        content: Content::Dense { mev_per_s: 2.0 },
        pacing: Pacing::HostTime,
        ..Emulated::new(FIRST)
    };
    on_bus(test, vec![camera.into()], |remote| {
        let config = Evk1Config {
            chunk_bytes: 128 << 10,
            backlog_bytes: 1 << 20,
            ..Evk1Config::default()
        };
        let clock = RealClock::start();
        let mut camera = Evk1::open_serial(FIRST, CameraId::One, config, clock).unwrap();
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |_| {
            remote.observe(FIRST).unwrap().delivered.bytes > 1 << 20
        })
        .unwrap();
        let delivered = || remote.observe(FIRST).unwrap().delivered.bytes;
        let asleep = delivered() + (8 << 20);
        while delivered() < asleep {
            std::thread::yield_now();
        }
        camera.poll(&mut chunks).unwrap();
        camera.stop(&mut chunks).unwrap();
        let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
        assert!(lost > 6 << 20, "{lost}");
        assert_eq!(lost, camera.report().lost_bytes);
        assert_eq!(delivered(), lost + bytes(&chunks).len() as u64);
        // After a gap the stream continues with a time.
        for pair in chunks.windows(2) {
            if pair[1].lost_before > 0 && !pair[1].bytes.is_empty() {
                assert_eq!(pair[1].bytes[3] >> 4, 8);
            }
        }
        assert!(chunks.is_sorted_by_key(|c| c.host_time));
        let times: Vec<u64> = chunks.iter().filter_map(|c| c.facts.first_us).collect();
        assert!(times.is_sorted());
    });
}

#[test]
fn data_of_an_earlier_session_is_discarded() {
    let camera = Emulated {
        stale_words: 5000,
        ..noise(FIRST)
    };
    let test = "bus::stream::data_of_an_earlier_session_is_discarded";
    on_bus(test, vec![camera.into()], |_| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 1000).unwrap();
        camera.stop(&mut chunks).unwrap();
        assert_eq!(camera.report().jump_count, 0, "{:?}", camera.report());
        assert!(chunks[0].facts.first_us.unwrap() < 1000);
    });
}

#[test]
fn overflow_is_detected_by_its_counter() {
    let fast = Emulated {
        fifo_bytes: 4 << 10,
        content: Content::Dense { mev_per_s: 50.0 },
        ..Emulated::new(FIRST)
    };
    let test = "bus::stream::overflow_is_detected_by_its_counter";
    on_bus(test, vec![fast.into()], |remote| {
        // Two transfers of 16 KiB do not take a packet of 200 kB.
        let config = Evk1Config {
            transfers: 2,
            transfer_bytes: 16 << 10,
            ..Evk1Config::default()
        };
        let clock = RealClock::start();
        let mut camera = Evk1::open_serial(FIRST, CameraId::One, config, clock).unwrap();
        camera.configure(&CameraSettings::default()).unwrap();
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 20_000).unwrap();
        camera.stop(&mut chunks).unwrap();
        assert!(remote.observe(FIRST).unwrap().counters.dropped_bytes > 0);
        assert!(camera.report().overflow_gaps > 0);
        let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
        assert_eq!(lost, camera.report().lost_bytes);
        // Reported with the start of the unknown interval, and no event after it has a time from before.
        let losses: Vec<usize> = (0..chunks.len())
            .filter(|n| chunks[*n].lost_before > 0)
            .collect();
        assert!(losses.iter().any(|n| chunks[*n].lost_from_us.is_some()));
        for n in losses {
            if let Some(after) = chunks[n..].iter().find(|c| !c.bytes.is_empty()) {
                assert_eq!(after.bytes[3] >> 4, 8);
            }
        }
        let hits = camera.report().overflow_hits;
        assert!(
            hits.is_some_and(|(before, after)| before < after),
            "{hits:?}"
        );
        let mut notes = Vec::new();
        camera.take_notes(&mut notes);
        let text = notes.join("\n");
        assert!(text.contains("overflow counter increased"), "{text}");
    });
}
