//! Owns the published numbers that sessions are compared with, with their sources.
//!
//! "The paper" is Koolani et al., "An Event-Based Opto-Tactile Skin" (Frontiers); table and figure names are its own.
//! Numbers are quoted; wording is ours. Where published numbers contradict each other, both are listed and a `Footnote`
//! explains it.

use serde::Serialize;

pub use skinrig_model::published::PASS_RATE;
pub(crate) use skinrig_model::published::{
    DETECTED_RATE, FALSE_ALARMS_PER_S, REPEAT_STD_MM, RMSE_1024_MM, RMSE_MM, RMSE_X_MM, RMSE_Y_MM,
};

/// Area of the skin, area seen by both cameras, probed area, mm² (section 3.1).
pub(crate) const AREAS_MM2: [f64; 3] = [9328.0, 8763.0, 4620.0];
/// Effective taxels over the sensor and over the probed area, without reduction (table "MSOWS").
pub(crate) const TAXELS: (f64, f64) = (105.0, 46.0);

/// A note below a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Footnote {
    /// Mark in the table.
    pub mark: &'static str,
    /// Text of the note.
    pub text: &'static str,
}

/// Contradictions between published numbers, and their likely reason.
pub(crate) const FOOTNOTES: [Footnote; 7] = [
    Footnote {
        mark: "a",
        text: "The published RMSE along x and y (4.17, 3.28 mm) add up to 5.31 mm in quadrature, not to 4.66 mm.",
    },
    Footnote {
        mark: "b",
        text: "3.75 % of the skin's diagonal (141.4 mm) is 5.30 mm; 4.66 mm is 3.30 %. The published contact map \
               error has the same value, 3.75 %; its parameters are not published.",
    },
    Footnote {
        mark: "c",
        text: "105 taxels over the skin, and 46 over 64 x 64 mm (the span of the grid, not the 4620 mm² named), need a \
               radius of 5.31 mm; 4.66 mm gives 136.7 over the skin and 67.7 over 4620 mm².",
    },
    Footnote {
        mark: "d",
        text: "75 kB/s divided by 1024 is 0.073 kB/s, not about 1 kB/s.",
    },
    Footnote {
        mark: "e",
        text: "The address of a 640 x 480 pixel and its polarity take 20 bits; the 21st is not explained.",
    },
    Footnote {
        mark: "f",
        text: "The pass threshold is the 95th percentile of the errors at factor 1, so the rate at factor 1 is about \
               95 % by construction, and less where presses have no estimate.",
    },
    Footnote {
        mark: "g",
        text: "Width of the 5-95 % interval of the onsets, not a delay after contact: the published recording has no \
               measured contact.",
    },
];

/// One row of the published comparison with the multitouch soft optical waveguide skin (table "MSOWS").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MsowsRow {
    /// The quantity.
    pub metric: Metric,
    /// Lo Preti et al. 2022, as given in the paper.
    pub msows: &'static str,
    /// The paper without reduction.
    pub paper: &'static str,
    /// The paper at 1024-fold reduction.
    pub paper_1024: &'static str,
    /// Marks of the footnotes.
    pub notes: &'static str,
}

/// A quantity of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Kind of sensor.
    Sensor,
    /// Number of view points.
    ViewPoints,
    /// Where the data are processed.
    Processing,
    /// Samples or events per press.
    Samples,
    /// Bits per sample or event.
    Bits,
    /// Length of a press.
    PressDuration,
    /// Data rate during a press.
    PressRate,
    /// Data rate while idle.
    IdleRate,
    /// Width of the 5-95 % interval of the detections.
    LatencyWidth,
    /// Median delay after the measured contact.
    LatencyFromContact,
    /// Global error.
    GlobalError,
    /// RMSE as a share of the diagonal.
    DiagonalError,
    /// Localisation RMSE.
    Rmse,
    /// Share of presses that pass.
    PassRate,
    /// Effective taxels over the sensor.
    TaxelsSkin,
    /// Effective taxels over the probed area.
    TaxelsProbed,
}

impl Metric {
    /// Name with unit.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::ViewPoints => "view points",
            Self::Processing => "processing",
            Self::Samples => "samples per press",
            Self::Bits => "bits per sample",
            Self::PressDuration => "press duration (s)",
            Self::PressRate => "data rate, press (kB/s)",
            Self::IdleRate => "data rate, idle (kB/s)",
            Self::LatencyWidth => "detection, width of 5-95 % (ms)",
            Self::LatencyFromContact => "detection, median after contact (ms)",
            Self::GlobalError => "contact map imbalance (%)",
            Self::DiagonalError => "RMSE, share of the diagonal (%)",
            Self::Rmse => "localisation RMSE (mm)",
            Self::PassRate => "pass rate (%)",
            Self::TaxelsSkin => "effective taxels, sensor",
            Self::TaxelsProbed => "effective taxels, probed area",
        }
    }
}

const fn row(
    metric: Metric,
    msows: &'static str,
    paper: &'static str,
    paper_1024: &'static str,
    notes: &'static str,
) -> MsowsRow {
    MsowsRow {
        metric,
        msows,
        paper,
        paper_1024,
        notes,
    }
}

/// Table "MSOWS" of the paper; `–` where it has no value. Pass rates are from its abstract and section 3.
pub(crate) const MSOWS: [MsowsRow; 16] = [
    row(
        Metric::Sensor,
        "24 emitters, 24 receivers",
        "2 event cameras",
        "2 event cameras",
        "",
    ),
    row(Metric::ViewPoints, "24", "2", "2", ""),
    row(
        Metric::Processing,
        "FPGA board",
        "on events",
        "on events",
        "",
    ),
    row(
        Metric::Samples,
        "168 per receiver",
        "event stream",
        "event stream",
        "",
    ),
    row(Metric::Bits, "12", "21", "21", "e"),
    row(Metric::PressDuration, "0.144", "0.55", "0.55", ""),
    row(Metric::PressRate, "~145", "~75", "~1", "d"),
    row(Metric::IdleRate, "~145", "~24", "~0.02", ""),
    row(Metric::LatencyWidth, "–", "31", "113", "g"),
    row(Metric::LatencyFromContact, "–", "–", "–", ""),
    row(Metric::GlobalError, "1.8", "3.75", "~6.4", "b"),
    row(Metric::DiagonalError, "–", "3.75", "–", "b"),
    row(Metric::Rmse, "–", "4.66", "9.33", "a"),
    row(Metric::PassRate, "–", "95", "85", "f"),
    row(Metric::TaxelsSkin, "–", "105", "34", "c"),
    row(Metric::TaxelsProbed, "–", "46", "15", "c"),
];

/// A touch-localising skin from the paper's table of tactile localisation technologies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Skin {
    /// Kind of skin.
    pub name: &'static str,
    /// Author and year of the source.
    pub source: &'static str,
    /// Kinds of touch that it locates.
    pub touches: &'static str,
    /// Material.
    pub material: &'static str,
    /// Accuracy or resolution.
    pub accuracy: &'static str,
    /// Method.
    pub method: &'static str,
}

/// The paper's table of tactile localisation technologies.
pub(crate) const SKINS: [Skin; 7] = [
    Skin {
        name: "impedance tomography sheet",
        source: "Chen et al. 2025",
        touches: "several, while bent",
        material: "conductive hydrogel, elastomer",
        accuracy: "5.4 mm error",
        method: "tomography, learned",
    },
    Skin {
        name: "hydrogel tomography skin",
        source: "Hardman et al. 2023",
        touches: "several",
        material: "self-healing hydrogel",
        accuracy: "12.1 mm",
        method: "tomography, learned",
    },
    Skin {
        name: "stretchable capacitive array",
        source: "Sarwar et al. 2017",
        touches: "several, while stretched or bent",
        material: "elastomer, stretchable electrodes",
        accuracy: "10 mm resolution",
        method: "capacitive grid",
    },
    Skin {
        name: "magnetic skin",
        source: "Hu et al. 2024",
        touches: "several",
        material: "magnetised elastomer, Hall sensors",
        accuracy: "1.2 mm error over 48 400 mm²",
        method: "convolutional network",
    },
    Skin {
        name: "graphene Hall array",
        source: "Li et al. 2025",
        touches: "single, 6 x 6 virtual",
        material: "graphene Hall elements, magnetised layer",
        accuracy: "1.3 mm mean error",
        method: "periodic magnetisation",
    },
    Skin {
        name: "flexible tomography skin",
        source: "Chen et al. 2025b",
        touches: "several, while bent",
        material: "magnetic hydrogel, silicone",
        accuracy: "4.8 ± 2.8 mm error",
        method: "convolutional network",
    },
    Skin {
        name: "SonicBoom",
        source: "Lee et al. 2025",
        touches: "single",
        material: "microphones",
        accuracy: "4.3 to 22.2 mm error",
        method: "acoustic triangulation, learned",
    },
];

/// A tactile sensor of the paper's overview table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sensor {
    /// Kind of sensor.
    pub name: &'static str,
    /// Author and year of the source.
    pub source: &'static str,
    /// Sensing element.
    pub hardware: &'static str,
    /// Measured quantity.
    pub measures: &'static str,
    /// Method.
    pub method: &'static str,
    /// Performance.
    pub result: &'static str,
}

const fn sensor(
    name: &'static str,
    source: &'static str,
    hardware: &'static str,
    measures: &'static str,
    method: &'static str,
    result: &'static str,
) -> Sensor {
    Sensor {
        name,
        source,
        hardware,
        measures,
        method,
        result,
    }
}

/// The paper's overview table of optical tactile sensors.
pub(crate) const SENSORS: [Sensor; 10] = [
    sensor(
        "Force-EvT",
        "Guo et al. 2024",
        "event camera",
        "force",
        "transformer",
        "RMSE 0.13 N, R² 0.3, error 1.5 %",
    ),
    sensor(
        "vision-based",
        "Naeini et al. 2020",
        "event camera",
        "contact force",
        "time-delay network",
        "RMSE 0.16 to 0.17 N",
    ),
    sensor(
        "bio-inspired",
        "Faris et al. 2024",
        "event camera",
        "slip, pressure",
        "spike processing",
        "5 %, response 2 ms",
    ),
    sensor(
        "Evetac",
        "Funk et al. 2024",
        "event camera",
        "vibration, shear",
        "learned",
        "up to 48 Hz",
    ),
    sensor(
        "E-BTS",
        "Mukashev et al. 2025",
        "event camera",
        "force",
        "learned",
        "RMSE ~1 N, latency < 5 ms",
    ),
    sensor(
        "NeuroTac",
        "Ward-Cherrier et al. 2020",
        "event camera",
        "texture, slip",
        "spiking network",
        "~95 % on Braille",
    ),
    sensor(
        "multi-camera",
        "Trueeb et al. 2020",
        "4 RGB cameras",
        "force distribution",
        "convolutional network",
        "RMSE 0.057 N (z), 40 Hz",
    ),
    sensor(
        "DIGIT",
        "Lambeta et al. 2020",
        "RGB camera",
        "shape, force",
        "autoencoder",
        "640 x 480 px at 60 Hz",
    ),
    sensor(
        "retrographic",
        "Johnson and Adelson 2009",
        "RGB camera",
        "texture, shape",
        "photometric stereo",
        "2.5D capture",
    ),
    sensor(
        "MSOWS",
        "Lo Preti et al. 2022",
        "LEDs, photoreceivers",
        "location",
        "sequential scan",
        "5 mm resolution, error 2.6 %",
    ),
];
