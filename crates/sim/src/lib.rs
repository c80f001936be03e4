//! A seeded skin world, simulated devices, replayed devices, fault injection.

pub mod scene;
