//! Nights that are not what they were, or never were one.

use skinrig_nightly::{Night, Verdict};

use crate::support::Lab;
use crate::synthetic::write_nights;

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
