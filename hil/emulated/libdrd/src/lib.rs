//! A stand-in for libdrd: the same C interface over a simulated arm whose firmware is a process of its own.
