//! Compression of chunks: stored unchanged, or with runs of EVT2 time words folded. Both are lossless.
//!
//! An EVT2 camera without events sends only TIME_HIGH words (type nibble 0x8, bits 27:0 = t / 64 µs;
//! evk1.md section 4.1), each value once or several times in a row. `th-rle` replaces a run of two or
//! more TIME_HIGH words by one token word:
//!
//! | bits | meaning |
//! |---|---|
//! | 31:28 | 0xB, a type that no EVK1 produces |
//! | 27:26 | `phase`, less than `2^shift` |
//! | 25:24 | `shift`, 0..=2: every value repeats `2^shift` times |
//! | 23:0 | `n`, the number of words replaced |
//!
//! Let `base` be the value of the TIME_HIGH word before the run (literal, or the last of an earlier token).
//! Word `k` of the run then has the value `base + ((phase + 1 + k) >> shift)` modulo 2^28. A chunk is stored unchanged if it
//! contains a word of type 0xB, has a length that is not a multiple of 4, or does not shrink.

use std::fmt;

/// Longest raw chunk: 256 MiB. Bounds the memory that a damaged file can request.
pub const MAX_CHUNK_BYTES: usize = 1 << 28;

const TIME_HIGH: u32 = 0x8;
const TOKEN: u32 = 0xB;
const VALUE: u32 = 0x0FFF_FFFF;
const MAX_RUN: usize = 0x00FF_FFFF;
const MAX_SHIFT: u32 = 2;
/// Words that unfolding writes at once.
const BLOCK: usize = 16;

/// Encoding of a stored chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Codec {
    /// Unchanged.
    None,
    /// Runs of EVT2 TIME_HIGH words folded.
    TimeHighRuns,
}

impl Codec {
    /// Name in the session file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::TimeHighRuns => "th-rle",
        }
    }
}

impl fmt::Display for Codec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Invalid folded bytes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("th-rle: word {word}: expected {expected}, found {found}")]
pub struct CodecError {
    /// Index of the 32-bit word in the folded bytes.
    pub word: usize,
    /// What is valid there.
    pub expected: String,
    /// What was found.
    pub found: String,
}

/// Value of word `k` of a run after `base`.
const fn value(base: u32, phase: u32, shift: u32, k: u32) -> u32 {
    base.wrapping_add((phase + 1 + k) >> shift) & VALUE
}

/// Number of leading `words` that continue the run.
fn run_length(words: &[[u8; 4]], base: u32, phase: u32, shift: u32) -> usize {
    let words = &words[..words.len().min(MAX_RUN)];
    let expected = |k: usize| (TIME_HIGH << 28) | value(base, phase, shift, k as u32);
    let mut k = 0;
    // Whole blocks without a branch per word, so that the compiler vectorises them.
    for block in words.as_chunks::<16>().0 {
        let mut difference = 0;
        for (j, word) in block.iter().enumerate() {
            difference |= u32::from_le_bytes(*word) ^ expected(k + j);
        }
        if difference != 0 {
            break;
        }
        k += block.len();
    }
    while k < words.len() && u32::from_le_bytes(words[k]) == expected(k) {
        k += 1;
    }
    k
}

/// Longest run that starts with the TIME_HIGH word `words[0]`: (length, phase, shift).
fn best_run(words: &[[u8; 4]], base: u32) -> (usize, u32, u32) {
    let first = u32::from_le_bytes(words[0]) & VALUE;
    let mut best = (0, 0, 0);
    let mut consider = |phase, shift| {
        let n = run_length(words, base, phase, shift);
        if n > best.0 {
            best = (n, phase, shift);
        }
    };
    if first == value(base, 0, 0, 0) {
        for shift in 0..=MAX_SHIFT {
            consider((1 << shift) - 1, shift);
        }
    } else if first == base {
        // `base` repeats: the number of further repeats gives the phase.
        let repeats = words.iter().take(4).take_while(|w| **w == words[0]).count() as u32;
        for shift in 1..=MAX_SHIFT {
            if repeats < 1 << shift {
                consider((1 << shift) - 1 - repeats, shift);
            }
        }
    }
    best
}

/// Folds EVT2 bytes; `None` if they are to be stored unchanged (see the module).
#[must_use]
pub fn fold(raw: &[u8]) -> Option<Vec<u8>> {
    let (words, rest) = raw.as_chunks::<4>();
    if !rest.is_empty() {
        return None;
    }
    let mut out = Vec::new();
    let mut base = None;
    let (mut kept, mut i) = (0, 0); // words before `kept` are in `out`
    while i < words.len() {
        let word = u32::from_le_bytes(words[i]);
        match word >> 28 {
            TOKEN => return None,
            TIME_HIGH => {
                if let Some(previous) = base {
                    let (n, phase, shift) = best_run(&words[i..], previous);
                    if n >= 2 {
                        out.extend_from_slice(words[kept..i].as_flattened());
                        let token = (TOKEN << 28) | (phase << 26) | (shift << 24) | n as u32;
                        out.extend_from_slice(&token.to_le_bytes());
                        base = Some(value(previous, phase, shift, n as u32 - 1));
                        i += n;
                        kept = i;
                        continue;
                    }
                }
                base = Some(word & VALUE);
            }
            _ => {}
        }
        i += 1;
    }
    if kept == 0 {
        return None; // no run: nothing to copy
    }
    out.extend_from_slice(words[kept..].as_flattened());
    (out.len() < raw.len()).then_some(out)
}

/// Reverses [`fold`]; the result must have `raw_bytes` bytes.
///
/// # Errors
/// [`CodecError`] for bytes that [`fold`] never produces, or for another length.
pub fn unfold(stored: &[u8], raw_bytes: usize) -> Result<Vec<u8>, CodecError> {
    let mut out = Vec::new();
    unfold_into(stored, raw_bytes, &mut out)?;
    out.truncate(raw_bytes);
    Ok(out)
}

/// [`unfold`] into a buffer for several chunks, which only grows.
///
/// # Errors
/// As [`unfold`].
pub fn unfold_into<'a>(
    stored: &[u8],
    raw_bytes: usize,
    buffer: &'a mut Vec<u8>,
) -> Result<&'a [u8], CodecError> {
    let fault = |word, expected: String, found: String| CodecError {
        word,
        expected,
        found,
    };
    let (words, rest) = stored.as_chunks::<4>();
    if !rest.is_empty() || raw_bytes > MAX_CHUNK_BYTES {
        return Err(fault(
            words.len(),
            format!("whole words, expanding to at most {MAX_CHUNK_BYTES} bytes"),
            format!(
                "{} trailing bytes, and a raw length of {raw_bytes}",
                rest.len()
            ),
        ));
    }
    // Allocate by actual input, not by the claimed length.
    let claimed = words.iter().map(|w| u32::from_le_bytes(*w));
    let unfolded: usize = claimed
        .map(|w| match w >> 28 {
            TOKEN => w as usize & MAX_RUN,
            _ => 1,
        })
        .sum();
    // Runs are written in whole blocks, which end up to a block later.
    let most = 4 * (unfolded.min(raw_bytes / 4) + BLOCK);
    if buffer.len() < most {
        buffer.resize(most, 0);
    }
    let out = buffer.as_chunks_mut::<4>().0;
    let (mut at, mut base) = (0, None);
    for (i, bytes) in words.iter().enumerate() {
        let word = u32::from_le_bytes(*bytes);
        if word >> 28 != TOKEN {
            if word >> 28 == TIME_HIGH {
                base = Some(word & VALUE);
            }
            // The length is checked at the end.
            if let Some(out) = out.get_mut(at) {
                *out = *bytes;
            }
            at += 1;
            continue;
        }
        let (phase, shift, n) = ((word >> 26) & 3, (word >> 24) & 3, word & MAX_RUN as u32);
        let Some(previous) = base else {
            return Err(fault(
                i,
                "a time word before the first token".into(),
                "none".into(),
            ));
        };
        if shift > MAX_SHIFT || phase >> shift != 0 || n < 2 {
            return Err(fault(
                i,
                "a token of phase < 2^shift <= 4, n >= 2".into(),
                format!("{word:#010x}"),
            ));
        }
        if 4 * (at + n as usize) > raw_bytes {
            return Err(fault(
                i,
                format!("{raw_bytes} bytes in all"),
                "more bytes".into(),
            ));
        }
        let blocks = out[at..].as_chunks_mut::<BLOCK>().0.iter_mut();
        for (first, block) in (0..n).step_by(BLOCK).zip(blocks) {
            // No branch per word, so that the compiler vectorises it.
            for (k, out) in (first..).zip(block) {
                let time = value(previous, phase, shift, k);
                *out = ((TIME_HIGH << 28) | time).to_le_bytes();
            }
        }
        at += n as usize;
        base = Some(value(previous, phase, shift, n - 1));
    }
    if 4 * at != raw_bytes {
        return Err(fault(
            words.len(),
            format!("{raw_bytes} bytes in all"),
            format!("{} bytes", 4 * at),
        ));
    }
    Ok(&buffer[..raw_bytes])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bytes(words: impl IntoIterator<Item = u32>) -> Vec<u8> {
        words.into_iter().flat_map(u32::to_le_bytes).collect()
    }

    fn round_trip(raw: &[u8]) -> Option<usize> {
        let folded = fold(raw)?;
        assert_eq!(unfold(&folded, raw.len()).unwrap(), raw);
        Some(folded.len())
    }

    #[test]
    fn an_idle_stream_becomes_two_words_at_either_cadence() {
        let once = bytes((5..1005).map(|v| 0x8000_0000 | v));
        let four = bytes((0..1000).map(|k| 0x8000_0000 | (9 + k / 4)));
        let two = bytes((0..1000).map(|k| 0x8000_0000 | (9 + k / 2)));
        for raw in [once, four, two] {
            assert_eq!(round_trip(&raw), Some(8));
        }
        // An event in the middle of a group of four: the run continues with its phase.
        let mut words: Vec<u32> = (0..100).map(|k| 0x8000_0000 | (9 + k / 4)).collect();
        words.insert(50, 0x1000_0000);
        assert_eq!(round_trip(&bytes(words)), Some(16));
    }

    #[test]
    fn the_layout_matches_the_documentation() {
        let raw = bytes([
            0x8000_0007,
            0x8000_0008,
            0x8000_0009,
            0x0000_0001,
            0x8000_0009,
            0x8000_000A,
        ]);
        let folded = bytes([0x8000_0007, 0xB000_0002, 0x0000_0001, 0xB100_0002]);
        assert_eq!(
            unfold(&bytes([0x8000_0007, 0xB000_0002]), 12).unwrap(),
            raw[..12]
        );
        assert_eq!(fold(&raw).unwrap(), folded);
        let wrap = bytes([0x8FFF_FFFE, 0x8FFF_FFFF, 0x8000_0000, 0x8000_0001]);
        assert_eq!(fold(&wrap).unwrap(), bytes([0x8FFF_FFFE, 0xB000_0003]));
    }

    #[test]
    fn unfoldable_bytes_are_stored_unchanged() {
        let idle = bytes((0..8).map(|v| 0x8000_0000 | v));
        assert!(fold(&idle).is_some());
        assert!(fold(&idle[..idle.len() - 1]).is_none(), "not whole words");
        assert!(
            fold(&[idle.as_slice(), &bytes([0xB000_0000])].concat()).is_none(),
            "a type 0xB"
        );
        assert!(
            fold(&bytes([0x8000_0001, 0x1000_0000])).is_none(),
            "not smaller"
        );
        assert!(fold(&[]).is_none());
    }

    #[test]
    fn bad_tokens_are_errors() {
        for (words, raw_bytes) in [
            (vec![0xB000_0002], 8),               // no time before it
            (vec![0x8000_0000, 0xB000_0002], 8),  // too long
            (vec![0x8000_0000, 0xB000_0002], 16), // too short
            (vec![0x8000_0000, 0xB400_0002], 12), // phase 1 of 1
            (vec![0x8000_0000, 0xB300_0002], 12), // shift 3
            (vec![0x8000_0000, 0xB000_0001], 8),  // a run of one
            (vec![0x8000_0000, 0xB0FF_FFFF], usize::MAX),
        ] {
            assert!(unfold(&bytes(words), raw_bytes).is_err());
        }
    }

    fn word() -> impl Strategy<Value = Vec<u32>> {
        prop_oneof![
            any::<u32>().prop_map(|w| vec![w & 0x1FFF_FFFF]),
            any::<u32>().prop_map(|w| vec![w]),
            (
                prop_oneof![0u32..20, 0x0FFF_FFF0u32..=0x0FFF_FFFF],
                1u32..40,
                1u32..6
            )
                .prop_map(|(v, n, repeat)| (0..n)
                    .map(|k| 0x8000_0000 | ((v + k / repeat) & VALUE))
                    .collect()),
        ]
    }

    proptest! {
        #[test]
        fn any_bytes_round_trip(raw in proptest::collection::vec(any::<u8>(), 0..400)) {
            round_trip(&raw);
        }

        #[test]
        fn streams_of_many_time_words_round_trip(runs in proptest::collection::vec(word(), 0..30)) {
            round_trip(&bytes(runs.concat()));
        }

        #[test]
        fn unfolding_is_total(stored in proptest::collection::vec(any::<u8>(), 0..64), raw_bytes in 0usize..4096) {
            let _ = unfold(&stored, raw_bytes);
        }

        #[test]
        fn unfolding_words_is_total(runs in proptest::collection::vec(word(), 0..8), raw_bytes in 0usize..4096) {
            let _ = unfold(&bytes(runs.concat()), raw_bytes);
        }
    }
}
