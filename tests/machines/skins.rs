//! Two skins that differ in how wide their presses are.

use skinrig_analysis::analyze;
use skinrig_compare::{Session, SessionFacts, Subject};
use skinrig_planted::grid::{Shape, session_of};

/// The analysed session of a skin.
pub(crate) fn skin(letter: char, seed: u64) -> Subject {
    let (mut input, events) = session_of(seed, &Shape::drawn(seed));
    input.settings.study_presses = 0;
    let facts = SessionFacts {
        file: format!("{seed}.session.sqlite"),
        session_id: format!("{seed:032x}"),
        prototype: letter.to_string(),
        rig_kind: "simulated".into(),
        rig_name: "planted".into(),
        ..SessionFacts::default()
    };
    let session = Session {
        facts,
        analysis: analyze(&input, &events).unwrap(),
    };
    Subject {
        letter,
        name: letter.to_string(),
        sessions: vec![session],
    }
}
