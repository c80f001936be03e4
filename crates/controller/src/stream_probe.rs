//! Checks of the camera streams in the preflight: whether their clocks advance, and whether the test mark arrives.

use skinrig_model::pulse::{LOOPBACK, decode_marks};
use skinrig_model::{
    CameraId, CheckKind, DeviceRole, HostDuration, PreflightCheck, RawChunk, TriggerEdge,
};

use crate::checks::Loopback;

/// Data from the cameras during the preflight.
#[derive(Debug, Default)]
pub(crate) struct StreamProbe {
    edges: [Vec<TriggerEdge>; 2],
    first_us: [Option<u64>; 2],
    last_us: [Option<u64>; 2],
}

impl StreamProbe {
    pub(crate) fn observe(&mut self, chunk: &RawChunk) {
        let i = chunk.camera.index();
        self.edges[i].extend_from_slice(&chunk.triggers);
        for t_us in [chunk.facts.first_us, chunk.facts.last_us]
            .into_iter()
            .flatten()
        {
            self.first_us[i].get_or_insert(t_us);
            self.last_us[i] = Some(t_us);
        }
    }

    /// True if the times of both cameras advance.
    pub(crate) fn all_advance(&self) -> bool {
        CameraId::ALL.into_iter().all(|c| self.advances(c))
    }

    /// True if both cameras received the loop-back mark, and no other mark, on their channels.
    pub(crate) fn all_saw_mark(&self, loopback: &Loopback) -> bool {
        CameraId::ALL
            .into_iter()
            .all(|c| self.saw_mark(c, loopback.channels[c.index()]))
    }

    /// Result of the check that the camera's clock advances `within` this time.
    pub(crate) fn clock_check(&self, camera: CameraId, within: HostDuration) -> PreflightCheck {
        let i = camera.index();
        let found = match (self.first_us[i], self.last_us[i]) {
            (Some(a), Some(b)) => format!("from {a} to {b} us"),
            _ => "no time".to_owned(),
        };
        PreflightCheck::new(
            format!("{camera}: clock"),
            format!("advancing within {}", seconds(within)),
            found,
            self.advances(camera),
            "power-cycle the camera; a slave camera needs its master's sync line",
        )
        .about(CheckKind::Clock(DeviceRole::of_camera(camera)))
    }

    /// Result of the loop-back after this many marks were sent.
    pub(crate) fn loopback_check(
        &self,
        camera: CameraId,
        loopback: &Loopback,
        marks: u32,
    ) -> PreflightCheck {
        let channel = loopback.channels[camera.index()];
        let found = self.describe(camera, channel);
        PreflightCheck::new(
            format!("{camera}: trigger loop-back"),
            format!(
                "the mark on channel {channel} within {}",
                seconds(loopback.within)
            ),
            match marks {
                1 => found,
                n => format!("{found}; {n} marks were sent"),
            },
            self.saw_mark(camera, channel),
            "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)",
        )
        .about(CheckKind::Trigger(DeviceRole::of_camera(camera)))
    }

    fn advances(&self, camera: CameraId) -> bool {
        let i = camera.index();
        matches!((self.first_us[i], self.last_us[i]), (Some(a), Some(b)) if b > a)
    }

    /// True if the loop-back mark, and no other mark, arrived on `channel`.
    fn saw_mark(&self, camera: CameraId, channel: u8) -> bool {
        let marks = decode_marks(&self.on(camera, channel)).marks;
        !marks.is_empty() && marks.iter().all(|m| m.mark == LOOPBACK)
    }

    fn on(&self, camera: CameraId, channel: u8) -> Vec<TriggerEdge> {
        let edges = self.edges[camera.index()].iter().copied();
        edges.filter(|e| e.channel == channel).collect()
    }

    /// Description of the edges on `channel` and elsewhere.
    fn describe(&self, camera: CameraId, channel: u8) -> String {
        let edges_here = self.on(camera, channel);
        let mut channels: Vec<u8> = self.edges[camera.index()]
            .iter()
            .map(|e| e.channel)
            .collect();
        channels.sort_unstable();
        channels.dedup();
        channels.retain(|c| *c != channel);
        let decoded = decode_marks(&edges_here);
        let what = match decoded.marks.as_slice() {
            [] if edges_here.is_empty() => format!("no edge on channel {channel}"),
            [] => format!(
                "no mark on channel {channel}, but {} edges: {} periodic trains, {} edges of no train",
                edges_here.len(),
                decoded.syncs.len(),
                decoded.stray_edges
            ),
            marks if marks.iter().all(|m| m.mark == LOOPBACK) => "the mark".to_owned(),
            [first, ..] => {
                let n = decoded.marks.len();
                format!(
                    "{n} marks, the first `{}` of {}",
                    first.mark.kind, first.mark.press
                )
            }
        };
        if channels.is_empty() {
            what
        } else {
            format!("{what}; edges on channel {channels:?}")
        }
    }
}

/// `2 s`, without trailing zeros.
fn seconds(t: HostDuration) -> String {
    format!("{} s", t.as_secs_f64())
}
