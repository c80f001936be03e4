//! Linux's user-space USB interface as bytes: request numbers and the URB (kernel header `linux/usbdevice_fs.h`).
//!
//! 64-bit machines only: the layout is that of a process whose pointers have eight bytes.

const fn number(direction: u64, nr: u64, size: u64) -> u64 {
    direction << 30 | size << 16 | (b'U' as u64) << 8 | nr
}
const fn none(nr: u64) -> u64 {
    number(0, nr, 0)
}
const fn write(nr: u64, size: u64) -> u64 {
    number(1, nr, size)
}
const fn read(nr: u64, size: u64) -> u64 {
    number(2, nr, size)
}

pub(crate) const RESET_ENDPOINT: u64 = read(3, 4);
pub(crate) const SET_INTERFACE: u64 = read(4, 8);
pub(crate) const SET_CONFIGURATION: u64 = read(5, 4);
pub(crate) const GET_DRIVER: u64 = write(8, 260);
pub(crate) const SUBMIT_URB: u64 = read(10, URB_BYTES as u64);
pub(crate) const DISCARD_URB: u64 = none(11);
pub(crate) const REAP_URB_NO_DELAY: u64 = write(13, 8);
pub(crate) const CLAIM_INTERFACE: u64 = read(15, 4);
pub(crate) const RELEASE_INTERFACE: u64 = read(16, 4);
pub(crate) const RESET: u64 = none(20);
pub(crate) const CLEAR_HALT: u64 = read(21, 4);
pub(crate) const GET_CAPABILITIES: u64 = read(26, 4);
pub(crate) const DISCONNECT_CLAIM: u64 = read(27, 264);

/// Zero packet, bulk continuation, no packet size limit, scatter-gather, reap after disconnect.
pub(crate) const CAPABILITIES: u32 = 0x1f;

pub(crate) const URB_BYTES: usize = 56;
const CONTROL: u8 = 2;
const BULK: u8 = 3;

/// `struct usbdevfs_urb`, kept as bytes so that unknown fields return unchanged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Urb([u8; URB_BYTES]);

/// Type of a URB's transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transfer {
    Control,
    BulkIn(u8),
    BulkOut(u8),
    Other,
}

impl Urb {
    pub(crate) const fn new(bytes: [u8; URB_BYTES]) -> Self {
        Self(bytes)
    }

    pub(crate) const fn transfer(&self) -> Transfer {
        match (self.0[0], self.0[1]) {
            (CONTROL, _) => Transfer::Control,
            (BULK, endpoint) if endpoint & 0x80 != 0 => Transfer::BulkIn(endpoint),
            (BULK, endpoint) => Transfer::BulkOut(endpoint),
            _ => Transfer::Other,
        }
    }

    /// Address of the data in the submitting process.
    pub(crate) fn buffer(&self) -> u64 {
        u64::from_ne_bytes(self.field(16))
    }

    /// Number of requested bytes; 0 if the caller's number is negative.
    pub(crate) fn length(&self) -> usize {
        usize::try_from(i32::from_ne_bytes(self.field(24))).unwrap_or(0)
    }

    /// Writes the outcome: 0 or a negative error number, and the bytes moved.
    pub(crate) fn finish(&mut self, status: i32, moved: usize) {
        self.0[4..8].copy_from_slice(&status.to_ne_bytes());
        let moved = i32::try_from(moved).unwrap_or(i32::MAX);
        self.0[28..32].copy_from_slice(&moved.to_ne_bytes());
    }

    pub(crate) const fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    fn field<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field = [0; N];
        field.copy_from_slice(&self.0[at..at + N]);
        field
    }
}

/// The eight bytes that open a control transfer (USB 2.0 section 9.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Setup {
    pub request_type: u8,
    pub request: u8,
    pub value: u16,
    pub index: u16,
    pub length: u16,
}

impl Setup {
    pub(crate) const fn new(b: [u8; 8]) -> Self {
        Self {
            request_type: b[0],
            request: b[1],
            value: u16::from_le_bytes([b[2], b[3]]),
            index: u16::from_le_bytes([b[4], b[5]]),
            length: u16::from_le_bytes([b[6], b[7]]),
        }
    }

    /// Device to host.
    pub(crate) const fn is_in(&self) -> bool {
        self.request_type & 0x80 != 0
    }

    /// Vendor request.
    pub(crate) const fn is_vendor(&self) -> bool {
        self.request_type & 0x60 == 0x40
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn request_numbers_are_the_kernels() {
        // As printed by the kernel's header on a 64-bit machine.
        assert_eq!(SUBMIT_URB, 0x8038_550a);
        assert_eq!(DISCARD_URB, 0x550b);
        assert_eq!(REAP_URB_NO_DELAY, 0x4008_550d);
        assert_eq!(CLAIM_INTERFACE, 0x8004_550f);
        assert_eq!(RESET, 0x5514);
        assert_eq!(GET_CAPABILITIES, 0x8004_551a);
        assert_eq!(DISCONNECT_CLAIM, 0x8108_551b);
    }
}
