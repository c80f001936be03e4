//! From fields to a rig file: what single keys cannot say, checked across keys.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use skinrig_model::HostDuration;

use super::keys::RIG;
use super::{Environment, PreflightLimits, RigFile, RigKind, camera, frame, hil, robot};
use crate::build::hex;
use crate::shape::{Field, Keys, Value};
use crate::surface::surface;
use skinrig_settings::open;
use skinrig_settings::{Collector, Diagnostics};

/// Where paths of a rig file lead.
pub(super) struct Places<'a> {
    folder: &'a Path,
    environment: Environment<'a>,
}

impl Places<'_> {
    /// The text with every `${NAME}` replaced.
    pub(super) fn text(&self, f: &Field, out: &mut Collector) -> Option<String> {
        let Value::Text(text) = &f.value else {
            return None;
        };
        let mut done = String::new();
        let mut rest = text.as_str();
        while let Some((before, after)) = rest.split_once("${") {
            done.push_str(before);
            let Some((name, after)) = after.split_once('}') else {
                out.error(f.span, f.path.as_str(), "the variable has no end")
                    .expected("`${NAME}`")
                    .found(format!("`{text}`"));
                return None;
            };
            match (self.environment)(name) {
                Some(value) if !value.is_empty() => done.push_str(&value),
                _ => {
                    out.error(
                        f.span,
                        f.path.as_str(),
                        "the environment variable is not set",
                    )
                    .expected(format!("a value of `{name}`"))
                    .found("none")
                    .help(format!("export {name}=..., or write the path out"));
                    return None;
                }
            }
            rest = after;
        }
        done.push_str(rest);
        Some(done)
    }

    /// The text as a path, relative to the rig file's folder.
    pub(super) fn path(&self, f: &Field, out: &mut Collector) -> Option<PathBuf> {
        Some(self.folder.join(self.text(f, out)?))
    }
}

/// Reads a rig file; see [`RigFile::parse`].
pub(super) fn rig(
    name: &str,
    bytes: &[u8],
    environment: Environment<'_>,
) -> Result<RigFile, Diagnostics> {
    let (mut out, root) = open(name, bytes, &[], &RIG)?;
    let places = Places {
        folder: Path::new(name).parent().unwrap_or(Path::new("")),
        environment,
    };
    let rig = root.and_then(|root| assemble(&root, &places, &mut out));
    match rig {
        Some(rig) if out.is_clean() => Ok(RigFile {
            file_name: name.to_owned(),
            text: String::from_utf8_lossy(bytes).into_owned(),
            sha256: hex(&Sha256::digest(bytes)),
            ..rig
        }),
        _ => Err(out.finish()),
    }
}

/// Every part is read even when another one failed, so that all findings appear at once.
fn assemble(root: &Field, places: &Places<'_>, out: &mut Collector) -> Option<RigFile> {
    let frame = root.get("frame").and_then(|f| frame::frame(f, out));
    let tip = root.get("tip").and_then(|f| robot::tip(f, out));
    let limits = root.get("limits").and_then(|f| robot::limits(f, out));
    let max_force = root.get("limits").and_then(|l| l.quantity("max_force"));
    let robot = root
        .get("robot")
        .and_then(|f| robot::robot(f, max_force, places, out));
    let cameras = root
        .get("cameras")
        .and_then(|f| camera::cameras(f, places, out));
    let trigger_box = root
        .get("trigger_box")
        .map(|f| camera::trigger_box(f, places, out));
    let preflight = root.get("preflight").and_then(preflight);
    if let (Some(cameras), Some(device)) = (&cameras, root.get("trigger_box")) {
        camera::wired(cameras, device, out);
    }
    let press = root.get("press").map(surface);
    let hil = root.get("hil").and_then(|f| hil::hil(f, places, out));
    if let (Some(frame), Some(limits)) = (&frame, &limits) {
        inside(frame, limits, root, out);
    }
    Some(RigFile {
        file_name: String::new(),
        text: String::new(),
        sha256: String::new(),
        name: root.text("name")?,
        kind: match root.word("kind")? {
            "emulated" => RigKind::Emulated,
            _ => RigKind::Bench,
        },
        description: root.text("description"),
        frame: frame?,
        tip: tip?,
        limits: limits?,
        robot: robot?,
        cameras: cameras?,
        trigger_box: trigger_box.map_or(Some(None), |b| b.map(Some))?,
        preflight: preflight?,
        surface: press.map_or(Some(None), |p| p.map(Some))?,
        hil: hil?,
    })
}

/// Every touched point, or the skin's origin, within the workspace.
fn inside(frame: &super::Frame, limits: &super::BenchLimits, root: &Field, out: &mut Collector) {
    let places: Vec<(String, [f64; 3])> = match &frame.touch_off {
        Some(touched) => touched
            .points
            .iter()
            .map(|p| (p.name.clone(), p.robot.to_array()))
            .collect(),
        None => vec![(
            "the skin's origin".to_owned(),
            frame.robot_from_skin.translation_mm,
        )],
    };
    let (min, max) = (limits.workspace_min_mm, limits.workspace_max_mm);
    for (name, p) in places {
        if (0..3).all(|i| (min[i]..=max[i]).contains(&p[i])) {
            continue;
        }
        let field = root.get("limits").and_then(|l| l.get("workspace"));
        out.error(
            field.map_or(root.span, |f| f.span),
            "limits.workspace",
            "the skin lies outside the workspace",
        )
        .expected(format!("{name} from {min:?} to {max:?} mm, robot frame"))
        .found(format!("{p:?} mm"));
        return;
    }
}

fn preflight(f: &Field) -> Option<PreflightLimits> {
    let span = |key| f.quantity(key).map(HostDuration::from_secs_f64);
    Some(PreflightLimits {
        touch_off_max_age: span("touch_off_max_age")?,
        data_rate_b_s: f.quantity("data_rate")?,
        min_free_disk_b: f.quantity("min_free_disk")?,
        loopback_within: span("loopback_within")?,
        clocks_within: span("clocks_within")?,
    })
}
