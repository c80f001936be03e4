//! The EVT2 encoder: converts events to the bytes that a camera would send.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};

use crate::error::FormatsError;

/// Interval at which a camera repeats its time base, µs, even without events. Recordings and the published
/// examples show 16 µs; the sensor's documentation does not state it.
pub const TIME_HIGH_CADENCE_US: u64 = 16;

/// Largest column or row in the format's 11 bits.
pub const MAX_COORDINATE: u16 = 2047;

/// Writes an EVT2 stream: CD events, trigger edges, and a TIME_HIGH word at every multiple of the cadence.
///
/// Items must be in time order; an item between two TIME_HIGH words is written between them. Times may
/// exceed the 34 bits of the format; the written time base then wraps like a camera's.
#[derive(Debug, Clone)]
pub struct Encoder {
    cadence_us: u64,
    /// Time of the next TIME_HIGH word, µs.
    next_us: u64,
    /// Earliest time of the next item, µs.
    reached_us: u64,
}

impl Encoder {
    /// An encoder whose stream begins at `first_time_us`, with the usual cadence. Its first word is the
    /// TIME_HIGH word for that time.
    #[must_use]
    pub const fn new(first_time_us: u64) -> Self {
        Self {
            cadence_us: TIME_HIGH_CADENCE_US,
            next_us: first_time_us - first_time_us % TIME_HIGH_CADENCE_US,
            reached_us: first_time_us,
        }
    }

    /// An encoder that writes TIME_HIGH words every `cadence_us`, which must divide 64.
    ///
    /// # Errors
    /// [`FormatsError::Cadence`] for any other number.
    pub const fn with_cadence(first_time_us: u64, cadence_us: u64) -> Result<Self, FormatsError> {
        if cadence_us == 0 || 64 % cadence_us != 0 {
            return Err(FormatsError::Cadence(cadence_us));
        }
        Ok(Self {
            cadence_us,
            next_us: first_time_us - first_time_us % cadence_us,
            reached_us: first_time_us,
        })
    }

    /// Time that the stream has reached, µs: items must not be earlier.
    #[must_use]
    pub const fn reached_us(&self) -> u64 {
        self.reached_us
    }

    /// Writes one CD event.
    ///
    /// # Errors
    /// [`FormatsError::OutOfOrder`] if it is earlier than the stream, [`FormatsError::OutOfRange`] for a
    /// coordinate above 2047. Nothing is written then.
    #[inline]
    pub fn cd(&mut self, event: CdEvent, out: &mut Vec<u8>) -> Result<(), FormatsError> {
        check("x", MAX_COORDINATE.into(), event.x.into())?;
        check("y", MAX_COORDINATE.into(), event.y.into())?;
        self.advance_to(event.t_us, out)?;
        let kind = match event.polarity {
            Polarity::Off => 0,
            Polarity::On => 1 << 28,
        };
        let low = (event.t_us as u32 & 0x3f) << 22;
        let word = kind | low | u32::from(event.x) << 11 | u32::from(event.y);
        out.extend_from_slice(&word.to_le_bytes());
        Ok(())
    }

    /// Writes one trigger edge.
    ///
    /// # Errors
    /// [`FormatsError::OutOfOrder`] if it is earlier than the stream, [`FormatsError::OutOfRange`] for a
    /// channel above 31. Nothing is written then.
    pub fn trigger(&mut self, edge: TriggerEdge, out: &mut Vec<u8>) -> Result<(), FormatsError> {
        check("trigger channel", 31, edge.channel.into())?;
        self.advance_to(edge.t_us, out)?;
        let low = (edge.t_us as u32 & 0x3f) << 22;
        let word = 0xa << 28 | low | u32::from(edge.channel) << 8 | u32::from(edge.rising);
        out.extend_from_slice(&word.to_le_bytes());
        Ok(())
    }

    /// Advances the time: writes the TIME_HIGH words up to and including `t_us`. A later item may
    /// have the same time.
    ///
    /// # Errors
    /// [`FormatsError::OutOfOrder`] if `t_us` is earlier than the stream.
    #[inline]
    pub fn advance_to(&mut self, t_us: u64, out: &mut Vec<u8>) -> Result<(), FormatsError> {
        if t_us < self.reached_us {
            return Err(FormatsError::OutOfOrder {
                found_us: t_us,
                written_us: self.reached_us,
            });
        }
        self.reached_us = t_us;
        if t_us >= self.next_us {
            self.time_words(t_us, out);
        }
        Ok(())
    }

    fn time_words(&mut self, t_us: u64, out: &mut Vec<u8>) {
        let words = (t_us - self.next_us) / self.cadence_us + 1;
        let start = out.len();
        out.resize(start + words as usize * 4, 0);
        for (k, word) in (0..words).zip(out[start..].chunks_exact_mut(4)) {
            let high = (self.next_us + k * self.cadence_us) >> 6;
            word.copy_from_slice(&(0x8000_0000 | high as u32 & 0x0fff_ffff).to_le_bytes());
        }
        self.next_us += words * self.cadence_us;
    }
}

fn check(what: &'static str, max: u64, found: u64) -> Result<(), FormatsError> {
    if found > max {
        return Err(FormatsError::OutOfRange { what, max, found });
    }
    Ok(())
}
