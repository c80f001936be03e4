//! The status vector.

/// Words of the buffer for the status vector: more than any known SDK writes (15 to 17).
pub const STATUS_CAPACITY: usize = 32;

/// Fills the places that the library did not write.
const ABSENT: i32 = i32::MIN;

/// What a word of the status vector tells. 1 for yes, 0 for no, -1 for "the device has no such thing".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum StatusField {
    /// The controller has power.
    Power = 0,
    /// The controller answers.
    Connected = 1,
    /// The controller runs.
    Started = 2,
    /// The device asks for calibration.
    Reset = 3,
    /// No motor current, no brake.
    Idle = 4,
    /// Motors live.
    Force = 5,
    /// Electromagnetic brake: viscous, holds nothing.
    Brake = 6,
    /// Torques of a wrist are live.
    Torque = 7,
    /// A wrist is there.
    WristDetected = 8,
    /// The controller reports a fault.
    Error = 9,
    /// Gravity compensation is on.
    Gravity = 10,
    /// The time guard is on.
    TimeGuard = 11,
    /// The wrist is initialised.
    WristInit = 12,
    /// 1: redundant encoders agree; 0: they do not, or there are none; -1 on some devices: there are none.
    Redundancy = 13,
    /// Why forces went off last, see [`ForceOffCause`].
    ForceOffCause = 14,
    /// Mechanical locks (since 3.7.1).
    Locks = 15,
    /// Axes whose end stops were checked, one bit each (after 3.10).
    AxisChecked = 16,
}

/// Why the controller took the force off the last time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceOffCause {
    /// It did not.
    None,
    /// The force button on the base.
    Button,
    /// An axis was faster than the velocity threshold.
    Velocity,
    /// No command arrived in time.
    Watchdog,
    /// A program asked for it.
    Software,
    /// USB was unplugged.
    UsbDisconnect,
    /// The dead-man's switch opened.
    Deadman,
    /// A cause that we do not know.
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

/// The status vector with room for every version of the SDK; what it did not write is absent.
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
    /// A vector in which every word is absent.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A vector that holds `words` (at most [`STATUS_CAPACITY`]), the others absent.
    #[must_use]
    pub fn from_words(words: &[i32]) -> Self {
        let mut vector = Self::new();
        for (place, word) in vector.words.iter_mut().zip(words) {
            *place = *word;
        }
        vector
    }

    /// Where `dhdGetStatus` writes; good for [`STATUS_CAPACITY`] words.
    pub fn as_mut_ptr(&mut self) -> *mut i32 {
        self.words.as_mut_ptr()
    }

    /// One word, `None` if the library did not write it.
    #[must_use]
    pub fn get(&self, field: StatusField) -> Option<i32> {
        Some(self.words[field as usize]).filter(|word| *word != ABSENT)
    }

    /// Whether a word is there and is 1.
    #[must_use]
    pub fn is(&self, field: StatusField) -> bool {
        self.get(field) == Some(1)
    }

    /// Why forces went off the last time, `None` if this version does not tell.
    #[must_use]
    pub fn force_off_cause(&self) -> Option<ForceOffCause> {
        self.get(StatusField::ForceOffCause)
            .map(ForceOffCause::from)
    }

    /// The words that were written, up to the last one present.
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
