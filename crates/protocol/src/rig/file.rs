//! A whole rig file, with the checks across its parts.

use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_settings::{Choice, Collector, Diagnostics, Field, Settings, open};

use super::camera::{self, CameraSetup};
use super::frame::Frame;
use super::hil::HilSetup;
use super::limits::{BenchLimits, PreflightLimits};
use super::robot::{MotorForce, RobotSetup};
use super::tip::Tip;
use super::trigger_box::BoxSetup;
use super::variables::{self, Environment};
use crate::file::hex;
use crate::notify::Notify;
use crate::surface::Surface;

/// A skinrig rig file: the devices of a bench, the position of the skin and the bench's limits.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(
    name = "rig",
    version = "skinrig_rig",
    check(Self::force_can_be_set),
    check(Self::skin_is_inside, "frame", "limits"),
    check(Self::cameras_see_the_box, "cameras")
)]
pub struct RigFile {
    /// The file's name as given to [`RigFile::parse`].
    #[setting(skip)]
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    #[setting(skip)]
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    #[setting(skip)]
    pub sha256: String,
    /// Name of the bench. Stored with every session.
    #[setting(example = "bench")]
    pub name: String,
    /// Whether the drivers control hardware. Stored with every session.
    pub kind: RigKind,
    /// Free text about the bench.
    pub description: Option<String>,
    /// Pose of the skin in the robot's frame: given, or fitted to touched points.
    pub frame: Frame,
    /// The indenter's tip.
    pub tip: Tip,
    /// Limits of this bench, for every protocol.
    pub limits: BenchLimits,
    /// The robot that presses.
    pub robot: RobotSetup,
    /// The two event cameras.
    #[setting(shape = camera::CAMERAS, read = camera::cameras)]
    pub cameras: [CameraSetup; 2],
    /// The trigger box, which pulses the cameras' trigger inputs; absent: not connected.
    pub trigger_box: Option<BoxSetup>,
    /// Checks before arming.
    #[setting(default)]
    pub preflight: PreflightLimits,
    /// How presses find the surface if the protocol does not set it; absent: the frame is trusted.
    #[setting(key = "press")]
    pub surface: Option<Surface>,
    /// Permissions for suites of checks on this bench.
    #[setting(default)]
    pub hil: HilSetup,
    /// Messages about runs on this bench, and about its nights if the suite has no `notify`; absent: none.
    pub notify: Option<Notify>,
}

/// Whether the drivers control hardware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum RigKind {
    /// Hardware.
    Bench,
    /// Production drivers over stand-ins for the hardware; every recording is marked as emulated.
    Emulated,
}

impl RigKind {
    /// `bench` or `emulated`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.word()
    }
}

impl RigFile {
    /// Reads a rig file from the bytes of a file named `name`. Paths in it are relative to its folder; `${NAME}` in
    /// a path or port is looked up in `environment`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(
        name: &str,
        bytes: &[u8],
        environment: Environment<'_>,
    ) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        let text = String::from_utf8_lossy(bytes).into_owned();
        out.variables = variables::mentioned(&text, environment);
        match root.and_then(|root| Self::from_mapping(&root, &mut out)) {
            Some(rig) if out.is_clean() => Ok(Self {
                file_name: name.to_owned(),
                text,
                sha256: hex(&Sha256::digest(bytes)),
                ..rig.in_folder(Path::new(name).parent().unwrap_or(Path::new("")))
            }),
            _ => Err(out.finish()),
        }
    }

    /// Resolves paths against the folder of the file.
    fn in_folder(mut self, folder: &Path) -> Self {
        let bias_files = self.cameras.iter_mut().map(|c| &mut c.bias_file);
        for path in bias_files.chain([&mut self.robot.library]).flatten() {
            *path = folder.join(&path);
        }
        if let Some(notify) = &mut self.notify {
            notify.in_folder(folder);
        }
        self
    }

    fn force_can_be_set(root: &Field, out: &mut Collector) {
        let field = root.at("robot.motor_force");
        let motor_force = MotorForce::from_mapping(field, out);
        let limit_n = root.at("limits.max_force").as_quantity();
        if let (Some(motor_force), Some(limit_n)) = (motor_force, limit_n) {
            motor_force.check_limit(limit_n, field, out);
        }
    }

    /// Checks that every touched point, or the skin's origin, is inside the workspace.
    fn skin_is_inside(frame: &Frame, limits: &BenchLimits, root: &Field, out: &mut Collector) {
        let places: Vec<(&str, [f64; 3])> = match &frame.touch_off {
            Some(touched) => {
                let points = touched.points.iter();
                points
                    .map(|p| (p.name.as_str(), p.robot.to_array()))
                    .collect()
            }
            None => vec![("the skin's origin", frame.robot_from_skin.translation_mm)],
        };
        let outside = places
            .into_iter()
            .find(|(_, p)| !limits.workspace.contains(*p));
        if let Some((name, p)) = outside {
            let (min, max) = (limits.workspace.min_mm, limits.workspace.max_mm);
            let at = root.at("limits.workspace");
            let message = "the skin lies outside the workspace";
            out.error(at.span, at.path.as_str(), message)
                .expected(format!("{name} from {min:?} to {max:?} mm, robot frame"))
                .found(format!("{p:?} mm"));
        }
    }

    /// Checks that both cameras have a trigger input if there is a trigger box.
    fn cameras_see_the_box(cameras: &[CameraSetup; 2], root: &Field, out: &mut Collector) {
        let Some(trigger_box) = root.get("trigger_box") else {
            return;
        };
        if let Some(camera) = cameras.iter().find(|c| !c.has_trigger()) {
            let message = "a camera has no input for the trigger box";
            out.error(trigger_box.span, trigger_box.path.as_str(), message)
                .expected("two cameras whose driver offers a trigger input: `evk1` or `evk4`")
                .found(format!("`model: {}`", camera.model))
                .help("remove `trigger_box`: camera times are then not synchronised, and marks cannot label sessions");
        }
    }
}
