//! Presses the paper's grid on the optical skin and prints the resulting events.
//!
//! Event counts, rates, localisation error with the true camera geometry, speed:
//!
//! `cargo run --release -p skinrig-sim --example optical_grid -- [presses] [depth in mm] [events.csv press]`
#![expect(clippy::print_stdout, reason = "an example that prints its result")]

use std::io::Write;
use std::time::Instant;

use skinrig_model::{CameraId, Point2, Point3, Polarity, SkinOutline, StereoGeometry};
use skinrig_sim::optical::OpticalModel;
use skinrig_sim::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

const PERIOD_STEPS: i64 = 3_003;
const CROP: [(u16, u16); 2] = [(185, 360), (200, 355)];

/// Height of the tip `ms` after the press began: 150 ms down, 250 ms held, 150 ms up.
fn height_mm(ms: f64, depth_mm: f64) -> f64 {
    let touch = |part: f64| 3.0 - (3.0 + depth_mm) * part;
    match ms {
        t if t < 150.0 => touch(t / 150.0),
        t if t < 400.0 => -depth_mm,
        t if t < 550.0 => touch((550.0 - t) / 150.0),
        _ => 3.0,
    }
}

fn grid(i: usize) -> Point2 {
    let (line, k) = (i / 17, i % 17);
    let row = if line % 2 == 0 { k } else { 16 - k };
    Point2::new(
        10.0 + 4.0 * (line as f64 - 8.0),
        2.0 + 4.0 * (row as f64 - 8.0),
    )
}

/// Column centroid of the densest connected patch of 10 px cells with at least 10 events: a stand-in for clustering.
fn centroid(events: &[PixelEvent], rows: (u16, u16)) -> Option<f64> {
    let mut cells = vec![(0u32, 0f64); 64 * 48];
    for e in events.iter().filter(|e| (rows.0..=rows.1).contains(&e.y)) {
        let cell = &mut cells[usize::from(e.y / 10) * 64 + usize::from(e.x / 10)];
        *cell = (cell.0 + 1, cell.1 + f64::from(e.x));
    }
    let mut best: Option<(u32, f64)> = None;
    for start in 0..cells.len() {
        let mut stack = vec![start];
        let mut sum = (0u32, 0f64);
        while let Some(i) = stack.pop() {
            if cells[i].0 < 10 {
                continue;
            }
            sum = (sum.0 + cells[i].0, sum.1 + cells[i].1);
            cells[i].0 = 0;
            let (x, y) = ((i % 64) as i64, (i / 64) as i64);
            for (nx, ny) in [
                (x - 1, y),
                (x + 1, y),
                (x, y - 1),
                (x, y + 1),
                (x - 1, y - 1),
                (x + 1, y + 1),
                (x - 1, y + 1),
                (x + 1, y - 1),
            ] {
                if (0..64).contains(&nx) && (0..48).contains(&ny) {
                    stack.push((ny * 64 + nx) as usize);
                }
            }
        }
        if sum.0 > best.map_or(0, |b| b.0) {
            best = Some(sum);
        }
    }
    best.map(|(n, s)| s / f64::from(n))
}

fn intersect(geometry: &StereoGeometry, u: [f64; 2]) -> Option<Point2> {
    let [a, b] = geometry.cameras;
    let d = a.direction(a.angle_of_column_deg(u[0]));
    let e = b.direction(b.angle_of_column_deg(u[1]));
    let cross = d[0] * e[1] - d[1] * e[0];
    let (px, py) = (
        b.position.x_mm - a.position.x_mm,
        b.position.y_mm - a.position.y_mm,
    );
    let s = (px * e[1] - py * e[0]) / cross;
    (cross.abs() > 0.02)
        .then(|| Point2::new(a.position.x_mm + s * d[0], a.position.y_mm + s * d[1]))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let presses: usize = arguments.first().map_or(Ok(250), |a| a.parse())?;
    let depth_mm: f64 = arguments.get(1).map_or(Ok(2.0), |a| a.parse())?;
    let dump: Option<(&String, usize)> = match (arguments.get(2), arguments.get(3)) {
        (Some(path), Some(n)) => Some((path, n.parse()?)),
        _ => None,
    };
    let geometry = StereoGeometry::PAPER;
    let mut models = CameraId::ALL.map(|id| {
        OpticalModel::new(&SceneConfig {
            seed: 7 + id.index() as u64,
            skin_seed: 7,
            start: 0,
            outline: SkinOutline::PAPER,
            camera_id: id,
            camera: geometry.cameras[id.index()],
            skin_rows: CROP[id.index()],
            tip_side_mm: 10.0,
            skin_thickness_mm: 4.0,
            contacts: skinrig_sim::contacts::Contacts::default(),
        })
    });
    println!(
        "noise: {:.0} / {:.0} events/s",
        models[0].noise_hz(),
        models[1].noise_hz()
    );
    let mut last = 0;
    let mut columns = vec![[None; 2]; presses];
    let (mut press_events, mut gap_events, mut all_events, mut on) =
        ([0usize; 2], [0usize; 2], 0usize, [0usize; 2]);
    let mut per_press = vec![[0usize; 2]; presses];
    let start = Instant::now();
    for (i, (found, counts)) in columns.iter_mut().zip(&mut per_press).enumerate() {
        let p = grid(i % 250);
        let t0 = last;
        let tips: Vec<TipSample> = (i64::from(t0 != 0)..=PERIOD_STEPS)
            .map(|k| TipSample {
                t_ns: (t0 + k) * GRID_NS,
                position: Point3::new(p.x_mm, p.y_mm, height_mm(k as f64 - 1000.0, depth_mm)),
            })
            .collect();
        last = t0 + PERIOD_STEPS;
        for (c, model) in models.iter_mut().enumerate() {
            let mut events = Vec::new();
            model.advance(&tips, &mut events);
            all_events += events.len();
            let ms = |e: &PixelEvent| (e.t_ns / GRID_NS - t0 - 1000) as f64;
            let window: Vec<PixelEvent> = events
                .iter()
                .copied()
                .filter(|e| (0.0..700.0).contains(&ms(e)))
                .collect();
            let burst = events.iter().filter(|e| {
                (0.0..550.0).contains(&ms(e)) && (CROP[c].0..=CROP[c].1).contains(&e.y)
            });
            counts[c] = burst.count();
            press_events[c] += counts[c];
            gap_events[c] += events
                .iter()
                .filter(|e| ms(e) >= 1500.0 && (CROP[c].0..=CROP[c].1).contains(&e.y))
                .count();
            for (k, range) in [(0, 0.0..250.0), (1, 400.0..700.0)] {
                let phase: Vec<_> = events.iter().filter(|e| range.contains(&ms(e))).collect();
                on[k] += phase.iter().filter(|e| e.polarity == Polarity::On).count() * 1000
                    / phase.len().max(1);
            }
            found[c] = centroid(&window, CROP[c]);
            if let Some((path, n)) = dump
                && n == i
            {
                let mut file = std::fs::File::create(format!("{path}{}", c + 1))?;
                for e in &events {
                    writeln!(
                        file,
                        "{},{},{},{}",
                        ms(e) + (e.t_ns % GRID_NS) as f64 * 1e-6,
                        e.x,
                        e.y,
                        e.polarity.bit()
                    )?;
                }
            }
        }
    }
    let (wall, simulated) = (
        start.elapsed().as_secs_f64(),
        presses as f64 * PERIOD_STEPS as f64 * 1e-3,
    );
    let n = presses as f64;
    println!(
        "press: {:.0} + {:.0} events in the crop in 0.55 s (paper: 15.7 k together)",
        press_events[0] as f64 / n,
        press_events[1] as f64 / n
    );
    let gap_s = n * (PERIOD_STEPS - 2500) as f64 * 1e-3;
    println!(
        "gap:   {:.0} + {:.0} events/s in the crop, 1.5 s to 2 s after the press began (paper: 9.1 k together)",
        gap_events[0] as f64 / gap_s,
        gap_events[1] as f64 / gap_s
    );
    println!(
        "ON part: {:.2} going down, {:.2} going up",
        on[0] as f64 / n / 2000.0,
        on[1] as f64 / n / 2000.0
    );
    let mut least = per_press.iter().flatten().copied().collect::<Vec<_>>();
    least.sort_unstable();
    println!(
        "events per press and camera: min {} p10 {} median {} p90 {} max {}",
        least[0],
        least[least.len() / 10],
        least[least.len() / 2],
        least[least.len() * 9 / 10],
        least[least.len() - 1]
    );
    let (mut square, mut x2, mut y2, mut located, mut outside) = (0.0, 0.0, 0.0, 0.0, 0);
    let mut u_error = [Vec::new(), Vec::new()];
    let mut errors = Vec::new();
    for (i, found) in columns.iter().enumerate() {
        let p = grid(i % 250);
        for c in 0..2 {
            if let (Some(u), Some(true_u)) = (found[c], geometry.cameras[c].column_of_point(p)) {
                u_error[c].push(u - true_u);
            }
        }
        let [Some(a), Some(b)] = *found else { continue };
        match intersect(&geometry, [a, b]) {
            Some(q) if SkinOutline::PAPER.box_contains(q) => {
                let (dx, dy) = (q.x_mm - p.x_mm, q.y_mm - p.y_mm);
                (x2, y2) = (x2 + dx * dx, y2 + dy * dy);
                square += dx * dx + dy * dy;
                errors.push((dx * dx + dy * dy).sqrt());
                located += 1.0;
            }
            _ => outside += 1,
        }
    }
    let rms = |v: f64| (v / f64::max(located, 1.0)).sqrt();
    println!(
        "localisation with the true geometry: RMSE {:.2} mm (x {:.2}, y {:.2}) over {located} presses, {outside} parallel or outside",
        rms(square),
        rms(x2),
        rms(y2)
    );
    errors.sort_by(f64::total_cmp);
    println!(
        "error median {:.2} p95 {:.2} max {:.2} mm",
        errors[errors.len() / 2],
        errors[errors.len() * 95 / 100],
        errors[errors.len() - 1]
    );
    for (c, e) in u_error.iter().enumerate() {
        let m = e.iter().sum::<f64>() / e.len() as f64;
        let s = (e.iter().map(|v| (v - m) * (v - m)).sum::<f64>() / e.len() as f64).sqrt();
        println!(
            "camera {}: column error mean {m:+.1} px, std {s:.1} px, n {}",
            c + 1,
            e.len()
        );
    }
    println!(
        "{all_events} events, {simulated:.0} s simulated in {wall:.2} s for both cameras: {:.0} times real time",
        simulated / wall
    );
    Ok(())
}
