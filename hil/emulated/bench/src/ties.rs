//! What ties the devices together: the tip that the cameras see, and the wires from the trigger box to the cameras.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use drd::{ArmView, EmulatedArm};
use skinrig_emulated_camera::Bus;
use skinrig_emulated_camera::world::{Edge, Tip};
use skinrig_emulated_trigger_box::{CAMERA_1, CAMERA_2, EdgeStream, EmulatedBox, Told};

use crate::CAMERA_SERIALS;

/// How often the tip is looked at.
const LOOK_EVERY: Duration = Duration::from_micros(500);
/// How long the wires wait before they look whether they are still needed.
const PATIENCE: Duration = Duration::from_millis(50);
/// The cameras' input that the box is wired to: TRIG IN.
const TRIGGER_INPUT: u8 = 0;

/// The threads; they end with this value.
pub(crate) struct Ties {
    cut: Arc<AtomicBool>,
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
            threads: Vec::new(),
        };
        let (view, on, cut) = (
            ArmView::attach(arm.directory())?,
            Arc::clone(bus),
            Arc::clone(&ties.cut),
        );
        ties.spawn("tip", move || show_tip(&view, &on, &cut))?;
        let edges = EdgeStream::follow(trigger_box.socket())?;
        let (on, cut) = (Arc::clone(bus), Arc::clone(&ties.cut));
        ties.spawn("wires", move || carry_edges(edges, &on, &cut))?;
        Ok(ties)
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
fn carry_edges(mut edges: EdgeStream, bus: &Bus, cut: &AtomicBool) {
    let world = bus.world();
    let source = world.source();
    let clock = edges.clock();
    while !cut.load(Ordering::Relaxed) {
        match edges.told(PATIENCE) {
            Ok(Some(Told::Edge(edge))) => {
                let camera = match edge.pin {
                    CAMERA_1 => CAMERA_SERIALS[0],
                    CAMERA_2 => CAMERA_SERIALS[1],
                    _ => continue,
                };
                let edge = Edge {
                    channel: TRIGGER_INPUT,
                    rising: edge.high,
                    at_ns: clock.host_ns(edge.cycle),
                };
                world.edge(camera, edge);
            }
            Ok(Some(Told::At(cycle))) => world.announce(source, clock.host_ns(cycle)),
            Ok(None) => {}
            Err(_) => break,
        }
    }
    world.leave(source);
}
