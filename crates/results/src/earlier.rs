//! Owns the calibration of an earlier session: whether it may be about the same skin, and its analysis.

use std::collections::BTreeMap;
use std::path::Path;

use skinrig_analysis::locator::EarlierCalibration;
use skinrig_analysis::result::EarlierSession;
use skinrig_analysis::{AnalysisError, analyze as analyze_input};
use skinrig_model::{AnalysisSettings, CameraId, DeviceRole, Setting};
use skinrig_protocol::Protocol;
use skinrig_recorder::{DeviceRow, RecorderError, SessionReader};

use crate::earlier_mismatch::EarlierMismatch;
use crate::error::ResultsError;
use crate::events::SessionEvents;
use crate::origin::Origin;
use crate::rig_document::RigDocument;
use crate::session::Session;
use crate::settings::AnalysisOptions;
use crate::shared_events::{event_runs, shared};

/// Larger shares of the same events are those of the same presses. Simulations with the same seed share sync presses and noise between
/// presses.
const SAME_EVENTS: f64 = 0.25;

/// Analyses the session at `path` as far as its calibration, with the settings of `session`, whose events are `events`, so that the
/// columns of both mean the same. Presses that the earlier protocol excludes by hand stay excluded.
///
/// # Errors
/// [`ResultsError::Earlier`] if it cannot be about the same skin and cameras; else as for any analysis.
pub(crate) fn calibration(
    session: &Session,
    events: &SessionEvents,
    path: &Path,
) -> Result<EarlierCalibration, ResultsError> {
    let mut earlier = Session::open(path, AnalysisOptions::default())?;
    let refused = |why: EarlierMismatch| {
        let path = path.to_owned();
        Err(ResultsError::Earlier { path, why })
    };
    if let Some(why) = mismatch(session, &earlier)? {
        return refused(why);
    }
    earlier.settings = AnalysisSettings {
        exclude_press_numbers: earlier.settings.exclude_press_numbers,
        selected_out: Vec::new(),
        study_presses: 0,
        ..session.settings.clone()
    };
    let seal = earlier.reader.seal()?;
    let about = EarlierSession {
        session_id: earlier.reader.session_id()?,
        content_sha256: seal.map(|s| s.content_sha256()),
        started: earlier.header.started_at.clone(),
    };
    let aligned = earlier.read_input()?.align();
    let same = shared(&event_runs(events)?, &event_runs(&aligned.events)?);
    if same > SAME_EVENTS {
        let percent = 100.0 * same;
        return refused(EarlierMismatch::SameEvents { percent });
    }
    let analysis = analyze_input(&aligned.input, &aligned.events)?;
    Ok(EarlierCalibration::new(about, &analysis).map_err(AnalysisError::from)?)
}

fn mismatch(this: &Session, earlier: &Session) -> Result<Option<EarlierMismatch>, RecorderError> {
    if this.reader.session_id()? == earlier.reader.session_id()? {
        return Ok(Some(EarlierMismatch::SameSession));
    }
    let rigs = [earlier, this].map(rig);
    if rigs[0] != rigs[1] {
        let [earlier, this] = rigs;
        return Ok(Some(EarlierMismatch::OtherRig { earlier, this }));
    }
    let faults = [earlier, this].map(planted_faults);
    if faults[0] != faults[1] {
        let [earlier, this] = faults;
        return Ok(Some(EarlierMismatch::OtherFaults { earlier, this }));
    }
    let skins = [earlier, this].map(|s| s.header.prototype.clone());
    if skins[0] != skins[1] {
        let [earlier, this] = skins;
        return Ok(Some(EarlierMismatch::OtherSkin { earlier, this }));
    }
    if this.rig.outline != earlier.rig.outline {
        return Ok(Some(EarlierMismatch::OtherOutline));
    }
    let tips = [earlier, this].map(tips);
    let shared = tips[1].iter().find_map(|(name, this)| {
        let earlier = tips[0].get(name)?;
        (earlier != this).then(|| (earlier.clone(), this.clone()))
    });
    if let Some((earlier, this)) = shared {
        return Ok(Some(EarlierMismatch::OtherTip { earlier, this }));
    }
    for camera in CameraId::ALL {
        let k = camera.index();
        if this.rig.nominal.cameras[k] != earlier.rig.nominal.cameras[k] {
            return Ok(Some(EarlierMismatch::OtherGeometry { camera }));
        }
        let devices = (
            device(&earlier.reader, camera)?,
            device(&this.reader, camera)?,
        );
        let (Some(earlier), Some(this)) = devices else {
            continue;
        };
        let serials = [&earlier, &this].map(|d| d.identity.serial.clone());
        if serials[0] != serials[1] && serials.iter().all(|s| !s.is_empty()) {
            let [earlier, this] = serials;
            return Ok(Some(EarlierMismatch::OtherCamera {
                camera,
                earlier,
                this,
            }));
        }
        if let Some(other) = other_setting(camera, &earlier, &this) {
            return Ok(Some(other));
        }
    }
    Ok(None)
}

/// What recorded a session, in words: its origin and, of a simulation, its level. A replay counts as what it replays.
fn rig(session: &Session) -> String {
    let origin = Origin::of(&session.header);
    let origin = origin.map_or("unknown", Origin::name);
    match rig_value(session)["level"].as_str() {
        Some(level) => format!("{origin}, level {level}"),
        None => origin.to_owned(),
    }
}

/// The planted faults of a simulation, as it describes them.
fn planted_faults(session: &Session) -> String {
    let rig = rig_value(session);
    let faults = rig["faults"].as_array().into_iter().flatten();
    let faults: Vec<String> = faults
        .map(|f| f.as_str().unwrap_or("?").to_owned())
        .collect();
    if faults.is_empty() {
        "none".to_owned()
    } else {
        faults.join(", ")
    }
}

fn rig_value(session: &Session) -> serde_json::Value {
    let document = serde_json::from_str::<RigDocument>(&session.header.rig_json);
    document.map(|d| d.rig).unwrap_or_default()
}

/// A camera as recorded by the last leg; `None` if the session has none, as an import.
fn device(reader: &SessionReader, camera: CameraId) -> Result<Option<DeviceRow>, RecorderError> {
    let role = DeviceRole::of_camera(camera);
    Ok(reader.devices()?.into_iter().rev().find(|d| d.role == role))
}

/// The first setting of a camera that changes which events it sends.
fn other_setting(
    camera: CameraId,
    earlier: &DeviceRow,
    this: &DeviceRow,
) -> Option<EarlierMismatch> {
    let settings = [earlier, this].map(|device| {
        let all = device.settings.iter().filter(|s| {
            s.name.starts_with("bias") || matches!(s.name.as_str(), "roi" | "noise_filter")
        });
        all.map(|s| (s.name.as_str(), value(s)))
            .collect::<BTreeMap<_, _>>()
    });
    let names = settings[0].keys().chain(settings[1].keys());
    let of = |k: usize, name: &str| settings[k].get(name).copied().unwrap_or("not set");
    let mut names = names.filter(|name| of(0, name) != of(1, name));
    names.next().map(|name| EarlierMismatch::OtherSetting {
        camera,
        name: (*name).to_owned(),
        earlier: of(0, name).to_owned(),
        this: of(1, name).to_owned(),
    })
}

/// Some cameras cannot read back what was requested.
fn value(setting: &Setting) -> &str {
    if setting.was_requested() {
        &setting.requested
    } else {
        &setting.read_back
    }
}

/// The tip, as protocol and rig describe it.
fn tips(session: &Session) -> BTreeMap<&'static str, String> {
    let header = &session.header;
    let mut tips = BTreeMap::new();
    let no_file = |p: &Path| Err(std::io::Error::other(p.display().to_string()));
    let text = header.protocol_text.as_bytes();
    let name = &header.protocol_name;
    let protocol = Protocol::parse_recorded(name, text, &header.overrides, &no_file);
    let tip = protocol.ok().and_then(|p| p.prototype.tip);
    tips.extend(tip.map(|tip| ("prototype", format!("`{tip}`"))));
    let rig = rig_value(session);
    let (shape, size) = (rig["tip"]["shape"].as_str(), rig["tip"]["size_mm"].as_f64());
    tips.extend(
        shape
            .zip(size)
            .map(|(shape, mm)| ("bench", format!("{shape} of {mm} mm"))),
    );
    let side = rig["tip_side_mm"].as_f64();
    tips.extend(side.map(|mm| ("simulation", format!("cube of {mm} mm"))));
    tips
}
