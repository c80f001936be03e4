//! What a suite needs of a bench; the command line puts drivers behind it.

use std::path::Path;

use skinrig_controller::ControlHandle;
use skinrig_device::{CameraSettings, Clock, EventCamera, Indenter, TriggerBox};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, Golden};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::Light;

use crate::findings::Findings;

/// Why something could not be had or done: boxed, for it is rare and large.
pub type Trouble = Box<Evidence>;

/// A device that was opened, or why it could not be.
pub type Slot<T> = Result<Box<T>, Trouble>;

/// The devices of a bench, each opened by itself: one that is missing keeps no other from being checked.
pub struct Devices {
    /// The robot, braked.
    pub robot: Slot<dyn Indenter>,
    /// Camera 1 and camera 2, stopped.
    pub cameras: [Slot<dyn EventCamera>; 2],
    /// The trigger box, armed; `None`: the rig file has none.
    pub trigger_box: Option<Slot<dyn TriggerBox>>,
    /// The clock that all of them share.
    pub clock: Box<dyn Clock>,
}

/// What a golden campaign gave: the session, and its numbers in the units of the suite's metrics.
#[derive(Debug, Clone, PartialEq)]
pub struct GoldenRun {
    /// The session and its report, relative to the night's folder.
    pub files: Golden,
    /// Name of the skin, from the protocol.
    pub skin: Option<String>,
    /// Version of the analysis.
    pub analysis_version: u32,
    /// What was measured, and what else was seen: losses, faults, findings of the audit.
    pub findings: Findings,
}

/// What the drill of a watchdog gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Drilled {
    /// From the kill until the motors were known to be off, s; `None`: they never were.
    pub braked_within_s: Option<f64>,
    /// How far the tip was from where it had been held, mm.
    pub drop_mm: f64,
    /// What the robot says of why its motors went off.
    pub note: Option<String>,
}

/// A bench.
pub trait Bench {
    /// The rig file.
    fn rig(&self) -> &RigFile;

    /// Opens every device that is not open, and hands them out.
    fn devices(&mut self) -> &mut Devices;

    /// Lets go of every device: robot braked, cameras stopped. Nothing happens when none is open.
    fn close(&mut self);

    /// The settings that a run would write to this camera.
    ///
    /// # Errors
    /// [`Trouble`] when a bias file cannot be read.
    fn camera_settings(&self, camera: CameraId) -> Result<CameraSettings, Trouble>;

    /// Switches the lamps. `Ok(false)`: this bench cannot.
    ///
    /// # Errors
    /// [`Trouble`] when the program failed.
    fn light(&mut self, light: Light) -> Result<bool, Trouble>;

    /// Whether the drill is permitted here.
    fn permits(&self, drill: Drill) -> bool;

    /// Closes every device and lets another process hold the arm in free air, which is then killed.
    ///
    /// # Errors
    /// [`Trouble`] when it could not be done.
    fn watchdog_drill(&mut self) -> Result<Drilled, Trouble>;

    /// Closes every device, runs the golden campaign through controller and recorder, and analyses it.
    ///
    /// # Errors
    /// [`Trouble`] when there is no session to speak of.
    fn golden(&mut self, protocol: &Path) -> Result<GoldenRun, Trouble>;

    /// Where sessions go: the folder whose disk is checked.
    fn folder(&self) -> &Path;

    /// The firmware of every device that was open so far: `robot`, `camera1`, ..., and its version.
    fn firmware(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Whether everything is to end soon: ctrl-C, or the system's polite end. Checks look at it while they wait or move, and
    /// come back with what they have; the runner says why.
    fn stop_asked(&self) -> bool {
        false
    }

    /// As [`stop_asked`](Self::stop_asked), for whoever has devices of the bench in hand.
    fn stopping(&self) -> Box<dyn Fn() -> bool> {
        Box::new(|| false)
    }

    /// The operator's hand on the arm: a halt switches the motors off at once, wherever it is.
    fn control(&self) -> ControlHandle {
        ControlHandle::new()
    }

    /// Whether somebody else took the bench: everything ends, and the night says so.
    fn lease_is_lost(&self) -> bool {
        false
    }

    /// How late stand-ins that share this computer's processors may be; zero on a bench of hardware.
    fn patience(&self) -> HostDuration;
}
