//! The USB side: a folder that looks like a machine's devices, and the system calls on them.

pub mod descriptors;
pub mod function;
pub mod queues;
pub mod readiness;
pub mod serve;
pub mod testbed;
pub mod usbfs;
pub mod wire;
