//! Owns the labels of facts: what texts for people call them, in place of their paths.

use skinrig_model::AnalysisSettings;

/// Labels of facts that no setting declares, by path.
const FACTS: &[(&str, &str)] = &[
    ("rig.kind", "kind of rig"),
    ("rig.level", "simulation level"),
    ("rig.name", "name of the rig"),
    ("software.recorded", "software that recorded"),
    ("session.sealed", "session is sealed"),
    ("session.end", "end of the session"),
    ("session.lost_bytes", "lost data (bytes)"),
    ("calibration.origin", "origin of the calibration"),
    ("calibration.model", "calibrated parameters"),
    ("calibration.lens", "calibrated lens"),
    ("locator.used", "locator"),
    ("protocol.path_kind", "protocol: kind of path"),
    ("protocol.order", "protocol: order of the presses"),
    ("protocol.shuffle_seed", "protocol: seed of the order"),
    ("protocol.roles", "protocol: role of each repetition"),
    ("simulation.seed", "simulation: seed"),
    ("simulation.tip_side_mm", "simulation: side of the tip (mm)"),
];

/// Words for parts of paths that are not words themselves, or mean something else alone.
const WORDS: &[(&str, &str)] = &[
    ("true_cameras", "true place of camera"),
    ("drawn_cameras", "drawn camera"),
    ("camera1", "camera 1"),
    ("camera2", "camera 2"),
    ("trigger_box", "trigger box"),
    ("indenter", "robot"),
    ("geometric", "events"),
    ("w", "lens coefficient"),
    ("half_fov_deg", "half the field of view (deg)"),
    ("crop_v", "rows that are used"),
];

/// Ends of names that are units, and the units; longer ones before those that they contain.
const UNITS: &[(&str, &str)] = &[
    ("_n_s_per_mm", "N s/mm"),
    ("_n_per_mm", "N/mm"),
    ("_per_mm", "1/mm"),
    ("_mm_s3", "mm/s³"),
    ("_mm_s2", "mm/s²"),
    ("_mm_s", "mm/s"),
    ("_rad_s", "rad/s"),
    ("_ev_s", "events/s"),
    ("_b_s", "bytes/s"),
    ("_bytes", "bytes"),
    ("_deg_c", "°C"),
    ("_deg", "deg"),
    ("_percent", "%"),
    ("_ppm", "ppm"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_us", "µs"),
    ("_ns", "ns"),
    ("_hz", "Hz"),
    ("_px", "px"),
    ("_kg", "kg"),
    ("_n", "N"),
    ("_s", "s"),
];

/// Label of the fact at `path`: the documentation of the setting that declares it, or else the words of its path.
pub(super) fn label(path: &str, doc: Option<&str>) -> String {
    if let Some((_, known)) = FACTS.iter().find(|(fact, _)| *fact == path) {
        return (*known).to_owned();
    }
    let of_analysis = || AnalysisSettings::doc_of_field(path.strip_prefix("analysis.")?);
    let declared = doc.or_else(of_analysis);
    let parts: Vec<&str> = path.split('.').collect();
    let Some((last, around)) = parts.split_last() else {
        return path.to_owned();
    };
    // `device.camera1.model`: the device says enough. A bias keeps the name that the camera gives it.
    let (around, own) = match around {
        ["device", rest @ ..] => (rest, None),
        ["bias", rest @ ..] => (rest, Some(format!("bias {last}"))),
        around => (around, None),
    };
    let around: Vec<String> = around.iter().map(|part| word(part)).collect();
    let (name, unit) = split_unit(last);
    let own = own
        .or_else(|| declared.map(first_clause))
        .unwrap_or_else(|| word(name));
    let unit = unit.map_or_else(String::new, |unit| format!(" ({unit})"));
    format!("{}: {own}{unit}", joined(&around))
}

/// Parts of a path; a number belongs to the part before it.
fn joined(parts: &[String]) -> String {
    let mut text = String::new();
    for part in parts {
        let is_number = part.bytes().all(|b| b.is_ascii_digit());
        text.push_str(match (text.is_empty(), is_number) {
            (true, _) => "",
            (false, true) => " ",
            (false, false) => ", ",
        });
        text.push_str(part);
    }
    text
}

fn word(part: &str) -> String {
    let known = WORDS.iter().find(|(name, _)| *name == part);
    known.map_or_else(|| part.replace('_', " "), |(_, words)| (*words).to_owned())
}

fn split_unit(name: &str) -> (&str, Option<&'static str>) {
    if WORDS.iter().any(|(known, _)| *known == name) {
        return (name, None);
    }
    let units = UNITS.iter();
    let mut found = units.filter_map(|(end, unit)| Some((name.strip_suffix(end)?, Some(*unit))));
    found.next().unwrap_or((name, None))
}

/// Up to the end of the first clause: labels are short.
fn first_clause(doc: &str) -> String {
    let end = [". ", "; ", ": ", " ("]
        .iter()
        .filter_map(|end| doc.find(end));
    let clause = &doc[..end.min().unwrap_or(doc.len())];
    let clause = clause.trim_end_matches('.').replace('`', "");
    let mut chars = clause.chars();
    match (chars.next(), chars.clone().next()) {
        // Not an abbreviation, such as DBSCAN.
        (Some(first), Some(second)) if second.is_lowercase() || second == ' ' => {
            first.to_lowercase().chain(chars).collect()
        }
        _ => clause,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::flatten::flatten;

    #[test]
    fn facts_have_labels_for_people() {
        for (path, doc, expected) in [
            ("rig.kind", None, "kind of rig"),
            (
                "simulation.true_cameras.1.position_mm",
                None,
                "simulation, true place of camera 1: position (mm)",
            ),
            ("device.camera2.model", None, "camera 2: model"),
            ("bias.camera1.bias_fo", None, "camera 1: bias bias_fo"),
            (
                "protocol.motion.press_mm_s",
                Some("Speed into the skin. At most 20 mm/s."),
                "protocol, motion: speed into the skin (mm/s)",
            ),
            (
                "analysis.eps_px",
                None,
                "analysis: neighbourhood radius of DBSCAN (px)",
            ),
        ] {
            assert_eq!(label(path, doc), expected);
        }
    }

    #[test]
    fn every_setting_of_the_analysis_has_its_own_label() {
        let settings = serde_json::to_value(AnalysisSettings::default()).unwrap();
        let mut facts = Vec::new();
        flatten("analysis", &settings, &mut facts);
        assert!(facts.len() > 40);
        let mut labels = BTreeMap::new();
        for (path, _) in &facts {
            let text = label(path, None);
            assert!(!text.contains('_') && text.len() < 160, "{text}");
            let other = labels.insert(text.clone(), path);
            assert!(other.is_none(), "{text}: {path} and {other:?}");
        }
    }
}
