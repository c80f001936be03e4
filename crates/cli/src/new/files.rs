//! Starter files embedded in the program, and the kinds of protocols that `skinrig new` writes.

use std::borrow::Cow;

use clap::ValueEnum;

/// A starter file.
#[derive(Debug, Clone, Copy)]
pub(super) struct StarterFile {
    /// Path in the lab folder.
    pub(super) path: &'static str,
    content: Content,
}

#[derive(Debug, Clone, Copy)]
enum Content {
    /// Written by hand; belongs to the user once written.
    Text(&'static str),
    /// Generated from this version's declarations of settings.
    Generated(fn() -> String),
}

impl StarterFile {
    const fn text(path: &'static str, text: &'static str) -> Self {
        Self {
            path,
            content: Content::Text(text),
        }
    }

    const fn generated(path: &'static str, make: fn() -> String) -> Self {
        Self {
            path,
            content: Content::Generated(make),
        }
    }

    /// The file's name without folders.
    pub(super) fn name(self) -> &'static str {
        self.path.rsplit('/').next().unwrap_or(self.path)
    }

    pub(super) const fn is_generated(self) -> bool {
        matches!(self.content, Content::Generated(_))
    }

    pub(super) fn content(self) -> Cow<'static, str> {
        match self.content {
            Content::Text(text) => Cow::Borrowed(text),
            Content::Generated(make) => Cow::Owned(make()),
        }
    }
}

/// A file of the repository with the same path in the lab folder.
macro_rules! same {
    ($path:literal) => {
        StarterFile::text($path, include_str!(concat!("../../../../", $path)))
    };
}

const DEMO: StarterFile = same!("protocols/demo.yaml");
const CAMPAIGN: StarterFile = same!("protocols/paper-meander.yaml");
const COMPARISON: StarterFile = same!("protocols/comparison.yaml");
const DEPTH_SWEEP: StarterFile = same!("protocols/depth-sweep.yaml");
const QUICK_CHECK: StarterFile = same!("protocols/quick-check.yaml");
const RINGS: StarterFile = same!("protocols/circles.yaml");
const OWN_OUTLINE: StarterFile = same!("protocols/own-outline.yaml");
const OWN_CAMERAS: StarterFile = same!("protocols/own-cameras.yaml");
const PAPER_SCENE: StarterFile = same!("protocols/paper.yaml");
const OTHER_SKIN: StarterFile = same!("protocols/other-skin.yaml");

/// Schema of protocols, for editors.
pub(super) const PROTOCOL_SCHEMA: StarterFile = StarterFile::generated(
    "protocols/skinrig.schema.json",
    skinrig_protocol::schema_json,
);

/// Files that `skinrig init` writes, at the paths of the repository so that documented commands work in the lab folder.
pub(super) const LAB: &[StarterFile] = &[
    DEMO,
    CAMPAIGN,
    COMPARISON,
    DEPTH_SWEEP,
    QUICK_CHECK,
    RINGS,
    OWN_OUTLINE,
    OWN_CAMERAS,
    OTHER_SKIN,
    PAPER_SCENE,
    same!("protocols/comparison.limits.yaml"),
    PROTOCOL_SCHEMA,
    StarterFile::generated(
        "protocols/skinrig-limits.schema.json",
        skinrig_protocol::limits_schema_json,
    ),
    StarterFile::generated(
        "protocols/skinrig-selection.schema.json",
        skinrig_protocol::selection_schema_json,
    ),
    same!("hil/nightly.yaml"),
    same!("hil/first-contact.yaml"),
    same!("hil/golden.yaml"),
    same!("hil/reaction.yaml"),
    StarterFile::generated(
        "hil/skinrig-suite.schema.json",
        skinrig_protocol::suite_schema_json,
    ),
    StarterFile::text(
        "hil/rigs/bench.yaml",
        include_str!("../../../../hil/rigs/bench.example.yaml"),
    ),
    StarterFile::generated(
        "hil/rigs/skinrig-rig.schema.json",
        skinrig_protocol::rig_schema_json,
    ),
];

/// Kinds of starter protocols.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProtocolKind {
    /// The published experiment: 250 locations, ten repetitions
    Campaign,
    /// The same presses on every skin, for a comparison
    Comparison,
    /// Five depths at scattered locations, in random order
    DepthSweep,
    /// Is the rig alive? Five presses
    QuickCheck,
    /// Two rings of presses
    Rings,
    /// A skin of your own shape, with an area to keep out of
    OwnOutline,
    /// Simulated cameras at positions of your own
    OwnCameras,
    /// A simulated skin that differs from the published one
    OtherSkin,
    /// A simulated skin that resembles the published one
    Paper,
    /// The demonstration: a 9 x 9 grid, three times
    Demo,
}

impl ProtocolKind {
    /// Its name on the command line.
    pub(super) fn name(self) -> String {
        self.to_possible_value()
            .map(|value| value.get_name().to_owned())
            .unwrap_or_default()
    }

    pub(super) const fn file(self) -> StarterFile {
        match self {
            Self::Campaign => CAMPAIGN,
            Self::Comparison => COMPARISON,
            Self::DepthSweep => DEPTH_SWEEP,
            Self::QuickCheck => QUICK_CHECK,
            Self::Rings => RINGS,
            Self::OwnOutline => OWN_OUTLINE,
            Self::OwnCameras => OWN_CAMERAS,
            Self::OtherSkin => OTHER_SKIN,
            Self::Paper => PAPER_SCENE,
            Self::Demo => DEMO,
        }
    }
}
