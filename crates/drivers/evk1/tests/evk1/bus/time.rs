//! Time bases, triggers and the sync line.

use skinrig_device::{CameraSettings, EventCamera, SyncMode};
use skinrig_emulated_camera::Evk1Config as Emulated;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_emulated_camera::world::now_ns;
use skinrig_evk1::TriggerOut;

use crate::bus::bench::{FIRST, SECOND, edges, events, noise, open, until};

fn settings(sync: SyncMode, channels: &[u8]) -> CameraSettings {
    CameraSettings {
        sync,
        trigger_channels: channels.to_vec(),
        ..CameraSettings::default()
    }
}

#[test]
fn master_and_slave_timestamp_an_edge_equally() {
    let pair = [(FIRST, 100.0), (SECOND, -300.0)].map(|(serial, drift_ppm)| {
        Emulated {
            drift_ppm,
            ..noise(serial)
        }
        .into()
    });
    let test = "bus::time::master_and_slave_timestamp_an_edge_equally";
    on_bus(test, pair.to_vec(), |remote| {
        let (mut master, mut slave) = (open(FIRST), open(SECOND));
        master.configure(&settings(SyncMode::Master, &[0])).unwrap();
        slave.configure(&settings(SyncMode::Slave, &[0])).unwrap();
        let (mut by_master, mut by_slave) = (Vec::new(), Vec::new());
        slave.start().unwrap();
        slave.flush(&mut by_slave).unwrap();
        assert_eq!(by_slave, [], "no clock, no time, no chunk");
        assert!(!slave.time_runs());
        assert!(slave.report().discarded_bytes > 0);
        master.start().unwrap();
        // Far enough ahead that the edge is known before its time, on a busy machine as well.
        let at_ns = now_ns() + 200_000_000;
        for serial in [FIRST, SECOND] {
            remote.edge(serial, 0, true, at_ns).unwrap();
        }
        until(&mut master, &mut by_master, |c| edges(c).len() == 1).unwrap();
        until(&mut slave, &mut by_slave, |c| edges(c).len() == 1).unwrap();
        assert_eq!(edges(&by_master), edges(&by_slave));
        assert!(edges(&by_master)[0].t_us > 100_000);
        assert!(slave.time_runs());
        assert_eq!(slave.report().jump_count, 0);
    });
}

#[test]
fn a_camera_records_its_own_pulses_on_the_loopback() {
    let test = "bus::time::a_camera_records_its_own_pulses_on_the_loopback";
    on_bus(test, vec![noise(FIRST).into()], |_| {
        let mut camera = open(FIRST);
        camera
            .configure(&settings(SyncMode::Standalone, &[6]))
            .unwrap();
        let pulses = TriggerOut {
            period_us: 20_000,
            width_us: 5_000,
        };
        camera.set_trigger_out(Some(pulses)).unwrap();
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| edges(c).len() >= 6).unwrap();
        camera.stop(&mut chunks).unwrap();
        for pair in edges(&chunks).windows(2) {
            let expected = if pair[0].rising { 5_000 } else { 15_000 };
            assert_eq!((pair[0].channel, pair[0].rising), (6, !pair[1].rising));
            assert!(
                (pair[1].t_us - pair[0].t_us).abs_diff(expected) <= 2,
                "{pair:?}"
            );
        }
    });
}

#[test]
fn a_restarted_time_base_is_reported() {
    let test = "bus::time::a_restarted_time_base_is_reported";
    on_bus(test, vec![noise(FIRST).into()], |_| {
        let mut camera = open(FIRST);
        let mut chunks = Vec::new();
        for _ in 0..2 {
            camera.start().unwrap();
            let before = events(&chunks);
            until(&mut camera, &mut chunks, |c| events(c) > before + 100).unwrap();
            camera.stop(&mut chunks).unwrap();
        }
        assert_eq!(camera.report().jump_count, 0, "{:?}", camera.report());
        let (last, first) = camera.report().restarted.unwrap();
        assert!(first < 1000 && last > 500_000, "{first}, {last}");
        let mut notes = Vec::new();
        camera.take_notes(&mut notes);
        assert!(
            notes.iter().any(|n| n.contains("time base restarted")),
            "{notes:?}"
        );
    });
}
