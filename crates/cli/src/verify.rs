//! `skinrig verify`.

use skinrig_recorder::{RecorderError, SessionReader, verify as recheck};

use crate::args::SessionArg;
use crate::exit::{Exit, Failure, Outcome};
use crate::source::Rescan;

/// Recomputes everything in a session.
///
/// # Errors
/// [`Failure::input`] for a file that is no session; [`Failure::limit`] when something does not match.
pub fn verify(args: &SessionArg, json: bool) -> Outcome {
    if let Err(e @ RecorderError::NotASession { .. }) = SessionReader::open(&args.session) {
        return Err(Failure::input(e));
    }
    let report = recheck(&args.session, &mut Rescan::default()).map_err(Failure::input)?;
    let name = args.session.display();
    if json {
        crate::print_json(&serde_json::json!({
            "session": args.session, "sound": report.is_sound(), "sealed": report.sealed,
            "problems": report.problems, "more_problems": report.more_problems,
            "totals": report.totals,
        }));
    } else {
        for problem in &report.problems {
            // Some problems name the file themselves.
            let problem = problem
                .strip_prefix(&format!("{name}: "))
                .unwrap_or(problem);
            outln!("{name}: {problem}");
        }
        if report.more_problems > 0 {
            outln!("{name}: and {} more", report.more_problems);
        }
        if let (true, Some(t)) = (report.is_sound(), report.totals) {
            outln!(
                "{name}: sound{}; {} presses, {} events, {} chunks, {:.1} MB of camera bytes, {} pose samples",
                if report.sealed {
                    ", sealed"
                } else {
                    ", but not sealed: camera bytes, poses and counts were checked, not every byte"
                },
                t.presses.planned + t.sync.planned,
                t.cd_events,
                t.chunks,
                t.raw_bytes as f64 / 1e6,
                t.pose_samples
            );
        }
    }
    if report.is_sound() {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {} problem(s); the file is not what was recorded",
            report.problems.len() as u64 + report.more_problems
        )))
    }
}
