//! The presses of a run so far: the time of their repetition, their retakes and their faults.

use skinrig_model::{AttemptId, HostDuration, HostTime, PressFault, RunFault};
use skinrig_protocol::Retakes;
use skinrig_protocol::plan::Plan;

use crate::invalid_run::InvalidRun;

/// Schedule, retakes and faults of the presses.
pub(crate) struct PressSeries {
    /// Start of the current repetition or sync block, delayed by pauses.
    begin: HostTime,
    retakes: Retakes,
    /// Number of immediate retakes so far.
    retaken: u32,
    invalid_run: InvalidRun,
    /// Faults of each attempt so far.
    faults: Vec<(AttemptId, PressFault)>,
}

impl PressSeries {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self {
            begin: HostTime::ZERO,
            retakes: plan.retakes,
            retaken: 0,
            invalid_run: InvalidRun::new(plan.max_consecutive_invalid),
            faults: Vec::new(),
        }
    }

    /// Starts a repetition or sync block.
    pub(crate) const fn begin(&mut self, t: HostTime) {
        self.begin = t;
    }

    /// Delays the rest of the repetition.
    pub(crate) fn delay(&mut self, by: HostDuration) {
        self.begin += by;
    }

    /// Time at which a press is due that starts `after` the start of its repetition.
    pub(crate) fn due(&self, after: HostDuration) -> HostTime {
        self.begin + after
    }

    /// Whether a press with this many immediate retakes may have another one.
    pub(crate) const fn may_retake(&self, retakes: u32) -> bool {
        retakes < self.retakes.per_press && self.retaken < self.retakes.per_session
    }

    /// Counts an immediate retake.
    pub(crate) const fn count_retake(&mut self) {
        self.retaken += 1;
    }

    /// Adds the faults of an attempt.
    pub(crate) fn end_attempt(&mut self, attempt: AttemptId, faults: Vec<PressFault>) {
        self.invalid_run.attempt(&faults);
        self.faults.extend(faults.into_iter().map(|f| (attempt, f)));
    }

    /// Ends a press after its last attempt.
    ///
    /// # Errors
    /// [`RunFault::InvalidInARow`] at the limit of consecutive invalid presses.
    pub(crate) fn end_press(&mut self) -> Result<(), RunFault> {
        self.invalid_run.press_ended()
    }

    /// Takes the faults of all attempts.
    pub(crate) fn take_faults(&mut self) -> Vec<(AttemptId, PressFault)> {
        std::mem::take(&mut self.faults)
    }
}
