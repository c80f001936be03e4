//! Owns the rig description in a session.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use skinrig_model::{AnalysisSettings, PressId, RigGeometry};

/// Content of `RunHeader::rig_json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "StoredRigDocument")]
pub struct RigDocument {
    /// Geometry for the analysis.
    pub geometry: RigGeometry,
    /// The analysis settings of the protocol.
    pub analysis: AnalysisSettings,
    /// Full description of the rig.
    pub rig: Value,
}

/// [`RigDocument`] as written by any version.
#[derive(Deserialize)]
struct StoredRigDocument {
    geometry: RigGeometry,
    analysis: Value,
    rig: Value,
}

impl TryFrom<StoredRigDocument> for RigDocument {
    type Error = serde_json::Error;

    fn try_from(recorded: StoredRigDocument) -> Result<Self, Self::Error> {
        let mut analysis = recorded.analysis;
        // Earlier versions counted excluded presses from 0, under another name.
        if let Some(settings) = analysis.as_object_mut()
            && let Some(indices) = settings.remove("exclude_presses")
        {
            let indices: Vec<u32> = serde_json::from_value(indices)?;
            let presses: Vec<_> = indices.into_iter().map(PressId::from_index).collect();
            let name = "exclude_press_numbers".to_owned();
            settings.insert(name, serde_json::to_value(presses)?);
        }
        if let Some(latency) = analysis.get_mut("latency") {
            name_thresholds(latency);
            if let Some(reduced) = latency.get_mut("reduced") {
                name_thresholds(reduced);
            }
        }
        Ok(Self {
            geometry: recorded.geometry,
            analysis: serde_json::from_value(analysis)?,
            rig: recorded.rig,
        })
    }
}

/// Earlier versions stored a grid of thresholds as its ends and its size: `threshold_range` and `thresholds`.
fn name_thresholds(study: &mut Value) {
    let Some(study) = study.as_object_mut() else {
        return;
    };
    let mut grid = Map::new();
    if let Some(ends) = study.remove("threshold_range") {
        grid.insert("from".to_owned(), ends[0].clone());
        grid.insert("to".to_owned(), ends[1].clone());
    }
    if let Some(count) = study.get("thresholds").filter(|v| v.is_number()) {
        grid.insert("count".to_owned(), count.clone());
    }
    if !grid.is_empty() {
        study.insert("thresholds".to_owned(), Value::Object(grid));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn older_recordings_are_read() {
        let settings = AnalysisSettings {
            exclude_press_numbers: vec![PressId::from_index(4)],
            ..AnalysisSettings::default()
        };
        let rig = RigGeometry {
            outline: skinrig_model::SkinOutline::PAPER,
            nominal: skinrig_model::StereoGeometry::PAPER,
            trigger_channel: None,
            trigger_delay_us: [0; 2],
        };
        let document = RigDocument {
            geometry: rig,
            analysis: settings.clone(),
            rig: Value::Null,
        };
        let text = serde_json::to_string(&document).unwrap();
        let today = "\"exclude_press_numbers\":[5]";
        assert!(text.contains(today), "{text}");
        let old = text.replace(today, "\"exclude_presses\":[4]");
        let grids = [
            (
                r#""thresholds":{"from":1.0,"to":20.0,"count":20}"#,
                r#""threshold_range":[1.0,20.0],"thresholds":20"#,
            ),
            (
                r#""thresholds":{"from":3.0,"to":8.0,"count":6}"#,
                r#""threshold_range":[3.0,8.0],"thresholds":6"#,
            ),
        ];
        let older = grids.iter().fold(old.clone(), |text, (today, before)| {
            assert!(text.contains(today), "{text}");
            text.replace(today, before)
        });
        let half = older.replace(r#","thresholds":6"#, "");
        assert_ne!(half, older);
        for text in [text, old, older, half] {
            let read: RigDocument = serde_json::from_str(&text).unwrap();
            assert_eq!(read.analysis, settings);
        }
    }
}
