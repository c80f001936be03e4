//! A recorded run, replayed through the same traits.

use crate::common::{Log, RunData, places, press_all, ready, with_log};
use skinrig_device::{DeviceError, Rig};
use skinrig_model::{DeviceRole, Point2, SimLevel, StreamFormat};
use skinrig_sim::replay::{RecordedRig, replayed_rig};
use skinrig_sim::{SimConfig, simulated_rig};

fn config() -> SimConfig {
    let mut config = SimConfig::new(9, SimLevel::Geometric);
    config.camera_clock.chunk_bytes = 50_000;
    config
}

fn recorded(at: &[Point2]) -> (Log, RunData) {
    let (mut rig, log) = with_log(simulated_rig(&config()));
    ready(&mut rig);
    let mut take = press_all(&mut rig, at, &[5_000]).unwrap();
    take.poll(&mut rig).unwrap();
    take.stop(&mut rig);
    drop(rig);
    let log = log.lock().unwrap().clone();
    (log, take)
}

fn replay(log: &Log) -> Rig {
    let rig = simulated_rig(&config());
    let known = RecordedRig {
        name: rig.name,
        robot_from_skin: rig.robot_from_skin,
        geometry: rig.geometry,
        stream_formats: [StreamFormat::Evt2; 2],
        camera_settings: rig.camera_settings,
        description_json: rig.description_json,
    };
    replayed_rig(known, Box::new(log.clone()))
}

#[test]
fn the_same_requests_give_the_same_records() {
    let at = places(3);
    let (log, first) = recorded(&at);
    let mut rig = replay(&log);
    ready(&mut rig);
    let mut replayed = press_all(&mut rig, &at, &[5_000]).unwrap();
    replayed.poll(&mut rig).unwrap();
    replayed.stop(&mut rig);
    assert_eq!(first.marks, replayed.marks);
    assert!(!first.reports.is_empty());
    assert_eq!(first.reports, replayed.reports);
    assert_eq!(first.chunks, replayed.chunks);
    assert_eq!(first.samples.len(), replayed.samples.len());
    for (a, b) in first.samples.iter().zip(&replayed.samples) {
        assert_eq!(a.t, b.t);
        assert!(a.measured.distance_mm(b.measured) < 1e-9);
        assert!(a.commanded.distance_mm(b.commanded) < 1e-9);
        assert_eq!(a.force_n.to_bits(), b.force_n.to_bits());
    }
    assert!(
        rig.indenter
            .identity()
            .model
            .starts_with("replayed simulated")
    );
}

#[test]
fn commands_set_the_clock_to_their_recorded_instants() {
    let at = places(2);
    let (log, first) = recorded(&at);
    let mut rig = replay(&log);
    ready(&mut rig);
    // A controller with a different rhythm and shorter waits: the commands advance the clock.
    let mut replayed = RunData::default();
    for (t, command) in log.commands.clone() {
        rig.clock
            .wait_until(skinrig_model::HostTime(t.0 - 1_000_000));
        rig.indenter
            .command(
                rig.robot_from_skin.apply(command.target),
                command.speed_mm_s,
            )
            .unwrap();
        assert_eq!(rig.clock.now(), t);
        replayed.poll(&mut rig).unwrap();
        assert_eq!(
            replayed.samples.last().map(|s| s.t.0 / 1_000_000),
            Some(t.0 / 1_000_000)
        );
    }
    replayed.stop(&mut rig);
    // Every command was given, so stopping delivers the rest.
    assert_eq!(first.chunks, replayed.chunks);
}

#[test]
fn a_wait_stops_once_at_a_recorded_command() {
    let (log, _) = recorded(&places(2));
    let mut rig = replay(&log);
    ready(&mut rig);
    let (t0, first) = log.commands[0];
    rig.indenter
        .command(rig.robot_from_skin.apply(first.target), first.speed_mm_s)
        .unwrap();
    assert_eq!(rig.clock.now(), t0);
    let (t1, _) = log.commands[1];
    let later = skinrig_model::HostTime(t1.0 + 7_000_000);
    rig.clock.wait_until(later);
    assert_eq!(rig.clock.now(), t1);
    rig.clock.wait_until(later);
    assert_eq!(rig.clock.now(), later);
}

#[test]
fn a_different_request_is_a_divergence() {
    let at = places(2);
    let (log, _) = recorded(&at);
    let other = [at[0], Point2::new(at[1].x_mm + 0.001, at[1].y_mm)];
    let mut rig = replay(&log);
    ready(&mut rig);
    let error = press_all(&mut rig, &other, &[5_000]).err();
    match error {
        Some(DeviceError::Diverged {
            role: DeviceRole::Indenter,
            at,
            ..
        }) => {
            assert!(at.starts_with("command 3"), "{at}");
        }
        other => panic!("expected a divergence, found {other:?}"),
    }
}

#[test]
fn the_end_of_a_recording_is_an_error() {
    let at = places(2);
    let (log, _) = recorded(&at);
    let mut rig = replay(&log);
    ready(&mut rig);
    let more = [at.clone(), places(1)].concat();
    let error = press_all(&mut rig, &more, &[5_000]).err();
    let message = error.map(|e| e.to_string()).unwrap_or_default();
    assert!(
        message.contains("the recording ends here, at "),
        "{message}"
    );

    // Time continues, but no more poses arrive.
    let mut rig = replay(&log);
    ready(&mut rig);
    press_all(&mut rig, &at, &[5_000]).unwrap();
    let end = rig.clock.now();
    rig.clock
        .wait_until(skinrig_model::HostTime(end.0 + 60_000_000));
    let error = rig.indenter.poll(&mut Vec::new()).err();
    let message = error.map(|e| e.to_string()).unwrap_or_default();
    assert!(
        message.contains("the recording ends here, at "),
        "{message}"
    );
}
