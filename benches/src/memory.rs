//! Peak resident memory of this process and bytes that it read, if the system reports them.

/// Resets the peak resident memory, if the system supports it.
pub fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Peak resident memory since the start or the last reset, MB; `None` if the system does not report it.
#[must_use]
pub fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib * 1024.0 / 1e6)
}

/// Bytes read by this process since its start; `None` if the system does not report it.
#[must_use]
pub fn bytes_read() -> Option<u64> {
    let counters = std::fs::read_to_string("/proc/self/io").ok()?;
    let line = counters.lines().find_map(|l| l.strip_prefix("rchar:"))?;
    line.trim().parse().ok()
}
