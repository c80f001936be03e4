//! Online estimation: bytes in to decision out, against decoding alone.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::time::Instant;

use skinrig_analysis::analyze;
use skinrig_bench::files::Memory;
use skinrig_bench::{Table, recording};
use skinrig_formats::{Decoder, evt2::Encoder};
use skinrig_model::{CameraId, CdEvent, PressRole, StreamFormat};
use skinrig_online::{Decoders, Estimate, Live, SkinModel, StreamSettings, TipCourses};

/// The recording is played this much faster: 1 Mev/s per camera.
const FASTER: u64 = 125;
/// Bytes of a packet.
const PACKET: usize = 4096;

/// The bytes of a camera whose clock runs [`FASTER`].
fn bytes(events: &[CdEvent]) -> Vec<u8> {
    let mut encoder = Encoder::new(0);
    let mut bytes = Vec::new();
    for event in events {
        let faster = CdEvent {
            t_us: event.t_us / FASTER,
            ..*event
        };
        encoder
            .cd(faster, &mut bytes)
            .expect("sorted events on the sensor");
    }
    bytes
}

fn main() {
    let mut input = recording::input();
    for planned in &mut input.planned {
        if planned.role == PressRole::Score {
            planned.role = PressRole::Calibrate;
        }
    }
    let events = recording::events(&input);
    let source = Memory(events.clone());
    let analysis = analyze(&input, &source).expect("the recording is valid");
    let skin = SkinModel::learn(&analysis, &source, &TipCourses::new(), 0.13)
        .expect("its presses can be learnt from");
    let faster = skin.played_faster(FASTER as f64);
    let clocks = *faster.clocks();
    let streams = CameraId::ALL.map(|camera| bytes(&events[camera.index()]));
    let seconds = events[0].last().map_or(0, |e| e.t_us) as f64 / FASTER as f64 * 1e-6;
    let count = (events[0].len() + events[1].len()) as f64 * 1e-6;
    println!(
        "{} places, {:.2} Mev/s per camera",
        skin.places(),
        count / 2.0 / seconds
    );
    let settings = StreamSettings {
        every_us: 5_000,
        from_us: 0,
    };
    let formats = [StreamFormat::Evt2; 2];
    let (mut decisions, mut positions) = (Vec::new(), Vec::new());
    let mut table = Table::new(
        "both cameras, one thread",
        "Mev",
        "EVT2 in packets of 4 KiB, in turn; decoder, detector, a position every 5 ms of a touch. Baseline: the decoder alone",
    );
    table.baseline("decode", count, || {
        for stream in &streams {
            let mut decoder = Decoder::new(StreamFormat::Evt2);
            let mut seen = 0;
            for packet in stream.chunks(PACKET) {
                decoder.for_each_slice(packet, |events| seen += events.len());
            }
            std::hint::black_box(seen);
        }
    });
    table.row("bytes to decision", count, || {
        let live = Live::new(Decoders::new(formats), &faster, settings);
        let mut live = live.expect("clocks");
        let mut packets = [0, 1].map(|k| streams[k].chunks(PACKET));
        loop {
            let host_us = |k: usize| {
                let newest = live.newest_us(CameraId::ALL[k]);
                newest.map_or(f64::NEG_INFINITY, |us| {
                    clocks[k].host_us_of_camera(us as f64)
                })
            };
            let behind = usize::from(host_us(1) < host_us(0));
            let Some(packet) = packets[behind].next() else {
                break;
            };
            let mut located = false;
            let arrived = Instant::now();
            let taken = live.push(CameraId::ALL[behind], packet, |e| {
                located |= matches!(e, Estimate::Position { .. });
            });
            let us = arrived.elapsed().as_secs_f64() * 1e6;
            taken.expect("packets come in turn");
            if located {
                &mut positions
            } else {
                &mut decisions
            }
            .push(us);
        }
    });
    println!("{}", table.run(3));
    for (what, times) in [
        ("without a position", &mut decisions),
        ("with one", &mut positions),
    ] {
        times.sort_by(f64::total_cmp);
        let at = |p: f64| {
            times
                .get((times.len() as f64 * p) as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        println!(
            "  a packet {what}: p50 {:.0} µs, p99 {:.0} µs, n {}",
            at(0.5),
            at(0.99),
            times.len()
        );
    }
}
