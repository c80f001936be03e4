//! An object as SQLite reads it: blocks of it, fetched as they are needed and kept for a while.

use std::collections::{HashMap, VecDeque};
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

use crate::address::ObjectUrl;
use crate::store::{Store, StoreError};

/// Size of a block, bytes: a few pages of SQLite.
const BLOCK: u64 = 64 * 1024;
/// Most blocks that one request fetches, 4 MiB: reached by doubling while reads go on in order.
const MOST_AHEAD: u64 = 64;
/// Blocks that are kept, 32 MiB.
const KEPT: usize = 512;

/// An open object. Its bytes are those that it had when it was opened.
#[derive(Debug)]
pub(crate) struct Pages {
    store: Arc<Store>,
    url: ObjectUrl,
    tag: Option<String>,
    pub(crate) bytes: u64,
    blocks: HashMap<u64, Box<[u8]>>,
    /// The kept blocks, oldest first.
    order: VecDeque<u64>,
    /// The block after the last request, and how many blocks that fetched.
    ahead: (u64, u64),
}

impl Pages {
    pub(crate) fn open(store: Arc<Store>, url: ObjectUrl) -> Result<Self, StoreError> {
        let found = store.head(&url)?;
        Ok(Self {
            store,
            url,
            tag: found.e_tag,
            bytes: found.size,
            blocks: HashMap::new(),
            order: VecDeque::new(),
            ahead: (0, 1),
        })
    }

    /// Fills `out` with the bytes from `offset` on; returns how many there are.
    pub(crate) fn read(&mut self, offset: u64, out: &mut [u8]) -> Result<usize, StoreError> {
        let end = self.bytes.min(offset.saturating_add(out.len() as u64));
        let mut at = offset;
        while at < end {
            let block = at / BLOCK;
            if !self.blocks.contains_key(&block) {
                self.fetch(block)?;
            }
            let Some(bytes) = self.blocks.get(&block) else {
                break;
            };
            let within = (at % BLOCK) as usize;
            let to = (at - offset) as usize;
            let count = (bytes.len() - within.min(bytes.len())).min((end - at) as usize);
            if count == 0 {
                break;
            }
            out[to..to + count].copy_from_slice(&bytes[within..within + count]);
            at += count as u64;
        }
        Ok(at.saturating_sub(offset) as usize)
    }

    fn fetch(&mut self, first: u64) -> Result<(), StoreError> {
        let count = match self.ahead {
            (next, last) if next == first => (2 * last).min(MOST_AHEAD),
            _ => 1,
        };
        let from = first * BLOCK;
        let to = self.bytes.min(from + count * BLOCK);
        let bytes = self.store.range(&self.url, self.tag.as_deref(), from..to)?;
        for (block, part) in (first..).zip(bytes.chunks(BLOCK as usize)) {
            if self.blocks.insert(block, part.into()).is_none() {
                self.order.push_back(block);
            }
        }
        self.ahead = (first + count, count);
        while self.order.len() > KEPT {
            let oldest = self.order.pop_front();
            oldest.map(|block| self.blocks.remove(&block));
        }
        Ok(())
    }

    pub(crate) fn url(&self) -> &ObjectUrl {
        &self.url
    }

    pub(crate) fn store(&self) -> &Store {
        &self.store
    }
}

/// The bytes of an object, from a place on.
#[derive(Debug)]
pub(crate) struct PageReader {
    pub(crate) pages: Pages,
    pub(crate) at: u64,
}

impl Read for PageReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.pages.read(self.at, out).map_err(io::Error::other)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for PageReader {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.pages.bytes.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}
