//! Parses a page into cells, records and values. Total: any bytes yield rows or nothing.
//!
//! Layout: sqlite.org/fileformat.html, sections 1.6 and 2.

use std::collections::HashSet;
use std::io;

use super::pages::{Image, Pages};

/// Longest row of a session, bytes: a chunk has at most 64 MiB, protocol and plan a few.
const MAX_BYTES: u64 = 256 << 20;
/// Smallest page size that SQLite supports.
const MIN_PAGE_BYTES: usize = 512;
/// Most bytes of rows on a page, relative to its size. Rows do not overlap, but damaged offsets may.
const MAX_OVERLAP: usize = 4;

/// A stored value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Null,
    Int(i64),
    Real(f64),
    Text(String),
    Blob(Vec<u8>),
    /// Text that is not UTF-8.
    InvalidText,
}

/// Location of one row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Row id in a table; `None` on index pages and in tables without row ids.
    pub rowid: Option<i64>,
    at: usize,
    /// Bytes of the whole row, and of its part on this page.
    payload: u64,
    local: usize,
}

/// Cells of a page; empty if it holds no rows.
pub(super) fn cells(image: Image, page: &[u8]) -> Vec<Cell> {
    let start = if image.page == 1 { 100 } else { 0 };
    if page.len() < MIN_PAGE_BYTES {
        return Vec::new();
    }
    // Table leaf; index leaf and index interior page.
    let (keyed, header, child) = match page.get(start) {
        Some(0x0D) => (false, 8, 0),
        Some(0x0A) => (true, 8, 0),
        Some(0x02) => (true, 12, 4),
        _ => return Vec::new(),
    };
    let two = |at: usize| {
        Some(usize::from(u16::from_be_bytes([
            *page.get(at)?,
            *page.get(at + 1)?,
        ])))
    };
    let count = two(start + 3).unwrap_or(0);
    let (mut out, mut filled) = (Vec::new(), 0);
    for i in 0..count {
        let Some(mut at) = two(start + header + 2 * i) else {
            break;
        };
        at += child;
        let Some((payload, n)) = varint(page, at) else {
            continue;
        };
        at += n;
        let mut rowid = None;
        if !keyed {
            let Some((id, n)) = varint(page, at) else {
                continue;
            };
            rowid = Some(id as i64);
            at += n;
        }
        if !(2..=MAX_BYTES).contains(&payload) {
            continue;
        }
        let local = local_bytes(page.len(), payload as usize, keyed);
        filled += local;
        if filled > MAX_OVERLAP * page.len() {
            break;
        }
        out.push(Cell {
            rowid,
            at,
            payload,
            local,
        });
    }
    out
}

impl Cell {
    /// Whether the row is too long to be kept in memory.
    pub(crate) const fn is_long(&self) -> bool {
        self.payload > 64 << 10
    }

    /// Bytes of the row, from its page and its overflow pages; `None` if the chain is broken. Stops after `most` bytes: the first
    /// bytes suffice to identify a long row.
    pub(super) fn payload(
        &self,
        page: &[u8],
        pages: &mut Pages,
        most: usize,
    ) -> io::Result<Option<Vec<u8>>> {
        if self.payload > pages.most_bytes() {
            return Ok(None);
        }
        let (whole, expected) = (self.payload as usize, (self.payload as usize).min(most));
        let Some(first) = page.get(self.at..self.at + self.local) else {
            return Ok(None);
        };
        let mut bytes = first.to_vec();
        let mut next = number(page, self.at + self.local);
        let (mut image, mut visited) = (Vec::new(), HashSet::new());
        while bytes.len() < expected {
            // A valid overflow chain never visits a page twice.
            let Some(n) = next.filter(|n| *n > 1 && visited.insert(*n)) else {
                return Ok(None);
            };
            if !pages.follow(n, &mut image)? {
                return Ok(None);
            }
            let left = (whole - bytes.len()).min(pages.page_bytes() - 4);
            bytes.extend_from_slice(&image[4..4 + left]);
            next = number(&image, 0);
        }
        Ok(Some(bytes))
    }
}

/// Bytes of a row stored on its own page (section 1.6, "cell payload overflow").
fn local_bytes(usable: usize, payload: usize, keyed: bool) -> usize {
    let most = if keyed {
        (usable - 12) * 64 / 255 - 23
    } else {
        usable - 35
    };
    if payload <= most {
        return payload;
    }
    let least = (usable - 12) * 32 / 255 - 23;
    let even = least + (payload - least) % (usable - 4);
    if even <= most { even } else { least }
}

fn number(page: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(page.get(at..at + 4)?.try_into().ok()?))
}

/// A variable-length integer and its length (section 1.6).
fn varint(bytes: &[u8], at: usize) -> Option<(u64, usize)> {
    let mut value = 0u64;
    for i in 0..9 {
        let byte = *bytes.get(at + i)?;
        if i == 8 {
            return Some((value << 8 | u64::from(byte), 9));
        }
        value = value << 7 | u64::from(byte & 0x7F);
        if byte & 0x80 == 0 {
            return Some((value, i + 1));
        }
    }
    None
}

/// Serial types from the header of a record (section 2.1), and the offset of the first value.
pub(crate) fn serial_types(payload: &[u8]) -> Option<(Vec<u64>, usize)> {
    let (head, mut at) = varint(payload, 0)?;
    let head = usize::try_from(head).ok().filter(|h| *h <= payload.len())?;
    let mut types = Vec::new();
    while at < head {
        let (serial, n) = varint(payload, at)?;
        if matches!(serial, 10 | 11) {
            return None;
        }
        types.push(serial);
        at += n;
    }
    (at == head).then_some((types, head))
}

/// Values of a record; `None` if its length contradicts its header.
pub(super) fn values(payload: &[u8]) -> Option<Vec<Value>> {
    let (types, head) = serial_types(payload)?;
    let content = types
        .iter()
        .try_fold(head as u64, |n, t| n.checked_add(content_bytes(*t)))?;
    let whole = content == payload.len() as u64;
    whole.then(|| leading(payload, usize::MAX)).flatten()
}

/// The first `most` values of a record, as far as the possibly truncated `payload` contains them.
pub(crate) fn leading(payload: &[u8], most: usize) -> Option<Vec<Value>> {
    let (types, mut at) = serial_types(payload)?;
    let mut out = Vec::new();
    for serial in types.into_iter().take(most) {
        let Some(content) = usize::try_from(content_bytes(serial))
            .ok()
            .and_then(|n| payload.get(at..at.checked_add(n)?))
        else {
            break;
        };
        at += content.len();
        out.push(value(serial, content)?);
    }
    Some(out)
}

fn value(serial: u64, content: &[u8]) -> Option<Value> {
    Some(match serial {
        0 => Value::Null,
        7 => Value::Real(f64::from_be_bytes(content.try_into().ok()?)),
        8 => Value::Int(0),
        9 => Value::Int(1),
        1..=6 => Value::Int(integer(content)),
        n if n % 2 == 0 => Value::Blob(content.to_vec()),
        _ => String::from_utf8(content.to_vec()).map_or(Value::InvalidText, Value::Text),
    })
}

fn content_bytes(serial: u64) -> u64 {
    match serial {
        0 | 8 | 9 => 0,
        1..=4 => serial,
        5 => 6,
        6 | 7 => 8,
        n => (n - 12) / 2,
    }
}

/// A big-endian two's complement integer of 1 to 8 bytes.
fn integer(bytes: &[u8]) -> i64 {
    let negative = bytes.first().is_some_and(|b| b & 0x80 != 0);
    bytes
        .iter()
        .fold(if negative { -1 } else { 0 }, |value, byte| {
            value << 8 | i64::from(*byte)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_of_every_width_keep_their_sign() {
        for value in [
            0i64,
            1,
            -1,
            127,
            -128,
            8_388_607,
            -8_388_608,
            i64::MAX,
            i64::MIN,
        ] {
            let all = value.to_be_bytes();
            for width in 1..=8 {
                let cut = &all[8 - width..];
                let fits = value << (64 - 8 * width) >> (64 - 8 * width) == value;
                assert_eq!(integer(cut) == value, fits, "{value} in {width}");
            }
        }
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_give_rows_or_nothing(bytes: Vec<u8>, page in 1u32..3, kind in 0usize..4) {
            let mut bytes = bytes;
            bytes.resize(MIN_PAGE_BYTES, 0xFF);
            let start = if page == 1 { 100 } else { 0 };
            if let Some(first) = bytes.get_mut(start) {
                *first = [0x0D, 0x0A, 0x02, 0x05][kind];
            }
            let _ = (values(&bytes), cells(Image::in_file(page), &bytes));
        }
    }
}
