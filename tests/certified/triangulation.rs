//! Two rays, and the columns of points.

use serde_json::Value;
use skinrig_analysis::result::LocationOutcome;
use skinrig_analysis::triangulate::{intersect, locate, locate_angles};
use skinrig_model::{CameraModel, LensModel, Point2, SkinOutline, StereoGeometry};

use crate::problem::{Problem, Solution};

fn camera(of: &Value) -> CameraModel {
    let number = |key: &str| of[key].as_f64().unwrap();
    CameraModel {
        position: Point2::new(number("x"), number("y")),
        aim: Point2::new(number("aim_x"), number("aim_y")),
        skew_deg: number("skew_deg"),
        lens: LensModel::Exponential {
            half_fov_deg: number("half_fov_deg"),
            w: number("w"),
        },
    }
}

pub(crate) fn solve(problem: &Problem) -> Solution {
    let inputs = &problem.inputs;
    if let Some(at) = inputs.get("point_mm") {
        let at = crate::problem::numbers(at);
        let column = camera(&inputs["camera"]).column_of_point(Point2::new(at[0], at[1]));
        return match column {
            Some(column) => Solution::Values(vec![("column", column)]),
            None => Solution::Refused("outside".to_owned(), "column_of_point -> None", Vec::new()),
        };
    }
    let geometry = StereoGeometry {
        cameras: [camera(&inputs["camera_1"]), camera(&inputs["camera_2"])],
    };
    let skin = SkinOutline::PAPER;
    let (outcome, angles) = if let Some(columns) = inputs.get("columns_px") {
        let columns = [0, 1].map(|k| columns[k].as_f64());
        let angle =
            |k: usize| columns[k].map_or(f64::NAN, |u| geometry.cameras[k].angle_of_column_deg(u));
        (locate(&geometry, &skin, columns), [angle(0), angle(1)])
    } else {
        let angles = problem.numbers("angles_deg");
        let angles = [angles[0], angles[1]];
        // What a camera reads has no skew of its own: the data give the whole angle.
        (locate_angles(&geometry, &skin, angles), angles)
    };
    let hit = intersect(&geometry, angles);
    let values = vec![
        ("x", hit.at.x_mm),
        ("y", hit.at.y_mm),
        ("range_1", hit.range_mm[0]),
        ("range_2", hit.range_mm[1]),
        ("sine", hit.sine),
    ];
    let refused = |name, values| Solution::Refused(outcome.name().to_owned(), name, values);
    match outcome {
        LocationOutcome::Located { at, .. } | LocationOutcome::Outside { at, .. } => {
            assert_eq!(at, hit.at);
            Solution::Values(values)
        }
        LocationOutcome::Behind { .. } => refused("LocationOutcome::Behind", values),
        LocationOutcome::Parallel { .. } => refused("LocationOutcome::Parallel", Vec::new()),
        LocationOutcome::Missing => refused("LocationOutcome::Missing", Vec::new()),
    }
}
