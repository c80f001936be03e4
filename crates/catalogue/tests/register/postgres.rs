//! The same catalogue on a PostgreSQL server.

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError, Question};
use skinrig_nightly::Night;
use skinrig_nightly::trend::Filter;

use crate::server::Server;
use crate::support::{Lab, WAIT};
use crate::{nights, questions, sessions, synthetic};

/// Each role may do what its words say, and nothing of the next one.
#[test]
fn roles_allow_reading_annotating_and_recording() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(2);
    let mut owner = server.open().unwrap();
    owner.register(&[lab.session(0)]).unwrap();
    owner.create_roles().unwrap();
    owner.create_roles().unwrap();
    server.execute(&[
        "CREATE ROLE stranger LOGIN",
        "CREATE ROLE reader LOGIN IN ROLE skinrig_read",
        "CREATE ROLE annotator LOGIN IN ROLE skinrig_annotate",
        "CREATE ROLE recorder LOGIN IN ROLE skinrig_record",
        "CREATE ROLE keeper LOGIN IN ROLE skinrig_admin",
    ]);
    let denied = |result: Result<(), CatalogueError>| match result {
        Err(e @ CatalogueError::Denied { .. }) => {
            let words = e.to_string();
            assert!(words.contains("skinrig catalogue roles --help"), "{words}");
        }
        other => panic!("{other:?}"),
    };
    denied(server.open_as("stranger", Access::Read).map(drop));
    sessions::add_tag(&lab, 0);
    let tags = || server.rows("postgres", "SELECT tag FROM tag");
    let open = |user| server.open_as(user, Access::Write).unwrap();

    let mut reader = open("reader");
    assert_eq!(questions::ask(&mut reader, "unfinished", &[]).rows.len(), 1);
    denied(reader.register_annotations(&[lab.session(0)]).map(drop));
    denied(reader.register(&[lab.session(0)]).map(drop));
    denied(reader.create_roles());
    assert!(tags().is_empty());

    let mut annotator = open("annotator");
    let both = [lab.session(0), lab.session(1)];
    let done = annotator.register_annotations(&both).unwrap();
    assert_eq!(done.registered, ["0.session.sqlite"]);
    assert_eq!(
        done.unreadable[0].reason,
        "not in the catalogue: register it first"
    );
    assert_eq!(tags(), ["Some(\"wet\")"]);
    // Tags and notes are not all of a session: it stays stale.
    let status = annotator.status(lab.path()).unwrap();
    assert_eq!(status.stale.len(), 2, "{status:?}");
    denied(annotator.register(&[lab.session(0)]).map(drop));
    assert_eq!(tags(), ["Some(\"wet\")"]);

    let mut recorder = open("recorder");
    assert_eq!(
        recorder
            .refresh(lab.path(), false)
            .unwrap()
            .registered
            .len(),
        2
    );
    denied(recorder.create_roles());
    assert_eq!(tags(), ["Some(\"wet\")"]);
    let mut keeper = open("keeper");
    assert_eq!(
        keeper.refresh(lab.path(), true).unwrap().registered.len(),
        2
    );
}

#[test]
fn a_server_gives_the_answers_of_the_embedded_catalogue() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(3);
    let missing = Catalogue::open(server.address(), Access::Read, WAIT).unwrap_err();
    assert!(
        matches!(missing, CatalogueError::Missing { .. }),
        "{missing:?}"
    );
    let mut embedded = lab.open();
    let mut central = server.open().unwrap();
    for catalogue in [&mut embedded, &mut central] {
        assert_eq!(
            catalogue
                .refresh(lab.path(), false)
                .unwrap()
                .registered
                .len(),
            3
        );
        let status = catalogue.status(lab.path()).unwrap();
        assert_eq!((status.current, status.stale.len()), (3, 0));
        let again = catalogue.refresh(lab.path(), false).unwrap();
        assert_eq!((again.registered.len(), again.unchanged), (0, 3));
        let all = catalogue.refresh(lab.path(), true).unwrap();
        assert_eq!(all.registered.len(), 3);
    }
    let store = questions::ask(&mut central, "unfinished", &[]).rows[0][7].clone();
    let folder = lab.path().canonicalize().unwrap();
    assert!(
        store.as_text().unwrap().ends_with(folder.to_str().unwrap()),
        "{store:?}"
    );
    drop(central);

    // Synthetic sessions, in a database of their own: every answer is the same, row by row.
    let other = Lab::with_sessions(0);
    let (mut embedded, mut central) = (other.open(), server.open().unwrap());
    central.refresh(other.path(), false).unwrap();
    std::fs::remove_file(lab.session(0)).unwrap();
    std::fs::remove_file(lab.session(1)).unwrap();
    std::fs::remove_file(lab.session(2)).unwrap();
    assert_eq!(
        central.refresh(lab.path(), false).unwrap().forgotten.len(),
        3
    );
    synthetic::write_prototypes(other.path());
    synthetic::write_nights(&other.path().join("nights"), 20);
    for catalogue in [&mut embedded, &mut central] {
        catalogue.refresh(other.path(), false).unwrap();
        let nights = catalogue
            .register_nights(&other.path().join("nights"))
            .unwrap();
        assert_eq!(nights.registered, 20);
        catalogue.add(&synthetic::sessions(200, 5)).unwrap();
        let accepted = [nights::accepted(None)];
        catalogue
            .replace_acceptances(other.path(), &accepted)
            .unwrap();
        let mut expected = nights::history(&other.path().join("nights"));
        expected.accepted = accepted.map(|(_, accepted)| accepted).into();
        assert_eq!(
            catalogue.nights(&Filter::default()).unwrap().history,
            expected
        );
    }
    for question in Question::all() {
        let all = question.parameters.iter().find(|p| p.name == "limit");
        let given: Vec<_> = all.map(|p| (p.name, "1000")).into_iter().collect();
        let [own, servers] =
            [&mut embedded, &mut central].map(|c| questions::ask(c, question.name, &given));
        assert_eq!(own.columns, servers.columns, "{}", question.name);
        assert_eq!(own.rows.len(), servers.rows.len(), "{}", question.name);
        for (own, servers) in own.rows.iter().zip(&servers.rows) {
            assert!(
                questions::is_equal(own, servers),
                "{}: {own:?} {servers:?}",
                question.name
            );
        }
    }
}

#[test]
fn programs_that_register_a_folder_at_once_wait_for_each_other() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(2);
    synthetic::write_prototypes(lab.path());
    server.open().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let mut catalogue = server.open().unwrap();
                for n in 0..10 {
                    catalogue.refresh(lab.path(), n % 2 == 0).unwrap();
                    let accepted = [nights::accepted(None)];
                    catalogue
                        .replace_acceptances(lab.path(), &accepted)
                        .unwrap();
                }
            });
        }
    });
    assert_eq!(
        server.open().unwrap().status(lab.path()).unwrap().current,
        2
    );
}

#[test]
fn benches_of_one_name_on_two_computers_keep_their_nights() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(0);
    let [own, other] = ["own", "other"].map(|name| lab.path().join(name));
    let mut central = server.open().unwrap();
    synthetic::write_nights(&other, 3);
    central.register_nights(&other).unwrap();
    central
        .replace_acceptances(&other, &[nights::accepted(None)])
        .unwrap();
    // As another computer would have registered them.
    server.execute(&[
        "UPDATE night SET folder = 'lab2-abcdef:/nights' || night_id",
        "UPDATE night_acceptance SET store = 'lab2-abcdef:/nights'",
    ]);
    assert_eq!(central.suites().unwrap()[0].rig, "bench 1");
    // They begin in the same seconds, under the same names, and measure something else.
    synthetic::write_nights(&own, 2);
    for night in ["00000", "00001"] {
        let file = own.join(night).join("night.json");
        let mut changed: Night = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        changed.took_s += 1.0;
        std::fs::write(&file, serde_json::to_vec(&changed).unwrap()).unwrap();
    }
    let done = central.register_nights(&own).unwrap();
    assert_eq!((done.registered, done.unreadable.len()), (2, 0), "{done:?}");
    let suites = central.suites().unwrap();
    let of_lab2 = suites
        .iter()
        .position(|s| s.rig == "bench 1 of lab2-abcdef");
    let [lab2, here] = of_lab2.map(|at| [at, 1 - at]).unwrap();
    assert_eq!([suites[lab2].nights, suites[here].nights], [3, 2]);
    for (at, accepted) in [(lab2, 1), (here, 0)] {
        let filter = Filter {
            rig: Some(suites[at].rig.clone()),
            ..Filter::default()
        };
        let found = central.nights(&filter).unwrap().history;
        assert_eq!(found.nights.len(), suites[at].nights);
        assert_eq!(found.series[0].points.len(), suites[at].nights);
        assert_eq!(found.accepted.len(), accepted);
    }
    let unclear = Filter {
        rig: Some("bench 1".to_owned()),
        ..Filter::default()
    };
    let refused = central.nights(&unclear).unwrap_err().to_string();
    assert!(refused.contains("bench 1 of lab2-abcdef"), "{refused}");
    // A changed night of this computer is still refused.
    let copy = lab.path().join("copy");
    synthetic::write_nights(&copy, 1);
    let done = central.register_nights(&copy).unwrap();
    assert_eq!((done.registered, done.unreadable.len()), (0, 1), "{done:?}");
}

#[test]
fn an_unreachable_server_is_an_error_without_its_password() {
    let folder = tempfile::tempdir().unwrap();
    let url = format!(
        "postgres://ann:secret@localhost/skins?host={}",
        folder.path().display()
    );
    let error = Catalogue::open(Address::parse(url.as_ref()), Access::Write, WAIT).unwrap_err();
    assert!(
        matches!(error, CatalogueError::Connection { .. }),
        "{error:?}"
    );
    assert!(error.to_string().contains("`host=FOLDER`"), "{error}");
    let text = format!("{error} {error:?}");
    assert!(
        text.contains("postgres://ann@localhost/skins") && !text.contains("secret"),
        "{text}"
    );
}

#[test]
fn a_reader_asks_and_does_not_register() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(1);
    server.open().unwrap().refresh(lab.path(), false).unwrap();
    server.execute(&[
        "CREATE ROLE reader LOGIN",
        "GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader",
    ]);
    let url = server.url("postgres").replace("skinrig@", "reader@");
    let address = Address::parse(url.as_ref());
    for access in [Access::Read, Access::Write] {
        let mut reader = Catalogue::open(address.clone(), access, WAIT).unwrap();
        assert_eq!(reader.status(lab.path()).unwrap().current, 1);
        assert_eq!(questions::ask(&mut reader, "rigs", &[]).rows.len(), 1);
        let refused = reader.refresh(lab.path(), true).unwrap_err();
        assert!(
            matches!(refused, CatalogueError::Denied { .. }),
            "{refused:?}"
        );
    }
    let central = server.open().unwrap().status(lab.path()).unwrap();
    assert_eq!((central.current, central.stale.len()), (1, 0));
}

#[test]
#[ignore = "measures, a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-catalogue -- --ignored --nocapture"]
fn ten_thousand_sessions_in_postgresql() {
    let Some(server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(0);
    let mut catalogue = server.open().unwrap();
    println!("{}", questions::measure(&mut catalogue, &lab, "PostgreSQL"));
}
