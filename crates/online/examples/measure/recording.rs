//! A session in memory: events per slot and region, thinned on request.

use skinrig_analysis::result::ClockFit;
use skinrig_model::{CameraId, CdEvent, Polarity};
use skinrig_online::{SLOT_US, interleave};
use skinrig_results::SessionEvents;

pub(crate) const REGIONS: usize = 2 * 40 * 20 * 2;

/// True for one event in `factor`, by its content.
pub(crate) fn keeps(factor: u64, camera: CameraId, e: &CdEvent) -> bool {
    let place = u64::from(e.x) << 40 ^ u64::from(e.y) << 52 ^ (camera.index() as u64) << 63;
    let mut z = (e.t_us ^ place).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)).is_multiple_of(factor)
}

/// Regions of the events of each slot, in order.
pub(crate) struct Recording {
    first: i64,
    starts: Vec<u32>,
    regions: Vec<u16>,
}

impl Recording {
    pub(crate) fn read(events: &SessionEvents, clocks: &[ClockFit; 2], factor: u64) -> Self {
        let mut all: Vec<(i64, u16)> = Vec::new();
        let read = interleave(events, clocks, |camera, slice, _| {
            for e in slice.iter().filter(|e| keeps(factor, camera, e)) {
                let host_us = clocks[camera.index()].host_us_of_camera(e.t_us as f64);
                let block = usize::from(e.y / 24) * 40 + usize::from(e.x / 16);
                let region =
                    (camera.index() * 800 + block) * 2 + usize::from(e.polarity == Polarity::On);
                all.push(((host_us / SLOT_US as f64).floor() as i64, region as u16));
            }
            true
        });
        read.expect("the session is readable");
        all.sort_unstable();
        let (first, last) = (
            all.first().map_or(0, |e| e.0),
            all.last().map_or(0, |e| e.0),
        );
        let mut starts = Vec::with_capacity((last - first + 2) as usize);
        let mut at = 0;
        for slot in first..=last + 1 {
            while at < all.len() && all[at].0 < slot {
                at += 1;
            }
            starts.push(at as u32);
        }
        Self {
            first,
            starts,
            regions: all.into_iter().map(|e| e.1).collect(),
        }
    }

    pub(crate) fn slot(&self, slot: i64) -> &[u16] {
        let at = (slot - self.first) as usize;
        match (self.starts.get(at), self.starts.get(at + 1)) {
            (Some(from), Some(to)) => &self.regions[*from as usize..*to as usize],
            _ => &[],
        }
    }
}
