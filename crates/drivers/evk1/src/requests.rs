//! The USB side of an EVK1 as data: IDs, interface, endpoint, and vendor requests on control endpoint 0 (bmRequestType
//! 0xC0 in, 0x40 out).
//!
//! Source: OpenEB 3.1.2, `hal_psee_plugins` (`psee_libusb_board_command`, `vendor_command_definition.h`).

/// Vendor and product IDs under which an EVK1 appears; other cameras share them.
pub const USB_IDS: [(u16, u16); 3] = [(0x04b4, 0x00f4), (0x04b4, 0x00f1), (0x04b4, 0x00bc)];
/// Interface subclass of Treuzell cameras, which must never receive an EVK1 request.
pub(crate) const TREUZELL_SUBCLASS: u8 = 0x19;
/// The interface to claim.
pub const INTERFACE: u8 = 0;
/// Bulk endpoint of the event stream.
pub(crate) const EVENT_ENDPOINT: u8 = 0x81;

/// Reads a register: 8 bytes asked; byte 0 is [`READ_OK`], bytes 4..8 the value, big-endian. wValue is the low
/// half of the address, wIndex the high half; so for [`WRITE_REGISTER`].
pub const READ_REGISTER: u8 = 0x55;
/// Writes a register: 4 bytes, big-endian.
pub const WRITE_REGISTER: u8 = 0x56;
/// First byte of an answer to [`READ_REGISTER`] that succeeded.
pub const READ_OK: u8 = 0x40;
/// Kind of board: 4 bytes asked; the answer is byte 2 + 256 byte 3; so for the next two.
pub const BOARD_VERSION: u8 = 0x70;
/// Not 0 once the FPGA is configured.
pub const FPGA_BOOT_STATE: u8 = 0x71;
/// Which system the FPGA image is.
pub const SYSTEM_ID: u8 = 0x72;
/// Version of the FX3's firmware: 8 bytes asked; bytes 0..4 little-endian are 0x00MMmmuu.
pub const FX3_VERSION: u8 = 0x79;

/// Answer of an EVK1 to [`BOARD_VERSION`].
pub const BOARD_EVK1: u16 = 2;
/// Answer of an EVK1 Gen3.1 to [`SYSTEM_ID`].
pub const SYSTEM_GEN31: u16 = 0x1c;
/// Answer of a board that runs its rescue image to [`SYSTEM_ID`].
pub(crate) const SYSTEM_GOLDEN: u16 = 0x11;
