//! Tests in real time, and whether this machine kept up: a failure while it delayed its threads says nothing about the program.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::slot::Slot;

/// Attempts of a test.
const ATTEMPTS: u32 = 6;
/// Failures that count, while this machine kept up as far as one thread can tell: threads of the drivers work more and may be delayed
/// when it is not. A defect fails again.
const FAILURES: u32 = 2;
/// The drivers allow their devices a tenth of a second (`docs/reference/runs.md`); several threads take part in each step, and each
/// may be late several times as long as the gauge.
const LATE: Duration = Duration::from_millis(10);
/// Pause of the gauge between two readings, and its work in each.
const REST: Duration = Duration::from_millis(10);
const WORK: Duration = Duration::from_micros(500);

/// Runs a test, and again if it fails while this machine was late, or for the first time.
pub(crate) fn in_real_time(test: impl Fn()) {
    let _slot = Slot::wait();
    let mut failures = 0;
    for attempt in 1.. {
        let gauge = Gauge::start();
        let result = catch_unwind(AssertUnwindSafe(&test));
        let late = gauge.end();
        match result {
            Ok(()) => return,
            Err(failure) => {
                failures += u32::from(late < LATE);
                if failures == FAILURES || attempt == ATTEMPTS {
                    resume_unwind(failure);
                }
                eprintln!("this machine was {late:?} late: attempt {attempt} is repeated");
            }
        }
    }
}

/// Measures how late a thread is that rests and works by turns.
struct Gauge {
    thread: JoinHandle<()>,
    ended: Arc<AtomicBool>,
    late_ns: Arc<AtomicU64>,
}

impl Gauge {
    fn start() -> Self {
        let ended = Arc::new(AtomicBool::new(false));
        let late_ns = Arc::new(AtomicU64::new(0));
        let (end, latest) = (Arc::clone(&ended), Arc::clone(&late_ns));
        let thread = std::thread::spawn(move || {
            while !end.load(Ordering::Relaxed) {
                let begin = Instant::now();
                std::thread::park_timeout(REST);
                let mut last = Instant::now();
                let mut worked = Duration::ZERO;
                // Time that passes between two looks at the clock is work, unless the thread was interrupted.
                while worked < WORK {
                    let now = Instant::now();
                    worked += (now - last).min(WORK / 10);
                    last = now;
                }
                let late = begin.elapsed().saturating_sub(REST + WORK);
                latest.fetch_max(late.as_nanos() as u64, Ordering::Relaxed);
            }
        });
        Self {
            thread,
            ended,
            late_ns,
        }
    }

    /// The longest delay.
    fn end(self) -> Duration {
        self.ended.store(true, Ordering::Relaxed);
        self.thread.thread().unpark();
        self.thread.join().unwrap();
        Duration::from_nanos(self.late_ns.load(Ordering::Relaxed))
    }
}

#[test]
fn a_test_that_always_fails_fails() {
    let attempts = AtomicU64::new(0);
    let failing = || {
        attempts.fetch_add(1, Ordering::Relaxed);
        panic!("always");
    };
    let result = catch_unwind(AssertUnwindSafe(|| in_real_time(failing)));
    assert!(result.is_err());
    let attempts = attempts.into_inner();
    assert!((1..=u64::from(ATTEMPTS)).contains(&attempts), "{attempts}");
}
