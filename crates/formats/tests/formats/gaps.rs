//! Streams with missing bytes that are reported as lost: all decoded events match the complete stream.
#![expect(clippy::unwrap_used, reason = "tests")]

use proptest::prelude::*;
use skinrig_formats::evt2::Encoder;
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};

const FORMATS: [StreamFormat; 4] = [
    StreamFormat::Evt2,
    StreamFormat::Evt21,
    StreamFormat::Evt21Legacy,
    StreamFormat::Evt3,
];

/// Events and edges in time order, with random intervals.
fn events() -> impl Strategy<Value = Vec<CdEvent>> {
    let step = prop_oneof![8 => 0_u64..50, 1 => 0_u64..40_000];
    let event = (step, 0_u16..640, 0_u16..480, any::<bool>());
    let start = prop_oneof![Just(70), Just((1_u64 << 34) - 20_000)];
    (start, prop::collection::vec(event, 1..400)).prop_map(|(start, raw)| {
        let mut t_us = start;
        let events = raw.into_iter().map(|(step, x, y, bit)| {
            t_us += step;
            let polarity = Polarity::from_bit(bit);
            CdEvent {
                t_us,
                x,
                y,
                polarity,
            }
        });
        events.collect()
    })
}

/// One event in ten is an edge instead.
fn is_edge(e: &CdEvent) -> bool {
    e.x % 10 == 3
}

/// Encodes like a camera: a time base word only when it is due.
fn encode(format: StreamFormat, events: &[CdEvent]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let start = events[0].t_us;
    let mut evt2 = Encoder::with_cadence(start, 16).unwrap();
    let (mut high, mut low, mut row) = (None, None, None);
    for e in events {
        let bit = e.polarity.bit();
        match format {
            StreamFormat::Evt2 if is_edge(e) => {
                let edge = TriggerEdge {
                    t_us: e.t_us,
                    channel: 6,
                    rising: bit == 1,
                };
                evt2.trigger(edge, &mut bytes).unwrap();
            }
            StreamFormat::Evt2 => evt2.cd(*e, &mut bytes).unwrap(),
            StreamFormat::Evt3 => {
                let mut push_word = |word: u16| bytes.extend(word.to_le_bytes());
                let now = ((e.t_us >> 12) as u16 & 0xfff, e.t_us as u16 & 0xfff);
                if high.replace(u64::from(now.0)) != Some(u64::from(now.0)) {
                    push_word(0x8000 | now.0);
                    low = Some(0);
                }
                if low.replace(now.1) != Some(now.1) {
                    push_word(0x6000 | now.1);
                }
                let bit = u16::from(bit);
                if is_edge(e) {
                    push_word(0xa600 | bit);
                    continue;
                }
                if row.replace(e.y) != Some(e.y) {
                    push_word(e.y);
                }
                if e.x % 3 == 0 {
                    push_word(0x2000 | bit << 11 | e.x);
                } else {
                    push_word(0x3000 | bit << 11 | e.x);
                    push_word(0x4001);
                }
            }
            _ => {
                let turn = if format == StreamFormat::Evt21Legacy {
                    32
                } else {
                    0
                };
                let mut push_word = |word: u64| bytes.extend(word.rotate_left(turn).to_le_bytes());
                let now = e.t_us >> 6 & 0xfff_ffff;
                if high.replace(now) != Some(now) {
                    push_word(8 << 60 | now << 32);
                }
                let (low, bit) = ((e.t_us & 63) << 54, u64::from(bit));
                if is_edge(e) {
                    push_word(10 << 60 | low | 6 << 40 | bit << 32);
                } else {
                    let column = u64::from(e.x) & !31;
                    push_word(
                        bit << 60 | low | column << 43 | u64::from(e.y) << 32 | 1 << (e.x & 31),
                    );
                }
            }
        }
    }
    bytes
}

/// Decoded events and edges.
type DecodedEvents = (Vec<CdEvent>, Vec<TriggerEdge>);

fn push(decoder: &mut Decoder, bytes: &[u8], found: &mut DecodedEvents) {
    decoder.push_cd(bytes, &mut found.0, &mut found.1);
}

/// True if `part` is `whole` with some elements removed.
fn is_within<T: PartialEq>(part: &[T], whole: &[T]) -> bool {
    let mut rest = whole.iter();
    part.iter().all(|item| rest.any(|w| w == item))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Any bytes removed anywhere, and the rest split anyhow: every decoded event and edge belongs to the complete
    /// stream, at its time and position. All are decoded up to the first loss, and from the first time base word after the last.
    #[test]
    fn events_around_losses_match_the_stream(
        events in events(),
        format in prop::sample::select(FORMATS.to_vec()),
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 1_usize..200), 1..4),
        piece in 1_usize..50,
    ) {
        let bytes = encode(format, &events);
        let mut whole = DecodedEvents::default();
        push(&mut Decoder::new(format), &bytes, &mut whole);
        prop_assert_eq!(whole.0.len() + whole.1.len(), events.len());

        let mut cuts: Vec<(usize, usize)> = cuts
            .iter()
            // After the first time base word: without one, the number of wraps is unknown.
            .map(|(at, n)| ((8 + at.index(bytes.len())).min(bytes.len()), *n))
            .collect();
        cuts.sort_unstable();
        let (mut decoder, mut scanner) = (Decoder::new(format), Scanner::new(format));
        let (mut found, mut counted, mut from) = (DecodedEvents::default(), (0, Vec::new()), 0);
        let mut take = |decoder: &mut Decoder, scanner: &mut Scanner, part: &[u8], found: &mut DecodedEvents| {
            for part in part.chunks(piece) {
                push(decoder, part, found);
                let (facts, edges) = scanner.push(part);
                counted.0 += facts.cd_events;
                counted.1.extend(edges);
            }
        };
        let mut before = DecodedEvents::default();
        push(&mut Decoder::new(format), &bytes[..cuts[0].0], &mut before);
        for (at, n) in cuts {
            if at < from {
                continue;
            }
            take(&mut decoder, &mut scanner, &bytes[from..at], &mut found);
            let end = (at + n).min(bytes.len());
            decoder.lost((end - at) as u64);
            scanner.lost((end - at) as u64);
            from = end;
        }
        let kept = (found.0.len(), found.1.len());
        take(&mut decoder, &mut scanner, &bytes[from..], &mut found);

        prop_assert!(is_within(&found.0, &whole.0), "{format}: events {:?}", found.0);
        prop_assert!(is_within(&found.1, &whole.1), "{format}: edges {:?}", found.1);
        prop_assert!(found.0.starts_with(&before.0) && found.1.starts_with(&before.1));
        prop_assert_eq!(counted, (found.0.len() as u64, found.1.clone()));
        // A decoder of the rest alone, from its first whole word, finds as many events and edges.
        let word = match format {
            StreamFormat::Evt2 => 4,
            StreamFormat::Evt3 => 2,
            _ => 8,
        };
        let mut rest = DecodedEvents::default();
        push(&mut Decoder::new(format), &bytes[from.next_multiple_of(word).min(bytes.len())..], &mut rest);
        if format != StreamFormat::Evt3 {
            prop_assert_eq!((found.0.len() - kept.0, found.1.len() - kept.1), (rest.0.len(), rest.1.len()));
        }
    }
}

/// Two losses without a whole word between them count as one.
#[test]
fn losses_within_one_word_add_up() {
    let event = |t_us, x| CdEvent {
        t_us,
        x,
        y: 5,
        polarity: Polarity::On,
    };
    let events = [event(70, 1), event(80, 2), event(200, 4), event(300, 5)];
    let bytes = encode(StreamFormat::Evt2, &events);
    let mut decoder = Decoder::new(StreamFormat::Evt2);
    let mut found = DecodedEvents::default();
    push(&mut decoder, &bytes[..6], &mut found);
    decoder.lost(3);
    push(&mut decoder, &bytes[9..10], &mut found);
    decoder.lost(1);
    decoder.lost(0);
    push(&mut decoder, &bytes[11..], &mut found);
    assert_eq!(found.0, events[2..]);
    assert!(decoder.stats().dropped_before_time <= 1);
    // 2 bytes before the first loss, and 1 on either side of the second.
    assert_eq!(decoder.stats().trailing_bytes, 4);
}
