//! Connections between the emulated devices: the tip that the cameras see, and the wires from the trigger box to the cameras.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use drd::{ArmView, EmulatedArm};
use skinrig_emulated_camera::Bus;
use skinrig_emulated_camera::world::{Edge, Tip};
use skinrig_emulated_trigger_box::{BoardMessage, CAMERA_1, CAMERA_2, EdgeStream, EmulatedBox};
use skinrig_model::CameraId;

/// Serial numbers of the two cameras, as in `hil/rigs/emulated.yaml`.
pub const CAMERA_SERIALS: [&str; 2] = ["00000001", "00000002"];

/// Interval at which the tip is read.
const TIP_INTERVAL: Duration = Duration::from_micros(500);
/// Interval at which the wire threads check whether to end.
const TIMEOUT: Duration = Duration::from_millis(50);
/// Camera input connected to the box: TRIG IN.
const TRIGGER_INPUT: u8 = 0;

/// Quality of the wire from the trigger box to a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wire {
    /// Transmits all pulses.
    Sound,
    /// Loses every `LOST_EVERY`-th pulse.
    Noisy,
    /// Disconnected.
    Cut,
}

/// A noisy wire loses one of this many pulses.
const LOST_EVERY: u32 = 11;

/// The threads that connect the devices. Dropping this value ends them.
pub(crate) struct Connections {
    stop: Arc<AtomicBool>,
    wires: Arc<[AtomicU8; 2]>,
    threads: Vec<JoinHandle<()>>,
}

impl Connections {
    pub(crate) fn start(
        arm: &EmulatedArm,
        bus: &Arc<Bus>,
        trigger_box: &EmulatedBox,
    ) -> io::Result<Self> {
        let mut connections = Self {
            stop: Arc::default(),
            wires: Arc::new([Wire::Sound; 2].map(|wire| AtomicU8::new(wire as u8))),
            threads: Vec::new(),
        };
        let (view, on, stop) = (
            ArmView::attach(arm.directory())?,
            Arc::clone(bus),
            Arc::clone(&connections.stop),
        );
        connections.spawn("tip", move || report_tip(&view, &on, &stop))?;
        let edges = EdgeStream::follow(trigger_box.socket())?;
        let (on, stop, wires) = (
            Arc::clone(bus),
            Arc::clone(&connections.stop),
            Arc::clone(&connections.wires),
        );
        connections.spawn("wires", move || forward_edges(edges, &on, &wires, &stop))?;
        Ok(connections)
    }

    /// Sets the quality of a camera's wire.
    pub(crate) fn wire(&self, camera: CameraId, wire: Wire) {
        self.wires[camera.index()].store(wire as u8, Ordering::Relaxed);
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        let thread = thread::Builder::new().name(name.to_owned()).spawn(work)?;
        self.threads.push(thread);
        Ok(())
    }
}

impl Drop for Connections {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A panic has already printed its message.
            let _ = thread.join();
        }
    }
}

/// Reports the tip position to the cameras, which never simulate past the last report.
fn report_tip(arm: &ArmView, bus: &Bus, stop: &AtomicBool) {
    let world = bus.world();
    let source = world.source();
    while !stop.load(Ordering::Relaxed) {
        // If the firmware died, the run under test detects it itself.
        let Ok(state) = arm.state() else { break };
        let at_ns = i64::try_from(state.t_ns).unwrap_or(i64::MAX);
        world.tip(Tip {
            at_ns,
            position_mm: state.position_m.map(|m| m * 1e3),
        });
        world.announce(source, at_ns);
        thread::sleep(TIP_INTERVAL);
    }
    world.leave(source);
}

/// Forwards the box's pulses to the cameras' inputs. Cameras wait for a board that lags on a busy
/// computer.
fn forward_edges(mut edges: EdgeStream, bus: &Bus, wires: &[AtomicU8; 2], stop: &AtomicBool) {
    let world = bus.world();
    let source = world.source();
    let clock = edges.clock();
    let mut pulses = [0_u32; 2];
    while !stop.load(Ordering::Relaxed) {
        match edges.next_message(TIMEOUT) {
            Ok(Some(BoardMessage::Edge(edge))) => {
                let n = match edge.pin {
                    CAMERA_1 => 0,
                    CAMERA_2 => 1,
                    _ => continue,
                };
                pulses[n] = pulses[n].wrapping_add(u32::from(edge.high));
                let wire = wires[n].load(Ordering::Relaxed);
                let is_lost = wire == Wire::Noisy as u8 && pulses[n].is_multiple_of(LOST_EVERY);
                if is_lost || wire == Wire::Cut as u8 {
                    continue;
                }
                let edge = Edge {
                    channel: TRIGGER_INPUT,
                    rising: edge.high,
                    at_ns: clock.host_ns(edge.cycle),
                };
                world.edge(CAMERA_SERIALS[n], edge);
            }
            Ok(Some(BoardMessage::At(cycle))) => world.announce(source, clock.host_ns(cycle)),
            Ok(None) => {}
            Err(_) => break,
        }
    }
    world.leave(source);
}
