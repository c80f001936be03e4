//! The trigger box of a bench.

use serde::Serialize;
use skinrig_settings::{Choice, Collector, Field, Settings};

use super::variables;

/// The trigger box.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(name = "trigger_box")]
pub struct BoxSetup {
    /// Serial port, preferably one under `/dev/serial/by-id`; `${NAME}` stands for an environment variable. Ports are never guessed.
    #[setting(read = variables::text, example = "/dev/serial/by-id/usb-Arduino_Uno-if00")]
    pub port: String,
    /// Serial number of the box as shown by `skinrig devices --rig`; absent: any.
    pub serial: Option<String>,
    /// Expected firmware version; absent: the version that this build of skinrig supports.
    pub firmware: Option<String>,
    /// Connections of the box's lines.
    #[serde(flatten)]
    #[setting(default)]
    pub wiring: Wiring,
    /// Period of the coded sync trains, in whole milliseconds.
    #[setting(default = "100 ms", min = 18, max = 65_000)]
    pub sync_period_ms: u16,
    /// Largest error of the box's clock, parts per million: 5000 for the ceramic resonator of an Arduino Uno, 100 for a
    /// board with a crystal.
    #[setting(
        default = "5000",
        key = "max_drift_ppm",
        unit = "",
        above = 0,
        max = 20_000
    )]
    pub max_drift_ppm: f64,
}

/// Connections of a trigger box's lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Wiring {
    /// Outputs 1, 2 and 3.
    pub outputs: [BoxOutput; 3],
    /// The time-stamped input.
    pub input: BoxInput,
}

/// Connection of an output of the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum BoxOutput {
    /// Trigger input of camera 1.
    Camera1,
    /// Trigger input of camera 2.
    Camera2,
    /// Something else, an oscilloscope for example.
    Other,
    /// Nothing.
    None,
}

/// Source of the box's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum BoxInput {
    /// Contact switch that closes when the tip touches.
    Contact,
    /// A light gate that the tip interrupts.
    Optical,
    /// Something else.
    Other,
    /// Nothing; edges are not recorded.
    None,
}

/// Connections of the box's lines. All outputs rise in the same cycle.
#[derive(Settings)]
#[settings(name = "wiring", builds(Wiring, WiringKeys::wiring))]
struct WiringKeys {
    /// First output.
    #[setting(default = "camera1")]
    output1: BoxOutput,
    /// Second output.
    #[setting(default = "camera2")]
    output2: BoxOutput,
    /// Third output.
    #[setting(default = "none")]
    output3: BoxOutput,
    /// The time-stamped input.
    #[setting(default = "none")]
    input: BoxInput,
}

impl WiringKeys {
    fn wiring(self, field: &Field, out: &mut Collector) -> Option<Wiring> {
        let outputs = [self.output1, self.output2, self.output3];
        for camera in [BoxOutput::Camera1, BoxOutput::Camera2] {
            let lines = outputs.iter().filter(|o| **o == camera).count();
            if lines != 1 {
                let message = "a camera needs exactly one trigger line";
                out.error(field.span, field.path.as_str(), message)
                    .expected(format!(
                        "exactly one output that goes to `{}`",
                        camera.word()
                    ))
                    .found(lines.to_string());
                break;
            }
        }
        Some(Wiring {
            outputs,
            input: self.input,
        })
    }
}
