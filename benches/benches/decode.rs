//! Event decoding and encoding on one core, compared with a straightforward decoder and a memory copy.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::hint::black_box;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_bench::Table;
use skinrig_formats::{Decoder, Scanner, evt2::Encoder};
use skinrig_model::{CdEvent, Polarity, StreamFormat};
use skinrig_simd::InstructionSet;

const CHUNK: usize = 128 * 1024;

/// Random events, `per_time_high` of them between two time base words on average, as EVT2.
fn evt2(events: usize, per_time_high: f64) -> Vec<u8> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut encoder = Encoder::new(0);
    let mut bytes = Vec::new();
    let mut t = 0.0;
    for _ in 0..events {
        t += 16.0 / per_time_high * rng.random_range(0.0..2.0);
        let event = CdEvent {
            t_us: t as u64,
            x: rng.random_range(0..640),
            y: rng.random_range(0..480),
            polarity: Polarity::from_bit(rng.random()),
        };
        encoder
            .cd(event, &mut bytes)
            .expect("sorted events on the sensor");
    }
    bytes
}

/// Random events as EVT3: rows of `per_row` events, single ADDR_X words or vectors of 12 + 12 + 8.
fn evt3(rows: usize, per_row: usize, vectors: bool) -> (Vec<u8>, usize) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut words: Vec<u16> = vec![0x8000];
    let mut events = 0;
    for row in 0..rows {
        let t = row as u32 * 10;
        if t & 0xfff < 10 {
            words.push(0x8000 | (t >> 12 & 0xfff) as u16);
        }
        words.push(0x6000 | (t & 0xfff) as u16);
        words.push(rng.random_range(0..480));
        for _ in 0..per_row {
            let polarity = u16::from(rng.random::<bool>()) << 11;
            if vectors {
                let masks: [u16; 3] = std::array::from_fn(|_| rng.random::<u16>());
                words.push(0x3000 | polarity | rng.random_range(0..600));
                words.push(0x4000 | masks[0] & 0xfff);
                words.push(0x4000 | masks[1] & 0xfff);
                words.push(0x5000 | masks[2] & 0xff);
                let bits = (masks[0] & 0xfff).count_ones()
                    + (masks[1] & 0xfff).count_ones()
                    + (masks[2] & 0xff).count_ones();
                events += bits as usize;
            } else {
                words.push(0x2000 | polarity | rng.random_range(0..640));
                events += 1;
            }
        }
    }
    (words.iter().flat_map(|w| w.to_le_bytes()).collect(), events)
}

/// A straightforward decoder: a match per word, a push per event.
fn plain_evt2(bytes: &[u8], mut each: impl FnMut(CdEvent)) {
    let (mut base, mut previous, mut epoch) = (0, None, 0);
    for word in bytes.chunks_exact(4) {
        let w = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        match w >> 28 {
            kind @ (0 | 1) if previous.is_some() => each(CdEvent {
                t_us: base + u64::from(w >> 22 & 0x3f),
                x: (w >> 11 & 0x7ff) as u16,
                y: (w & 0x7ff) as u16,
                polarity: Polarity::from_bit(kind == 1),
            }),
            8 => {
                let high = w & 0x0fff_ffff;
                if previous.is_some_and(|p| p > high && p - high > 1 << 27) {
                    epoch += 1 << 34;
                }
                previous = Some(high);
                base = epoch + (u64::from(high) << 6);
            }
            _ => {}
        }
    }
}

/// Same for EVT3, word by word and bit by bit.
fn plain_evt3(bytes: &[u8], mut each: impl FnMut(CdEvent)) {
    let (mut high, mut low, mut epoch, mut started) = (0_u64, 0_u64, 0_u64, false);
    let (mut y, mut x, mut polarity) = (0, 0, Polarity::Off);
    for word in bytes.chunks_exact(2) {
        let w = u16::from_le_bytes([word[0], word[1]]);
        let data = w & 0xfff;
        let t_us = epoch + (high << 12) + low;
        match w >> 12 {
            0 => y = data & 0x7ff,
            2 if started => each(CdEvent {
                t_us,
                x: data & 0x7ff,
                y,
                polarity: Polarity::from_bit(data & 0x800 != 0),
            }),
            3 => (x, polarity) = (data & 0x7ff, Polarity::from_bit(data & 0x800 != 0)),
            kind @ (4 | 5) => {
                let bits = if kind == 4 { 12 } else { 8 };
                for bit in 0..bits {
                    if started && data >> bit & 1 == 1 {
                        each(CdEvent {
                            t_us,
                            x: x + bit,
                            y,
                            polarity,
                        });
                    }
                }
                x += bits;
            }
            6 => low = data.into(),
            8 => {
                if high > u64::from(data) + 2048 {
                    epoch += 1 << 24;
                }
                if high != u64::from(data) {
                    low = 0;
                }
                high = data.into();
                started = true;
            }
            _ => {}
        }
    }
}

/// Uses all parts of an event, so that no decoder can skip any.
fn digest(sum: u64, e: &CdEvent) -> u64 {
    sum.wrapping_add(e.t_us)
        .wrapping_add(u64::from(e.x) ^ u64::from(e.y) << 16)
        .wrapping_add(u64::from(e.polarity.bit()))
}

/// The instruction sets of processors that lack the best ones of this one.
fn other_sets() -> Vec<InstructionSet> {
    let mut sets = InstructionSet::available();
    sets.pop();
    sets
}

fn decode_table(title: &str, format: StreamFormat, bytes: &[u8], events: usize) {
    let mev = events as f64 / 1e6;
    let title = format!(
        "{title}: {mev:.1} M events, {:.1} MB, {:.0} % of the words are events",
        bytes.len() as f64 / 1e6,
        100.0
            * events as f64
            * if format == StreamFormat::Evt2 {
                4.0
            } else {
                2.0
            }
            / bytes.len() as f64,
    );
    let method =
        "one core, bytes in memory, chunks of 128 KiB; `digest` adds up every field of every event";
    let mut table = Table::new(&title, "Mev", method);
    let plain = |each: &mut dyn FnMut(CdEvent)| match format {
        StreamFormat::Evt2 => plain_evt2(bytes, each),
        _ => plain_evt3(bytes, each),
    };
    let mut reference = 0;
    plain(&mut |e| reference = digest(reference, &e));
    let mut kept = Vec::with_capacity(events);
    table.baseline("straightforward decoder to a Vec", mev, move || {
        kept.clear();
        match format {
            StreamFormat::Evt2 => plain_evt2(bytes, |e| kept.push(e)),
            _ => plain_evt3(bytes, |e| kept.push(e)),
        }
        black_box(&kept);
    });
    table.row("for_each_slice (slices to a callback)", mev, || {
        let mut decoder = Decoder::new(format);
        let mut count = 0;
        for chunk in bytes.chunks(CHUNK) {
            decoder.for_each_slice(chunk, |slice| count += black_box(slice).len());
        }
        assert_eq!(count, events);
    });
    table.row("for_each_slice + digest", mev, || {
        let mut decoder = Decoder::new(format);
        let mut sum = 0;
        for chunk in bytes.chunks(CHUNK) {
            decoder.for_each_slice(chunk, |slice| sum = slice.iter().fold(sum, digest));
        }
        assert_eq!(sum, reference, "same events as the straightforward decoder");
    });
    for set in other_sets() {
        table.row(&format!("for_each_slice, {}", set.name()), mev, move || {
            let mut decoder = Decoder::new(format).with_instructions(set);
            for chunk in bytes.chunks(CHUNK) {
                decoder.for_each_slice(chunk, |slice| {
                    black_box(slice);
                });
            }
        });
        table.row(
            &format!("Scanner (counts only), {}", set.name()),
            mev,
            move || {
                let mut scanner = Scanner::new(format).with_instructions(set);
                for chunk in bytes.chunks(CHUNK) {
                    black_box(scanner.push(chunk));
                }
            },
        );
    }
    let (mut kept, mut edges) = (Vec::with_capacity(events), Vec::new());
    table.row("push_cd (to a Vec)", mev, move || {
        let mut decoder = Decoder::new(format);
        kept.clear();
        for chunk in bytes.chunks(CHUNK) {
            decoder.push_cd(chunk, &mut kept, &mut edges);
        }
        black_box(&kept);
    });
    table.row("Scanner (counts only)", mev, || {
        let mut scanner = Scanner::new(format);
        let mut count = 0;
        for chunk in bytes.chunks(CHUNK) {
            count += scanner.push(chunk).0.cd_events;
        }
        assert_eq!(count, events as u64);
    });
    let mut copy = vec![0; bytes.len()];
    table.row("memory copy of the same bytes", mev, move || {
        copy.copy_from_slice(bytes);
        black_box(&copy);
    });
    println!("{}", table.run(7));
}

/// Typical recording: an idle camera, mostly TIME_HIGH words.
fn idle_table() {
    for (title, per_time_high, events) in [
        (
            "a skin at rest, 2.5 kev/s (1 event per 25 time words)",
            0.04,
            500_000,
        ),
        (
            "darkness, 60 ev/s (1 event per 1000 time words)",
            0.001,
            12_500,
        ),
    ] {
        let bytes = evt2(events, per_time_high);
        let gigabytes = bytes.len() as f64 / 1e9;
        let mut table = Table::new(
            &format!("EVT2, {title}: {:.1} MB", 1e3 * gigabytes),
            "GB",
            "one core, bytes in memory, chunks of 128 KiB",
        );
        table.baseline("straightforward decoder", gigabytes, || {
            let mut count = 0;
            plain_evt2(&bytes, |e| count += usize::from(black_box(e).x < 640));
            assert_eq!(count, events);
        });
        table.row("for_each_slice (slices to a callback)", gigabytes, || {
            let mut decoder = Decoder::new(StreamFormat::Evt2);
            let mut count = 0;
            for chunk in bytes.chunks(CHUNK) {
                decoder.for_each_slice(chunk, |slice| count += black_box(slice).len());
            }
            assert_eq!(count, events);
        });
        for set in other_sets() {
            let bytes = &bytes;
            table.row(
                &format!("for_each_slice, {}", set.name()),
                gigabytes,
                move || {
                    let mut decoder = Decoder::new(StreamFormat::Evt2).with_instructions(set);
                    for chunk in bytes.chunks(CHUNK) {
                        decoder.for_each_slice(chunk, |slice| {
                            black_box(slice);
                        });
                    }
                },
            );
        }
        table.row("Scanner (counts only)", gigabytes, || {
            let mut scanner = Scanner::new(StreamFormat::Evt2);
            let mut count = 0;
            for chunk in bytes.chunks(CHUNK) {
                count += scanner.push(chunk).0.cd_events;
            }
            assert_eq!(count, events as u64);
        });
        let mut copy = vec![0; bytes.len()];
        let source = &bytes;
        table.row("memory copy of the same bytes", gigabytes, move || {
            copy.copy_from_slice(source);
            black_box(&copy);
        });
        println!("{}", table.run(7));
    }
}

fn encode_table() {
    const IDLE_US: u64 = 1_000_000_000;
    let gigabytes = IDLE_US as f64 / 16.0 * 4.0 / 1e9;
    let mut table = Table::new(
        "EVT2 encoder, idle camera: 1000 s of TIME_HIGH words",
        "GB",
        "1 s of camera time per call, into a reused Vec",
    );
    let mut out = Vec::new();
    table.row("Encoder::advance_to", gigabytes, move || {
        let mut encoder = Encoder::new(0);
        for s in 1..=IDLE_US / 1_000_000 {
            out.clear();
            encoder
                .advance_to(s * 1_000_000, &mut out)
                .expect("time passes");
            black_box(&out);
        }
    });
    let (source, mut out) = (vec![1_u8; 250_000], vec![0_u8; 250_000]);
    table.baseline("memory copy, 250 kB at a time", gigabytes, move || {
        for _ in 0..IDLE_US / 1_000_000 {
            out.copy_from_slice(black_box(&source));
            black_box(&out);
        }
    });
    println!("{}", table.run(5));
}

fn main() {
    for (title, per_time_high) in [
        ("EVT2, a burst (160 events per time word)", 160.0),
        ("EVT2, a press (10 events per time word)", 10.0),
        ("EVT2, background (1 event per time word)", 1.0),
    ] {
        let bytes = evt2(10_000_000, per_time_high);
        decode_table(title, StreamFormat::Evt2, &bytes, 10_000_000);
    }
    idle_table();
    let (bytes, events) = evt3(1_000_000, 10, false);
    decode_table(
        "EVT3, single events (10 per TIME_LOW)",
        StreamFormat::Evt3,
        &bytes,
        events,
    );
    let (bytes, events) = evt3(200_000, 4, true);
    decode_table(
        "EVT3, vectors 12 + 12 + 8, half full",
        StreamFormat::Evt3,
        &bytes,
        events,
    );
    encode_table();
}
