//! Properties of the stream codecs: round trips, independence of splits, counts, and a real recording.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::path::Path;

use proptest::prelude::*;
use sha2::{Digest as _, Sha256};
use skinrig_formats::evt2::Encoder;
use skinrig_formats::raw::RawReader;
use skinrig_formats::{Decoder, Discontinuity, EventSink, Geometry, Scanner, evt2};
use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};

const FORMATS: [StreamFormat; 4] = [
    StreamFormat::Evt2,
    StreamFormat::Evt21,
    StreamFormat::Evt21Legacy,
    StreamFormat::Evt3,
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Item {
    Cd(CdEvent),
    Trigger(TriggerEdge),
    Jump(Discontinuity),
}

#[derive(Default)]
struct Items(Vec<Item>);

impl EventSink for Items {
    fn on_cd(&mut self, events: &[CdEvent]) {
        self.0.extend(events.iter().copied().map(Item::Cd));
    }
    fn on_trigger(&mut self, edge: TriggerEdge) {
        self.0.push(Item::Trigger(edge));
    }
    fn on_discontinuity(&mut self, step: Discontinuity) {
        self.0.push(Item::Jump(step));
    }
}

fn decode(format: StreamFormat, parts: &[&[u8]]) -> (Vec<Item>, Decoder) {
    let (mut decoder, mut items) = (Decoder::new(format), Items::default());
    for part in parts {
        decoder.push(part, &mut items);
    }
    (items.0, decoder)
}

/// Items in time order, at most 50 µs to several minutes apart.
fn items() -> impl Strategy<Value = (u64, Vec<Item>)> {
    let gap = prop_oneof![8 => 0_u64..50, 1 => 0_u64..40_000];
    let item = (gap, 0_u16..640, 0_u16..480, any::<bool>(), 0_u8..12);
    let start = prop_oneof![0..1_000_000_u64, (1_u64 << 34) - 20_000..1 << 34];
    (start, prop::collection::vec(item, 0..3000)).prop_map(|(start, raw)| {
        let mut t_us = start;
        let items = raw.into_iter().map(|(gap, x, y, bit, kind)| {
            t_us += gap;
            if kind == 0 {
                let channel = [0, 6, 7][usize::from(x) % 3];
                Item::Trigger(TriggerEdge {
                    t_us,
                    channel,
                    rising: bit,
                })
            } else {
                Item::Cd(CdEvent {
                    t_us,
                    x,
                    y,
                    polarity: Polarity::from_bit(bit),
                })
            }
        });
        (start, items.collect())
    })
}

fn encode(start: u64, items: &[Item], cadence_us: u64) -> Vec<u8> {
    let mut encoder = Encoder::with_cadence(start, cadence_us).unwrap();
    let mut bytes = Vec::new();
    for item in items {
        match item {
            Item::Cd(event) => encoder.cd(*event, &mut bytes).unwrap(),
            Item::Trigger(edge) => encoder.trigger(*edge, &mut bytes).unwrap(),
            Item::Jump(_) => unreachable!("never generated"),
        }
    }
    bytes
}

/// The same items as EVT2.1 or EVT3 words, in the simplest encoding.
fn encode_plainly(format: StreamFormat, items: &[Item]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let wide = |w: u64| {
        let turn = if format == StreamFormat::Evt21Legacy {
            32
        } else {
            0
        };
        w.rotate_left(turn).to_le_bytes()
    };
    for item in items {
        let (t, x, y, bit, channel) = match item {
            Item::Cd(e) => (e.t_us, e.x, e.y, e.polarity.bit(), None),
            Item::Trigger(e) => (e.t_us, 0, 0, u8::from(e.rising), Some(e.channel)),
            Item::Jump(_) => unreachable!("never generated"),
        };
        if format == StreamFormat::Evt3 {
            let bit = u16::from(bit);
            let mut words = vec![0x8000 | (t >> 12) as u16 & 0xfff, 0x6000 | t as u16 & 0xfff];
            match channel {
                Some(channel) => words.push(0xa000 | u16::from(channel) << 8 | bit),
                None if x % 3 == 0 => words.extend([y, 0x2000 | bit << 11 | x]),
                None => {
                    let base = x.saturating_sub(5);
                    words.extend([y, 0x3000 | bit << 11 | base, 0x4000 | 1 << (x - base)]);
                }
            }
            bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
            continue;
        }
        let (low, bit) = ((t & 63) << 54, u64::from(bit));
        bytes.extend(wide(8 << 60 | (t >> 6 & 0xfff_ffff) << 32));
        bytes.extend(wide(match channel {
            Some(channel) => 10 << 60 | low | u64::from(channel) << 40 | bit << 32,
            None => {
                let base = u64::from(x) & !31;
                bit << 60 | low | base << 43 | u64::from(y) << 32 | 1 << (x & 31)
            }
        }));
    }
    bytes
}

/// `bytes` split into pieces whose lengths cycle through `sizes`.
fn pieces<'a>(mut bytes: &'a [u8], sizes: &[usize]) -> Vec<&'a [u8]> {
    let mut parts = Vec::new();
    for size in sizes.iter().cycle() {
        if bytes.is_empty() {
            break;
        }
        let (head, rest) = bytes.split_at((*size).min(bytes.len()));
        parts.push(head);
        bytes = rest;
    }
    parts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// After any data, split anywhere in a word.
    #[test]
    fn a_restarted_decoder_is_a_fresh_one_moved_by_the_origin(
        (start, before) in items(),
        (begin, after) in items(),
        cut in 0_usize..9,
        origin in 0_u64..1 << 40,
        sizes in prop::collection::vec(1_usize..5000, 1..5),
    ) {
        for format in FORMATS {
            let bytes_of = |start, items: &[Item]| match format {
                StreamFormat::Evt2 => encode(start, items, 16),
                other => encode_plainly(other, items),
            };
            let (old, new) = (bytes_of(start, &before), bytes_of(begin, &after));
            let old = &old[..old.len().saturating_sub(cut)];
            let mut decoder = decode(format, &[old]).1;
            let mut found = Items::default();
            decoder.restart(origin);
            for part in pieces(&new, &sizes) {
                decoder.push(part, &mut found);
            }
            let later = |item: &Item| match *item {
                Item::Cd(e) => Item::Cd(CdEvent { t_us: e.t_us + origin, ..e }),
                Item::Trigger(e) => Item::Trigger(TriggerEdge { t_us: e.t_us + origin, ..e }),
                Item::Jump(step) => Item::Jump(step),
            };
            let fresh: Vec<Item> = decode(format, &[&new]).0.iter().map(later).collect();
            prop_assert_eq!(&found.0, &fresh, "{:?}", format);
        }
    }

    #[test]
    fn evt2_round_trip_at_any_split(
        (start, items) in items(),
        cadence in prop::sample::select(vec![16_u64, 64, 1]),
        sizes in prop::collection::vec(1_usize..5000, 1..5),
    ) {
        let bytes = encode(start, &items, cadence);
        let (found, decoder) = decode(StreamFormat::Evt2, &pieces(&bytes, &sizes));
        prop_assert_eq!(&found, &items);
        prop_assert_eq!(decoder.stats().discontinuities, 0);
        let (mut events, mut edges) = (Vec::new(), Vec::new());
        Decoder::new(StreamFormat::Evt2).push_cd(&bytes, &mut events, &mut edges);
        let cd = items.iter().filter(|i| matches!(i, Item::Cd(_))).count();
        prop_assert_eq!((events.len(), edges.len()), (cd, items.len() - cd));
    }

    #[test]
    fn evt21_and_evt3_round_trips_at_any_split(
        (start, items) in items(),
        sizes in prop::collection::vec(1_usize..5000, 1..5),
    ) {
        for format in &FORMATS[1..] {
            // A short counter has an unknown start: decoded times are later by whole ranges.
            let range = if *format == StreamFormat::Evt3 { 1 << 24 } else { 1 << 34 };
            let bytes = encode_plainly(*format, &items);
            let (found, decoder) = decode(*format, &pieces(&bytes, &sizes));
            prop_assert_eq!(decoder.stats().discontinuities, 0);
            let missing = start / range * range;
            prop_assert_eq!(found.len(), items.len());
            for (found, item) in found.iter().zip(&items) {
                let same = match (*found, *item) {
                    (Item::Cd(a), Item::Cd(b)) => {
                        CdEvent { t_us: a.t_us + missing, ..a } == b
                    }
                    (Item::Trigger(a), Item::Trigger(b)) => {
                        TriggerEdge { t_us: a.t_us + missing, ..a } == b
                    }
                    _ => false,
                };
                let first = items.first().map(|i| match i { Item::Cd(e) => e.t_us, Item::Trigger(e) => e.t_us, Item::Jump(_) => 0 });
                prop_assume!(first.is_none_or(|t| t / range == start / range));
                prop_assert!(same, "{found:?} for {item:?} in {format}");
            }
        }
    }

    #[test]
    fn any_bytes_decode_alike_at_any_split(
        format in prop::sample::select(FORMATS.to_vec()),
        bytes in prop::collection::vec(any::<u8>(), 0..4000),
        sizes in prop::collection::vec(1_usize..600, 1..5),
    ) {
        let (whole, decoder) = decode(format, &[&bytes]);
        let (split, other) = decode(format, &pieces(&bytes, &sizes));
        prop_assert_eq!(&whole, &split);
        prop_assert_eq!(decoder.stats(), other.stats());
        let mut scanner = Scanner::new(format);
        let (mut cd, mut on, mut first, mut last) = (0, 0, None, None);
        for part in pieces(&bytes, &sizes) {
            let (facts, _) = scanner.push(part);
            cd += facts.cd_events;
            on += facts.on_events;
            first = first.or(facts.first_us);
            last = facts.last_us.or(last);
        }
        prop_assert_eq!(scanner.stats(), decoder.stats());
        prop_assert_eq!((cd, on), (decoder.stats().cd_events(), decoder.stats().cd_on));
        prop_assert_eq!(last, decoder.last_us());
        prop_assert_eq!(first.is_some(), last.is_some());
    }

    #[test]
    fn evt2_words_in_groups_decode_as_one_by_one(
        words in prop::collection::vec((0_u32..40, any::<u32>()), 0..3000),
        quiet in 0_u32..36,
    ) {
        // Mostly events and progress of the time base in some proportion, and occasionally something else:
        // another type, a pixel outside, a step back, a step of half of the range or more.
        let mut high = 0x0fff_ff00_u32;
        let bytes: Vec<u8> = words
            .into_iter()
            .flat_map(|(kind, any)| {
                let step = match kind {
                    0 => [1 << 27, (1 << 27) - 1, 0_u32.wrapping_sub(1), any][any as usize % 4],
                    _ => any % 3,
                };
                match kind {
                    39 => any,
                    38 => any & 0x1fff_ffff,
                    k if k <= quiet => {
                        high = high.wrapping_add(step) & 0x0fff_ffff;
                        0x8000_0000 | high
                    }
                    _ => (any & 0x1fc0_0000) | ((any % 640) << 11) | (any % 480),
                }
                .to_le_bytes()
            })
            .collect();
        let singly: Vec<&[u8]> = bytes.chunks(4).collect();
        let (whole, decoder) = decode(StreamFormat::Evt2, &[&bytes]);
        let (split, other) = decode(StreamFormat::Evt2, &singly);
        prop_assert_eq!(&whole, &split);
        prop_assert_eq!(decoder.stats(), other.stats());
        prop_assert_eq!(decoder.last_us(), other.last_us());
        let mut scanner = Scanner::new(StreamFormat::Evt2);
        let (facts, _) = scanner.push(&bytes);
        prop_assert_eq!(scanner.stats(), decoder.stats());
        prop_assert_eq!((facts.first_us, facts.last_us), (decoder.first_us(), decoder.last_us()));
    }

    #[test]
    fn every_evt2_word_is_counted_once(words in prop::collection::vec(any::<u32>(), 0..3000)) {
        // Few type codes and small steps, so that runs, wraps and jumps all occur.
        let bytes: Vec<u8> = words
            .iter()
            .map(|w| match w >> 28 {
                0..5 => w & 0x1fff_ffff,
                5..9 => 0x8000_0000 | w & 0x0fff_ffff,
                _ => *w,
            })
            .flat_map(u32::to_le_bytes)
            .collect();
        let stats = decode(StreamFormat::Evt2, &[&bytes]).1.stats();
        let counted = stats.cd_events()
            + stats.trigger_edges()
            + stats.time_high
            + stats.monitoring
            + stats.skipped_words()
            + stats.dropped_before_time
            + stats.out_of_geometry;
        prop_assert_eq!(counted, words.len() as u64);
    }
}

/// Chunks of events only, as from a busy camera, whose ends do not align with the decoder's own block.
#[test]
fn a_chunk_that_ends_just_behind_a_block_is_decoded_whole() {
    for events in (1_000..1_060).chain(2_040..2_070) {
        let time = 0x8000_0001_u32.to_le_bytes();
        let event = (3_u32 << 11 | 5).to_le_bytes();
        let chunk: Vec<u8> = std::iter::repeat_n(event, events).flatten().collect();
        // The time base is first, so that the chunk begins with an empty block and whole groups.
        let (observed, decoder) = decode(StreamFormat::Evt2, &[&time, &chunk]);
        assert_eq!(
            decoder.stats().cd_events(),
            events as u64,
            "{events} events"
        );
        assert_eq!(observed.len(), events, "{events} events");
    }
}

#[test]
fn an_idle_camera_repeats_its_time_base() {
    let mut encoder = Encoder::new(40);
    let mut bytes = Vec::new();
    encoder.advance_to(100, &mut bytes).unwrap();
    encoder.advance_to(111, &mut bytes).unwrap();
    // Due at 32 (in force at the start), 48, 64, 80 and 96; the unit of the word is 64 µs.
    let words = [0_u32, 0, 1, 1, 1].map(|high| (0x8000_0000 | high).to_le_bytes());
    assert_eq!(bytes, words.concat());
    let (facts, _) = Scanner::new(StreamFormat::Evt2).push(&bytes);
    assert_eq!((facts.first_us, facts.last_us), (Some(0), Some(64)));
    let late = encoder.advance_to(110, &mut bytes).unwrap_err();
    assert_eq!(
        late.to_string(),
        "expected items in time order, found 110 µs after 111 µs was written"
    );
    let wrong = TriggerEdge {
        t_us: 200,
        channel: 32,
        rising: true,
    };
    assert!(encoder.trigger(wrong, &mut bytes).is_err());
    assert_eq!(bytes.len(), 20, "an error writes nothing");
    assert!(Encoder::with_cadence(0, 48).is_err());
}

#[test]
fn a_small_step_back_is_reported_and_taken_at_its_word() {
    let word = |high: u32| (0x8000_0000 | high).to_le_bytes();
    let event = 0x1000_0000_u32.to_le_bytes();
    let bytes = [word(10), event, word(3), event].concat();
    let (items, decoder) = decode(StreamFormat::Evt2, &[&bytes]);
    let jump = Discontinuity {
        from_us: 640,
        to_us: 192,
    };
    assert!(matches!(
        items[..],
        [
            Item::Cd(CdEvent { t_us: 640, .. }),
            Item::Jump(found),
            Item::Cd(CdEvent { t_us: 192, .. })
        ] if found == jump
    ));
    assert_eq!(decoder.stats().discontinuities, 1);
    assert_eq!(decoder.stats().wraps, 0);
}

#[test]
fn events_outside_the_sensor_are_counted_and_left_out() {
    let cd = |x: u32, y: u32| (0x1000_0000 | x << 11 | y).to_le_bytes();
    let mut bytes = 0x8000_0000_u32.to_le_bytes().to_vec();
    for k in 0..40 {
        bytes.extend(cd(k, k));
        bytes.extend(cd(640 + k, k));
        bytes.extend(cd(k, 480 + k));
    }
    let (items, decoder) = decode(StreamFormat::Evt2, &[&bytes]);
    assert_eq!((items.len(), decoder.stats().out_of_geometry), (40, 80));
    let mut all = Decoder::with_geometry(StreamFormat::Evt2, Geometry::ANY);
    let mut count = 0;
    all.for_each_slice(&bytes, |events| count += events.len());
    assert_eq!((count, all.stats().out_of_geometry), (120, 0));
}

#[test]
fn long_wraps_continue() {
    let mut encoder = Encoder::with_cadence(evt2::RANGE_US - 100, 64).unwrap();
    let (mut bytes, mut events) = (Vec::new(), Vec::new());
    for k in 0..40 {
        events.push(CdEvent {
            t_us: evt2::RANGE_US - 100 + k * 5,
            x: 1,
            y: 2,
            polarity: Polarity::On,
        });
        encoder.cd(events[k as usize], &mut bytes).unwrap();
    }
    let mut decoder = Decoder::new(StreamFormat::Evt2);
    let mut found = Vec::new();
    decoder.for_each_slice(&bytes, |slice| found.extend_from_slice(slice));
    assert_eq!(found, events);
    assert_eq!(decoder.stats().wraps, 1);
}

#[test]
fn a_real_recording_gives_its_known_events() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/evk1-gen3-evt2.raw");
    if !path.exists() {
        println!("skipped: {} is not here", path.display());
        return;
    }
    let mut reader = RawReader::open(&path).unwrap();
    assert_eq!(reader.header().serial_number(), Some("00000157"));
    assert_eq!(reader.header().geometry, Some(Geometry::EVK1));
    let mut decoder = reader.decoder();
    let (mut hash, mut count, mut times) = (Sha256::new(), 0, Vec::new());
    loop {
        match reader.next_chunk().unwrap() {
            [] => break,
            bytes => decoder.for_each_slice(bytes, |events| {
                for e in events {
                    hash.update(e.t_us.to_le_bytes());
                    hash.update(e.x.to_le_bytes());
                    hash.update(e.y.to_le_bytes());
                    hash.update([e.polarity.bit()]);
                }
                count += events.len();
                times.extend([events[0].t_us, events[events.len() - 1].t_us]);
            }),
        }
    }
    assert_eq!(count, 521_252);
    assert_eq!(times.iter().min(), Some(&913_716_224));
    assert_eq!(times.iter().max(), Some(&913_812_095));
    let hash: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!(
        hash,
        "58773c06cd3098d13e0f2781e1134449d2f01ed498d4975aabc2c4e5ec81d44b"
    );
}
