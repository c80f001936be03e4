//! A simulated event camera: its settings, its states, and what happens to it.

use std::collections::{BTreeMap, VecDeque};

use skinrig_device::{
    CameraCapabilities, CameraSettings, DeviceError, EventCamera, OpenChunk, PatternScan,
    TestPattern, newest_words,
};
use skinrig_formats::evt2;
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, RawChunk, RigFault, SENSOR_HEIGHT, SENSOR_WIDTH, Setting,
    StreamFormat,
};

use crate::byte_encoder::{ByteEncoder, CameraFaults, Encoding, Interval};
use crate::camera_stream::StreamState;
use crate::config::SimConfig;
use crate::drifting::DriftingClock;
use crate::faults::{self, FaultTrigger, HOT_C, HOT_NS, HOT_RISE_NS, STORM_NS};
use crate::line::LineEdge;
use crate::pattern::ScanModel;
use crate::random::{Purpose, Stream};
use crate::scene::{GRID_NS, PixelModel};
use crate::world::{Shared, World};

/// Bias names, ranges and defaults in mV (evk1.md section 2.9). The simulation stores them without effect on its events.
const BIASES: [(&str, i64, i64, i64); 6] = [
    ("bias_diff_off", 0, 1800, 221),
    ("bias_diff_on", 0, 1800, 384),
    ("bias_fo", 1250, 1800, 1477),
    ("bias_hpf", 900, 1800, 1499),
    ("bias_pr", 975, 1800, 1250),
    ("bias_refr", 1300, 1800, 1500),
];

/// Trigger inputs of an EVK1 (evk1.md section 2.12).
const CHANNELS: [u8; 3] = [0, 6, 7];

/// Temperature of a simulated camera without faults, °C.
pub(crate) const TEMPERATURE_C: f64 = 35.0;

/// Supported rates of the test pattern, events per second.
const PATTERN_RATES_EV_S: std::ops::RangeInclusive<f64> = 1.0..=50e6;

/// Grid steps that a camera's thread gets at once.
const BATCH_STEPS: usize = 64;

/// Batches after which a poll waits for the thread: chunks are handed over within 1 s of rig time.
const MOST_BATCHES: usize = 16;

/// Creates the pixel model for the n-th start of a camera; `None` at levels without pixels.
pub(crate) type PixelFactory = Box<dyn Fn(u64) -> Option<Box<dyn PixelModel>> + Send>;

/// A simulated event camera.
pub(crate) struct SimCamera {
    shared: Shared,
    id: CameraId,
    serial: String,
    jitter_ns: i64,
    setting_ignored: Option<FaultTrigger>,
    lost: Vec<(FaultTrigger, u64)>,
    unplug: Option<FaultTrigger>,
    stall: Option<FaultTrigger>,
    storms: Vec<FaultTrigger>,
    steps: Vec<(FaultTrigger, u32)>,
    hot: Option<FaultTrigger>,
    make_pixels: PixelFactory,
    random: Stream,
    draw_clock: crate::config::CameraClockConfig,
    settings: CameraSettings,
    pattern: Option<PatternScan>,
    starts: u64,
    /// Grid point up to which the camera has seen the world; `None` while stopped.
    grid: Option<i64>,
    last_edge_ns: i64,
    /// What happened since, to be encoded, and its grid steps.
    waiting: Vec<Interval>,
    waiting_steps: usize,
    /// Batches on the thread since chunks were last handed over.
    batches: usize,
    encoding: Encoding,
    /// Whether every poll encodes all there is: the caller reads the open chunk, or there is next to nothing to encode.
    is_prompt: bool,
    /// Whether the last interval has a fault, or is so long that bytes may be lost: what becomes of it belongs to this time.
    is_eventful: bool,
    /// Whether bytes were lost that no chunk handed over tells of.
    has_lost: bool,
    /// Whether the host has noticed that the cable is pulled.
    gone: bool,
}

impl SimCamera {
    /// Camera `id` of a rig.
    #[must_use]
    pub(crate) fn new(
        config: &SimConfig,
        id: CameraId,
        shared: Shared,
        make_pixels: PixelFactory,
    ) -> Self {
        let times = |kind: fn(CameraId) -> RigFault| faults::times(&config.faults, kind(id));
        let sizes = config.fault_sizes;
        Self {
            shared,
            id,
            serial: format!("sim-{:08x}-c{}", config.seed as u32, id.number()),
            jitter_ns: config.camera_clock.trigger_jitter_ns.max(0),
            setting_ignored: times(RigFault::CameraSettingIgnored).next(),
            lost: times(RigFault::CameraDrops)
                .map(|when| (when, sizes.lost_words))
                .collect(),
            unplug: times(RigFault::CameraUnplugged).last(),
            stall: times(RigFault::CameraStalled).last(),
            storms: times(RigFault::CameraStorm).collect(),
            steps: times(RigFault::CameraClockStep)
                .map(|when| (when, sizes.clock_step_us))
                .collect(),
            hot: times(RigFault::CameraHot).last(),
            make_pixels,
            random: Stream::new(config.seed, Purpose::CameraClock, id.index() as u64),
            draw_clock: config.camera_clock,
            settings: CameraSettings::default(),
            pattern: None,
            starts: 0,
            grid: None,
            last_edge_ns: i64::MIN,
            waiting: Vec::new(),
            waiting_steps: 0,
            batches: 0,
            encoding: Encoding::new(ByteEncoder::new(id, config.camera_clock)),
            is_prompt: false,
            is_eventful: false,
            has_lost: false,
            gone: false,
        }
    }

    /// Fails if the camera is unplugged or streaming.
    fn expect_stopped(&self) -> Result<(), DeviceError> {
        if self.gone {
            return Err(self.gone_error());
        }
        if self.grid.is_some() {
            return Err(DeviceError::State {
                role: self.role(),
                serial: self.serial.clone(),
                expected: "stopped".to_owned(),
                found: "streaming".to_owned(),
            });
        }
        Ok(())
    }

    fn role(&self) -> DeviceRole {
        DeviceRole::of_camera(self.id)
    }

    fn refused(&self, expected: impl Into<String>, found: impl Into<String>) -> DeviceError {
        DeviceError::Refused {
            role: self.role(),
            serial: self.serial.clone(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn gone_error(&self) -> DeviceError {
        DeviceError::Lost {
            role: self.role(),
            serial: self.serial.clone(),
            detail: "expected transfers, found the device unplugged".to_owned(),
        }
    }

    fn check(&self, settings: &CameraSettings) -> Result<(), DeviceError> {
        for (name, &value) in &settings.biases {
            let Some((_, low, high, _)) = BIASES.iter().find(|b| b.0 == name) else {
                let names = BIASES.map(|b| b.0).join(", ");
                return Err(self.refused(format!("a bias out of {names}"), name));
            };
            if !(*low..=*high).contains(&value) {
                return Err(self.refused(
                    format!("{name} in {low}..={high} mV"),
                    format!("{value} mV"),
                ));
            }
        }
        for channel in &settings.trigger_channels {
            if !CHANNELS.contains(channel) {
                return Err(self.refused("trigger channel 0, 6 or 7", channel.to_string()));
            }
        }
        if let Some(r) = settings.roi {
            let fits = |from: u16, size: u16, limit: u16| {
                size > 0 && u32::from(from) + u32::from(size) <= u32::from(limit)
            };
            if !fits(r.x, r.width, SENSOR_WIDTH) || !fits(r.y, r.height, SENSOR_HEIGHT) {
                return Err(self.refused(
                    format!("a non-empty region within {SENSOR_WIDTH} x {SENSOR_HEIGHT}"),
                    format!("{} x {} at ({}, {})", r.width, r.height, r.x, r.y),
                ));
            }
        }
        Ok(())
    }

    /// Takes note of what happens to the camera up to the current time.
    fn observe(&mut self) {
        let Some(grid) = self.grid else { return };
        let index = self.id.index();
        let mut world = self.shared.world();
        let mut tips = Vec::new();
        world.tips_since(index, grid, &mut tips);
        let mut edges = Vec::new();
        for edge in world.line.take_edges(index) {
            let jitter_ns = (self.random.unit() * self.jitter_ns as f64) as i64;
            // Edges never overtake each other.
            self.last_edge_ns = self.last_edge_ns.max(edge.t_ns + jitter_ns);
            let t_ns = self.last_edge_ns;
            edges.push(LineEdge { t_ns, ..edge });
        }
        self.grid = Some(world.grid());
        let storms = self.storms.iter();
        let faults = CameraFaults {
            unplugged_ns: occurred(&world, self.unplug),
            stalled_ns: occurred(&world, self.stall),
            storms_ns: storms.filter_map(|s| world.occurred_at(*s)).collect(),
            losses: take_occurred(&world, &mut self.lost),
            steps: take_occurred(&world, &mut self.steps),
        };
        let now_ns = world.grid() * GRID_NS;
        let is_stormy = |t: &i64| now_ns - t <= 2 * STORM_NS;
        self.is_eventful = faults.unplugged_ns.is_some()
            || !faults.losses.is_empty()
            || !faults.steps.is_empty()
            || faults.storms_ns.iter().any(is_stormy)
            || tips.len() > BATCH_STEPS;
        self.waiting_steps += tips.len().saturating_sub(1);
        self.waiting.push(Interval {
            tips,
            edges,
            faults,
        });
    }

    /// Encodes everything up to the current time.
    fn catch_up(&mut self) {
        self.observe();
        self.encoding.finish(&mut self.waiting);
        self.waiting_steps = 0;
    }

    fn hand_over(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.batches = 0;
        let mut encoder = self.encoding.ended();
        if encoder.gone {
            encoder.close_chunk();
        }
        chunks.extend(encoder.out.ready.drain(..));
        self.gone = encoder.gone;
        self.has_lost = encoder.out.lost_before > 0 || encoder.out.to_lose > 0;
        drop(encoder);
        if self.gone {
            return Err(self.gone_error());
        }
        Ok(())
    }
}

/// Time of a fault, if it has occurred.
fn occurred(world: &World, when: Option<FaultTrigger>) -> Option<i64> {
    let now_ns = world.grid() * GRID_NS;
    world.occurred_at(when?).filter(|&t| t < now_ns)
}

/// Takes the faults that have occurred, with their times.
fn take_occurred<T: Copy>(world: &World, faults: &mut Vec<(FaultTrigger, T)>) -> Vec<(i64, T)> {
    let mut due = Vec::new();
    faults.retain(|&(when, what)| match occurred(world, Some(when)) {
        Some(t) => {
            due.push((t, what));
            false
        }
        None => true,
    });
    due
}

impl EventCamera for SimCamera {
    fn camera(&self) -> CameraId {
        self.id
    }

    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "simulated Prophesee EVK1 Gen3.1 VGA".to_owned(),
            serial: self.serial.clone(),
            firmware: concat!("skinrig-sim ", env!("CARGO_PKG_VERSION")).to_owned(),
        }
    }

    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            width: SENSOR_WIDTH,
            height: SENSOR_HEIGHT,
            format: StreamFormat::Evt2,
            trigger_channels: CHANNELS.to_vec(),
            biases: BIASES.iter().map(|b| b.0.to_owned()).collect(),
        }
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        self.expect_stopped()?;
        self.check(settings)?;
        self.pattern = None;
        let mut biases: BTreeMap<String, i64> =
            BIASES.iter().map(|b| (b.0.to_owned(), b.3)).collect();
        biases.extend(settings.biases.iter().map(|(n, v)| (n.clone(), *v)));
        self.settings = CameraSettings {
            biases: biases.clone(),
            ..settings.clone()
        };
        let ignores = self
            .setting_ignored
            .is_some_and(|when| self.shared.world().has_occurred(when));
        let mut read = Vec::new();
        for (name, value) in biases {
            let found = if ignores && name == "bias_fo" {
                value - 1
            } else {
                value
            };
            if found != value {
                return Err(DeviceError::ReadBack {
                    role: self.role(),
                    serial: self.serial.clone(),
                    name,
                    expected: value.to_string(),
                    found: found.to_string(),
                });
            }
            read.push(same(name, value.to_string()));
        }
        let roi = settings.roi.map_or_else(
            || "all".to_owned(),
            |r| format!("{} x {} at ({}, {})", r.width, r.height, r.x, r.y),
        );
        read.push(same("roi".to_owned(), roi));
        let channels: Vec<String> = settings
            .trigger_channels
            .iter()
            .map(u8::to_string)
            .collect();
        read.push(same("trigger_channels".to_owned(), channels.join(",")));
        Ok(read)
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.expect_stopped()?;
        let grid = self.shared.world().watch(self.id.index());
        let pixels = match &self.pattern {
            None => (self.make_pixels)(self.starts),
            Some(scan) => Some(Box::new(ScanModel::new(*scan)) as Box<dyn PixelModel>),
        };
        // Without pixels, there is nothing to do that is worth a thread.
        self.is_prompt = pixels.is_none();
        let start_ns = grid * GRID_NS;
        let draw = self.draw_clock;
        let random = &mut self.random;
        let mut encoder = self.encoding.ended();
        let clock = *encoder.clock.get_or_insert_with(|| {
            DriftingClock::draw(draw.max_origin_s, draw.max_drift_ppm, random, start_ns)
        });
        encoder.start(StreamState {
            pixels,
            has_region: self.pattern.is_none(),
            encoder: evt2::Encoder::new(clock.own_us(start_ns)),
            edges: VecDeque::new(),
            settings: self.settings.clone(),
            events: Vec::new(),
            fresh: Vec::new(),
        });
        drop(encoder);
        self.grid = Some(grid);
        self.starts += 1;
        Ok(())
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.observe();
        if self.is_prompt || self.is_eventful || self.has_lost {
            self.catch_up();
        }
        if self.waiting_steps >= BATCH_STEPS {
            self.encoding.run(&mut self.waiting);
            self.waiting_steps = 0;
            self.batches += 1;
        }
        if self.encoding.is_running() && self.batches < MOST_BATCHES {
            return Ok(());
        }
        self.hand_over(chunks)
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.catch_up();
        self.encoding.ended().close_chunk();
        self.hand_over(chunks)
    }

    fn newest(&mut self, most: usize) -> Option<Vec<u8>> {
        Some(newest_words(&self.encoding.ended().out.bytes, most))
    }

    fn open_chunk(&mut self, from: usize) -> Option<OpenChunk> {
        if !std::mem::replace(&mut self.is_prompt, true) {
            return None;
        }
        let encoder = self.encoding.ended();
        let out = &encoder.out;
        OpenChunk::of(out.seq, out.lost_before, &out.bytes, from)
    }

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        if self.grid.is_none() {
            return Ok(());
        }
        let flushed = self.flush(chunks);
        self.encoding.ended().stop();
        self.grid = None;
        self.shared.world().unwatch(self.id.index());
        flushed
    }

    fn test_pattern(
        &mut self,
        pattern: Option<TestPattern>,
    ) -> Result<Option<PatternScan>, DeviceError> {
        self.expect_stopped()?;
        self.pattern = match pattern {
            None => None,
            Some(TestPattern { rate_ev_s }) if PATTERN_RATES_EV_S.contains(&rate_ev_s) => {
                Some(PatternScan {
                    rate_ev_s,
                    columns: SENSOR_WIDTH,
                    rows: SENSOR_HEIGHT,
                })
            }
            Some(TestPattern { rate_ev_s }) => {
                let (low, high) = (PATTERN_RATES_EV_S.start(), PATTERN_RATES_EV_S.end());
                return Err(self.refused(
                    format!("a pattern of {low} to {high} events/s"),
                    rate_ev_s.to_string(),
                ));
            }
        };
        Ok(self.pattern)
    }

    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        if self.gone {
            return Err(self.gone_error());
        }
        let world = self.shared.world();
        let struck_ns = self.hot.and_then(|when| world.occurred_at(when));
        let after_ns = struck_ns.map(|t| world.grid() * GRID_NS - t);
        Ok(Some(TEMPERATURE_C + after_ns.map_or(0.0, heat_c)))
    }
}

/// Temperature rise this long after the fault that heats the camera, °C.
fn heat_c(after_ns: i64) -> f64 {
    let cooling_ns = 2 * HOT_RISE_NS + HOT_NS - after_ns;
    let near_ns = after_ns.min(cooling_ns).clamp(0, HOT_RISE_NS);
    HOT_C * near_ns as f64 / HOT_RISE_NS as f64
}

fn same(name: String, value: String) -> Setting {
    Setting {
        name,
        requested: value.clone(),
        read_back: value,
    }
}
