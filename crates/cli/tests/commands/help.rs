//! Help, bad command lines, shipped protocols.

use crate::support::{ROOT, skinrig};

const COMMANDS: [&str; 33] = [
    "init",
    "new",
    "doctor",
    "devices",
    "check",
    "plan",
    "status",
    "control",
    "note",
    "run",
    "resume",
    "sessions",
    "catalogue",
    "show",
    "analyze",
    "reanalyze",
    "report",
    "verify",
    "salvage",
    "import",
    "export",
    "challenge",
    "inspect",
    "schema",
    "tradeoff",
    "scene",
    "compare",
    "watch",
    "view",
    "prototypes",
    "tag",
    "completions",
    "man",
];

#[test]
fn every_command_has_help_with_an_example() {
    let all = skinrig(&["--help"]).code(0).out;
    assert!(all.contains("Exit codes"), "{all}");
    for name in COMMANDS {
        assert!(all.contains(name), "{name} is missing from --help");
        let help = skinrig(&[name, "--help"]).code(0).out;
        assert!(
            help.contains("Example") && help.contains(&format!("skinrig {name}")),
            "{help}"
        );
    }
}

#[test]
fn bad_input_exits_with_code_2_and_help() {
    skinrig(&["no-such-command"]).code(2);
    for (arguments, parts) in [
        (
            vec!["check", "no/such/file.yaml"],
            vec!["no/such/file.yaml", "cannot read"],
        ),
        (
            vec!["show", "no/such.session.sqlite"],
            vec!["skinrig sessions"],
        ),
        (
            vec!["analyze", "README.md"],
            vec!["README.md", "expected a skinrig session"],
        ),
        (
            vec!["report", "README.md"],
            vec!["expected a skinrig session"],
        ),
        (
            vec!["export", "README.md", "--to", "raw"],
            vec!["expected a skinrig session"],
        ),
        (vec!["verify", "docs"], vec!["expected a bundle"]),
        (vec!["watch", "no/such", "--once"], vec!["found none yet"]),
        (
            vec!["watch", "README.md"],
            vec!["expected a skinrig session"],
        ),
        (
            vec!["verify", "Cargo.toml"],
            vec!["Cargo.toml", "expected a skinrig session"],
        ),
        (
            vec!["run", "--replay", "Cargo.toml"],
            vec!["expected a skinrig session"],
        ),
        (vec!["inspect", "no/such.raw"], vec!["no/such.raw"]),
        (vec!["inspect", "Cargo.toml"], vec!["Cargo.toml"]),
        (vec!["inspect", "Cargo.toml", "--gap=-1"], vec!["--gap"]),
        (vec!["sessions", "no/such/folder"], vec!["no/such/folder"]),
        (vec!["run"], vec!["<PROTOCOL>", "--help"]),
        (
            vec!["run", "protocols/demo.yaml", "--level", "perfect"],
            vec!["--level", "perfect", "geometric"],
        ),
    ] {
        skinrig(&arguments)
            .code(2)
            .expect_stderr(&["error"])
            .expect_stderr(&parts);
    }
}

#[test]
fn shipped_protocols_pass_their_own_check() {
    let mut observed = 0;
    for entry in std::fs::read_dir(format!("{ROOT}/protocols")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let other = [".schedule.yaml", ".limits.yaml"];
        if name.ends_with(".yaml") && !other.iter().any(|e| name.ends_with(e)) {
            let text = skinrig(&["check", path.to_str().unwrap()]).code(0);
            assert!(text.out.contains(": ok"), "{text:?}");
            observed += 1;
        }
    }
    assert!(
        observed >= 5,
        "expected the shipped protocols, found {observed}"
    );
}

#[test]
fn the_shipped_schemas_are_those_that_the_program_prints() {
    for (kind, file) in [
        ("protocol", "skinrig.schema.json"),
        ("schedule", "skinrig-schedule.schema.json"),
        ("limits", "skinrig-limits.schema.json"),
    ] {
        let printed = skinrig(&["schema", kind]).code(0).json();
        let shipped = std::fs::read_to_string(format!("{ROOT}/protocols/{file}")).unwrap();
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&shipped).unwrap(),
            printed
        );
    }
}

/// Bash completes with the script; internal commands appear in no script and on no page.
#[test]
fn shells_complete_and_manuals_are_written() {
    for shell in ["bash", "zsh", "fish"] {
        let script = skinrig(&["completions", shell]).code(0).out;
        assert!(script.contains("tradeoff"), "{shell}");
        assert!(!script.contains("supervise-arm"), "{shell}");
        assert!(!script.contains("hold-arm"), "{shell}");
    }
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("skinrig.bash");
    std::fs::write(&script, skinrig(&["completions", "bash"]).out).unwrap();
    let complete = format!(
        "source {}; COMP_WORDS=(skinrig tra); COMP_CWORD=1; _skinrig skinrig tra skinrig; echo \"${{COMPREPLY[@]}}\"",
        script.display()
    );
    if let Ok(bash) = std::process::Command::new("bash")
        .args(["-c", &complete])
        .output()
    {
        assert_eq!(String::from_utf8_lossy(&bash.stdout).trim(), "tradeoff");
    }

    let pages = folder.path().join("man");
    skinrig(&["man", pages.to_str().unwrap()]).code(0);
    let names = std::fs::read_dir(&pages).unwrap();
    let names: Vec<String> = names
        .map(|n| n.unwrap().file_name().into_string().unwrap())
        .collect();
    for name in COMMANDS {
        assert!(names.contains(&format!("skinrig-{name}.1")), "{names:?}");
    }
    assert!(!names.iter().any(|n| n.contains("arm")), "{names:?}");
    let run = std::fs::read_to_string(pages.join("skinrig-run.1")).unwrap();
    assert!(run.contains(r"max\-rmse"), "{run}");
    skinrig(&["man", "/dev/null/x"]).code(2);
}
