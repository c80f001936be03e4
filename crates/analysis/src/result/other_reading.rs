//! Owns the ways in which a session can differ from its documents.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_model::CameraId;

/// A table of positions written in another frame or unit than the skin frame in mm, as in "the positions with ...".
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FrameChange {
    /// Reflected or rotated.
    #[error("{turn} about {about}")]
    Turned {
        /// How.
        turn: Turn,
        /// Fixed point.
        about: Origin,
    },
    /// In another unit.
    #[error("all multiplied by {factor:.3}")]
    Scaled {
        /// Factor from the table to the skin frame.
        factor: f64,
    },
    /// Stretched.
    #[error("x multiplied by {:.2} and y by {:.2} about {about}", .factors[0], .factors[1])]
    Stretched {
        /// Factors from the table to the skin frame, along x and y.
        factors: [f64; 2],
        /// Fixed point.
        #[serde(default = "Origin::zero")]
        about: Origin,
    },
    /// Relative to another point of the skin.
    #[error("the skin's {origin} {}", if *.is_added { "added" } else { "subtracted" })]
    OtherOrigin {
        /// The point.
        origin: Corner,
        /// True if its coordinates are to be added, false if subtracted.
        is_added: bool,
    },
    /// Displaced.
    #[error("({:+.1}, {:+.1}) mm added", .by_mm[0], .by_mm[1])]
    Displaced {
        /// Offset to add, x and y, mm.
        by_mm: [f64; 2],
    },
}

/// A reflection or rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Turn {
    /// x mirrored.
    XMirrored,
    /// y mirrored.
    YMirrored,
    /// Both mirrored: turned by 180 degrees.
    BothMirrored,
    /// Exchanged.
    Exchanged,
    /// Exchanged and both mirrored.
    ExchangedMirrored,
    /// Turned by 90 degrees, counter-clockwise.
    Quarter,
    /// Turned by -90 degrees.
    QuarterBack,
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::XMirrored => "x mirrored",
            Self::YMirrored => "y mirrored",
            Self::BothMirrored => "x and y mirrored",
            Self::Exchanged => "x and y exchanged",
            Self::ExchangedMirrored => "x and y exchanged and both mirrored",
            Self::Quarter => "x and y turned by 90 degrees",
            Self::QuarterBack => "x and y turned by -90 degrees",
        })
    }
}

/// Fixed point of a change of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Origin of the skin frame.
    Zero,
    /// Centre of the skin.
    Centre,
    /// Mean of the table's positions.
    Table,
}

impl Origin {
    /// Fixed point of a stretch whose results do not name one.
    const fn zero() -> Self {
        Self::Zero
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Zero => "0",
            Self::Centre => "the skin's centre",
            Self::Table => "the middle of the table",
        })
    }
}

/// A point of the skin that tables take as their origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Corner {
    /// Centre.
    Centre,
    /// Lower left corner.
    LowerLeft,
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Centre => "centre",
            Self::LowerLeft => "lower left corner",
        })
    }
}

/// A plan that matches the measured positions better, as in "0.1 mm ...".
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum OtherPlan {
    /// The planned positions are those of a table in another frame.
    #[error("with {frame}")]
    Frame {
        /// The other frame.
        frame: FrameChange,
    },
    /// The planned positions are those of other rows.
    #[error("of the planned ones {rows:+} rows on")]
    Shifted {
        /// Rows later.
        rows: i32,
    },
}

/// A reading of a session that may explain the cameras better than the session as recorded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum OtherReading {
    /// The session as recorded.
    #[error("as recorded")]
    AsRecorded,
    /// The streams belong to the other cameras.
    #[error("cameras exchanged")]
    CamerasExchanged,
    /// Both streams come from one camera.
    #[error("both streams of {camera}")]
    BothStreams {
        /// The camera.
        camera: CameraId,
    },
    /// The image of one camera is mirrored.
    #[error("the picture of {camera} mirrored")]
    PictureMirrored {
        /// The camera.
        camera: CameraId,
    },
    /// The images of both cameras are mirrored.
    #[error("the pictures of both cameras mirrored")]
    PicturesMirrored,
    /// The positions are in another frame.
    #[error("the positions with {frame}")]
    Frame {
        /// The other frame.
        frame: FrameChange,
    },
    /// The positions are displaced by as much as the cameras seem to be.
    #[error("the positions with ({:+.0}, {:+.0}) mm added", .by_mm[0], .by_mm[1])]
    Displaced {
        /// Offset to add, x and y, mm.
        by_mm: [f64; 2],
    },
    /// The tip was at the planned positions.
    #[error("the planned positions instead of the measured ones")]
    AsPlanned,
    /// The presses are those of other rows of the list.
    #[error("the press list shifted by {rows:+} rows")]
    ListShifted {
        /// Rows later.
        rows: i32,
    },
    /// Each stream is late by presses of its own.
    #[error("the streams shifted by {:+} and {:+} presses (cameras 1 and 2)", .presses[0], .presses[1])]
    StreamsShifted {
        /// Presses of each stream.
        presses: [i32; 2],
    },
    /// The list is reversed.
    #[error("the press list reversed")]
    ListReversed,
    /// A raster for a meander, or the reverse.
    #[error("every second line of the press list reversed")]
    LinesReversed,
}
