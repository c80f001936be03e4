//! Seeded mutations: bit flips, splices, truncations, wrong length fields, misplaced tokens of the format.

/// A small seeded generator of 64-bit numbers (SplitMix64, Steele, Lea and Flood 2014).
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    /// A generator with this seed.
    #[must_use]
    pub const fn seeded(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub const fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform below `n`, which is far below 2^64; 0 if `n` is 0.
    pub const fn below(&mut self, n: usize) -> usize {
        if n == 0 {
            return 0;
        }
        (self.roll() % n as u64) as usize
    }
}

/// Numbers at which counts, lengths and offsets often fail.
const EDGES: [u64; 16] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_ffff,
    0x0010_0000_0000,
];

/// Mutates `bytes` one to eight times; `other` is another input to splice from.
pub fn mutate(
    bytes: &mut Vec<u8>,
    other: &[u8],
    dictionary: &[&[u8]],
    longest: usize,
    dice: &mut Dice,
) {
    for _ in 0..=dice.below(8) {
        once(bytes, other, dictionary, dice);
        bytes.truncate(longest);
    }
}

fn once(bytes: &mut Vec<u8>, other: &[u8], dictionary: &[&[u8]], dice: &mut Dice) {
    let at = dice.below(bytes.len());
    match dice.below(10) {
        // Flip one bit.
        0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << dice.below(8),
        // Replace one byte.
        2 if !bytes.is_empty() => bytes[at] = EDGES[dice.below(EDGES.len())] as u8,
        // Write a number of 2, 4 or 8 bytes in either byte order, like a length: an edge, or slightly more or less than the
        // present value.
        3 | 4 => {
            let size = [2, 4, 8][dice.below(3)];
            let at = if dice.below(2) == 0 {
                at / size * size
            } else {
                at
            };
            if let Some(field) = bytes.get_mut(at..at + size) {
                let mut word = [0; 8];
                word[..size].copy_from_slice(field);
                let number = match dice.below(3) {
                    0 => u64::from_le_bytes(word)
                        .wrapping_add(dice.roll() % 17)
                        .wrapping_sub(8),
                    _ => EDGES[dice.below(EDGES.len())],
                };
                match dice.below(2) {
                    0 => field.copy_from_slice(&number.to_le_bytes()[..size]),
                    _ => field.copy_from_slice(&number.to_be_bytes()[8 - size..]),
                }
            }
        }
        // Truncate.
        5 => bytes.truncate(at),
        // Remove a piece.
        6 => {
            let end = at + dice.below((bytes.len() - at).min(64) + 1);
            bytes.drain(at..end);
        }
        // Duplicate a piece elsewhere.
        7 => {
            let end = at + dice.below((bytes.len() - at).min(256) + 1);
            let piece = bytes[at..end].to_vec();
            insert(bytes, &piece, dice);
        }
        // Splice a piece of another input.
        8 => {
            let start = dice.below(other.len());
            let end = start + dice.below((other.len() - start).min(512) + 1);
            insert(bytes, &other[start..end], dice);
        }
        // Insert a token of the format, or noise.
        _ => match dictionary.get(dice.below(dictionary.len() + 1)) {
            Some(word) => insert(bytes, word, dice),
            None => insert(bytes, &dice.roll().to_le_bytes(), dice),
        },
    }
}

/// Inserts a piece between the bytes, or overwrites them.
fn insert(bytes: &mut Vec<u8>, piece: &[u8], dice: &mut Dice) {
    let at = dice.below(bytes.len() + 1);
    let end = match dice.below(2) {
        0 => at,
        _ => (at + piece.len()).min(bytes.len()),
    };
    bytes.splice(at..end, piece.iter().copied());
}
