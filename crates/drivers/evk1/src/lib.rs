//! The Prophesee EVK1 Gen3.1 as an event camera: registers and streaming over libusb.

pub mod registers;
