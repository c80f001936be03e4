//! What can be chosen about the way a camera is driven; what it shall see is in `CameraSettings`.

use std::time::Duration;

use crate::error::Evk1Error;
use crate::tolerance::Tolerance;

/// How a camera is driven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Evk1Config {
    /// Bytes after which a chunk is closed; at least one transfer.
    pub chunk_bytes: usize,
    /// Bytes that may wait for [`poll`](skinrig_device::EventCamera::poll). What comes on top is lost, and counted.
    /// 256 MiB are 1.3 s at the highest rate of the sensor.
    pub backlog_bytes: usize,
    /// Transfers in flight; 20 are 13 ms at the highest rate of the sensor.
    pub transfers: usize,
    /// Bytes of a transfer; a multiple of the packet size 1024.
    pub transfer_bytes: usize,
    /// After this long a transfer comes back with what it has.
    pub transfer_timeout: Duration,
    /// Addresses of registers whose writes need not read back. Empty unless a real camera has shown that a register
    /// reads differently: what each register of an EVK1 reads back is not public.
    pub read_back_exceptions: Vec<u32>,
    /// Longest step of the time base, µs, that is no loss. `None`: steps are noted and nothing more, because how often
    /// an EVK1 sends its time base is not public.
    pub max_time_step_us: Option<u64>,
    /// Whether a step of the camera's overflow counter is a loss of at least one word. False: it is noted at the end and nothing
    /// more, because what the counter of a real EVK1 counts is not public.
    pub overflow_is_loss: bool,
    /// What is accepted although a camera is not expected to do it.
    pub tolerance: Tolerance,
}

impl Default for Evk1Config {
    fn default() -> Self {
        Self {
            chunk_bytes: 1 << 20,
            backlog_bytes: 256 << 20,
            transfers: 20,
            transfer_bytes: 128 << 10,
            transfer_timeout: Duration::from_millis(100),
            read_back_exceptions: Vec::new(),
            max_time_step_us: None,
            overflow_is_loss: true,
            tolerance: Tolerance::default(),
        }
    }
}

impl Evk1Config {
    /// Checks that the numbers go together.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] naming the first that does not.
    pub fn check(&self) -> Result<(), Evk1Error> {
        let rules = [
            (
                (1..=64).contains(&self.transfers),
                "1..=64 transfers",
                self.transfers,
            ),
            (
                (1024..=16 << 20).contains(&self.transfer_bytes)
                    && self.transfer_bytes.is_multiple_of(1024),
                "transfer_bytes a multiple of 1024 up to 16 MiB",
                self.transfer_bytes,
            ),
            (
                (self.transfer_bytes..=64 << 20).contains(&self.chunk_bytes),
                "chunk_bytes from transfer_bytes to 64 MiB",
                self.chunk_bytes,
            ),
            (
                self.backlog_bytes >= 2 * self.chunk_bytes,
                "backlog_bytes of two chunks or more",
                self.backlog_bytes,
            ),
            (
                self.max_time_step_us.is_none_or(|us| us >= 64),
                "max_time_step_us of one count of the time base, 64 µs, or more",
                self.max_time_step_us.unwrap_or_default() as usize,
            ),
            (
                (1..=10_000).contains(&self.transfer_timeout.as_millis()),
                "transfer_timeout of 1 ms to 10 s",
                self.transfer_timeout.as_millis() as usize,
            ),
        ];
        match rules.into_iter().find(|(holds, ..)| !holds) {
            Some((_, expected, found)) => Err(Evk1Error::refused(expected, found.to_string())),
            None => Ok(()),
        }
    }
}
