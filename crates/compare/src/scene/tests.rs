//! Predictions from figures whose law is known.

use skinrig_statistics::seeded::{generator, signed_unit};

use super::*;

/// Figures of a session: a middle and a spread for each, on the scale of the figure, moved by `shift` standard deviations.
fn drawn(seed: u64, shift: impl Fn(SessionFigure) -> f64) -> SessionFigures {
    let mut random = generator(seed, 1);
    let values = SessionFigure::ALL.map(|figure| {
        // Near enough normal: twelve uniform numbers of variance 1/3.
        let normal = 0.5 * (0..12).map(|_| signed_unit(&mut random)).sum::<f64>();
        Some(figure.scale().back(0.7 + 0.02 * (normal + shift(figure))))
    });
    SessionFigures {
        values,
        presses: 100_000,
    }
}

fn replicates(first: u64, n: u64) -> Vec<SessionFigures> {
    (first..first + n)
        .map(|seed| drawn(seed, |_| 0.0))
        .collect()
}

fn row(rows: &[FigurePrediction], figure: SessionFigure) -> FigurePrediction {
    *rows.iter().find(|row| row.figure == figure).unwrap()
}

#[test]
fn a_right_scene_is_rejected_in_a_twentieth_of_the_sessions_at_most() {
    let (mut rejected, mut outside) = (0, 0);
    let sessions = 600;
    for seed in 0..sessions {
        let rows = predict(&drawn(seed, |_| 0.0), &replicates(10_000 + 20 * seed, 20));
        rejected += u32::from(rows.iter().any(FigurePrediction::differs));
        outside += rows
            .iter()
            .filter(|row| {
                let p = row.predicted.unwrap();
                !(p.low..=p.high).contains(&row.session.unwrap())
            })
            .count();
    }
    // 5 %, and three binomial standard errors.
    let most = f64::from(sessions as u32) * (0.05 + 3.0 * (0.05f64 * 0.95 / 600.0).sqrt());
    assert!(f64::from(rejected) < most, "{rejected} of {sessions}");
    let share = outside as f64 / (600.0 * 16.0);
    assert!((0.043..0.057).contains(&share), "{share}");
}

#[test]
fn a_figure_far_from_its_replicates_differs_alone_and_in_its_direction() {
    let others = replicates(1, 20);
    for (shift, higher) in [(8.0, true), (-8.0, false)] {
        let session = drawn(1_000, |figure| match figure {
            SessionFigure::Fading => shift,
            _ => 0.0,
        });
        let rows = predict(&session, &others);
        let differing: Vec<_> = rows.iter().filter(|row| row.differs()).collect();
        assert_eq!(differing.len(), 1, "{rows:?}");
        assert_eq!(differing[0].figure, SessionFigure::Fading);
        assert_eq!(differing[0].is_higher(), higher);
    }
}

#[test]
fn figures_without_a_prediction_say_so() {
    let session = drawn(1_000, |_| 0.0);
    let few = predict(&session, &replicates(1, LEAST_REPLICATES as u64 - 1));
    assert!(few.iter().all(|row| row.predicted.is_none()));
    // Replicates that do not vary predict nothing, but shares of presses vary by their number.
    let same = vec![drawn(7, |_| 0.0); 20];
    let rows = predict(&session, &same);
    assert_eq!(row(&rows, SessionFigure::Rmse).predicted, None);
    assert!(row(&rows, SessionFigure::Located).predicted.is_some());
    // A session without the figure has a prediction and no p value.
    let mut without = session;
    without.values[0] = None;
    let rows = predict(&without, &replicates(1, 20));
    let predicted = rows[0].predicted.unwrap();
    assert_eq!((predicted.p, predicted.deviations), (None, None));
    assert!(!rows[0].differs());
}

#[test]
fn one_lost_press_of_many_is_no_difference_and_a_tenth_is() {
    let all = |located: f64, presses| {
        let mut figures = drawn(3, |_| 0.0);
        let at = SessionFigure::ALL
            .iter()
            .position(|f| *f == SessionFigure::Located);
        figures.values[at.unwrap()] = Some(located);
        figures.presses = presses;
        figures
    };
    let others = vec![all(1.0, 250); 20];
    let differs = |located| {
        row(
            &predict(&all(located, 250), &others),
            SessionFigure::Located,
        )
        .differs()
    };
    assert!(!differs(1.0));
    assert!(!differs(249.0 / 250.0));
    assert!(differs(0.9));
}
