//! Positions located by learnt fields.

use serde_json::Value;
use skinrig_analysis::locator::{Features, FittedLocator, LocatorModelError};
use skinrig_analysis::result::{CameraField, FieldModel, FieldPoint, LocatorModel, PositionPrior};
use skinrig_model::{Locator, StereoGeometry};

use crate::problem::{Problem, Solution, numbers};

/// Variance of the prior along each axis, mm²: so wide that it moves no digit.
const WIDE_MM2: f64 = 1e30;

fn camera(of: &Value) -> CameraField {
    let column = numbers(&of["column"]);
    let points = of["points"].as_array().unwrap().iter().map(numbers);
    CameraField {
        polynomial: Some([column[0], column[1], column[2], 0.0, 0.0, 0.0]),
        field: FieldModel {
            amplitude_px: of["amplitude_px"].as_f64().unwrap(),
            length_mm: of["length_mm"].as_f64().unwrap(),
            fixed_px: 0.1,
            column_px: 0.1,
            points: points
                .map(|p| FieldPoint {
                    at_mm: [p[0], p[1]],
                    residual_px: p[2],
                    variance_px2: p[3],
                })
                .collect(),
        },
        spreads: None,
    }
}

pub(crate) fn solve(problem: &Problem) -> Solution {
    let model = LocatorModel {
        reference_events: 100.0,
        scatter: None,
        geometry_covariance: None,
        remount_covariance: None,
        cameras: Some([
            camera(&problem.inputs["camera_1"]),
            camera(&problem.inputs["camera_2"]),
        ]),
        prior: Some(PositionPrior {
            centre_mm: [0.0, 0.0],
            covariance_mm2: [WIDE_MM2, 0.0, WIDE_MM2],
        }),
        inflation: 1.0,
        levels: Vec::new(),
        learnt: None,
    };
    let locator = match FittedLocator::new(Locator::Direct, StereoGeometry::PAPER, model) {
        Ok(locator) => locator,
        Err(LocatorModelError::Singular) => {
            let name = "LocatorModelError::Singular";
            return Solution::Refused("singular".to_owned(), name, Vec::new());
        }
        Err(other) => panic!("{}: {other}", problem.name),
    };
    let columns = problem.numbers("columns_px");
    let features = Features {
        columns: [columns[0], columns[1]],
        spreads: [None; 2],
        cluster_events: 100,
    };
    let [x, y] = locator.locate(&features).unwrap().at;
    Solution::Values(vec![("x", x), ("y", y)])
}
