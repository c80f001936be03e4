//! Events of a camera of the simulated bench that sees a tip in real time.

use skinrig_model::{Point3, RigidTransform, Robot, SimLevel, Skin};
use skinrig_sim::SimConfig;
use skinrig_sim::geometric::GeometricModel;
use skinrig_sim::optical::OpticalModel;
use skinrig_sim::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

use crate::config::SceneContent;
use crate::error::BusError;
use crate::world::World;

pub(crate) struct Scene {
    scene: SceneConfig,
    config: SimConfig,
    skin_from_robot: RigidTransform<Skin, Robot>,
    /// Tip position before the first report.
    rest: Point3<Skin>,
    running: Option<SceneRun>,
    /// Events that belong to the next packet.
    ahead: Vec<PixelEvent>,
}

/// Pixels of the current run.
struct SceneRun {
    pixels: Box<dyn PixelModel>,
    /// Whether the lamps are on.
    lit: bool,
    /// The last processed sample.
    last: TipSample,
}

impl Scene {
    pub(crate) fn new(content: &SceneContent) -> Result<Self, BusError> {
        if content.level == SimLevel::Kinematic {
            return Err(BusError::Content(
                "expected a scene of level geometric or optical, found kinematic, which has no pixels"
                    .to_owned(),
            ));
        }
        let mut config = SimConfig::new(content.seed, content.level);
        if let Some(share) = content.dead_share {
            config.geometric.dead_share = share;
        }
        let robot_from_skin = content.robot_from_skin.unwrap_or(config.robot_from_skin);
        Ok(Self {
            scene: config.scene(content.camera),
            skin_from_robot: robot_from_skin.inverse(),
            rest: config.start,
            config,
            running: None,
            ahead: Vec::new(),
        })
    }

    /// Starts a run. Its first events occur at the grid step after `from_ns`; every run has its own
    /// noise.
    pub(crate) fn start(&mut self, world: &World, from_ns: i64) {
        let t_ns = (from_ns / GRID_NS + 1) * GRID_NS;
        let first = TipSample {
            t_ns,
            position: self.tip(world, t_ns),
        };
        self.ahead.clear();
        self.running = Some(self.begin(world.is_lit(), first));
    }

    /// New pixel models: the same pixels with new noise.
    fn begin(&mut self, lit: bool, last: TipSample) -> SceneRun {
        let (scene, geometric) = (&self.scene, &self.config.geometric);
        let pixels: Box<dyn PixelModel> = match (self.config.level, lit) {
            (SimLevel::Optical, true) => Box::new(OpticalModel::new(scene)),
            (SimLevel::Optical, false) => Box::new(OpticalModel::dark(scene)),
            (_, true) => Box::new(GeometricModel::new(scene, geometric)),
            (_, false) => Box::new(GeometricModel::new(scene, &geometric.dark())),
        };
        self.scene.start += 1;
        SceneRun { pixels, lit, last }
    }

    fn tip(&self, world: &World, t_ns: i64) -> Point3<Skin> {
        world.tip_at(t_ns).map_or(self.rest, |[x, y, z]| {
            self.skin_from_robot.apply(Point3::new(x, y, z))
        })
    }

    pub(crate) fn events(&mut self, world: &World, until_ns: i64, out: &mut Vec<PixelEvent>) {
        let Some(mut running) = self.running.take() else {
            return;
        };
        let lit = world.is_lit();
        if lit != running.lit {
            // The events of all pixels caused by switching the lamps are omitted.
            running = self.begin(lit, running.last);
        }
        let mut last = running.last;
        let mut tips = vec![last];
        while last.t_ns < until_ns {
            let t_ns = last.t_ns + GRID_NS;
            let position = self.tip(world, t_ns);
            last = TipSample { t_ns, position };
            tips.push(last);
        }
        if tips.len() > 1 {
            running.pixels.advance(&tips, &mut self.ahead);
        }
        running.last = last;
        self.running = Some(running);
        let due = self.ahead.partition_point(|e| e.t_ns < until_ns);
        out.extend(self.ahead.drain(..due));
    }
}
