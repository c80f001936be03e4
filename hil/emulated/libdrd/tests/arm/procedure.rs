//! The procedure of a press from open to close, as in a driver, and its journal.

use crate::support::{Bench, ID, WITHIN};
use drd::{ArmConfig, Contact, Mode};
use skinrig_drd_abi::{SYMBOLS, SdkVersion, StatusField, is_true, succeeded};

#[test]
fn a_press_from_open_to_close() {
    let surface_m = 0.0;
    let config = ArmConfig {
        contact: Some(Contact::horizontal(surface_m)),
        ..ArmConfig::default()
    };
    let bench = Bench::new(&config);
    let (arm, sdk) = (&bench.arm, &bench.sdk);
    let press_m = [0.02, 0.01, -0.002];
    // SAFETY: functions of the table, called with their signatures; every place lives through its call.
    unsafe {
        assert!(SdkVersion::query(sdk.dhdGetSDKVersion) >= SdkVersion::ADVISED);
        assert_eq!(
            ((sdk.dhdGetDeviceCount)(), (sdk.dhdGetAvailableCount)()),
            (1, 1)
        );
        assert_eq!((sdk.drdOpenID)(0), 0);
        assert_eq!((sdk.dhdGetAvailableCount)(), 0);
        assert_eq!((sdk.dhdGetSystemType)(ID), 33);
        let mut serial = 0;
        assert_eq!((sdk.dhdGetSerialNumber)(&raw mut serial, ID), 0);
        assert_eq!(serial, 1234);
        assert!(is_true((sdk.drdIsSupported)(ID)) && is_true((sdk.drdIsInitialized)(ID)));
        assert!(
            (sdk.drdIsSupported)(ID) > 1,
            "expected a byte that is not a valid Rust bool"
        );
        assert!(bench.status().is(StatusField::Brake));

        assert_eq!((sdk.drdStart)(ID), 0);
        assert_eq!((sdk.drdSetMotRatioMax)(0.5, ID), 0);
        assert_eq!((sdk.drdSetEncIGain)(0.0, ID), 0);
        assert_eq!((sdk.drdSetPosMoveParam)(0.5, 0.05, 10.0, ID), 0);
        let mut limits = [0.0; 3];
        let [amax, vmax, jerk] = &mut limits;
        assert_eq!((sdk.drdGetPosMoveParam)(amax, vmax, jerk, ID), 0);
        assert_eq!(limits, [0.5, 0.05, 10.0]);
        assert!(is_true((sdk.drdIsRunning)(ID)) && bench.status().is(StatusField::Force));

        assert!(succeeded(bench.move_to([press_m[0], press_m[1], 0.005])));
        assert!(is_true((sdk.drdIsMoving)(ID)));
        arm.wait_until(WITHIN, |s| !s.moving).unwrap();
        let [_, _, tare] = bench.force();

        assert!(succeeded(bench.move_to(press_m)));
        let pressed = arm.wait_until(WITHIN, |s| !s.moving).unwrap();
        let [_, _, force] = bench.force();
        // The forces of sample and servo balance before the tip reaches its target.
        let contact_n = pressed.contact_force_n[2];
        assert!(
            contact_n > 1.0 && (tare - force - contact_n).abs() < 0.1,
            "{contact_n} {tare} {force}"
        );
        assert!(pressed.position_m[2] > press_m[2] && pressed.position_m[2] < surface_m);
        let (_, [x, y, z]) = bench.position();
        for (read, real) in [x, y, z].into_iter().zip(pressed.position_m) {
            assert!((read - real).abs() < 2e-5, "{read} {real}");
            assert!(
                (read / 1e-5 - (read / 1e-5).round()).abs() < 1e-6,
                "quantised: {read}"
            );
        }

        assert!(succeeded(bench.move_to([press_m[0], press_m[1], 0.005])));
        arm.wait_until(WITHIN, |s| !s.moving && s.contact_force_n == [0.0; 3])
            .unwrap();
        assert_eq!((sdk.drdStop)(false, ID), 0);
        assert_eq!(arm.state().unwrap().mode, Mode::Brake);
        assert_eq!((sdk.drdClose)(ID), 0);
        assert_eq!((sdk.dhdGetAvailableCount)(), 1);
    }
    let journal = arm.journal().unwrap();
    let [open, start, first_move, tare, stop, close] = [
        "drdOpenID",
        "drdStart",
        "drdMoveToPos",
        "dhdGetForce",
        "drdStop",
        "drdClose",
    ]
    .map(|name| journal.first(name).unwrap());
    assert!(open < start && start < first_move && first_move < tare && tare < stop && stop < close);
    assert_eq!(journal.owners().len(), 1, "{:?}", journal.owners());
    assert!(journal.beside_regulation().is_empty());
    assert_eq!(
        journal.calls("drdMoveToPos").nth(1).unwrap().arguments,
        [0.02, 0.01, -0.002, 0.0]
    );
    assert!((journal.largest_step_m("drdMoveToPos") - 0.007).abs() < 1e-12);
}

#[test]
fn the_library_exports_exactly_the_table() {
    let path = drd::library_beside_this_executable().unwrap();
    // SAFETY: the library runs no code when it is loaded, unless it is to become a firmware.
    let library = unsafe { libloading::Library::new(path) }.unwrap();
    // SAFETY: the address is never dereferenced.
    let has = |name: &str| unsafe { library.get::<*const ()>(name.as_bytes()) }.is_ok();
    for symbol in SYMBOLS {
        assert!(has(symbol.name), "{}", symbol.name);
    }
    for (name, _) in skinrig_drd_abi::NEVER_USED {
        assert!(!has(name), "{name}");
    }
}
