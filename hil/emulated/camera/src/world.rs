//! Inputs of the cameras: edges on their trigger inputs, the position of the robot's tip, and light.
//!
//! Times are those of the computer's monotonic clock (`CLOCK_MONOTONIC`), ns, in every process.
//!
//! Other processes write lines to the Unix stream socket `ROOT/world`:
//!
//! ```text
//! edge SERIAL CHANNEL LEVEL T_NS     an edge at a camera's trigger input: LEVEL 1 rises, 0 falls
//! time T_NS                          later lines of this connection concern no time before T_NS
//! tip T_NS X_MM Y_MM Z_MM            position of the robot's tip in the robot frame
//! ```
//!
//! Lines of one connection must be in time order. Cameras lag behind the current time by `LATENCY_NS`, so that an edge finds its place in
//! the stream. A process that may lag further, such as a simulated microcontroller on a busy computer, writes `time` at least once per
//! millisecond of its own time: cameras then never pass the announced time, and its edges keep their exact places. An unreadable line
//! gets the reply `error: ...` and ends the connection.
//!
//! The lamps are off while a file `ROOT/lamps-off` exists: `touch` switches them off, `rm -f` on. They affect all cameras, from the next
//! packet on.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// The lamps are off while a file with this name exists in the bus's folder.
const LAMPS_OFF: &str = "lamps-off";

/// Minimum lag of cameras behind the current time, ns.
pub(crate) const LATENCY_NS: i64 = 2_000_000;

/// How long tip positions are kept, ns: as long as a camera may lag behind a slow source. A camera
/// without the positions of a press would send only noise.
const REMEMBERED_NS: i64 = 60_000_000_000;

/// How long unread edges are kept, ns.
const EDGES_REMEMBERED_NS: i64 = 60_000_000_000;

/// An edge at a trigger input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// The input: 0 is TRIG IN, 6 the loop-back of the trigger output, 7 the auxiliary input.
    pub channel: u8,
    /// Whether it is a rising edge.
    pub rising: bool,
    /// Time on the monotonic clock, ns.
    pub at_ns: i64,
}

/// A tip position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Time on the monotonic clock, ns.
    pub at_ns: i64,
    /// Robot frame, mm.
    pub position_mm: [f64; 3],
}

#[derive(Debug, Default)]
struct State {
    edges: BTreeMap<String, VecDeque<Edge>>,
    tips: VecDeque<Tip>,
    /// By connection: time up to which it has announced.
    announced: BTreeMap<u64, i64>,
    next_source: u64,
    closed: bool,
}

/// Inputs of the cameras of one bus.
#[derive(Debug, Default)]
pub struct World {
    state: Mutex<State>,
    changed: Condvar,
    lamps_off: PathBuf,
}

/// Current time of the monotonic clock, ns.
#[must_use]
pub fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

impl World {
    /// Inputs for the bus in this folder.
    pub(crate) fn around(root: &Path) -> Self {
        Self {
            lamps_off: root.join(LAMPS_OFF),
            ..Self::default()
        }
    }

    /// The file that switches the lamps off.
    #[must_use]
    pub fn lamps_off(&self) -> &Path {
        &self.lamps_off
    }

    /// Whether the lamps are on.
    pub(crate) fn is_lit(&self) -> bool {
        !self.lamps_off.exists()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an edge at the trigger input of the camera with this serial number.
    pub fn edge(&self, serial: &str, edge: Edge) {
        let mut state = self.lock();
        let edges = state.edges.entry(serial.to_owned()).or_default();
        edges.push_back(edge);
        // A camera that is not running reads none.
        while edges
            .front()
            .is_some_and(|e| e.at_ns < edge.at_ns - EDGES_REMEMBERED_NS)
        {
            edges.pop_front();
        }
    }

    /// Sets the tip position.
    pub fn tip(&self, tip: Tip) {
        let mut state = self.lock();
        state.tips.push_back(tip);
        while state
            .tips
            .front()
            .is_some_and(|t| t.at_ns < tip.at_ns - REMEMBERED_NS)
        {
            state.tips.pop_front();
        }
    }

    /// Adds a source of edges that announces its own time; see [`World::announce`].
    pub fn source(&self) -> u64 {
        let mut state = self.lock();
        state.next_source += 1;
        state.next_source
    }

    /// Announces that `source` will send nothing from before `t_ns`.
    pub fn announce(&self, source: u64, t_ns: i64) {
        self.lock().announced.insert(source, t_ns);
        self.changed.notify_all();
    }

    /// Removes `source`.
    pub fn leave(&self, source: u64) {
        self.lock().announced.remove(&source);
        self.changed.notify_all();
    }

    /// Waits until all inputs before `t_ns` are known, at most for `timeout`.
    pub(crate) fn wait_until(&self, t_ns: i64, timeout: Duration) -> bool {
        let state = self.lock();
        let ahead_ns = t_ns - state.horizon();
        if ahead_ns <= 0 {
            return true;
        }
        let nap = Duration::from_nanos(ahead_ns as u64).min(timeout);
        let (state, _) = self
            .changed
            .wait_timeout(state, nap)
            .unwrap_or_else(PoisonError::into_inner);
        t_ns <= state.horizon()
    }

    /// Edges of a camera before `until_ns`.
    pub(crate) fn take_edges(&self, serial: &str, until_ns: i64) -> Vec<Edge> {
        let mut state = self.lock();
        let Some(edges) = state.edges.get_mut(serial) else {
            return Vec::new();
        };
        let (due, later): (Vec<Edge>, Vec<Edge>) =
            edges.drain(..).partition(|e| e.at_ns < until_ns);
        edges.extend(later);
        due
    }

    /// Tip position at `t_ns`, interpolated linearly between reports and constant before the first and after the last. `None` without a
    /// report.
    pub(crate) fn tip_at(&self, t_ns: i64) -> Option<[f64; 3]> {
        let state = self.lock();
        let after = state.tips.partition_point(|t| t.at_ns <= t_ns);
        match (
            after.checked_sub(1).and_then(|n| state.tips.get(n)),
            state.tips.get(after),
        ) {
            (Some(a), Some(b)) => {
                let share = (t_ns - a.at_ns) as f64 / (b.at_ns - a.at_ns) as f64;
                Some(std::array::from_fn(|k| {
                    a.position_mm[k] + share * (b.position_mm[k] - a.position_mm[k])
                }))
            }
            (Some(only), None) | (None, Some(only)) => Some(only.position_mm),
            (None, None) => None,
        }
    }

    /// Reads the lines of other processes from `listener`.
    pub(crate) fn listen(self: &Arc<Self>, listener: UnixListener) -> std::io::Result<()> {
        let world = Arc::clone(self);
        thread::Builder::new()
            .name("world".into())
            .spawn(move || {
                while let Ok((stream, _)) = listener.accept() {
                    if world.lock().closed {
                        return;
                    }
                    let world = Arc::clone(&world);
                    let reader = move || world.read(stream);
                    if thread::Builder::new()
                        .name("world line".into())
                        .spawn(reader)
                        .is_err()
                    {
                        return;
                    }
                }
            })
            .map(drop)
    }

    fn read(&self, mut stream: UnixStream) {
        let source = self.source();
        if let Ok(reading) = stream.try_clone() {
            for line in BufReader::new(reading).lines().map_while(Result::ok) {
                if let Err(what) = self.execute(source, &line) {
                    let _ = writeln!(stream, "error: {what}");
                    break;
                }
            }
        }
        self.leave(source);
    }

    fn execute(&self, source: u64, line: &str) -> Result<(), LineError> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let number = |word: &str| -> Result<i64, LineError> {
            word.parse().map_err(|_| LineError::Number {
                word: word.to_owned(),
                line: line.to_owned(),
            })
        };
        match words[..] {
            ["edge", serial, channel, level, at] => {
                let channel = u8::try_from(number(channel)?).ok().filter(|c| *c < 8);
                let rising = match level {
                    "0" => Some(false),
                    "1" => Some(true),
                    _ => None,
                };
                let (Some(channel), Some(rising)) = (channel, rising) else {
                    return Err(LineError::Edge {
                        line: line.to_owned(),
                    });
                };
                let at_ns = number(at)?;
                self.edge(
                    serial,
                    Edge {
                        channel,
                        rising,
                        at_ns,
                    },
                );
                Ok(())
            }
            ["time", at] => {
                self.announce(source, number(at)?);
                Ok(())
            }
            ["tip", at, x, y, z] => {
                let mut position_mm = [0.0; 3];
                for (to, word) in position_mm.iter_mut().zip([x, y, z]) {
                    *to = word
                        .parse()
                        .ok()
                        .filter(|v: &f64| v.is_finite())
                        .ok_or_else(|| LineError::Position {
                            word: word.to_owned(),
                            line: line.to_owned(),
                        })?;
                }
                self.tip(Tip {
                    at_ns: number(at)?,
                    position_mm,
                });
                Ok(())
            }
            _ => Err(LineError::Word {
                line: line.to_owned(),
            }),
        }
    }

    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }
}

/// Why a line of another process was rejected.
#[derive(Debug, thiserror::Error)]
enum LineError {
    #[error("expected a whole number, found `{word}` in `{line}`")]
    Number { word: String, line: String },
    #[error("expected a channel in 0..8 and a level 0 or 1, found `{line}`")]
    Edge { line: String },
    #[error("expected mm, found `{word}` in `{line}`")]
    Position { word: String, line: String },
    #[error(
        "expected `edge SERIAL CHANNEL LEVEL T_NS`, `time T_NS` or `tip T_NS X Y Z`, found `{line}`"
    )]
    Word { line: String },
}

impl State {
    /// Time up to which all inputs are known.
    fn horizon(&self) -> i64 {
        let present = now_ns() - LATENCY_NS;
        self.announced.values().fold(present, |a, b| a.min(*b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_executed_or_refused_with_the_expected_form() {
        let world = World::default();
        world.execute(1, "edge 00001621 0 1 1000").unwrap();
        world.execute(1, "edge 00001621 0 0 2000").unwrap();
        world.execute(1, "edge 00001622 7 1 1500").unwrap();
        world.execute(1, "tip 1000 0 0 4").unwrap();
        world.execute(1, "tip 2000 1 -2 5").unwrap();
        let first = Edge {
            channel: 0,
            rising: true,
            at_ns: 1000,
        };
        assert_eq!(world.take_edges("00001621", 2000), [first]);
        assert_eq!(world.take_edges("00001621", 2001).len(), 1);
        assert_eq!(world.tip_at(500), Some([0.0, 0.0, 4.0]));
        assert_eq!(world.tip_at(1500), Some([0.5, -1.0, 4.5]));
        assert_eq!(world.tip_at(9000), Some([1.0, -2.0, 5.0]));
        for bad in [
            "",
            "edge 00001621 9 1 1000",
            "edge 00001621 0 2 1000",
            "time soon",
            "tip 1 nan 0 0",
            "jump 1",
        ] {
            let output = world.execute(1, bad).unwrap_err().to_string();
            assert!(
                output.contains("expected") && output.contains(bad),
                "{output}"
            );
        }
    }

    #[test]
    fn a_camera_that_waited_long_for_a_late_source_still_finds_the_tip() {
        let world = World::default();
        let late = 10_000_000_000;
        for (at_ns, z_mm) in [(0, -1.0), (1_000_000_000, 5.0), (late, 5.0)] {
            let position_mm = [0.0, 0.0, z_mm];
            world.tip(Tip { at_ns, position_mm });
        }
        assert_eq!(world.tip_at(0), Some([0.0, 0.0, -1.0]));
    }

    #[test]
    fn cameras_wait_for_sources_that_announce_times() {
        let world = World::default();
        let long_ago = now_ns() - 1_000_000_000;
        assert!(world.wait_until(long_ago, Duration::ZERO));
        world.announce(1, long_ago - 1);
        assert!(!world.wait_until(long_ago, Duration::ZERO));
        world.announce(1, long_ago);
        assert!(world.wait_until(long_ago, Duration::ZERO));
        world.announce(2, 0);
        assert!(!world.wait_until(long_ago, Duration::ZERO));
        world.leave(2);
        assert!(world.wait_until(long_ago, Duration::ZERO));
    }
}
