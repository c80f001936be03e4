//! The pages of a session file and of its log, read without SQLite and whatever state they are in.
//!
//! Layout of both files: sqlite.org/fileformat.html, sections 1.2 to 1.5 and 4.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes of a page, when the first page no longer tells: what every session is made with.
const PAGE_BYTES: u64 = 65536;
/// Bytes before the first frame of a log, and before the page of each frame.
const LOG_HEADER: u64 = 32;
const FRAME_HEADER: u64 = 24;
/// How often, on average, a page is read because a row goes on there. Twice is usual; a file made to keep its reader busy
/// has all its rows go on to the same pages.
const FOLLOWED: u64 = 32;

/// Where one image of a page lies. Later ones supersede earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Image {
    /// Which page, from 1.
    pub page: u32,
    in_log: bool,
    at: u64,
}

#[cfg(test)]
impl Image {
    /// The image of a page in the file itself.
    pub const fn in_file(page: u32) -> Self {
        Self {
            page,
            in_log: false,
            at: 0,
        }
    }
}

/// Every image of every page that can be told: those of the file, then those of the log.
pub struct Pages {
    file: File,
    log: Option<File>,
    size: usize,
    images: Vec<Image>,
    latest: HashMap<u32, usize>,
    /// Frames of the log whose checksum is wrong.
    pub damaged_frames: u64,
    /// Bytes after the last whole page of the file, and after the last whole frame of the log.
    pub cut_bytes: u64,
    /// Pages that rows may still go on to.
    follow: u64,
}

impl Pages {
    /// Looks at the file and at the log beside it.
    pub fn open(path: &Path, log: &Path) -> io::Result<Self> {
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
        // A page that was cut off may still hold whole rows.
        for n in 0..bytes.div_ceil(size) {
            pages.add(n as u32 + 1, false, n * size);
        }
        if let Ok(file) = File::open(log) {
            pages.read_log(file)?;
        }
        pages.follow = FOLLOWED * pages.images.len() as u64;
        Ok(pages)
    }

    fn add(&mut self, page: u32, in_log: bool, at: u64) {
        self.latest.insert(page, self.images.len());
        self.images.push(Image { page, in_log, at });
    }

    /// Takes the frames of every transaction that was committed. A frame is chained to the one before by the sum stored there, so
    /// that it can be judged although the page before it is damaged. What no commit follows was never part of the session:
    /// SQLite writes pages of a large transaction ahead of its commit, and a later life of the process writes over
    /// the beginning of what such a one left only.
    fn read_log(&mut self, mut log: File) -> io::Result<()> {
        let bytes = log.metadata()?.len();
        let mut head = [0u8; LOG_HEADER as usize];
        if read_at(&mut log, 0, &mut head).is_err() {
            self.cut_bytes += bytes;
            return Ok(());
        }
        let stride = FRAME_HEADER + self.size as u64;
        let salts = self.salts(&mut log, &head, bytes)?;
        let mut big_endian = word(&head, 0) & 1 == 1;
        let first = checksum(big_endian, [0, 0], &head[..24]);
        // The sums that the next frame may go on from: as stored and as computed, for either may be damaged.
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
            // Frames of an earlier turn of the log have other salts: they are in the file already.
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

    /// What marks the frames of the log's last turn: as its header says, when the header is whole, else as the first two frames
    /// in a row that agree say.
    fn salts(&self, log: &mut File, head: &[u8], bytes: u64) -> io::Result<[u32; 2]> {
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

    /// Bytes of a page. SQLite uses all of them: sessions are made with none reserved.
    pub(crate) const fn page_bytes(&self) -> usize {
        self.size
    }

    /// No row is longer than all pages together.
    pub const fn most_bytes(&self) -> u64 {
        self.size as u64 * self.images.len() as u64
    }

    /// Reads the page on which a row goes on; false when there is none, or rows went on to more pages than those of a session do.
    pub fn follow(&mut self, page: u32, bytes: &mut Vec<u8>) -> io::Result<bool> {
        let Some(image) = self.latest(page).filter(|_| self.follow > 0) else {
            return Ok(false);
        };
        self.follow -= 1;
        self.read(image, bytes)?;
        Ok(true)
    }

    /// Whether some row was not read to its end because rows went on to too many pages.
    pub(crate) const fn is_exhausted(&self) -> bool {
        self.follow == 0
    }

    /// Every image, earlier ones first.
    pub fn images(&self) -> Vec<Image> {
        self.images.clone()
    }

    /// The latest image of a page.
    pub fn latest(&self, page: u32) -> Option<Image> {
        self.latest.get(&page).map(|i| self.images[*i])
    }

    /// The bytes of an image; what was cut off is zero.
    pub fn read(&mut self, image: Image, page: &mut Vec<u8>) -> io::Result<()> {
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

/// Whether foreign salts are damage: an earlier turn differs in both, a flipped byte in one.
fn is_damaged(found: &[u8], salts: [u32; 2]) -> bool {
    found[..4] == salts[0].to_be_bytes() || found[4..] == salts[1].to_be_bytes()
}

/// The log's checksum over `bytes`, going on from `sum` (sqlite.org/fileformat.html section 4.2).
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
