//! The hidden command `hold-arm`: holds the arm in free air until the program that started it ends or kills it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use skinrig_device::RealClock;

use super::args::HoldArmArgs;
use super::real_bench::patience;
use crate::exit::{Exit, Failure, Outcome};
use crate::rig::bench;

/// What it says once it holds the arm, before the place in the robot's frame, mm.
pub(crate) const HOLDING: &str = "holding ";
/// Longer than this no drill waits for it.
const AT_MOST: Duration = Duration::from_secs(120);
/// Told to end, it retracts and brakes within this time, or ends as it is: the supervisor then brakes the arm.
const ENDS_WITHIN: Duration = Duration::from_secs(15);

/// Holds the arm as long as standard input stays open.
///
/// # Errors
/// [`Failure::rig`] when the robot fails.
pub(crate) fn hold(args: &HoldArmArgs) -> Outcome {
    let rig = bench::load(&args.rig)?;
    let over = Arc::new(AtomicBool::new(false));
    let ends = Arc::clone(&over);
    std::thread::Builder::new()
        .name("hold-arm".to_owned())
        .spawn(move || {
            // The end of the pipe is the death of whoever holds its other end.
            let _ = std::io::stdin().lock().read_to_end(&mut Vec::new());
            ends.store(true, Ordering::SeqCst);
            std::thread::sleep(ENDS_WITHIN);
            std::process::exit(i32::from(Exit::Rig.code()));
        })
        .map_err(Failure::internal)?;
    let mut clock = RealClock::start();
    let mut omega = bench::omega(bench::omega_config(&rig)?, clock).map_err(Failure::rig)?;
    let until = Instant::now() + AT_MOST;
    let stop = || over.load(Ordering::SeqCst) || Instant::now() >= until;
    skinrig_hil::arm::hold_in_air(
        &mut omega,
        &mut clock,
        &rig,
        patience(rig.kind),
        &stop,
        &mut |at| {
            let [x, y, z] = at.to_array();
            outln!("{HOLDING}{x} {y} {z}");
        },
    )
    .map_err(|why| Failure::rig(why.what))?;
    Ok(Exit::Ok)
}
