//! Frames on the serial line: COBS with zero as the delimiter (Cheshire and Baker, "Consistent Overhead Byte Stuffing", SIGCOMM 1997),
//! and the CRC-32 of the body.
//!
//! The delimiter occurs nowhere else, so a damaged byte costs only its own frame.

/// Maximum length of a body, bytes.
pub const MAX_BODY: usize = 112;
const CHECKSUM: usize = 4;
/// COBS adds one byte to content of up to 254 bytes.
const MAX_STUFFED: usize = MAX_BODY + CHECKSUM + 1;

/// Encodes `body` as a frame with delimiters.
///
/// `None` if the body is empty or longer than [`MAX_BODY`].
#[must_use]
pub fn encode(body: &[u8]) -> Option<Vec<u8>> {
    if body.is_empty() || body.len() > MAX_BODY {
        return None;
    }
    let mut content = body.to_vec();
    content.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
    let mut frame = Vec::with_capacity(content.len() + 3);
    frame.push(0);
    for block in content.split(|&byte| byte == 0) {
        // Block lengths are at most MAX_BODY + 4, below 255.
        frame.push(block.len() as u8 + 1);
        frame.extend_from_slice(block);
    }
    frame.push(0);
    Some(frame)
}

/// Decodes a stream of bytes into the bodies of valid frames.
#[derive(Debug, Default)]
pub struct FrameReader {
    stuffed: Vec<u8>,
    too_long: bool,
    bad_frames: u64,
}

impl FrameReader {
    /// Adds one byte; returns the body of the frame that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Vec<u8>> {
        if byte != 0 {
            if self.stuffed.len() < MAX_STUFFED {
                self.stuffed.push(byte);
            } else {
                self.too_long = true;
            }
            return None;
        }
        let stuffed = std::mem::take(&mut self.stuffed);
        let too_long = std::mem::take(&mut self.too_long);
        if stuffed.is_empty() {
            return None; // consecutive delimiters are not a frame
        }
        let body = if too_long { None } else { open(&stuffed) };
        if body.is_none() {
            self.bad_frames += 1;
        }
        body
    }

    /// Number of damaged frames so far.
    #[must_use]
    pub fn bad_frames(&self) -> u64 {
        self.bad_frames
    }
}

/// Decodes a stuffed frame; `None` if its code or checksum is wrong.
fn open(stuffed: &[u8]) -> Option<Vec<u8>> {
    let mut content = Vec::with_capacity(stuffed.len());
    let mut rest = stuffed;
    while let Some((&code, after)) = rest.split_first() {
        let block = after.get(..usize::from(code).checked_sub(1)?)?;
        content.extend_from_slice(block);
        rest = &after[block.len()..];
        if !rest.is_empty() {
            content.push(0);
        }
    }
    let (body, checksum) = content.split_last_chunk::<CHECKSUM>()?;
    let good = !body.is_empty() && crc32fast::hash(body).to_le_bytes() == *checksum;
    good.then(|| body.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) -> (Vec<Vec<u8>>, u64) {
        let mut reader = FrameReader::default();
        let bodies = bytes.iter().filter_map(|&b| reader.push(b)).collect();
        (bodies, reader.bad_frames())
    }

    proptest! {
        #[test]
        fn every_body_survives(bodies in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..=MAX_BODY), 0..5)) {
            let line: Vec<u8> = bodies.iter().flat_map(|b| encode(b).unwrap()).collect();
            prop_assert_eq!(read(&line), (bodies, 0));
        }

        #[test]
        fn delimiters_are_at_both_ends_only(body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY)) {
            let frame = encode(&body).unwrap();
            let zeros: Vec<usize> = (0..frame.len()).filter(|&i| frame[i] == 0).collect();
            prop_assert_eq!(zeros, vec![0, frame.len() - 1]);
        }

        #[test]
        fn garbage_never_panics_nor_damages_the_next_frame(garbage in prop::collection::vec(any::<u8>(), 0..600),
                                                          body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY)) {
            let mut line = garbage;
            line.extend(encode(&body).unwrap());
            prop_assert_eq!(read(&line).0.pop(), Some(body));
        }

        #[test]
        fn a_damaged_byte_is_detected(body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY),
                                     at in any::<prop::sample::Index>(), flip in 1u8..) {
            let mut line = encode(&body).unwrap();
            let at = at.index(line.len());
            line[at] ^= flip;
            // A damaged delimiter may leave the frame intact; a damaged body never passes.
            prop_assert!(read(&line).0.iter().all(|b| *b == body));
        }
    }

    #[test]
    fn empty_and_too_long_bodies_are_rejected() {
        assert_eq!(encode(&[]), None);
        assert_eq!(encode(&[1; MAX_BODY + 1]), None);
    }

    #[test]
    fn the_checksum_is_that_of_ieee_802_3() {
        // Check value of CRC-32 for the digits 1 to 9, from Cook's catalogue.
        let frame = encode(b"123456789").unwrap();
        assert_eq!(frame[11..15], 0xcbf4_3926_u32.to_le_bytes());
    }
}
