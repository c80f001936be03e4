//! What ended a run, as evidence. A run tells in words what ended it: device and serial, expected, found.

use skinrig_nightly::{Evidence, EvidenceKind};

/// Words that a message begins with or holds, and what it then is.
const SIGNS: &[(&str, EvidenceKind)] = &[
    ("recorder:", EvidenceKind::Disk),
    ("No space left", EvidenceKind::Disk),
    ("disk full", EvidenceKind::Disk),
    ("preflight: 1 check failed: disk:", EvidenceKind::Disk),
    ("loop: expected", EvidenceKind::HostLate),
    ("nobody looked at the live arm", EvidenceKind::HostLate),
    ("after writing, found", EvidenceKind::ReadBack),
    (": lost:", EvidenceKind::DeviceLost),
    ("pose stream:", EvidenceKind::DeviceLost),
    (": refused:", EvidenceKind::Refused),
    ("motion refused", EvidenceKind::Refused),
    ("force: expected", EvidenceKind::Trip),
    ("depth: expected", EvidenceKind::Trip),
    ("speed: expected", EvidenceKind::Trip),
    ("operator:", EvidenceKind::TimeOut),
    ("internal error", EvidenceKind::Software),
];

/// The evidence that `why` is.
#[must_use]
pub fn of(why: &str) -> Evidence {
    let sign = SIGNS.iter().find(|(words, _)| why.contains(words));
    // Everything else is about a device's state: a surface that is not there, a failed check before the run.
    let kind = sign.map_or(EvidenceKind::State, |(_, kind)| *kind);
    Evidence::new(kind, subject(why, kind), why)
}

fn subject(why: &str, kind: EvidenceKind) -> &'static str {
    match kind {
        EvidenceKind::Disk | EvidenceKind::HostLate | EvidenceKind::Software => return "computer",
        EvidenceKind::Trip => return "robot",
        _ => {}
    }
    let named = [
        ("camera 1", "camera1"),
        ("camera 2", "camera2"),
        ("trigger box", "trigger box"),
    ];
    let named = named.iter().find(|(words, _)| why.contains(words));
    named.map_or("robot", |(_, subject)| subject)
}

#[cfg(test)]
mod tests {
    use skinrig_controller::{ControllerError, Trip};
    use skinrig_device::DeviceError;
    use skinrig_model::{DeviceRole, HostDuration, HostTime};

    use super::*;

    #[test]
    fn what_the_controller_says_is_told_apart() {
        let (role, serial) = (DeviceRole::Camera2, "00000002".to_owned());
        let lost = DeviceError::Lost {
            role,
            serial: serial.clone(),
            detail: "no answer".to_owned(),
        };
        let read_back = DeviceError::ReadBack {
            role,
            serial,
            name: "bias_fo".to_owned(),
            expected: "1".to_owned(),
            found: "2".to_owned(),
        };
        let late = Trip::Late {
            limit: HostDuration::from_millis(1),
            found: HostDuration::from_millis(2),
        };
        let force = Trip::Force {
            limit_n: 1.0,
            found_n: 2.0,
            t: HostTime(0),
        };
        let cases = [
            (
                ControllerError::from(lost),
                EvidenceKind::DeviceLost,
                "camera2",
            ),
            (read_back.into(), EvidenceKind::ReadBack, "camera2"),
            (late.into(), EvidenceKind::HostLate, "computer"),
            (force.into(), EvidenceKind::Trip, "robot"),
            (ControllerError::Halted, EvidenceKind::TimeOut, "robot"),
        ];
        for (error, kind, subject) in cases {
            let seen = of(&error.to_string());
            assert_eq!(
                (seen.kind, seen.subject.as_str()),
                (kind, subject),
                "{error}"
            );
        }
    }
}
