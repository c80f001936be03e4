//! The command line as a new user meets it.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot start the program must fail"
)]

use assert_cmd::Command;
use predicates::prelude::*;

const COMMANDS: [&str; 12] = [
    "check", "plan", "run", "sessions", "show", "analyze", "report", "verify", "import", "export",
    "inspect", "schema",
];

fn skinrig() -> Command {
    let mut command = Command::cargo_bin("skinrig").unwrap();
    command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    command
}

#[test]
fn every_command_has_help_with_an_example() {
    let all = skinrig()
        .arg("--help")
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    let all = String::from_utf8(all).unwrap();
    for name in COMMANDS {
        assert!(all.contains(name), "{name} is missing from --help");
        let help = skinrig()
            .args([name, "--help"])
            .assert()
            .success()
            .get_output()
            .stdout
            .clone();
        let help = String::from_utf8(help).unwrap();
        assert!(
            help.contains("Example") && help.contains(&format!("skinrig {name}")),
            "{help}"
        );
    }
    assert!(all.contains("Exit codes"), "{all}");
}

#[test]
fn bad_input_ends_with_code_2_and_says_what_to_do() {
    skinrig().arg("no-such-command").assert().code(2);
    for arguments in [
        vec!["check", "no/such/file.yaml"],
        vec!["show", "no/such.session.sqlite"],
        vec!["verify", "Cargo.toml"],
        vec!["inspect", "no/such.raw"],
        vec![
            "run",
            "protocols/demo.yaml",
            "--set",
            "path.meander.pich=6mm",
        ],
        vec!["run", "protocols/demo.yaml", "--level", "perfect"],
    ] {
        skinrig()
            .args(&arguments)
            .assert()
            .code(2)
            .stderr(predicate::str::contains("error"))
            .stderr(predicate::str::contains("panicked").not());
    }
}

#[test]
fn shipped_protocols_pass_their_own_check() {
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../protocols")).unwrap()
    {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.ends_with(".yaml") && !name.ends_with(".schedule.yaml") {
            skinrig().arg("check").arg(&path).assert().success();
        }
    }
}
