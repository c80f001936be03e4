//! Text files written by people: protocols, schedules, rig files, position tables, bias files.

use std::path::Path;

use skinrig_formats::positions::{LengthUnit, PositionTable};
use skinrig_model::Point2;
use skinrig_protocol::{Protocol, RigFile, Schedule, check, path_svg};

/// Plans with more presses are valid but long; compiling them is not the purpose here.
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

/// A protocol, with its plan, checks and figures.
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

/// The schedule of a recording made without skinrig.
pub fn schedule(bytes: &[u8]) {
    match Schedule::parse("x.yaml", bytes, &[]) {
        Err(found) => assert!(!found.to_string().is_empty()),
        Ok(schedule) => {
            let positions = (schedule.presses_per_repetition as usize).min(FEW);
            let _ = schedule.planned(&vec![Point2::default(); positions]);
        }
    }
}

/// The description of a bench.
pub fn rig(bytes: &[u8]) {
    if let Err(found) = RigFile::parse("x.yaml", bytes, &|_| Some("../x".to_owned())) {
        assert!(!found.to_string().is_empty());
    }
}
