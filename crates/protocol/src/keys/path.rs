//! Keys of the path, the repetitions and the order.

use skinrig_model::{HostDuration, Point2};
use skinrig_settings::{Choice, Collector, Field, Setting, Settings, Shape};

use super::ranges::{LENGTH_MM, MOST_POINTS, POSITIVE_LENGTH_MM, SPAN_S};

/// The locations that are pressed: exactly one kind.
#[derive(Settings)]
#[settings(name = "path", no_default)]
#[settings(exactly_one("meander", "circles", "points", "csv", "random"))]
pub(crate) struct Path {
    /// A grid, line by line, every second line backwards.
    pub meander: Option<Meander>,
    /// Rings of presses, counter-clockwise.
    pub circles: Option<Circles>,
    /// Explicit locations.
    #[setting(items = 1..=MOST_POINTS as usize)]
    pub points: Option<Vec<Point2>>,
    /// Locations from a CSV file with the columns `x` and `y`.
    pub csv: Option<Csv>,
    /// Random locations inside the outline, with a least distance between any two.
    pub random: Option<Random>,
}

/// A grid, line by line, every second line backwards.
#[derive(Settings)]
pub(crate) struct Meander {
    /// The first location: the grid's corner with the smallest x and y.
    pub origin: Point2,
    /// Distance of neighbours along x and along y.
    #[setting(range = POSITIVE_LENGTH_MM)]
    pub pitch_mm: f64,
    /// Locations along x.
    #[setting(min = 1, max = 10_000)]
    pub columns: u32,
    /// Locations along y.
    #[setting(min = 1, max = 10_000)]
    pub rows: u32,
    /// The axis along which a line runs.
    pub line_direction: LineDirection,
    /// How many locations are used, from the first; all when absent.
    #[setting(min = 1, max = MOST_POINTS)]
    pub count: Option<u32>,
}

/// The axis along which a line of a grid runs.
#[derive(Clone, Copy, PartialEq, Choice)]
pub(crate) enum LineDirection {
    /// Lines run along x; the next line is one pitch further in y.
    X,
    /// Lines run along y; the next line is one pitch further in x.
    Y,
}

/// Rings of presses about one centre, each counter-clockwise, in the order given.
#[derive(Settings)]
pub(crate) struct Circles {
    /// Centre of all rings.
    pub centre: Point2,
    /// The rings.
    #[setting(items = 1..=1000)]
    pub rings: Vec<Ring>,
    /// Direction of each ring's first press from the centre, counter-clockwise from the x axis.
    #[setting(default = "0 deg", min = -360.0, max = 360.0)]
    pub start_angle_deg: f64,
}

/// One ring of presses at equal angles.
#[derive(Settings)]
pub(crate) struct Ring {
    /// Its radius.
    #[setting(range = POSITIVE_LENGTH_MM)]
    pub radius_mm: f64,
    /// How many presses.
    #[setting(min = 1, max = 10_000)]
    pub presses: u32,
}

/// Locations from a CSV file with a header; the columns `x` and `y` are used.
#[derive(Settings)]
pub(crate) struct Csv {
    /// The file, relative to the protocol's own folder.
    pub file: String,
    /// Unit of the columns `x` and `y`.
    pub unit: LengthUnit,
    /// Whether blank rows are skipped; otherwise they are errors.
    #[setting(default = "false")]
    pub skip_blank_rows: bool,
    /// How many locations are used, from the first; all when absent.
    #[setting(min = 1, max = MOST_POINTS)]
    pub count: Option<u32>,
}

/// Unit of the columns of a CSV file.
#[derive(Clone, Copy, Choice)]
pub(crate) enum LengthUnit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
}

impl LengthUnit {
    /// One unit in mm.
    pub(crate) const fn in_mm(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1000.0,
        }
    }
}

/// Random locations: uniform inside the outline, drawn until each is far enough from all others.
#[derive(Settings)]
pub(crate) struct Random {
    /// How many locations.
    #[setting(min = 1, max = 10_000)]
    pub count: u32,
    /// Least distance of any two locations.
    #[setting(range = LENGTH_MM)]
    pub spacing_mm: f64,
    /// Least distance from the outline, beyond `frame.margin`.
    #[setting(default = "0 mm", range = LENGTH_MM)]
    pub margin_mm: f64,
    /// Seed of the locations; the run's seed when absent.
    pub seed: Option<u64>,
}

/// How often the whole path is run.
#[derive(Settings)]
pub(crate) struct Repetitions {
    /// How often the whole path is run.
    #[setting(default = "1", min = 1, max = 10_000)]
    pub count: u32,
    /// What happens between two repetitions.
    #[setting(default)]
    pub between: RepetitionPause,
}

/// What happens between two repetitions.
#[derive(Settings)]
#[settings(name = "between")]
pub(crate) struct RepetitionPause {
    /// Go back above the first location before the pause; otherwise after it.
    #[setting(default = "true")]
    pub return_to_start: bool,
    /// How long to wait.
    #[setting(default = "0 s", range = SPAN_S)]
    pub pause: HostDuration,
}

/// Order of the presses of a repetition.
pub(crate) enum Order {
    /// The order of the path.
    Listed,
    /// A random order.
    Shuffled(ShuffleKeys),
}

/// Orders with a name.
#[derive(Clone, Copy, Choice)]
enum OrderName {
    /// The order of the path.
    Listed,
}

/// A shuffled order.
#[derive(Settings)]
#[settings(name = "order")]
struct OrderKeys {
    /// Each repetition runs its presses (all locations at all depths) in its own random order.
    shuffled: ShuffleKeys,
}

/// A random order.
#[derive(Settings)]
#[settings(name = "shuffled")]
pub(crate) struct ShuffleKeys {
    /// Seed of the order; the run's seed when absent.
    pub seed: Option<u64>,
}

impl Setting for Order {
    const SHAPE: Shape = Shape::WordOr(OrderName::WORDS, OrderKeys::TABLE);

    fn from_field(field: &Field, out: &mut Collector) -> Option<Self> {
        match field.as_word().and_then(OrderName::from_word) {
            Some(OrderName::Listed) => Some(Self::Listed),
            None => OrderKeys::from_mapping(field, out).map(|keys| Self::Shuffled(keys.shuffled)),
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Listed => OrderName::Listed.text(),
            Self::Shuffled(shuffled) => format!("{{shuffled: {}}}", shuffled.text()),
        }
    }
}
