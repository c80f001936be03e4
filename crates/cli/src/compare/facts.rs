//! Collects the facts of a session that a comparison checks.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::Value;
use skinrig_compare::{SessionFacts, flatten};
use skinrig_model::{CameraId, DeviceRole, RunHeader};
use skinrig_protocol::{Protocol, setting_doc};
use skinrig_recorder::SessionReader;

use crate::exit::Failure;
use crate::paths::file_name;
use skinrig_results::{Origin, RigDocument};

/// Protocol keys that are compared elsewhere, or that only label the protocol.
const IGNORED_KEYS: [&str; 10] = [
    "file_name",
    "text",
    "sha256",
    "overrides",
    "analysis",
    "locations",
    "depths_mm",
    "description",
    "operator",
    "scene",
];

/// Reads the facts of the session at `path`.
pub(super) fn facts(
    path: &Path,
    reader: &SessionReader,
    header: &RunHeader,
) -> Result<SessionFacts, Failure> {
    let unreadable = Failure::session;
    let mut values = BTreeMap::new();
    let mut add = |name: &str, value: String| {
        values.insert(name.to_owned(), value);
    };
    add("rig.kind", header.rig_kind.clone());
    add("rig.name", header.rig_name.clone());
    let rig: Option<RigDocument> = serde_json::from_str(&header.rig_json).ok();
    let level = rig.as_ref().and_then(|r| r.rig["level"].as_str());
    add("rig.level", level.unwrap_or("none").to_owned());
    add("software.recorded", header.software.clone());
    let sealed = reader.seal().map_err(unreadable)?.is_some();
    add("session.sealed", sealed.to_string());
    let end = reader.end().map_err(unreadable)?;
    add(
        "session.end",
        end.map_or("not ended", |(_, e)| e.name()).to_owned(),
    );
    let (mut lost, mut recorded) = (0, BTreeSet::new());
    for camera in CameraId::ALL {
        let chunks = reader.chunk_index(camera).map_err(unreadable)?;
        lost += chunks.iter().map(|c| c.lost_before).sum::<u64>();
        let with_events = chunks.iter().filter(|c| c.facts.cd_events > 0);
        recorded.extend(with_events.map(|c| (c.raw_crc32, c.raw_bytes)));
    }
    add("session.lost_bytes", lost.to_string());
    for device in reader.devices().map_err(unreadable)? {
        let role = device.role.name();
        add(&format!("device.{role}.model"), device.identity.model);
        add(&format!("device.{role}.serial"), device.identity.serial);
        add(&format!("device.{role}.firmware"), device.identity.firmware);
        if matches!(device.role, DeviceRole::Camera1 | DeviceRole::Camera2) {
            for setting in device
                .settings
                .iter()
                .filter(|s| s.name.starts_with("bias"))
            {
                // Some cameras cannot read back what was requested.
                let value = if setting.was_requested() {
                    &setting.requested
                } else {
                    &setting.read_back
                };
                add(&format!("bias.{role}.{}", setting.name), value.clone());
            }
        }
    }
    let mut flat = Vec::new();
    flatten("protocol", &protocol(header), &mut flat);
    let origin = Origin::of(header);
    let kind = if origin == Some(Origin::Simulated) {
        "simulation"
    } else {
        "bench"
    };
    flatten(kind, &rig.map_or(Value::Null, |r| r.rig), &mut flat);
    values.extend(flat);
    let doc = |path: &String| Some((path.clone(), setting_doc(path)?.to_owned()));
    let docs = values.keys().filter_map(doc).collect();
    Ok(SessionFacts {
        file: file_name(path),
        session_id: reader.session_id().map_err(unreadable)?,
        prototype: header.prototype.clone(),
        started: header.started_at.clone(),
        rig_kind: header.rig_kind.clone(),
        origin: origin.map(|origin| origin.name().to_owned()),
        rig_name: header.rig_name.clone(),
        values,
        docs,
        chunks: recorded,
    })
}

/// The protocol by key. Without its files (positions of a path) it is reduced to its name and the digest of its plan; so is the
/// schedule of an import, whose plan only lists the presses.
fn protocol(header: &RunHeader) -> Value {
    let no_file = |p: &Path| Err(std::io::Error::other(p.display().to_string()));
    let text = header.protocol_text.as_bytes();
    let read = Protocol::parse_recorded(&header.protocol_name, text, &header.overrides, &no_file);
    let Ok(read) = read else {
        let digest = match Origin::of(header) {
            Some(Origin::Imported) => "plan",
            _ => "unread_plan",
        };
        return serde_json::json!({ "name": header.protocol_name, digest: header.plan_sha256 });
    };
    settings(&read)
}

fn settings(read: &Protocol) -> Value {
    let mut value = serde_json::to_value(read).unwrap_or(Value::Null);
    let hold_ms = read.motion.hold.0 as f64 / 1e6;
    value["motion"]["hold"] = Value::from(format!("{hold_ms} ms"));
    value["order"] = Value::from(match read.shuffle_seed {
        Some(_) => "shuffled",
        None => "as listed",
    });
    if let Some(map) = value.as_object_mut() {
        IGNORED_KEYS.iter().for_each(|key| {
            map.remove(*key);
        });
        if let Some(prototype) = map.get_mut("prototype").and_then(Value::as_object_mut) {
            // The identity of the skin is the subject of the comparison.
            prototype.retain(|key, _| key == "tip");
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_compare::RULES;

    /// Whoever adds a key decides whether it may cause the difference of two skins.
    #[test]
    fn each_key_of_a_protocol_has_a_rule_of_its_own() {
        let text = include_bytes!("../../tests/fixtures/small.yaml");
        let no_file = |p: &Path| Err(std::io::Error::other(p.display().to_string()));
        let read = Protocol::parse_recorded("small.yaml", text, &[], &no_file).unwrap();
        let mut keys: BTreeSet<String> = settings(&read)
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect();
        assert!(
            keys.contains("motion") && keys.contains("order") && keys.len() > 15,
            "{keys:?}"
        );
        // Left out where they are not set.
        keys.extend(["calibrate_at", "stop", "online", "faults"].map(str::to_owned));
        // Parts with different rules: each part has one.
        keys.remove("prototype");
        keys.remove("surroundings");
        for key in keys {
            let path = format!("protocol.{key}");
            let rule = RULES.iter().find(|rule| path.starts_with(rule.prefix));
            assert!(
                rule.is_some_and(|rule| rule.prefix != "protocol."),
                "{path}"
            );
        }
    }
}
