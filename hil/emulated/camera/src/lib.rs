//! An emulated EVK1 on an emulated USB bus.
