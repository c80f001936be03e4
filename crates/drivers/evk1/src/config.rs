//! Configuration of the driver; the camera's own settings are in `CameraSettings`.

use std::time::Duration;

use crate::error::Evk1Error;
use crate::tolerance::Tolerance;

/// Configuration of the driver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Evk1Config {
    /// Chunk size, bytes; at least one transfer.
    pub chunk_bytes: usize,
    /// Capacity of the queue until [`poll`](skinrig_device::EventCamera::poll), bytes. Data beyond it is lost and counted. 256 MiB are 1.3 s
    /// at the sensor's highest rate.
    pub backlog_bytes: usize,
    /// Number of transfers in flight; 20 cover 13 ms at the sensor's highest rate.
    pub transfers: usize,
    /// Size of a transfer, bytes; a multiple of the packet size 1024.
    pub transfer_bytes: usize,
    /// Time after which a transfer completes with partial data.
    pub transfer_timeout: Duration,
    /// Addresses of registers whose writes need not read back. Empty unless a real camera has shown a difference: the behaviour of an
    /// EVK1's registers is not published.
    pub read_back_exceptions: Vec<u32>,
    /// Largest step of the time base that is not a loss, µs. `None`: steps only become notes, because the interval of an EVK1's time base
    /// words is not published.
    pub max_time_step_us: Option<u64>,
    /// Whether a step of the camera's overflow counter counts as a loss of at least one word. False: it only becomes a note, because the
    /// meaning of the counter is not published.
    pub overflow_is_loss: bool,
    /// Accepted deviations of the camera.
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
    /// Checks that the values are consistent.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] for the first inconsistent value.
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
