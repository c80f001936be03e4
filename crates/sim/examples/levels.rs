//! Measures the statistics that the simulation levels with pixel events share.
//!
//! `cargo run --release -p skinrig-sim --example levels -- [geometric presses] [optical presses]`
//!
//! The presses are those of the paper (2 mm deep, 3.003 s apart, meander over a 4 mm grid); the devices are
//! polled every 10 ms of simulated time and flushed after each press, as a run does. Statistics come from the
//! decoded bytes, rows outside the visible skin left out.
#![expect(clippy::print_stdout, reason = "its output is its purpose")]

use skinrig_device::{DeviceError, MotionLimits, RobotSample};
use skinrig_formats::Decoder;
use skinrig_model::{
    CameraId, CdEvent, HostDuration, HostTime, Point2, Polarity, RawChunk, SimLevel, StreamFormat,
};
use skinrig_sim::{SimConfig, simulated_rig};

const PERIOD_MS: i64 = 3_003;
const LIMITS: MotionLimits = MotionLimits {
    min_mm: [-80.0, -80.0, -60.0],
    max_mm: [80.0, 80.0, 60.0],
    max_speed_mm_s: 100.0,
    max_acceleration_mm_s2: 500.0,
    max_force_n: 8.0,
};

/// The k-th press of the meander, spread over the grid when there are only few.
fn place(k: usize, of: usize) -> Point2 {
    let n = if of < 289 { k * 289 / of } else { k % 289 };
    let (line, step) = (n / 17, n % 17);
    let step = if line % 2 == 0 { step } else { 16 - step };
    Point2::new(-22.0 + 4.0 * line as f64, -30.0 + 4.0 * step as f64)
}

#[derive(Default)]
struct Tally {
    press: u64,
    press_s: f64,
    idle: u64,
    idle_s: f64,
    down: [u64; 2],
    up: [u64; 2],
    /// Per camera and press: distance, spread and offset of the median column, columns.
    spreads: Vec<(f64, f64, f64)>,
    silent: u64,
}

fn main() -> Result<(), DeviceError> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: usize| {
        let given = arguments.next();
        given.and_then(|a| a.parse().ok()).unwrap_or(default)
    };
    measure(SimLevel::Geometric, number(250))?;
    measure(SimLevel::Optical, number(120))
}

/// Simulates, decodes and prints the statistics.
fn measure(level: SimLevel, presses: usize) -> Result<(), DeviceError> {
    let config = SimConfig::new(1, level);
    let truth = config.true_geometry();
    let mut rig = simulated_rig(&config);
    rig.indenter.configure(&LIMITS)?;
    for (camera, settings) in rig.cameras.iter_mut().zip(&rig.camera_settings) {
        camera.configure(settings)?;
        camera.start()?;
    }
    rig.indenter.arm()?;
    let up = rig.robot_from_skin;
    let mut decoders = CameraId::ALL.map(|_| Decoder::new(StreamFormat::Evt2));
    let mut tally = Tally::default();
    let mut samples: Vec<RobotSample> = Vec::new();
    let mut chunks: Vec<RawChunk> = Vec::new();
    for k in 0..presses {
        let at = place(k, presses);
        let start = HostTime(k as i64 * PERIOD_MS * 1_000_000);
        // Travel, press, release; the press begins 2.0 s into the period.
        let steps = [(0, 3.0, 60.0), (2_000, -2.0, 25.0), (2_350, 3.0, 25.0)];
        let mut window: [Vec<CdEvent>; 2] = Default::default();
        for (n, (ms, z, speed)) in steps.into_iter().enumerate() {
            rig.indenter.command(up.apply(at.at_height(z)), speed)?;
            let next = steps.get(n + 1).map_or(PERIOD_MS, |s| s.0);
            let mut t = start + HostDuration::from_millis(ms);
            while t < start + HostDuration::from_millis(next) {
                t = (t + HostDuration::from_millis(10))
                    .min(start + HostDuration::from_millis(next));
                rig.clock.wait_until(t);
                rig.indenter.poll(&mut samples)?;
                for camera in &mut rig.cameras {
                    camera.poll(&mut chunks)?;
                }
            }
        }
        for camera in &mut rig.cameras {
            camera.flush(&mut chunks)?;
        }
        for chunk in chunks.drain(..) {
            let index = chunk.camera.index();
            let rows = config.skin_rows[index];
            decoders[index].for_each_slice(&chunk.bytes, |slice| {
                let observed = slice.iter().filter(|e| (rows.0..=rows.1).contains(&e.y));
                window[index].extend(observed);
            });
        }
        samples.clear();
        for camera in CameraId::ALL {
            let model = &truth.cameras[camera.index()];
            let expected = model.column_of_point(at);
            let distance = model.position.distance_mm(at);
            tally.add(&window[camera.index()], distance, expected);
        }
    }
    tally.print(level, presses);
    Ok(())
}

impl Tally {
    /// One press in one camera: its whole period, the press beginning at 2.0 s of 3.003 s.
    fn add(&mut self, events: &[CdEvent], distance: f64, expected: Option<f64>) {
        let Some(last) = events.last() else { return };
        let zero = last.t_us.saturating_sub(PERIOD_MS as u64 * 1_000);
        let phase = |from: u64, to: u64| {
            let inside =
                move |e: &&CdEvent| (zero + from * 1_000..zero + to * 1_000).contains(&e.t_us);
            events.iter().filter(inside)
        };
        self.press += phase(2_080, 2_630).count() as u64;
        self.idle += phase(0, 2_080).count() as u64;
        self.press_s += 0.55;
        self.idle_s += 2.08;
        let Some(expected) = expected else { return };
        let near = |e: &&CdEvent| (f64::from(e.x) - expected).abs() < 70.0;
        for e in phase(2_100, 2_300).filter(near) {
            self.down[usize::from(e.polarity == Polarity::On)] += 1;
        }
        for e in phase(2_400, 2_620).filter(near) {
            self.up[usize::from(e.polarity == Polarity::On)] += 1;
        }
        let mut columns: Vec<u16> = phase(2_080, 2_630).filter(near).map(|e| e.x).collect();
        columns.sort_unstable();
        if columns.len() < 400 {
            self.silent += 1;
            return;
        }
        let at = |q: f64| f64::from(columns[(q * (columns.len() - 1) as f64) as usize]);
        let spread = (at(0.84) - at(0.16)) / 2.0;
        self.spreads
            .push((distance, spread, at(0.5) + 0.5 - expected));
    }

    fn print(&self, level: SimLevel, presses: usize) {
        let share = |n: [u64; 2]| n[1] as f64 / (n[0] + n[1]).max(1) as f64;
        println!(
            "{level}: {presses} presses: both cameras press {:.1} kev/s, idle {:.1} kev/s; ON share press {:.2}, \
             release {:.2}; {} of {} views with fewer than 400 events",
            2.0 * self.press as f64 / self.press_s * 1e-3,
            2.0 * self.idle as f64 / self.idle_s * 1e-3,
            share(self.down),
            share(self.up),
            self.silent,
            2 * presses,
        );
        for (from, to) in [(10.0, 30.0), (30.0, 50.0), (50.0, 70.0), (70.0, 100.0)] {
            let mut inside: Vec<_> = self
                .spreads
                .iter()
                .filter(|s| (from..to).contains(&s.0))
                .collect();
            let n = inside.len();
            if n == 0 {
                continue;
            }
            let rms = (inside.iter().map(|s| s.2 * s.2).sum::<f64>() / n as f64).sqrt();
            inside.sort_by(|a, b| a.1.total_cmp(&b.1));
            println!(
                "  {from:.0} to {to:.0} mm: {n} views, median spread {:.1} columns, median column off by {rms:.2} rms",
                inside[n / 2].1
            );
        }
    }
}
