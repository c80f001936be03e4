//! Runs every target over its corpus and over seeded mutations of it: no panic in any thread, no memory beyond the bound,
//! and termination.
//!
//! `SKINRIG_FUZZ_FACTOR` multiplies the number of mutations, `SKINRIG_FUZZ_SEED` selects others.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]
#![expect(
    clippy::print_stderr,
    reason = "a case that hangs is told before the process ends"
)]

mod allocator;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

use skinrig_fuzz::mutate::{Dice, mutate};
use skinrig_fuzz::{Target, target};

use self::allocator::CountingAllocator;

#[global_allocator]
static MEMORY: CountingAllocator = CountingAllocator::new();

/// Timeout of a case. Generous, because other programs compete for the processors.
const HANGS: Duration = Duration::from_secs(120);

/// Panics of any thread so far.
static PANICS: AtomicU64 = AtomicU64::new(0);
/// The running case, and its start.
static CASE: Mutex<Option<(String, Vec<u8>, Instant)>> = Mutex::new(None);
/// Memory is counted for the whole process, so only one target runs at a time.
static TURN: Mutex<()> = Mutex::new(());

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts panics, and ends the process when a case hangs.
fn watch() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let default_hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            PANICS.fetch_add(1, Relaxed);
            default_hook(info);
        }));
        std::thread::spawn(|| {
            loop {
                std::thread::sleep(Duration::from_secs(1));
                let hanging = match &*lock(&CASE) {
                    Some((name, bytes, since)) if since.elapsed() > HANGS => {
                        Some((name.clone(), save_input(name, bytes)))
                    }
                    _ => None,
                };
                if let Some((name, path)) = hanging {
                    eprintln!(
                        "{name}: expected an end, found none in {HANGS:?}: {}",
                        path.display()
                    );
                    std::process::abort();
                }
            }
        });
    });
}

/// Writes an input to a file, for inspection and the corpus.
fn save_input(name: &str, bytes: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("skinrig-fuzz-{}.bin", name.replace(' ', "-")));
    std::fs::write(&path, bytes).expect("the temporary folder takes a file");
    path
}

fn number(variable: &str, otherwise: u64) -> u64 {
    match std::env::var(variable) {
        Ok(text) => text.parse().expect("a whole number"),
        Err(_) => otherwise,
    }
}

/// Runs one case; `name` identifies it. Returns its peak memory.
fn run(target: &Target, name: &str, bytes: &[u8]) -> usize {
    *lock(&CASE) = Some((name.to_owned(), bytes.to_vec(), Instant::now()));
    let panics = PANICS.load(Relaxed);
    let held = MEMORY.reset_peak();
    let ended = catch_unwind(AssertUnwindSafe(|| target.run(bytes)));
    let peak = MEMORY.peak().saturating_sub(held);
    *lock(&CASE) = None;
    let bound = target.bound.of(bytes.len());
    if ended.is_err() || PANICS.load(Relaxed) > panics || peak > bound {
        let path = save_input(name, bytes);
        panic!(
            "{name}: expected no panic and at most {bound} bytes of memory, found {} panic(s) and {peak} bytes for the input {}; \
             mend the reader, and add the input to tests/fuzz/corpus/{}",
            PANICS.load(Relaxed) - panics,
            path.display(),
            target.name
        );
    }
    peak
}

fn hostile(name: &str) {
    let _turn = lock(&TURN);
    watch();
    let target = target(name);
    let files = target.corpus().unwrap();
    let corpus: Vec<Vec<u8>> = files.iter().map(|f| std::fs::read(f).unwrap()).collect();
    assert!(!corpus.is_empty(), "{name}: a target without a corpus");
    let trace = std::env::var_os("SKINRIG_FUZZ_TRACE").is_some();
    for (file, bytes) in files.iter().zip(&corpus) {
        let file = file.file_name().unwrap().to_string_lossy();
        run(&target, &format!("{name} {file}"), bytes);
    }
    run(&target, &format!("{name} empty"), &[]);
    let seed = number("SKINRIG_FUZZ_SEED", 1);
    let (mut largest, began) = (0, Instant::now());
    let cases = target.cases * number("SKINRIG_FUZZ_FACTOR", 1);
    for case in 0..cases {
        // Each case is independent, so that it can be reproduced alone.
        let mut dice = Dice::seeded(seed.wrapping_mul(0x1_0000_0001).wrapping_add(case));
        let mut bytes = corpus[dice.below(corpus.len())].clone();
        let other = &corpus[dice.below(corpus.len())];
        mutate(
            &mut bytes,
            other,
            target.dictionary,
            target.longest,
            &mut dice,
        );
        let case = format!("{name} seed {seed} case {case}");
        if trace {
            eprintln!(
                "{case}: {}",
                save_input(&format!("{name} last"), &bytes).display()
            );
        }
        largest = largest.max(run(&target, &case, &bytes));
    }
    eprintln!(
        "{name}: {cases} cases in {:.1?}, at most {} kB held",
        began.elapsed(),
        largest / 1000
    );
}

macro_rules! targets {
    ($($function:ident $name:literal,)*) => {
        $(#[test]
        fn $function() {
            hostile($name);
        })*

        #[test]
        fn every_target_is_run() {
            let run = [$($name),*];
            assert_eq!(skinrig_fuzz::all().map(|t| t.name), run);
        }
    };
}

targets! {
    camera_words "stream",
    folded_chunks "folded",
    raw_files "raw",
    hdf5_files "hdf5",
    position_tables "csv",
    bias_files "biases",
    protocols "protocol",
    schedules "schedule",
    rig_files "rig",
    trigger_box_replies "box",
    robot_library_answers "robot",
    session_files "session",
}

#[test]
fn a_claimed_length_alone_takes_no_memory() {
    let _turn = lock(&TURN);
    let held = MEMORY.reset_peak();
    // Two words that claim to unfold to a quarter of a gigabyte.
    let fault = skinrig_formats::codec::unfold(&[0; 8], 1 << 28).unwrap_err();
    assert!(fault.to_string().contains("in all"), "{fault}");
    assert!(
        MEMORY.peak() - held < 1 << 16,
        "{} bytes",
        MEMORY.peak() - held
    );
}

#[test]
fn memory_and_panics_are_noticed() {
    let _turn = lock(&TURN);
    let greedy = Target {
        function: |bytes| drop(vec![1u8; bytes.len() << 20]),
        bound: skinrig_fuzz::Bound {
            fixed: 1 << 20,
            per_byte: 1,
        },
        ..target("csv")
    };
    run(&greedy, "greedy", &[]);
    let panic = catch_unwind(|| run(&greedy, "greedy", &[0; 8])).unwrap_err();
    assert!(
        panic
            .downcast_ref::<String>()
            .unwrap()
            .contains("expected no panic and at most 1048584 bytes")
    );
    watch();
    let nervous = Target {
        function: |_| _ = std::thread::spawn(|| panic!("in another thread")).join(),
        ..greedy
    };
    assert!(catch_unwind(|| run(&nervous, "nervous", &[])).is_err());
}
