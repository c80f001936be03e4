//! USB constants of an EVK1: IDs, interface, endpoint, and vendor requests on control endpoint 0 (bmRequestType
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

/// Reads a register: 8 bytes; byte 0 is [`READ_OK`], bytes 4..8 the value, big-endian. wValue is the low
/// half of the address, wIndex the high half, as for [`WRITE_REGISTER`].
pub const READ_REGISTER: u8 = 0x55;
/// Writes a register: 4 bytes, big-endian.
pub const WRITE_REGISTER: u8 = 0x56;
/// First byte of a successful reply to [`READ_REGISTER`].
pub const READ_OK: u8 = 0x40;
/// Board type: 4 bytes; the value is byte 2 + 256 byte 3, as for the next two.
pub const BOARD_VERSION: u8 = 0x70;
/// Nonzero once the FPGA is configured.
pub const FPGA_BOOT_STATE: u8 = 0x71;
/// System ID of the FPGA image.
pub const SYSTEM_ID: u8 = 0x72;
/// Version of the FX3's firmware: 8 bytes; bytes 0..4 little-endian are 0x00MMmmuu.
pub const FX3_VERSION: u8 = 0x79;

/// Reply of an EVK1 to [`BOARD_VERSION`].
pub const BOARD_EVK1: u16 = 2;
/// Reply of an EVK1 Gen3.1 to [`SYSTEM_ID`].
pub const SYSTEM_GEN31: u16 = 0x1c;
/// Reply of a board with its rescue image to [`SYSTEM_ID`].
pub(crate) const SYSTEM_GOLDEN: u16 = 0x11;
