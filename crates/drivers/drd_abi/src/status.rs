//! The status vector.

/// Buffer size of the status vector in words: more than any known SDK writes (15 to 17).
pub const STATUS_CAPACITY: usize = 32;

/// Marks words that the library did not write.
const ABSENT: i32 = i32::MIN;

/// Words of the status vector. 1 is yes, 0 is no, -1 means that the device has no such feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum StatusField {
    /// The controller is powered.
    Power = 0,
    /// The controller responds.
    Connected = 1,
    /// The controller runs.
    Started = 2,
    /// The device requires calibration.
    Reset = 3,
    /// No motor current, no brake.
    Idle = 4,
    /// Motors live.
    Force = 5,
    /// Electromagnetic brake: viscous, holds nothing.
    Brake = 6,
    /// The wrist torques are live.
    Torque = 7,
    /// A wrist is installed.
    WristDetected = 8,
    /// The controller reports a fault.
    Error = 9,
    /// Gravity compensation is on.
    Gravity = 10,
    /// The time guard is on.
    TimeGuard = 11,
    /// The wrist is initialised.
    WristInit = 12,
    /// 1: redundant encoders agree; 0: they disagree, or there are none; -1 on some devices: there are none.
    Redundancy = 13,
    /// Cause of the last loss of force, see [`ForceOffCause`].
    ForceOffCause = 14,
    /// Mechanical locks (since 3.7.1).
    Locks = 15,
    /// Axes with checked end stops, one bit each (after 3.10).
    AxisChecked = 16,
}

/// Why the controller last switched the force off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceOffCause {
    /// Never switched off.
    None,
    /// The force button on the base.
    Button,
    /// An axis exceeded the velocity threshold.
    Velocity,
    /// No command arrived in time.
    Watchdog,
    /// A program's request.
    Software,
    /// USB was unplugged.
    UsbDisconnect,
    /// The dead-man's switch opened.
    Deadman,
    /// Unknown cause.
    Unknown(i32),
}

impl From<i32> for ForceOffCause {
    fn from(code: i32) -> Self {
        match code {
            0 => Self::None,
            1 => Self::Button,
            2 => Self::Velocity,
            3 => Self::Watchdog,
            4 => Self::Software,
            5 => Self::UsbDisconnect,
            6 => Self::Deadman,
            other => Self::Unknown(other),
        }
    }
}

/// The status vector with space for every SDK version. Unwritten words are absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusVector {
    words: [i32; STATUS_CAPACITY],
}

impl Default for StatusVector {
    fn default() -> Self {
        Self {
            words: [ABSENT; STATUS_CAPACITY],
        }
    }
}

impl StatusVector {
    /// A vector without any words.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A vector with `words` (at most [`STATUS_CAPACITY`]); the others are absent.
    #[must_use]
    pub fn from_words(words: &[i32]) -> Self {
        let mut vector = Self::new();
        for (place, word) in vector.words.iter_mut().zip(words) {
            *place = *word;
        }
        vector
    }

    /// Buffer for `dhdGetStatus`, of [`STATUS_CAPACITY`] words.
    pub fn as_mut_ptr(&mut self) -> *mut i32 {
        self.words.as_mut_ptr()
    }

    /// One word, `None` if the library did not write it.
    #[must_use]
    pub fn get(&self, field: StatusField) -> Option<i32> {
        Some(self.words[field as usize]).filter(|word| *word != ABSENT)
    }

    /// Whether a word is present and 1.
    #[must_use]
    pub fn is(&self, field: StatusField) -> bool {
        self.get(field) == Some(1)
    }

    /// Cause of the last loss of force; `None` if this version does not report it.
    #[must_use]
    pub fn force_off_cause(&self) -> Option<ForceOffCause> {
        self.get(StatusField::ForceOffCause)
            .map(ForceOffCause::from)
    }

    /// The written words, up to the last present one.
    #[must_use]
    pub fn words(&self) -> &[i32] {
        let len = self
            .words
            .iter()
            .rposition(|word| *word != ABSENT)
            .map_or(0, |last| last + 1);
        &self.words[..len]
    }
}
