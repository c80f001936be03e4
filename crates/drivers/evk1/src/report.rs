//! Report of a stream: events that its bytes do not show.

use skinrig_model::HostDuration;

use crate::inbox::Loss;
use crate::time_base::TimeJump;

/// Number of jumps and losses stored individually; all are counted.
const KEPT: usize = 16;

/// Report of a stream from one start to the next stop.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StreamReport {
    /// Bytes at the start without a time: before the first TIME_HIGH word, and on a slave before its time advanced.
    pub discarded_bytes: u64,
    /// Bytes left over from the previous stream and discarded before this one.
    pub left_over_bytes: u64,
    /// Lost bytes, also counted in `lost_before` of the chunks.
    pub lost_bytes: u64,
    /// Number of losses.
    pub loss_count: u64,
    /// Failed transfers, each a loss; set when the stream stops.
    pub failed_transfers: u64,
    /// Total host time of the losses.
    pub lost_time: HostDuration,
    /// The first losses.
    pub losses: Vec<Loss>,
    /// Time base steps that count as losses, see [`crate::Evk1Config::max_time_step_us`]. Each adds one word to `lost_bytes`, because the
    /// amount is unknown.
    pub time_gaps: u64,
    /// Increments of the overflow counter that count as losses, see [`crate::Evk1Config::overflow_is_loss`]. Each adds one word to
    /// `lost_bytes`, because the amount is unknown.
    pub overflow_gaps: u64,
    /// Jumps of the time base by more than one count, or backward: the camera itself lost data.
    pub jump_count: u64,
    /// The first jumps.
    pub jumps: Vec<TimeJump>,
    /// Last time of the previous stream and first time of this one, µs, if time restarted.
    pub restarted: Option<(u64, u64)>,
    /// OVERFLOW_HITCOUNT at start and stop; its meaning is not published. `None` while streaming, and after a disconnection.
    pub overflow_hits: Option<(u16, u16)>,
}

impl StreamReport {
    pub(crate) fn add_loss(&mut self, loss: Loss) {
        self.lost_bytes += loss.bytes;
        self.loss_count += 1;
        self.lost_time = self.lost_time + (loss.until - loss.since);
        if self.losses.len() < KEPT {
            self.losses.push(loss);
        }
    }

    pub(crate) fn add_jump(&mut self, jump: TimeJump) {
        self.jump_count += 1;
        if self.jumps.len() < KEPT {
            self.jumps.push(jump);
        }
    }

    /// The report as sentences; empty if there is nothing to report.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.discarded_bytes > 0 {
            notes.push(format!(
                "{} bytes without a time were discarded at the start of the stream",
                self.discarded_bytes
            ));
        }
        if self.left_over_bytes > 0 {
            notes.push(format!(
                "{} bytes left over from the previous stream were discarded",
                self.left_over_bytes
            ));
        }
        if self.loss_count > 0 {
            notes.push(format!(
                "{} bytes were lost on the host in {} gaps of {} in total",
                self.lost_bytes, self.loss_count, self.lost_time
            ));
        }
        if self.failed_transfers > 0 {
            notes.push(format!(
                "{} transfers failed with an unknown loss of data",
                self.failed_transfers
            ));
        }
        if self.time_gaps > 0 {
            notes.push(format!(
                "{} time base steps were longer than allowed: the camera lost an unknown number of events",
                self.time_gaps
            ));
        }
        if self.overflow_gaps > 0 {
            notes.push(format!(
                "the camera's overflow counter increased {} times: the camera lost an unknown number of events",
                self.overflow_gaps
            ));
        }
        if let Some(first) = self.jumps.first() {
            notes.push(format!(
                "the time base jumped {} times, first from {} to {} µs at {}: the camera lost events or its time",
                self.jump_count, first.from_us, first.to_us, first.arrived
            ));
        }
        if let Some((last, first)) = self.restarted {
            notes.push(format!(
                "the time base restarted: {first} µs after {last} µs of the previous stream"
            ));
        }
        if let Some((before, after)) = self.overflow_hits
            && before != after
        {
            notes.push(format!(
                "the camera's overflow counter went from {before} to {after}"
            ));
        }
        notes
    }
}
