//! The emulated bench end to end in real time: production drivers over emulated hardware.

mod endurance;
mod first_contact;
mod notify;
mod real_time;
mod slot;
mod tolerant;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use skinrig_emulated_bench::{BenchConfig, BenchError, EmulatedBench};

pub(crate) use real_time::in_real_time;

const SKINRIG: &str = env!("CARGO_BIN_EXE_skinrig");
/// Seed of the cameras' true geometry and noise, also for the simulated run.
const SEED: u64 = 1;

/// Starts a bench; `None`, with the reason on standard error, where it cannot run.
fn start() -> Option<EmulatedBench> {
    let bench = EmulatedBench::start(&BenchConfig {
        seed: SEED,
        ..BenchConfig::default()
    });
    match bench {
        Ok(bench) => Some(bench),
        Err(BenchError::Box(reason)) => {
            eprintln!("skipped: no emulated bench: {reason}");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

fn workspace_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn all_output(output: &Output) -> String {
    format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

fn assert_success(output: &Output) -> String {
    let message = all_output(output);
    assert!(output.status.success(), "{}\n{message}", output.status);
    message
}

fn run(mut command: Command, rig: &[&str], sessions: &Path) -> Output {
    let seed = SEED.to_string();
    command
        .current_dir(workspace_root())
        .args(["run", "protocols/quick-check.yaml", "--seed", &seed])
        .args(rig)
        .arg("--sessions")
        .arg(sessions);
    command.output().unwrap()
}

fn only_file(folder: &Path, ending: &str) -> PathBuf {
    let found: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.to_string_lossy().ends_with(ending))
        .collect();
    assert_eq!(found.len(), 1, "{ending} in {found:?}");
    found[0].clone()
}

fn results(folder: &Path) -> Value {
    let text = fs::read(only_file(folder, ".results.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

#[test]
fn the_quick_check_on_the_emulated_bench_agrees_with_the_simulated_one() {
    in_real_time(compare_with_simulation);
}

fn compare_with_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let (emulated, simulated) = (folder.path().join("emulated"), folder.path().join("sim"));
    let Some(bench) = start() else {
        return;
    };
    let rig = ["--rig", "hil/rigs/emulated.yaml"];
    let output = run(bench.command(SKINRIG).unwrap(), &rig, &emulated);
    let message = assert_success(&output);
    assert!(message.contains("rig       emulated"), "{message}");
    assert_success(&run(Command::new(SKINRIG), &[], &simulated));

    let (bench, sim) = (results(&emulated), results(&simulated));
    assert_eq!(bench["provenance"]["rig_kind"], "emulated");
    assert_eq!(bench["provenance"]["lost_bytes"], serde_json::json!([0, 0]));
    assert_eq!(bench["provenance"]["run_end"], "completed");
    let models: Vec<&str> = bench["provenance"]["devices"]
        .as_array()
        .unwrap()
        .iter()
        .map(|d| d["model"].as_str().unwrap())
        .collect();
    assert_eq!(
        models,
        [
            "Force Dimension omega.3",
            "Prophesee EVK1 Gen3.1",
            "Prophesee EVK1 Gen3.1",
            "skinrig-trigger-box"
        ]
    );
    for metric in ["rmse_mm", "bias_x_mm", "bias_y_mm"] {
        let of = |results: &Value, what: &str| {
            results["analysis"]["scored"][metric][what]
                .as_f64()
                .unwrap_or_else(|| panic!("{metric}: no {what}"))
        };
        // Both draw their own contacts, so only their intervals overlap.
        let [bench, sim] = [&bench, &sim].map(|r| (of(r, "low"), of(r, "high")));
        assert!(
            bench.0 <= sim.1 && sim.0 <= bench.1,
            "{metric}: expected {sim:?} as on the simulated bench, found {bench:?}"
        );
    }
    let session = only_file(&emulated, ".session.sqlite");
    let verified = Command::new(SKINRIG).arg("verify").arg(session).output();
    assert_success(&verified.unwrap());
}
