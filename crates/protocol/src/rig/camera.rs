//! The cameras of a bench.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_model::{CameraModel, Point2};
use skinrig_settings::{Choice, Collector, Field, Setting, Settings, Shape};

use super::variables;
use crate::keys::{NominalCamera, Roi};

/// The EVK1's trigger inputs: main, loop-back of its own output, auxiliary.
const EVK1_INPUTS: [u8; 3] = [0, 6, AUXILIARY];
/// The trigger input that the EVK1's sync line uses when it is a slave.
const AUXILIARY: u8 = 7;

/// One event camera. Missing keys keep the device's default; a protocol may override biases and region.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(
    name = "rig_camera",
    check(Self::has_input, "model", "sync", "trigger_channel"),
    check(Self::has_time_base, "model"),
    check(Self::shares_time, "model", "sync")
)]
pub struct CameraSetup {
    /// Which camera.
    #[setting(default = "evk1")]
    pub model: CameraKind,
    /// Serial number as shown by `skinrig devices`; for an EVK1 without one its port, such as `usb-BUS-PORT.PORT`.
    #[setting(example = "\"00000815\"")]
    pub serial: String,
    /// Expected FPGA version; any other fails the preflight.
    pub fpga: Option<String>,
    /// Bias values by name, in the device's own unit (EVK1: mV). They override those of `bias_file`.
    #[setting(default)]
    pub biases: BTreeMap<String, i64>,
    /// A `.bias` file, relative to this one; `${NAME}` stands for an environment variable.
    #[setting(read = variables::path)]
    pub bias_file: Option<PathBuf>,
    /// Pixels that stay on (x, y, width, height); all when absent.
    #[setting(shape = Roi::SHAPE, read = Roi::read)]
    pub roi: Option<[u16; 4]>,
    /// The sensor's activity gate: suppresses all events while the total rate is below this. Absent: off.
    #[setting(min = 10_000, max = 10_000_000)]
    pub noise_filter_ev_s: Option<u32>,
    /// EVK1: a longer step of the camera's time base counts as lost data and makes the press invalid. Absent: steps are only noted
    /// at the end, because the vendor does not publish how often a camera sends its time base.
    #[setting(min = 64, max = 10e6)]
    pub max_time_high_gap_us: Option<u64>,
    /// EVK1: how a step of the camera's overflow counter is handled. The vendor does not publish what it counts. Choose `note` for a
    /// camera that counts without losses, to keep valid presses from becoming invalid.
    #[setting(key = "overflow_counter", default = "loss", through = OverflowRule)]
    pub overflow_is_loss: bool,
    /// Addresses of registers, such as `"0x0204"`, that your camera reads back differently; the vendor does not publish which do.
    #[setting(default = "[]", shape = ADDRESSES, read = addresses)]
    pub read_back_exceptions: Vec<u32>,
    /// EVK1: further valid status bytes of register reads, such as `"0x00"`, besides 0x40. `--tolerant` lists those that your camera
    /// sends.
    #[setting(default = "[]", shape = ADDRESSES, read = bytes)]
    pub read_status: Vec<u8>,
    /// EVK1: how a bus reset that fails before a run is handled.
    #[setting(key = "failed_reset", default = "refused", through = ResetRule)]
    pub failed_reset_is_accepted: bool,
    /// EVK1: how a failed transfer of the event stream is handled. A stall and a lost device end the stream in any case.
    #[setting(key = "failed_transfers", default = "end", through = TransferRule)]
    pub failed_transfer_is_loss: bool,
    /// Accepts and reports every deviation from the documented behaviour. Set by `--tolerant`, not by a key.
    #[setting(skip)]
    pub tolerant: bool,
    /// Time base that the camera follows.
    #[setting(default = "standalone")]
    pub sync: SyncRole,
    /// The trigger input that the box is wired to (EVK1: 0 main, 7 auxiliary, 6 loop-back of its own output).
    #[setting(default = "0", max = 31)]
    pub trigger_channel: u8,
    /// Delay from an edge at the trigger input to its time stamp, in whole microseconds. Not published: measure it on your bench.
    /// Analyses subtract it from the camera's edges; the session keeps the raw times.
    #[setting(default = "0 us", max = 1000)]
    pub trigger_delay_us: u16,
    /// Nominal position of the camera, drawn or measured: the start of the calibration.
    #[setting(shape = NominalCamera::SHAPE, read = geometry, example = GEOMETRY)]
    pub geometry: CameraModel,
}

const GEOMETRY: &str =
    "{position: [45 mm, -38 mm], aim: [10 mm, 2 mm], half_field_of_view: 60 deg}";

/// A camera that skinrig drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum CameraKind {
    /// Prophesee EVK1, VGA, Gen3.1.
    Evk1,
    /// Prophesee EVK4, in builds with `--features evk4`; recorded in full, analysed within 640 x 480 pixels.
    Evk4,
    /// Prophesee EVK3 HD, as `evk4`; no trigger input, so only without a trigger box and standalone.
    Evk3Hd,
    /// CenturyArks SilkyEvCam VGA, as `evk3_hd`; no biases either.
    SilkyVga,
}

impl CameraKind {
    /// As typed in a rig file: `evk1`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.word()
    }

    /// Whether the camera's driver offers a trigger input and a shared time base.
    #[must_use]
    pub const fn has_trigger(self) -> bool {
        match self {
            Self::Evk1 | Self::Evk4 => true,
            Self::Evk3Hd | Self::SilkyVga => false,
        }
    }
}

impl fmt::Display for CameraKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// Time base that a camera follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum SyncRole {
    /// Its own time base.
    Standalone,
    /// Its own time base, shared with the other camera.
    Master,
    /// The other camera's time base.
    Slave,
}

#[derive(Clone, Copy, Choice)]
enum ResetRule {
    /// The camera is not opened.
    Refused,
    /// The run continues without a note.
    Accepted,
}

impl From<ResetRule> for bool {
    fn from(rule: ResetRule) -> Self {
        matches!(rule, ResetRule::Accepted)
    }
}

#[derive(Clone, Copy, Choice)]
enum TransferRule {
    /// The run ends.
    End,
    /// Lost data: a gap in the session and an invalid press.
    Loss,
}

impl From<TransferRule> for bool {
    fn from(rule: TransferRule) -> Self {
        matches!(rule, TransferRule::Loss)
    }
}

#[derive(Clone, Copy, Choice)]
enum OverflowRule {
    /// Lost data: a gap in the session and an invalid press.
    Loss,
    /// A note at the end of the session.
    Note,
}

impl From<OverflowRule> for bool {
    fn from(rule: OverflowRule) -> Self {
        matches!(rule, OverflowRule::Loss)
    }
}

const ADDRESSES: Shape = Shape::List {
    of: &Shape::Text,
    min: 0,
    max: 100,
};

/// Register addresses, hexadecimal.
fn addresses(list: &Field, out: &mut Collector) -> Option<Vec<u32>> {
    let mut addresses = Vec::new();
    for item in list.items() {
        let text = item.as_text()?;
        let hex = text.strip_prefix("0x").map(|h| u32::from_str_radix(h, 16));
        let Some(Ok(address)) = hex else {
            out.error(item.span, item.path.as_str(), "not an address")
                .expected("a hexadecimal number such as `0x0204`")
                .found(format!("`{text}`"));
            return None;
        };
        addresses.push(address);
    }
    Some(addresses)
}

/// Bytes, hexadecimal.
fn bytes(list: &Field, out: &mut Collector) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    for (word, item) in addresses(list, out)?.into_iter().zip(list.items()) {
        let Ok(byte) = u8::try_from(word) else {
            out.error(item.span, item.path.as_str(), "not a byte")
                .expected("`0x00` to `0xff`")
                .found(format!("`{word:#x}`"));
            return None;
        };
        bytes.push(byte);
    }
    Some(bytes)
}

fn geometry(f: &Field, out: &mut Collector) -> Option<CameraModel> {
    if f.get("aim").is_none() {
        out.error(f.span, f.path.as_str(), "the camera's aim is missing")
            .expected("`aim`: a rig file has no outline with a centre to aim at")
            .found("no such key")
            .help("add `aim: [10 mm, 2 mm]`, a point on the camera's axis");
        return None;
    }
    let camera = NominalCamera::from_field(f, out)?;
    camera.checked(Point2::new(0.0, 0.0), f, out)
}

impl CameraSetup {
    /// Whether the camera's driver offers a trigger input.
    #[must_use]
    pub const fn has_trigger(&self) -> bool {
        self.model.has_trigger()
    }

    /// Fault of a trigger input: message and expectation.
    fn input_fault(
        model: CameraKind,
        sync: SyncRole,
        channel: u8,
    ) -> Option<(&'static str, &'static str)> {
        if model != CameraKind::Evk1 {
            None
        } else if !EVK1_INPUTS.contains(&channel) {
            Some((
                "the EVK1 has no such trigger input",
                "0 (main), 6 (loop-back of its own output) or 7 (auxiliary)",
            ))
        } else if sync == SyncRole::Slave && channel == AUXILIARY {
            Some((
                "a slave's auxiliary input carries the sync clock",
                "0, the main trigger input",
            ))
        } else {
            None
        }
    }

    fn has_input(
        model: &CameraKind,
        sync: &SyncRole,
        channel: &u8,
        field: &Field,
        out: &mut Collector,
    ) {
        if let Some((message, expected)) = Self::input_fault(*model, *sync, *channel) {
            let at = field.at("trigger_channel");
            out.error(at.span, at.path.as_str(), message)
                .expected(expected)
                .found(channel.to_string());
        }
    }

    fn has_time_base(model: &CameraKind, field: &Field, out: &mut Collector) {
        if let (Some(gap), true) = (field.get("max_time_high_gap"), *model != CameraKind::Evk1) {
            let message = "this camera's time base is not monitored";
            out.error(gap.span, gap.path.as_str(), message)
                .expected("`max_time_high_gap` with `model: evk1` only")
                .found(format!("`model: {model}`"));
        }
    }

    fn shares_time(model: &CameraKind, sync: &SyncRole, field: &Field, out: &mut Collector) {
        if !model.has_trigger() && *sync != SyncRole::Standalone {
            let at = field.at("sync");
            let message = "the camera's driver shares no time base";
            out.error(at.span, at.path.as_str(), message)
                .expected(format!("`standalone` for `model: {model}`"))
                .found(format!("`{}`", sync.word()));
        }
    }
}

/// The two event cameras.
#[derive(Settings)]
#[settings(
    name = "rig_cameras",
    check(Self::are_two, "camera1", "camera2"),
    check(Self::sync_fits, "camera1", "camera2"),
    check(Self::share_a_channel, "camera1", "camera2")
)]
struct CamerasKeys {
    /// Camera 1.
    camera1: CameraSetup,
    /// Camera 2.
    #[setting(example = CAMERA2)]
    camera2: CameraSetup,
}

const CAMERA2: &str = "{serial: \"00001754\", geometry: {position: [45 mm, 42 mm], aim: [10 mm, 2 mm], half_field_of_view: 60 deg}}";

/// The mapping of [`cameras`].
pub(super) const CAMERAS: Shape = CamerasKeys::SHAPE;

/// Camera 1 and camera 2.
pub(super) fn cameras(f: &Field, out: &mut Collector) -> Option<[CameraSetup; 2]> {
    CamerasKeys::from_mapping(f, out).map(|keys| [keys.camera1, keys.camera2])
}

impl CamerasKeys {
    fn are_two(one: &CameraSetup, two: &CameraSetup, field: &Field, out: &mut Collector) {
        if one.serial == two.serial {
            let at = field.at("camera2.serial");
            out.error(at.span, at.path.as_str(), "both cameras are the same")
                .expected("two different serial numbers")
                .found(format!("`{}` twice", one.serial));
        }
    }

    fn sync_fits(one: &CameraSetup, two: &CameraSetup, field: &Field, out: &mut Collector) {
        let fits = matches!(
            (one.sync, two.sync),
            (SyncRole::Standalone, SyncRole::Standalone)
                | (SyncRole::Master, SyncRole::Slave)
                | (SyncRole::Slave, SyncRole::Master)
        );
        if !fits {
            let at = field.at("camera2.sync");
            out.error(at.span, at.path.as_str(), "the sync modes do not fit")
                .expected("both `standalone`, or one `master` and one `slave`")
                .found(format!("{} and {}", one.sync.word(), two.sync.word()));
        }
    }

    fn share_a_channel(one: &CameraSetup, two: &CameraSetup, field: &Field, out: &mut Collector) {
        let is_valid = |c: &CameraSetup| {
            CameraSetup::input_fault(c.model, c.sync, c.trigger_channel).is_none()
        };
        if is_valid(one) && is_valid(two) && one.trigger_channel != two.trigger_channel {
            let at = field.at("camera2.trigger_channel");
            out.error(at.span, at.path.as_str(), "the trigger channels differ")
                .expected("the same channel on both cameras: analyses read one")
                .found(format!(
                    "{} and {}",
                    one.trigger_channel, two.trigger_channel
                ));
        }
    }
}
