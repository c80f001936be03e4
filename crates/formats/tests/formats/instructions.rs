//! Every instruction set decodes the same, at any split, and EVT3 as a decoder that looks at one word after the other.
#![expect(clippy::unwrap_used, reason = "tests")]

use proptest::prelude::*;
use skinrig_formats::{Decoder, Discontinuity, EventSink, Geometry, Monitoring, Scanner};
use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};
use skinrig_simd::InstructionSet;

const SMALL: Geometry = Geometry {
    width: 320,
    height: 100,
};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Item {
    Cd(CdEvent),
    Trigger(TriggerEdge),
    Monitoring(Monitoring),
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
    fn on_monitoring(&mut self, monitoring: Monitoring) {
        self.0.push(Item::Monitoring(monitoring));
    }
    fn on_discontinuity(&mut self, step: Discontinuity) {
        self.0.push(Item::Jump(step));
    }
}

/// EVT3 words, mostly single events, rows and low times, or mostly vectors; few others.
fn evt3(random: &[(u8, u16)], vectors: bool) -> Vec<u8> {
    let mut high = 0x0fe_u16;
    let mut words = vec![0x8000 | high, 0x6001, 7];
    for (kind, any) in random {
        let data = any & 0x0fff;
        let pixel = (any & 0x0800) | (any % 310);
        words.push(match kind {
            0..100 if vectors => {
                [0x3000 | pixel, 0x4000 | data, 0x5000 | data][any.count_ones() as usize % 3]
            }
            0..100 => 0x2000 | pixel,
            100..115 => any % 100,
            115..130 => 0x6000 | data,
            130..136 => 0x8000 | high,
            136 => {
                high = (high + any % 3) & 0x0fff;
                0x8000 | high
            }
            137 => 0x8000 | data,
            138 => 0x3000 | data,
            139 => 0x2000 | data,
            140 => data,
            141 => *any,
            142 => 0xa000 | data,
            143 => [0xe000, 0xf000, 0x7000][usize::from(any % 3)] | data,
            _ => 0x2000 | pixel,
        });
    }
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}

/// EVT2 words: events and progress of the time base in some proportion, and few others.
fn evt2(random: &[(u8, u16)], quiet: bool) -> Vec<u8> {
    let mut high = 0x0fff_ff00_u32;
    let words = random.iter().map(|(kind, any)| {
        let any = u32::from(*any);
        match kind {
            0..100 if quiet => {
                high = (high + any % 3) & 0x0fff_ffff;
                0x8000_0000 | high
            }
            100 => any << 16 | any,
            101 => 0x8000_0000 | any << 8,
            _ => (any & 1) << 28 | (any & 0x3f) << 22 | ((any % 310) << 11) | (any % 90),
        }
    });
    words.flat_map(u32::to_le_bytes).collect()
}

/// The CD events of EVT3 words whose row, column and time are known, on a sensor of this size.
fn one_by_one(bytes: &[u8], geometry: Geometry) -> Vec<CdEvent> {
    let (mut high, mut low, mut epoch) = (None::<u64>, 0, 0_u64);
    // Before a step that was no progress, and to where it went: taken back if the next word goes on from before it.
    let mut doubtful = None::<(u64, u64, u64)>;
    let progress = |from: u64, to: u64| to >= from && to - from <= 1 << 11;
    let (mut row, mut vector) = (None, None::<(u16, u16)>);
    let mut events = Vec::new();
    for word in bytes.chunks_exact(2) {
        let w = u16::from_le_bytes([word[0], word[1]]);
        let data = w & 0x0fff;
        let t_us = high.map(|high| epoch + (high << 12) + low);
        let mut add = |x, sign: u16| {
            if let (Some(t_us), Some(y)) = (t_us, row)
                && geometry.contains(x, y)
            {
                let polarity = Polarity::from_bit(sign & 0x0800 != 0);
                events.push(CdEvent {
                    t_us,
                    x,
                    y,
                    polarity,
                });
            }
        };
        match w >> 12 {
            0 => row = Some(data & 0x7ff),
            2 => add(data & 0x7ff, data),
            3 => vector = Some((data & 0x7ff, data)),
            kind @ (4 | 5) => {
                let columns = if kind == 4 { 12 } else { 8 };
                if let Some((x, sign)) = vector {
                    let bits = (0..columns).filter(|bit| data >> bit & 1 == 1);
                    bits.for_each(|bit| add(x + bit, sign));
                    vector = Some((x.saturating_add(columns), sign));
                }
            }
            6 => low = data.into(),
            8 => {
                let next = u64::from(data);
                if high != Some(next) {
                    low = 0;
                }
                if let Some(high) = high.filter(|high| !progress(*high, next)) {
                    match doubtful.replace((high, epoch, next)) {
                        Some((last, at, found)) if found == high && progress(last, next) => {
                            (epoch, doubtful) = (at, None);
                        }
                        _ if high > next && high - next > 1 << 11 => epoch += 1 << 24,
                        _ => {}
                    }
                }
                high = Some(next);
            }
            _ => {}
        }
    }
    events
}

/// What a decoder and a scanner report of the pieces.
fn outcome(
    set: InstructionSet,
    format: StreamFormat,
    geometry: Geometry,
    pieces: &[&[u8]],
) -> (Vec<Item>, String) {
    let mut decoder = Decoder::with_geometry(format, geometry).with_instructions(set);
    let mut items = Items::default();
    let mut scanner = Scanner::with_geometry(format, geometry).with_instructions(set);
    let facts: Vec<_> = pieces.iter().map(|piece| scanner.push(piece)).collect();
    pieces
        .iter()
        .for_each(|piece| decoder.push(piece, &mut items));
    assert_eq!(decoder.stats(), scanner.stats());
    let times = (decoder.first_us(), decoder.last_us());
    (
        items.0,
        format!("{:?} {times:?} {facts:?}", decoder.stats()),
    )
}

fn check(
    format: StreamFormat,
    geometry: Geometry,
    bytes: &[u8],
    size: usize,
) -> Result<Vec<Item>, TestCaseError> {
    let (whole, split) = (vec![bytes], bytes.chunks(size).collect::<Vec<_>>());
    let mut first = None;
    for pieces in [&whole, &split] {
        let sets = InstructionSet::available().into_iter();
        let all: Vec<_> = sets
            .map(|set| (set, outcome(set, format, geometry, pieces)))
            .collect();
        for (set, other) in &all[1..] {
            prop_assert_eq!(&all[0].1, other, "{:?}", set);
        }
        let items = all[0].1.0.clone();
        prop_assert_eq!(first.get_or_insert(items.clone()), &items);
    }
    Ok(first.unwrap())
}

proptest! {
    #[test]
    fn all_sets_decode_evt3_as_one_word_after_the_other(
        random in prop::collection::vec((0_u8..150, any::<u16>()), 0..3000),
        vectors in any::<bool>(),
        geometry in prop::sample::select(vec![Geometry::EVK1, Geometry::ANY, SMALL]),
        size in 1_usize..700,
    ) {
        let bytes = evt3(&random, vectors);
        let items = check(StreamFormat::Evt3, geometry, &bytes, size)?;
        let events = items.into_iter().filter_map(|item| match item {
            Item::Cd(event) => Some(event),
            _ => None,
        });
        let found: Vec<CdEvent> = events.collect();
        prop_assert_eq!(found, one_by_one(&bytes, geometry));
    }

    #[test]
    fn all_sets_decode_evt2_alike(
        random in prop::collection::vec((0_u8..150, any::<u16>()), 0..3000),
        quiet in any::<bool>(),
        geometry in prop::sample::select(vec![Geometry::EVK1, Geometry::ANY, SMALL]),
        size in 1_usize..700,
    ) {
        check(StreamFormat::Evt2, geometry, &evt2(&random, quiet), size)?;
    }
}
