//! Trends of a bench's nights: changes shown on the terminal, on the trend page and on
//! the page of the last night; and accepting a change.

mod nights;

use std::path::{Path, PathBuf};

use skinrig_model::Occasion;
use skinrig_nightly::{Night, NightExit, Verdict};

use crate::servers::http;
use crate::support::{ProgramOutput, files, only, program, run_to_end, skinrig, text};
use nights::Nights;

/// Name of the series [`EVENTS`] on pages.
const EVENTS_IN_WORDS: &str = "skin: press events (golden)";
const EVENTS: &str = "golden/skin/press_events";

#[track_caller]
fn read(page: &Path) -> String {
    std::fs::read_to_string(page).unwrap()
}

#[track_caller]
fn assert_contains(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "expected {part:?} in {text}");
    }
}

/// Text at the start of the element with this test id, before any nested element.
#[track_caller]
fn element_text<'a>(page: &'a str, id: &str) -> &'a str {
    let after = page.split(&format!("data-testid=\"{id}\"")).nth(1);
    let after = after.unwrap_or_else(|| panic!("no {id} in {page}"));
    let (_, text) = after.split_once('>').unwrap();
    text.split('<').next().unwrap()
}

/// Asserts that every link of the page leads to a file or an anchor in one; returns the links.
#[track_caller]
fn links(page: &Path) -> Vec<String> {
    let html = read(page);
    let hrefs = html.split("href=\"").skip(1);
    let hrefs: Vec<String> = hrefs
        .map(|rest| rest.split('"').next().unwrap().to_owned())
        .collect();
    for href in &hrefs {
        let (file, place) = href.split_once('#').unwrap_or((href, ""));
        let file = match file.strip_prefix("file://") {
            Some(full) => PathBuf::from(full),
            None if file.is_empty() => page.to_owned(),
            None => page.parent().unwrap().join(file),
        };
        assert!(file.is_file(), "{href} of {} leads nowhere", page.display());
        if !place.is_empty() {
            let html = read(&file);
            assert!(html.contains(&format!(" id=\"{place}\"")), "{href}");
        }
    }
    hrefs
}

#[test]
fn the_terminal_lists_changes_with_date_and_cause() {
    let nights = Nights::of(40, 36);
    let trend = nights.trend(&["--ascii"]).code(1);
    assert_contains(
        &trend.out,
        &[
            &format!("{EVENTS} moved (-20 %)"),
            "on 2024-02-06",
            "probable cause: the skin",
            "alarm 2024-02-08T02-00-00Z-small",
            "no session: that night has no golden session",
            "idle/camera1/data_rate",
        ],
    );
    assert!(
        trend
            .out
            .lines()
            .all(|l| l.chars().count() <= 80 && l.is_ascii()),
        "{}",
        trend.out
    );
    let one = nights.trend(&["--series", "idle/*"]).code(1);
    let table = one.out.split("series  ").last().unwrap();
    assert!(
        table.contains("data_rate") && !table.contains("press_events"),
        "{}",
        one.out
    );
    let json = nights.trend(&["--json"]).code(1).json();
    let alarm = &json["alarms"][0];
    assert_eq!(alarm["attribution"]["cause"], "skin");
    assert_eq!(alarm["since"], serde_json::json!([36, 36]));

    let steady = Nights::of(40, 40).trend(&[]).code(0);
    assert_contains(&steady.out, &["nothing moved in 40 nights (2 series)"]);
    let few = Nights::of(11, 11).trend(&[]).code(0);
    assert_contains(
        &few.out,
        &["too few nights for trends: 11 of the 12 that a reference needs"],
    );
}

#[test]
fn a_check_that_is_no_longer_made_ends_the_all_clear() {
    let nights = Nights::of(40, 40);
    nights.add_disk(40..43, 43);
    let trend = nights.trend(&[]).code(1);
    assert_contains(&trend.out, &["not known whether all is steady", "no value"]);
    assert!(trend.out.lines().all(|l| l.chars().count() <= 80));
    let page = nights.lab.text("trends.html");
    let _ = nights.trend(&["--html", &page]).code(1);
    assert_contains(&read(Path::new(&page)), &["not measured for 3 nights"]);
}

#[test]
fn what_is_no_history_is_bad_input_and_left_alone() {
    let nights = Nights::of(3, 3);
    let lab = &nights.lab;
    let none = lab.text("none.sqlite");
    let page = lab.text("page.html");
    skinrig(&["hil", "trend", &none, "--html", &page])
        .code(2)
        .expect_stderr(&["expected a history of nights, found no file", "--rebuild"]);
    assert!(!lab.path("none.sqlite").exists() && !lab.path("page.html").exists());

    std::fs::write(lab.path("notes.txt"), "name,value\n").unwrap();
    let notes = lab.text("notes.txt");
    skinrig(&["hil", "trend", &notes])
        .code(2)
        .expect_stderr(&["a file that is not SQLite"]);
    let of_notes = [
        "hil",
        "accept",
        "--all",
        "--night",
        "x",
        "--reason",
        "r",
        "--history",
        &notes,
    ];
    skinrig(&of_notes)
        .code(2)
        .expect_stderr(&["a file that is not SQLite"]);
    assert_eq!(std::fs::read_to_string(&notes).unwrap(), "name,value\n");

    nights
        .trend(&["--rig", "another"])
        .code(2)
        .expect_stderr(&["on another", "small on emulated"]);
    nights
        .trend(&["--series", "lamp"])
        .code(2)
        .expect_stderr(&["found `lamp`", "none of 2"]);
}

#[test]
fn an_alarm_links_a_session_that_outlives_its_night_and_replays() {
    let nights = Nights::new();
    let session = nights.lab.record("s", &[]);
    nights.add(0..36, 36, None);
    nights.add(36..40, 36, Some(&session));
    let page = nights.lab.path("trends.html");
    let html = |to: &Path| nights.trend(&["--html", &text(to)]).code(1);
    let trend = html(&page);
    assert_contains(&trend.out, &[&text(&page)]);
    let there = links(&page);
    let kept = nights.lab.path("nights/alarms/2024-02-08T02-00-00Z-small");
    let kept = only(&kept, ".session.sqlite");
    assert!(
        there.iter().any(|l| l.ends_with(".session.sqlite")),
        "{there:?}"
    );
    assert!(
        there.contains(&"nights/2024-02-08T02-00-00Z-small/night.html".to_owned()),
        "{there:?}"
    );
    let shown = read(Path::new(&page));
    assert_contains(
        element_text(&shown, "headline"),
        &[EVENTS_IN_WORDS, "probable cause: the skin"],
    );
    assert_eq!(element_text(&shown, "alarms"), "1 alarm");
    assert_eq!(element_text(&shown, "theme"), "Dark");

    // With the nights removed, the commands printed on the terminal still work.
    for night in files(&nights.lab.path("nights"), "-small") {
        std::fs::remove_dir_all(night).unwrap();
    }
    let trend = html(&page);
    links(&page);
    for (command, more) in [("run --replay", &["--no-analysis"][..]), ("verify", &[])] {
        let line = trend.out.lines().map(str::trim);
        let mut found = line.filter_map(|l| l.strip_prefix(&format!("skinrig {command} ")));
        let file = found
            .next()
            .unwrap_or_else(|| panic!("no {command}: {trend:#?}"));
        assert_eq!(Path::new(file), kept);
        let sessions = nights.lab.text("replayed");
        let mut arguments: Vec<&str> = command.split(' ').chain([file]).collect();
        if !more.is_empty() {
            arguments.extend(["--sessions", &sessions]);
            arguments.extend(more);
        }
        skinrig(&arguments).code(0);
    }
}

#[test]
fn an_accepted_change_restarts_the_reference_and_records_author_and_reason() {
    let nights = Nights::of(40, 36);
    let first = "2024-02-06T02-00-00Z-small";
    let before = std::fs::read(&nights.history).unwrap();
    for (arguments, why) in [
        (
            &["golden/skin/lamp", "--night", first, "--reason", "r"][..],
            "golden/skin/lamp",
        ),
        (
            &[EVENTS, "--night", "2024-02-31", "--reason", "r"],
            "the newest is 2024-02-09",
        ),
        (
            &[EVENTS, "--night", first, "--reason", " "],
            "--reason: expected a reason",
        ),
        (&["--night", first, "--reason", "r"], "<SERIES>"),
        (
            &[EVENTS, "--all", "--night", first, "--reason", "r"],
            "--all",
        ),
    ] {
        nights.accept(arguments).code(2).expect_stderr(&[why]);
    }
    assert_eq!(std::fs::read(&nights.history).unwrap(), before);
    nights.trend(&[]).code(1);

    let taken = [
        EVENTS,
        "--night",
        first,
        "--reason",
        "a <new> lamp",
        "--by",
        "ada",
    ];
    let output = nights.accept(&taken).code(0);
    assert_eq!(
        output.out.trim(),
        format!("{EVENTS}: the reference restarts at night {first}")
    );
    let page = nights.lab.text("trends.html");
    let trend = nights.trend(&["--html", &page]).code(0);
    assert_contains(
        &trend.out,
        &["nothing moved in 40 nights; 1 of 2 series are still learning their reference"],
    );
    let shown = read(Path::new(&page));
    let (_, accepted) = shown.split_once("data-testid=\"accepted\"").unwrap();
    assert_contains(
        accepted,
        &[first, EVENTS_IN_WORDS, "a &lt;new&gt; lamp", "ada, 20"],
    );
    assert_eq!(element_text(&shown, "alarms"), "no alarm");
    // The new level is the reference from now on.
    nights.add(40..60, 36, None);
    assert_contains(
        &nights.trend(&[]).code(0).out,
        &["nothing moved in 60 nights (2 series)"],
    );
    nights.add(60..64, 0, None);
    nights.trend(&[]).code(0);

    let all = [
        "--all",
        "--night",
        "2024-03-01T02-00-00Z-small",
        "--reason",
        "new skin",
    ];
    let output = nights
        .accept(&[&["--json"], &all[..]].concat())
        .code(0)
        .json();
    assert!(
        output["series"].is_null() && output["reason"] == "new skin",
        "{output}"
    );
    assert_contains(
        &nights.trend(&[]).code(0).out,
        &["too few nights for trends: 4 of the 12"],
    );
}

#[test]
fn the_nights_of_a_catalogue_are_judged_like_those_of_a_history() {
    let nights = Nights {
        with_json: true,
        ..Nights::new()
    };
    let session = nights.lab.record("s", &[]);
    nights.add(0..36, 36, None);
    nights.add(36..40, 36, Some(&session));
    let lab = &nights.lab;
    let (sessions, folder) = (lab.text("sessions"), lab.text("nights"));
    std::fs::create_dir_all(&sessions).unwrap();
    let register = || {
        let registered = ["catalogue", "register", &sessions, "--nights", &folder];
        skinrig(&registered).code(0)
    };
    let first = register();
    assert_contains(&first.out, &["nights      40 added, 0 unchanged"]);
    let catalogue = lab.text("sessions/catalogue.sqlite");
    let of_catalogue =
        |more: &[&str]| skinrig(&[&["hil", "trend", "--catalogue", &catalogue], more].concat());
    // Folders and copies of sessions have other paths.
    let judged = |output: ProgramOutput| {
        let mut report = output.json();
        for night in report["nights"].as_array_mut().unwrap() {
            night["folder"].take();
        }
        let sessions = report["sessions"].take();
        (report, sessions)
    };
    let (own, copies) = judged(nights.trend(&["--json"]).code(1));
    let (catalogues, originals) = judged(of_catalogue(&["--json"]).code(1));
    assert_eq!(own, catalogues);
    let found = originals[0].as_str().unwrap();
    assert!(
        found.starts_with(&folder) && copies[0] != originals[0],
        "{found}"
    );
    // The originals are named, and nothing is copied.
    assert!(!lab.path("sessions/alarms").exists());
    let page = lab.text("trends.html");
    assert_contains(&of_catalogue(&["--html", &page]).code(1).out, &[&page]);
    assert!(
        links(Path::new(&page))
            .iter()
            .any(|link| link.ends_with("night.html"))
    );

    // Accepted changes come along.
    let change = [
        EVENTS,
        "--night",
        "2024-02-06T02-00-00Z-small",
        "--reason",
        "a lamp",
    ];
    nights.accept(&change).code(0);
    let again = register();
    assert_contains(&again.out, &["nights      0 added, 40 unchanged"]);
    let (own, _) = judged(nights.trend(&["--json"]).code(0));
    assert_eq!(own, judged(of_catalogue(&["--json"]).code(0)).0);

    // Without arguments, the catalogue that the environment names is asked; folders that are gone are on another computer.
    for night in files(&lab.path("nights"), "-small") {
        std::fs::remove_dir_all(night).unwrap();
    }
    std::fs::remove_file(&nights.history).unwrap();
    let mut of_environment = program(&["hil", "trend"]);
    of_environment.env("SKINRIG_CATALOGUE", &catalogue);
    let trend = run_to_end(of_environment).code(0);
    assert_contains(&trend.out, &["nothing moved in 40 nights"]);
    nights.trend(&[]).code(2);
    of_catalogue(&["--rig", "bench 9"]).code(2).expect_stderr(&[
        "nights of any suite on bench 9, found small on emulated",
        "--nights FOLDER",
    ]);
}

#[test]
fn the_page_of_a_night_lists_the_trends() {
    let nights = Nights::new();
    let session = nights.lab.record("s", &[]);
    nights.add(0..36, 36, None);
    nights.add(36..40, 36, Some(&session));
    let (ran, folder) = nights.run(&["--history", &nights.history]);
    // Its limits are met: a trend alarm does not change the exit code.
    let ran = ran.code(0);
    let sentence = format!("{EVENTS} moved (-20 %) on 2024-02-06; probable cause: the skin");
    assert!(
        ran.out
            .lines()
            .all(|l| l.chars().count() <= 80 || l.starts_with('/'))
    );
    let words: Vec<&str> = ran.out.split_whitespace().collect();
    let trends = text(&folder.join("trends.html"));
    assert_contains(&words.join(" "), &[&format!("trend: {sentence}"), &trends]);
    let page = folder.join("night.html");
    let there = links(&page);
    assert_contains(
        &there.join("\n"),
        &[
            "trends.html\n",
            "trends.html#2024-02-08T02-00-00Z-small",
            "../2024-02-08T02-00-00Z-small/night.html",
            "../alarms/2024-02-08T02-00-00Z-small/",
        ],
    );
    links(&folder.join("trends.html"));
    let shown = read(Path::new(&page));
    assert_eq!(
        element_text(&shown, "headline"),
        "All within limits, but the skin probably moved"
    );
    let trends = shown.find("data-testid=\"trends-moved\"").unwrap();
    assert!(trends < shown.find("id=\"checks\"").unwrap());
    assert_contains(
        &shown[trends..],
        &[
            &sentence.replace(EVENTS, EVENTS_IN_WORDS),
            "skinrig run --replay ",
            "skinrig verify ",
        ],
    );
    let json = std::fs::read_to_string(folder.join("night.json")).unwrap();
    let night: Night = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (night.verdict, night.exit),
        (Verdict::Pass, NightExit::Pass)
    );
}

/// Third night of a disk that became a million times slower: the alarm links to tonight's page.
#[test]
fn an_alarm_that_is_raised_tonight_leads_to_tonight() {
    let nights = Nights::new();
    nights.add_disk(0..40, 38);
    nights.trend(&[]).code(0);
    let (ran, folder) = nights.run(&["--history", &nights.history]);
    assert_contains(&ran.code(0).out, &["trend: disk/computer/write_rate moved"]);
    let page = folder.join("trends.html");
    assert!(links(&page).contains(&"night.html".to_owned()));
    links(&folder.join("night.html"));
    let shown = read(&folder.join("night.html"));
    assert_eq!(
        element_text(&shown, "headline"),
        "All within limits, but the computer probably moved"
    );
    // Free disk space shrinks by design: it has no chart, and so no reference to restart.
    let tonight = folder.file_name().unwrap().to_string_lossy().into_owned();
    let free = ["disk/computer/free", "--night", &tonight, "--reason", "r"];
    nights
        .accept(&free)
        .code(2)
        .expect_stderr(&["a series disk/computer/free", "no series of that name"]);
    let rate = [
        "disk/computer/write_rate",
        "--night",
        &tonight,
        "--reason",
        "r",
    ];
    nights.accept(&rate).code(0);
}

/// The messages are sent after the history has the night, so `night.json` may differ from then on; adding it again changes nothing.
#[test]
fn a_night_tells_of_its_verdict_and_of_the_alarms_that_it_raised() {
    let nights = Nights::new();
    nights.add_disk(0..40, 38);
    let server = http(&[200]);
    let notify = format!(
        "notify: {{on: [night_pass, trend_alarm], webhook: {{url: \"http://127.0.0.1:{}/\"}}}}\n",
        server.port
    );
    let history = ["--history", &nights.history];
    let (ran, folder) = nights.run_notifying(&notify, &history);
    ran.code(0).expect_stderr(&[
        "note: webhook: night_pass: sent",
        "note: webhook: trend_alarm: sent",
    ]);
    let told: Vec<serde_json::Value> = server
        .received()
        .iter()
        .map(|request| serde_json::from_str(&request.body).unwrap())
        .collect();
    assert_eq!(told.len(), 2);
    let page = |name: &str| text(&folder.join(name));
    assert_eq!(told[0]["night"]["verdict"], "PASS");
    assert_eq!(told[0]["night"]["page"], page("night.html"));
    assert_eq!(told[1]["alarms"]["raised"], 1);
    assert_eq!(told[1]["alarms"]["page"], page("trends.html"));
    let headline = told[1]["alarms"]["headline"].as_str().unwrap();
    assert!(
        headline.contains("disk/computer/write_rate moved"),
        "{headline}"
    );
    let json = std::fs::read_to_string(folder.join("night.json")).unwrap();
    let night: Night = serde_json::from_str(&json).unwrap();
    let sent: Vec<_> = night
        .notifications
        .iter()
        .map(|n| (n.occasion, &n.fault))
        .collect();
    assert_eq!(
        sent,
        [(Occasion::NightPass, &None), (Occasion::TrendAlarm, &None)]
    );
    // The alarm goes on, but it was told; the second night has another verdict than the chosen ones.
    let notify = notify.replace("night_pass", "night_fail");
    let (ran, folder) = nights.run_notifying(&notify, &history);
    ran.code(0);
    assert_eq!(server.received(), []);
    let json = std::fs::read_to_string(folder.join("night.json")).unwrap();
    assert!(!json.contains("notifications"), "{json}");
    nights
        .trend(&["--rebuild", &nights.lab.text("nights")])
        .expect_stderr(&["0 nights added, 2 already present, 0 skipped"]);
}

/// A clock that went back must not turn tonight into a part of the reference, and yesterday into the newest night.
#[test]
fn nights_that_are_dated_before_others_are_not_taken_for_the_newest() {
    let nights = Nights::of(15, 15);
    nights.add_dated("2099-01-01");
    let (ran, folder) = nights.run(&["--history", &nights.history]);
    let dated = "the newest one there, found one of";
    ran.code(3)
        .expect_stderr(&["no trends for this night", "2099-01-01T02:00:00Z", dated]);
    assert_contains(&read(&folder.join("night.html")), &[dated]);
    let all = nights.lab.text("nights");
    nights.trend(&["--rebuild", &all]).expect_stderr(&[
        "1 nights added, 0 already present, 0 skipped",
        "1 of them started before nights that the history had already",
    ]);
    nights.add_file("2099-01-02");
    nights.trend(&["--rebuild", &all]).expect_stderr(&[
        "1 nights added, 1 already present",
        "of these, 1 dated in the future",
    ]);
}

#[test]
fn a_night_without_trends_gives_the_reason_and_is_still_judged() {
    let nights = Nights::of(10, 10);
    let shown = |folder: &Path| read(&folder.join("night.html"));
    let (ran, folder) = nights.run(&[]);
    ran.code(0);
    let page = shown(&folder);
    assert_contains(
        &page,
        &["data-testid=\"trends-not-requested\"", "--history FILE"],
    );
    assert!(!folder.join("trends.html").exists());
    links(&folder.join("night.html"));

    let (ran, folder) = nights.run(&["--history", &nights.history]);
    let too_few = "too few nights for trends: 10 of the 12";
    assert_contains(&ran.code(0).out, &[too_few]);
    assert_contains(
        &shown(&folder),
        &["data-testid=\"trends-learning\"", too_few],
    );

    std::fs::write(nights.lab.path("notes.txt"), "name,value\n").unwrap();
    let (ran, folder) = nights.run(&["--history", &nights.lab.text("notes.txt")]);
    let ran = ran.code(3);
    assert!(!ran.out.contains("trend"), "{ran:#?}");
    assert!(ran.out.contains("exit 3"), "{ran:#?}");
    ran.expect_stderr(&[
        "no trends for this night",
        "a file that is not SQLite",
        "--rebuild",
    ]);
    let page = shown(&folder);
    assert_eq!(element_text(&page, "verdict"), "PASS");
    assert_contains(
        &page,
        &[
            "data-testid=\"trends-unavailable\"",
            "a file that is not SQLite",
            "Limits were checked nevertheless",
        ],
    );
    // It is added once the history is available again.
    let all = nights.lab.text("nights");
    nights
        .trend(&["--rebuild", &all])
        .code(0)
        .expect_stderr(&["2 nights added"]);
    // Nothing moved in the nights that can be read says nothing about the others.
    let damaged = nights.lab.path("nights").join("2099-01-03-damaged");
    std::fs::create_dir(&damaged).unwrap();
    std::fs::write(damaged.join("night.json"), "{").unwrap();
    nights.trend(&["--rebuild", &all]).code(3).expect_stderr(&[
        "skipped",
        "2099-01-03-damaged",
        "leave out 1 nights that could not be read",
    ]);
}
