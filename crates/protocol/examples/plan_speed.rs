//! Measures parse, compile and check of a protocol: `cargo run --release -p skinrig-protocol --example plan_speed -- FILE [RUNS]`.
//!
//! Each run does everything from the file's bytes on; the median of all runs is printed.

use std::io::Write;
use std::time::Instant;

use skinrig_protocol::{Protocol, check};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments
        .next()
        .ok_or("expected the name of a protocol file")?;
    let runs: usize = arguments.next().map_or(Ok(101), |n| n.parse())?;
    let bytes = std::fs::read(&file)?;
    let mut times = Vec::with_capacity(runs);
    let mut lines = String::new();
    for _ in 0..runs.max(1) {
        let start = Instant::now();
        let protocol = Protocol::parse(&file, &bytes, &[], &|p| std::fs::read(p))?;
        let parsed = start.elapsed();
        let start = Instant::now();
        let plan = protocol.compile();
        let compiled = start.elapsed();
        let start = Instant::now();
        let violations = check(&plan, &protocol.surroundings, Some(protocol.motion.home));
        times.push((parsed, compiled, start.elapsed()));
        lines = format!("{}\n{} violations", plan.summary(), violations.len());
    }
    let median = |part: fn(
        &(
            std::time::Duration,
            std::time::Duration,
            std::time::Duration,
        ),
    ) -> std::time::Duration| {
        let mut all: Vec<_> = times.iter().map(part).collect();
        all.sort_unstable();
        all.get(all.len() / 2).copied().unwrap_or_default()
    };
    writeln!(
        std::io::stdout(),
        "{lines}\nparse {:?} (with one trial compile), compile {:?}, check {:?}: medians of {runs} runs",
        median(|t| t.0),
        median(|t| t.1),
        median(|t| t.2)
    )?;
    Ok(())
}
