//! Data of the simulated cameras: time base, rates, polarity, position, triggers.

use crate::common::{RunData, places, press_all, ready};
use skinrig_formats::Decoder;
use skinrig_model::{
    CameraId, CdEvent, Point2, Polarity, SimLevel, StreamFormat, TriggerEdge, pulse::decode_marks,
};
use skinrig_sim::{SimConfig, simulated_rig};

fn decode(take: &RunData, camera: CameraId) -> (Vec<CdEvent>, Vec<TriggerEdge>) {
    let (mut events, mut triggers) = (Vec::new(), Vec::new());
    Decoder::new(StreamFormat::Evt2).push_cd(&take.bytes(camera), &mut events, &mut triggers);
    (events, triggers)
}

fn run(config: &SimConfig, at: &[Point2]) -> RunData {
    let mut rig = simulated_rig(config);
    ready(&mut rig);
    let mut take = press_all(&mut rig, at, &[10_000]).unwrap();
    take.stop(&mut rig);
    take
}

#[test]
fn time_base_words_come_every_16_us_even_when_idle() {
    let take = run(&SimConfig::new(5, SimLevel::Kinematic), &places(1));
    for camera in CameraId::ALL {
        let bytes = take.bytes(camera);
        let highs: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]]))
            .filter(|w| w >> 28 == 8)
            .map(|w| w & 0x0fff_ffff)
            .collect();
        // 1.5 s, 62,500 words per second.
        assert!((93_700..93_800).contains(&highs.len()), "{}", highs.len());
        assert!(highs.windows(2).all(|p| p[1] - p[0] <= 1));
        // Each value four times, except for the first and last.
        let full = highs.len() as u32 / 4;
        assert!((highs.last().unwrap() - highs[0]).abs_diff(full) <= 1);
        let (events, _) = decode(&take, camera);
        assert!(events.is_empty(), "no pixels at the kinematic level");
    }
}

#[test]
fn marks_reach_both_cameras_and_fit_a_line() {
    let config = SimConfig::new(6, SimLevel::Kinematic);
    let take = run(&config, &places(8));
    for camera in CameraId::ALL {
        let (_, edges) = decode(&take, camera);
        let observed = decode_marks(&edges);
        assert_eq!(observed.stray_edges, 0);
        assert_eq!(observed.marks.len(), take.marks.len());
        // Camera time against host time: a line with a slope within the stated drift.
        let pairs: Vec<(f64, f64)> = observed
            .marks
            .iter()
            .zip(&take.marks)
            .map(|(s, m)| {
                assert_eq!(s.mark, m.mark);
                (m.t.as_secs_f64(), s.t_us as f64 * 1e-6)
            })
            .collect();
        let (first, last) = (pairs[0], pairs[pairs.len() - 1]);
        let drift = (last.1 - first.1) / (last.0 - first.0) - 1.0;
        assert!(drift.abs() < 60e-6, "{drift}");
        for (host, camera_s) in pairs {
            let off = camera_s - first.1 - (host - first.0) * (1.0 + drift);
            assert!(off.abs() < 60e-6, "{off}");
        }
    }
}

#[test]
fn presses_appear_at_their_position_and_time() {
    let mut config = SimConfig::new(7, SimLevel::Geometric);
    config.geometric.dead_share = 0.0;
    let at = [Point2::new(10.0, 2.0)];
    let take = run(&config, &at);
    let truth = config.true_geometry();
    for camera in CameraId::ALL {
        let (events, triggers) = decode(&take, camera);
        // The mark rose at the press's command at 0.6 s; the press takes 0.25 s, the release begins at 1 s.
        let zero = decode_marks(&triggers).marks[0].t_us;
        let phase = |from_ms: u64, to_ms: u64| -> Vec<CdEvent> {
            let inside = |e: &&CdEvent| {
                (zero + from_ms * 1_000..zero + to_ms * 1_000).contains(&e.t_us)
                    && (185..=360).contains(&e.y)
            };
            events.iter().filter(inside).copied().collect()
        };
        let on = |e: &[CdEvent]| {
            e.iter().filter(|e| e.polarity == Polarity::On).count() as f64 / e.len() as f64
        };
        let (press, release) = (phase(130, 330), phase(400, 600));
        assert!(press.len() > 1_500, "{}", press.len());
        assert!(release.len() > 1_500, "{}", release.len());
        assert!(on(&press) < 0.35, "{}", on(&press));
        assert!(on(&release) > 0.6, "{}", on(&release));
        // The median column equals that of the contact.
        let mut columns: Vec<u16> = press.iter().map(|e| e.x).collect();
        columns.sort_unstable();
        let median = f64::from(columns[columns.len() / 2]);
        let expected = truth.cameras[camera.index()]
            .column_of_point(at[0])
            .unwrap();
        assert!((median - expected).abs() < 4.0, "{median} {expected}");
        let quiet = phase(0, 50).len() as f64 / 0.05;
        assert!(quiet < 2_500.0, "background {quiet} events/s");
    }
}

#[test]
fn rates_match_the_paper() {
    // Twelve presses of 3 s, as in the campaign; both cameras together: press 28.6 kev/s over 0.55 s, idle 9.1 kev/s.
    let config = SimConfig::new(8, SimLevel::Geometric);
    let mut rig = simulated_rig(&config);
    ready(&mut rig);
    let mut take = RunData::default();
    let grid = places(12);
    let up = rig.robot_from_skin;
    let mut bounds = Vec::new();
    for (n, place) in grid.iter().enumerate() {
        let start = 3_000 * n as i64;
        let steps = [(0, 3.0, 60.0), (2_000, -2.0, 25.0), (2_350, 3.0, 25.0)];
        for (ms, z, speed) in steps {
            rig.clock
                .wait_until(skinrig_model::HostTime((start + ms) * 1_000_000));
            rig.indenter
                .command(up.apply(place.at_height(z)), speed)
                .unwrap();
            take.poll(&mut rig).unwrap();
            for (camera, chunks) in rig.cameras.iter_mut().zip(&mut take.chunks) {
                camera.flush(chunks).unwrap();
            }
        }
        bounds.push(start + 2_080);
    }
    take.stop(&mut rig);
    let (mut press, mut idle, mut press_s, mut idle_s) = (0u64, 0u64, 0.0, 0.0);
    for camera in CameraId::ALL {
        let (events, _) = decode(&take, camera);
        let first = take.chunks[camera.index()][0].facts.first_us.unwrap();
        for &from in &bounds[2..11] {
            let at = |ms: i64| first + ms as u64 * 1_000;
            let count =
                |a: u64, b: u64| events.iter().filter(|e| (a..b).contains(&e.t_us)).count() as u64;
            press += count(at(from), at(from + 550));
            idle += count(at(from + 550), at(from + 3_000));
            press_s += 0.55;
            idle_s += 2.45;
        }
    }
    // Seconds were counted once per camera.
    let press_hz = 2.0 * press as f64 / press_s;
    let idle_hz = 2.0 * idle as f64 / idle_s;
    assert!((press_hz / 28_600.0 - 1.0).abs() < 0.25, "press {press_hz}");
    assert!((idle_hz / 9_100.0 - 1.0).abs() < 0.25, "idle {idle_hz}");
}
