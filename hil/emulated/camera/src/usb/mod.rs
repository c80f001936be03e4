//! The USB side: a folder that looks like a machine's devices, and the system calls on them.

pub(crate) mod descriptors;
pub(crate) mod function;
pub(crate) mod queues;
pub(crate) mod readiness;
pub(crate) mod serve;
pub(crate) mod testbed;
pub(crate) mod usbfs;
pub(crate) mod wire;
