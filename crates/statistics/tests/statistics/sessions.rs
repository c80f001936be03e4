//! Sessions of one skin differ by mounting, light and calibration: what that does to the difference between skins.

use skinrig_statistics::{
    ComparisonTarget, ImprovementDirection, PressesNeeded, Sample, Settings, Verdict, compare,
    seeded,
};

const LOCATIONS: u32 = 16;
const REPETITIONS: usize = 2;
/// Standard deviations: of a location, shared by all; between sessions; of a press.
const LOCATION: f64 = 0.3;
const SESSION: f64 = 0.2;
const PRESS: f64 = 0.2;

fn settings() -> Settings {
    Settings {
        resamples: 399,
        ..Settings::default()
    }
}

/// (location, error) of each press of a session.
type Session = Vec<(u32, f64)>;

/// So many sessions of each skin, with this true difference of the mean and this standard deviation between sessions.
fn skins(seed: u64, sessions: [usize; 2], difference: f64, spread: f64) -> [Vec<Session>; 2] {
    let mut rng = seeded::generator(seed, 7);
    let mut normal = move || (0..12).map(|_| seeded::signed_unit(&mut rng)).sum::<f64>() / 2.0;
    let locations: Vec<f64> = (0..LOCATIONS).map(|_| 2.0 + LOCATION * normal()).collect();
    [0, 1].map(|side| {
        let session = |_| {
            let own = difference * side as f64 + spread * normal();
            let mut presses = Session::new();
            for (k, at) in (0..).zip(&locations) {
                presses.extend((0..REPETITIONS).map(|_| (k, at + own + PRESS * normal())));
            }
            presses
        };
        (0..sessions[side]).map(session).collect()
    })
}

fn sample(sessions: &[Session], of: fn(&Session) -> Sample) -> Sample {
    let all: Session = sessions.iter().flatten().copied().collect();
    let by_session = sessions.iter().filter(|_| sessions.len() > 1).map(of);
    of(&all).of_sessions(by_session)
}

fn target(margin: Option<f64>) -> ComparisonTarget {
    ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin,
    }
}

fn mean(session: &Session) -> Sample {
    Sample::mean(session.iter().copied()).expect("finite values")
}

fn rms(session: &Session) -> Sample {
    Sample::rms(session.iter().copied()).expect("finite values")
}

/// Share of 400 pairs of equal skins that are called better or worse.
fn false_claims(sessions: [usize; 2], of: fn(&Session) -> Sample) -> f64 {
    let claims = (0..400).filter(|seed| {
        let [a, b] = skins(*seed, sessions, 0.0, SESSION).map(|s| sample(&s, of));
        let found = compare(&a, &b, &target(None), &settings()).expect("a comparison");
        let excludes = found.difference.low > Some(0.0) || found.difference.high < Some(0.0);
        assert_eq!(excludes, found.p_difference <= 0.05, "{found:#?}");
        excludes
    });
    claims.count() as f64 / 400.0
}

#[test]
fn sessions_of_equal_skins_are_called_equal() {
    for of in [mean, rms] {
        // Four standard errors above 5 %.
        for sessions in [[2, 2], [4, 4], [1, 3], [3, 2]] {
            let found = false_claims(sessions, of);
            assert!(found <= 0.094, "{sessions:?}: {found}");
        }
        // One session of each tells nothing of the next: what the caller has to say.
        assert!(false_claims([1, 1], of) > 0.5);
    }
}

/// Presses do not tell more about sessions; sessions do.
#[test]
fn more_sessions_decide_what_more_presses_cannot() {
    let compared = |sessions: usize| {
        let [a, b] = skins(5, [sessions; 2], 0.25, SESSION).map(|s| sample(&s, mean));
        compare(&a, &b, &target(None), &settings()).expect("a comparison")
    };
    let found = compared(3);
    assert_eq!(found.verdict, Verdict::Undecided, "{found:#?}");
    let PressesNeeded::Sessions { towards, each } = found.needed else {
        panic!("{found:#?}");
    };
    assert_eq!(towards, Verdict::Worse);
    assert!((5..60).contains(&each), "{each}");
    let then = compared(2 * each as usize);
    assert_eq!(then.verdict, Verdict::Worse, "{then:#?}");
}

/// With sessions that do not differ the interval is wider than that over locations, but less than twice as wide.
#[test]
fn sessions_that_are_alike_cost_little() {
    let widths: Vec<f64> = (0..20)
        .map(|seed| {
            let both = skins(seed, [8, 8], 0.0, 0.0);
            let [a, b] = both.each_ref().map(|s| sample(s, mean));
            let [c, d] = both.each_ref().map(|s| mean(&s.concat()));
            let width = |a, b| {
                let of = compare(a, b, &target(None), &settings()).expect("a comparison");
                of.difference.high.expect("closed") - of.difference.low.expect("closed")
            };
            width(&a, &b) / width(&c, &d)
        })
        .collect();
    assert!(widths.iter().all(|w| (1.0..2.0).contains(w)), "{widths:?}");
}

/// Skins a margin apart are not called equivalent because of two lucky sessions.
#[test]
fn sessions_limit_what_is_called_equivalent() {
    let margin = 0.2;
    let claims = (0..400).filter(|seed| {
        let [a, b] = skins(*seed, [3, 3], margin, SESSION).map(|s| sample(&s, mean));
        let found = compare(&a, &b, &target(Some(margin)), &settings()).expect("a comparison");
        found.verdict == Verdict::Equivalent
    });
    assert!(
        claims.count() <= 37,
        "of 400, at most 5 % and four standard errors"
    );
}
