//! The lines that skinrig and a guest exchange: one JSON object per line.

use serde::{Deserialize, Serialize};
use skinrig_analysis::locator::CameraFeatures;
use skinrig_analysis::result::Region;
use skinrig_model::{CdEvent, Polarity, SkinOutline};

use super::error::GuestError;
use crate::challenge::estimates::Position;

/// Version of the exchange.
pub(super) const PROTOCOL: u32 = 1;

/// A line to the guest.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(super) enum Message<'a> {
    /// The first line.
    Begin {
        protocol: u32,
        outline: Option<&'a SkinOutline>,
        /// Number of `learn` lines, and of `locate` lines.
        calibrating: usize,
        scored: usize,
    },
    /// A calibration press with its position.
    Learn {
        press: u32,
        location: u32,
        x_mm: f64,
        y_mm: f64,
        cameras: [CameraLine; 2],
    },
    /// All calibration presses were sent: the guest learns, and introduces itself.
    Fit,
    /// A press without its position: the guest answers with a position.
    Locate {
        press: u32,
        cameras: [CameraLine; 2],
    },
}

/// Features of a press in one camera.
#[derive(Debug, Serialize)]
pub(super) struct CameraLine {
    column_px: Option<f64>,
    spread_px: Option<[f64; 2]>,
    cluster_events: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    events: Option<EventColumns>,
}

/// Events about a press as columns of equal length; times count from the contact.
#[derive(Debug, Serialize)]
struct EventColumns {
    t_us: Vec<i64>,
    x_px: Vec<u16>,
    y_px: Vec<u16>,
    on: Vec<u8>,
}

impl CameraLine {
    /// `events`: recorded time of the contact, µs, and the events.
    pub(super) fn new(features: &CameraFeatures, events: Option<(f64, Vec<CdEvent>)>) -> Self {
        let events = events.map(|(contact_us, events)| EventColumns {
            t_us: events
                .iter()
                .map(|e| (e.t_us as f64 - contact_us).round() as i64)
                .collect(),
            x_px: events.iter().map(|e| e.x).collect(),
            y_px: events.iter().map(|e| e.y).collect(),
            on: events
                .iter()
                .map(|e| u8::from(e.polarity == Polarity::On))
                .collect(),
        });
        Self {
            column_px: features.column,
            spread_px: features.spread,
            cluster_events: features.cluster_events,
            events,
        }
    }
}

/// The guest's answer to `fit`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Introduction {
    pub name: String,
    pub version: String,
}

/// The guest's answer to `locate`; without a position: not located.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    press: u32,
    x_mm: Option<f64>,
    y_mm: Option<f64>,
    region: Option<AnswerRegion>,
}

/// The 95 % region: semi-axes, and the angle of the longer one counter-clockwise from x.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerRegion {
    major_mm: f64,
    minor_mm: f64,
    angle_deg: f64,
}

/// Reads an answer to `fit`.
pub(super) fn introduction(line: &str) -> Result<Introduction, GuestError> {
    let refused = |why: String| GuestError::Unexpected {
        to: "`fit`".to_owned(),
        expected: r#"{"name": NAME, "version": VERSION}"#,
        found: format!("{why}: {}", shown(line)),
    };
    let found: Introduction = serde_json::from_str(line).map_err(|e| refused(e.to_string()))?;
    // Both are printed.
    let is_plain = |text: &str| !text.trim().is_empty() && !text.chars().any(char::is_control);
    if !is_plain(&found.name) || !is_plain(&found.version) {
        return Err(refused("an empty text or control characters".to_owned()));
    }
    Ok(found)
}

/// Reads an answer to `locate` for `press`; `None`: not located.
pub(super) fn position(line: &str, press: u32) -> Result<Option<Position>, GuestError> {
    let refused = |found: String| GuestError::Unexpected {
        to: format!("`locate` of press {press}"),
        expected: r#"{"press": NUMBER, "x_mm": X, "y_mm": Y}, or {"press": NUMBER} if it is not located"#,
        found,
    };
    let answer: Answer =
        serde_json::from_str(line).map_err(|e| refused(format!("{e}: {}", shown(line))))?;
    if answer.press != press {
        return Err(refused(format!("press {}", answer.press)));
    }
    let at = match (answer.x_mm, answer.y_mm, &answer.region) {
        (None, None, None) => return Ok(None),
        (Some(x), Some(y), _) => [x, y],
        _ => return Err(refused(format!("only a part of them: {}", shown(line)))),
    };
    let region = answer.region.map(|r| Region {
        semi_axes_mm: [r.major_mm, r.minor_mm],
        angle_deg: r.angle_deg,
    });
    if region.is_some_and(|r| r.semi_axes_mm.iter().any(|a| *a <= 0.0)) {
        return Err(refused(format!(
            "a semi-axis that is not above 0 mm: {}",
            shown(line)
        )));
    }
    if region.is_some_and(|r| r.semi_axes_mm[0] < r.semi_axes_mm[1]) {
        return Err(refused(format!(
            "a `minor_mm` above `major_mm`, whose angle is stated: {}",
            shown(line)
        )));
    }
    Ok(Some(Position { at, region }))
}

/// The beginning of a line, without control characters.
fn shown(line: &str) -> String {
    const MOST: usize = 120;
    let line = line.replace(char::is_control, " ");
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("`{}…`", &line[..end]),
        None => format!("`{line}`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_read_strictly() {
        let read = |line: &str| position(line, 3);
        assert_eq!(read(r#"{"press": 3}"#).unwrap(), None);
        let plain = read(r#"{"press": 3, "x_mm": 1, "y_mm": -2.5}"#);
        assert_eq!(plain.unwrap().unwrap().at, [1.0, -2.5]);
        let region =
            r#"{"press":3,"x_mm":1,"y_mm":2,"region":{"major_mm":2,"minor_mm":1,"angle_deg":30}}"#;
        let region = read(region).unwrap().unwrap().region.unwrap();
        assert_eq!((region.semi_axes_mm, region.angle_deg), ([2.0, 1.0], 30.0));
        for (line, part) in [
            (r#"{"press": 4, "x_mm": 1, "y_mm": 2}"#, "press 4"),
            (r#"{"press": 3, "x_mm": 1}"#, "only a part"),
            (r#"{"press": 3, "x_mm": NaN, "y_mm": 2}"#, "expected value"),
            (r#"{"press": 3, "x_mm": 1e999, "y_mm": 2}"#, "out of range"),
            (r#"{"press": 3, "x": 1, "y_mm": 2}"#, "unknown field `x`"),
            ("loading the model", "`loading the model`"),
            (
                r#"{"press":3,"x_mm":1,"y_mm":2,"region":{"major_mm":0,"minor_mm":1,"angle_deg":0}}"#,
                "above 0 mm",
            ),
            (
                r#"{"press":3,"x_mm":1,"y_mm":2,"region":{"major_mm":1,"minor_mm":2,"angle_deg":30}}"#,
                "`minor_mm` above `major_mm`",
            ),
        ] {
            let text = read(line).unwrap_err().to_string();
            assert!(text.contains(part) && text.contains("press 3"), "{text}");
        }
        let text = introduction("{}").unwrap_err().to_string();
        assert!(text.contains("`fit`") && text.contains("name"), "{text}");
        introduction(r#"{"name": "a b", "version": "1"}"#).unwrap();
        for line in [
            r#"{"name": "a\u001b[31m", "version": "1"}"#,
            r#"{"name": "a", "version": "1\n"}"#,
            r#"{"name": " ", "version": "1"}"#,
            "\u{1b}[31m",
        ] {
            let text = introduction(line).unwrap_err().to_string();
            assert!(text.contains("`fit`"), "{text}");
            assert!(!text.contains('\u{1b}'), "{text:?}");
        }
    }
}
