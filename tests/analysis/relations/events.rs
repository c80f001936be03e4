//! Changes of the events alone.

use skinrig_model::Polarity;

use super::base::Session;
use super::figures::{Figure, kind};
use super::{BASE, Relation, begins, number};

/// Exchanges ON and OFF.
pub(super) fn flip_polarities(session: &mut Session) {
    for event in session.events.iter_mut().flatten() {
        event.polarity = Polarity::from_bit(event.polarity == Polarity::Off);
    }
}

/// ON and OFF exchange their names; the analysis uses both alike.
#[test]
fn polarity_is_counted_and_nothing_else() {
    let mut relation = Relation::nothing_changes("polarity flipped", &flip_polarities);
    let counts = |path: &str| BASE.1[path].clone();
    let expect = |path: &mut String, figure: &mut Figure| {
        if let Some(view) = path.strip_suffix(".on_events") {
            if let Figure::Number(all) = counts(&format!("{view}.events")) {
                number(figure, |on| all - on);
            }
        } else if path.starts_with("pictures") || path.starts_with("zooms") {
            *path = exchanged(path, ".on", ".off");
        }
    };
    relation.expect = &expect;
    // Events at one time are in the order of their polarities, and random choices follow this order.
    relation.silent = &|kind| begins(kind, &["reduction.curves[].rows", "latency.reduced"]);
    relation.holds();
}

/// The path with `a` and `b` exchanged.
pub(super) fn exchanged(path: &str, a: &str, b: &str) -> String {
    path.replace(a, "\u{0}").replace(b, a).replace('\u{0}', b)
}

/// Every event twice, and every threshold on events twice as large: what thinning by two would undo.
#[test]
fn doubled_events_with_doubled_thresholds_give_the_same_positions() {
    let counts = [
        "presses[].views[].events",
        "presses[].views[].on_events",
        "presses[].views[].cluster_events",
        "presses[].views[].core_threshold",
        "presses[].views[].rate_per_s",
        "presses[].views[].idle_rate_per_s",
        "rates[].mean_per_s[]",
        "rates[].peak_per_s[]",
        "zooms[].on_per_s[]",
        "zooms[].off_per_s[]",
        "off_sensor[]",
        "locator.model.reference_events",
        "threshold.candidates[][]",
        "threshold.events",
    ];
    let is_count = |path: &str| {
        let kind = kind(path);
        counts.contains(&kind.as_str())
            || kind.starts_with("off_sensor[].")
            || kind.starts_with("bit_rates.") && !kind.contains("press_s") && !kind.ends_with(".n")
            || kind.ends_with("].on")
            || kind.contains(".pixels.") && !kind.ends_with("clustered")
    };
    let is_error = |path: &str| path.starts_with("threshold.candidates") && path.ends_with("[1]");
    let relation = Relation {
        name: "every event twice",
        change: &|session| {
            for events in &mut session.events {
                *events = events.iter().flat_map(|e| [*e, *e]).collect();
            }
            let settings = &mut session.input.settings;
            settings.min_samples *= 2;
            settings.background_margin = 0.0;
            settings.min_cluster_events *= 2;
        },
        expect: &|path, figure| {
            if path == "threshold.candidates[1][0]" {
                // One more event than the press with the fewest.
                number(figure, |n| 2.0 * (n - 1.0) + 1.0);
            } else if is_count(path) && path != "bit_rates.bits_per_event" && !is_error(path) {
                number(figure, |n| 2.0 * n);
            }
        },
        // Pairs of events at one time are no random arrivals to the detector and the thinning, the estimate of depth counts in
        // events, not in shares of them, a cell of the camera's picture is a text, and a warning names the doubled recording.
        silent: &|kind| {
            begins(
                kind,
                &[
                    "reduction",
                    "latency",
                    "indentation",
                    "activity[].counts",
                    "warnings",
                ],
            )
        },
        digits: &[],
    };
    relation.holds();
}
