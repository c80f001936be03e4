//! Checks files of the bench that no compiler reads: systemd units, udev rules, and the first-contact guide with its
//! questions.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::error::ErrorKind;
use serde_json::Value;
use skinrig_protocol::suite::Suite;

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(file: &str) -> String {
    std::fs::read_to_string(top().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// Directives used by the units, per section; systemd only warns about typos.
const DIRECTIVES: &[(&str, &str)] = &[
    (
        "Unit",
        "Description ConditionPathExists RequiresMountsFor After Requires OnFailure StopWhenUnneeded",
    ),
    (
        "Service",
        "Type User Group SupplementaryGroups WorkingDirectory StateDirectory SyslogIdentifier ExecCondition ExecStart Restart \
         TimeoutStartSec TimeoutStopSec KillMode LimitRTPRIO LimitMEMLOCK OOMScoreAdjust DevicePolicy DeviceAllow NoNewPrivileges \
         CapabilityBoundingSet ProtectSystem ProtectHome ReadWritePaths PrivateTmp PrivateNetwork ProtectKernelTunables ProtectKernelModules \
         ProtectKernelLogs ProtectControlGroups ProtectHostname RestrictAddressFamilies IPAddressDeny RestrictNamespaces \
         RestrictSUIDSGID LockPersonality SystemCallArchitectures UMask",
    ),
    (
        "Timer",
        "OnCalendar Persistent RandomizedDelaySec AccuracySec WakeSystem",
    ),
    ("Install", "WantedBy"),
];

const UNITS: [&str; 4] = [
    "skinrig-awake.service",
    "skinrig-nightly-failed.service",
    "skinrig-nightly.service",
    "skinrig-nightly.timer",
];

/// A unit as a map from section and key to values.
fn unit(name: &str) -> BTreeMap<(String, String), Vec<String>> {
    let (mut section, mut found) = (String::new(), BTreeMap::<_, Vec<String>>::new());
    for line in read(&format!("hil/systemd/{name}")).lines() {
        if let Some(new) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            section = new.to_owned();
        } else if !line.is_empty() && !line.starts_with('#') {
            let (key, value) = line
                .split_once('=')
                .unwrap_or_else(|| panic!("{name}: {line}"));
            let known = DIRECTIVES.iter().find(|(s, _)| *s == section);
            let (_, known) = known.unwrap_or_else(|| panic!("{name}: [{section}]"));
            assert!(
                known.split_whitespace().any(|k| k == key),
                "{name}: [{section}] {key}"
            );
            found
                .entry((section.clone(), key.to_owned()))
                .or_default()
                .push(value.to_owned());
        }
    }
    found
}

fn single_value<'a>(
    unit: &'a BTreeMap<(String, String), Vec<String>>,
    section: &str,
    key: &str,
) -> &'a str {
    match unit
        .get(&(section.to_owned(), key.to_owned()))
        .map(Vec::as_slice)
    {
        Some([value]) => value,
        other => panic!("expected [{section}] {key} once, found {other:?}"),
    }
}

#[test]
fn units_have_known_keys_and_existing_dependencies() {
    let there: BTreeSet<String> = std::fs::read_dir(top().join("hil/systemd"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(there, UNITS.map(str::to_owned).into());
    let mut named = 0;
    for name in UNITS {
        for ((_, key), values) in unit(name) {
            for word in values.iter().flat_map(|v| v.split_whitespace()) {
                if word.starts_with("skinrig-")
                    && ["Requires", "After", "OnFailure"].contains(&key.as_str())
                {
                    assert!(there.contains(word), "{name}: {key}={word}");
                    named += 1;
                }
            }
        }
    }
    assert!(named >= 3, "{named}");
    let timer = unit("skinrig-nightly.timer");
    assert_eq!(single_value(&timer, "Timer", "Persistent"), "true");
    assert_eq!(single_value(&timer, "Timer", "RandomizedDelaySec"), "0");
}

#[test]
fn a_night_has_the_time_and_the_rights_that_it_needs() {
    let service = unit("skinrig-nightly.service");
    // The suite's own budget ends a night first.
    let limit = single_value(&service, "Service", "TimeoutStartSec");
    let hours: f64 = limit.strip_suffix('h').unwrap().parse().unwrap();
    let text = read("hil/nightly.yaml");
    let suite = Suite::parse("nightly.yaml", text.as_bytes()).unwrap();
    assert!(suite.budget.as_secs_f64() * 1.5 < hours * 3600.0, "{limit}");
    // The process that brakes the arm outlives the program.
    assert_eq!(single_value(&service, "Service", "KillMode"), "process");
    assert_eq!(single_value(&service, "Service", "LimitRTPRIO"), "99");
    assert_eq!(
        single_value(&service, "Service", "LimitMEMLOCK"),
        "infinity"
    );
    for kind in ["char-usb_device rw", "char-ttyACM rw", "char-ttyUSB rw"] {
        let allowed = &service[&("Service".to_owned(), "DeviceAllow".to_owned())];
        assert!(allowed.iter().any(|a| a == kind), "{kind}");
    }
    // A lease in a private folder would not protect the bench.
    assert_eq!(
        single_value(&service, "Service", "ReadWritePaths"),
        "-/run/lock /tmp"
    );
    for forbidding in [
        "PrivateDevices",
        "RestrictRealtime",
        "PrivateNetwork",
        "PrivateTmp",
    ] {
        assert!(
            !service.keys().any(|(_, key)| key == forbidding),
            "{forbidding}"
        );
    }
}

#[test]
fn the_night_is_a_command_that_the_program_takes() {
    let service = unit("skinrig-nightly.service");
    let command = single_value(&service, "Service", "ExecStart");
    let words: Vec<&str> = command.split_whitespace().collect();
    assert_eq!(words[1..3], ["hil", "run"]);
    if let Err(e) = skinrig::parse(&words) {
        panic!("{command}: {e}");
    }
    for file in ["/etc/skinrig/nightly.yaml", "/etc/skinrig/rig.yaml"] {
        assert!(words.contains(&file), "{command}");
        let conditions = &service[&("Unit".to_owned(), "ConditionPathExists".to_owned())];
        assert!(
            conditions.iter().any(|c| c == file),
            "{file} is no condition"
        );
    }
    // It may write its outputs.
    assert_eq!(
        single_value(&service, "Service", "StateDirectory"),
        "skinrig"
    );
    assert!(words.contains(&"/var/lib/skinrig/nights"), "{command}");
    // Without a history no page shows trends; next to the nights, relative links survive a move.
    let history = words.iter().position(|w| *w == "--history");
    assert_eq!(
        history.map(|at| words[at + 1]),
        Some("/var/lib/skinrig/nights/history.sqlite"),
        "{command}"
    );
}

#[test]
fn systemd_verifies_the_units() {
    let folder = tempfile::tempdir().unwrap();
    for name in UNITS {
        // The program is not installed where tests run.
        let text =
            read(&format!("hil/systemd/{name}")).replace("/usr/local/bin/skinrig", "/bin/true");
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let paths = UNITS.map(|name| folder.path().join(name));
    let output = match Command::new("systemd-analyze")
        .arg("verify")
        .args(&paths)
        .output()
    {
        Ok(output) => output,
        Err(e) => {
            eprintln!("skipped: no systemd-analyze: {e}");
            return;
        }
    };
    let messages = String::from_utf8_lossy(&output.stderr);
    // systemd also reads the machine's own units, and may report them.
    let ours: Vec<&str> = messages.lines().filter(|l| l.contains("skinrig")).collect();
    assert!(ours.is_empty(), "{messages}");
}

/// Keys allowed in the rules, without braces.
const RULE_KEYS: &[&str] = &[
    "ACTION",
    "SUBSYSTEM",
    "ENV",
    "ATTR",
    "ATTRS",
    "GROUP",
    "MODE",
    "TAG",
    "GOTO",
    "LABEL",
];

/// A rule as key, operator, value.
fn rule(line: &str) -> Vec<(String, String, String)> {
    line.split(", ")
        .map(|part| {
            let (left, value) = part.split_once('"').unwrap_or_else(|| panic!("{part}"));
            let value = value.strip_suffix('"').unwrap_or_else(|| panic!("{part}"));
            let key = left.trim_end_matches(['=', '+', '!']);
            let bare = key.split('{').next().unwrap();
            assert!(RULE_KEYS.contains(&bare), "{part}");
            (
                key.to_owned(),
                left[key.len()..].to_owned(),
                value.to_owned(),
            )
        })
        .collect()
}

#[test]
fn the_udev_rules_give_the_devices_to_one_group_only() {
    let text = read("hil/udev/70-skinrig.rules");
    let rules: Vec<_> = text
        .lines()
        .filter(|l| !l.is_empty() && !l.starts_with('#'))
        .map(rule)
        .collect();
    let mut found = BTreeSet::new();
    for rule in &rules {
        let value = |key: &str| {
            rule.iter()
                .find(|(k, ..)| k == key)
                .map(|(_, _, v)| v.as_str())
        };
        let has = |key: &str, op: &str, value: &str| {
            rule.contains(&(key.to_owned(), op.to_owned(), value.to_owned()))
        };
        for (key, op, _) in rule {
            let matches = [
                "ACTION",
                "SUBSYSTEM",
                "ATTRS{idVendor}",
                "ATTR{idVendor}",
                "ENV{DEVTYPE}",
            ];
            assert!(!matches.contains(&key.as_str()) || op == "==", "{rule:?}");
        }
        if let Some(group) = value("GROUP") {
            assert!(
                has("MODE", "=", "0660") && has("TAG", "+=", "uaccess"),
                "{rule:?}"
            );
            assert_eq!(
                group,
                if value("SUBSYSTEM") == Some("tty") {
                    "dialout"
                } else {
                    "plugdev"
                }
            );
        }
        if value("SUBSYSTEM") == Some("usb") {
            assert!(has("ATTR{power/control}", "=", "on"), "{rule:?}");
            let vendor = u16::from_str_radix(value("ATTR{idVendor}").unwrap(), 16).unwrap();
            let products = value("ATTR{idProduct}").map_or(vec![None], |all| {
                all.split('|')
                    .map(|id| u16::from_str_radix(id, 16).ok())
                    .collect()
            });
            found.extend(products.into_iter().map(|product| (vendor, product)));
        }
    }
    let mut expected: BTreeSet<(u16, Option<u16>)> = skinrig_evk1::requests::USB_IDS
        .into_iter()
        .map(|(vendor, product)| (vendor, Some(product)))
        .collect();
    expected.insert((skinrig_omega3::enumerate::USB_VENDOR, None));
    // vid and pid of `uno` in boards.txt of github.com/arduino/ArduinoCore-avr.
    for (vendor, product) in [
        (0x2341, 0x0043),
        (0x2341, 0x0001),
        (0x2a03, 0x0043),
        (0x2341, 0x0243),
        (0x2341, 0x006a),
    ] {
        expected.insert((vendor, Some(product)));
    }
    assert_eq!(found, expected);
    assert!(
        !text
            .lines()
            .any(|l| !l.starts_with('#') && l.contains("0666"))
    );
}

/// True if `path` leads to a key of this schema.
fn has_key(schema: &Value, path: &str) -> bool {
    let resolved = |value: &'_ Value| match value["$ref"].as_str() {
        Some(to) => schema.pointer(to.trim_start_matches('#')).cloned(),
        None => Some(value.clone()),
    };
    let mut at = Some(schema.clone());
    for key in path.split('.') {
        at = at.and_then(|at| resolved(&at["properties"][key]));
    }
    at.is_some_and(|at| !at.is_null())
}

/// Table rows whose first cell looks like a number of this kind.
fn rows(text: &str, is_number: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
    text.lines()
        .filter_map(|l| l.strip_prefix("| ")?.strip_suffix(" |"))
        .map(|l| {
            l.split(" | ")
                .map(|cell| cell.trim().to_owned())
                .collect::<Vec<_>>()
        })
        .filter(|cells| is_number(&cells[0]))
        .collect()
}

#[test]
fn every_question_of_the_guide_has_a_number_of_its_own_and_a_key_that_exists() {
    let text = read("docs/how-to/bench.md");
    let number = |cell: &str| {
        let (kind, rest) = cell.split_at_checked(1).unwrap_or_default();
        ["R", "C", "T", "B"].contains(&kind)
            && !rest.is_empty()
            && rest.bytes().all(|b| b.is_ascii_digit())
    };
    let questions = rows(&text, number);
    assert!(questions.len() > 30, "{}", questions.len());
    let numbers: BTreeSet<&str> = questions.iter().map(|q| q[0].as_str()).collect();
    assert_eq!(numbers.len(), questions.len(), "a number twice");
    let schema = |file: &str| -> Value { serde_json::from_str(&read(file)).unwrap() };
    let (rig, protocol) = (
        schema("hil/rigs/skinrig-rig.schema.json"),
        schema("protocols/skinrig.schema.json"),
    );
    assert!(
        has_key(&rig, "robot.motor_force.per_ratio") && !has_key(&rig, "robot.motor_force.none")
    );
    let mut keys = 0;
    for question in &questions {
        let [number, _, _, answer] = question.as_slice() else {
            panic!("expected number, question, way and key, found {question:?}");
        };
        let (schema, list) = match answer.strip_prefix("protocol: ") {
            Some(list) => (&protocol, list),
            None => (&rig, answer.as_str()),
        };
        for key in list.split(", ") {
            let key = key.strip_prefix('`').and_then(|k| k.strip_suffix('`'));
            let key = key.unwrap_or_else(|| panic!("{number}: {answer}"));
            assert!(has_key(schema, key), "{number}: there is no key {key}");
            keys += 1;
        }
    }
    assert!(keys > 25, "{keys}");
    // References from steps to questions must resolve.
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    for word in words.filter(|w| number(w)) {
        assert!(numbers.contains(word), "there is no question {word}");
    }
}

#[test]
fn the_steps_of_the_guide_are_counted() {
    let text = read("docs/how-to/bench.md");
    let steps = rows(&text, |cell| cell.parse::<usize>().is_ok());
    let numbers: Vec<usize> = steps.iter().map(|s| s[0].parse().unwrap()).collect();
    assert_eq!(numbers, (1..=steps.len()).collect::<Vec<_>>());
    assert!(steps.iter().all(|s| s.len() == 4), "{steps:?}");
}

#[test]
fn every_command_in_the_guides_exists() {
    let mut observed = 0;
    for file in ["docs/how-to/bench.md", "hil/README.md"] {
        let text = read(file);
        for command in text.split('`').filter(|c| c.starts_with("skinrig ")) {
            let words = command
                .split_whitespace()
                .take_while(|w| w.bytes().all(|b| b.is_ascii_alphabetic()));
            let mut words: Vec<&str> = words.take(3).collect();
            words.push("--help");
            let kind = skinrig::parse(&words).unwrap_err().kind();
            assert_eq!(kind, ErrorKind::DisplayHelp, "{file}: {command}");
            observed += 1;
        }
    }
    assert!(observed > 15, "{observed}");
}

#[test]
fn the_suite_of_first_contact_leaves_the_robot_without_power() {
    let bytes = read("hil/first-contact.yaml");
    let suite = Suite::parse("first-contact.yaml", bytes.as_bytes()).unwrap();
    let still = [
        "identity",
        "settings",
        "disk",
        "trigger_loopback",
        "clocks",
        "idle",
        "test_pattern",
    ];
    let names: Vec<&str> = suite.checks.iter().map(|c| c.name).collect();
    assert_eq!(names, still);
}
