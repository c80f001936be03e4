//! The published test vectors of all stream formats, whole and split at every byte.

use skinrig_formats::{Decoder, EventSink, Monitoring, Scanner};
use skinrig_model::{CdEvent, StreamFormat, TriggerEdge};

/// (name, format, bytes, what must come out)
const VECTORS: &[(&str, StreamFormat, &str, &str)] = &[
    (
        "E2-1 basic",
        StreamFormat::Evt2,
        "01 00 00 80 f0 00 4a 11",
        "CD t=69 x=320 y=240 p=1",
    ),
    (
        "E2-2 corners, both polarities",
        StreamFormat::Evt2,
        "02 00 00 80 00 00 00 00 df f9 d3 1f",
        "CD t=128 x=0 y=0 p=0; CD t=191 x=639 y=479 p=1",
    ),
    (
        "E2-3 drop before first TIME_HIGH",
        StreamFormat::Evt2,
        "14 50 40 12 01 00 40 a2 03 00 00 80 15 58 40 02",
        "CD t=201 x=11 y=21 p=0",
    ),
    (
        "E2-4 repeated TIME_HIGH (every 16us)",
        StreamFormat::Evt2,
        "10 00 00 80 01 08 00 10 10 00 00 80 02 10 40 14 10 00 00 80 03 18 00 1a 10 00 00 80 11 00 00 80 04 20 00 10",
        "CD t=1024 x=1 y=1 p=1; CD t=1041 x=2 y=2 p=1; CD t=1064 x=3 y=3 p=1; CD t=1088 x=4 y=4 p=1",
    ),
    (
        "E2-5 triggers",
        StreamFormat::Evt2,
        "00 01 00 80 01 00 40 a0 00 00 40 a8 01 06 80 a8 00 07 c0 a8 06 28 00 19",
        "TRIG t=16385 id=0 value=1; TRIG t=16417 id=0 value=0; TRIG t=16418 id=6 value=1; TRIG t=16419 id=7 value=0; CD t=16420 x=5 y=6 p=1",
    ),
    (
        "E2-6 34-bit wrap",
        StreamFormat::Evt2,
        "ff ff ff 8f 32 20 c3 1f 00 00 00 80 33 28 03 00 01 00 80 a0 01 00 00 80 34 30 43 10",
        "CD t=17179869183 x=100 y=50 p=1; CD t=17179869184 x=101 y=51 p=0; TRIG t=17179869186 id=0 value=1; CD t=17179869249 x=102 y=52 p=1",
    ),
    (
        "E2-7 OTHER+CONTINUED skipped",
        StreamFormat::Evt2,
        "05 00 00 80 14 00 c0 e1 34 12 00 f0 08 38 00 12",
        "OTHERS t=327 subtype=0x14 payload=0x1234; CD t=328 x=7 y=8 p=1",
    ),
    (
        "E2-8 IMU 1+5 words skipped",
        StreamFormat::Evt2,
        "06 00 00 80 f6 ff c1 d0 02 00 c0 f0 04 00 c0 f0 06 00 c0 f0 08 00 c0 f0 0a 00 c0 f0 0a 48 00 01",
        "CD t=388 x=9 y=10 p=0",
    ),
    (
        "E21-1 vector LE",
        StreamFormat::Evt21,
        "00 00 00 00 02 00 00 80 01 00 00 80 64 00 81 12",
        "CD t=138 x=32 y=100 p=1; CD t=138 x=63 y=100 p=1",
    ),
    (
        "E21-2 OFF full nibble",
        StreamFormat::Evt21,
        "00 00 00 00 02 00 00 80 0f 00 00 00 df 01 d3 02",
        "CD t=139 x=608 y=479 p=0; CD t=139 x=609 y=479 p=0; CD t=139 x=610 y=479 p=0; CD t=139 x=611 y=479 p=0",
    ),
    (
        "E21-3 empty mask",
        StreamFormat::Evt21,
        "00 00 00 00 02 00 00 80 00 00 00 00 00 00 00 13 02 00 00 00 01 00 40 13",
        "CD t=141 x=1 y=1 p=1",
    ),
    (
        "E21-4 trigger",
        StreamFormat::Evt21,
        "00 00 00 00 10 00 00 80 00 00 00 00 01 00 40 a1 00 00 00 00 00 00 00 af",
        "TRIG t=1029 id=0 value=1; TRIG t=1084 id=0 value=0",
    ),
    (
        "E21-5 wrap",
        StreamFormat::Evt21,
        "00 00 00 00 ff ff ff 8f 01 00 00 00 03 00 c0 1f 00 00 00 00 00 00 00 80 01 00 00 00 04 00 00 10",
        "CD t=17179869183 x=0 y=3 p=1; CD t=17179869184 x=0 y=4 p=1",
    ),
    (
        "E21-6 OTHERS",
        StreamFormat::Evt21,
        "00 00 00 00 01 00 00 80 34 12 00 f0 14 00 c0 e0 01 00 00 00 05 00 02 01",
        "OTHERS t=67 subtype=0x14 payload=0xF0001234; CD t=68 x=64 y=5 p=0",
    ),
    (
        "E21-7 same as E21-1, legacy order",
        StreamFormat::Evt21Legacy,
        "02 00 00 80 00 00 00 00 64 00 81 12 01 00 00 80",
        "CD t=138 x=32 y=100 p=1; CD t=138 x=63 y=100 p=1",
    ),
    (
        "E3-1 single events",
        StreamFormat::Evt3,
        "00 80 64 60 f0 00 40 29 41 21",
        "CD t=100 x=320 y=240 p=1; CD t=100 x=321 y=240 p=0",
    ),
    (
        "E3-2 VECT 12+12+8",
        StreamFormat::Evt3,
        "01 80 02 60 0a 00 40 38 01 48 02 40 80 50",
        "CD t=4098 x=64 y=10 p=1; CD t=4098 x=75 y=10 p=1; CD t=4098 x=77 y=10 p=1; CD t=4098 x=95 y=10 p=1",
    ),
    (
        "E3-3 two vector groups, base advances",
        StreamFormat::Evt3,
        "01 80 03 60 0b 00 00 30 01 40 00 40 00 50 01 40 00 48 01 50",
        "CD t=4099 x=0 y=11 p=0; CD t=4099 x=32 y=11 p=0; CD t=4099 x=55 y=11 p=0; CD t=4099 x=56 y=11 p=0",
    ),
    (
        "E3-4 triggers",
        StreamFormat::Evt3,
        "02 80 05 60 01 a0 06 60 00 a0 01 a6",
        "TRIG t=8197 id=0 value=1; TRIG t=8198 id=0 value=0; TRIG t=8198 id=6 value=1",
    ),
    (
        "E3-5 24-bit wrap",
        StreamFormat::Evt3,
        "ff 8f ff 6f 01 00 02 28 00 80 00 60 03 28 01 80 07 60 04 20",
        "CD t=16777215 x=2 y=1 p=1; CD t=16777216 x=3 y=1 p=1; CD t=16781319 x=4 y=1 p=0",
    ),
    (
        "E3-6 TL rolls with TH+1",
        StreamFormat::Evt3,
        "07 80 ff 6f 14 00 1e 28 08 80 00 60 1f 28",
        "CD t=32767 x=30 y=20 p=1; CD t=32768 x=31 y=20 p=1",
    ),
    (
        "E3-7 drop before first TIME_HIGH",
        StreamFormat::Evt3,
        "01 00 02 28 01 a0 03 80 00 60 04 00 05 20",
        "CD t=12288 x=5 y=4 p=0",
    ),
    (
        "E3-8 OTHERS + CONTINUED_12,12,4",
        StreamFormat::Evt3,
        "04 80 01 60 14 e0 34 f2 01 f0 00 70 06 00 07 28",
        "OTHERS t=16385 subtype=0x14 payload=0x1234; CD t=16385 x=7 y=6 p=1",
    ),
    (
        "E3-9 lone VECT_12 then VECT_8 (not a 12-12-8 triple)",
        StreamFormat::Evt3,
        "05 80 01 60 06 00 60 38 03 40 01 50",
        "CD t=20481 x=96 y=6 p=1; CD t=20481 x=97 y=6 p=1; CD t=20481 x=108 y=6 p=1",
    ),
    (
        "E3-10 y out of range (y=500 on 480 rows)",
        StreamFormat::Evt3,
        "05 80 01 60 f4 01 07 28 df 01 08 28",
        "CD t=20481 x=8 y=479 p=1",
    ),
];

#[derive(Default)]
struct Text(Vec<String>);

impl EventSink for Text {
    fn on_cd(&mut self, events: &[CdEvent]) {
        for e in events {
            let (t, p) = (e.t_us, e.polarity.bit());
            self.0.push(format!("CD t={t} x={} y={} p={p}", e.x, e.y));
        }
    }
    fn on_trigger(&mut self, e: TriggerEdge) {
        let (t, value) = (e.t_us, u8::from(e.rising));
        self.0
            .push(format!("TRIG t={t} id={} value={value}", e.channel));
    }
    fn on_monitoring(&mut self, m: Monitoring) {
        let (t, sub, payload) = (m.t_us, m.subtype, m.payload);
        self.0.push(format!(
            "OTHERS t={t} subtype={sub:#x} payload={payload:#X}"
        ));
    }
}

fn bytes_of(hex: &str) -> Vec<u8> {
    hex.split(' ')
        .map(|b| u8::from_str_radix(b, 16).expect("two hexadecimal digits"))
        .collect()
}

fn decode(format: StreamFormat, parts: &[&[u8]]) -> String {
    let (mut decoder, mut text) = (Decoder::new(format), Text::default());
    for part in parts {
        decoder.push(part, &mut text);
    }
    text.0.join("; ")
}

#[test]
fn all_vectors_decode_completely_and_at_every_split() {
    assert_eq!(VECTORS.len(), 25);
    for (name, format, hex, expected) in VECTORS {
        let bytes = bytes_of(hex);
        let expected = expected.replace("0x", "0X");
        let check = |parts: &[&[u8]]| {
            assert_eq!(
                decode(*format, parts).replace("0x", "0X"),
                expected,
                "{name}"
            );
        };
        check(&[&bytes]);
        check(&bytes.chunks(1).collect::<Vec<_>>());
        for at in 0..=bytes.len() {
            check(&[&bytes[..at], &bytes[at..]]);
        }
    }
}

#[test]
fn the_scanner_and_the_decoder_have_equal_counts() {
    for (name, format, hex, expected) in VECTORS {
        let bytes = bytes_of(hex);
        for size in 1..=bytes.len() {
            let mut scanner = Scanner::new(*format);
            let (mut cd, mut on, mut edges) = (0, 0, 0);
            for part in bytes.chunks(size) {
                let (facts, triggers) = scanner.push(part);
                assert_eq!(facts.trigger_edges, triggers.len() as u64);
                assert_eq!(facts.first_us.is_some(), facts.last_us.is_some());
                cd += facts.cd_events;
                on += facts.on_events;
                edges += facts.trigger_edges;
            }
            assert_eq!(cd, expected.matches("CD ").count() as u64, "{name}");
            assert_eq!(on, expected.matches("p=1").count() as u64, "{name}");
            assert_eq!(edges, expected.matches("TRIG").count() as u64, "{name}");
        }
    }
}
