//! Texts that people write and send around: protocols, schedules, rig files, position tables, bias files.

use std::path::Path;

use skinrig_formats::positions::{LengthUnit, PositionTable};
use skinrig_model::Point2;
use skinrig_protocol::{Protocol, RigFile, Schedule, check, path_svg};

/// Beyond this many presses a plan is right and only long: its compilation is not what is tested here.
const FEW: usize = 2_000;

/// A press-position table.
pub fn positions(bytes: &[u8]) {
    for unit in [LengthUnit::Metre, LengthUnit::Millimetre] {
        let _ = PositionTable::parse(bytes, Path::new("x.csv"), unit);
    }
}

/// A camera's bias file.
pub fn biases(bytes: &[u8]) {
    let _ = skinrig_evk1::biases::parse_bias_file(&String::from_utf8_lossy(bytes));
}

/// A protocol, and the plan, checks and pictures that come from it.
pub fn protocol(bytes: &[u8]) {
    let table = |_: &Path| Ok(b"x,y\n1,2\n3,4\n".to_vec());
    match Protocol::parse("x.yaml", bytes, &[], &table) {
        Err(found) => assert!(!found.to_string().is_empty()),
        Ok(protocol) => {
            let plan = protocol.compile();
            if plan.presses.len() <= FEW {
                let _ = plan.summary();
                if let Some(around) = &plan.surroundings {
                    let _ = check(&plan, around, None);
                    let _ = path_svg(&plan, around);
                }
            }
        }
    }
}

/// A description of a recording that was made without skinrig.
pub fn schedule(bytes: &[u8]) {
    match Schedule::parse("x.yaml", bytes, &[]) {
        Err(found) => assert!(!found.to_string().is_empty()),
        Ok(schedule) => {
            let positions = (schedule.presses_per_repetition as usize).min(FEW);
            let _ = schedule.planned(&vec![Point2::default(); positions]);
        }
    }
}

/// A description of a bench.
pub fn rig(bytes: &[u8]) {
    if let Err(found) = RigFile::parse("x.yaml", bytes, &|_| Some("../x".to_owned())) {
        assert!(!found.to_string().is_empty());
    }
}
