//! Reports of the trigger box, split at its resets: within an epoch its clock is continuous.

use std::collections::BTreeMap;

use skinrig_model::{BoxReport, Label, PulseTrain};

use crate::leg::{LegStart, leg_at};

/// A time exchange: `sent <= box time <= received`, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tie {
    pub sent_us: f64,
    pub received_us: f64,
    /// Box clock relative to [`Epoch::reference_us`]; resolution 1 µs.
    pub box_us: f64,
}

/// A train that the box sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SentTrain {
    pub label: Label,
    pub train: PulseTrain,
    /// First rising edge on the box's clock, relative to [`Epoch::reference_us`].
    pub box_us: f64,
    /// True if no other train of its leg has this label.
    pub unique: bool,
}

/// Reports between two resets.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Epoch {
    /// Its leg (0: the first).
    pub leg: usize,
    /// Reference of all box times, µs.
    pub reference_us: u64,
    /// In time order.
    pub ties: Vec<Tie>,
    /// In time order.
    pub trains: Vec<SentTrain>,
}

/// Epochs of a session in order, without empty ones. Every further leg begins with a reset at its origin.
pub(crate) fn epochs(reports: &[BoxReport], legs: &[LegStart]) -> Vec<Epoch> {
    let mut leg = 0;
    let mut parts = Vec::new();
    for part in reports.split_inclusive(|r| matches!(r, BoxReport::Reset { .. })) {
        parts.push((leg, part));
        if let Some(BoxReport::Reset { noticed }) = part.last() {
            leg = leg_at(legs, *noticed);
        }
    }
    // Labels may repeat in every leg; trains are searched among the edges of their own leg.
    let mut times: BTreeMap<(usize, Label), u32> = BTreeMap::new();
    for (leg, part) in &parts {
        for (label, _) in part.iter().filter_map(train_of) {
            *times.entry((*leg, label)).or_default() += 1;
        }
    }
    let each = parts.into_iter();
    each.filter_map(|(leg, part)| epoch(part, leg, &times))
        .collect()
}

fn train_of(report: &BoxReport) -> Option<(Label, u64)> {
    match *report {
        BoxReport::Mark { mark, at } => Some((Label::Mark(mark), at.us)),
        BoxReport::Sync { count, at } => Some((Label::Sync(count), at.us)),
        _ => None,
    }
}

fn epoch(part: &[BoxReport], leg: usize, times: &BTreeMap<(usize, Label), u32>) -> Option<Epoch> {
    let reference_us = part.iter().find_map(|r| match *r {
        BoxReport::Exchange { at, .. } => Some(at.us),
        _ => train_of(r).map(|(_, us)| us),
    })?;
    let relative = |us: u64| us.wrapping_sub(reference_us) as i64 as f64;
    let mut out = Epoch {
        leg,
        reference_us,
        ..Epoch::default()
    };
    for report in part {
        if let BoxReport::Exchange { sent, received, at } = *report {
            out.ties.push(Tie {
                sent_us: sent.0 as f64 * 1e-3,
                received_us: received.0 as f64 * 1e-3,
                box_us: relative(at.us),
            });
        } else if let Some((label, us)) = train_of(report)
            && let Some(train) = PulseTrain::of(label)
        {
            out.trains.push(SentTrain {
                label,
                train,
                box_us: relative(us),
                unique: times.get(&(leg, label)) == Some(&1),
            });
        }
    }
    out.ties.sort_by(|a, b| a.box_us.total_cmp(&b.box_us));
    out.trains.sort_by(|a, b| a.box_us.total_cmp(&b.box_us));
    Some(out)
}
