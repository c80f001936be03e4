//! Manual motion on the simulated rig: the floor of the frame, and the operator's halt.

use skinrig_controller::{
    ControlHandle, ControllerSettings, Floor, GuardError, Jog, JogSetup, RunFault,
};
use skinrig_device::MotionLimits;
use skinrig_model::{HostDuration, Point3, RigidTransform, SimLevel, Skin};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::{RunLimits, TripReaction};
use skinrig_sim::config::SimConfig;
use skinrig_sim::rig::simulated_rig;

const NEVER_STOP: fn() -> bool = || false;

/// A jog in the robot frame, whose floor is `max_depth_mm` below the skin. The skin's surface is at z = -15 mm.
fn jog(max_depth_mm: Option<f64>, control: &ControlHandle) -> Jog<'static> {
    let rig = simulated_rig(&SimConfig::new(1, SimLevel::Kinematic));
    let can = rig.indenter.capabilities();
    let (min_mm, max_mm) = (can.workspace_min_mm, can.workspace_max_mm);
    let limits = RunLimits {
        workspace_min_mm: min_mm,
        workspace_max_mm: max_mm,
        clearance_mm: min_mm[2],
        max_depth_mm: -min_mm[2],
        max_speed_mm_s: can.max_speed_mm_s,
        max_force_n: can.max_force_n,
        position_tolerance_mm: 0.1,
        settle_time: HostDuration::from_millis(50),
        max_acceleration_mm_s2: None,
        on_trip: TripReaction::Retract,
    };
    let robot_limits = MotionLimits {
        min_mm,
        max_mm,
        max_speed_mm_s: can.max_speed_mm_s,
        max_acceleration_mm_s2: can.max_acceleration_mm_s2,
        max_force_n: can.max_force_n,
    };
    let floor = max_depth_mm.map(|max_depth_mm| Floor {
        skin_from_robot: rig.robot_from_skin.inverse(),
        max_depth_mm,
    });
    let setup = JogSetup {
        robot_from_skin: RigidTransform::identity(),
        limits,
        robot_limits,
        floor,
        control: control.clone(),
        settings: ControllerSettings::default(),
    };
    match Jog::start(rig.indenter, rig.clock, &setup) {
        Ok(jog) => jog,
        Err(e) => panic!("{e}"),
    }
}

fn down_to(jog: &mut Jog<'_>, z_mm: f64) -> Result<f64, RunFault> {
    let position = jog.look()?.commanded;
    jog.go(position.plane().at_height(z_mm), 10.0, &NEVER_STOP)?;
    Ok(jog.look()?.measured.z_mm)
}

#[test]
fn the_floor_limits_every_motion_unless_disabled() {
    let control = ControlHandle::new();
    let mut low = jog(Some(2.0), &control);
    assert!((down_to(&mut low, -16.9).unwrap() + 16.9).abs() < 0.1);
    let is_floor = |e: &RunFault| matches!(e, RunFault::Guard(GuardError::Floor { .. }));
    assert!(down_to(&mut low, -17.1).is_err_and(|e| is_floor(&e)));
    down_to(&mut low, -10.0).unwrap();
    let search = TouchSearch {
        threshold_n: 0.2,
        samples: 5,
        speed_mm_s: 2.0,
        band_mm: 1.0,
        tare: HostDuration::from_millis(300),
    };
    // Also if it would find the surface earlier.
    let touched = low.touch(search, 9.0, &NEVER_STOP);
    assert!(touched.is_err_and(|e| is_floor(&e)));
    low.touch(search, 6.5, &NEVER_STOP).unwrap();
    low.finish().unwrap();

    let mut free = jog(None, &control);
    down_to(&mut free, -17.1).unwrap();
    free.finish().unwrap();
}

#[test]
fn a_halt_leaves_the_tip_in_place() {
    let control = ControlHandle::new();
    let mut moved = jog(Some(5.0), &control);
    down_to(&mut moved, -12.0).unwrap();
    // During the downward motion the motors switch off: no retraction.
    let position = moved.look().unwrap().commanded;
    let target: Point3<Skin> = position.plane().at_height(-17.0);
    let halting = || {
        control.halt();
        false
    };
    assert_eq!(moved.go(target, 1.0, &halting), Err(RunFault::Halted));
    let left = moved.finish().unwrap().unwrap();
    assert!((left.measured.z_mm + 12.0).abs() < 0.5, "{left:?}");
    assert!(moved.look().is_err() || moved.look().unwrap().measured.z_mm < -11.0);

    // Also during the rise at the end.
    let control = ControlHandle::new();
    let mut rising = jog(None, &control);
    down_to(&mut rising, -12.0).unwrap();
    control.halt();
    let left = rising.finish().unwrap().unwrap();
    assert!((left.measured.z_mm + 12.0).abs() < 0.5, "{left:?}");
}
