//! How to find and use one trigger box.

use std::time::Duration;

/// Settings of the driver.
#[derive(Debug, Clone, PartialEq)]
pub struct TriggerBoxConfig {
    /// Path of the serial port, best one under `/dev/serial/by-id`.
    pub port: String,
    /// The serial number that the box must have; `None` takes any.
    pub serial: Option<String>,
    /// The box forbids itself to pulse when it has heard nothing from the host for so long; 0 is never. ms.
    pub silence_ms: u16,
    /// How fast or slow the box's clock may be against the host's, ppm. The Arduino Uno has a ceramic resonator of
    /// 0.5 %; a board with a crystal allows 100.
    pub max_drift_ppm: f64,
    /// From one exchange of time to the next.
    pub exchange_interval: Duration,
    /// From one look at the box's events to the next.
    pub events_interval: Duration,
    /// Before an unanswered request is sent again.
    pub reply_timeout: Duration,
    /// Before an unanswered command is given up, and a line without any answer counts as lost.
    pub command_timeout: Duration,
    /// How long a box may take to say hello after its port was opened: opening resets an Arduino, and its boot loader
    /// waits for about two seconds.
    pub hello_timeout: Duration,
}

impl TriggerBoxConfig {
    /// The box at this port, with the usual times.
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
