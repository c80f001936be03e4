//! Law: the streams cover all presses: they start before the first, end after the last, and have no gaps.

use skinrig_model::{CameraId, HostTime};

use super::finding::finding;
use crate::input::SessionInput;
use crate::result::{Analysis, Evidence, Fault, Finding, Law, Silence};
use crate::stream::Silences;

/// Presses during silences, on the camera's clock.
struct MissedPresses {
    presses: usize,
    silences: Vec<Silence>,
}

pub(super) fn findings(
    input: &SessionInput,
    analysis: &Analysis,
    silences: [&Silences; 2],
) -> Vec<Finding> {
    let ends = CameraId::ALL.map(|camera| {
        let own = silences[camera.index()];
        lost(input, analysis, camera, &[own.before, own.after])
    });
    let gaps = CameraId::ALL.map(|camera| {
        let between: Vec<_> = silences[camera.index()]
            .between
            .iter()
            .map(|s| Some(*s))
            .collect();
        lost(input, analysis, camera, &between)
    });
    let mut found = Vec::new();
    // Both streams end together: the recording ended, and the presses are not in it.
    found.extend(findings_for(
        ends,
        Fault::RecordingShort,
        Fault::PressesMissing,
    ));
    found.extend(findings_for(gaps, Fault::RecordingGap, Fault::RecordingGap));
    found
}

fn findings_for(lost: [Option<MissedPresses>; 2], alone: Fault, both: Fault) -> Vec<Finding> {
    let say = |fault, camera, lost: &MissedPresses| {
        let evidence = Evidence::Silence {
            silences: lost.silences.clone(),
            presses: lost.presses,
        };
        finding(Law::Complete, fault, camera, evidence)
    };
    match &lost {
        [Some(one), Some(two)] => {
            let more = if two.presses > one.presses { two } else { one };
            vec![say(both, None, more)]
        }
        each => CameraId::ALL
            .into_iter()
            .zip(each)
            .filter_map(|(camera, lost)| Some(say(alone, Some(camera), lost.as_ref()?)))
            .collect(),
    }
}

/// Presses of the list during these silences, if any.
fn lost(
    input: &SessionInput,
    analysis: &Analysis,
    camera: CameraId,
    silences: &[Option<(u64, u64)>],
) -> Option<MissedPresses> {
    let clock = analysis.clocks[camera.index()]?;
    let camera_us = |t: HostTime| clock.camera_us_of_host(t);
    let timings: Vec<_> = input
        .outcomes
        .iter()
        .flatten()
        .filter_map(|o| o.timing)
        .collect();
    let (mut presses, mut silent) = (0, Vec::new());
    for (from, to) in silences.iter().flatten() {
        let (from, to) = (*from as f64, *to as f64);
        let inside = timings
            .iter()
            .filter(|t| camera_us(t.release) > from && camera_us(t.contact) < to);
        let n = inside.count();
        if n > 0 {
            presses += n;
            let host_s = |us: f64| clock.host_us_of_camera(us) * 1e-6;
            let is_to_end = from != 0.0 && to >= u64::MAX as f64;
            silent.push(Silence {
                from_s: (from != 0.0).then(|| host_s(from)),
                to_s: (!is_to_end).then(|| host_s(to)),
            });
        }
    }
    (presses > 0).then_some(MissedPresses {
        presses,
        silences: silent,
    })
}
