//! Owns the calibration of an earlier session: whether it may be about the same skin, and its analysis.

use std::path::Path;

use skinrig_analysis::locator::EarlierCalibration;
use skinrig_analysis::result::EarlierSession;
use skinrig_analysis::{AnalysisError, analyze as analyze_input};
use skinrig_model::{AnalysisSettings, CameraId, DeviceRole};
use skinrig_recorder::{RecorderError, SessionReader};

use crate::earlier_mismatch::EarlierMismatch;
use crate::error::ResultsError;
use crate::session::Session;
use crate::settings::AnalysisOptions;

/// Analyses the session at `path` as far as its calibration, with the settings of `session`, so that the columns of both mean
/// the same. Presses that the earlier protocol excludes by hand stay excluded.
///
/// # Errors
/// [`ResultsError::Earlier`] if it cannot be about the same skin and cameras; else as for any analysis.
pub(crate) fn calibration(
    session: &Session,
    path: &Path,
) -> Result<EarlierCalibration, ResultsError> {
    let mut earlier = Session::open(path, AnalysisOptions::default())?;
    if let Some(why) = mismatch(session, &earlier)? {
        let path = path.to_owned();
        return Err(ResultsError::Earlier { path, why });
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
    let analysis = analyze_input(&aligned.input, &aligned.events)?;
    Ok(EarlierCalibration::new(about, &analysis).map_err(AnalysisError::from)?)
}

fn mismatch(this: &Session, earlier: &Session) -> Result<Option<EarlierMismatch>, RecorderError> {
    if this.reader.session_id()? == earlier.reader.session_id()? {
        return Ok(Some(EarlierMismatch::SameSession));
    }
    let skins = [earlier, this].map(|s| s.header.prototype.clone());
    if skins[0] != skins[1] {
        let [earlier, this] = skins;
        return Ok(Some(EarlierMismatch::OtherSkin { earlier, this }));
    }
    if this.rig.outline != earlier.rig.outline {
        return Ok(Some(EarlierMismatch::OtherOutline));
    }
    for camera in CameraId::ALL {
        let k = camera.index();
        if this.rig.nominal.cameras[k] != earlier.rig.nominal.cameras[k] {
            return Ok(Some(EarlierMismatch::OtherGeometry { camera }));
        }
        let serials = (
            serial(&earlier.reader, camera)?,
            serial(&this.reader, camera)?,
        );
        if let (Some(earlier), Some(this)) = serials
            && earlier != this
        {
            return Ok(Some(EarlierMismatch::OtherCamera {
                camera,
                earlier,
                this,
            }));
        }
    }
    Ok(None)
}

/// Serial number of a camera; `None` if the session states none, as an import does.
fn serial(reader: &SessionReader, camera: CameraId) -> Result<Option<String>, RecorderError> {
    let role = DeviceRole::of_camera(camera);
    let mut devices = reader.devices()?.into_iter().rev();
    let own = devices.find(|d| d.role == role);
    Ok(own.map(|d| d.identity.serial).filter(|s| !s.is_empty()))
}
