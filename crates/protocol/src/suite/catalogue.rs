//! All checks: parameters, metrics and units.

use std::path::PathBuf;

use skinrig_model::{HostDuration, Limit};
use skinrig_settings::{Collector, Field, Setting, Settings, Shape};

use super::check::{Check, Light, Measure, Metric};
use super::limits::{
    Count, DataRate, Drift, EventRate, Force, Height, Length, Loss, Offset, Ratio, Share, Space,
    Time, WriteRate,
};

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
                /// Reason to skip the check for now. It is reported as SKIPPED, and its limits stay in the file.
                #[setting(shape = Shape::Text, read = super::check::skip_reason)]
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
        /// Differences from the rig file, per device.
        differences: Count,
    }

    /// Biases, region and inputs of the cameras, written as for a run and read back.
    CheckSettings: settings = "settings read back" => Settings {} {
        /// Settings that read back a different value, per camera.
        differences: Count,
    }

    /// Writes a file to the session folder, flushes it, reads it back and deletes it.
    CheckDisk: disk = "disk" => Disk {
        /// Amount of data written.
        #[setting(default = "200 MB", min = 1e6, max = 1e11)]
        amount_b: f64,
    } {
        /// Bytes per second, including the final flush.
        write_rate: WriteRate,
        /// Free space.
        free: Space,
    }

    /// Coded trains from the trigger box, seen by both cameras.
    CheckTriggerLoopback: trigger_loopback = "trigger loopback" => TriggerLoopback {
        /// Number of trains sent.
        #[setting(default = "20", min = 5, max = 10_000)]
        trains: u32,
    } {
        /// Pulses sent but not received, per camera.
        lost_pulses: Count,
        /// Edges received but not sent, per camera.
        extra_pulses: Count,
        /// Trains decoded wrongly, per camera.
        unread_trains: Count,
        /// Standard deviation of the edges' times about the trains' own, per camera.
        jitter: Time,
    }

    /// The cameras' clocks against the trigger box's.
    CheckClocks: clocks = "camera clocks" => Clocks {
        /// Duration of the measurement.
        #[setting(default = "10 s", above = 0, max = 3600)]
        duration: HostDuration,
    } {
        /// Rate relative to the trigger box's clock, per camera.
        drift: Drift,
        /// Root mean square of the trains' distances from a straight line, per camera.
        residual: Time,
        /// Time of camera 1 minus that of camera 2 at the same pulse: the offset of their starts.
        offset: Offset,
    }

    /// Data rate and loss with nothing moving.
    CheckIdle: idle = "stream at rest" => Idle {
        /// Duration of the measurement.
        #[setting(default = "5 s", above = 0, max = 3600)]
        duration: HostDuration,
    } {
        /// Bytes per second, per camera.
        data_rate: DataRate,
        /// Bytes known to be lost, per camera.
        lost: Loss,
        /// Gaps in the stream, per camera.
        gaps: Count,
    }

    /// Noise floor and hot pixels with the lamps off.
    CheckNoiseDark: noise_dark = "noise in the dark" => Noise[light: Light::Dark] {
        /// Duration of the measurement.
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
        /// Duration of the measurement.
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
        /// Duration of the measurement.
        #[setting(default = "3 s", above = 0, max = 3600)]
        duration: HostDuration,
        /// Event rate that the pattern is set to.
        #[setting(default = "1 Mev/s", above = 0, max = 5e7)]
        rate_ev_s: f64,
    } {
        /// Share of the pattern's events received, per camera.
        received: Ratio,
        /// Bytes known to be lost, per camera.
        lost: Loss,
        /// Gaps in the stream, per camera.
        gaps: Count,
    }

    /// Whether the robot is initialised, accepts its limits, powers up and holds its position.
    CheckRobotState: robot_state = "robot state" => RobotState {} {
        /// Faults of the robot: not initialised, limits read back differently, motors do not start.
        faults: Count,
        /// How far the tip moves within a second of holding still.
        creep: Length,
    }

    /// Approaches five points in free air repeatedly from different sides.
    CheckRepeatability: repeatability = "robot repeatability" => Repeatability {
        /// Approaches of each point.
        #[setting(default = "5", min = 2, max = 100)]
        approaches: u32,
        /// Speed of the approaches.
        #[setting(default = "40 mm/s", above = 0, max = 100)]
        speed_mm_s: f64,
    } {
        /// Standard deviation of the tip position about each point's mean, over all points.
        spread: Length,
        /// Mean distance of the tip from its target.
        error: Length,
    }

    /// Moves in free air.
    CheckStepResponse: step_response = "robot step response" => StepResponse {
        /// Length of a move; far beyond the 0.1 mm within which it has settled.
        #[setting(default = "5 mm", min = 1, max = 50)]
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

    /// Presses near the touch-off points: height of contact and depth.
    CheckDepth: depth = "depth against touch-off" => Depth {
        /// Depth of the presses.
        #[setting(default = "1 mm", above = 0, max = 10)]
        depth_mm: f64,
        /// Presses at each point.
        #[setting(default = "3", min = 1, max = 100)]
        presses: u32,
    } {
        /// Mean height of the touches above the frame's surface; negative: below.
        height: Height,
        /// Largest difference between two touches.
        spread: Length,
        /// Root mean square of measured minus commanded depth.
        error: Length,
    }

    /// Commands the tip deeper into the skin than its force limit allows.
    CheckForceCeiling: force_ceiling = "commanded-force ceiling" => ForceCeiling {
        /// The force limit that is set.
        #[setting(default = "1 N", above = 0, max = 12)]
        force_n: f64,
        /// Commanded depth.
        #[setting(default = "2 mm", above = 0, max = 10)]
        depth_mm: f64,
    } {
        /// Largest reported force.
        peak: Force,
        /// Power-offs by the limit, per press: 0 if the limit only bounds the force.
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
        /// Mean standard deviation between repetitions of a location.
        repeat_std: Length,
        /// Median time from contact to detection.
        latency: Time,
        /// Events per second during presses, both cameras together.
        press_events: EventRate,
        /// Events per second between presses, both cameras together.
        idle_events: EventRate,
        /// Share of planned presses that were located.
        located: Share,
        /// Share of planned presses recorded without a fault.
        valid: Share,
        /// Shift of the reference presses' estimates from start to end.
        reference_shift: Length,
        /// Events of the reference presses at the end, relative to the start.
        reference_events: Ratio,
        /// Bytes known to be lost, both cameras together.
        lost: Loss,
    }

    /// A short campaign that feels its presses while it records.
    CheckReaction: reaction = "touch felt while recording" => Reaction {
        /// Its protocol, with `online`, relative to this file.
        #[setting(example = "reaction.yaml")]
        protocol: PathBuf,
    } {
        /// Share of the scored presses that were felt.
        felt: Share,
        /// Median time from measured contact to the run knowing of it.
        delay: Time,
        /// Median time from measured contact to the new set point of a press that reacts (`react`).
        reaction: Time,
        /// Touches felt between presses.
        false_alarms: Count,
        /// Times at which bytes were skipped because the estimator could not keep up.
        skipped: Count,
        /// Positions of the session replayed as a live source that differ from its analysis in any bit.
        differences: Count,
    }

    /// Kills the program that holds the arm in free air; the arm must brake without it.
    CheckWatchdogDrill: watchdog_drill = "watchdog drill" => WatchdogDrill {} {
        /// Time from the kill until the motors are known to be off.
        braked_within: Time,
        /// Motion of the tip until it was measured again.
        drop: Length,
    }

    /// Stops the arm in the middle of a move in free air.
    CheckStopDrill: stop_drill = "emergency stop drill" => StopDrill {} {
        /// Time from the command until the tip rests.
        stopped_within: Time,
        /// Motion of the tip meanwhile.
        distance: Length,
    }
}
