//! Writes the part of the corpus that our own code makes: `cargo run -p skinrig-fuzz --example make_corpus`.
#![expect(
    clippy::unwrap_used,
    reason = "a corpus that cannot be made is not made"
)]

#[path = "../../../crates/recorder/tests/session/common.rs"]
#[expect(dead_code, reason = "the recorder's tests use more of it")]
mod common;

use std::path::{Path, PathBuf};

use skinrig_formats::codec;
use skinrig_formats::evt2::Encoder;
use skinrig_formats::raw::{RawMetadata, RawWriter};
use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};
use skinrig_recorder::SessionWriter;
use skinrig_trigger_box::frame;
use sqlx::Connection;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};

/// Pages of the small sessions, bytes. Sessions have larger ones; small pages hit more with each mutation.
const PAGE_BYTES: u32 = 1024;

fn file(kind: &str, name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(kind);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    let _ = std::fs::remove_file(&path);
    path
}

fn events() -> Vec<CdEvent> {
    let event = |k: u64| CdEvent {
        t_us: 1_000 + 7 * k,
        x: (k * 13 % 640) as u16,
        y: (k * 29 % 480) as u16,
        polarity: Polarity::from_bit(k.is_multiple_of(3)),
    };
    (0..200).map(event).collect()
}

fn evt2() -> Vec<u8> {
    let mut encoder = Encoder::new(0);
    let mut bytes = Vec::new();
    for event in events() {
        encoder.cd(event, &mut bytes).unwrap();
        if event.t_us.is_multiple_of(5) {
            let (t_us, rising) = (event.t_us, event.t_us.is_multiple_of(2));
            encoder
                .trigger(
                    TriggerEdge {
                        t_us,
                        channel: 0,
                        rising,
                    },
                    &mut bytes,
                )
                .unwrap();
        }
    }
    bytes
}

/// Words of every type of EVT2.1, in the order of the type.
fn evt21() -> Vec<u8> {
    let words = (0..400u64).map(|k| {
        let low = (k & 63) << 54 | (k * 32 % 640) << 43 | (k % 480) << 32 | (k | 1);
        match k % 8 {
            0 => 8 << 60 | k << 32,
            1..=3 => low,
            4..=6 => 1 << 60 | low,
            _ => 10 << 60 | (k & 63) << 54 | (k & 1) << 32,
        }
    });
    words.flat_map(u64::to_le_bytes).collect()
}

/// Words of every type of EVT3, in the order of the type.
fn evt3() -> Vec<u8> {
    let words = (0..600u16).map(|k| match k % 8 {
        0 => 0x8000 | k,
        1 => 0x6000 | k,
        2 => k % 480,
        3 => 0x2000 | (k % 640),
        4 => 0x3000 | (k % 640),
        5 => 0x4000 | k,
        6 => 0x5000 | k & 0xff,
        _ => 0xa000 | k & 1,
    });
    words.flat_map(u16::to_le_bytes).collect()
}

fn streams() {
    let formats = [
        ("evt2", StreamFormat::Evt2, evt2()),
        ("evt21", StreamFormat::Evt21, evt21()),
        ("evt21-legacy", StreamFormat::Evt21Legacy, evt21()),
        ("evt3", StreamFormat::Evt3, evt3()),
    ];
    for (choice, (name, format, bytes)) in (0u8..).zip(formats) {
        let words = [&[choice | 8 << 2], &bytes[..]].concat();
        std::fs::write(file("stream", name), words).unwrap();
        let metadata = RawMetadata {
            format,
            ..RawMetadata::evk1("2026-01-02 03:04:05", "00000157")
        };
        let path = file("raw", &format!("{name}.raw"));
        let mut writer = RawWriter::create(&path, &metadata).unwrap();
        writer.write(&bytes).unwrap();
        writer.finish().unwrap();
    }
    for (name, raw) in [
        ("idle", common::stream(5_000_000, 0)),
        ("busy", common::stream(5_000_000, 300)),
    ] {
        let stored = codec::fold(&raw).unwrap();
        let claimed = (raw.len() as u32).to_le_bytes();
        std::fs::write(file("folded", name), [&claimed, &stored[..]].concat()).unwrap();
    }
}

fn texts() {
    for (name, text) in [
        (
            "published.csv",
            "x,y,z\n0.001,-0.002,0.0\n0.004,0.005,0.001\n,,\n",
        ),
        (
            "two-columns.csv",
            "y, x ,note\r\n1,2,\"a, b\"\r\n-3.5e-1,4,\r\n",
        ),
    ] {
        std::fs::write(file("csv", name), text).unwrap();
    }
    let biases = skinrig_evk1::biases::parse_bias_file("1500 % bias_fo\n");
    let written = biases.and_then(|b| skinrig_evk1::biases::write_bias_file(&b));
    std::fs::write(
        file("biases", "all.bias"),
        written.unwrap_or_else(|_| "1500 % bias_fo\n".into()),
    )
    .unwrap();
}

fn devices() {
    // A greeting, events of every kind, counters: bodies as the firmware sends them, in frames on the line.
    let mut line = Vec::new();
    let head = |command: u8, outcome: u8| {
        let mut body = vec![2, command | 0x80, 1, 0, outcome, 1, 3, 0];
        body.extend(160_000_000u64.to_le_bytes());
        body
    };
    let mut hello = head(1, 0);
    hello.extend(b"\x01\x01\x00\x10\x04A123\x13skinrig-trigger-box");
    let mut message = head(6, 0);
    message.extend([0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 4]);
    for (kind, code) in [(1u32, 0u32), (2, 7 << 17), (3, 0), (4, 0)] {
        message.extend((kind << 24 | code).to_le_bytes());
        message.extend(170_000_000u64.to_le_bytes());
    }
    let mut counters = head(7, 0);
    counters.extend([0; 40]);
    for body in [hello, message, counters, head(9, 0), head(4, 3)] {
        line.extend(frame::encode(&body).unwrap());
    }
    std::fs::write(file("box", "line"), &line).unwrap();
    // Replies in turn: length, outcome, flags, boot, ticks, answers.
    let mut replies = Vec::new();
    for k in 0..60u8 {
        let answers = usize::from(k) * 7 % 80;
        replies.push(12 + answers as u8);
        replies.extend([0, 1, 3, 0]);
        replies.extend((u64::from(k) * 320_000).to_le_bytes());
        replies.extend((0..answers).map(|n| (n as u8).wrapping_mul(k)));
    }
    std::fs::write(file("box", "replies"), replies).unwrap();
    std::fs::write(file("robot", "good"), [2; 300]).unwrap();
    let odd: Vec<u8> = (0..600u32)
        .map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    std::fs::write(file("robot", "odd"), odd).unwrap();
    let nan: Vec<u8> = (0..80)
        .flat_map(|_| [1, 0, 0, 0, 0, 0, 0, 0xf8, 0x7f])
        .collect();
    std::fs::write(file("robot", "no-numbers"), nan).unwrap();
}

/// The recorder's test session, sealed and in the middle of a run, rewritten with small pages.
async fn sessions() {
    let folder = tempfile::tempdir().unwrap();
    let view =
        "CREATE VIEW note AS WITH RECURSIVE n(t_ns) AS (SELECT 1 UNION ALL SELECT t_ns + 1 FROM n)
                SELECT t_ns AS id, t_ns, 'x' AS text FROM n";
    let column =
        "CREATE TABLE note (id INTEGER PRIMARY KEY, t_ns, text AS (hex(zeroblob(400000000))))";
    for (name, ended, note) in [
        ("ended.sqlite", true, None),
        ("cut-off.sqlite", false, None),
        ("endless-view.sqlite", true, Some(view)),
        ("computed-column.sqlite", true, Some(column)),
    ] {
        let path = folder.path().join(name);
        tokio::task::spawn_blocking({
            let path = path.clone();
            move || {
                let mut writer = SessionWriter::create(&path).unwrap();
                let all = common::records(3);
                let some = if ended { all.len() } else { all.len() - 5 };
                for record in all.into_iter().take(some) {
                    writer.accept(record).unwrap();
                }
                if ended {
                    writer.finish().unwrap();
                }
            }
        })
        .await
        .unwrap();
        let copy = folder.path().join("copy");
        std::fs::write(&copy, std::fs::read(&path).unwrap()).unwrap();
        let options = SqliteConnectOptions::new().filename(&copy);
        let mut conn = SqliteConnection::connect_with(&options).await.unwrap();
        for pragma in ["PRAGMA journal_mode = DELETE", "PRAGMA page_size = 1024"] {
            sqlx::query(pragma).execute(&mut conn).await.unwrap();
        }
        for statement in note.into_iter().flat_map(|note| ["DROP TABLE note", note]) {
            sqlx::query(statement).execute(&mut conn).await.unwrap();
        }
        let small = file("session", name);
        sqlx::query("VACUUM INTO ?")
            .bind(small.to_str().unwrap())
            .execute(&mut conn)
            .await
            .unwrap();
        conn.close().await.unwrap();
        std::fs::remove_file(copy).unwrap();
        let head = std::fs::read(&small).unwrap();
        assert_eq!(
            u32::from(u16::from_be_bytes([head[16], head[17]])),
            PAGE_BYTES
        );
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() {
    streams();
    texts();
    devices();
    sessions().await;
}
