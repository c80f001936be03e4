//! Progress of a run from its records.

use skinrig_controller::ProgressTracker;
use skinrig_model::*;

use crate::course::{faults, run};

#[test]
fn progress_follows_the_records() {
    let result = run(faults());
    let expected = HostDuration::from_millis(1700);
    let mut tracker = ProgressTracker::new(Some(expected));
    let mut labels = Vec::new();
    let mut last_eta = None;
    for record in &result.records {
        let done = tracker.progress().done;
        let p = tracker.update(record);
        assert!(p.done >= done && p.done == p.valid + p.invalid + p.missed);
        last_eta = p.eta.or(last_eta);
        if matches!(record, Record::Intent { .. }) {
            labels.push(tracker.press_label());
        }
    }
    assert_eq!(labels, ["1/3", "2/3", "3/3"]);
    let p = tracker.progress();
    assert_eq!((p.planned, p.done, p.valid), (3, 3, 3));
    assert_eq!(p.marks_sent, 9);
    assert_eq!(p.end, Some(RunEnd::Completed));
    assert!(p.eta.is_none() && last_eta.is_some_and(|e| e.as_secs_f64() < 0.1));
    assert!(
        p.tip
            .is_some_and(|(at, z)| at.distance_mm(Point2::new(14.0, -6.0)) < 0.05 && z > 4.9)
    );
    for camera in CameraId::ALL {
        // 100 events in a chunk, a chunk about every 100 ms.
        let rate = tracker.events_per_s(camera).unwrap_or_default();
        assert!((800.0..1300.0).contains(&rate), "{rate}");
    }
}

#[test]
fn rates_count_the_events_between_chunks() {
    let mut tracker = ProgressTracker::new(None);
    let mut send = |seq: u64, ms: i64, cd_events: u64| {
        let p = tracker.update(&Record::Chunk(RawChunk {
            camera: CameraId::Two,
            seq,
            host_time: HostTime(ms * 1_000_000),
            lost_before: 0,
            lost_from_us: None,
            bytes: vec![],
            facts: ChunkFacts {
                cd_events,
                ..ChunkFacts::default()
            },
            triggers: vec![],
        }));
        p.cameras[1].events_per_s
    };
    assert_eq!(send(0, 0, 999), None);
    assert_eq!(send(1, 500, 50), Some(100.0));
    assert_eq!(send(2, 1000, 150), Some(200.0));
    // The oldest chunk leaves the span of one second.
    assert_eq!(send(3, 1500, 250), Some(400.0));
}

#[test]
fn marks_are_counted_across_chunks_and_stray_edges_are_not() {
    let mark = Mark {
        kind: MarkKind::Contact,
        press: PressId::from_index(77),
    };
    let mut edges = vec![TriggerEdge {
        t_us: 10,
        channel: 0,
        rising: true,
    }];
    for base in [1_000, 50_000] {
        for (offset, width) in PulseTrain::new(mark)
            .into_iter()
            .flat_map(PulseTrain::pulses)
        {
            for (t_us, rising) in [(base + offset, true), (base + offset + width, false)] {
                edges.push(TriggerEdge {
                    t_us,
                    channel: 0,
                    rising,
                });
            }
        }
    }
    let mut tracker = ProgressTracker::new(None);
    let mut observed = Vec::new();
    for (seq, part) in edges.chunks(20).enumerate() {
        let p = tracker.update(&Record::Chunk(RawChunk {
            camera: CameraId::One,
            seq: seq as u64,
            host_time: HostTime(seq as i64),
            lost_before: 0,
            lost_from_us: None,
            bytes: vec![],
            facts: ChunkFacts::default(),
            triggers: part.to_vec(),
        }));
        observed.push(p.cameras[0].marks_seen);
    }
    // A train is complete once no more than three of its bits are missing: the first after 60 edges.
    assert_eq!(observed, [0, 0, 1, 1, 1, 1, 2]);
}
