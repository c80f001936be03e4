//! What the trigger box told, cut at its resets: within an epoch its clock goes on without a break.

use std::collections::BTreeMap;

use skinrig_model::{BoxReport, Label, PulseTrain};

/// An exchange of time: `sent <= box time <= received`, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tie {
    pub sent_us: f64,
    pub received_us: f64,
    /// What the box's clock showed, relative to [`Epoch::reference_us`]; it shows whole µs.
    pub box_us: f64,
}

/// A train that the box sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sent {
    pub label: Label,
    pub train: PulseTrain,
    /// The first rising edge on the box's clock, relative to [`Epoch::reference_us`].
    pub box_us: f64,
    /// No other train of the session has this label.
    pub unique: bool,
}

/// Reports between two resets.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Epoch {
    /// Box time to which all others are relative, µs.
    pub reference_us: u64,
    /// In time order.
    pub ties: Vec<Tie>,
    /// In time order.
    pub trains: Vec<Sent>,
}

/// The epochs of a session in order; those without any train or exchange are left out.
pub fn epochs(reports: &[BoxReport]) -> Vec<Epoch> {
    let mut times: BTreeMap<Label, u32> = BTreeMap::new();
    for report in reports {
        if let Some((label, _)) = train_of(report) {
            *times.entry(label).or_default() += 1;
        }
    }
    let parts = reports.split(|r| matches!(r, BoxReport::Reset { .. }));
    parts.filter_map(|part| epoch(part, &times)).collect()
}

fn train_of(report: &BoxReport) -> Option<(Label, u64)> {
    match *report {
        BoxReport::Mark { mark, at } => Some((Label::Mark(mark), at.us)),
        BoxReport::Sync { count, at } => Some((Label::Sync(count), at.us)),
        _ => None,
    }
}

fn epoch(part: &[BoxReport], times: &BTreeMap<Label, u32>) -> Option<Epoch> {
    let reference_us = part.iter().find_map(|r| match *r {
        BoxReport::Exchange { at, .. } => Some(at.us),
        _ => train_of(r).map(|(_, us)| us),
    })?;
    let relative = |us: u64| us.wrapping_sub(reference_us) as i64 as f64;
    let mut out = Epoch {
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
            out.trains.push(Sent {
                label,
                train,
                box_us: relative(us),
                unique: times.get(&label) == Some(&1),
            });
        }
    }
    out.ties.sort_by(|a, b| a.box_us.total_cmp(&b.box_us));
    out.trains.sort_by(|a, b| a.box_us.total_cmp(&b.box_us));
    Some(out)
}
