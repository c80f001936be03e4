//! Owns the tables of the alignment certificate.

use skinrig_analysis::result::{Alignment, AlignmentStatus, Analysis};

use crate::document::Table;
use crate::format::{NONE, by_rates, number, sentence};

/// One row per map between two clocks.
pub(super) fn maps(a: &Analysis) -> Option<Table> {
    let certificate = &a.alignment;
    if certificate.maps.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "alignment",
        "Alignment certificate",
        &[
            "Clock map",
            "#drift (ppm)",
            "#residual, rms (µs)",
            "#largest (µs)",
            "#95 % interval at presses (µs)",
            "#systematic bound (µs)",
            "#held-out coverage (%)",
            "#points (left out)",
            "#pieces",
        ],
    );
    for map in &certificate.maps {
        let or_none =
            |value: Option<f64>, digits| value.map_or(NONE.to_owned(), |v| number(Some(v), digits));
        grid.row([
            map.map.name().to_owned(),
            or_none(map.drift_ppm, 3),
            or_none(map.residual_rms_us, 2),
            or_none(map.residual_max_us, 2),
            half_widths(map.interval_us, 2),
            half_widths(map.bound_us, 1),
            or_none(map.coverage.map(|share| 100.0 * share), 1),
            format!("{} ({})", map.n, map.rejected),
            map.pieces.to_string(),
        ]);
    }
    grid.note(words(certificate));
    if let Some(evidence) = &certificate.rates {
        grid.note(sentence(&by_rates(evidence)));
    }
    for warning in &certificate.warnings {
        grid.note(sentence(&warning.to_string()));
    }
    grid.note(
        "The 95 % interval covers the random error of trains and exchanges, assuming that both directions of an \
         exchange take equally long on average. The bound is in addition and covers systematic error. For host from \
         box it is certain, however a delay divides between the two directions, because the box reads its clock \
         between two host timestamps. For the cameras it covers the unknown mean delay of an edge, the 1 µs resolution \
         of both clocks, and possible rate changes outside the trains. Robot from host is the identity with a stated \
         delay. A constant delay of the trigger inputs cannot be detected here.",
    );
    Some(grid)
}

fn half_widths(of: Option<(f64, f64)>, digits: usize) -> String {
    of.map_or(NONE.to_owned(), |(usual, largest)| {
        format!(
            "± {} (largest {})",
            number(Some(usual), digits),
            number(Some(largest), digits)
        )
    })
}

/// One row per camera: edges sent, lost, doubled and spurious.
pub(super) fn lines(a: &Analysis) -> Option<Table> {
    let lines = &a.alignment.lines;
    if lines.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "trigger-lines",
        "Trigger inputs",
        &[
            "Camera",
            "#trains sent",
            "#trains seen",
            "#edges sent",
            "#lost",
            "#doubled",
            "#spurious",
        ],
    );
    for (k, line) in lines.iter().enumerate() {
        let share = |n: u64| format!("{n} ({} %)", number(Some(100.0 * line.share(n)), 2));
        grid.row([
            format!("camera {}", k + 1),
            line.trains_sent.to_string(),
            line.trains_seen.to_string(),
            line.sent.to_string(),
            share(line.lost),
            share(line.doubled),
            share(line.spurious),
        ]);
    }
    grid.note("All trains that the box sent while the camera was recording are counted.");
    for (k, line) in lines.iter().enumerate() {
        if line.trains_unrecorded > 0 {
            grid.note(format!(
                "Camera {}: {} further trains were sent while it was not recording.",
                k + 1,
                line.trains_unrecorded
            ));
        }
    }
    Some(grid)
}

/// The verdict in one sentence.
pub(crate) fn words(certificate: &Alignment) -> String {
    match certificate.status {
        AlignmentStatus::Valid => "Valid: every figure is within its limit.".to_owned(),
        AlignmentStatus::Invalid => {
            let why = certificate.violations.iter().map(ToString::to_string);
            format!("INVALID: {}.", why.collect::<Vec<_>>().join("; "))
        }
        AlignmentStatus::NotCertified => {
            "Not certified: the session has no usable reports of a trigger box.".to_owned()
        }
    }
}
