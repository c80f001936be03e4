//! The adapter over a scripted link, without a camera.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use skinrig_device::{CameraSettings, Clock, DeviceError, EventCamera, SyncMode};
use skinrig_evk4::{Evt3Camera, Link, LinkError, Model, Packet, Packets, StreamSettings, TimeBase};
use skinrig_model::{CameraId, HostTime, RawChunk};

const PACKET: usize = 128 << 10;
const MS: i64 = 1_000_000;

/// A clock that jumps.
#[derive(Clone, Default)]
struct JumpingClock(Arc<AtomicI64>);

impl Clock for JumpingClock {
    fn now(&self) -> HostTime {
        HostTime(self.0.load(Ordering::Relaxed))
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.fetch_max(t.0, Ordering::Relaxed);
    }
}

/// A camera that sends a packet every millisecond: a time, a row, an event and a trigger edge. Its clock keeps running over stops.
#[derive(Clone, Default)]
struct Script {
    clock: JumpingClock,
    /// Packets from this one to the next are dropped.
    drops: Option<(i64, i64)>,
    /// From this packet on, all are dropped.
    drops_rest: Option<i64>,
    /// The cable is pulled before this packet.
    ends: Option<i64>,
}

struct ScriptRun {
    script: Script,
    next_ms: i64,
    dropped: u64,
}

impl Link for Script {
    fn packet_bytes(&self) -> usize {
        PACKET
    }

    fn stream(&mut self, settings: &StreamSettings) -> Result<Box<dyn Packets>, LinkError> {
        assert_eq!(settings.trigger, settings.time_base == TimeBase::Master);
        Ok(Box::new(ScriptRun {
            next_ms: self.clock.now().0 / MS,
            script: self.clone(),
            dropped: 0,
        }))
    }
}

impl Packets for ScriptRun {
    fn next(&mut self, take: &mut dyn FnMut(Packet<'_>)) -> Result<bool, LinkError> {
        let now = self.script.clock.now().0;
        let mut after_loss = false;
        if let Some((from, to)) = self.script.drops
            && (from..to).contains(&self.next_ms)
            && now / MS >= to
        {
            self.dropped += (to - self.next_ms) as u64;
            (self.next_ms, after_loss) = (to, true);
        }
        if (self.next_ms + 1) * MS > now {
            return Ok(false);
        }
        if self
            .script
            .drops_rest
            .is_some_and(|from| self.next_ms >= from)
        {
            self.dropped += (now / MS - self.next_ms) as u64;
            self.next_ms = now / MS;
            return Ok(false);
        }
        if self.script.ends.is_some_and(|end| self.next_ms >= end) {
            return Err(LinkError("no device".into()));
        }
        let us = self.next_ms as u32 * 1_000;
        // TIME_HIGH, TIME_LOW, row 700, column 1279 ON, rising edge of channel 0.
        let words = [
            0x8000 | (us >> 12) as u16,
            0x6000 | (us & 0xfff) as u16,
            700,
            0x2800 | 1279,
            0xa001,
        ];
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        self.next_ms += 1;
        take(Packet {
            bytes: &bytes,
            age: Duration::from_nanos((now - self.next_ms * MS) as u64),
            after_loss,
        });
        Ok(true)
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }
}

fn settings(model: Model) -> CameraSettings {
    let all = CameraSettings::default();
    match model {
        Model::Evk4 => CameraSettings {
            sync: SyncMode::Master,
            biases: [("fo".to_owned(), -20)].into(),
            trigger_channels: vec![0],
            ..all
        },
        Model::Evk3Hd => CameraSettings {
            biases: [("fo_p".to_owned(), 80)].into(),
            ..all
        },
        Model::SilkyVga => all,
    }
}

fn started(script: &Script) -> Evt3Camera {
    let clock = Box::new(script.clock.clone());
    let mut camera = Evt3Camera::new(
        Model::Evk4,
        Box::new(script.clone()),
        "00ABCDEF",
        CameraId::Two,
        clock,
    );
    camera.configure(&settings(Model::Evk4)).expect("settings");
    camera.start().expect("start");
    camera
}

#[test]
fn the_adapter_keeps_the_contract() {
    for model in Model::ALL {
        let mut make = || -> (Box<dyn EventCamera>, Box<dyn Clock>) {
            let script = Script::default();
            let clock = Box::new(script.clock.clone());
            let camera = Evt3Camera::new(
                model,
                Box::new(script.clone()),
                "00ABCDEF",
                CameraId::One,
                clock.clone(),
            );
            (Box::new(camera), clock)
        };
        skinrig_device::contract::event_camera(&mut make, &settings(model));
    }
}

#[test]
fn unsupported_settings_are_rejected_by_name() {
    let refused = |model: Model, spoil: &dyn Fn(&mut CameraSettings)| {
        let mut all = settings(model);
        spoil(&mut all);
        StreamSettings::new(model, &all).unwrap_err().expected
    };
    let trigger = |s: &mut CameraSettings| s.trigger_channels = vec![0];
    let slave = |s: &mut CameraSettings| s.sync = SyncMode::Slave;
    let bias = |s: &mut CameraSettings| {
        s.biases.insert("diff_on".to_owned(), -1);
    };
    for model in [Model::Evk3Hd, Model::SilkyVga] {
        assert!(refused(model, &trigger).contains("no trigger input"));
        assert!(refused(model, &slave).contains("shares no time base"));
    }
    assert_eq!(refused(Model::Evk3Hd, &bias), "diff_on in 0..=255");
    assert!(refused(Model::SilkyVga, &bias).contains("keep their defaults"));
    assert!(StreamSettings::new(Model::Evk4, &settings(Model::Evk4)).is_ok());
}

#[test]
fn chunks_have_the_facts_of_their_words() {
    let script = Script::default();
    let mut camera = started(&script);
    script.clock.clone().wait_until(HostTime(10 * MS));
    let mut chunks: Vec<RawChunk> = Vec::new();
    camera.flush(&mut chunks).unwrap();
    let [chunk] = &chunks[..] else {
        panic!("{chunks:?}")
    };
    assert_eq!((chunk.facts.cd_events, chunk.facts.on_events), (10, 10));
    assert_eq!(
        (chunk.facts.first_us, chunk.facts.last_us),
        (Some(0), Some(9_000))
    );
    assert_eq!(chunk.triggers.len(), 10);
    assert_eq!(
        (chunk.triggers[3].t_us, chunk.triggers[3].rising),
        (3_000, true)
    );
    assert_eq!(
        chunk.host_time,
        HostTime(10 * MS),
        "when the last packet arrived"
    );
}

#[test]
fn dropped_packets_are_reported_in_the_next_chunk() {
    let script = Script {
        drops: Some((5, 8)),
        ..Script::default()
    };
    let mut camera = started(&script);
    script.clock.clone().wait_until(HostTime(10 * MS));
    let mut chunks = Vec::new();
    camera.stop(&mut chunks).unwrap();
    let losses: Vec<_> = chunks
        .iter()
        .map(|c| (c.seq, c.lost_before, c.facts.cd_events))
        .collect();
    assert_eq!(losses, [(0, 0, 5), (1, 3 * PACKET as u64, 2)]);
}

#[test]
fn packets_dropped_at_the_end_are_reported_at_stop() {
    let script = Script {
        drops_rest: Some(6),
        ..Script::default()
    };
    let mut camera = started(&script);
    script.clock.clone().wait_until(HostTime(10 * MS));
    let mut chunks = Vec::new();
    camera.stop(&mut chunks).unwrap();
    let losses: Vec<_> = chunks
        .iter()
        .map(|c| (c.seq, c.lost_before, c.facts.cd_events, c.host_time))
        .collect();
    let lost = 4 * PACKET as u64;
    assert_eq!(
        losses,
        [(0, 0, 6, HostTime(6 * MS)), (1, lost, 0, HostTime(10 * MS))]
    );
}

#[test]
fn the_end_of_the_link_is_reported_after_its_data() {
    let script = Script {
        ends: Some(4),
        ..Script::default()
    };
    let mut camera = started(&script);
    script.clock.clone().wait_until(HostTime(10 * MS));
    let mut chunks = Vec::new();
    match camera.poll(&mut chunks) {
        Err(DeviceError::Lost { serial, detail, .. }) => {
            assert_eq!((&serial[..], &detail[..]), ("00ABCDEF", "no device"));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(chunks.iter().map(|c| c.facts.cd_events).sum::<u64>(), 4);
    assert_eq!(camera.stop(&mut chunks), Ok(()));
}
