//! The largest resident memory of this process and the bytes that it read, where the system tells them.

/// Forgets the largest resident memory so far, where the system can.
pub fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Largest resident memory since the start or the last reset, MB; `None` where the system does not say.
#[must_use]
pub fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib * 1024.0 / 1e6)
}

/// Bytes that this process has asked the system to read since it began; `None` where the system does not say.
#[must_use]
pub fn bytes_read() -> Option<u64> {
    let counters = std::fs::read_to_string("/proc/self/io").ok()?;
    let line = counters.lines().find_map(|l| l.strip_prefix("rchar:"))?;
    line.trim().parse().ok()
}
