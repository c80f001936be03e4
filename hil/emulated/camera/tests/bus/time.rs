//! Time bases, trigger edges and the sync line.

use skinrig_emulated_camera::config::Content;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_emulated_camera::world::now_ns;
use skinrig_emulated_camera::{DeviceConfig, Evk1Config};
use skinrig_model::TriggerEdge;

use crate::client::Camera;

const FIRST: &str = "00001621";
const SECOND: &str = "00001622";

const STANDALONE: u32 = 1 << 12;
const MASTER: u32 = 1 << 12 | 1 << 14;
const SLAVE: u32 = 1 << 14;

/// A time far enough ahead that an edge arrives before it, even on a busy computer.
fn upcoming_ns() -> i64 {
    now_ns() + 200_000_000
}

fn pair() -> Vec<DeviceConfig> {
    let noise = |seed| Content::Noise {
        events_per_s: 2e4,
        seed,
    };
    let first = Evk1Config {
        drift_ppm: 100.0,
        content: noise(1),
        ..Evk1Config::new(FIRST)
    };
    let second = Evk1Config {
        drift_ppm: -300.0,
        content: noise(2),
        ..Evk1Config::new(SECOND)
    };
    vec![first.into(), second.into()]
}

#[test]
fn edges_arrive_at_their_times_on_enabled_inputs_only() {
    on_bus(
        "time::edges_arrive_at_their_times_on_enabled_inputs_only",
        pair(),
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(STANDALONE);
            camera.write(0x01a0, 1 << 0 | 1 << 7).unwrap();
            camera.start();
            let first_ns = upcoming_ns();
            for (channel, rising, after_us) in [
                (0, true, 0),
                (0, false, 500),
                (6, true, 600),
                (7, true, 700),
            ] {
                remote
                    .edge(FIRST, channel, rising, first_ns + after_us * 1_000)
                    .unwrap();
            }
            let observed = camera.read_until(|s| s.triggers.len() >= 3);
            let zero = observed.triggers[0].t_us;
            // 100 ppm of 700 µs is below a microsecond; the first edge may be anywhere within one.
            let after: Vec<_> = observed
                .triggers
                .iter()
                .map(|t: &TriggerEdge| (t.channel, t.rising, t.t_us - zero))
                .collect();
            assert_eq!(after[0], (0, true, 0));
            assert!(matches!(after[1], (0, false, 499..=501)), "{after:?}");
            assert!(matches!(after[2], (7, true, 699..=701)), "{after:?}");
            assert_eq!(remote.observe(FIRST).unwrap().counters.late_edges, 0);
        },
    );
}

#[test]
fn trigger_out_comes_back_on_input_6() {
    on_bus("time::trigger_out_comes_back_on_input_6", pair(), |_| {
        let mut camera = Camera::open(0);
        camera.configure(STANDALONE);
        camera.write(0x01a0, 1 << 6).unwrap();
        camera.write(0x01a8, 10_000).unwrap();
        camera.write(0x01ac, 2_500).unwrap();
        camera.write(0x003c, 1).unwrap();
        camera.write(0x01a4, 1).unwrap();
        camera.start();
        let observed = camera.read_until(|s| s.triggers.len() >= 10);
        for (pair, rising) in observed
            .triggers
            .windows(2)
            .zip([true, false].into_iter().cycle())
        {
            let gap = pair[1].t_us - pair[0].t_us;
            let expected = if rising { 2_500 } else { 7_500 };
            assert_eq!((pair[0].channel, pair[0].rising), (6, rising));
            assert!(gap.abs_diff(expected) <= 2, "{gap} for {expected}");
        }
    });
}

#[test]
fn a_slave_shares_its_masters_time_when_it_starts_first() {
    on_bus(
        "time::a_slave_shares_its_masters_time_when_it_starts_first",
        pair(),
        |remote| {
            let (mut master, mut slave) = (Camera::open(0), Camera::open(1));
            master.configure(MASTER);
            slave.configure(SLAVE);
            for camera in [&master, &slave] {
                camera.write(0x01a0, 1).unwrap();
            }
            slave.start();
            let waiting = slave.read_until(|s| s.events.len() > 100);
            assert_eq!(waiting.last_us, 0, "no pulses on the line yet");
            master.start();
            let at_ns = upcoming_ns();
            for serial in [FIRST, SECOND] {
                remote.edge(serial, 0, true, at_ns).unwrap();
            }
            let by_master = master.read_until(|s| s.triggers.len() == 1);
            let by_slave = slave.read_until(|s| s.triggers.len() == 1);
            assert!(by_master.triggers[0].t_us > 0);
            assert_eq!(by_master.triggers, by_slave.triggers);
        },
    );
}

#[test]
fn a_slave_that_starts_after_its_master_is_behind() {
    on_bus(
        "time::a_slave_that_starts_after_its_master_is_behind",
        pair(),
        |remote| {
            let (mut master, mut slave) = (Camera::open(0), Camera::open(1));
            master.configure(MASTER);
            slave.configure(SLAVE);
            for camera in [&master, &slave] {
                camera.write(0x01a0, 1).unwrap();
            }
            master.start();
            master.read_until(|s| s.last_us > 20_000);
            slave.start();
            let at_ns = upcoming_ns();
            for serial in [FIRST, SECOND] {
                remote.edge(serial, 0, true, at_ns).unwrap();
            }
            let by_master = master.read_until(|s| s.triggers.len() == 1).triggers[0].t_us;
            let by_slave = slave.read_until(|s| s.triggers.len() == 1).triggers[0].t_us;
            assert!(by_slave + 20_000 < by_master, "{by_slave}, {by_master}");
        },
    );
}

#[test]
fn a_time_base_restarts_at_every_start_or_continues() {
    let mut bus = pair();
    let DeviceConfig::Evk1(second) = &mut bus[1] else {
        panic!("{bus:?}")
    };
    (second.time_restarts, second.origin_us) = (false, 5_000_000);
    on_bus(
        "time::a_time_base_restarts_at_every_start_or_continues",
        bus,
        |_| {
            for (n, first_us, second_us) in [(0, 0, 0), (1, 5_000_000, 5_020_000)] {
                let mut camera = Camera::open(n);
                camera.configure(STANDALONE);
                for at_least in [first_us, second_us] {
                    camera.received.clear();
                    camera.start();
                    let observed = camera.read_until(|s| s.last_us > at_least + 20_000);
                    let first = observed.events[0].t_us;
                    assert!((at_least..at_least + 20_000).contains(&first), "{first}");
                    camera.stop();
                    camera.handle.reset().unwrap();
                }
            }
        },
    );
}
