//! From fields to a protocol: what single keys cannot say, checked across keys.

use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::pulse::{MAX_MARKED_PRESS, PULSE_PERIOD_US, PULSES_PER_TRAIN};
use skinrig_model::{
    AnalysisSettings, CalibrationModel, HostDuration, MarkKind, Point2, Point3, PressRole,
    SceneNeed, SimLevel, SkinOutline,
};

use crate::area::{Area, KeepOut, Surroundings};
use crate::build_path;
use crate::diagnostic::{Collector, Diagnostics};
use crate::keys::PROTOCOL;
use crate::plan::RunLimits;
use crate::protocol::{CameraRequest, Loader, Motion, Pace, Protocol, Prototype, Scene, Sync};
use crate::quantity::Dimension;
use crate::read::read_table;
use crate::settings;
use crate::shape::{Field, Table, Value};
use crate::source::{Sources, Span};
use crate::timing;
use crate::yaml;

/// Decodes a file, applies overrides and reads it by its table. `Err` only when there is nothing to go on with.
pub(crate) fn open(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
    table: &'static Table,
) -> Result<(Collector, Option<Field>), Diagnostics> {
    let mut sources = Sources::default();
    let text = match yaml::decode(bytes) {
        Ok(text) => text,
        Err((at, found)) => {
            let start = at.saturating_sub(200);
            let valid = bytes.get(..at).unwrap_or(&[]);
            let text = String::from_utf8_lossy(valid);
            let source = sources.add(name, text.clone());
            let mut out = Collector::new(sources);
            let span = Span::new(source, text.len().max(start), text.len());
            let limit = yaml::LARGEST_TEXT;
            if bytes.len() > limit {
                out.error(span, "", "the file is too large")
                    .expected(format!("at most {limit} bytes"))
                    .found(found);
            } else {
                let utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
                let help = if utf16 {
                    "the file seems to be UTF-16; save it as UTF-8"
                } else {
                    "save the file as UTF-8"
                };
                out.error(span, "", "not UTF-8 text")
                    .expected("UTF-8 text")
                    .found(found)
                    .help(help);
            }
            return Err(out.finish());
        }
    };
    let source = sources.add(name, text);
    let mut out = Collector::new(sources);
    let Some(mut root) = yaml::parse(&mut out, source) else {
        return Err(out.finish());
    };
    if matches!(root.kind, yaml::Kind::Null) && out.is_clean() {
        out.error(root.span, "", "the file is empty")
            .expected(format!("a {}", table.name))
            .help("begin with `skinrig: 1`, or copy one of the shipped files");
        return Err(out.finish());
    }
    crate::overrides::apply(&mut root, table, overrides, &mut out);
    let field = read_table(&root, table, "", &mut out);
    Ok((out, field))
}

/// Reads a protocol; see [`Protocol::parse`].
pub(crate) fn protocol(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
    loader: Loader<'_>,
) -> Result<Protocol, Diagnostics> {
    let (mut out, root) = open(name, bytes, overrides, &PROTOCOL)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut protocol = root.and_then(|root| {
        let protocol = assemble(&root, folder, loader, &mut out)?;
        if out.is_clean() {
            check_timing(&protocol, &root, &mut out);
        }
        Some(protocol)
    });
    match (&mut protocol, out.is_clean()) {
        (Some(protocol), true) => {
            protocol.file_name = name.to_owned();
            protocol.text = String::from_utf8_lossy(bytes).into_owned();
            protocol.sha256 = hex(&Sha256::digest(bytes));
            protocol.overrides = overrides.to_vec();
        }
        (None, true) => {
            let span = Span::default();
            out.error(span, "", "the file could not be understood")
                .help("this is a defect of skinrig; please report it with the file");
        }
        _ => {}
    }
    match protocol {
        Some(protocol) if out.is_clean() => Ok(protocol),
        _ => Err(out.finish()),
    }
}

/// Lower-case hex.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Every part is read even when another one failed, so that all findings appear at once.
fn assemble(
    root: &Field,
    folder: &Path,
    loader: Loader<'_>,
    out: &mut Collector,
) -> Option<Protocol> {
    let seed = root.whole("seed").map(i64::unsigned_abs);
    let scene = root.get("scene").and_then(|f| scene(f, out));
    let surroundings = root.get("frame").and_then(|f| surroundings(f, out));
    let limits = root.get("limits");
    let max_depth = limits.and_then(|l| l.quantity("max_depth"));
    let depths = depths(root, max_depth, out);
    let motion = root.get("motion");
    let clearance = motion.and_then(|m| m.quantity("clearance"));
    let motion_read = motion.and_then(|m| {
        read_motion(
            m,
            limits,
            clearance,
            depths.as_deref(),
            surroundings.as_ref(),
            out,
        )
    });
    let limits_read = limits.and_then(|l| read_limits(l, motion, out));
    let path = root.get("path").and_then(|f| {
        build_path::locations(
            f,
            surroundings.as_ref(),
            seed.unwrap_or(1),
            folder,
            loader,
            out,
        )
    });
    let sync = root
        .get("sync")
        .map(|f| read_sync(f, surroundings.as_ref(), depths.as_deref(), max_depth, out));
    let repetitions = root.get("repetitions");
    let count = repetitions.and_then(|r| r.count("count"));
    let roles = root
        .get("evaluation")
        .zip(count)
        .and_then(|(e, count)| roles(e, count, out));
    let analysis = root
        .get("analysis")
        .and_then(|f| settings::analysis(f, out));
    if let (Some(roles), Some(analysis), Some(field)) = (&roles, &analysis, root.get("evaluation"))
    {
        calibration_possible(roles, analysis, field, out);
    }
    let marks = root.get("triggers").and_then(|f| marks(f, out));
    let between = repetitions.and_then(|r| r.get("between"));
    let cameras = root.get("cameras").map(|f| {
        ["camera1", "camera2"].map(|key| f.get(key).map(|c| camera(c, out)).unwrap_or_default())
    });
    let prototype = root.get("prototype").and_then(|p| {
        Some(Prototype {
            id: p.text("id")?,
            description: p.text("description"),
            tip: p.text("tip"),
        })
    });
    let order = root.get("order")?;
    let shuffle_seed = order
        .get("shuffled")
        .map(|s| s.whole("seed").map(i64::unsigned_abs).or(seed).unwrap_or(1));
    let (path_kind, locations) = path?;
    let (depths, roles, sync) = (depths?, roles?, sync.map_or(Some(None), |s| s.map(Some))?);
    let presses = locations.len() as u64 * depths.len() as u64 * roles.len() as u64
        + sync.as_ref().map_or(0, |s: &Sync| u64::from(s.count));
    if presses > u64::from(MAX_MARKED_PRESS) + 1 {
        let span = root.get("path").map_or(root.span, |f| f.span);
        out.error(span, "path", "too many presses")
            .expected(format!(
                "at most {} presses in all",
                u64::from(MAX_MARKED_PRESS) + 1
            ))
            .found(format!("{presses}"))
            .help("split the campaign into several protocols");
        return None;
    }
    Some(Protocol {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        overrides: Vec::new(),
        name: root.text("name")?,
        description: root.text("description"),
        operator: root.text("operator")?,
        prototype: prototype?,
        seed: seed?,
        scene: scene?,
        surroundings: surroundings?,
        sync,
        locations,
        path_kind,
        roles,
        return_to_start: between?.flag("return_to_start")?,
        pause_between: seconds(between?.quantity("pause")?),
        shuffle_seed,
        depths_mm: depths,
        motion: motion_read?,
        limits: limits_read?,
        marks: marks?,
        analysis: analysis?,
        cameras: cameras?,
    })
}

pub(crate) fn seconds(s: f64) -> HostDuration {
    HostDuration::from_secs_f64(s)
}

fn scene(f: &Field, out: &mut Collector) -> Option<Scene> {
    let named = f.word("level").and_then(|w| w.parse::<SimLevel>().ok());
    let mut needs = Vec::new();
    for item in f.get("needs").map_or(&[][..], Field::items) {
        let need = SceneNeed::ALL
            .into_iter()
            .find(|n| Some(n.name()) == item.as_word())?;
        if needs.contains(&need) {
            out.error(item.span, item.path.as_str(), "the need is given twice")
                .found(format!("`{}`", need.name()));
        }
        needs.push(need);
    }
    if f.entries().is_empty() {
        out.error(f.span, "scene", "the scene is empty")
            .expected("`needs`, `level` or both")
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

fn point(f: &Field, key: &str) -> Option<Point2> {
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

fn surroundings(f: &Field, out: &mut Collector) -> Option<Surroundings> {
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

fn depths(root: &Field, max_depth: Option<f64>, out: &mut Collector) -> Option<Vec<f64>> {
    let fields = match root.get("depths") {
        Some(list) => list.items(),
        None => std::slice::from_ref(root.get("depth")?),
    };
    for field in fields {
        depth_within(field, max_depth, out);
    }
    fields.iter().map(Field::as_quantity).collect()
}

fn depth_within(field: &Field, max_depth: Option<f64>, out: &mut Collector) {
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

fn pace(f: &Field, key: &str) -> Option<Pace> {
    match f.get(key)?.value {
        Value::Quantity(v, Dimension::Time) => Some(Pace::Time(v)),
        Value::Quantity(v, _) => Some(Pace::Speed(v)),
        _ => None,
    }
}

fn read_motion(
    m: &Field,
    limits: Option<&Field>,
    clearance: Option<f64>,
    depths: Option<&[f64]>,
    surroundings: Option<&Surroundings>,
    out: &mut Collector,
) -> Option<Motion> {
    let clearance = clearance?;
    let deepest = depths?.iter().copied().fold(0.0, f64::max);
    let max_speed = limits.and_then(|l| l.quantity("max_speed"));
    let travel = m.quantity("travel")?;
    for (key, distance) in [
        ("approach", clearance),
        ("indent", deepest),
        ("retract", clearance + deepest),
        ("travel", 0.0),
    ] {
        let speed = pace(m, key)?.speed_mm_s(distance);
        if let Some(max) = max_speed.filter(|max| speed > *max) {
            let field = m.get(key)?;
            out.error(
                field.span,
                format!("motion.{key}"),
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
            .found(format!("{hold} s"));
    }
    let tolerance = m.get("settle").and_then(|s| s.quantity("tolerance"));
    if let Some(tolerance) = tolerance
        && let Some(shallowest) = depths?.iter().copied().reduce(f64::min)
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
        travel_mm_s: travel,
        period_s: m.quantity("period"),
        home,
    })
}

fn read_limits(l: &Field, motion: Option<&Field>, out: &mut Collector) -> Option<RunLimits> {
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
    })
}

fn read_sync(
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
        let field = f.get(key)?;
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

fn marks(f: &Field, out: &mut Collector) -> Option<Vec<MarkKind>> {
    let mut marks = Vec::new();
    for item in f.get("marks")?.items() {
        let mark = MarkKind::ALL
            .into_iter()
            .find(|m| Some(m.name()) == item.as_word())?;
        if marks.contains(&mark) {
            out.error(item.span, item.path.as_str(), "the mark is given twice")
                .found(format!("`{}`", mark.name()));
        }
        marks.push(mark);
    }
    marks.sort_unstable();
    Some(marks)
}

fn camera(f: &Field, out: &mut Collector) -> CameraRequest {
    let biases = f.get("biases").map_or(&[][..], Field::entries);
    let roi = f.get("roi").and_then(|r| {
        let n = |key| r.count(key).and_then(|n| u16::try_from(n).ok());
        let roi = [n("x")?, n("y")?, n("width")?, n("height")?];
        let [x, y, width, height] = roi;
        if x + width > skinrig_model::SENSOR_WIDTH || y + height > skinrig_model::SENSOR_HEIGHT {
            out.error(r.span, r.path.as_str(), "larger than the sensor")
                .expected("x + width of at most 640 and y + height of at most 480")
                .found(format!("{} and {}", x + width, y + height));
        }
        Some(roi)
    });
    CameraRequest {
        biases: biases
            .iter()
            .filter_map(|(name, v)| match v.value {
                Value::Whole(n) => Some((name.clone(), n)),
                _ => None,
            })
            .collect(),
        roi,
    }
}

/// Whether everything fits into its period, and marks do not overlap. Needs the plan.
fn check_timing(protocol: &Protocol, root: &Field, out: &mut Collector) {
    let at = |path: &[&str]| {
        path.iter()
            .try_fold(root, |f, key| f.get(key))
            .map_or(root.span, |f| f.span)
    };
    let plan = protocol.compile();
    if let Some(late) = timing::first_misfit(&plan) {
        let (path, span, key) = if late.sync {
            (
                "sync.interval",
                at(&["sync", "interval"]),
                "sync presses begin",
            )
        } else {
            ("motion.period", at(&["motion", "period"]), "presses begin")
        };
        out.error(span, path, "the presses do not fit into their time")
            .expected(format!(
                "at least {:.3} s: what {} takes with {:.0} % in reserve (motion {:.3} s, hold and settling {:.3} s, travel to the next {:.3} s)",
                late.needed_s,
                late.press,
                (timing::FIT_RESERVE - 1.0) * 100.0,
                late.motion_s,
                late.still_s,
                late.travel_s
            ))
            .found(format!("{key} every {:.3} s", late.period_s))
            .help("lengthen it, move faster, or lower `motion.clearance` or `motion.hold`");
    }
    let train_s = (PULSES_PER_TRAIN * PULSE_PERIOD_US) as f64 * 1e-6;
    for press in timing::distinct_presses(&plan) {
        let moments = timing::moments_s(&plan.limits, press);
        let chosen: Vec<_> = press
            .marks
            .iter()
            .filter_map(|m| moments.iter().find(|(k, _)| k == m))
            .collect();
        for pair in chosen.windows(2) {
            if let [(a, from), (b, to)] = pair
                && to - from < train_s
            {
                out.error(
                    at(&["triggers", "marks"]),
                    "triggers.marks",
                    "two marks overlap",
                )
                .expected(format!(
                    "at least {:.1} ms between marks, the length of a coded pulse",
                    train_s * 1e3
                ))
                .found(format!(
                    "{:.1} ms from `{}` to `{}`",
                    (to - from) * 1e3,
                    a.name(),
                    b.name()
                ))
                .help("remove one of the two marks, or move more slowly between them");
                return;
            }
        }
    }
}
