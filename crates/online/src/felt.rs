//! Touches felt while a session was recorded, compared with its analysis.

use skinrig_analysis::Analysis;
use skinrig_analysis::metrics::quantile;
use skinrig_analysis::result::{FeltReactions, FeltTouches, PressResult, Region, Spread};
use skinrig_model::{
    AttemptId, HostTime, PressId, PressOutcome, Reaction, TouchEstimate, TouchKind, TouchRegion,
};

use crate::detector::{Detection, Felt};
use crate::score::{DetectionScore, ScoredPress};
use crate::tip::{TipCourse, TipCourses};

const fn region(region: TouchRegion) -> Region {
    Region {
        semi_axes_mm: region.semi_axes_mm,
        angle_deg: region.angle_deg,
    }
}

fn us(t: HostTime) -> f64 {
    t.0 as f64 * 1e-3
}

fn spread(values: impl IntoIterator<Item = f64>) -> Spread {
    let mut values: Vec<f64> = values.into_iter().collect();
    Spread {
        n: values.len() as u32,
        median: quantile(&mut values, 0.5),
        p99: quantile(&mut values, 0.99),
    }
}

/// Vector from an estimate to the measured position, mm.
fn error(press: &PressResult, at: [f64; 2]) -> Option<[f64; 2]> {
    let truth = press.truth?;
    Some([truth.x_mm - at[0], truth.y_mm - at[1]])
}

fn detections(touches: &[TouchEstimate]) -> Vec<Detection> {
    let detection = |touch: &TouchEstimate| {
        let felt = match touch.kind {
            TouchKind::Onset => Felt::Onset,
            TouchKind::Withdrawn => Felt::Withdrawn,
            // After skipped bytes the skin counts as idle.
            TouchKind::Release | TouchKind::Skipped => Felt::Release,
            _ => return None,
        };
        let host_us = touch.until.0 / 1_000;
        Some(Detection {
            felt,
            host_us,
            since_us: host_us,
            llr: touch.llr.unwrap_or(0.0),
            near_mm: touch.at_mm.unwrap_or_default(),
        })
    };
    touches.iter().filter_map(detection).collect()
}

/// A press that was felt: its row, its onset, and the positions of that touch.
struct Sensed<'a> {
    press: &'a PressResult,
    contact_us: f64,
    onset: &'a TouchEstimate,
    positions: Vec<&'a TouchEstimate>,
}

impl<'a> Sensed<'a> {
    fn of(
        analysis: &'a Analysis,
        scored: &ScoredPress,
        touches: &'a [TouchEstimate],
    ) -> Option<Self> {
        let during = scored.contact_us - 1e3..scored.release_us;
        let is_onset =
            |t: &TouchEstimate| t.kind == TouchKind::Onset && during.contains(&us(t.until));
        let at = touches.iter().position(is_onset)?;
        let ends = |t: &&TouchEstimate| {
            !matches!(
                t.kind,
                TouchKind::Onset | TouchKind::Withdrawn | TouchKind::Release | TouchKind::Skipped
            )
        };
        let own = touches[at + 1..].iter().take_while(ends);
        Some(Self {
            press: &analysis.presses[scored.row],
            contact_us: scored.contact_us,
            onset: &touches[at],
            positions: own.filter(|t| t.kind == TouchKind::Position).collect(),
        })
    }

    /// Whether each region holds the measured position.
    fn inside(&self) -> Vec<bool> {
        let inside = |t: &&TouchEstimate| {
            let error = error(self.press, t.at_mm?)?;
            Some(region(t.region?).reach(error) <= 1.0)
        };
        self.positions.iter().filter_map(inside).collect()
    }

    /// Error of each depth and how far its interval reaches to each side, mm.
    fn depths(&self, tip: &TipCourse) -> Vec<(f64, f64)> {
        let depth = |t: &&TouchEstimate| {
            let depth = t.depth?;
            let error_mm = depth.mm - tip.reached_mm(us(t.until))?;
            Some((error_mm.abs(), depth.within_mm))
        };
        self.positions.iter().filter_map(depth).collect()
    }

    fn last(&self) -> Option<&TouchEstimate> {
        let located = self.positions.iter().rfind(|t| t.at_mm.is_some());
        located.copied()
    }
}

/// Compares `touches`, in the order of the record, with the analysis of the session, of which `tips` gives the depths of the scored
/// presses and `outcome` the last attempts; `None` if nothing was ever felt in it. Nothing is felt from `resumed` on, the start of the second leg.
#[must_use]
pub fn felt<'o>(
    analysis: &Analysis,
    touches: &[TouchEstimate],
    tips: &TipCourses,
    resumed: Option<HostTime>,
    outcome: impl Fn(PressId) -> Option<&'o PressOutcome>,
) -> Option<FeltTouches> {
    let from = touches.iter().find(|t| t.kind == TouchKind::Started)?.t;
    let all = ScoredPress::of(analysis);
    let until_us = resumed.map_or(f64::INFINITY, us);
    let (presses, outside): (Vec<ScoredPress>, Vec<ScoredPress>) = all
        .into_iter()
        .partition(|p| us(from) < p.contact_us && p.contact_us < until_us);
    let score = DetectionScore::new(&detections(touches), &presses);
    let was_felt = |p: &&ScoredPress| score.delays_ms.iter().any(|(row, _)| *row == p.row);
    let sensed: Vec<Sensed<'_>> = presses
        .iter()
        .filter(was_felt)
        .filter_map(|p| Sensed::of(analysis, p, touches))
        .collect();
    let held: Vec<bool> = sensed
        .iter()
        .map(Sensed::inside)
        .filter(|inside| !inside.is_empty())
        .map(|inside| inside.iter().all(|is| *is))
        .collect();
    let depths = sensed.iter().filter_map(|s| {
        let all = s.depths(tips.get(&s.press.press)?);
        (!all.is_empty()).then_some(all)
    });
    let depths: Vec<Vec<(f64, f64)>> = depths.collect();
    let last_depths = || depths.iter().filter_map(|all| all.last());
    let holds = |all: &&Vec<(f64, f64)>| all.iter().all(|(error, within)| error <= within);
    let last = || sensed.iter().filter_map(|s| Some((s, s.last()?)));
    let distance = |(s, t): (&Sensed<'_>, &TouchEstimate)| {
        let [x, y] = error(s.press, t.at_mm?)?;
        Some(libm::hypot(x, y))
    };
    let lags = touches.iter().filter(|t| is_of_events(t.kind));
    Some(FeltTouches {
        from_s: from.0 as f64 * 1e-9,
        presses: presses.len() as u32,
        outside: outside.len() as u32,
        felt: score.delays_ms.len() as u32,
        missed: score.missed as u32,
        alarmed: score.alarmed as u32,
        delay_ms: spread(sensed.iter().map(|s| (us(s.onset.t) - s.contact_us) * 1e-3)),
        lag_ms: spread(lags.map(|t| (us(t.t) - us(t.until)) * 1e-3)),
        false_alarms: score.false_alarms,
        at_risk_s: score.at_risk_s,
        error_mm: spread(last().filter_map(distance)),
        region_mm: spread(last().filter_map(|(_, t)| Some(t.region?.semi_axes_mm[0]))),
        with_regions: held.len() as u32,
        held: held.iter().filter(|held| **held).count() as u32,
        depth_error_mm: spread(last_depths().map(|(error, _)| *error)),
        depth_within_mm: spread(last_depths().map(|(_, within)| *within)),
        with_depths: depths.len() as u32,
        depths_held: depths.iter().filter(holds).count() as u32,
        reactions: reactions(analysis, &presses, touches, outcome),
        skipped: touches
            .iter()
            .filter(|t| t.kind == TouchKind::Skipped)
            .count() as u32,
    })
}

/// How an attempt reacted.
fn reaction_of(
    touches: &[TouchEstimate],
    reaction: Reaction,
    attempt: AttemptId,
) -> Option<&TouchEstimate> {
    let own = |t: &&TouchEstimate| t.kind == reaction.kind() && t.attempt == Some(attempt);
    touches.iter().rfind(own)
}

const fn is_of_events(kind: TouchKind) -> bool {
    matches!(
        kind,
        TouchKind::Onset | TouchKind::Position | TouchKind::Withdrawn | TouchKind::Release
    )
}

fn reactions<'o>(
    analysis: &Analysis,
    presses: &[ScoredPress],
    touches: &[TouchEstimate],
    outcome: impl Fn(PressId) -> Option<&'o PressOutcome>,
) -> Option<FeltReactions> {
    // A press that lifts on the way down first brakes.
    let reaction = [Reaction::Lift, Reaction::Stop]
        .into_iter()
        .find(|reaction| touches.iter().any(|t| t.kind == reaction.kind()))?;
    let of_press = |scored: &ScoredPress| {
        let press = &analysis.presses[scored.row];
        // The last attempt is the one that counts; an earlier one may have reacted where it did not.
        let counted = outcome(press.press)?.attempt;
        let own = reaction_of(touches, reaction, counted)?;
        Some((press, scored.contact_us, own))
    };
    let all: Vec<_> = presses.iter().filter_map(of_press).collect();
    let late_ms =
        |(_, contact_us, t): &(&PressResult, f64, &TouchEstimate)| (us(t.t) - contact_us) * 1e-3;
    let inside: Vec<bool> = all
        .iter()
        .filter_map(|(press, _, t)| Some(region(t.region?).reach(error(press, t.at_mm?)?) <= 1.0))
        .collect();
    Some(FeltReactions {
        reaction,
        reaction_ms: spread(all.iter().map(late_ms)),
        since_event_ms: spread(all.iter().map(|(_, _, t)| (us(t.t) - us(t.until)) * 1e-3)),
        depth_mm: spread(
            all.iter()
                .filter_map(|(press, ..)| outcome(press.press)?.measured_depth_mm),
        ),
        early: all
            .iter()
            .filter(|a| late_ms(a) < 0.0)
            .map(|a| a.0.press)
            .collect(),
        regions: (
            inside.len() as u32,
            inside.iter().filter(|is| **is).count() as u32,
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A retaken press that was not felt again went to its depth, and did not react.
    #[test]
    fn the_reaction_of_an_earlier_attempt_is_none_of_the_last() {
        let attempt = |number| AttemptId {
            press: PressId::from_index(4),
            number,
        };
        let stopped = TouchEstimate {
            t: HostTime(2_000_000),
            until: HostTime(1_000_000),
            until_sd_ns: 0,
            kind: TouchKind::Stopped,
            attempt: Some(attempt(1)),
            at_mm: None,
            region: None,
            depth: None,
            llr: None,
        };
        let of = |number| reaction_of(&[stopped], Reaction::Stop, attempt(number)).copied();
        assert_eq!(of(1), Some(stopped));
        assert_eq!(of(2), None);
    }
}
