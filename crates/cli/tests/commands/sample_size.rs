//! Presses needed to detect a difference, from a session's variance.

use std::path::Path;

use crate::support::{Lab, ROOT, SMALL, only, skinrig, text};

#[test]
fn a_session_gives_the_sample_size_of_the_next_one() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let ask = |more: &[&str]| {
        let arguments = ["--json", "plan", "--from", &session, "--detect"];
        skinrig(&[&arguments[..], more].concat()).code(0).json()
    };
    let answer = ask(&["1 mm"]);
    let proposals = answer["plan"]["proposals"].as_array().unwrap();
    let presses = |i: usize| proposals[i]["presses"].as_u64().unwrap();
    let cheapest = answer["plan"]["cheapest"].as_u64().unwrap() as usize;
    assert!((0..proposals.len()).all(|i| presses(i) >= presses(cheapest)));
    assert!(proposals[0]["seconds"].as_f64().unwrap() > 0.0);
    let locations = |answer: &serde_json::Value| {
        answer["plan"]["proposals"][0]["locations"]
            .as_u64()
            .unwrap()
    };
    // A tenth of the difference takes more locations; units do not matter.
    assert!(locations(&ask(&["0.1 mm"])) > locations(&answer));
    assert_eq!(ask(&["100 um"]), ask(&["0.1 mm"]));
    assert!(locations(&ask(&["0.1 mm", "--power", "0.95"])) > locations(&ask(&["0.1 mm"])));
    assert!(locations(&ask(&["0.1 mm", "--common", "0.9"])) < locations(&ask(&["0.1 mm"])));
    let table = skinrig(&["plan", "--from", &session, "--detect", "0.1 mm"]).code(0);
    assert!(
        table.out.contains("locations  repetitions  presses"),
        "{}",
        table.out
    );

    // Errors at several depths are no repetitions.
    let small = std::fs::read_to_string(Path::new(ROOT).join(SMALL)).unwrap();
    let deep = small.replace("depth: 1.5 mm", "depths: [0.8 mm, 1.4 mm]");
    std::fs::write(lab.path("sweep.yaml"), deep).unwrap();
    let folder = lab.text("d");
    skinrig(&["run", &lab.text("sweep.yaml"), "--sessions", &folder]).code(0);
    let sweep = text(&only(&lab.path("d"), ".session.sqlite"));
    skinrig(&["plan", "--from", &sweep, "--detect", "1 mm"])
        .code(2)
        .expect_stderr(&["found 2 depths", "one depth with --from"]);
    skinrig(&["plan", "--detect", "1 mm"])
        .code(2)
        .expect_stderr(&["--from"]);
    for (wrong, part) in [("0 mm", "above 0"), ("3 s", "length")] {
        let answer = skinrig(&["plan", "--from", &session, "--detect", wrong]);
        answer.code(2).expect_stderr(&[part]);
    }
    let sure = [
        "plan", "--from", &session, "--detect", "1 mm", "--power", "1",
    ];
    skinrig(&sure).code(2).expect_stderr(&["probability"]);
    let both = [
        "plan",
        "protocols/demo.yaml",
        "--from",
        &session,
        "--detect",
        "1 mm",
    ];
    skinrig(&both).code(2);
}
