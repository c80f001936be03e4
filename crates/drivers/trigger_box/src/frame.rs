//! Frames on the serial line: zero-delimited by COBS (Cheshire and Baker, "Consistent Overhead Byte Stuffing",
//! SIGCOMM 1997), each closed by the CRC-32 of its body.
//!
//! The delimiter occurs nowhere else, so a spoiled byte costs the frame it hit and the next one is read again.

/// The longest body of a frame, bytes.
pub const MAX_BODY: usize = 112;
const CHECKSUM: usize = 4;
/// COBS adds one byte to contents of at most 254.
const MAX_STUFFED: usize = MAX_BODY + CHECKSUM + 1;

/// A frame around `body`, delimiters included.
///
/// `None` when the body is empty or longer than [`MAX_BODY`].
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
        // At most MAX_BODY + 4 bytes, below 255.
        frame.push(block.len() as u8 + 1);
        frame.extend_from_slice(block);
    }
    frame.push(0);
    Some(frame)
}

/// Takes bytes as they come and gives the bodies of good frames.
#[derive(Debug, Default)]
pub struct FrameReader {
    stuffed: Vec<u8>,
    too_long: bool,
    bad_frames: u64,
}

impl FrameReader {
    /// Takes one byte; the body of the frame that it completed.
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
            return None; // two delimiters in a row are no frame
        }
        let body = if too_long { None } else { open(&stuffed) };
        if body.is_none() {
            self.bad_frames += 1;
        }
        body
    }

    /// Frames that were spoiled on the way so far.
    #[must_use]
    pub fn bad_frames(&self) -> u64 {
        self.bad_frames
    }
}

/// The body of a stuffed frame, when its code and its checksum are right.
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
        fn a_delimiter_is_at_both_ends_only(body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY)) {
            let frame = encode(&body).unwrap();
            let zeros: Vec<usize> = (0..frame.len()).filter(|&i| frame[i] == 0).collect();
            prop_assert_eq!(zeros, vec![0, frame.len() - 1]);
        }

        #[test]
        fn garbage_never_panics_nor_spoils_the_next_frame(garbage in prop::collection::vec(any::<u8>(), 0..600),
                                                          body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY)) {
            let mut line = garbage;
            line.extend(encode(&body).unwrap());
            prop_assert_eq!(read(&line).0.pop(), Some(body));
        }

        #[test]
        fn a_spoiled_byte_is_noticed(body in prop::collection::vec(any::<u8>(), 1..=MAX_BODY),
                                     at in any::<prop::sample::Index>(), flip in 1u8..) {
            let mut line = encode(&body).unwrap();
            let at = at.index(line.len());
            line[at] ^= flip;
            // A spoiled delimiter may leave the frame whole; a spoiled body never passes.
            prop_assert!(read(&line).0.iter().all(|b| *b == body));
        }
    }

    #[test]
    fn bodies_that_fit_no_frame_are_refused() {
        assert_eq!(encode(&[]), None);
        assert_eq!(encode(&[1; MAX_BODY + 1]), None);
    }

    #[test]
    fn the_checksum_is_the_one_of_ieee_802_3() {
        // The check value of CRC-32 for the digits 1 to 9, as in the catalogue of Cook.
        let frame = encode(b"123456789").unwrap();
        assert_eq!(frame[11..15], 0xcbf4_3926_u32.to_le_bytes());
    }
}
