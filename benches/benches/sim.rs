//! Speed of each simulation level relative to real time.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::path::Path;

use skinrig_bench::Table;
use skinrig_controller::{ControlHandle, RecordSink, Run, SinkFault};
use skinrig_model::{CameraId, Record, RunEnd, RunHeader, SimLevel};

const PROTOCOL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../protocols/paper-meander.yaml"
);

/// Accepts every record and adds up its size.
#[derive(Default)]
struct Scales {
    events: u64,
    bytes: u64,
    poses: u64,
}

impl RecordSink for Scales {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        match record {
            Record::Chunk(chunk) => {
                self.events += chunk.facts.cd_events;
                self.bytes += chunk.bytes.len() as u64;
            }
            Record::Poses(poses) => self.poses += poses.len() as u64,
            _ => {}
        }
        Ok(())
    }
}

/// Runs `presses` presses of the published experiment; returns the totals and the simulated seconds.
fn simulate(level: SimLevel, presses: u32) -> (Scales, f64) {
    let overrides = [
        format!("path.meander.count={presses}"),
        "repetitions.count=1".into(),
        "evaluation.calibrate=[]".into(),
        "evaluation.score=[1]".into(),
        "analysis.calibration=none".into(),
    ];
    let checked = skinrig::check::load(Path::new(PROTOCOL), &overrides)
        .unwrap_or_else(|failure| panic!("{}", failure.message));
    let (protocol, plan) = (checked.protocol, checked.plan);
    let (rig, _) = skinrig::rig::simulated(&protocol, level, 1, false, &[])
        .unwrap_or_else(|failure| panic!("{}", failure.message));
    let header = RunHeader {
        protocol_text: protocol.text.clone(),
        protocol_name: protocol.name.clone(),
        protocol_sha256: protocol.sha256.clone(),
        overrides: overrides.into(),
        plan_json: String::new(),
        plan_sha256: plan.digest(),
        seed: 1,
        rig_kind: rig.kind.clone(),
        rig_name: rig.name.clone(),
        rig_json: String::new(),
        robot_from_skin: rig.robot_from_skin,
        stream_formats: CameraId::ALL.map(|c| rig.cameras[c.index()].capabilities().format),
        prototype: String::new(),
        operator: String::new(),
        started_at: String::new(),
        host: String::new(),
        software: String::new(),
        command_line: String::new(),
        presses: plan.presses.clone(),
    };
    let mut scales = Scales::default();
    let report = Run::new(&plan, header, rig, &ControlHandle::new(), &mut scales).execute();
    assert_eq!(report.end, RunEnd::Completed);
    (scales, plan.summary().duration_s)
}

fn main() {
    let mut table = Table::new(
        "simulation, in simulated seconds per second",
        "sim s",
        "presses of protocols/paper-meander.yaml through controller and devices, both cameras, bytes encoded and \
         scanned, nothing stored; plan and rig made anew each time",
    );
    table.baseline_timed("real time, by definition", 1.0, || 1.0);
    for (level, presses) in SimLevel::ALL.into_iter().zip([250, 250, 40]) {
        let (scales, simulated_s) = simulate(level, presses);
        println!(
            "{level}: {presses} presses, {simulated_s:.0} s: {:.2} M events, {:.0} MB, {} poses",
            scales.events as f64 * 1e-6,
            scales.bytes as f64 * 1e-6,
            scales.poses
        );
        table.row(
            &format!("{level}, {presses} presses"),
            simulated_s,
            move || {
                std::hint::black_box(simulate(level, presses).0.bytes);
            },
        );
    }
    println!("{}", table.run(3));
}
