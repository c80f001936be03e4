//! A part of a camera's picture that sends few events or none, for warnings.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};
use skinrig_model::{Polarity, PressId};

/// A part of a camera's picture that is quiet throughout, or during a part of the session only.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QuietPart {
    /// First and last column, px; `None`: all.
    pub columns: Option<(u16, u16)>,
    /// First and last row, px; `None`: all of the crop.
    pub rows: Option<(u16, u16)>,
    /// The polarity that is missing; `None`: both.
    pub polarity: Option<Polarity>,
    /// First and last press before which it is quiet; `None`: throughout, without a single event.
    pub presses: Option<(PressId, PressId)>,
    /// Share of pixels that fire before these presses in those that fire before others; 0 throughout.
    pub share: f64,
}

impl Display for QuietPart {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let polarity = match self.polarity {
            None => "",
            Some(Polarity::On) => "ON ",
            Some(Polarity::Off) => "OFF ",
        };
        write!(f, "{polarity}events of ")?;
        match (self.columns, self.rows) {
            (Some((first, last)), _) => write!(f, "columns {first} to {last}")?,
            (None, Some((first, last))) => write!(f, "rows {first} to {last}")?,
            (None, None) => f.write_str("the whole picture")?,
        }
        match self.presses {
            None if self.polarity.is_some() => {
                f.write_str(" are missing throughout: look at the biases, and at what converted the recording")
            }
            None => f.write_str(
                " are missing throughout, although those beside them are there: a mask, a region of interest or dead pixels hide a part of the \
                 skin, or events were lost",
            ),
            Some((first, last)) => write!(
                f,
                " fall to {:.0} % of their usual number between presses, from {first} to {last}: find out what changed there, such as light, \
                 lens, cable or bias, and record these presses again",
                100.0 * self.share
            ),
        }
    }
}
