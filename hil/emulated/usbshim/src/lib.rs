//! A preload library that sends a process's USB system calls to an emulated bus.
