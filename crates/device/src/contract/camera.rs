//! Contract of event cameras.

use skinrig_model::{HostDuration, HostTime, RawChunk};

use super::{answered, pass};
use crate::{CameraSettings, Clock, DeviceError, EventCamera, OpenChunk, Roi, TestPattern};

/// Verifies the contract of [`EventCamera`]. `make` returns a new, stopped camera and its clock; `settings` are those of the rig.
pub fn event_camera(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    camera_states(make, settings);
    camera_stream(make, settings);
    camera_pattern(make, settings);
}

fn camera_states(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    let (mut camera, mut clock) = make();
    let mut chunks = Vec::new();
    assert!(
        !camera.identity().model.is_empty(),
        "camera: expected a model name"
    );
    let can = camera.capabilities();
    camera
        .stop(&mut chunks)
        .expect("camera: stop must be allowed before everything");
    let mut bias = settings.clone();
    bias.biases.insert("bias_of_no_camera".to_owned(), 1);
    let mut channel = settings.clone();
    channel.trigger_channels.push(31);
    let mut region = settings.clone();
    region.roi = Some(Roi {
        x: can.width - 1,
        y: 0,
        width: 2,
        height: 1,
    });
    let mut none = settings.clone();
    none.roi = Some(Roi {
        x: 0,
        y: 0,
        width: 0,
        height: 1,
    });
    for (bad, what) in [
        (bias, "an unknown bias"),
        (channel, "an unknown trigger channel"),
        (region, "a region outside the sensor"),
        (none, "an empty region"),
    ] {
        expect_error!(
            camera.configure(&bad),
            DeviceError::Refused { .. },
            format!("camera: {what} must be refused")
        );
    }
    camera
        .configure(settings)
        .expect("camera: the rig's settings must be accepted");
    camera.start().expect("camera: a stopped camera must start");
    expect_error!(
        camera.start(),
        DeviceError::State { .. },
        "camera: start while streaming must be a State error"
    );
    expect_error!(
        camera.configure(settings),
        DeviceError::State { .. },
        "camera: configure while streaming must be a State error"
    );
    let hot = answered(clock.as_mut(), || camera.temperature_c())
        .expect("camera: temperature while streaming");
    camera.stop(&mut chunks).expect("camera: stop");
    camera.stop(&mut chunks).expect("camera: stop twice");
    let cold = answered(clock.as_mut(), || camera.temperature_c())
        .expect("camera: temperature while stopped");
    assert_eq!(
        hot.map(f64::is_finite),
        cold.map(|_| true),
        "camera: it tells a temperature in every state or in none, found {hot:?} and {cold:?}"
    );
    camera
        .configure(settings)
        .expect("camera: configure after stop");
}

fn camera_stream(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    let (mut camera, mut clock) = make();
    camera
        .configure(settings)
        .expect("camera: the rig's settings must be accepted");
    let mut all: Vec<RawChunk> = Vec::new();
    let mut open: Vec<OpenChunk> = Vec::new();
    camera.poll(&mut all).expect("camera: poll while stopped");
    assert!(all.is_empty(), "camera: a stopped camera sends nothing");
    for round in 0..2 {
        camera.start().expect("camera: start");
        let before = all.len();
        pass(clock.as_mut(), HostDuration::from_millis(300), || {
            camera.poll(&mut all).expect("camera: poll");
            let from = next_of(&open, all.len() as u64);
            open.extend(camera.open_chunk(from));
        });
        let at = clock.now();
        answered(clock.as_mut(), || camera.flush(&mut all)).expect("camera: flush");
        let after = all.len();
        answered(clock.as_mut(), || camera.flush(&mut all)).expect("camera: flush again");
        // Bytes arrive between two calls on a real clock, and while an unfinished first call waits for its reply.
        assert!(
            all.len() == after || clock.now() > at,
            "camera: a second flush at the same time must be empty (round {round})"
        );
        pass(clock.as_mut(), HostDuration::from_millis(20), || {});
        camera.stop(&mut all).expect("camera: stop");
        let stopped = all.len();
        camera.poll(&mut all).expect("camera: poll after stop");
        answered(clock.as_mut(), || camera.flush(&mut all)).expect("camera: flush after stop");
        assert_eq!(all.len(), stopped, "camera: a stopped camera sends nothing");
        if round == 0 {
            let bytes: usize = all[before..].iter().map(|c| c.bytes.len()).sum();
            assert!(bytes > 0, "camera: expected bytes after 0.3 s, found none");
        }
    }
    check_chunks(camera.as_ref(), &all, clock.now());
    for part in &open {
        let chunk = all.iter().find(|c| c.seq == part.seq);
        let chunk = chunk.expect("camera: an open chunk must be completed");
        let same = chunk.bytes.get(part.from..part.from + part.bytes.len());
        assert!(
            same == Some(&part.bytes) && chunk.lost_before == part.lost_before,
            "camera: chunk {} must hold the bytes that it showed while open",
            part.seq
        );
    }
}

/// Position after the newest bytes of the chunk with this number.
fn next_of(open: &[OpenChunk], seq: u64) -> usize {
    let newest = open.last().filter(|part| part.seq == seq);
    newest.map_or(0, |part| part.from + part.bytes.len())
}

/// A camera either generates a test pattern and restores its pixels, or rejects it.
fn camera_pattern(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    let (mut camera, mut clock) = make();
    camera
        .configure(settings)
        .expect("camera: the rig's settings must be accepted");
    let pixels = camera.test_pattern(None);
    assert_eq!(pixels, Ok(None), "camera: no pattern is always possible");
    let pattern = |rate_ev_s| Some(TestPattern { rate_ev_s });
    let scan = match camera.test_pattern(pattern(200e3)) {
        Ok(scan) => scan.expect("camera must report its test pattern"),
        Err(DeviceError::Refused { .. }) => return,
        Err(e) => panic!("camera: a pattern must be made or refused: {e}"),
    };
    assert!(
        (100e3..400e3).contains(&scan.rate_ev_s) && scan.columns > 0 && scan.rows > 0,
        "camera: expected a pattern of about 200000 events/s, found {scan:?}"
    );
    for rate_ev_s in [0.0, -1.0, 1e12, f64::NAN] {
        expect_error!(
            camera.test_pattern(pattern(rate_ev_s)),
            DeviceError::Refused { .. },
            format!("camera: a pattern of {rate_ev_s} events/s must be refused")
        );
    }
    camera.start().expect("camera: start with a pattern");
    expect_error!(
        camera.test_pattern(None),
        DeviceError::State { .. },
        "camera: a pattern while streaming must be a State error"
    );
    let mut chunks = Vec::new();
    pass(clock.as_mut(), HostDuration::from_millis(200), || {
        camera.poll(&mut chunks).expect("camera: poll");
    });
    camera.stop(&mut chunks).expect("camera: stop");
    let events: u64 = chunks.iter().map(|c| c.facts.cd_events).sum();
    assert!(
        events > 0,
        "camera: expected events of the pattern, found none"
    );
    let pixels = camera.test_pattern(None);
    assert_eq!(pixels, Ok(None), "camera: the pixels must come back");
}

fn check_chunks(camera: &dyn EventCamera, chunks: &[RawChunk], now: HostTime) {
    let mut last = HostTime(i64::MIN);
    let mut camera_us = None;
    for (n, c) in chunks.iter().enumerate() {
        assert_eq!(
            c.camera,
            camera.camera(),
            "camera: chunk {n} of another camera"
        );
        assert_eq!(
            c.seq, n as u64,
            "camera: chunk numbers must run 0, 1, 2 through stop and start"
        );
        assert!(
            last <= c.host_time && c.host_time <= now,
            "camera: chunk {n}: host time {} out of order",
            c.host_time
        );
        last = c.host_time;
        assert!(
            !c.bytes.is_empty() || c.lost_before > 0,
            "camera: chunk {n} says nothing"
        );
        assert_eq!(
            c.facts.trigger_edges,
            c.triggers.len() as u64,
            "camera: chunk {n}: trigger edges and facts differ"
        );
        assert!(
            c.facts.on_events <= c.facts.cd_events,
            "camera: chunk {n}: impossible facts"
        );
        assert_eq!(
            c.facts.first_us.is_some(),
            c.facts.last_us.is_some(),
            "camera: chunk {n}: first and last time go together"
        );
        if let (Some(before), Some(first)) = (camera_us, c.facts.first_us) {
            assert!(
                before <= first,
                "camera: chunk {n}: camera time ran backwards"
            );
        }
        camera_us = c.facts.last_us.or(camera_us);
    }
}
