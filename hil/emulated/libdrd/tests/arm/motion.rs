//! Motion of the arm: filtered and raw targets, the sweep of the end stops, gravity on a tilted base.

use drd::{ArmConfig, Contact};

use crate::support::{Bench, ID, WITHIN};

#[test]
fn a_filtered_target_is_approached_and_a_raw_one_is_taken_at_once() {
    let bench = Bench::started(&ArmConfig::default());
    let track = |z| {
        // SAFETY: a function of the table.
        let rc = unsafe { (bench.sdk.drdTrackPos)(0.0125, 0.0, z, ID) };
        assert!(rc >= 0);
    };
    track(0.022);
    let begun = bench.arm.state().unwrap();
    assert!(begun.moving && begun.reference_m[2] < 0.022, "{begun:?}");
    bench
        .arm
        .wait_until(WITHIN, |s| {
            !s.moving && (s.reference_m[2] - 0.022).abs() < 1e-9
        })
        .unwrap();
    // SAFETY: a function of the table.
    let off = unsafe { (bench.sdk.drdEnableFilter)(false, ID) };
    assert_eq!(off, 0);
    track(0.0225);
    assert_eq!(bench.arm.state().unwrap().reference_m[2], 0.0225);
}

#[test]
fn a_sweep_of_the_end_stops_covers_the_workspace_despite_samples() {
    let config = ArmConfig {
        reach_radius_m: 0.01,
        start_m: ArmConfig::default().reach_centre_m,
        contact: Some(Contact::horizontal(0.014)),
        ..ArmConfig::default()
    };
    let bench = Bench::new(&config);
    let sdk = bench.sdk;
    // SAFETY: a function of the table.
    let opened = unsafe { (sdk.drdOpenID)(0) };
    assert_eq!(opened, 0);
    // SAFETY: a function of the table.
    let sweep = std::thread::spawn(move || unsafe { (sdk.drdCheckInit)(ID) });
    bench
        .arm
        .wait_until(WITHIN, |s| s.position_m[2] > 0.026)
        .unwrap();
    bench
        .arm
        .wait_until(WITHIN, |s| s.contact_force_n[2] > 2.0)
        .unwrap();
    assert_eq!(sweep.join().unwrap(), 0);
    assert!(bench.arm.state().unwrap().regulating);
}

#[test]
fn gravity_compensation_follows_the_configured_tilt_and_mass() {
    let bench = Bench::started(&ArmConfig {
        tilt_deg: 90.0,
        ..ArmConfig::default()
    });
    // By default the library assumes the wrong weight and direction; the servo force shows the difference.
    let weight_n = 0.12 * 9.81;
    let sideways =
        |n: f64| move |s: &drd::ArmState| (s.reported_force_n[0] - n).abs() < 0.05 && !s.moving;
    bench.arm.wait_until(WITHIN, sideways(weight_n)).unwrap();
    // SAFETY: functions of the table, called with their signatures.
    let set = unsafe {
        [
            (bench.sdk.dhdSetDeviceAngleDeg)(90.0, ID),
            (bench.sdk.dhdSetEffectorMass)(0.12, ID),
        ]
    };
    assert_eq!(set, [0, 0]);
    bench.arm.wait_until(WITHIN, sideways(0.0)).unwrap();
}
