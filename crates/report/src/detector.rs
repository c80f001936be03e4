//! Owns remarks on the latency detector: choice of its threshold, false detections.

use skinrig_analysis::result::Latency;

use crate::format::number;

/// The choice of a threshold h, and the range it came from.
struct ThresholdChoice {
    /// Data that the detector saw, as in "with all events".
    data: String,
    /// Prefix of the protocol keys.
    key: &'static str,
    /// First and last candidate.
    range: (f64, f64),
    chosen: Option<f64>,
    detected_rate: Option<f64>,
    target_rate: f64,
}

impl ThresholdChoice {
    /// Warnings when no candidate reaches the target rate, or the chosen one is at the end of the range.
    fn remarks(&self) -> Vec<String> {
        let Self { data, key, .. } = self;
        let (first, last) = self.range;
        let Some(chosen) = self.chosen else {
            return vec![format!(
                "with {data} no threshold h from {first} to {last} detects anything"
            )];
        };
        let mut out = Vec::new();
        let detected = self.detected_rate.unwrap_or(0.0);
        if detected < self.target_rate {
            out.push(format!(
                "with {data} no threshold h from {first} to {last} detects {:.0} % of the trials, the target rate: h \
                 {chosen} detects most, {:.1} % ({key}.target_rate)",
                100.0 * self.target_rate,
                100.0 * detected
            ));
        }
        let edge = match chosen {
            _ if first >= last => None,
            h if h <= first => Some(("lowest", "a lower one may detect more")),
            h if h >= last => Some(("highest", "a higher one may have fewer false alarms")),
            _ => None,
        };
        out.extend(edge.map(|(end, better)| {
            format!(
                "with {data} the chosen threshold, h {chosen}, is the {end} candidate: {better} ({key}.thresholds)"
            )
        }));
        out
    }
}

/// False detections listed individually.
const MAX_LISTED: usize = 8;

/// Presses whose detector fired before contact, with the time; `None` without any.
pub(crate) fn false_detections(l: &Latency) -> Option<String> {
    let all = &l.false_detections;
    let named = all.iter().take(MAX_LISTED);
    let named = named.map(|(press, ms)| format!("{press} at {} ms", number(Some(*ms), 0)));
    let mut list = named.collect::<Vec<_>>().join(", ");
    if all.len() > MAX_LISTED {
        list += &format!(" and {} more", all.len() - MAX_LISTED);
    }
    (!all.is_empty()).then_some(list)
}

/// Warnings about the thresholds chosen for all and for thinned events; none if both are inside their range and reach the
/// target rate.
pub(crate) fn remarks(l: &Latency) -> Vec<String> {
    let chosen = l.chosen.and_then(|i| l.sweep.get(i as usize));
    let all = ThresholdChoice {
        data: "all events".to_owned(),
        key: "analysis.latency",
        range: (l.settings.thresholds.from, l.settings.thresholds.to),
        chosen: chosen.map(|r| r.threshold),
        detected_rate: chosen.map(|r| r.detected_rate),
        target_rate: l.settings.target_rate,
    };
    let few = l.reduced.as_ref().map(|r| ThresholdChoice {
        data: format!("1/{} of the events", r.factor),
        key: "analysis.latency.reduced",
        range: (r.thresholds.from, r.thresholds.to),
        chosen: r.threshold,
        detected_rate: r.detected_rate.value,
        target_rate: r.target_rate,
    });
    // Without trials no threshold was tried.
    let tried = (l.trials > 0).then_some(all).into_iter();
    let few = few.filter(|_| l.trials > 0);
    tried.chain(few).flat_map(|c| c.remarks()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(chosen: Option<f64>, detected_rate: f64) -> ThresholdChoice {
        ThresholdChoice {
            data: "1/1024 of the events".to_owned(),
            key: "analysis.latency.reduced",
            range: (3.0, 8.0),
            chosen,
            detected_rate: Some(detected_rate),
            target_rate: 0.85,
        }
    }

    #[test]
    fn a_missed_target_and_both_ends_of_the_grid_are_said() {
        let text = |chosen, rate| choice(chosen, rate).remarks().join("; ");
        assert_eq!(text(Some(5.0), 0.85), "");
        let low = text(Some(3.0), 0.712);
        assert!(low.contains("85 %") && low.contains("71.2 %"), "{low}");
        assert!(low.contains("the lowest candidate"), "{low}");
        let high = text(Some(8.0), 0.9);
        assert!(high.contains("the highest candidate"), "{high}");
        assert!(!high.contains("no threshold"), "{high}");
        assert!(text(None, 0.0).contains("detects anything"));
        let mut one = choice(Some(3.0), 0.9);
        one.range = (3.0, 3.0);
        assert!(one.remarks().is_empty());
    }
}
