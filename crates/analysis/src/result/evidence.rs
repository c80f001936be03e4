//! Owns the evidence of an audit finding: what was expected and what was found, with numbers and n.

use serde::{Deserialize, Serialize};
use skinrig_model::{CameraId, InvalidReason, PressId, RepetitionId};

use super::evidence_parts::{
    FittingPlan, OnsetHeight, PeakForce, Response, SeenMarks, Silence, in_degrees, joined, noise,
    times, zoomed,
};
use super::other_reading::OtherReading;
use crate::with_text::with_text;

/// Above this share of the error of a constant guess (mean position), an RMSE says nothing about the skin: cameras, positions or
/// times are not what they seem, or the skin is dead.
pub(crate) const MOST_OF_GUESS: f64 = 0.7;

/// What was expected and what was found. In JSON `kind`, fields, and `text`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum Evidence {
    /// The journal's times or rows cannot all be true.
    #[error(
        "expected each press once, its moments in order and after the last press's, found {disordered} of {presses} \
         presses with moments out of order, {negative} before the session, {overlapping} overlapping another, {doubled} \
         listed twice"
    )]
    JournalContradictory {
        /// Presses with times.
        presses: usize,
        /// Presses with moments out of order.
        disordered: u32,
        /// Presses before the session.
        negative: u32,
        /// Presses that overlap another.
        overlapping: usize,
        /// Rows of the plan whose press is in another row.
        doubled: usize,
    },
    /// Neither camera has events.
    #[error(
        "expected events of two cameras, found none of either (the kinematic simulation makes none)"
    )]
    NoEventsOfEither,
    /// A camera has no events.
    #[error("expected events of {camera}, found none in the whole recording")]
    NoEvents {
        /// The camera.
        camera: CameraId,
    },
    /// A camera has no events in the rows of the crop.
    #[error(
        "expected events of {camera} in rows {first_row} to {last_row}, found none there and {elsewhere} elsewhere"
    )]
    NoEventsInCrop {
        /// The camera.
        camera: CameraId,
        /// First row of the crop.
        first_row: u16,
        /// Last row of the crop.
        last_row: u16,
        /// Events in other rows.
        elsewhere: u64,
    },
    /// Presses without measured position or times.
    #[error(
        "expected a measured time and position of each press done, found {without_position} of {presses} without a \
         position and {without_times} of {presses} without times"
    )]
    NoTruth {
        /// Presses done.
        presses: usize,
        /// Presses without a position.
        without_position: usize,
        /// Presses without times.
        without_times: usize,
    },
    /// The plan has no presses.
    #[error("expected presses other than sync presses in the plan, found none")]
    NoPlannedPress,
    /// Presses that were never attempted.
    #[error("expected {planned} presses, found {missed} never attempted")]
    PressesMissed {
        /// Planned presses.
        planned: u32,
        /// Presses never attempted.
        missed: u32,
    },
    /// Trigger marks that did not arrive.
    #[error("expected the {sent} marks sent on trigger channel {channel}, found {}", joined(.seen, " and "))]
    MarksLost {
        /// Marks sent.
        sent: usize,
        /// Trigger channel.
        channel: u8,
        /// Cameras that lack marks.
        seen: Vec<SeenMarks>,
    },
    /// Silence during presses.
    #[error("expected events at all times, noise as before, found none {}: {presses} presses are not recorded", joined(.silences, ", "))]
    Silence {
        /// Silent periods.
        silences: Vec<Silence>,
        /// Presses in them.
        presses: usize,
    },
    /// The measured positions do not match the size of a skin.
    #[error(
        "expected measured positions on a skin of {skin_mm} mm, found them {extent_mm:.3} mm wide with {beside} of \
         {presses} beside it"
    )]
    Extent {
        /// Longer side of the skin, mm.
        skin_mm: f64,
        /// Extent of the positions, mm.
        extent_mm: f64,
        /// Positions beside the skin.
        beside: usize,
        /// Positions.
        presses: usize,
    },
    /// The measured positions are not the planned ones.
    #[error(
        "expected measured positions within {limit_mm} mm of the planned ones, found them {off_mm:.2} mm off in the \
         median{} (n {presses})",
        .fits.map_or_else(String::new, |fits| format!(", and {:.3} mm {}", fits.off_mm, fits.plan))
    )]
    OffPlan {
        /// Maximum median distance, mm.
        limit_mm: f64,
        /// Median distance, mm.
        off_mm: f64,
        /// Another plan that matches.
        fits: Option<FittingPlan>,
        /// Measured presses.
        presses: usize,
    },
    /// The measured depths are not the commanded ones.
    #[error(
        "expected the commanded depths within {limit_mm} mm, found {wrong} of {presses} off, {off_mm:+.2} mm in the median"
    )]
    OffDepth {
        /// Limit of shallow presses, mm.
        limit_mm: f64,
        /// Presses beyond it.
        wrong: usize,
        /// Presses with a measured depth.
        presses: usize,
        /// Median of measured minus planned depth, mm.
        off_mm: f64,
    },
    /// Indentations of equal depth take different times.
    #[error(
        "expected indentations of equal depth to take equal time, found {wrong} of {presses} off by more than a factor of \
         {factor}"
    )]
    UnequalTimes {
        /// Presses beyond the factor.
        wrong: usize,
        /// Presses with times.
        presses: usize,
        /// Maximum ratio to the median.
        factor: f64,
    },
    /// The journal calls presses invalid.
    #[error(
        "expected presses as planned, found {wrong} of {presses} that the journal calls invalid, the first one: {first}"
    )]
    JournalInvalid {
        /// Invalid presses.
        wrong: usize,
        /// Presses seen.
        presses: usize,
        /// Why the first one is.
        first: InvalidReason,
    },
    /// Events begin before the tip reaches the surface.
    #[error(
        "expected events to begin when the tip reaches the surface, found them begin above it in the median: {} (camera 1), \
         {} (camera 2). Presses were that much deeper than is stated: the robot reports its tip higher than it is, or the \
         surface lies higher than z = 0 of the skin's frame",
        .heights[0], .heights[1]
    )]
    EarlyEvents {
        /// Camera 1 and camera 2.
        heights: [OnsetHeight; 2],
    },
    /// Sync presses at other times.
    #[error(
        "expected sync presses at {} s from the first press of the path, found presses at {} s",
        times(.planned_s), if .found_s.is_empty() { "no".to_owned() } else { times(.found_s) }
    )]
    SyncTimes {
        /// Planned contacts, from the first press of the path, s.
        planned_s: Vec<f64>,
        /// Presses found, s.
        found_s: Vec<f64>,
    },
    /// Presses that the list does not have.
    #[error(
        "expected the {listed} presses of the list, found {more} more in both cameras, from {from_s:.0} s to {to_s:.0} s of \
         the schedule"
    )]
    Unlisted {
        /// Presses of the list.
        listed: usize,
        /// Further presses.
        more: usize,
        /// First of them on the host clock, s.
        from_s: f64,
        /// Last of them, s.
        to_s: f64,
    },
    /// Neither camera responds to presses.
    #[error(
        "expected events to burst in presses, found {:.1} standard errors above idle in the median of {} (camera 1) and \
         {:.1} of {} (camera 2){}{}{}",
        .responses[0].sigmas, .responses[0].presses, .responses[1].sigmas, .responses[1].presses,
        if *.burst_elsewhere { "; both cameras burst at other times" } else { "" },
        noise(*.noise_per_s),
        .force.map_or_else(String::new, |force| format!(
            "; largest force of a press {:.2} N in the median (n {})", force.median_n, force.presses
        ))
    )]
    NoResponseOfEither {
        /// Camera 1 and camera 2.
        responses: [Response; 2],
        /// True if both cameras have bursts at other times.
        burst_elsewhere: bool,
        /// Noise of both cameras before presses, events per second; `None` if one has none, or if they have bursts.
        noise_per_s: Option<[f64; 2]>,
        /// Largest force of a press, if the robot reports forces and the cameras send only noise.
        force: Option<PeakForce>,
    },
    /// A camera does not respond to presses.
    #[error(
        "expected events to burst in presses, found {:.1} standard errors above idle in the median of {} ({camera}){}",
        .response.sigmas, .response.presses,
        .rates_per_s.map_or_else(String::new, |[press, idle]| format!(
            "; median rate {press:.0} events/s in presses, {idle:.0} before them"
        ))
    )]
    NoResponse {
        /// The camera.
        camera: CameraId,
        /// Its response.
        response: Response,
        /// Median rates during and before presses, events per second.
        rates_per_s: Option<[f64; 2]>,
    },
    /// A run of presses without bursts in both cameras.
    #[error(
        "expected a burst of events in each press, found none in either camera from {first} to {last}{}",
        noise(*.noise_per_s)
    )]
    NoBurstsOfEither {
        /// First press.
        first: PressId,
        /// Last press.
        last: PressId,
        /// Noise of both cameras before these presses, events per second.
        noise_per_s: Option<[f64; 2]>,
    },
    /// A run of presses without bursts in one camera.
    #[error(
        "expected a burst of events in each press, found none of {camera} from {first} to {last}"
    )]
    NoBursts {
        /// The camera.
        camera: CameraId,
        /// First press.
        first: PressId,
        /// Last press.
        last: PressId,
    },
    /// The bursts of a camera are at the presses if shifted.
    #[error(
        "expected the bursts of {camera} at the presses, found {here} of {presses} presses with one, and {there} of them \
         {shift_s:+.2} s later: odds of e^{log_odds:.0} ({bursts} bursts)"
    )]
    ShiftedBursts {
        /// The camera.
        camera: CameraId,
        /// Presses.
        presses: usize,
        /// Presses with a burst.
        here: usize,
        /// Presses with a burst after the shift.
        there: usize,
        /// The shift, s.
        shift_s: f64,
        /// Log odds (natural) against no shift.
        log_odds: f64,
        /// Bursts.
        bursts: usize,
    },
    /// A camera's clock steps within the session.
    #[error(
        "expected the clock of {camera} to run evenly, found it step by about {step_s:+.1} s between {last} and {first}, at \
         {at_s:.0} s: with the step {explained} of {presses} presses have a burst, without it {one_offset}{}",
        if *.both { "; the other camera likewise" } else { "" }
    )]
    ClockStep {
        /// The camera with these numbers.
        camera: CameraId,
        /// True if the other camera likewise.
        both: bool,
        /// Last press before the step.
        last: PressId,
        /// First press after it.
        first: PressId,
        /// Contact of that press on the host clock, s.
        at_s: f64,
        /// Size, s, known up to whole periods of the presses; positive if later events have later times.
        step_s: f64,
        /// Presses with a burst at the offset of their side of the step.
        explained: usize,
        /// Presses with a burst at the best single offset.
        one_offset: usize,
        /// Presses.
        presses: usize,
    },
    /// A camera's clock steps between two trigger marks.
    #[error(
        "expected the clock of {camera} to run evenly, found it step by {step_ms:+.1} ms between the trigger marks at \
         {from_s:.1} s and {to_s:.1} s (n {marks} marks)"
    )]
    MarksStep {
        /// The camera.
        camera: CameraId,
        /// Size, ms; positive if later events have later times.
        step_ms: f64,
        /// Last mark before the step on the host clock, s.
        from_s: f64,
        /// First mark after it, s.
        to_s: f64,
        /// Marks compared.
        marks: usize,
    },
    /// Both cameras see the same columns.
    #[error(
        "expected different columns in the two cameras, found the same column, within {within_px} px, in {same} of \
         {presses} presses"
    )]
    SameColumns {
        /// Maximum difference of equal columns, px.
        within_px: f64,
        /// Presses with equal columns.
        same: usize,
        /// Presses with both columns.
        presses: usize,
    },
    /// Another reading of the session explains the columns.
    #[error(
        "expected columns on the viewing angles of the presses, found them {} off as the session is and {} off with \
         {reading}: odds of e^{log_odds:.0} (n {places} places)",
        in_degrees(.off_deg), in_degrees(.other_off_deg)
    )]
    OtherReading {
        /// Deviation of each camera as recorded, degrees.
        off_deg: [Option<f64>; 2],
        /// The same with the other reading, degrees.
        other_off_deg: [Option<f64>; 2],
        /// The other reading.
        reading: OtherReading,
        /// Log odds (natural) against the session as recorded.
        log_odds: f64,
        /// Distinct locations.
        places: usize,
    },
    /// From some press on, the columns are those of other rows.
    #[error(
        "expected columns on the viewing angles of their own presses, found those of {presses} presses from {from} on at the \
         position {rows:+} rows later: odds of e^{log_odds:.0}"
    )]
    ShiftedRest {
        /// First press.
        from: PressId,
        /// Rows later.
        rows: i32,
        /// Log odds (natural) against no shift.
        log_odds: f64,
        /// Presses in a row, from the first one on.
        presses: usize,
    },
    /// Some rows of the list are in another order.
    #[error(
        "expected columns on the viewing angles of their own presses, found {rows} presses between {from} and {to} at the \
         positions of other rows of the list: odds of e^{log_odds:.0}"
    )]
    RearrangedRows {
        /// First press of the rows.
        from: PressId,
        /// Last press of the rows.
        to: PressId,
        /// Rows seen at the position of another row.
        rows: usize,
        /// Log odds (natural) against the list as it is.
        log_odds: f64,
    },
    /// The columns are unrelated to the order of the list.
    #[error(
        "expected columns on the viewing angles of the presses, found them {} off, no better than in random order, while \
         the located presses cover the area of the list (n {places} locations)",
        in_degrees(.off_deg)
    )]
    RandomOrder {
        /// Deviation of each camera, degrees.
        off_deg: [Option<f64>; 2],
        /// Distinct locations.
        places: usize,
    },
    /// The columns of a camera are unrelated to the positions.
    #[error(
        "expected columns on the viewing angles of the presses, found them {off_deg:.1} degrees off where a blind guess \
         gives {guess_deg:.1} ({camera}, n {places} locations), and no other reading of the session explains them"
    )]
    Unrelated {
        /// The camera.
        camera: CameraId,
        /// Deviation, degrees.
        off_deg: f64,
        /// Deviation of a blind guess, degrees.
        guess_deg: f64,
        /// Distinct locations.
        places: usize,
    },
    /// A camera is far from its position in the rig description.
    #[error(
        "expected {camera} within {limit_mm} mm and {limit_deg} degrees of its position in the rig description, found it \
         about ({:+.0}, {:+.0}) mm and {skew_deg:+.0} degrees off",
        .off_mm[0], .off_mm[1]
    )]
    CameraFar {
        /// The camera.
        camera: CameraId,
        /// Maximum distance, mm.
        limit_mm: f64,
        /// Maximum skew, degrees.
        limit_deg: f64,
        /// Offset, x and y, mm.
        off_mm: [f64; 2],
        /// Skew, degrees.
        skew_deg: f64,
    },
    /// The columns of a camera do not move.
    #[error(
        "expected columns that move with the presses, found them within {within_px:.1} px of column {column_px:.0} in the \
         median while the viewing angle scatters by {angle_deg:.0} degrees ({camera}{})",
        if *.both { "; the other camera likewise" } else { "" }
    )]
    FixedColumn {
        /// The camera with these numbers.
        camera: CameraId,
        /// Median distance from the column, px.
        within_px: f64,
        /// The column, px.
        column_px: f64,
        /// Scatter of the viewing angles of the presses, degrees.
        angle_deg: f64,
        /// True if the other camera likewise.
        both: bool,
    },
    /// The columns of a camera do not move for a part of the session.
    #[error(
        "expected columns that move with the presses, found them at column {column_px:.0} from {first} to {last} while the \
         viewing angle scatters by {angle_deg:.0} degrees ({camera}, n {presses} presses)"
    )]
    FixedStretch {
        /// The camera.
        camera: CameraId,
        /// First press.
        first: PressId,
        /// Last press.
        last: PressId,
        /// The column, px.
        column_px: f64,
        /// Scatter of the viewing angles of these presses, degrees.
        angle_deg: f64,
        /// Presses with a centroid from the first to the last one.
        presses: usize,
    },
    /// All centroids moved in a repetition.
    #[error(
        "expected centroids at the same columns in each repetition, found {repetition} moved by {moved_px:.1} ± \
         {error_px:.1} px{} ({camera}, n {pairs})", zoomed(*.zoom_percent)
    )]
    RepetitionMoved {
        /// The repetition.
        repetition: RepetitionId,
        /// Median move; of a zoom the move of the outermost column, px.
        moved_px: f64,
        /// Its standard error, px.
        error_px: f64,
        /// Growth of the distance between two columns, %, if columns move the more, the farther from one they are.
        zoom_percent: Option<f64>,
        /// The camera.
        camera: CameraId,
        /// Presses compared.
        pairs: usize,
    },
    /// The presses of a repetition are elsewhere.
    #[error(
        "expected repetitions of a location to agree, found {repetition} off by {off_px:.1} px in the median, where \
         locations differ by {between_px:.1} px from their middle ({camera}, n {pairs})"
    )]
    RepetitionElsewhere {
        /// The repetition.
        repetition: RepetitionId,
        /// Median distance, px.
        off_px: f64,
        /// Median distance of the locations from their middle, px.
        between_px: f64,
        /// The camera.
        camera: CameraId,
        /// Presses compared.
        pairs: usize,
    },
    /// Presses at the same position look different.
    #[error(
        "expected presses at the same position to agree, found their columns {off_px:.1} px from their middle (median), where those of \
         all presses are {all_px:.1} px from theirs ({camera}, n {presses})"
    )]
    SamePosition {
        /// Median distance within a position, px.
        off_px: f64,
        /// Median distance of all presses from their middle, px.
        all_px: f64,
        /// The camera.
        camera: CameraId,
        /// Presses that share a position.
        presses: usize,
    },
    /// Events that come after later ones.
    #[error(
        "expected the events of {camera} in the order of their times, found {late} of {events} more than {limit_ms} ms late"
    )]
    EventsOutOfOrder {
        /// The camera.
        camera: CameraId,
        /// Late events.
        late: u64,
        /// All events.
        events: u64,
        /// How late, ms.
        limit_ms: u64,
    },
    /// A camera's clock could not be aligned.
    #[error(
        "expected {presses} presses to show in the events of {camera}, found no alignment of the clocks in which they do"
    )]
    NoAlignment {
        /// Presses with times.
        presses: usize,
        /// The camera.
        camera: CameraId,
    },
    /// A camera's clock drifts.
    #[error(
        "expected the clock of {camera} within {limit_ppm} ppm of the host's, found {drift_ppm:.1} ± {error_ppm:.1} ppm (n \
         {n})"
    )]
    ClockDrift {
        /// The camera.
        camera: CameraId,
        /// Maximum, ppm.
        limit_ppm: f64,
        /// Drift, ppm.
        drift_ppm: f64,
        /// Its standard error, ppm.
        error_ppm: f64,
        /// Points of the fit.
        n: u32,
    },
    /// The error is that of a guess.
    #[error(
        "expected an RMSE of at most {:.0} % of a constant guess, found {rmse_mm:.1} mm where guessing the mean position gives \
         {guess_mm:.1} mm (n {presses})",
        MOST_OF_GUESS * 100.0
    )]
    NoBetterThanGuess {
        /// RMSE of the scored presses, mm.
        rmse_mm: f64,
        /// RMSE of guessing their mean position, mm.
        guess_mm: f64,
        /// Scored presses.
        presses: usize,
    },
}

with_text!(Evidence);
