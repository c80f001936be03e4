//! Pose, force, status, rates.

use std::sync::{Mutex, PoisonError};

use skinrig_drd_abi::{ErrorCode, TIMEGUARD};

use super::outcome::{Outcome, fill, run};
use crate::host;
use crate::page::ArmState;
use crate::wire::Call;

/// The state, if the regulation loop runs. The vendor's behaviour without the loop is not documented; this library fails, so that no
/// program relies on an old pose.
fn looped(id: i8) -> Outcome<ArmState> {
    let state = host::state(id)?;
    if state.regulating {
        Ok(state)
    } else {
        Err(ErrorCode::NO_REGULATION)
    }
}

/// 1 if the same call has already returned this reading, otherwise 0.
fn cached(last: &Mutex<u64>, now: u64) -> i32 {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    let repeated = *last == now;
    *last = now;
    if repeated { TIMEGUARD } else { 0 }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn drdGetPositionAndOrientation(
    x_m: *mut f64,
    y_m: *mut f64,
    z_m: *mut f64,
    oa_rad: *mut f64,
    ob_rad: *mut f64,
    og_rad: *mut f64,
    gap_m: *mut f64,
    matrix: *mut [f64; 9],
    id: i8,
) -> i32 {
    static LAST: Mutex<u64> = Mutex::new(0);
    run("drdGetPositionAndOrientation", &[], -1, || {
        let state = looped(id)?;
        let [x, y, z] = state.reported_position_m;
        let places = [x_m, y_m, z_m, oa_rad, ob_rad, og_rad, gap_m];
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill(places, [x, y, z, 0.0, 0.0, 0.0, 0.0]) }?;
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        // SAFETY: the caller passes NULL or a place for nine numbers.
        unsafe { fill([matrix], [identity]) }?;
        Ok(cached(&LAST, state.tick))
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn drdGetVelocity(
    vx_m_s: *mut f64,
    vy_m_s: *mut f64,
    vz_m_s: *mut f64,
    wx_rad_s: *mut f64,
    wy_rad_s: *mut f64,
    wz_rad_s: *mut f64,
    gap_m_s: *mut f64,
    id: i8,
) -> i32 {
    run("drdGetVelocity", &[], -1, || {
        let [x, y, z] = looped(id)?.reported_velocity_m_s;
        let places = [
            vx_m_s, vy_m_s, vz_m_s, wx_rad_s, wy_rad_s, wz_rad_s, gap_m_s,
        ];
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill(places, [x, y, z, 0.0, 0.0, 0.0, 0.0]) }?;
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetPosition(
    x_m: *mut f64,
    y_m: *mut f64,
    z_m: *mut f64,
    id: i8,
) -> i32 {
    static LAST: Mutex<u64> = Mutex::new(0);
    run("dhdGetPosition", &[], -1, || {
        let state = host::state(id)?;
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill([x_m, y_m, z_m], state.reported_position_m) }?;
        Ok(cached(&LAST, state.t_ns))
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetForce(
    fx_n: *mut f64,
    fy_n: *mut f64,
    fz_n: *mut f64,
    id: i8,
) -> i32 {
    run("dhdGetForce", &[], -1, || {
        let state = host::state(id)?;
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill([fx_n, fy_n, fz_n], state.reported_force_n) }?;
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetStatus(status: *mut i32, id: i8) -> i32 {
    run("dhdGetStatus", &[], -1, || {
        let words = host::call(id, Call::Status)?;
        if status.is_null() {
            return Err(ErrorCode::NULL_ARGUMENT);
        }
        for (index, word) in words.into_iter().enumerate() {
            // SAFETY: the caller's vector takes as many words as this version of the SDK writes.
            unsafe { status.add(index).write(host::integer(word)) };
        }
        Ok(0)
    })
}

/// Iterations and time of the previous call, ns.
static LAST_RATE: Mutex<(u64, u64)> = Mutex::new((0, 0));

#[unsafe(no_mangle)]
#[expect(
    clippy::cast_precision_loss,
    reason = "iterations per ns of a short while"
)]
pub extern "system" fn drdGetCtrlFreq(id: i8) -> f64 {
    run("drdGetCtrlFreq", &[], -1.0, || {
        let state = looped(id)?;
        let mut last = LAST_RATE.lock().unwrap_or_else(PoisonError::into_inner);
        let (tick, t_ns) = std::mem::replace(&mut *last, (state.tick, state.t_ns));
        let elapsed_ns = state.t_ns.saturating_sub(t_ns);
        if t_ns == 0 || elapsed_ns == 0 {
            return Ok(0.0);
        }
        Ok(state.tick.saturating_sub(tick) as f64 / elapsed_ns as f64 * 1e6)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetComFreq(id: i8) -> f64 {
    run("dhdGetComFreq", &[], -1.0, || {
        let state = host::state(id)?;
        Ok(if state.regulating { 4.0 } else { 0.0 })
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetButtonMask(id: i8) -> u32 {
    run("dhdGetButtonMask", &[], 0, || host::state(id).map(|_| 0))
}
