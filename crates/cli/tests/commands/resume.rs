//! Resuming a cut-off session in a further leg, up to its results; and rejected resumes.

use std::path::PathBuf;

use serde_json::Value;
use skinrig_model::{Record, RunHeader};
use skinrig_recorder::{SessionReader, SessionWriter};
use skinrig_results::Rescan;

use crate::support::{Lab, SMALL, files, only, read_json, show, skinrig, text};

/// The small campaign, killed during a press of its second repetition.
fn cut_off(lab: &Lab) -> PathBuf {
    killed(lab, "killed@journal:20")
}

/// The small campaign, killed at this fault.
fn killed(lab: &Lab, fault: &str) -> PathBuf {
    let sessions = lab.text("cut");
    let run = skinrig(&[
        "run",
        SMALL,
        "--sessions",
        &sessions,
        "--no-analysis",
        "--fault",
        fault,
    ]);
    assert_eq!(run.code, None, "{run:#?}");
    only(&lab.path("cut"), ".session.sqlite")
}

fn analysis(session: &std::path::Path) -> (Value, String) {
    let out = session.with_extension("results.json");
    let output = skinrig(&["analyze", &text(session), "--out", &text(&out)]).code(0);
    (read_json(&out), output.out)
}

#[test]
fn a_resumed_session_gives_the_results_of_one_that_was_never_cut_off() {
    let lab = Lab::new();
    let session = cut_off(&lab);
    let open: Vec<Value> = show(&session)["presses"].as_array().unwrap().clone();
    let open = open
        .iter()
        .find(|p| p["verdict"] == "open" && p["attempts"] == 1);
    let press = open.expect("one press was under way")["press"].clone();

    let output = skinrig(&["resume", "-v", &text(&session)]).code(0).out;
    assert!(
        output.contains(&format!("press {press} cut off")),
        "{output}"
    );
    let message = format!("press {press}: cut off: leg 1 of the session ended without its outcome");
    for line in [
        "leg 1 ",
        ": cut off\n",
        "leg 2 ",
        ": completed\n",
        "1 attempt at 1 press retaken",
        &message,
    ] {
        assert!(output.contains(line), "expected {line:?} in {output}");
    }
    let page = std::fs::read_to_string(only(&lab.path("cut"), ".report.html")).unwrap();
    for part in [
        "data-testid=\"legs\"",
        "data-testid=\"retaken\"",
        "<b>leg 2</b>",
        &message,
    ] {
        assert!(page.contains(part), "expected {part:?} on the page");
    }
    skinrig(&["verify", &text(&session)]).code(0);

    let (resumed, _) = analysis(&session);
    let (whole, _) = analysis(&lab.record("whole", &[]));
    assert_eq!(resumed["analysis"]["alignment"]["status"], "valid");
    assert_eq!(resumed["analysis"]["alignment"]["warnings"], Value::Null);
    let legs = resumed["analysis"]["legs"].as_array().unwrap();
    assert_eq!(legs.len(), 2);
    for fit in legs
        .iter()
        .flat_map(|leg| leg["cameras"].as_array().unwrap())
    {
        assert_eq!(fit["method"], "time_base", "a clock of its own: {fit}");
    }
    assert_eq!(resumed["analysis"]["counts"], whole["analysis"]["counts"]);
    let presses = |of: &Value| of["analysis"]["presses"].as_array().unwrap().clone();
    let (resumed, whole) = (presses(&resumed), presses(&whole));
    assert_eq!((resumed.len(), whole.len()), (10, 10));
    for (was, is) in whole.iter().zip(&resumed) {
        assert_eq!(
            (&is["press"], &is["planned"]),
            (&was["press"], &was["planned"])
        );
        assert_eq!(is["verdict"], "valid", "{is}");
        for axis in ["x_mm", "y_mm"] {
            let of = |press: &Value, what: &str| press[what][axis].as_f64().unwrap();
            // The robot's noise differs between runs.
            for expected in [of(was, "truth"), of(was, "planned")] {
                let off = of(is, "truth") - expected;
                assert!(off.abs() < 0.1, "{off} mm: {is}, was {was}");
            }
        }
    }
}

#[test]
fn a_further_leg_of_the_simulated_rig_is_no_copy_of_the_first() {
    let lab = Lab::new();
    let session = killed(&lab, "killed@press:6");
    skinrig(&["resume", &text(&session)]).code(0);
    let presses = show(&session)["presses"].as_array().unwrap().clone();
    let depths: Vec<f64> = presses
        .iter()
        .filter_map(|p| p["measured_depth_mm"].as_f64())
        .collect();
    assert_eq!(depths.len(), 10);
    for (i, depth) in depths.iter().enumerate() {
        let same = depths[..i]
            .iter()
            .position(|d| d.to_bits() == depth.to_bits());
        assert_eq!(same, None, "press {}: {depths:?}", i + 1);
    }
}

/// A session with only a header, changed by the caller.
fn begun(
    lab: &Lab,
    name: &str,
    like: &std::path::Path,
    change: impl FnOnce(&mut RunHeader),
) -> PathBuf {
    let mut header = SessionReader::open(like).unwrap().header().unwrap();
    change(&mut header);
    let path = lab.path(name);
    let mut writer = SessionWriter::create(&path).unwrap();
    writer.accept(Record::Started(Box::new(header))).unwrap();
    path
}

#[test]
fn what_cannot_go_on_is_refused_and_left_as_it_is() {
    let lab = Lab::new();
    let session = cut_off(&lab);
    let refused = |session: &std::path::Path, parts: &[&str]| {
        skinrig(&["resume", &text(session)])
            .code(2)
            .expect_stderr(parts);
    };
    let writer = SessionWriter::resume::<Rescan>(&session).unwrap();
    refused(&session, &["process "]);
    drop(writer);
    assert_eq!(show(&session)["legs"].as_array().unwrap().len(), 1);

    let rig = ["resume", &text(&session), "--rig", "hil/rigs/emulated.yaml"];
    skinrig(&rig).code(2).expect_stderr(&["expected no --rig"]);

    for kind in ["imported", "replayed"] {
        let other = |header: &mut RunHeader| header.rig_kind = kind.to_owned();
        let path = begun(&lab, &format!("{kind}.session.sqlite"), &session, other);
        refused(&path, &["expected a session recorded by a rig", kind]);
    }
    let whole = lab.record("whole", &[]);
    let before = std::fs::read(&whole).unwrap();
    refused(&whole, &["nothing to resume"]);
    assert_eq!(std::fs::read(&whole).unwrap(), before);
    assert_eq!(
        files(&lab.path("whole"), "-wal"),
        [""; 0].map(PathBuf::from)
    );

    // One byte of a text differs from its recorded SHA-256.
    let header = SessionReader::open(&whole).unwrap().header().unwrap();
    for (what, of) in [
        ("protocol", &header.protocol_text),
        ("plan", &header.plan_json),
    ] {
        let start = &of.as_bytes()[..32];
        let at = before.windows(32).position(|bytes| bytes == start);
        let mut bytes = before.clone();
        bytes[at.unwrap()] ^= 1;
        let path = lab.path(&format!("{what}.session.sqlite"));
        std::fs::write(&path, &bytes).unwrap();
        let problem = format!("{what}_sha256: expected");
        skinrig(&["resume", &text(&path)]).code(4).expect_stderr(&[
            "expected a sound session",
            &problem,
            "nothing was changed",
            "skinrig salvage",
        ]);
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }
}
