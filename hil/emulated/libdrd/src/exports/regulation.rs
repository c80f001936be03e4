//! Calibration, regulation, motion.

use std::thread::sleep;
use std::time::Duration;

use skinrig_drd_abi::{ErrorCode, MOTOR_SATURATED};

use super::outcome::{Outcome, run, run_bool, run_call, values};
use crate::host;
use crate::page::ArmState;
use crate::wire::Call;

/// Polling interval of blocking calls.
const POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Time limit for a tick of a loop that may have stopped.
const LONGEST_TICK: Duration = Duration::from_millis(100);

/// Waits indefinitely, like the vendor's blocking calls; ends if the device is gone.
fn wait_while(id: i8, busy: impl Fn(&ArmState) -> bool) -> Outcome<ArmState> {
    loop {
        let state = host::state(id)?;
        if !busy(&state) {
            return Ok(state);
        }
        sleep(POLL_INTERVAL);
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn drdIsInitialized(id: i8) -> u8 {
    run_bool("drdIsInitialized", || {
        let [initialised] = values(host::call(id, Call::Initialised)?)?;
        Ok(initialised != 0.0)
    })
}

fn initialise(name: &str, id: i8, call: Call) -> i32 {
    run(name, &[], -1, || {
        host::call(id, call)?;
        let state = wait_while(id, |s| s.initialising)?;
        if state.initialised && state.regulating {
            Ok(0)
        } else {
            Err(ErrorCode::TIMEOUT)
        }
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdAutoInit(id: i8) -> i32 {
    initialise("drdAutoInit", id, Call::AutoInit)
}

#[unsafe(no_mangle)]
pub extern "system" fn drdCheckInit(id: i8) -> i32 {
    initialise("drdCheckInit", id, Call::CheckInit)
}

#[unsafe(no_mangle)]
pub extern "system" fn drdStart(id: i8) -> i32 {
    run_call("drdStart", &[], id, Call::Start)
}

#[unsafe(no_mangle)]
pub extern "system" fn drdStop(keep_force: bool, id: i8) -> i32 {
    run_call(
        "drdStop",
        &[f64::from(u8::from(keep_force))],
        id,
        Call::Stop { keep_force },
    )
}

#[unsafe(no_mangle)]
pub extern "system" fn drdIsRunning(id: i8) -> u8 {
    run_bool("drdIsRunning", || Ok(host::state(id)?.regulating))
}

#[unsafe(no_mangle)]
pub extern "system" fn drdIsMoving(id: i8) -> u8 {
    run_bool("drdIsMoving", || Ok(host::state(id)?.moving))
}

#[unsafe(no_mangle)]
pub extern "system" fn drdHold(id: i8) -> i32 {
    run_call("drdHold", &[], id, Call::Hold)
}

/// 2 while the motors are saturated: still a success.
fn saturation_code(id: i8) -> Outcome<i32> {
    Ok(if host::state(id)?.saturated {
        MOTOR_SATURATED
    } else {
        0
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdMoveToPos(x_m: f64, y_m: f64, z_m: f64, block: bool, id: i8) -> i32 {
    let arguments = [x_m, y_m, z_m, f64::from(u8::from(block))];
    run("drdMoveToPos", &arguments, -1, || {
        set_target(id, [x_m, y_m, z_m], Call::Move)?;
        if block && !wait_while(id, |s| s.moving)?.regulating {
            return Err(ErrorCode::NO_REGULATION);
        }
        saturation_code(id)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdTrackPos(x_m: f64, y_m: f64, z_m: f64, id: i8) -> i32 {
    run("drdTrackPos", &[x_m, y_m, z_m], -1, || {
        set_target(id, [x_m, y_m, z_m], Call::Track)?;
        saturation_code(id)
    })
}

fn set_target(id: i8, target: [f64; 3], call: fn([f64; 3]) -> Call) -> Outcome<()> {
    if target.iter().any(|x| !x.is_finite()) {
        return Err(ErrorCode::INVALID);
    }
    host::call(id, call(target)).map(|_| ())
}

#[unsafe(no_mangle)]
pub extern "system" fn drdWaitForTick(id: i8) {
    run("drdWaitForTick", &[], f64::NAN, || {
        let tick = host::state(id)?.tick;
        let started = std::time::Instant::now();
        while host::state(id)?.tick == tick && started.elapsed() < LONGEST_TICK {
            sleep(Duration::from_micros(100));
        }
        Ok(f64::NAN)
    });
}
