//! Configuration of one trigger box.

use std::time::Duration;

/// Settings of the driver.
#[derive(Debug, Clone, PartialEq)]
pub struct TriggerBoxConfig {
    /// Path of the serial port, preferably one under `/dev/serial/by-id`.
    pub port: String,
    /// Required serial number of the box; `None` accepts any.
    pub serial: Option<String>,
    /// The box disarms itself after this time without a request from the host, ms; 0 means never.
    pub silence_ms: u16,
    /// Largest rate difference between the clocks of box and host, ppm. The Arduino Uno has a ceramic resonator with 0.5 %; 100 is enough
    /// for a board with a crystal.
    pub max_drift_ppm: f64,
    /// Interval of time exchanges.
    pub exchange_interval: Duration,
    /// Interval of event requests.
    pub events_interval: Duration,
    /// Time before an unanswered request is repeated.
    pub reply_timeout: Duration,
    /// Time before a command without a reply fails, and a line without any reply counts as lost.
    pub command_timeout: Duration,
    /// Time limit for the first reply after opening the port: opening resets an Arduino, and its boot loader waits for about two seconds.
    pub hello_timeout: Duration,
}

impl TriggerBoxConfig {
    /// A box at this port, with default times.
    #[must_use]
    pub fn new(port: impl Into<String>) -> Self {
        Self {
            port: port.into(),
            serial: None,
            silence_ms: 5_000,
            max_drift_ppm: 5_000.0,
            exchange_interval: Duration::from_millis(200),
            events_interval: Duration::from_millis(50),
            reply_timeout: Duration::from_millis(60),
            command_timeout: Duration::from_secs(1),
            hello_timeout: Duration::from_secs(4),
        }
    }
}
