//! A synthetic recording in the published dataset's layout, from its files to the errors in mm.
//!
//! The recording is too large for the repository; without it this test says so and passes. The clock alignment
//! alone is tested on its rates in `clocks.rs`.

use std::path::{Path, PathBuf};

use skinrig_analysis::{EventSource, EventSourceError, SessionInput, analyze, results_hash};
use skinrig_formats::{Geometry, hdf5::Container};
use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, Point2, PressRole, RigGeometry, SkinOutline,
    StereoGeometry,
};
use skinrig_planted::{PlantedPress, press, timing};

struct Recording(PathBuf);

impl EventSource for Recording {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        let file = self
            .0
            .join(format!("grid_path2_v2_camera{}.hdf5", camera.number()));
        let container = Container::open(&file)?;
        let mut reader = container.events(None, Geometry::EVK1)?;
        loop {
            let batch = reader.next_batch()?;
            if batch.is_empty() {
                return Ok(());
            }
            each(batch);
        }
    }
}

/// The published rhythm as a schedule: three sync presses 1 s apart at the centre, 3 s of rest, then the grid
/// with a period of 3 + 1/289 s. Every other press calibrates.
fn schedule(positions: &str) -> SessionInput {
    let grid = positions.lines().skip(1).filter_map(|line| {
        let mut fields = line.split(',').map(|f| f.parse::<f64>().ok());
        Some(Point2::new(fields.next()?? * 1e3, fields.next()?? * 1e3))
    });
    let sync = (0..3).map(|i| (PressRole::Sync, Point2::new(10.0, 2.0), f64::from(i)));
    let presses = sync.chain(grid.zip(0u32..).map(|(at, i)| {
        let role = if i % 2 == 0 {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
        (role, at, 5.0 + f64::from(i) * (3.0 + 1.0 / 289.0))
    }));
    let mut input = skinrig_planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: None,
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings::default(),
    );
    for ((role, at, contact), i) in presses.zip(0u32..) {
        let touch = PlantedPress {
            timing: timing(contact, [0.3, 0.2, 0.35, 0.55, 0.8]),
            scheduled: true,
            ..PlantedPress::new(role, 0, i.saturating_sub(3), at)
        };
        press(&mut input, touch);
    }
    input
}

#[test]
fn a_recording_in_the_published_layout_is_aligned_calibrated_and_scored() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/sample-grid");
    let Ok(positions) = std::fs::read_to_string(folder.join("snake_grid_press_positions.csv"))
    else {
        println!("skipped: no sample recording at {}", folder.display());
        return;
    };
    let input = schedule(&positions);
    assert_eq!(input.planned.len(), 292);
    let source = Recording(folder);
    let a = analyze(&input, &source).unwrap();
    // Camera 1 was started 12.6 s, camera 2 5.2 s (nominal, tenths off) before the schedule's zero, which is 4 s before
    // the first sync press; the first touch of a press is 0.1 s before its middle.
    for (clock, nominal_s) in a.clocks.iter().zip([12.6, 5.2]) {
        let clock = clock.unwrap();
        let start_s = clock.offset_us * 1e-6 - 4.0 + 0.1;
        assert!((start_s - nominal_s).abs() < 0.5, "{clock:?}");
        assert!(clock.drift_ppm.abs() < 60.0 && clock.n > 280, "{clock:?}");
    }
    assert!(a.counts.add_up());
    assert_eq!((a.counts.planned, a.counts.sync), (289, 3));
    assert!(a.counts.valid > 280, "{:?}", a.counts);
    // The nominal geometry is another rig's: only the calibration makes this skin localise.
    let calibration = a.calibration.as_ref().unwrap();
    assert!(
        calibration.rmse_before_mm > 10.0 && calibration.rmse_after_mm < 7.0,
        "{calibration:?}"
    );
    assert!(
        a.scored.rmse_mm.value.unwrap() < 7.0,
        "{:?}",
        a.scored.rmse_mm
    );
    assert!(
        a.scored.median_mm.value.unwrap() < 4.0,
        "{:?}",
        a.scored.median_mm
    );
    assert!(a.scored.located_rate.value.unwrap() > 0.97);
    assert_eq!(
        results_hash(&a),
        results_hash(&analyze(&input, &source).unwrap())
    );
}
