//! Contents of a sessions folder: prototypes, tags, remarks, and the catalogue of all.

use serde_json::{Value, json};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection};

use crate::support::{Lab, SMALL, files, only, skinrig, text};

#[test]
fn sessions_are_found_by_prototype_and_by_tag_and_their_trend_is_shown() {
    let lab = Lab::new();
    let s = lab.text("s");
    // Two sessions of one skin, one of another without results.
    for seed in ["1", "2"] {
        skinrig(&["run", SMALL, "--sessions", &s, "--seed", seed]).code(0);
    }
    let [a, b] = ["--no-analysis", "prototype.id=skin B"];
    skinrig(&["run", SMALL, "--sessions", &s, a, "--set", b]).code(0);
    let other = only(&lab.path("s"), "-skin-b.session.sqlite");
    let first = &files(&lab.path("s"), "-test-skin.session.sqlite")[0];

    let before = std::fs::read(first).unwrap();
    let tags = ["tag", &text(first), "good-skin", "wet", "--by", "Ann"];
    skinrig(&tags).code(0);
    let more = ["tag", &text(first), "-wet", "--note", "the lamp was new"];
    let output = skinrig(&more).code(0).out;
    assert!(
        output.contains("tags  good-skin\n") && output.contains("the lamp was new"),
        "{output}"
    );
    skinrig(&["tag", &text(first), "Good Skin"]).code(2);
    // The session file is unchanged.
    assert!(before == std::fs::read(first).unwrap());
    skinrig(&["verify", &text(first)]).code(0);

    let list = |more: &[&str]| -> Value {
        skinrig(&[&["sessions", &s, "--json"], more].concat())
            .code(0)
            .json()
    };
    assert_eq!(list(&[]).as_array().unwrap().len(), 3);
    let tagged = list(&["--tag", "good-skin"]);
    assert_eq!(tagged[0]["path"], text(first).as_str());
    assert_eq!(tagged[0]["state"]["notes"][0]["text"], "the lamp was new");
    assert_eq!(tagged.as_array().unwrap().len(), 1);
    assert_eq!(
        list(&["--tag", "good-skin", "--tag", "wet"]),
        Value::Array(vec![])
    );
    let of_b = list(&["--prototype", "skin B"]);
    assert_eq!(of_b[0]["path"], text(&other).as_str());
    let words = skinrig(&["sessions", &s]).code(0).out;
    assert!(words.contains("[good-skin]  1 note(s)"), "{words}");

    let prototypes = skinrig(&["prototypes", &s, "--json"]).code(0).json();
    let [b, small] = [0, 1].map(|i| prototypes[i].clone());
    assert_eq!(
        (&b["prototype"], &b["sessions"]),
        (&"skin B".into(), &1.into())
    );
    assert_eq!(b["series"][0]["points"][0]["without"], "not analysed");
    assert_eq!(
        (&small["prototype"], &small["sessions"]),
        (&"test skin".into(), &2.into())
    );
    let series = &small["series"][0];
    let rmse = |point: &Value| point["value"].as_f64().unwrap();
    for (i, point) in series["points"].as_array().unwrap().iter().enumerate() {
        let results = point["session"].as_str().unwrap();
        let results = results.replace(".session.sqlite", ".results.json");
        let results = crate::support::read_json(results.as_ref());
        assert_eq!(
            point["rmse_mm"], results["analysis"]["scored"]["rmse_mm"],
            "{i}"
        );
        assert!(rmse(&series["best"]) <= rmse(&point["rmse_mm"]), "{series}");
    }
    assert_eq!(series["last"], series["points"][1]["rmse_mm"]);
    let words = skinrig(&["prototypes", &s, "--prototype", "test skin"])
        .code(0)
        .out;
    for word in ["test skin", "small.yaml", " to ", "[good-skin]"] {
        assert!(words.contains(word), "{word} in {words}");
    }
    skinrig(&["prototypes", &s, "--prototype", "skin C"])
        .code(2)
        .expect_stderr(&["skin C", "skin B, test skin"]);

    the_catalogue_has_the_same_answers(&s, &prototypes);

    // A broken tag log is reported; its session is still listed.
    let log = only(&lab.path("s"), ".tags.jsonl");
    std::fs::write(&log, "good-skin\n").unwrap();
    let words = skinrig(&["sessions", &s]).code(0).out;
    assert!(
        words.contains("tags unreadable") && words.contains("line 1"),
        "{words}"
    );
    skinrig(&["tag", &text(first), "more"])
        .code(2)
        .expect_stderr(&["line 1"]);
}

/// Without being asked, the catalogue has what reading the files gives.
fn the_catalogue_has_the_same_answers(s: &str, prototypes: &Value) {
    let status = skinrig(&["catalogue", "status", s, "--json"])
        .code(0)
        .json();
    let (current, stale) = (&status["status"]["current"], &status["status"]["stale"]);
    assert_eq!((current, stale), (&json!(3), &json!([])));
    let ask = |words: &[&str]| -> Vec<Value> {
        let all = [&["catalogue", "query"], words, &["--folder", s, "--json"]].concat();
        let answer = skinrig(&all).code(0);
        assert_eq!(answer.err, "", "nothing is stale");
        answer.json()["rows"].as_array().unwrap().clone()
    };
    let points = prototypes[1]["series"][0]["points"].as_array().unwrap();
    let trend = ask(&["prototype-trend", "prototype=test skin"]);
    assert_eq!(trend.len(), points.len());
    for (row, point) in trend.iter().zip(points) {
        assert_eq!(row["started_at"], point["started_at"]);
        for (own, part) in [
            ("rmse_mm", "value"),
            ("rmse_low_mm", "low"),
            ("presses", "n"),
        ] {
            assert_eq!(row[own], point["rmse_mm"][part], "{own}");
        }
    }
    let best = ask(&["best-prototypes", "min_sessions=2"]);
    assert_eq!((best.len(), &best[0]["sessions"]), (1, &json!(2)));
    assert_eq!(
        best[0]["best_rmse_mm"],
        prototypes[1]["series"][0]["best"]["value"]
    );
    let left_out = points.iter().map(|point| {
        let session = point["session"].as_str().unwrap();
        let results =
            crate::support::read_json(session.replace(".session.sqlite", ".results.json").as_ref());
        let rmse = results["summary"]["left_out_rmse_mm"]["value"].as_f64();
        rmse.unwrap()
    });
    let mean = left_out.sum::<f64>() / 2.0;
    let answered = best[0]["left_out_rmse_mm"].as_f64().unwrap();
    assert!((answered - mean).abs() < 1e-9, "{answered} {mean}");
    the_presses_are_those_of_the_results(&ask, points);
    assert_eq!(ask(&["tagged", "tag=good-skin"]).len(), 1);
    assert_eq!(
        ask(&["notes", "text=lamp"])[0]["text"],
        json!("the lamp was new")
    );
    let listed = skinrig(&["sessions", s, "--json"]).code(0).json();
    let listed = listed.as_array().unwrap();
    for row in ask(&["rigs"]) {
        let sum = |key: &str| -> u64 {
            let one = |session: &Value| session["state"]["presses"][key].as_u64().unwrap();
            listed.iter().map(one).sum()
        };
        assert_eq!(
            (&row["planned"], &row["valid"]),
            (&json!(sum("planned")), &json!(sum("valid")))
        );
        assert_eq!(row["sessions"], json!(listed.len()));
    }
    let drift = ask(&["clock-drift"]);
    assert_eq!(drift.len(), 2, "two simulated cameras: {drift:?}");
    // The list of prototypes comes from the catalogue, and is that of the files.
    let file = std::path::Path::new(s).join("catalogue.sqlite");
    let list = || skinrig(&["prototypes", s, "--json"]).code(0).json();
    assert_eq!(list(), *prototypes);
    change(&file, "UPDATE analysis SET rmse_mm = 99");
    assert_eq!(list()[1]["series"][0]["last"]["value"], json!(99.0));
    skinrig(&["catalogue", "rebuild", s]).code(0);
    // Rebuilt from nothing: the same answers.
    let before = ask(&["devices"]);
    std::fs::remove_file(&file).unwrap();
    assert_eq!(list(), *prototypes);
    skinrig(&["catalogue", "query", "devices", "--folder", s])
        .code(2)
        .expect_stderr(&["skinrig catalogue rebuild"]);
    let rebuilt = skinrig(&["catalogue", "rebuild", s]).code(0).out;
    assert!(rebuilt.contains("3 read"), "{rebuilt}");
    assert_eq!(ask(&["devices"]), before);
    assert_eq!(ask(&["prototype-trend", "prototype=test skin"]), trend);
    let words = skinrig(&["catalogue", "query", "devices", "--folder", s])
        .code(0)
        .out;
    assert!(words.contains("sim-00000001-c1"), "{words}");
}

/// Number and mean error of the presses that count, and number of those that failed.
fn the_presses_are_those_of_the_results(ask: &dyn Fn(&[&str]) -> Vec<Value>, points: &[Value]) {
    let (mut errors, mut failed) = (Vec::new(), 0);
    for point in points {
        let results = point["session"].as_str().unwrap();
        let results = results.replace(".session.sqlite", ".results.json");
        let results = crate::support::read_json(results.as_ref());
        for press in results["analysis"]["presses"].as_array().unwrap() {
            let is_valid = press["verdict"] == "valid";
            failed += u64::from(!is_valid && press["role"] != "sync");
            if is_valid && press["role"] == "score" {
                let of = |at: &Value, axis: &str| at[axis].as_f64().unwrap();
                let off =
                    |axis| of(&press["location_outcome"]["at"], axis) - of(&press["truth"], axis);
                errors.push(libm::hypot(off("x_mm"), off("y_mm")));
            }
        }
    }
    let of = |question: &str| ask(&[question, "prototype=test skin"]);
    let depths = of("depth-errors");
    let sum =
        |rows: &[Value], key: &str| -> u64 { rows.iter().map(|r| r[key].as_u64().unwrap()).sum() };
    assert_eq!(sum(&depths, "presses"), errors.len() as u64);
    let weighted =
        |r: &Value| r["mean_error_mm"].as_f64().unwrap() * r["presses"].as_f64().unwrap();
    let total: f64 = depths.iter().map(weighted).sum();
    assert!((total - errors.iter().sum::<f64>()).abs() < 1e-9);
    assert_eq!(sum(&of("failure-causes"), "presses"), failed);
    assert!(!errors.is_empty());
}

/// Executes a statement on a database.
pub(crate) fn change(file: &std::path::Path, statement: &'static str) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = SqliteConnectOptions::new().filename(file);
        let mut conn = options.connect().await.unwrap();
        sqlx::query(statement).execute(&mut conn).await.unwrap();
        conn.close().await.unwrap();
    });
}

/// A run neither waits for a catalogue that is in use nor fails because of one that cannot be used; its session is then stale.
#[test]
fn a_run_does_without_a_catalogue() {
    let lab = Lab::new();
    let s = lab.text("s");
    std::fs::create_dir(lab.path("s")).unwrap();
    let file = lab.path("s").join("catalogue.sqlite");
    std::fs::write(&file, "not a catalogue").unwrap();
    let run = ["run", SMALL, "--sessions", &s, "--no-analysis"];
    let next = "skinrig catalogue register";
    skinrig(&run)
        .code(0)
        .expect_stderr(&["is not in the catalogue", "not SQLite", next]);
    assert_eq!(std::fs::read(&file).unwrap(), b"not a catalogue");
    skinrig(&["catalogue", "register", &s])
        .code(2)
        .expect_stderr(&["move it away"]);
    std::fs::remove_file(&file).unwrap();
    let session = only(&lab.path("s"), ".session.sqlite");
    skinrig(&["catalogue", "register", &text(&session)]).code(0);

    // In use by another program, which never ends.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    let options = SqliteConnectOptions::new().filename(&file);
    let mut other = runtime.block_on(options.connect()).unwrap();
    let lock = sqlx::query("BEGIN EXCLUSIVE").execute(&mut other);
    runtime.block_on(lock).unwrap();
    let note = "another program is writing the catalogue";
    skinrig(&["tag", &text(&session), "wet"])
        .code(0)
        .expect_stderr(&[note, next]);
    drop(other);
    let status = skinrig(&["catalogue", "status", &s]).code(0).out;
    for part in ["0 current, 1 stale", "changed since it was read", next] {
        assert!(status.contains(part), "{part}: {status}");
    }
    let done = skinrig(&["catalogue", "register", &s, "--json"])
        .code(0)
        .json();
    let registered = done["sessions"]["registered"].as_array().unwrap();
    assert_eq!(registered.len(), 1, "{done}");
    // Given by name, a session that cannot be read is an error.
    std::fs::write(lab.path("s").join("b.session.sqlite"), "no session").unwrap();
    skinrig(&["catalogue", "register", &lab.text("s/b.session.sqlite")]).code(2);
    let status = skinrig(&["catalogue", "status", &s]).code(0).out;
    assert!(
        status.contains("unreadable  b.session.sqlite: "),
        "{status}"
    );
    // The next list of the folder would leave it out.
    let unlisted = lab.text("s/copy.sqlite");
    std::fs::copy(&session, &unlisted).unwrap();
    skinrig(&["catalogue", "register", &unlisted])
        .code(2)
        .expect_stderr(&["a name that ends with `.session.sqlite`", "rename the file"]);
    std::fs::write(
        lab.path("s").join("prototypes.yaml"),
        "skinrig_prototypes: 1\nprototypes: [{nam: a}]\n",
    )
    .unwrap();
    skinrig(&["catalogue", "register", &s])
        .code(2)
        .expect_stderr(&["nam", "did you mean"]);
    skinrig(&["catalogue", "query", "devises"])
        .code(2)
        .expect_stderr(&["devices"]);
    let list = skinrig(&["catalogue", "query"]).code(0).out;
    assert!(
        list.contains("tagged") && list.contains("tag=..."),
        "{list}"
    );
}
