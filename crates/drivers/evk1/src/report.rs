//! What happened to a stream that its bytes do not say.

use skinrig_model::HostDuration;

use crate::inbox::Loss;
use crate::time_base::TimeJump;

/// How many jumps and losses are kept one by one; all are counted.
const KEPT: usize = 16;

/// What happened to the bytes between one start and the stop that followed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StreamReport {
    /// Bytes at the start that had no time: before the first TIME_HIGH word, and, on a slave, before its time advanced.
    pub discarded_bytes: u64,
    /// Bytes that the stream before had left in the camera's buffers, let go before this one began.
    pub left_over_bytes: u64,
    /// Bytes lost since, which `lost_before` of the chunks says as well.
    pub lost_bytes: u64,
    /// How often bytes were lost.
    pub loss_count: u64,
    /// Transfers that failed, each a loss; told when the stream stops.
    pub failed_transfers: u64,
    /// Host time over which they were lost, together.
    pub lost_time: HostDuration,
    /// The first losses.
    pub losses: Vec<Loss>,
    /// How often it made a step that counts as a loss, see [`crate::Evk1Config::max_time_step_us`]; each is a word in
    /// `lost_bytes`, for how many it was is not known.
    pub time_gaps: u64,
    /// How often the overflow counter was found to have counted on, which counts as a loss, see
    /// [`crate::Evk1Config::overflow_is_loss`]; each is a word in `lost_bytes`, for how many it was is not known.
    pub overflow_gaps: u64,
    /// How often the time base jumped by more than one count, or back: the camera itself has lost something.
    pub jump_count: u64,
    /// The first jumps.
    pub jumps: Vec<TimeJump>,
    /// The last time of the stream before and the first of this one, µs, when time began again at the start.
    pub restarted: Option<(u64, u64)>,
    /// OVERFLOW_HITCOUNT at start and at stop, as read; its meaning is not public. `None` while streaming, and when the
    /// camera was gone.
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

    /// The report in sentences; none when nothing happened.
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
                "{} bytes left over from the stream before were let go",
                self.left_over_bytes
            ));
        }
        if self.loss_count > 0 {
            notes.push(format!(
                "{} bytes were lost on the host in {} gaps of {} together",
                self.lost_bytes, self.loss_count, self.lost_time
            ));
        }
        if self.failed_transfers > 0 {
            notes.push(format!(
                "{} transfers failed, and what they held is lost: how much is not known",
                self.failed_transfers
            ));
        }
        if self.time_gaps > 0 {
            notes.push(format!(
                "{} steps of the time base were longer than allowed: the camera lost events, how many is not known",
                self.time_gaps
            ));
        }
        if self.overflow_gaps > 0 {
            notes.push(format!(
                "the camera's overflow counter was seen to count on {} times: the camera lost events, how many is not known",
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
                "the time base began again: {first} µs after {last} µs of the stream before"
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
