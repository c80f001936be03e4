//! Fits the clock to coded trigger marks: sent marks, matched by name with those that the camera saw.

use std::collections::BTreeMap;

use skinrig_model::pulse::{LOOPBACK, decode_marks};
use skinrig_model::{Mark, SentMark, TriggerEdge};

use super::error::MarksError;
use super::line::{self, Pair};
use super::{NO_CLOCK_DRIFT, NO_TIME_US};
use crate::result::{ClockFit, ClockMethod, WarningCause};
use crate::timebase::{Point, STEP_US, SmoothMap};

/// Lower bound of the residual scale, µs: the camera's clock ticks in µs.
const FLOOR_US: f64 = 1.0;
/// A repeated mark matches one within this distance of its predicted time, µs.
const NEAR_US: f64 = 50_000.0;
/// Residuals above this are suspicious, µs: three orders of magnitude above the resolution of the trigger input.
const SUSPICIOUS_RMS_US: f64 = 100.0;

/// A clock fit from marks, with its warnings.
#[derive(Debug, Clone, PartialEq)]
pub struct MarksFit {
    /// The fit.
    pub fit: ClockFit,
    /// Warnings about this camera.
    pub warnings: Vec<WarningCause>,
    /// Host times of the marks used by the fit, ascending, µs.
    pub seen_us: Vec<f64>,
}

/// Fits a camera's clock from the edges on its trigger channel and the marks that were sent.
///
/// Marks sent or seen several times (a repeated attempt sends the same name again) are matched by time after the others have given a first fit.
///
/// # Errors
/// [`MarksError`] if fewer than three marks match, if they are not on the line of a clock, or if their camera times are beyond
/// 2^62 µs. The session must then be aligned by its presses.
pub fn fit_marks(
    edges: &[TriggerEdge],
    channel: u8,
    sent: &[SentMark],
) -> Result<MarksFit, MarksError> {
    let on_channel: Vec<TriggerEdge> = edges
        .iter()
        .copied()
        .filter(|e| e.channel == channel)
        .collect();
    let mut decoded = decode_marks(&on_channel);
    decoded.marks.retain(|m| m.mark != LOOPBACK); // test of the line before the run
    let mut sent_by: BTreeMap<Mark, Vec<f64>> = BTreeMap::new();
    for mark in sent {
        let host_us = mark.t.0 as f64 * 1e-3;
        sent_by.entry(mark.mark).or_default().push(host_us);
    }
    let mut seen_by: BTreeMap<Mark, Vec<u64>> = BTreeMap::new();
    for mark in &decoded.marks {
        seen_by.entry(mark.mark).or_default().push(mark.t_us);
    }
    // Camera times relative to the first mark, exactly, so that large counters lose no digits.
    let reference = decoded.marks.first().ok_or(MarksError::NoneSeen)?.t_us;
    if let Some(mark) = decoded.marks.iter().find(|m| m.t_us >= NO_TIME_US) {
        return Err(MarksError::BrokenTimeBase { t_us: mark.t_us });
    }
    let relative = |t_us: u64| t_us.wrapping_sub(reference) as i64 as f64;

    let mut pairs = Vec::new();
    let mut repeated = Vec::new();
    for (mark, hosts) in &sent_by {
        let Some(cameras) = seen_by.get(mark) else {
            continue;
        };
        if let ([host_us], [camera]) = (hosts.as_slice(), cameras.as_slice()) {
            pairs.push(Pair {
                host_us: *host_us,
                camera_us: relative(*camera),
            });
        } else {
            repeated.push((hosts, cameras));
        }
    }
    if pairs.len() < 3 {
        // Hardly any unique names: rely on the order, which requires that none is missing.
        for (hosts, cameras) in repeated.iter().filter(|(h, c)| h.len() == c.len()) {
            pairs.extend(hosts.iter().zip(cameras.iter()).map(|(h, c)| Pair {
                host_us: *h,
                camera_us: relative(*c),
            }));
        }
    } else {
        let first = line::fit(&pairs, FLOOR_US)?;
        for (hosts, cameras) in &repeated {
            for host_us in hosts.iter() {
                let predicted = first.offset_us + host_us + first.drift * host_us;
                let nearest = cameras
                    .iter()
                    .map(|c| relative(*c))
                    .min_by(|a, b| (a - predicted).abs().total_cmp(&(b - predicted).abs()));
                if let Some(camera_us) = nearest.filter(|c| (c - predicted).abs() < NEAR_US) {
                    pairs.push(Pair {
                        host_us: *host_us,
                        camera_us,
                    });
                }
            }
        }
    }
    let line = line::fit(&pairs, FLOOR_US)?;
    if line.drift.abs() > NO_CLOCK_DRIFT {
        return Err(MarksError::Drift {
            drift_ppm: line.drift * 1e6,
            most_ppm: NO_CLOCK_DRIFT * 1e6,
        });
    }
    let fit = ClockFit {
        method: ClockMethod::TriggerMarks,
        offset_us: reference as f64 + line.offset_us,
        drift_ppm: line.drift * 1e6,
        drift_se_ppm: drift_se(&pairs).unwrap_or(line.drift_se) * 1e6,
        residual_rms_us: line.rms_us,
        residual_max_us: line.max_us,
        n: line.n() as u32,
        rejected: (decoded.marks.len().max(pairs.len()) - line.n()) as u32,
    };
    let used = pairs.iter().zip(&line.used).filter(|(_, used)| **used);
    let mut seen_us: Vec<f64> = used.map(|(pair, _)| pair.host_us).collect();
    seen_us.sort_by(f64::total_cmp);
    let mut warnings = Vec::new();
    if line.rms_us > SUSPICIOUS_RMS_US {
        let rms_us = line.rms_us;
        warnings.push(WarningCause::MarksScatter { rms_us });
    }
    if fit.rejected > 0 {
        warnings.push(WarningCause::MarksRejected {
            rejected: fit.rejected,
            of: decoded.marks.len(),
        });
    }
    let unseen = sent.len().saturating_sub(decoded.marks.len());
    if unseen > 0 {
        let of = sent.len();
        warnings.push(WarningCause::MarksUnseen { unseen, of });
    }
    if decoded.stray_edges > 0 {
        let edges = decoded.stray_edges;
        warnings.push(WarningCause::StrayEdges { edges, channel });
    }
    Ok(MarksFit {
        fit,
        warnings,
        seen_us,
    })
}

/// Standard error of the mean rate, including the wander of the clocks and of the host's estimates of the marks.
fn drift_se(pairs: &[Pair]) -> Option<f64> {
    let mut points: Vec<Point> = pairs
        .iter()
        .map(|p| Point::new(p.host_us, p.camera_us))
        .collect();
    points.sort_by(|a, b| a.from_us.total_cmp(&b.from_us));
    let fit = SmoothMap::fit(&points, STEP_US, FLOOR_US)?;
    Some(fit.drift.stated_se())
}
