//! Assembles a protocol from its keys, with checks across keys.

use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::level_bias::{is_measured_for, is_measured_over, is_measured_with};
use skinrig_model::pulse::MAX_MARKED_PRESS;
use skinrig_model::{PressRole, PulseTrain, SimLevel, SkinOutline, StereoGeometry};
use skinrig_settings::{Collector, Diagnostics, Field, Finding, Settings, Span, open, rewrite};

use crate::file::hex;
use crate::keys::{
    LimitKeys, MotionKeys, MotionParts, Order, ProtocolKeys, SyncKeys, calibration_possible, roles,
};
use crate::online::Taught;
use crate::path::locations;
use crate::plan::RunLimits;
use crate::protocol::{Loader, Motion, Pace, Protocol, Scene, Sync};
use crate::surface::Surface;
use crate::timing;

impl Protocol {
    /// Reads a protocol from the bytes of a file.
    ///
    /// `name` is the file's name for messages, and files named in the protocol are looked up in its folder through
    /// `loader`. Each override is `key.path=value` as given with `--set`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(
        name: &str,
        bytes: &[u8],
        overrides: &[String],
        loader: Loader<'_>,
    ) -> Result<Self, Diagnostics> {
        protocol(name, bytes, overrides, loader, false)
    }

    /// Reads the protocol of a recording, which may contain keys that are invalid in a new one (`analysis.exclude_presses`). Otherwise as
    /// [`Protocol::parse`].
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse_recorded(
        name: &str,
        bytes: &[u8],
        overrides: &[String],
        loader: Loader<'_>,
    ) -> Result<Self, Diagnostics> {
        protocol(name, bytes, overrides, loader, true)
    }
}

/// Text of a protocol with the overrides applied: the same values, without comments.
///
/// # Errors
/// [`Diagnostics`] for text that is not YAML, and for overrides of unknown keys. Values are not tested.
pub fn protocol_with(name: &str, text: &str, overrides: &[String]) -> Result<String, Diagnostics> {
    rewrite(name, text, overrides, ProtocolKeys::TABLE)
}

/// Reads a protocol; see [`Protocol::parse`].
fn protocol(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
    loader: Loader<'_>,
    recorded: bool,
) -> Result<Protocol, Diagnostics> {
    let (mut out, root) = open(name, bytes, overrides, ProtocolKeys::TABLE)?;
    out.recorded = recorded;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut protocol = root.and_then(|root| {
        let protocol = assemble(&root, folder, loader, &mut out)?;
        if out.is_clean() {
            check_timing(&protocol, &root, &mut out);
        }
        if !recorded {
            within_skin(&protocol.scene, &root, &mut out);
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
            out.error(span, "", "the file could not be compiled")
                .expected("a protocol")
                .found("a file that passes every check but yields no protocol")
                .help("this is a bug in skinrig: please report it with the file");
        }
        _ => {}
    }
    match protocol {
        Some(protocol) if out.is_clean() => Ok(protocol),
        _ => Err(out.finish()),
    }
}

/// Reads every part even if another one failed, so that all findings appear at once.
fn assemble(
    root: &Field,
    folder: &Path,
    loader: Loader<'_>,
    out: &mut Collector,
) -> Option<Protocol> {
    let keys = ProtocolKeys::read_parts(root, out);
    let surroundings = keys.frame.as_ref().map(|frame| frame.surroundings());
    let outline = surroundings.as_ref().map(|s| s.outline);
    let depths_mm = match (&keys.depths_mm, &keys.depth_mm) {
        (Some(Some(depths)), _) => Some(depths.clone()),
        (_, Some(Some(depth))) => Some(vec![*depth]),
        _ => None,
    };
    // Cross-checks need only the values that were read; findings of these parts are in `out` already.
    let discarded = &mut Collector::default();
    let limits = LimitKeys::read_parts(root.at("limits"), discarded);
    let motion = MotionKeys::read_parts(root.at("motion"), discarded);
    if let Some(max_mm) = limits.max_depth_mm {
        let message = "deeper than the limit allows";
        deeper_than(
            root,
            |mm| mm > max_mm,
            message,
            out,
            |finding| {
                finding
                    .expected(format!("at most {max_mm} mm, `limits.max_depth`"))
                    .help("reduce the depth, or raise `limits.max_depth` if the skin can take it")
            },
        );
    }
    check_motion(
        &motion,
        limits.max_speed_mm_s,
        depths_mm.as_deref(),
        root,
        out,
    );
    let path = keys.path.as_ref().and_then(|path| {
        let seed = keys.seed.unwrap_or(1);
        let field = root.at("path");
        locations(
            path,
            field,
            surroundings.as_ref(),
            seed,
            folder,
            loader,
            out,
        )
    });
    let count = keys.repetitions.as_ref().map(|r| r.count);
    let evaluation = root.at("evaluation");
    let roles = count.and_then(|count| roles(evaluation, count, out));
    if let (Some(roles), Some(analysis)) = (&roles, &keys.analysis) {
        calibration_possible(roles, analysis, evaluation, out);
    }
    let press = keys.press.as_ref().and_then(Option::as_ref);
    if let Some(surface) = press {
        let field = root.at("press");
        band_fits(
            surface,
            field,
            motion.clearance_mm,
            limits.max_depth_mm,
            out,
        );
    }
    let surface_check = declared(keys.surface_check, |check| {
        check.touching(press, root.at("surface_check"), out)
    });
    let stop = declared(keys.stop, |stop| {
        stop.declare(roles.as_deref()?, root.at("stop"), evaluation, out)
    });
    let online = declared(keys.online, |online| {
        online.online(roles.as_deref()?, root.at("online"), out)
    });

    let (path_kind, locations) = path?;
    let (depths_mm, roles, outline) = (depths_mm?, roles?, outline?);
    let deepest_mm = depths_mm.iter().copied().fold(0.0, f64::max);
    let is_measured = outline == SkinOutline::PAPER
        && keys.analysis.as_ref().is_none_or(is_measured_with)
        && is_measured_over(&locations)
        && motion
            .indent
            .zip(motion.hold)
            .is_some_and(|(indent, hold)| {
                let speed_mm_s = indent.speed_mm_s(deepest_mm);
                is_measured_for(&depths_mm, speed_mm_s, 1e3 * hold.as_secs_f64())
            });
    let scene = keys.scene?;
    scene.within_measured(is_measured, root.at("scene"), out);
    let least = keys.analysis.as_ref().map_or(0.0, |a| a.min_ray_sine);
    scene.cameras_see(
        &locations,
        outline.centre,
        least,
        root.at("scene.cameras"),
        out,
    );
    let scene = scene.scene(outline.centre, is_measured);
    let calibrate_at = declared(keys.calibrate_at, |keys| {
        let cameras = scene
            .cameras
            .map_or(StereoGeometry::PAPER, |cameras| StereoGeometry { cameras });
        let field = root.at("calibrate_at");
        keys.choose(&locations, &roles, &cameras, field, out)
    })?;
    if let Some(Some(react)) = online.as_ref().map(|o| o.as_ref().and_then(|o| o.react)) {
        let places = calibrate_at.as_ref().map_or(locations.len(), Vec::len);
        let calibrating = roles.iter().filter(|r| **r == PressRole::Calibrate).count();
        let taught = Taught {
            presses: places * depths_mm.len() * calibrating,
            places,
            of: locations.len(),
        };
        let deepest_mm = depths_mm.iter().copied().fold(0.0, f64::max);
        react.can_act(taught, deepest_mm, root.at("online.react"), out);
    }
    let sync = declared(keys.sync, |keys| sync(&keys, outline, &depths_mm))?;
    let presses = locations.len() as u64 * depths_mm.len() as u64 * roles.len() as u64
        + sync.as_ref().map_or(0, |s: &Sync| u64::from(s.count));
    // The last number that a mark can carry tests the trigger line.
    if presses > u64::from(MAX_MARKED_PRESS) {
        out.error(root.at("path").span, "path", "too many presses")
            .expected(format!("at most {MAX_MARKED_PRESS} presses in all"))
            .found(presses.to_string())
            .help("split the campaign into several protocols");
        return None;
    }
    let (limits, motion, seed) = (keys.limits?, keys.motion?, keys.seed?);
    let between = keys.repetitions?.between;
    Some(Protocol {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        overrides: Vec::new(),
        name: keys.name?,
        description: keys.description?,
        operator: keys.operator?,
        prototype: keys.prototype?,
        seed,
        scene,
        surroundings: surroundings?,
        sync,
        locations,
        path_kind,
        roles,
        calibrate_at,
        return_to_start: between.return_to_start,
        pause_between: between.pause,
        shuffle_seed: match keys.order? {
            Order::Listed => None,
            Order::Shuffled(shuffled) => Some(shuffled.seed.unwrap_or(seed)),
        },
        depths_mm,
        limits: run_limits(&limits, &motion),
        max_consecutive_invalid: limits.max_consecutive_invalid,
        motion: Motion {
            approach: motion.approach,
            indent: motion.indent,
            hold: motion.hold,
            retract: motion.retract,
            travel_mm_s: motion.travel_mm_s,
            period_s: motion.period_s,
            home: match motion.home {
                Some(home) => home,
                None => outline.centre.at_height(motion.clearance_mm),
            },
        },
        retakes: keys.retakes?,
        surface_check: surface_check?,
        suspend: keys.suspend?,
        stop: stop?,
        online: online?,
        faults: keys.faults?.unwrap_or_default(),
        marks: keys.triggers?.marks,
        surface: keys.press?,
        analysis: keys.analysis?,
        cameras: keys.cameras?.requests(),
        key_places: crate::findings::places(root, &out.sources),
    })
}

/// Evaluates an optional part: `None` if it could not be read or evaluated, `Some(None)` if it is absent.
fn declared<T, U>(
    part: Option<Option<T>>,
    evaluate: impl FnOnce(T) -> Option<U>,
) -> Option<Option<U>> {
    match part? {
        Some(keys) => evaluate(keys).map(Some),
        None => Some(None),
    }
}

/// Reports the depths of presses and sync presses that are too deep.
fn deeper_than(
    root: &Field,
    is_too_deep: impl Fn(f64) -> bool,
    message: &'static str,
    out: &mut Collector,
    explain: impl for<'a> Fn(Finding<'a>) -> Finding<'a>,
) {
    let listed = root.get("depths").map_or(&[][..], Field::items).iter();
    let sync = root.get("sync").and_then(|sync| sync.get("depth"));
    for field in listed.chain(root.get("depth")).chain(sync) {
        let Some(depth_mm) = field.as_quantity().filter(|d| is_too_deep(*d)) else {
            continue;
        };
        explain(out.error(field.span, field.path.as_str(), message))
            .found(format!("{depth_mm} mm"));
    }
}

/// Thickness of the published skin (paper, section III), mm.
const PUBLISHED_THICKNESS_MM: f64 = 4.0;

/// Checks that the tip stays inside the simulated skin.
fn within_skin(scene: &Scene, root: &Field, out: &mut Collector) {
    let thickness_mm = match scene.skin {
        Some(skin) => skin.thickness_mm,
        None if scene.level == SimLevel::Optical => PUBLISHED_THICKNESS_MM,
        None => return,
    };
    let message = "the press goes through the simulated skin";
    deeper_than(
        root,
        |mm| mm >= thickness_mm,
        message,
        out,
        |finding| {
            finding
                .expected(format!("less than {thickness_mm} mm, its thickness"))
                .help(
                    "reduce the depth, or set `scene.skin.thickness` to the thickness of your skin",
                )
        },
    );
}

/// Checks that the motion is consistent and within the limits of speed and depth.
fn check_motion(
    motion: &MotionParts,
    max_speed_mm_s: Option<f64>,
    depths_mm: Option<&[f64]>,
    root: &Field,
    out: &mut Collector,
) {
    let clearance_mm = motion.clearance_mm;
    let deepest_mm = depths_mm.map(|d| d.iter().copied().fold(0.0, f64::max));
    let both_mm = clearance_mm.zip(deepest_mm).map(|(c, d)| c + d);
    let travel = motion.travel_mm_s.map(Pace::Speed);
    // A speed needs no distance; a time does.
    for (key, pace, distance_mm) in [
        ("motion.approach", motion.approach, clearance_mm),
        ("motion.indent", motion.indent, deepest_mm),
        ("motion.retract", motion.retract, both_mm),
        ("motion.travel", travel, Some(0.0)),
    ] {
        let speed_mm_s = match (pace, distance_mm) {
            (Some(Pace::Speed(speed_mm_s)), _) => speed_mm_s,
            (Some(pace), Some(distance_mm)) => pace.speed_mm_s(distance_mm),
            _ => continue,
        };
        if let Some(max_mm_s) = max_speed_mm_s.filter(|max| speed_mm_s > *max) {
            out.error(root.at(key).span, key, "faster than the limit allows")
                .expected(format!("at most {max_mm_s} mm/s, `limits.max_speed`"))
                .found(format!("{speed_mm_s} mm/s"))
                .help("move more slowly, or raise `limits.max_speed`");
        }
    }
    if let (Some(Some(period_s)), Some(hold)) = (motion.period_s, motion.hold)
        && hold.as_secs_f64() >= period_s
    {
        let field = root.at("motion.hold");
        out.error(
            field.span,
            "motion.hold",
            "the hold is longer than the period",
        )
        .expected(format!("less than `motion.period`, {period_s} s"))
        .found(format!("{} s", hold.as_secs_f64()))
        .help("shorten the hold or lengthen the period");
    }
    let shallowest_mm = depths_mm.and_then(|d| d.iter().copied().reduce(f64::min));
    let room_mm = clearance_mm.zip(shallowest_mm).map(|(c, d)| c.min(d));
    if let (Some(settle), Some(room_mm)) = (&motion.settle, room_mm)
        && settle.tolerance_mm >= room_mm
    {
        out.error(
            root.at("motion.settle").span,
            "motion.settle.tolerance",
            "the tolerance hides the press",
        )
        .expected(format!(
            "less than the smallest depth and the clearance, {room_mm} mm"
        ))
        .found(format!("{} mm", settle.tolerance_mm));
    }
    if let (Some(Some(home)), Some(clearance_mm)) = (motion.home, clearance_mm)
        && home.z_mm < clearance_mm
    {
        let field = root.at("motion.home");
        out.error(field.span, "motion.home", "home is below clearance height")
            .expected(format!(
                "z of at least {clearance_mm} mm, `motion.clearance`"
            ))
            .found(format!("{} mm", home.z_mm));
    }
}

fn run_limits(limits: &LimitKeys, motion: &MotionKeys) -> RunLimits {
    let (min, max) = (limits.workspace.min, limits.workspace.max);
    RunLimits {
        workspace_min_mm: [min.x_mm, min.y_mm, min.z_mm],
        workspace_max_mm: [max.x_mm, max.y_mm, max.z_mm],
        clearance_mm: motion.clearance_mm,
        max_depth_mm: limits.max_depth_mm,
        max_speed_mm_s: limits.max_speed_mm_s,
        max_force_n: limits.max_force_n,
        position_tolerance_mm: motion.settle.tolerance_mm,
        settle_time: motion.settle.time,
        max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
        on_trip: limits.on_trip,
    }
}

fn sync(keys: &SyncKeys, outline: SkinOutline, depths_mm: &[f64]) -> Option<Sync> {
    Some(Sync {
        count: keys.count,
        interval_s: keys.interval_s,
        at: keys.at.unwrap_or(outline.centre),
        pause_after: keys.pause_after,
        depth_mm: keys.depth_mm.or_else(|| depths_mm.first().copied())?,
    })
}

/// Checks that the search band is below clearance height and above the floor.
fn band_fits(
    surface: &Surface,
    f: &Field,
    clearance_mm: Option<f64>,
    max_depth_mm: Option<f64>,
    out: &mut Collector,
) {
    let Surface::Touch(search) = surface else {
        return;
    };
    for (limit, key) in [
        (clearance_mm, "motion.clearance"),
        (max_depth_mm, "limits.max_depth"),
    ] {
        if let Some(limit) = limit.filter(|limit| search.band_mm >= *limit) {
            let span = f.get("band").map_or(f.span, |b| b.span);
            out.error(
                span,
                "press.band",
                "the search would begin or end too far off",
            )
            .expected(format!("less than {limit} mm, `{key}`"))
            .found(format!("{} mm", search.band_mm));
            return;
        }
    }
}

/// Checks that each press fits into its period and that marks do not overlap. Needs the plan.
fn check_timing(protocol: &Protocol, root: &Field, out: &mut Collector) {
    let plan = protocol.compile();
    if let Some(late) = timing::first_misfit(&plan) {
        let (path, span, key) = if late.sync {
            (
                "sync.interval",
                root.at("sync.interval").span,
                "sync presses begin",
            )
        } else {
            (
                "motion.period",
                root.at("motion.period").span,
                "presses begin",
            )
        };
        out.error(span, path, "the presses do not fit into their time")
            .expected(format!(
                "at least {:.3} s: the time of {} plus {:.0} % reserve (motion {:.3} s, hold and settling {:.3} s, travel to the next {:.3} s)",
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
    let train_s = PulseTrain::DURATION_US as f64 * 1e-6;
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
                    root.at("triggers.marks").span,
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
