//! `skinrig new` and `skinrig init` in a folder outside any checkout.

use std::path::Path;

use crate::support::{Lab, ProgramOutput, only, program, run_to_end};

const KINDS: [&str; 10] = [
    "campaign",
    "comparison",
    "depth-sweep",
    "quick-check",
    "rings",
    "own-outline",
    "own-cameras",
    "other-skin",
    "paper",
    "demo",
];

/// Runs the program in `folder`.
fn at(folder: &Path, arguments: &[&str]) -> ProgramOutput {
    let mut command = program(arguments);
    command.current_dir(folder);
    run_to_end(command)
}

#[test]
fn every_new_protocol_passes_its_check_and_none_is_overwritten() {
    let lab = Lab::new();
    let folder = lab.path("");
    let help = at(&folder, &["new", "--help"]).code(0).out;
    for kind in KINDS {
        assert!(help.contains(kind), "{kind}: {help}");
        let file = format!("{kind}.yaml");
        at(&folder, &["new", kind, &file]).code(0);
        at(&folder, &["check", &file]).code(0);
        std::fs::write(lab.path(&file), "mine").unwrap();
        at(&folder, &["new", kind, &file]).code(2).expect_stderr(&[
            &file,
            "found an existing one",
            "next:",
        ]);
        assert_eq!(std::fs::read_to_string(lab.path(&file)).unwrap(), "mine");
    }
    // The schema that their first line names.
    assert!(lab.path("skinrig.schema.json").exists());
    let created = at(&folder, &["new", "demo", "deeper/one.yaml", "--json"]).code(0);
    assert_eq!(created.json()["files"].as_array().unwrap().len(), 2);
}

#[test]
fn a_new_lab_runs_and_user_files_are_not_overwritten() {
    let lab = Lab::new();
    let folder = lab.path("");
    let message = at(&folder, &["init", "here"]).code(0).out;
    assert!(
        message.contains("cd here && skinrig run protocols/demo.yaml"),
        "{message}"
    );
    let base = lab.path("here");
    at(&base, &["run", "protocols/quick-check.yaml"]).code(0);
    only(&base.join("sessions"), ".session.sqlite");
    let (own, schema) = (
        base.join("protocols/demo.yaml"),
        base.join("protocols/skinrig.schema.json"),
    );
    std::fs::write(&own, "mine").unwrap();
    std::fs::write(&schema, "old").unwrap();
    let message = at(&base, &["init"]).code(0).out;
    assert!(message.contains("0 files written, 1 updated"), "{message}");
    assert_eq!(std::fs::read_to_string(&own).unwrap(), "mine");
    assert_ne!(std::fs::read_to_string(&schema).unwrap(), "old");
    std::fs::write(lab.path("file"), "").unwrap();
    at(&folder, &["init", "file/lab"])
        .code(2)
        .expect_stderr(&["next:"]);
}

/// Without `scene` the summary names the chosen level; a custom skin needs the level that models skins.
#[test]
fn a_scene_is_optional_and_the_chosen_level_is_reported() {
    let lab = Lab::new();
    let folder = lab.path("");
    at(&folder, &["new", "quick-check", "p.yaml"]).code(0);
    let text = std::fs::read_to_string(lab.path("p.yaml")).unwrap();
    let without = text.replace(
        "scene:\n  needs: [triggers, event_rates, localisation]\n",
        "",
    );
    assert_ne!(text, without);
    std::fs::write(lab.path("p.yaml"), without).unwrap();
    let message = at(&folder, &["run", "p.yaml", "--no-analysis"]).code(0).out;
    assert!(
        message.contains("simulated (geometric, for event_rates, localisation)"),
        "{message}"
    );
    at(&folder, &["new", "other-skin", "o.yaml"]).code(0);
    at(
        &folder,
        &["check", "o.yaml", "--set", "scene.level=geometric"],
    )
    .code(2)
    .expect_stderr(&["scene.level", "optical"]);
}
