//! The hidden command `hold-arm`: holds the arm in free air until its parent closes standard input
//! or kills it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use skinrig_device::RealClock;

use super::args::HoldArmArgs;
use super::real_bench::timing_slack_of;
use crate::exit::{Exit, Failure, Outcome};
use crate::rig::bench;

/// Prefix of the line that it prints once it holds the arm. The tip position in the robot frame,
/// mm, follows.
pub(crate) const HOLDING: &str = "holding ";
/// Time limit for holding; drills are shorter.
const MAX_HOLD: Duration = Duration::from_secs(120);
/// Time limit to retract and brake at the end. After that the process exits, and the supervisor
/// brakes the arm.
const RELEASE_TIMEOUT: Duration = Duration::from_secs(15);

/// Holds the arm as long as standard input stays open.
///
/// # Errors
/// [`Failure::rig`] when the robot fails.
pub(crate) fn hold(args: &HoldArmArgs) -> Outcome {
    let rig = bench::load(&args.rig)?;
    let input_closed = Arc::new(AtomicBool::new(false));
    let closed = Arc::clone(&input_closed);
    std::thread::Builder::new()
        .name("hold-arm".to_owned())
        .spawn(move || {
            // The pipe also closes when the parent dies.
            let _ = std::io::stdin().lock().read_to_end(&mut Vec::new());
            closed.store(true, Ordering::SeqCst);
            std::thread::sleep(RELEASE_TIMEOUT);
            std::process::exit(i32::from(Exit::Rig.code()));
        })
        .map_err(Failure::internal)?;
    let mut clock = RealClock::start();
    let mut omega = bench::omega(bench::omega_config(&rig)?, clock).map_err(Failure::rig)?;
    let until = Instant::now() + MAX_HOLD;
    let stop = || input_closed.load(Ordering::SeqCst) || Instant::now() >= until;
    skinrig_hil::arm::hold_in_air(
        &mut omega,
        &mut clock,
        &rig,
        timing_slack_of(rig.kind),
        &stop,
        &mut |at| {
            let [x, y, z] = at.to_array();
            outln!("{HOLDING}{x} {y} {z}");
        },
    )
    .map_err(|why| Failure::rig(why.what))?;
    Ok(Exit::Ok)
}
