//! What a session says of its rig, for whoever analyses it.

use serde::{Deserialize, Serialize};
use skinrig_model::{AnalysisSettings, PressId, RigGeometry};

/// What `RunHeader::rig_json` holds.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "RecordedRig")]
pub struct RigDocument {
    /// What an analysis needs to know of the rig.
    pub geometry: RigGeometry,
    /// The analysis settings of the protocol.
    pub analysis: AnalysisSettings,
    /// Everything worth keeping about the rig.
    pub rig: serde_json::Value,
}

/// [`RigDocument`] as any version wrote it.
#[derive(Deserialize)]
struct RecordedRig {
    geometry: RigGeometry,
    analysis: serde_json::Value,
    rig: serde_json::Value,
}

impl TryFrom<RecordedRig> for RigDocument {
    type Error = serde_json::Error;

    fn try_from(recorded: RecordedRig) -> Result<Self, Self::Error> {
        let mut analysis = recorded.analysis;
        // Earlier versions counted presses that are left out from 0, under another name.
        if let Some(settings) = analysis.as_object_mut()
            && let Some(indices) = settings.remove("exclude_presses")
        {
            let indices: Vec<u32> = serde_json::from_value(indices)?;
            let presses: Vec<_> = indices.into_iter().map(PressId::from_index).collect();
            let name = "exclude_press_numbers".to_owned();
            settings.insert(name, serde_json::to_value(presses)?);
        }
        Ok(Self {
            geometry: recorded.geometry,
            analysis: serde_json::from_value(analysis)?,
            rig: recorded.rig,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_recording_names_the_presses_that_it_leaves_out_by_index() {
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
            rig: serde_json::Value::Null,
        };
        let text = serde_json::to_string(&document).unwrap();
        let today = "\"exclude_press_numbers\":[5]";
        assert!(text.contains(today), "{text}");
        let old = text.replace(today, "\"exclude_presses\":[4]");
        for text in [text, old] {
            let read: RigDocument = serde_json::from_str(&text).unwrap();
            assert_eq!(read.analysis, settings);
        }
    }
}
