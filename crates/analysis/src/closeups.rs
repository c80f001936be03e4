//! Selects presses for images, rate close-ups and event retention.

use skinrig_model::{Background, HostTime, PressId, PressRole};

use crate::accumulate::ZoomPlan;
use crate::input::SessionInput;
use crate::press_event_collector::RetentionPlan;
use crate::press_events::{EventView, Retention};
use crate::rates::drawn_bin_us;
use crate::result::ClockFit;
use crate::segment::Window;
use skinrig_statistics::seeded;

/// Scored presses with an image.
const PICTURES: usize = 6;
/// Scored presses with a rate close-up.
const ZOOMS: usize = 3;
/// Margin of a close-up before contact and after release, s.
const ZOOM_SIDE_S: f64 = 0.3;
/// Maximum number of bins in a close-up.
const MAX_ZOOM_BINS: usize = 2000;

/// Start of a kept view before contact, s: the published trial is 0.85 s on each side.
const KEPT_BEFORE_S: f64 = 1.0;
/// End of a kept view after contact, s, or 0.1 s after the press window, whichever is later.
const KEPT_AFTER_S: f64 = 0.9;
/// End of the background in the public code, after the middle of the press, s.
const BACKGROUND_AFTER_S: f64 = 2.4;
/// Random stream for choosing presses, separate from the bootstrap's.
const CHOICE: u64 = 0x6b65_7074;

/// Presses with images and rate close-ups.
pub(crate) struct Closeups {
    pub pictures: Vec<(usize, PressId)>,
    pub zooms: Vec<(usize, PressId)>,
    /// Rows whose events are kept, ascending.
    pub kept: Vec<usize>,
}

impl Closeups {
    /// Spreads them over the executed scored presses (over all presses if none scores) and over their locations: from each
    /// of equal parts of the session, the press nearest to its share of the locations. Equal steps alone would hit the same
    /// few locations in every repetition.
    pub(crate) fn choose(input: &SessionInput, keep: Retention) -> Self {
        let done = |scored: bool| -> Vec<(usize, PressId, u32)> {
            let rows = input.planned.iter().zip(&input.outcomes).enumerate();
            rows.filter(|(_, (p, _))| !scored || p.role == PressRole::Score)
                .filter(|(_, (_, o))| o.as_ref().is_some_and(|o| o.timing.is_some()))
                .map(|(row, (p, _))| (row, p.id, p.location.index()))
                .collect()
        };
        let mut candidates = done(true);
        if candidates.is_empty() {
            candidates = done(false);
        }
        let spaced = |most: usize| {
            let n = candidates.len();
            let count = most.min(n);
            let lowest = candidates.iter().map(|c| c.2).min().unwrap_or(0);
            let highest = candidates.iter().map(|c| c.2).max().unwrap_or(0);
            let part = |i: usize| {
                let share = (2 * i + 1) as f64 / (2 * count) as f64;
                let target = f64::from(lowest) + share * f64::from(highest - lowest);
                let away = |c: &&(usize, PressId, u32)| (f64::from(c.2) - target).abs();
                candidates[i * n / count..(i + 1) * n / count]
                    .iter()
                    .min_by(|a, b| away(a).total_cmp(&away(b)))
            };
            let chosen = (0..count).filter_map(part);
            chosen.map(|&(row, press, _)| (row, press)).collect()
        };
        Self {
            pictures: spaced(PICTURES),
            zooms: spaced(ZOOMS),
            kept: kept_rows(input, keep),
        }
    }
}

/// Random choice, so that it does not follow the rhythm of the plan.
fn kept_rows(input: &SessionInput, keep: Retention) -> Vec<usize> {
    let roles: &[PressRole] = match keep {
        Retention::Scored => &[PressRole::Score],
        Retention::All => &[PressRole::Score, PressRole::Calibrate],
    };
    let most = input.settings.study_presses as usize;
    let mut chosen: Vec<usize> = Vec::new();
    for &role in roles {
        let rows = input.planned.iter().zip(&input.outcomes).enumerate();
        let mut rows: Vec<usize> = rows
            .filter(|(_, (p, o))| p.role == role && o.as_ref().is_some_and(|o| o.timing.is_some()))
            .map(|(row, _)| row)
            .collect();
        let mut rng = seeded::generator(input.settings.seed, CHOICE);
        let count = most.min(rows.len());
        for i in 0..count {
            let other = i + seeded::index(&mut rng, rows.len() - i);
            rows.swap(i, other);
        }
        chosen.extend(&rows[..count]);
    }
    chosen.sort_unstable();
    chosen
}

/// Views to keep of one camera, sorted by start. `windows` are those of all presses.
pub(crate) fn keep_plans(
    input: &SessionInput,
    plan: &Closeups,
    windows: &[Window],
    clock: &ClockFit,
) -> Vec<RetentionPlan> {
    let seconds_after = |t: HostTime, s: f64| clock.camera_us_of_host(t) + s * 1e6;
    let mut plans: Vec<RetentionPlan> = windows
        .iter()
        .filter(|w| plan.kept.binary_search(&w.row).is_ok())
        .filter_map(|w| {
            let timing = input.outcomes[w.row].as_ref()?.timing?;
            let contact = clock.camera_us_of_host(timing.contact);
            let release = clock.camera_us_of_host(timing.release);
            let start = seconds_after(timing.contact, -KEPT_BEFORE_S).max(0.0) as u64;
            let start_us = start.min(w.start_us);
            let mut end = seconds_after(timing.contact, KEPT_AFTER_S).max(w.end_us as f64 + 1e5);
            if input.settings.latency.background == Background::After {
                end = end.max(0.5 * (contact + release) + BACKGROUND_AFTER_S * 1e6);
            }
            let within = |t_us: u64| u32::try_from(t_us.saturating_sub(start_us)).ok();
            Some(RetentionPlan {
                row: w.row,
                view: EventView {
                    start_us,
                    length_us: within(end.max(0.0) as u64)?,
                    window_us: (within(w.start_us)?, within(w.end_us)?),
                    idle_from_us: within(w.idle_start_us)?,
                    contact_us: contact - start_us as f64,
                    release_us: release - start_us as f64,
                    events: Vec::new(),
                },
            })
        })
        .collect();
    plans.sort_by_key(|p| (p.view.start_us, p.row));
    plans
}

/// Close-ups of one camera, sorted by start.
pub(crate) fn zoom_plans(input: &SessionInput, plan: &Closeups, clock: &ClockFit) -> Vec<ZoomPlan> {
    let bin_us = drawn_bin_us(&input.settings);
    let mut plans: Vec<ZoomPlan> = plan
        .zooms
        .iter()
        .filter_map(|&(row, press)| {
            let timing = input.outcomes[row].as_ref()?.timing?;
            let contact = clock.camera_us_of_host(timing.contact);
            let release = clock.camera_us_of_host(timing.release);
            let start_us = (contact - ZOOM_SIDE_S * 1e6).ceil().max(0.0) as u64;
            let length_us = (release + ZOOM_SIDE_S * 1e6 - start_us as f64).max(0.0);
            Some(ZoomPlan {
                press,
                start_us,
                bins: ((length_us / bin_us as f64).ceil() as usize).min(MAX_ZOOM_BINS),
                start_s: (start_us as f64 - contact) * 1e-6,
                release_s: (release - contact) * 1e-6,
            })
        })
        .collect();
    plans.sort_by_key(|p| p.start_us);
    plans
}
