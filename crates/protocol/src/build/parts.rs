//! The parts of a protocol, each from its own keys: scene, frame, depths, motion, limits, sync, roles, marks, cameras.

use std::collections::BTreeMap;

use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraModel, LensModel, MarkKind, Point2, Point3,
    PressRole, SceneNeed, SimLevel, SkinOutline,
};

use super::seconds;
use crate::area::{Area, KeepOut, Surroundings};
use crate::plan::{OnTrip, RunLimits};
use crate::protocol::{CameraRequest, Motion, Pace, Scene, Sync};
use crate::shape::{Field, Keys, Value};
use skinrig_settings::Collector;
use skinrig_settings::Dimension;

pub(super) fn scene(f: &Field, out: &mut Collector) -> Option<Scene> {
    let named = f.word("level").and_then(|w| w.parse::<SimLevel>().ok());
    let mut needs = Vec::new();
    for item in f.get("needs").map_or(&[][..], Field::items) {
        let need = SceneNeed::ALL
            .into_iter()
            .find(|n| Some(n.name()) == item.as_word())?;
        if needs.contains(&need) {
            out.error(item.span, item.path.as_str(), "the need is given twice")
                .expected("each need once")
                .found(format!("`{}`", need.name()));
        }
        needs.push(need);
    }
    if f.entries().is_empty() {
        out.error(f.span, "scene", "the scene is empty")
            .expected("`needs`, `level` or both")
            .found("neither")
            .help("write `scene: {needs: [event_rates, localisation]}`");
        return None;
    }
    let enough = skinrig_model::scene::cheapest_level(&needs);
    if let Some(level) = named.filter(|level| *level < enough) {
        let dear = needs.iter().find(|n| n.level() > level)?;
        let span = f.get("level").map_or(f.span, |l| l.span);
        out.error(
            span,
            "scene.level",
            "the level does not give what the scene needs",
        )
        .expected(format!("`{enough}`, because of the need `{}`", dear.name()))
        .found(format!("`{level}`"))
        .help(format!(
            "write `level: {enough}`, or remove the key: the cheapest sufficient level is chosen"
        ));
    }
    Some(Scene {
        level: named.unwrap_or(enough),
        needs,
        level_is_named: named.is_some(),
    })
}

pub(super) fn point(f: &Field, key: &str) -> Option<Point2> {
    f.get(key)?.pair().map(|[x, y]| Point2::new(x, y))
}

/// The outline under `key` of `f`.
pub(crate) fn outline(f: &Field, out: &mut Collector) -> Option<SkinOutline> {
    if f.as_word().is_some() {
        return Some(SkinOutline::PAPER);
    }
    let outline = SkinOutline {
        centre: point(f, "centre")?,
        width_mm: f.quantity("width")?,
        height_mm: f.quantity("height")?,
        chamfer_mm: f.quantity("chamfer")?,
        radius_mm: f.quantity("radius")?,
    };
    let (chamfer, radius) = (outline.chamfer_mm, outline.radius_mm);
    let room = outline.width_mm.min(outline.height_mm) / 2.0;
    for (key, value) in [("chamfer", chamfer), ("radius", radius)] {
        if value > room {
            let span = f.get(key).map_or(f.span, |x| x.span);
            out.error(
                span,
                format!("{}.{key}", f.path),
                "the corner is larger than half the skin",
            )
            .expected(format!("at most {room} mm, half of the shorter side"))
            .found(format!("{value} mm"));
        }
    }
    Some(outline)
}

pub(super) fn surroundings(f: &Field, out: &mut Collector) -> Option<Surroundings> {
    let outline = outline(f.get("outline")?, out)?;
    let mut keep_outs = Vec::new();
    for (i, item) in f
        .get("keep_outs")
        .map_or(&[][..], Field::items)
        .iter()
        .enumerate()
    {
        let area = if let Some(c) = item.get("circle") {
            Area::Circle {
                centre: point(c, "centre")?,
                radius_mm: c.quantity("radius")?,
            }
        } else if let Some(r) = item.get("rectangle") {
            let (min, max) = (point(r, "min")?, point(r, "max")?);
            if min.x_mm >= max.x_mm || min.y_mm >= max.y_mm {
                out.error(r.span, r.path.as_str(), "the rectangle is empty")
                    .expected("`min` smaller than `max` in x and y")
                    .found(format!(
                        "({}, {}) and ({}, {}) mm",
                        min.x_mm, min.y_mm, max.x_mm, max.y_mm
                    ));
            }
            let corner = Point2::new;
            Area::Polygon(vec![
                min,
                corner(max.x_mm, min.y_mm),
                max,
                corner(min.x_mm, max.y_mm),
            ])
        } else {
            let corners = item.get("polygon")?.items().iter();
            Area::Polygon(
                corners
                    .map(|c| c.pair().map(|[x, y]| Point2::new(x, y)))
                    .collect::<Option<_>>()?,
            )
        };
        keep_outs.push(KeepOut {
            name: item
                .text("name")
                .unwrap_or_else(|| format!("keep-out {}", i + 1)),
            area,
            margin_mm: item.quantity("margin")?,
            height_mm: item.quantity("height"),
        });
    }
    Some(Surroundings {
        outline,
        margin_mm: f.quantity("margin")?,
        keep_outs,
    })
}

pub(super) fn depths(
    root: &Field,
    max_depth: Option<f64>,
    out: &mut Collector,
) -> Option<Vec<f64>> {
    let fields = match root.get("depths") {
        Some(list) => list.items(),
        None => std::slice::from_ref(root.get("depth")?),
    };
    for field in fields {
        depth_within(field, max_depth, out);
    }
    fields.iter().map(Field::as_quantity).collect()
}

pub(super) fn depth_within(field: &Field, max_depth: Option<f64>, out: &mut Collector) {
    if let (Some(depth), Some(max)) = (field.as_quantity(), max_depth)
        && depth > max
    {
        out.error(
            field.span,
            field.path.as_str(),
            "deeper than the limit allows",
        )
        .expected(format!("at most {max} mm, `limits.max_depth`"))
        .found(format!("{depth} mm"))
        .help("press less deep, or raise `limits.max_depth` if the skin bears it");
    }
}

pub(super) fn pace(f: &Field, key: &str) -> Option<Pace> {
    match f.get(key)?.value {
        Value::Quantity(v, Dimension::Time) => Some(Pace::Time(v)),
        Value::Quantity(v, _) => Some(Pace::Speed(v)),
        _ => None,
    }
}

pub(super) fn read_motion(
    m: &Field,
    limits: Option<&Field>,
    clearance: Option<f64>,
    depths: Option<&[f64]>,
    surroundings: Option<&Surroundings>,
    out: &mut Collector,
) -> Option<Motion> {
    let deepest = depths.map(|d| d.iter().copied().fold(0.0, f64::max));
    let max_speed = limits.and_then(|l| l.quantity("max_speed"));
    // A speed needs no distance; a time does.
    for (key, distance) in [
        ("approach", clearance),
        ("indent", deepest),
        ("retract", clearance.zip(deepest).map(|(c, d)| c + d)),
        ("travel", Some(0.0)),
    ] {
        let speed = match (pace(m, key), distance) {
            (Some(Pace::Speed(speed)), _) => speed,
            (Some(pace), Some(distance)) => pace.speed_mm_s(distance),
            _ => continue,
        };
        if let (Some(max), Some(field)) = (max_speed.filter(|max| speed > *max), m.get(key)) {
            out.error(
                field.span,
                field.path.as_str(),
                "faster than the limit allows",
            )
            .expected(format!("at most {max} mm/s, `limits.max_speed`"))
            .found(format!("{speed} mm/s"))
            .help("move more slowly, or raise `limits.max_speed`");
        }
    }
    if let (Some(period), Some(hold)) = (m.quantity("period"), m.quantity("hold"))
        && hold >= period
    {
        let span = m.get("hold").map_or(m.span, |f| f.span);
        out.error(span, "motion.hold", "the hold is longer than the period")
            .expected(format!("less than `motion.period`, {period} s"))
            .found(format!("{hold} s"))
            .help("shorten the hold or lengthen the period");
    }
    let (clearance, depths) = (clearance?, depths?);
    let tolerance = m.get("settle").and_then(|s| s.quantity("tolerance"));
    if let Some(tolerance) = tolerance
        && let Some(shallowest) = depths.iter().copied().reduce(f64::min)
        && tolerance >= shallowest.min(clearance)
    {
        let span = m.get("settle").map_or(m.span, |f| f.span);
        out.error(
            span,
            "motion.settle.tolerance",
            "the tolerance hides the press",
        )
        .expected(format!(
            "less than the smallest depth and the clearance, {} mm",
            shallowest.min(clearance)
        ))
        .found(format!("{tolerance} mm"));
    }
    let home = match m.get("home") {
        Some(f) => {
            let [x, y, z] = f.triple()?;
            if z < clearance {
                out.error(f.span, "motion.home", "home is below clearance height")
                    .expected(format!("z of at least {clearance} mm, `motion.clearance`"))
                    .found(format!("{z} mm"));
            }
            Point3::new(x, y, z)
        }
        None => surroundings?.outline.centre.at_height(clearance),
    };
    Some(Motion {
        approach: pace(m, "approach")?,
        indent: pace(m, "indent")?,
        hold: seconds(m.quantity("hold")?),
        retract: pace(m, "retract")?,
        travel_mm_s: m.quantity("travel")?,
        period_s: m.quantity("period"),
        home,
    })
}

pub(super) fn read_limits(
    l: &Field,
    motion: Option<&Field>,
    out: &mut Collector,
) -> Option<RunLimits> {
    let workspace = l.get("workspace")?;
    let (min, max) = (
        workspace.get("min")?.triple()?,
        workspace.get("max")?.triple()?,
    );
    for ((axis, low), high) in ["x", "y", "z"].iter().zip(min).zip(max) {
        if low >= high {
            out.error(workspace.span, "limits.workspace", "the workspace is empty")
                .expected(format!("`min` smaller than `max` in {axis}"))
                .found(format!("{low} mm and {high} mm"));
        }
    }
    let settle = motion?.get("settle")?;
    Some(RunLimits {
        workspace_min_mm: min,
        workspace_max_mm: max,
        clearance_mm: motion?.quantity("clearance")?,
        max_depth_mm: l.quantity("max_depth")?,
        max_speed_mm_s: l.quantity("max_speed")?,
        max_force_n: l.quantity("max_force")?,
        position_tolerance_mm: settle.quantity("tolerance")?,
        settle_time: seconds(settle.quantity("time")?),
        max_acceleration_mm_s2: l.quantity("max_acceleration"),
        on_trip: match l.word("on_trip")? {
            "brake" => OnTrip::Brake,
            _ => OnTrip::Retract,
        },
    })
}

pub(super) fn read_sync(
    f: &Field,
    surroundings: Option<&Surroundings>,
    depths: Option<&[f64]>,
    max_depth: Option<f64>,
    out: &mut Collector,
) -> Option<Sync> {
    if let Some(depth) = f.get("depth") {
        depth_within(depth, max_depth, out);
    }
    Some(Sync {
        count: f.count("count")?,
        interval_s: f.quantity("interval")?,
        at: match f.get("at") {
            Some(at) => at.pair().map(|[x, y]| Point2::new(x, y))?,
            None => surroundings?.outline.centre,
        },
        pause_after: seconds(f.quantity("pause_after")?),
        depth_mm: match f.get("depth") {
            Some(depth) => depth.as_quantity()?,
            None => *depths?.first()?,
        },
    })
}

/// What each repetition is for. Every repetition stands in exactly one list.
pub(crate) fn roles(f: &Field, count: u32, out: &mut Collector) -> Option<Vec<PressRole>> {
    let mut roles = vec![None; count as usize];
    let mut clean = true;
    for (key, role) in [
        ("calibrate", PressRole::Calibrate),
        ("score", PressRole::Score),
    ] {
        let Some(field) = f.get(key) else {
            clean = false;
            continue;
        };
        let Value::Numbers(spans) = &field.value else {
            return None;
        };
        for &(first, last, span) in spans {
            if last > count {
                out.error(span, field.path.as_str(), "there is no such repetition")
                    .expected(format!(
                        "1 to {count}: there are {count} repetitions, counted from 1"
                    ))
                    .found(format!("{last}"));
                clean = false;
            }
            for number in first..=last.min(count) {
                if let Some(slot) = roles.get_mut(number as usize - 1) {
                    if slot.is_some() {
                        out.error(span, field.path.as_str(), "the repetition is given twice")
                            .expected("each repetition once: presses that calibrate never score")
                            .found(format!("repetition {number}"));
                        clean = false;
                        break;
                    }
                    *slot = Some(role);
                }
            }
        }
    }
    if !clean {
        return None;
    }
    let missing: Vec<String> = (1..)
        .zip(&roles)
        .filter(|(_, r)| r.is_none())
        .map(|(n, _): (u32, _)| n.to_string())
        .take(10)
        .collect();
    let score = f.get("score")?;
    if !missing.is_empty() {
        out.error(score.span, f.path.as_str(), "repetitions without a purpose")
            .expected("every repetition in `calibrate` or `score`")
            .found(format!("nothing about repetition {}", missing.join(", ")));
        return None;
    }
    if !roles.contains(&Some(PressRole::Score)) {
        out.error(score.span, score.path.as_str(), "nothing is scored")
            .expected("at least one repetition")
            .found("none");
        return None;
    }
    roles.into_iter().collect()
}

/// A calibration needs presses that may calibrate.
pub(crate) fn calibration_possible(
    roles: &[PressRole],
    analysis: &AnalysisSettings,
    evaluation: &Field,
    out: &mut Collector,
) {
    if roles.contains(&PressRole::Calibrate) || analysis.calibration == CalibrationModel::None {
        return;
    }
    let field = evaluation.get("calibrate").unwrap_or(evaluation);
    out.error(field.span, field.path.as_str(), "nothing to calibrate with")
        .expected("at least one repetition, or `analysis.calibration: none`")
        .found("no repetition")
        .help("give a repetition to `calibrate`, or write `analysis: {calibration: none}`");
}

pub(super) fn marks(f: &Field, out: &mut Collector) -> Option<Vec<MarkKind>> {
    let mut marks = Vec::new();
    for item in f.get("marks")?.items() {
        let mark = MarkKind::ALL
            .into_iter()
            .find(|m| Some(m.name()) == item.as_word())?;
        if marks.contains(&mark) {
            out.error(item.span, item.path.as_str(), "the mark is given twice")
                .expected("each mark once")
                .found(format!("`{}`", mark.name()));
        }
        marks.push(mark);
    }
    marks.sort_unstable();
    Some(marks)
}

pub(super) fn camera(f: &Field, out: &mut Collector) -> CameraRequest {
    CameraRequest {
        biases: f.get("biases").map(biases).unwrap_or_default(),
        roi: f.get("roi").and_then(|r| roi(r, out)),
    }
}

/// Bias values by name.
pub(crate) fn biases(f: &Field) -> BTreeMap<String, i64> {
    f.entries()
        .iter()
        .filter_map(|(name, v)| match v.value {
            Value::Whole(n) => Some((name.clone(), n)),
            _ => None,
        })
        .collect()
}

/// A rectangle of pixels: first column, first row, columns, rows.
pub(crate) fn roi(r: &Field, out: &mut Collector) -> Option<[u16; 4]> {
    let n = |key| r.count(key).and_then(|n| u16::try_from(n).ok());
    let roi = [n("x")?, n("y")?, n("width")?, n("height")?];
    let [x, y, width, height] = roi;
    if x + width > skinrig_model::SENSOR_WIDTH || y + height > skinrig_model::SENSOR_HEIGHT {
        out.error(r.span, r.path.as_str(), "larger than the sensor")
            .expected("x + width of at most 640 and y + height of at most 480")
            .found(format!("{} and {}", x + width, y + height));
    }
    Some(roi)
}

/// A camera as drawn or measured; aims at `aim` where it does not say.
pub(crate) fn nominal_camera(f: &Field, aim: Point2) -> Option<CameraModel> {
    let place = |key| f.get(key)?.pair().map(|[x, y]| Point2::new(x, y));
    Some(CameraModel {
        position: place("position")?,
        aim: place("aim").unwrap_or(aim),
        skew_deg: f.quantity("skew")?,
        lens: LensModel::Exponential {
            half_fov_deg: f.quantity("half_field_of_view")?,
            w: f.number("distortion")?,
        },
    })
}
