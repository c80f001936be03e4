//! Interface between a suite and its bench; the command line implements it with real drivers.

use std::path::Path;

use skinrig_analysis::Analysis;
use skinrig_controller::ControlHandle;
use skinrig_device::{CameraSettings, Clock, EventCamera, Indenter, TriggerBox};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, GoldenSession};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::Light;

/// Evidence that explains why an operation failed. Boxed because it is large and rare.
pub type Problem = Box<Evidence>;

/// An open device, or the reason why it could not be opened.
pub type Slot<T> = Result<Box<T>, Problem>;

/// The devices of a bench. Each is opened separately, so that a missing one does not prevent checks of the others.
pub struct Devices {
    /// The robot, braked.
    pub robot: Slot<dyn Indenter>,
    /// Camera 1 and camera 2, stopped.
    pub cameras: [Slot<dyn EventCamera>; 2],
    /// The trigger box, armed; `None`: the rig file has none.
    pub trigger_box: Option<Slot<dyn TriggerBox>>,
    /// Clock shared by all devices.
    pub clock: Box<dyn Clock>,
}

/// Result of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignRun {
    /// The session and its report, relative to the night's folder.
    pub files: GoldenSession,
    /// Name of the skin, from the protocol.
    pub skin: Option<String>,
    /// The analysis; `None` if there is none, for which `evidence` has the reason.
    pub analysis: Option<Box<Analysis>>,
    /// Bytes known to be lost, by camera.
    pub lost_bytes: [u64; 2],
    /// Evidence from the run: faults, losses, what stopped it.
    pub evidence: Vec<Evidence>,
}

/// A session replayed as a live source, against its analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnlineComparison {
    /// Press windows compared.
    pub windows: usize,
    /// Those with the same bits.
    pub equal: usize,
}

/// Result of a watchdog drill.
#[derive(Debug, Clone, PartialEq)]
pub struct DrillResult {
    /// Time from the kill until the motors were known to be off, s; `None`: they stayed live.
    pub braked_within_s: Option<f64>,
    /// Distance of the tip from the position it held, mm.
    pub drop_mm: f64,
    /// Reason that the robot reports for switching its motors off.
    pub note: Option<String>,
}

/// A bench on which a suite runs.
pub trait Bench {
    /// The rig file.
    fn rig(&self) -> &RigFile;

    /// Opens every closed device and returns all of them.
    fn devices(&mut self) -> &mut Devices;

    /// Closes every device: robot braked, cameras stopped. Does nothing when none is open.
    fn close(&mut self);

    /// The settings that a run would write to `camera`.
    ///
    /// # Errors
    /// [`Problem`] when a bias file cannot be read.
    fn camera_settings(&self, camera: CameraId) -> Result<CameraSettings, Problem>;

    /// Switches the lamps. `Ok(false)`: this bench has no switchable lamps.
    ///
    /// # Errors
    /// [`Problem`] when the lamp program fails.
    fn set_light(&mut self, light: Light) -> Result<bool, Problem>;

    /// Whether the rig file permits `drill`.
    fn permits(&self, drill: Drill) -> bool;

    /// Closes every device, starts another process that holds the arm in free air, and kills that process.
    ///
    /// [`Problem`] when the drill fails to run.
    /// [`Problem`] when the drill could not be carried out.
    fn watchdog_drill(&mut self) -> Result<DrillResult, Problem>;

    /// Closes every device, runs a campaign through controller and recorder, and analyses it.
    ///
    /// # Errors
    /// [`Problem`] when there is no usable session.
    fn run_campaign(&mut self, protocol: &Path) -> Result<CampaignRun, Problem>;

    /// Replays the session of a campaign as a live source and compares the positions with its analysis.
    ///
    /// # Errors
    /// [`Problem`] when the session cannot be replayed.
    fn compare_online(&mut self, session: &GoldenSession) -> Result<OnlineComparison, Problem>;

    /// Folder for sessions. The check `disk` tests the disk that holds it.
    fn folder(&self) -> &Path;

    /// Firmware version of every device opened so far, by device name.
    fn firmware(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Whether the suite must end soon, after ctrl-C or SIGTERM. Checks poll this while they wait
    /// or move, and return what they have measured.
    fn stop_requested(&self) -> bool {
        false
    }

    /// [`stop_requested`](Self::stop_requested) as a function, for callers that already borrow the
    /// bench's devices.
    fn stop_signal(&self) -> Box<dyn Fn() -> bool> {
        Box::new(|| false)
    }

    /// The operator's control over the arm: a halt switches the motors off at once.
    fn control(&self) -> ControlHandle {
        ControlHandle::new()
    }

    /// Whether another program took the lease. The suite then ends and records it.
    fn lease_is_lost(&self) -> bool {
        false
    }

    /// Extra delay to tolerate from emulated devices that share this computer's processors; zero on real hardware.
    fn timing_slack(&self) -> HostDuration;
}
