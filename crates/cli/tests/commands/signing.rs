//! Signed bundles and crates: by a key made here; edited, re-signed or unsigned copies do not count.

use std::path::Path;
use std::process::Command;

use crate::support::{Lab, SMALL, only, program, read_json, run_to_end, sha256, skinrig, text};

/// Makes a key and a file of allowed signers with its person; false, with the reason on standard error, without the program.
fn key(lab: &Lab, name: &str) -> bool {
    let made = Command::new("ssh-keygen")
        .args(["-q", "-t", "ed25519", "-N", "", "-C", name, "-f"])
        .arg(lab.path(name))
        .output();
    let Ok(made) = made else {
        eprintln!("skipped: no ssh-keygen");
        return false;
    };
    assert!(made.status.success(), "{made:?}");
    let public = std::fs::read_to_string(lab.path(&format!("{name}.pub"))).unwrap();
    std::fs::write(
        lab.path(&format!("{name}.signers")),
        format!("{name}@lab {public}"),
    )
    .unwrap();
    true
}

/// Edits a file of a bundle, and its hash in the manifest.
fn forge(bundle: &Path, ending: &str, from: &str, to: &str) {
    let path = only(bundle, ending);
    let before = std::fs::read_to_string(&path).unwrap();
    let after = before.replacen(from, to, 1);
    assert_ne!(before, after, "{from}");
    std::fs::write(&path, &after).unwrap();
    let manifest = bundle.join("manifest.json");
    let mut document = read_json(&manifest);
    let name = path.file_name().unwrap().to_str().unwrap();
    let listed = document["files"].as_array_mut().unwrap();
    let entry = listed.iter_mut().find(|f| f["name"] == name).unwrap();
    entry["bytes"] = after.len().into();
    entry["sha256"] = sha256(after.as_bytes()).into();
    std::fs::write(&manifest, document.to_string()).unwrap();
}

#[test]
fn an_edited_table_with_an_edited_manifest_does_not_verify() {
    let lab = Lab::new();
    if !key(&lab, "author") || !key(&lab, "forger") {
        return;
    }
    let session = text(&lab.record("s", &[]));
    skinrig(&["tag", &session, "good"]).code(0);
    let (bundle, author) = (lab.text("bundle"), lab.text("author"));
    let export = [
        "export", &session, "--to", "bundle", "--out", &bundle, "--sign", &author,
    ];
    skinrig(&export).code(0);
    // Again, as after a change of the key.
    skinrig(&export).code(0);
    let signers = lab.text("author.signers");
    let verify = |signers: &str| skinrig(&["verify", &bundle, "--signers", signers]);
    let sound = verify(&signers).code(0);
    assert!(
        sound.out.contains("signed by author@lab") && sound.out.contains("sound"),
        "{sound:#?}"
    );
    let unknown = skinrig(&["verify", &bundle]).code(0);
    assert!(
        unknown
            .out
            .contains("signed with a key that was not checked"),
        "{unknown:#?}"
    );
    let document = skinrig(&["--json", "verify", &bundle, "--signers", &signers])
        .code(0)
        .json();
    assert_eq!(document["signature"]["signer"], "author@lab");
    verify(&lab.text("forger.signers"))
        .code(4)
        .expect_stderr(&["a signature of a person in", "add a line"]);
    verify(&lab.text("none")).code(2).expect_stderr(&["none"]);

    // Tags follow from nothing: without the signature this edit is not found.
    let folder = lab.path("bundle");
    let signature = folder.join("manifest.json.sig");
    let good = std::fs::read(&signature).unwrap();
    forge(&folder, ".tags.jsonl", "good", "best");
    verify(&signers)
        .code(4)
        .expect_stderr(&["expected a signature of manifest.json", "do not use"]);
    skinrig(&["verify", &bundle]).code(4);
    std::fs::remove_file(&signature).unwrap();
    skinrig(&["verify", &bundle]).code(0);
    verify(&signers)
        .code(4)
        .expect_stderr(&["expected a signature, found none"]);
    let sign = |key: &str, namespace: &str| {
        let _ = std::fs::remove_file(&signature);
        let mut sign = Command::new("ssh-keygen");
        sign.args(["-q", "-Y", "sign", "-n", namespace, "-f", key]);
        assert!(
            sign.arg(folder.join("manifest.json"))
                .output()
                .unwrap()
                .status
                .success()
        );
    };
    sign(&lab.text("forger"), "skinrig");
    verify(&signers)
        .code(4)
        .expect_stderr(&["a signature of a person in"]);
    forge(&folder, ".tags.jsonl", "best", "good");
    sign(&author, "file");
    verify(&signers)
        .code(4)
        .expect_stderr(&["expected a signature of manifest.json"]);
    sign(&author, "skinrig");
    verify(&signers).code(0);
    forge(&folder, ".presses.csv", ",valid,", ",missed,");
    std::fs::write(&signature, good).unwrap();
    verify(&signers)
        .code(4)
        .expect_stderr(&["expected a signature of manifest.json"]);
}

#[test]
fn a_signature_that_cannot_be_made_or_checked_says_what_to_do() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let (bundle, key) = (lab.text("bundle"), lab.text("no-key"));
    let export = [
        "export", &session, "--to", "bundle", "--out", &bundle, "--sign", &key,
    ];
    let mut without = program(&export);
    without.env("PATH", lab.path(""));
    run_to_end(without)
        .code(1)
        .expect_stderr(&["the program `ssh-keygen`", "openssh-client"]);
    if Command::new("ssh-keygen").arg("-?").output().is_ok() {
        skinrig(&export)
            .code(2)
            .expect_stderr(&["a private key of `ssh-keygen`", "id_ed25519"]);
    }
    let csv = [
        "export", &session, "--to", "csv", "--out", &bundle, "--sign", &key,
    ];
    skinrig(&csv).code(2).expect_stderr(&["--to bundle"]);
    let verify = ["verify", &session, "--signers", &key];
    skinrig(&verify)
        .code(2)
        .expect_stderr(&["the folder of a bundle"]);
}

#[test]
fn a_signed_crate_is_that_of_its_author() {
    let lab = Lab::new();
    if !key(&lab, "author") {
        return;
    }
    skinrig(&["run", SMALL, "--sessions", &lab.text("s")]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let about = lab.text("publication.yaml");
    std::fs::write(&about, crate::publish::ABOUT).unwrap();
    let (out, author, signers) = (
        lab.text("crate"),
        lab.text("author"),
        lab.text("author.signers"),
    );
    let publish = [
        "publish", &session, "--about", &about, "--out", &out, "--sign", &author,
    ];
    skinrig(&publish).code(0);
    let reproduce = || skinrig(&["reproduce", &out, "--signers", &signers]);
    let good = reproduce().code(0);
    assert!(
        good.out.contains("PASS  signature: signed by author@lab"),
        "{good:#?}"
    );
    // Another author, in a description that fits.
    let path = lab.path("crate").join("ro-crate-metadata.json");
    let before = std::fs::read_to_string(&path).unwrap();
    std::fs::write(
        &path,
        before.replace("0000-0002-1825-0097", "0000-0001-5109-3700"),
    )
    .unwrap();
    let forged = reproduce().code(4);
    assert_eq!(forged.out.matches("FAIL").count(), 1, "{forged:#?}");
    assert!(forged.out.contains("FAIL  signature"), "{forged:#?}");
}
