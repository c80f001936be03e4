//! A healthy arm: contract, lines, limits, force, and order of calls.

use emulated_libdrd::journal::Journal;
use emulated_libdrd::{ArmConfig, Contact, Mode};
use skinrig_device::contract::{self, IndenterContract};
use skinrig_device::{DeviceError, Indenter, RealClock};
use skinrig_model::HostDuration;
use skinrig_omega3::Omega;

use crate::support::*;

#[test]
fn keeps_the_contract() {
    let arm = arm();
    let options = IndenterContract {
        limits: LIMITS,
        targets: [point([15.0, 4.0, 16.0]), point([10.0, -2.0, 22.0])],
        outside: point([12.0, 15.5, 16.0]),
        speed_mm_s: 30.0,
        tolerance_mm: 0.1,
        move_timeout: HostDuration::from_millis(1_200),
        rate_share: 0.2,
    };
    contract::indenter(
        &mut || {
            let clock = RealClock::start();
            let omega = Omega::open(config(&arm), clock).expect("robot opens");
            (Box::new(omega), Box::new(clock))
        },
        &options,
    );
}

#[test]
fn one_thread_makes_all_calls_in_order_and_within_limits() {
    let arm = arm();
    let mut omega = armed(&arm);
    go(&mut omega, [20.0, 5.0, 15.0], 30.0);
    omega.hold().expect("robot holds");
    omega.disarm().expect("robot disarms");
    omega.arm().expect("robot arms again");
    go(&mut omega, START, 30.0);
    drop(omega);
    let state = arm.state().expect("arm state");
    assert_eq!((state.mode, state.held), (Mode::Brake, false));

    let journal = arm.journal().expect("journal");
    let owners = journal.owners();
    assert_eq!(owners.len(), 1, "{owners:?}");
    assert_eq!(owners[0].2, "omega3");
    let at = |name: &str| journal.first(name).unwrap_or_else(|| panic!("no {name}"));
    let order = [
        "dhdGetSDKVersion",
        "drdOpenID",
        "dhdGetSystemType",
        "dhdSetWatchdog",
        "drdStart",
        "drdTrackPos",
        "drdStop",
    ];
    for pair in order.windows(2) {
        assert!(at(pair[0]) < at(pair[1]), "{pair:?}");
    }
    // After every start the limits are written before the first target.
    let mut limited = false;
    for entry in &journal.entries {
        match entry.call.as_str() {
            "drdStart" => limited = false,
            "drdSetPosTrackParam" => limited = true,
            "drdTrackPos" => assert!(limited, "a target before the limits"),
            _ => {}
        }
    }
    assert!(journal.last("drdStop") < journal.last("drdClose"));
    for forbidden in [
        "drdAutoInit",
        "drdCheckInit",
        "drdMoveToPos",
        "dhdSetBrakes",
    ] {
        assert_eq!(journal.first(forbidden), None, "{forbidden}");
    }
    assert!(journal.beside_regulation().is_empty());
    // A braked arm sinks: each start begins at the current position.
    let phases = journal.entries.split(|e| e.call == "drdStart");
    for phase in phases.skip(1) {
        let phase = Journal {
            entries: phase.to_vec(),
        };
        let step_mm = phase.largest_step_m("drdTrackPos") * 1e3;
        assert!(step_mm > 0.0 && step_mm <= 0.1 + 1e-6, "{step_mm} mm");
    }
}

#[test]
fn samples_are_new_and_finite_and_end_at_the_target() {
    let arm = arm();
    let mut omega = armed(&arm);
    omega
        .command(point([20.0, 0.0, 12.0]), 25.0)
        .expect("command is accepted");
    let target = point([20.0, 0.0, 12.0]);
    let samples = poll_until(&mut omega, |s| {
        s.commanded == target && s.measured.distance_mm(target) < 0.05
    })
    .expect("tip arrives");
    assert!(samples.windows(2).all(|w| w[0].t < w[1].t));
    let lead = samples
        .iter()
        .map(|s| s.commanded.distance_mm(s.measured))
        .fold(0.0, f64::max);
    assert!(lead <= 2.0 + 0.1, "{lead} mm");
    assert!(samples.iter().all(|s| s.measured.is_finite()));
    // In free air only friction acts.
    let last = samples.last().expect("at least one sample");
    assert!(last.force_n.abs() < 0.3, "{last:?}");
}

#[test]
fn a_press_is_reported_upward_and_capped_by_the_motor_ratio() {
    let arm = arm_like(&ArmConfig {
        contact: Some(Contact {
            stiffness_n_m: 20_000.0,
            ..Contact::horizontal(0.015)
        }),
        ..ArmConfig::default()
    });
    let mut omega = armed(&arm);
    go(&mut omega, [12.5, 0.0, 15.2], 10.0);
    // Far into a hard sample: the lead limits the pull, the ratio limits the force, and nothing trips.
    omega
        .command(point([12.5, 0.0, 5.0]), 5.0)
        .expect("command is accepted");
    let pressed = poll_until(&mut omega, |s| s.force_n > 0.8).expect("contact force");
    let strongest = pressed.iter().map(|s| s.force_n).fold(0.0, f64::max);
    let truly = arm.state().expect("arm state").contact_force_n[2];
    assert!(truly > 0.5, "the sample pushes up: {truly} N");
    assert!(strongest <= LIMITS.max_force_n + 0.3, "{strongest} N");
    go(&mut omega, [12.5, 0.0, 20.0], 20.0);
    omega.disarm().expect("robot disarms");
}

#[test]
fn at_the_force_limit_it_stops_and_only_rises() {
    let arm = arm_like(&ArmConfig {
        contact: Some(Contact {
            stiffness_n_m: 20_000.0,
            ..Contact::horizontal(0.015)
        }),
        ..ArmConfig::default()
    });
    let mut config = config(&arm);
    // A miscalibrated ratio that would allow 12 N instead of the requested 2 N.
    config.envelope.n_per_ratio = 2.0;
    config.gains.p = Some(4.0);
    let mut omega = Omega::open(config, RealClock::start()).expect("robot opens");
    let mut limits = LIMITS;
    limits.max_force_n = 1.0;
    omega.configure(&limits).expect("limits are accepted");
    omega.arm().expect("robot arms");
    go(&mut omega, [12.5, 0.0, 15.2], 10.0);
    omega
        .command(point([12.5, 0.0, 10.0]), 2.0)
        .expect("command is accepted");
    let samples = poll_until(&mut omega, |s| s.force_n > 1.0).expect("a stop without braking");
    let strongest = samples.iter().map(|s| s.force_n).fold(0.0, f64::max);
    assert!(strongest < 1.5, "{strongest} N");
    let deeper = omega.command(point([12.5, 0.0, 10.0]), 2.0);
    assert!(
        matches!(deeper, Err(DeviceError::Refused { .. })),
        "{deeper:?}"
    );
    go(&mut omega, START, 20.0);
    assert_eq!(arm.state().expect("arm state").mode, Mode::Force);
}

#[test]
fn the_tip_arrives_in_soft_ground_only_with_the_correction() {
    for corrected in [true, false] {
        let arm = arm_like(&ArmConfig {
            contact: Some(Contact::horizontal(0.015)),
            ..ArmConfig::default()
        });
        let mut config = config(&arm);
        if !corrected {
            config.motion.correction_per_s = 0.0;
        }
        let mut omega = armed_with(config);
        let deep = point([12.5, 0.0, 13.0]);
        omega.command(deep, 10.0).expect("command is accepted");
        let off = |s: &skinrig_device::RobotSample| s.measured.distance_mm(deep);
        let samples = if corrected {
            poll_until(&mut omega, |s| off(s) < 0.03).expect("tip arrives")
        } else {
            poll_until(&mut omega, |s| s.commanded == deep).expect("tip arrives")
        };
        let last = samples.last().expect("at least one sample");
        if corrected {
            // 1 N/mm times 2 mm.
            assert!((last.force_n - 2.0).abs() < 0.3, "{last:?}");
        } else {
            assert!(off(last) > 0.2, "{last:?}");
        }
    }
}

#[test]
fn a_loop_slower_than_the_driver_yields_each_reading_once() {
    let arm = arm_like(&ArmConfig {
        loop_khz: 1.0,
        ..ArmConfig::default()
    });
    let mut omega = armed(&arm);
    let target = [15.0, 0.0, 18.0];
    let samples = go(&mut omega, target, 10.0);
    assert!(samples.windows(2).all(|w| w[0].t < w[1].t));
    drop(omega);
    let journal = arm.journal().expect("journal");
    let cached = journal
        .calls("drdGetPositionAndOrientation")
        .filter(|e| e.result == 1.0)
        .count();
    assert!(cached > 50, "the library repeated {cached} readings");
    let targets = journal.calls("drdTrackPos").count();
    assert!(samples.len() < targets, "{} of {targets}", samples.len());
}
