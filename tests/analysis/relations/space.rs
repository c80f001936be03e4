//! Changes of space: names of the cameras, mirror image, turns, shifts and scales of the skin.

use skinrig_model::{CalibrationModel, Point2, SkinOutline};

use super::base::Session;
use super::events::exchanged;
use super::figures::{Figure, Figures, figures, kind};
use super::{BASE, Relation, begins, number};

/// Camera 1 becomes camera 2, with everything that belongs to it.
fn exchange_cameras(session: &mut Session) {
    let input = &mut session.input;
    session.events.reverse();
    input.edges.reverse();
    input.gaps.reverse();
    input.recorded.reverse();
    input.rig.nominal.cameras.reverse();
    input.rig.trigger_delay_us.reverse();
    input.settings.crop_v.reverse();
}

/// Moves every position of the session, of skin and cameras.
fn move_all(session: &mut Session, to: impl Fn(Point2) -> Point2) {
    let input = &mut session.input;
    for planned in &mut input.planned {
        planned.at = to(planned.at);
    }
    for outcome in input.outcomes.iter_mut().flatten() {
        outcome.measured_at = outcome.measured_at.map(&to);
    }
    for camera in &mut input.rig.nominal.cameras {
        camera.position = to(camera.position);
        camera.aim = to(camera.aim);
    }
    input.rig.outline.centre = to(input.rig.outline.centre);
}

/// The mirror image at the x axis: columns run backwards.
fn mirror(session: &mut Session) {
    move_all(session, |p| Point2::new(p.x_mm, -p.y_mm));
    for camera in &mut session.input.rig.nominal.cameras {
        camera.skew_deg = -camera.skew_deg;
    }
    for event in session.events.iter_mut().flatten() {
        event.x = 640 - event.x;
    }
}

/// Kinds of figures that belong to one camera by their index.
const BY_CAMERA: [&str; 16] = [
    "runner_up_s",
    "geometry.cameras",
    "start.cameras",
    "clocks",
    ".cameras",
    "alignment.lines",
    "alignment.maps",
    "alignment.residuals",
    "camera_from_host",
    "activity",
    "hot_pixels",
    "off_sensor",
    "rates",
    ".views",
    "model.cameras",
    "coverage.views",
];

/// The path after an exchange of the cameras.
fn other_camera(path: &mut String) {
    for kind in BY_CAMERA {
        let [zero, one] = [0, 1].map(|k| format!("{kind}[{k}]"));
        if path.contains(&zero) || path.contains(&one) {
            *path = exchanged(path, &zero, &one);
            return;
        }
    }
    // Pictures and close-ups of camera 1 come first.
    for (kind, each) in [("pictures", 6), ("zooms", 3)] {
        let index = path.strip_prefix(kind).and_then(|rest| {
            let (index, rest) = rest.strip_prefix('[')?.split_once(']')?;
            Some((index.parse::<usize>().unwrap(), rest.to_owned()))
        });
        if let Some((index, rest)) = index {
            *path = format!("{kind}[{}]{rest}", (index + each) % (2 * each));
            return;
        }
    }
    // Parameters of both cameras alternate, except that positions come in pairs.
    let parameter = |i: usize| if i < 4 { (i + 2) % 4 } else { i ^ 1 };
    *path = with_parameters(path, parameter);
}

/// Kinds of lists with one entry per parameter of the calibration.
const BY_PARAMETER: [&str; 5] = [
    "calibration.start_values",
    "calibration.values",
    "calibration.standard_errors",
    "calibration.correlation",
    "locator.model.geometry_covariance",
];

/// Indices of parameters in this path.
fn parameters(path: &str) -> Vec<usize> {
    if !BY_PARAMETER.iter().any(|kind| path.starts_with(kind)) {
        return Vec::new();
    }
    let indices = path
        .split('[')
        .skip(1)
        .filter_map(|part| part.split(']').next());
    indices.map(|i| i.parse().unwrap()).collect()
}

fn with_parameters(path: &str, other: impl Fn(usize) -> usize) -> String {
    let indices = parameters(path);
    if indices.is_empty() {
        return path.to_owned();
    }
    let (start, _) = path.split_once('[').unwrap();
    let end = if path.ends_with(".len") { ".len" } else { "" };
    let indices: String = indices.iter().map(|i| format!("[{}]", other(*i))).collect();
    format!("{start}{indices}{end}")
}

fn is_sine(path: &str) -> bool {
    path.ends_with(".sine")
}

/// Words that name a camera.
fn rename(figure: &mut Figure) {
    if let Figure::Word(word) = figure {
        *word = exchanged(word, "camera1", "camera2");
        *word = exchanged(word, "camera 1", "camera 2");
    }
}

fn swapped(path: &mut String, figure: &mut Figure) {
    other_camera(path);
    if is_sine(path) {
        number(figure, |sine| -sine);
    }
    if !path.starts_with("calibration.names") {
        rename(figure);
    }
}

/// The figure in the mirror image.
fn mirrored(path: &mut String, figure: &mut Figure) {
    let signs = [1.0, -1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0];
    let sign: f64 = parameters(path).iter().map(|i| signs[*i]).product();
    let signed = !path.ends_with(".len") && !path.contains("standard_errors");
    if path.contains("bias_y_mm") && !path.ends_with(".n") {
        *path = exchanged(path, ".low", ".high");
        number(figure, |y| -y);
    } else if path.ends_with(".y_mm") || path.ends_with("skew_deg") || is_sine(path) {
        number(figure, |y| -y);
    } else if path.ends_with("sin_twice") {
        number(figure, |sine| -sine);
    } else if path.ends_with("centroid_u") {
        number(figure, |u| 640.0 - u);
    } else if path.contains(".pixels.v") {
        let (place, name) = path.rsplit_once('.').unwrap();
        let (row, column) = place.rsplit_once('u').unwrap();
        let column = 640 - column.parse::<u32>().unwrap();
        *path = format!("{row}u{column}.{name}");
    } else if sign < 0.0 && signed {
        number(figure, |v| -v);
    }
}

/// The random choices of both cameras are exchanged, so the studies of thinned events agree by their distribution alone.
pub(super) fn is_thinned(kind: &str) -> bool {
    begins(kind, &["reduction.curves[].rows", "latency.reduced"])
}

/// Column 640, the image of column 0, is in no cell of two columns; places are listed in the order of their coordinates.
pub(super) fn is_unordered(kind: &str) -> bool {
    begins(kind, &["activity[].counts", "coverage.places[]"])
}

#[test]
fn cameras_that_exchange_names_change_nothing_else() {
    Relation {
        name: "cameras exchanged",
        change: &exchange_cameras,
        expect: &swapped,
        silent: &is_thinned,
        digits: &[],
    }
    .holds();
}

#[test]
fn a_mirror_image_has_mirrored_results() {
    Relation {
        name: "mirrored",
        change: &mirror,
        expect: &mirrored,
        silent: &is_unordered,
        digits: &[],
    }
    .holds();
}

/// The same skin, seen from below: mirrored, with the cameras exchanged.
pub(super) fn seen_from_below(session: &mut Session) {
    mirror(session);
    exchange_cameras(session);
}

/// A figure of the skin seen from below.
pub(super) fn below(path: &mut String, figure: &mut Figure) {
    mirrored(path, figure);
    swapped(path, figure);
}

#[test]
fn a_mirror_image_with_exchanged_cameras_has_mirrored_results() {
    Relation {
        name: "mirrored, cameras exchanged",
        change: &seen_from_below,
        expect: &below,
        silent: &|kind| is_unordered(kind) || is_thinned(kind),
        digits: &[],
    }
    .holds();
}

/// A square skin, which a quarter turn leaves a square skin.
fn square() -> (Session, Figures) {
    let mut session = BASE.0.clone();
    let SkinOutline { centre, .. } = SkinOutline::PAPER;
    session.input.rig.outline = SkinOutline {
        centre,
        width_mm: 100.0,
        height_mm: 100.0,
        chamfer_mm: 0.0,
        radius_mm: 0.0,
    };
    let figures = figures(&session.analysis());
    (session, figures)
}

#[test]
fn a_quarter_turn_turns_the_results() {
    let (session, own) = square();
    Relation {
        name: "turned by 90 degrees",
        change: &|session| move_all(session, |p| Point2::new(-p.y_mm, p.x_mm)),
        expect: &|path, figure| {
            // The new x is the old -y, the new y the old x; of each pair of parameters too.
            let signs: f64 = parameters(path)
                .iter()
                .map(|i| if *i < 4 && i % 2 == 1 { -1.0 } else { 1.0 })
                .product();
            let signed = !path.contains("rmse") && !path.ends_with(".n");
            let is_y = path.ends_with(".y_mm") || path.contains("bias_y_mm");
            if signed && is_y || path.contains("_twice") {
                number(figure, |y| -y);
            }
            if signs < 0.0 && !path.ends_with(".len") && !path.contains("standard_errors") {
                number(figure, |v| -v);
            }
            if path.contains("bias_y_mm") {
                *path = exchanged(path, ".low", ".high");
            }
            for (x, y) in [
                (".x_mm", ".y_mm"),
                ("bias_x", "bias_y"),
                ("rmse_x", "rmse_y"),
            ] {
                *path = exchanged(path, x, y);
            }
            *path = with_parameters(path, |i| if i < 4 { i ^ 1 } else { i });
        },
        silent: &is_unordered,
        digits: &[],
    }
    .holds_for(&session, &own);
}

#[test]
fn a_shifted_skin_has_shifted_results() {
    let by = Point2::new(128.0, -56.0);
    Relation {
        name: "shifted by 128 mm and -56 mm",
        change: &|session| {
            move_all(session, |p| Point2::new(p.x_mm + by.x_mm, p.y_mm + by.y_mm));
        },
        expect: &|path, figure| {
            let place = !path.contains("bias") && !path.contains("rmse");
            if place && path.ends_with(".x_mm") {
                number(figure, |x| x + by.x_mm);
            } else if place && path.ends_with(".y_mm") {
                number(figure, |y| y + by.y_mm);
            } else if path.starts_with("calibration.values[")
                || path.starts_with("calibration.start_values[")
            {
                let by = match parameters(path)[0] {
                    0 | 2 => by.x_mm,
                    1 | 3 => by.y_mm,
                    _ => 0.0,
                };
                number(figure, |v| v + by);
            }
        },
        silent: &|_| false,
        digits: &[],
    }
    .holds();
}

/// Doubles all lengths of the rig, the presses and the settings. SR of the contact map is no length: it divides distances in cells.
fn double(session: &mut Session) {
    move_all(session, |p| Point2::new(2.0 * p.x_mm, 2.0 * p.y_mm));
    let outline = &mut session.input.rig.outline;
    let corners = [&mut outline.chamfer_mm, &mut outline.radius_mm];
    for side in [&mut outline.width_mm, &mut outline.height_mm]
        .into_iter()
        .chain(corners)
    {
        *side *= 2.0;
    }
    let settings = &mut session.input.settings;
    settings.within_mm *= 2.0;
    settings.cmre.cell_mm *= 2.0;
    settings.cmre.sigma_mm *= 2.0;
}

/// Doubles lengths, and areas twice.
fn doubled(path: &str, figure: &mut Figure) {
    let kind = kind(path);
    let estimate = [".value", ".low", ".high"]
        .iter()
        .any(|end| kind.ends_with(end));
    let length = kind.trim_end_matches("[]").ends_with("_mm") || estimate && kind.contains("_mm.");
    let is_position = parameters(path).first().is_some_and(|i| *i < 4);
    if kind.contains("_mm2") {
        number(figure, |mm2| 4.0 * mm2);
    } else if kind == "threshold.candidates[][]" && path.ends_with("[1]")
        || length && !kind.ends_with("depth_mm") && !kind.ends_with(".settings.sr_mm")
        || is_position && kind.ends_with("[]") && !kind.contains("correlation")
    {
        number(figure, |mm| 2.0 * mm);
    }
}

/// Words with lengths, and quantities that are taught in millimetres of depth.
fn is_worded(kind: &str) -> bool {
    begins(kind, &["warnings[].text", "indentation"])
}

#[test]
fn a_drawn_skin_of_twice_the_size_has_twice_the_errors() {
    let mut session = BASE.0.clone();
    session.input.settings.calibration = CalibrationModel::None;
    let own = figures(&session.analysis());
    Relation {
        name: "twice as large, drawn geometry",
        change: &double,
        expect: &|path, figure| doubled(path, figure),
        silent: &is_worded,
        // The search for the scatter ends with eight digits.
        digits: &[("locator.model", 8.0), ("presses[].region", 8.0)],
    }
    .holds_for(&session, &own);
}

/// A calibration and a locator expect errors of some millimetres: their bounds and priors do not grow with the skin.
#[test]
fn a_calibrated_skin_of_twice_the_size_has_about_twice_the_errors() {
    Relation {
        name: "twice as large",
        change: &double,
        expect: &|path, figure| doubled(path, figure),
        silent: &|kind| {
            let compared = ["calibration.compared", "locator", "calibration.correlation"];
            let regions = ["presses[].region", "coverage.taxels", "reduction"];
            is_worded(kind) || begins(kind, &compared) || begins(kind, &regions)
        },
        // The ends of a median are ranks, which the order of the errors moves.
        digits: &[
            ("scored.median_mm", 1.5),
            ("scored_without_exclusions.median_mm", 1.5),
            ("", 3.5),
        ],
    }
    .holds();
}
