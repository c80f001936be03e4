//! Event counts of one camera around the calibration presses: on the idle skin, at the start of presses, during and after
//! them.

use skinrig_analysis::{EventSource, EventSourceError};
use skinrig_model::CameraId;

use crate::clock::SLOT_US;
use crate::model::{TAIL_BIN, TAIL_BINS};
use crate::regions::{REGIONS, below, region, shifted};
use crate::training::{Training, TrainingPress};

/// Events after which the idle rate of a region is as much its own as that of the blocks around it.
const PRIOR_EVENTS: f64 = 2.0;

/// Events of one press in one camera.
#[derive(Debug, Clone)]
pub(crate) struct PressCounts {
    /// Time after the contact, host µs, and region, until the tip is at its depth.
    pub begin: Vec<(f64, u16)>,
    /// From contact to release.
    pub pressed: Vec<u32>,
    /// Bin after the release and region.
    pub tail: Vec<(u8, u16)>,
}

/// Counts of one camera.
#[derive(Debug, Clone)]
pub(crate) struct CameraCounts {
    idle: Vec<u64>,
    idle_slots: f64,
    pub presses: Vec<PressCounts>,
}

impl CameraCounts {
    /// Expected idle events per slot of a region: its own, with those of its neighbours as a gamma distribution before them.
    pub(crate) fn idle_rate(&self, region: usize) -> f64 {
        let mut near = (0.5, 0.0);
        for rows in -1..=1 {
            for columns in -1..=1 {
                let neighbour = below(region, rows).and_then(|r| shifted(r, columns));
                if let Some(r) = neighbour {
                    near = (near.0 + self.idle[r] as f64, near.1 + 1.0);
                }
            }
        }
        let expected = PRIOR_EVENTS / (near.0 / near.1);
        (self.idle[region] as f64 + PRIOR_EVENTS) / (self.idle_slots * (1.0 + expected))
    }

    pub(crate) fn collect(
        training: &Training,
        camera: CameraId,
        source: &dyn EventSource,
    ) -> Result<Self, EventSourceError> {
        let clock = &training.clocks[camera.index()];
        let idle = training.presses.iter().filter_map(TrainingPress::idle_us);
        let empty = PressCounts {
            begin: Vec::new(),
            pressed: vec![0; REGIONS],
            tail: Vec::new(),
        };
        let mut counts = Self {
            idle: vec![0; REGIONS],
            idle_slots: idle.map(|(from, to)| to - from).sum::<f64>() / SLOT_US as f64,
            presses: vec![empty; training.presses.len()],
        };
        let mut at = 0;
        source.for_each_slice(camera, &mut |events| {
            for event in events {
                let Some(region) = region(event) else {
                    continue;
                };
                let host_us = clock.host_us_of_camera(event.t_us as f64);
                while training
                    .presses
                    .get(at + 1)
                    .is_some_and(|p| p.contact_us <= host_us)
                {
                    at += 1;
                }
                counts.add(&training.presses[at], at, host_us, region);
            }
        })?;
        Ok(counts)
    }

    fn add(&mut self, press: &TrainingPress, at: usize, host_us: f64, region: usize) {
        let after_us = host_us - press.contact_us;
        if after_us < 0.0 {
            return;
        }
        let own = &mut self.presses[at];
        if host_us < press.at_depth_us {
            own.begin.push((after_us, region as u16));
        }
        if host_us < press.release_us {
            own.pressed[region] += 1;
        }
        let Some((from, to)) = press
            .gap_us()
            .filter(|gap| (gap.0..gap.1).contains(&host_us))
        else {
            return;
        };
        let bin = (host_us - from) / (f64::from(TAIL_BIN) * SLOT_US as f64);
        if bin < TAIL_BINS as f64 {
            own.tail.push((bin as u8, region as u16));
        }
        if press.idle_us().is_some_and(|idle| host_us >= idle.0) && host_us < to {
            self.idle[region] += 1;
        }
    }
}
