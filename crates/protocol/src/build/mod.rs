//! From fields to a protocol: what single keys cannot say, checked across keys.

mod parts;
mod path;

use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::pulse::MAX_MARKED_PRESS;
use skinrig_model::{AnalysisSettings, HostDuration, PulseTrain};

use crate::keys::PROTOCOL;
use crate::protocol::{Loader, Protocol, Prototype, Sync};
use crate::shape::{Field, Keys};
use crate::surface::Surface;
use crate::timing;
pub(crate) use parts::{biases, calibration_possible, nominal_camera, outline, roi, roles};
use parts::{camera, depths, marks, read_limits, read_motion, read_sync, scene, surroundings};
use skinrig_settings::Span;
use skinrig_settings::{Collector, Diagnostics};
use skinrig_settings::{Settings, open};

/// Reads a protocol; see [`Protocol::parse`].
pub(crate) fn protocol(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
    loader: Loader<'_>,
    recorded: bool,
) -> Result<Protocol, Diagnostics> {
    let (mut out, root) = open(name, bytes, overrides, &PROTOCOL)?;
    out.recorded = recorded;
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
                .expected("a protocol")
                .found("an input that passed every check and still has no meaning")
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
    let faults = match root.get("faults") {
        Some(f) => crate::faults::faults(f, out),
        None => Some(Vec::new()),
    };
    let suspend = root
        .get("suspend")
        .and_then(|s| crate::suspend::suspend(s, out));
    let limits_read = limits.and_then(|l| read_limits(l, motion, out));
    let path = root.get("path").and_then(|f| {
        path::locations(
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
        .and_then(|f| AnalysisSettings::from_mapping(f, out));
    if let (Some(roles), Some(analysis), Some(field)) = (&roles, &analysis, root.get("evaluation"))
    {
        calibration_possible(roles, analysis, field, out);
    }
    let surface = root.get("press").map(|f| {
        let surface = crate::surface::surface(f)?;
        band_fits(&surface, f, clearance, max_depth, out);
        Some(surface)
    });
    let surface_check = root.get("surface_check").map(|f| {
        crate::surface_check::surface_check(f, surface.as_ref().and_then(Option::as_ref), out)
    });
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
    // The last number that a mark can carry tests the trigger line.
    if presses > u64::from(MAX_MARKED_PRESS) {
        let span = root.get("path").map_or(root.span, |f| f.span);
        out.error(span, "path", "too many presses")
            .expected(format!("at most {MAX_MARKED_PRESS} presses in all"))
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
        retakes: root.get("retakes").and_then(crate::retakes::retakes)?,
        max_consecutive_invalid: limits?.count("max_consecutive_invalid")?,
        surface_check: surface_check.map_or(Some(None), |s| s.map(Some))?,
        suspend: suspend?,
        faults: faults?,
        marks: marks?,
        surface: surface.map_or(Some(None), |s| s.map(Some))?,
        analysis: analysis?,
        cameras: cameras?,
        key_places: crate::findings::places(root, &out.sources),
    })
}

/// The band in which a touch is believed lies below clearance height and above the floor.
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

pub(crate) fn seconds(s: f64) -> HostDuration {
    HostDuration::from_secs_f64(s)
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
