//! The checks there are: what each needs to know, what it measures and in which unit.

use std::path::PathBuf;

use skinrig_model::{HostDuration, Limit};
use skinrig_settings::{Collector, Field, Setting, Settings, Shape};

use super::check::{Check, Light, Measure, Metric};
use super::limits::{Count, Data, DataRate, Drift, EventRate, Force, Length, Share, Time};

/// Each check: documentation, file form, key, title, what it measures with which parameters, and its metrics with their limits.
/// A parameter has the name of the field in [`Measure`]. Suites run the checks in this order.
macro_rules! checks {
    ($(
        #[doc = $doc:literal]
        $keys:ident: $check:ident = $title:literal => $measure:ident$([$constant:ident: $value:expr])? {
            $($(#[$attribute:meta])+ $parameter:ident: $type:ident,)*
        } {
            $(#[doc = $what:literal] $metric:ident: $limit:ident,)+
        }
    )+) => {
        $(
            #[doc = $doc]
            #[derive(Settings)]
            struct $keys {
                $($(#[$attribute])+ $parameter: $type,)*
                $(
                    #[doc = $what]
                    #[setting(
                        shape = $limit::SHAPE,
                        read = $limit::read,
                        at_least_one,
                        example = $limit::EXAMPLE
                    )]
                    $metric: Option<Limit>,
                )+
                /// Why the check does not run for now. It is SKIPPED with this reason, and its limits stay in the file.
                skip: Option<String>,
            }

            impl $keys {
                const METRICS: &[Metric] = &[$(Metric {
                    name: stringify!($metric),
                    title: $what.trim_ascii(),
                    unit: $limit::UNIT,
                }),+];

                fn check(self) -> Check {
                    let limits = [$((stringify!($metric), self.$metric)),+];
                    let stated = limits.into_iter().filter_map(|(name, limit)| Some((name, limit?)));
                    Check {
                        name: stringify!($check),
                        title: $title,
                        limits: stated.collect(),
                        measure: Measure::$measure {
                            $($constant: $value,)?
                            $($parameter: self.$parameter,)*
                        },
                        skip: self.skip,
                        metrics: Self::METRICS,
                    }
                }
            }
        )+

        /// The checks of a suite. They run in the order of this list, whatever the order in the file.
        #[derive(Settings)]
        #[settings(name = "checks")]
        struct ChecksKeys {
            $(
                #[doc = $doc]
                #[setting(at_least_one)]
                $check: Option<$keys>,
            )+
        }

        /// The mapping of [`checks`].
        pub(super) const CHECKS: Shape = ChecksKeys::SHAPE;

        /// The checks of a suite, in the order in which they run.
        pub(super) fn checks(f: &Field, out: &mut Collector) -> Option<Vec<Check>> {
            let keys = ChecksKeys::from_mapping(f, out)?;
            let checks = [$(keys.$check.map($keys::check)),+];
            Some(checks.into_iter().flatten().collect())
        }
    };
}

checks! {
    /// Model, serial number and firmware of every device, as the rig file expects them.
    CheckIdentity: identity = "identity and firmware" => Identity {} {
        /// Answers that differ from the rig file's, per device.
        differences: Count,
    }

    /// Biases, region and inputs of the cameras, written as for a run and read back.
    CheckSettings: settings = "settings read back" => Settings {} {
        /// Settings that read back with another value, per camera.
        differences: Count,
    }

    /// A file is written where sessions go, synchronised, read back and removed.
    CheckDisk: disk = "disk" => Disk {
        /// Amount of data written.
        #[setting(default = "200 MB", min = 1e6, max = 1e11)]
        amount_b: f64,
    } {
        /// Bytes per second, the last synchronisation included.
        write_rate: DataRate,
        /// Free space.
        free: Data,
    }

    /// Coded trains from the trigger box, seen by both cameras.
    CheckTriggerLoopback: trigger_loopback = "trigger loopback" => TriggerLoopback {
        /// Number of trains sent.
        #[setting(default = "20", min = 1, max = 10_000)]
        trains: u32,
    } {
        /// Pulses sent and not seen, per camera.
        lost_pulses: Count,
        /// Edges seen that nobody sent, per camera.
        extra_pulses: Count,
        /// Trains that do not read back under their own name, per camera.
        unread_trains: Count,
        /// Standard deviation of the edges' times about the trains' own, per camera.
        jitter: Time,
    }

    /// The cameras' clocks against the trigger box's.
    CheckClocks: clocks = "camera clocks" => Clocks {
        /// How long the check measures.
        #[setting(default = "10 s", above = 0, max = 3600)]
        duration: HostDuration,
    } {
        /// How much faster than the trigger box's, per camera.
        drift: Drift,
        /// Root mean square of the trains' distances from a straight line, per camera.
        residual: Time,
        /// Time of camera 1 minus that of camera 2 at one and the same pulse: how far apart they started.
        offset: Time,
    }

    /// Data rate and loss with nothing moving.
    CheckIdle: idle = "stream at rest" => Idle {
        /// How long the check measures.
        #[setting(default = "5 s", above = 0, max = 3600)]
        duration: HostDuration,
    } {
        /// Bytes per second, per camera.
        data_rate: DataRate,
        /// Bytes known to be lost, per camera.
        lost: Data,
        /// Gaps in the stream, per camera.
        gaps: Count,
    }

    /// Noise floor and hot pixels with the lamps off.
    CheckNoiseDark: noise_dark = "noise in the dark" => Noise[light: Light::Dark] {
        /// How long the check measures.
        #[setting(default = "5 s", above = 0, max = 3600)]
        duration: HostDuration,
        /// A pixel above this rate is hot.
        #[setting(default = "100 ev/s", above = 0, max = 1e7)]
        hot_above_ev_s: f64,
    } {
        /// Events per second of the whole sensor, per camera.
        rate: EventRate,
        /// Pixels above `hot_above`, per camera.
        hot_pixels: Count,
        /// Rate of the hottest pixel, per camera.
        hottest: EventRate,
    }

    /// Noise floor and hot pixels with the lamps on.
    CheckNoiseLit: noise_lit = "noise in the light" => Noise[light: Light::Lit] {
        /// How long the check measures.
        #[setting(default = "5 s", above = 0, max = 3600)]
        duration: HostDuration,
        /// A pixel above this rate is hot.
        #[setting(default = "100 ev/s", above = 0, max = 1e7)]
        hot_above_ev_s: f64,
    } {
        /// Events per second of the whole sensor, per camera.
        rate: EventRate,
        /// Pixels above `hot_above`, per camera.
        hot_pixels: Count,
        /// Rate of the hottest pixel, per camera.
        hottest: EventRate,
    }

    /// Data rate and loss while the cameras generate events themselves.
    CheckTestPattern: test_pattern = "built-in test pattern" => TestPattern {
        /// How long the check measures.
        #[setting(default = "3 s", above = 0, max = 3600)]
        duration: HostDuration,
        /// Event rate that the pattern is set to.
        #[setting(default = "1 Mev/s", above = 0, max = 5e7)]
        rate_ev_s: f64,
    } {
        /// Events received, of those that the pattern makes, per camera.
        received: Share,
        /// Bytes known to be lost, per camera.
        lost: Data,
        /// Gaps in the stream, per camera.
        gaps: Count,
    }

    /// Whether the robot is initialised, takes its limits, powers up and stays where it is.
    CheckRobotState: robot_state = "robot state" => RobotState {} {
        /// Faults of the robot: not initialised, limits that do not read back, motors that do not start.
        faults: Count,
        /// How far the tip moves within a second of holding still.
        creep: Length,
    }

    /// Five points in free air, approached again and again from different sides.
    CheckRepeatability: repeatability = "robot repeatability" => Repeatability {
        /// Approaches of each point.
        #[setting(default = "5", min = 2, max = 100)]
        approaches: u32,
        /// Speed of the approaches.
        #[setting(default = "40 mm/s", above = 0, max = 100)]
        speed_mm_s: f64,
    } {
        /// Standard deviation of the tip's place about each point's mean, all points together.
        spread: Length,
        /// Mean distance of the tip from where it was sent.
        error: Length,
    }

    /// Moves in free air.
    CheckStepResponse: step_response = "robot step response" => StepResponse {
        /// Length of a move.
        #[setting(default = "5 mm", above = 0, max = 50)]
        distance_mm: f64,
        /// Number of moves.
        #[setting(default = "5", min = 1, max = 100)]
        steps: u32,
    } {
        /// Median time from the end of the commanded move until the tip stays within 0.1 mm.
        settling: Time,
        /// Largest distance beyond the target.
        overshoot: Length,
        /// Largest distance from the target a second after the move.
        error: Length,
    }

    /// Presses near the points of the touch-off: where the tip touches, and how deep it goes.
    CheckDepth: depth = "depth against touch-off" => Depth {
        /// Depth of the presses.
        #[setting(default = "1 mm", above = 0, max = 10)]
        depth_mm: f64,
        /// Presses at each point.
        #[setting(default = "3", min = 1, max = 100)]
        presses: u32,
    } {
        /// Largest height of a touch above or below the frame's surface.
        surface: Length,
        /// Root mean square of measured minus commanded depth.
        error: Length,
    }

    /// The tip is sent into the skin deeper than the limit of its force allows.
    CheckForceCeiling: force_ceiling = "commanded-force ceiling" => ForceCeiling {
        /// The force limit that is set.
        #[setting(default = "1 N", above = 0, max = 12)]
        force_n: f64,
        /// Commanded depth.
        #[setting(default = "2 mm", above = 0, max = 10)]
        depth_mm: f64,
    } {
        /// Largest force that the robot reports.
        peak: Force,
        /// Times that the limit took the power off, per press: 0 when the force is only bounded.
        trips: Count,
    }

    /// A short campaign on the skin that stays on the bench, with the same presses at its start and end.
    CheckGolden: golden = "golden skin" => Golden {
        /// Its protocol, relative to this file.
        #[setting(example = "golden.yaml")]
        protocol: PathBuf,
    } {
        /// RMSE of the localisation.
        rmse: Length,
        /// Mean standard deviation between repetitions of a place.
        repeat_std: Length,
        /// Median time from contact to detection.
        latency: Time,
        /// Events per second during presses, both cameras together.
        press_events: EventRate,
        /// Events per second between presses, both cameras together.
        idle_events: EventRate,
        /// Presses that were located, of those planned.
        located: Share,
        /// Presses that were recorded without a fault, of those planned.
        valid: Share,
        /// How far the estimates of the reference presses moved from the start to the end.
        reference_shift: Length,
        /// Events of the reference presses at the end, of those at the start.
        reference_events: Share,
        /// Bytes known to be lost, both cameras together.
        lost: Data,
    }

    /// The program that holds the arm in free air is killed; the arm must brake by itself.
    CheckWatchdogDrill: watchdog_drill = "watchdog drill" => WatchdogDrill {} {
        /// From the kill until the motors are known to be off.
        braked_within: Time,
        /// How far the tip moved until it was looked at again.
        drop: Length,
    }

    /// The arm is stopped in the middle of a move in free air.
    CheckStopDrill: stop_drill = "emergency stop drill" => StopDrill {} {
        /// From the order until the tip rests.
        stopped_within: Time,
        /// How far it moved meanwhile.
        distance: Length,
    }
}
