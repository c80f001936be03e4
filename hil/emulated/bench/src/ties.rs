//! What ties the devices together: the tip that the cameras see, and the wires from the trigger box to the cameras.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use drd::{ArmView, EmulatedArm};
use skinrig_emulated_camera::Bus;
use skinrig_emulated_camera::world::{Edge, Tip};
use skinrig_emulated_trigger_box::{CAMERA_1, CAMERA_2, EdgeStream, EmulatedBox, Told};
use skinrig_model::CameraId;

/// Serial numbers of the two cameras, as in `hil/rigs/emulated.yaml`.
pub const CAMERA_SERIALS: [&str; 2] = ["00000001", "00000002"];

/// How often the tip is looked at.
const LOOK_EVERY: Duration = Duration::from_micros(500);
/// How long the wires wait before they look whether they are still needed.
const PATIENCE: Duration = Duration::from_millis(50);
/// The cameras' input that the box is wired to: TRIG IN.
const TRIGGER_INPUT: u8 = 0;

/// How well the wire from the trigger box to a camera carries pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    /// All of them.
    Whole,
    /// All but one of [`LEAKS_EVERY`].
    Leaky,
    /// None.
    Cut,
}

/// A leaky wire loses each such pulse.
pub const LEAKS_EVERY: u32 = 11;

/// The threads; they end with this value.
pub(crate) struct Ties {
    cut: Arc<AtomicBool>,
    wires: Arc<[AtomicU8; 2]>,
    threads: Vec<JoinHandle<()>>,
}

impl Ties {
    pub(crate) fn make(
        arm: &EmulatedArm,
        bus: &Arc<Bus>,
        trigger_box: &EmulatedBox,
    ) -> io::Result<Self> {
        let mut ties = Self {
            cut: Arc::default(),
            wires: Arc::default(),
            threads: Vec::new(),
        };
        let (view, on, cut) = (
            ArmView::attach(arm.directory())?,
            Arc::clone(bus),
            Arc::clone(&ties.cut),
        );
        ties.spawn("tip", move || show_tip(&view, &on, &cut))?;
        let edges = EdgeStream::follow(trigger_box.socket())?;
        let (on, cut, wires) = (
            Arc::clone(bus),
            Arc::clone(&ties.cut),
            Arc::clone(&ties.wires),
        );
        ties.spawn("wires", move || carry_edges(edges, &on, &wires, &cut))?;
        Ok(ties)
    }

    /// Lets a camera's wire carry pulses as well as this.
    pub(crate) fn wire(&self, camera: CameraId, wire: Wire) {
        self.wires[camera.index()].store(wire as u8, Ordering::Relaxed);
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        let thread = thread::Builder::new().name(name.to_owned()).spawn(work)?;
        self.threads.push(thread);
        Ok(())
    }
}

impl Drop for Ties {
    fn drop(&mut self) {
        self.cut.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so itself.
            let _ = thread.join();
        }
    }
}

/// Tells the cameras where the tip is. They never look further than it has been told.
fn show_tip(arm: &ArmView, bus: &Bus, cut: &AtomicBool) {
    let world = bus.world();
    let source = world.source();
    while !cut.load(Ordering::Relaxed) {
        // A dead firmware shows nothing more; the run under test finds that out by itself.
        let Ok(state) = arm.state() else { break };
        let at_ns = i64::try_from(state.t_ns).unwrap_or(i64::MAX);
        world.tip(Tip {
            at_ns,
            position_mm: state.position_m.map(|m| m * 1e3),
        });
        world.announce(source, at_ns);
        thread::sleep(LOOK_EVERY);
    }
    world.leave(source);
}

/// Carries the box's pulses to the cameras' inputs. A board on a busy machine lags; the cameras wait for it.
fn carry_edges(mut edges: EdgeStream, bus: &Bus, wires: &[AtomicU8; 2], cut: &AtomicBool) {
    let world = bus.world();
    let source = world.source();
    let clock = edges.clock();
    let mut pulses = [0_u32; 2];
    while !cut.load(Ordering::Relaxed) {
        match edges.told(PATIENCE) {
            Ok(Some(Told::Edge(edge))) => {
                let n = match edge.pin {
                    CAMERA_1 => 0,
                    CAMERA_2 => 1,
                    _ => continue,
                };
                pulses[n] = pulses[n].wrapping_add(u32::from(edge.high));
                let wire = wires[n].load(Ordering::Relaxed);
                let leaks = wire == Wire::Leaky as u8 && pulses[n].is_multiple_of(LEAKS_EVERY);
                if leaks || wire == Wire::Cut as u8 {
                    continue;
                }
                let edge = Edge {
                    channel: TRIGGER_INPUT,
                    rising: edge.high,
                    at_ns: clock.host_ns(edge.cycle),
                };
                world.edge(CAMERA_SERIALS[n], edge);
            }
            Ok(Some(Told::At(cycle))) => world.announce(source, clock.host_ns(cycle)),
            Ok(None) => {}
            Err(_) => break,
        }
    }
    world.leave(source);
}
