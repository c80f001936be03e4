//! Page images of a session file and its log, read without SQLite whatever their state.
//!
//! Layout of both files: sqlite.org/fileformat.html, sections 1.2 to 1.5 and 4.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Page size if the first page is unreadable: the size that skinrig uses, in bytes.
const PAGE_BYTES: u64 = 65536;
/// Bytes of the log's header, and of the header of each frame.
const LOG_HEADER: u64 = 32;
const FRAME_HEADER: u64 = 24;
/// Most overflow reads per page, on average. Two are usual; a malicious file could chain all its rows through the same
/// pages.
const OVERFLOW_READS_PER_PAGE: u64 = 32;

/// Location of one image of a page. Later images supersede earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Image {
    /// Page number, from 1.
    pub page: u32,
    in_log: bool,
    at: u64,
}

#[cfg(test)]
impl Image {
    /// Image of a page in the file itself.
    pub(super) const fn in_file(page: u32) -> Self {
        Self {
            page,
            in_log: false,
            at: 0,
        }
    }
}

/// All page images: those of the file, then those of the log.
pub(super) struct Pages {
    file: File,
    log: Option<File>,
    size: usize,
    images: Vec<Image>,
    latest: HashMap<u32, usize>,
    /// Frames of the log with a wrong checksum.
    pub damaged_frames: u64,
    /// Bytes after the last whole page of the file, and after the last whole frame of the log.
    pub cut_bytes: u64,
    /// Remaining budget of overflow reads.
    follow: u64,
}

impl Pages {
    /// Examines the file and the log beside it.
    pub(super) fn open(path: &Path, log: &Path) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let bytes = file.metadata()?.len();
        let mut head = [0u8; 100];
        let known =
            read_at(&mut file, 0, &mut head).is_ok() && head.starts_with(b"SQLite format 3\0");
        let size = match u16::from_be_bytes([head[16], head[17]]) {
            _ if !known => PAGE_BYTES,
            1 => 65536,
            n if n.is_power_of_two() && n >= 512 => u64::from(n),
            _ => PAGE_BYTES,
        };
        let mut pages = Self {
            file,
            log: None,
            size: size as usize,
            images: Vec::new(),
            latest: HashMap::new(),
            damaged_frames: 0,
            cut_bytes: bytes % size,
            follow: 0,
        };
        // A truncated page may still contain whole rows.
        for n in 0..bytes.div_ceil(size) {
            pages.add(n as u32 + 1, false, n * size);
        }
        if let Ok(file) = File::open(log) {
            pages.read_log(file)?;
        }
        pages.follow = OVERFLOW_READS_PER_PAGE * pages.images.len() as u64;
        Ok(pages)
    }

    fn add(&mut self, page: u32, in_log: bool, at: u64) {
        self.latest.insert(page, self.images.len());
        self.images.push(Image { page, in_log, at });
    }

    /// Adds the frames of every committed transaction. Each frame's checksum continues the stored one of the frame before, so it can
    /// be checked even if that frame is damaged. Frames without a later commit were never part of the session: SQLite
    /// writes pages of a large transaction ahead of its commit, and a restarted process overwrites only the beginning
    /// of such a remainder.
    fn read_log(&mut self, mut log: File) -> io::Result<()> {
        let bytes = log.metadata()?.len();
        let mut head = [0u8; LOG_HEADER as usize];
        if read_at(&mut log, 0, &mut head).is_err() {
            self.cut_bytes += bytes;
            return Ok(());
        }
        let stride = FRAME_HEADER + self.size as u64;
        let salts = self.read_salts(&mut log, &head, bytes)?;
        let mut big_endian = word(&head, 0) & 1 == 1;
        let first = checksum(big_endian, [0, 0], &head[..24]);
        // Checksums that the next frame may continue: the stored and the computed one, either of which may be damaged.
        let mut sums = [[word(&head, 24), word(&head, 28)], first];
        let mut frame = vec![0u8; stride as usize];
        let mut uncommitted = Vec::new();
        let mut at = LOG_HEADER;
        while at + stride <= bytes {
            read_at(&mut log, at, &mut frame)?;
            let stored = [word(&frame, 16), word(&frame, 20)];
            let sum = |big_endian, from| {
                let sum = checksum(big_endian, from, &frame[..8]);
                checksum(big_endian, sum, &frame[FRAME_HEADER as usize..])
            };
            let mut computed = stored;
            // Frames of an earlier generation of the log have other salts; their pages are already in the file.
            if [word(&frame, 8), word(&frame, 12)] != salts {
                self.damaged_frames += u64::from(is_damaged(&frame[8..16], salts));
            } else if let Some(order) = [big_endian, !big_endian]
                .into_iter()
                .find(|order| sums.iter().any(|from| sum(*order, *from) == stored))
            {
                big_endian = order;
                uncommitted.push((word(&frame, 0), at + FRAME_HEADER));
                let is_commit = word(&frame, 4) != 0;
                if is_commit {
                    for (page, at) in uncommitted.drain(..) {
                        self.add(page, true, at);
                    }
                }
            } else {
                self.damaged_frames += 1;
                computed = sum(big_endian, sums[0]);
            }
            sums = [stored, computed];
            at += stride;
        }
        self.cut_bytes += bytes - at;
        self.log = Some(log);
        Ok(())
    }

    /// Salts of the log's current generation: from an intact header, otherwise from the first two consecutive frames that
    /// agree.
    fn read_salts(&self, log: &mut File, head: &[u8], bytes: u64) -> io::Result<[u32; 2]> {
        let stored = [word(head, 24), word(head, 28)];
        let is_whole = [false, true]
            .iter()
            .any(|order| checksum(*order, [0, 0], &head[..24]) == stored);
        let mut salts = [word(head, 16), word(head, 20)];
        if is_whole {
            return Ok(salts);
        }
        let stride = FRAME_HEADER + self.size as u64;
        let (mut at, mut before) = (LOG_HEADER, None);
        while at + stride <= bytes {
            let mut frame = [0u8; FRAME_HEADER as usize];
            read_at(log, at, &mut frame)?;
            let found = [word(&frame, 8), word(&frame, 12)];
            if before.is_none() {
                salts = found;
            }
            if before == Some(found) && found != [0, 0] {
                return Ok(found);
            }
            before = Some(found);
            at += stride;
        }
        Ok(salts)
    }

    /// Usable bytes of a page: all of them, since sessions reserve none.
    pub(crate) const fn page_bytes(&self) -> usize {
        self.size
    }

    /// Upper bound of a row's length: all pages together.
    pub(super) const fn most_bytes(&self) -> u64 {
        self.size as u64 * self.images.len() as u64
    }

    /// Reads an overflow page; false if it does not exist or the budget of overflow reads is used up.
    pub(super) fn follow(&mut self, page: u32, bytes: &mut Vec<u8>) -> io::Result<bool> {
        let Some(image) = self.latest(page).filter(|_| self.follow > 0) else {
            return Ok(false);
        };
        self.follow -= 1;
        self.read(image, bytes)?;
        Ok(true)
    }

    /// Whether the budget of overflow reads is used up, so that some rows were not read to their end.
    pub(crate) const fn is_exhausted(&self) -> bool {
        self.follow == 0
    }

    /// All images, oldest first.
    pub(super) fn images(&self) -> Vec<Image> {
        self.images.clone()
    }

    /// Latest image of a page.
    pub(super) fn latest(&self, page: u32) -> Option<Image> {
        self.latest.get(&page).map(|i| self.images[*i])
    }

    /// Bytes of an image; a truncated part is zero.
    pub(super) fn read(&mut self, image: Image, page: &mut Vec<u8>) -> io::Result<()> {
        page.clear();
        page.resize(self.size, 0);
        let file = match (&mut self.log, image.in_log) {
            (Some(log), true) => log,
            _ => &mut self.file,
        };
        file.seek(SeekFrom::Start(image.at))?;
        let mut filled = 0;
        while filled < page.len() {
            match file.read(&mut page[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

fn read_at(file: &mut File, at: u64, bytes: &mut [u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(bytes)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Whether foreign salts mean damage: an earlier generation differs in both, a flipped byte in one.
fn is_damaged(found: &[u8], salts: [u32; 2]) -> bool {
    found[..4] == salts[0].to_be_bytes() || found[4..] == salts[1].to_be_bytes()
}

/// The log's checksum over `bytes`, continuing from `sum` (sqlite.org/fileformat.html section 4.2).
fn checksum(big_endian: bool, sum: [u32; 2], bytes: &[u8]) -> [u32; 2] {
    let [mut a, mut b] = sum;
    for pair in bytes.chunks_exact(8) {
        let word = |i: usize| {
            let four = [pair[i], pair[i + 1], pair[i + 2], pair[i + 3]];
            if big_endian {
                u32::from_be_bytes(four)
            } else {
                u32::from_le_bytes(four)
            }
        };
        a = a.wrapping_add(word(0)).wrapping_add(b);
        b = b.wrapping_add(word(4)).wrapping_add(a);
    }
    [a, b]
}
