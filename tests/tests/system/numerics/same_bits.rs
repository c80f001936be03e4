//! Identical sessions give identical bytes, for any number of threads and any slicing of the events.

use skinrig_analysis::{SessionInput, analyze};

use skinrig_planted::Memory;
use skinrig_planted::grid::session;

fn bytes(threads: usize, input: &SessionInput, source: &Memory) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let work = || serde_json::to_string(&analyze(input, source).unwrap()).unwrap();
    pool.build().unwrap().install(work)
}

#[test]
fn one_thread_or_two_and_slices_of_any_size_give_identical_bytes() {
    let (mut input, mut source) = session();
    input.settings.study_presses = 8;
    input.settings.reduction.seeds = 2;
    let expected = bytes(1, &input, &source);
    assert!(expected.len() > 100_000);
    for (threads, slice) in [(2, 1000), (2, 1), (3, 4096), (1, usize::MAX)] {
        source.slice = slice;
        let found = bytes(threads, &input, &source);
        assert!(found == expected, "{threads} threads, slices of {slice}");
    }
    // Control: another seed gives other bytes.
    input.settings.seed += 1;
    assert!(bytes(2, &input, &source) != expected);
}
