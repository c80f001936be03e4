//! Packages: installed into an empty root, the program needs no checkout.

use std::path::Path;
use std::process::Command;

use crate::support::{Lab, ROOT, files, only, run_to_end};

/// Runs a tool and asserts exit code 0.
fn run_tool(name: &str, arguments: &[&str]) {
    let mut command = Command::new(name);
    command.args(arguments);
    run_to_end(command).code(0);
}

/// Output of the installed program in `folder`, without access to this checkout.
fn installed(root: &Path, folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(root.join("bin/skinrig"));
    command
        .env_clear()
        .env("PATH", "/usr/bin:/bin")
        .env("HOME", folder);
    command.current_dir(folder).args(arguments);
    run_to_end(command).code(0).out
}

#[test]
fn packages_hold_all_that_a_lab_needs() {
    let lab = Lab::new();
    let (out, root) = (lab.text("packages"), lab.text("root"));
    std::fs::create_dir(&root).unwrap();
    let package = format!("{ROOT}/packaging/package");
    run_tool("bash", &[&package, &out, env!("CARGO_BIN_EXE_skinrig")]);
    let archive = only(Path::new(&out), ".tar.gz");
    run_tool(
        "tar",
        &[
            "-xzf",
            archive.to_str().unwrap(),
            "-C",
            &root,
            "--strip-components=1",
        ],
    );
    let root = Path::new(&root);
    for page in [
        "README.md",
        "docs/how-to/bench.md",
        "docs/report.png",
        "bench/README.md",
        "LICENSE-MIT",
    ] {
        assert!(root.join("share/doc/skinrig").join(page).exists(), "{page}");
    }
    assert!(root.join("share/man/man1/skinrig-run.1.gz").exists());

    let printed = installed(root, &lab.path(""), &["init", "lab"]);
    assert!(
        printed.contains("skinrig run protocols/demo.yaml"),
        "{printed}"
    );
    let folder = lab.path("lab");
    // The demo with few presses: only the origin of files matters here.
    let short = [
        "run",
        "protocols/demo.yaml",
        "--set",
        "path.meander.columns=3",
        "--set",
        "path.meander.rows=3",
    ];
    installed(root, &folder, &short);
    let session = only(&folder.join("sessions"), ".session.sqlite");
    assert_eq!(files(&folder.join("sessions"), ".report.html").len(), 1);
    installed(root, &folder, &["verify", session.to_str().unwrap()]);

    // Where dpkg-deb exists, the .deb contains the same program and the Debian-specific files.
    let Some(deb) = files(Path::new(&out), ".deb").pop() else {
        return;
    };
    let debian = lab.text("debian");
    run_tool("dpkg-deb", &["-x", deb.to_str().unwrap(), &debian]);
    let program = |path: &Path| std::fs::read(path).unwrap();
    assert!(
        program(&Path::new(&debian).join("usr/bin/skinrig")) == program(&root.join("bin/skinrig"))
    );
    assert!(
        Path::new(&debian)
            .join("usr/lib/udev/rules.d/70-skinrig.rules")
            .exists()
    );
}
