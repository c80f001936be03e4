//! Nights that are not what they were, or never were one.

use skinrig_catalogue::CatalogueError;
use skinrig_nightly::trend::{Acceptance, Filter, History};
use skinrig_nightly::{Night, Verdict};

use crate::support::Lab;
use crate::synthetic::write_nights;

/// The nights in a folder as a history has them.
pub(crate) fn history(folder: &std::path::Path) -> History {
    let mut folders: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    folders.sort();
    let mut all = History::default();
    for folder in folders {
        let text = std::fs::read(folder.join("night.json")).unwrap();
        let night: Night = serde_json::from_slice(&text).unwrap();
        all.push(&night, folder.canonicalize().unwrap().display().to_string());
    }
    all
}

/// An accepted change of the bench of [`write_nights`].
pub(crate) fn accepted(series: Option<&str>) -> (String, Acceptance) {
    let accepted = Acceptance {
        series: series.map(str::to_owned),
        night: "a night".to_owned(),
        reason: "new lamp".to_owned(),
        by: "ada".to_owned(),
        at: "2026-01-02T03:04:05Z".to_owned(),
    };
    ("bench 1".to_owned(), accepted)
}

#[test]
fn nights_are_read_back_as_a_history_has_them() {
    let lab = Lab::with_sessions(0);
    let nights = lab.path().join("nights");
    write_nights(&nights, 5);
    let mut catalogue = lab.open();
    let none = catalogue.nights(&Filter::default()).unwrap_err();
    assert!(matches!(none, CatalogueError::NoNights { .. }), "{none}");
    assert!(none.to_string().contains("found no nights"), "{none}");
    catalogue.register_nights(&nights).unwrap();
    let one = accepted(Some("trigger_loopback/camera1/jitter"));
    let foreign = ("bench 2".to_owned(), accepted(None).1);
    let all = [one, foreign, accepted(None)];
    // The history was copied to another folder.
    for folder in [&nights, lab.path()] {
        catalogue.replace_acceptances(folder, &all).unwrap();
        catalogue.replace_acceptances(folder, &all).unwrap();
    }
    let found = catalogue.nights(&Filter::default()).unwrap();
    let [one, _, every] = all;
    let mut expected = history(&nights);
    expected.accepted = vec![one.1, every.1];
    assert_eq!((found.history, found.outdated), (expected, 0));
    let suites = catalogue.suites().unwrap();
    assert_eq!((suites.len(), suites[0].nights), (1, 5));
    let other = Filter {
        suite: Some("weekly".to_owned()),
        ..Filter::default()
    };
    let none = catalogue.nights(&other).unwrap_err().to_string();
    assert!(
        none.contains("expected nights of weekly on any bench, found nightly on bench 1"),
        "{none}"
    );
    catalogue.close().unwrap();
}

#[test]
fn nights_that_were_changed_are_named_and_not_added() {
    let lab = Lab::with_sessions(0);
    let [first, copy, forged] = ["a", "b", "c"].map(|name| lab.path().join(name));
    for folder in [&first, &copy, &forged] {
        write_nights(folder, 2);
    }
    let change = |folder: &std::path::Path, change: &dyn Fn(&mut Night)| {
        let file = folder.join("00000/night.json");
        let mut night: Night = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        change(&mut night);
        std::fs::write(&file, serde_json::to_vec(&night).unwrap()).unwrap();
    };
    change(&copy, &|night| night.took_s += 1.0);
    change(&forged, &|night| night.checks[0].verdict = Verdict::Fail);

    let mut catalogue = lab.open();
    assert_eq!(catalogue.register_nights(&first).unwrap().registered, 2);
    for (folder, why) in [
        (&copy, "one of the two was changed"),
        (&forged, "PASS above FAIL among its checks"),
    ] {
        let done = catalogue.register_nights(folder).unwrap();
        assert_eq!((done.registered, done.unchanged), (0, 1));
        let [refused] = &done.unreadable[..] else {
            panic!("{done:?}");
        };
        assert!(refused.reason.contains(why), "{}", refused.reason);
    }
    catalogue.close().unwrap();
}
