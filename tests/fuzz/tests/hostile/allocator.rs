//! An allocator that counts held memory, and rejects requests that no input may cause.
#![expect(
    unsafe_code,
    reason = "the trait of allocators is unsafe; every call goes on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A single larger request fails, as on a machine without that memory.
const REFUSED: usize = 1 << 30;

/// Counts for the whole process.
pub struct CountingAllocator {
    held: AtomicUsize,
    peak: AtomicUsize,
}

impl CountingAllocator {
    pub const fn new() -> Self {
        Self {
            held: AtomicUsize::new(0),
            peak: AtomicUsize::new(0),
        }
    }

    /// Resets the peak; returns the present value.
    pub fn reset_peak(&self) -> usize {
        let held = self.held.load(Relaxed);
        self.peak.store(held, Relaxed);
        held
    }

    /// Peak since the last reset, bytes.
    pub fn peak(&self) -> usize {
        self.peak.load(Relaxed)
    }

    fn add(&self, bytes: usize) {
        let held = self.held.fetch_add(bytes, Relaxed) + bytes;
        self.peak.fetch_max(held, Relaxed);
    }

    fn less(&self, bytes: usize) {
        self.held.fetch_sub(bytes, Relaxed);
    }
}

// SAFETY: every method hands its arguments unchanged to the system's allocator and its answer back, or answers null, which the
// trait allows at any time; the counters have no influence on either.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if layout.size() > REFUSED {
            return std::ptr::null_mut();
        }
        self.add(layout.size());
        // SAFETY: the caller's promise about `layout` is the system's too.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if layout.size() > REFUSED {
            return std::ptr::null_mut();
        }
        self.add(layout.size());
        // SAFETY: as for `alloc`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        self.less(layout.size());
        // SAFETY: `pointer` came from `alloc` here, that is from the system, with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if size > REFUSED {
            return std::ptr::null_mut();
        }
        self.less(layout.size());
        self.add(size);
        // SAFETY: `pointer` came from `alloc` here, that is from the system, with this layout; `size` is the caller's.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
