//! Tests on a planted machine: a healthy one has no findings, and each fault has exactly its own.

mod faults;
#[path = "../../../tests/commands/terminal_picture.rs"]
mod terminal_picture;

use std::fs;
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};

use skinrig_hil::lease::{Lease, LeaseTiming, Owner};
use skinrig_protocol::rig::RigFile;
use tempfile::TempDir;

use super::finding::Verdict;
use super::machine::{Machine, WriteSpeed};
use super::survey::{Library, Survey};
use super::*;
use crate::devices::{DeviceState, Line};
use crate::rig::inputs::{Input, UnusableInput};
use faults::FAULTS;

const RIG: &str = include_str!("../../../../../hil/rigs/bench.example.yaml");
const CAMERA_1: &str = "sys/bus/usb/devices/2-1";
const CAMERA_2: &str = "sys/bus/usb/devices/4-2";
const LEASE: &str = "skinrig-omega3-12345.lease";
const ROBOT_NODE: &str = "dev/bus/usb/001/005";

/// A planted machine with its devices.
struct Bench {
    folder: TempDir,
    survey: Survey,
    rig: Option<RigFile>,
    inputs: Vec<Input>,
    free_b: fn(&Path) -> io::Result<f64>,
    write_b_s: WriteSpeed,
}

impl Bench {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn link(&self, name: &str, to: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        symlink(to, path).unwrap();
    }

    fn remove(&self, name: &str) {
        fs::remove_file(self.path(name)).unwrap();
    }

    fn mode(&self, name: &str, mode: u32) {
        fs::set_permissions(self.path(name), fs::Permissions::from_mode(mode)).unwrap();
    }

    fn line(&mut self, role: &str) -> &mut Line {
        let of_role = |l: &&mut Line| l.role.as_deref() == Some(role);
        self.survey.lines.iter_mut().find(of_role).unwrap()
    }

    fn usb(&self, name: &str, ids: &str, place: (u8, u8), speed: u32) {
        let (bus, number) = place;
        for (key, value) in [
            ("idVendor", ids.to_owned()),
            ("busnum", bus.to_string()),
            ("devnum", number.to_string()),
            ("speed", speed.to_string()),
        ] {
            self.write(
                &format!("sys/bus/usb/devices/{name}/{key}"),
                &format!("{value}\n"),
            );
        }
        let node = format!("dev/bus/usb/{bus:03}/{number:03}");
        self.write(&node, "");
        self.mode(&node, 0o666);
    }

    fn findings(&self) -> Vec<Finding> {
        let machine = Machine::with_root(self.folder.path(), self.free_b, self.write_b_s);
        examine(&Case {
            machine: &machine,
            rig: self.rig.as_ref(),
            inputs: &self.inputs,
            survey: &self.survey,
            sessions: &self.path("sessions"),
            lease: Some(&self.path(LEASE)),
        })
    }

    /// Area, check and verdict of each problem and warning.
    fn problems(&self) -> Vec<(&'static str, String, Verdict)> {
        let all = self.findings().into_iter();
        all.filter(|f| matches!(f.verdict, Verdict::Problem | Verdict::Warning))
            .map(|f| (f.area, f.check, f.verdict))
            .collect()
    }
}

/// The program that switches the lamps off, found or not.
fn lamp(found: Result<&str, UnusableInput>) -> Input {
    Input {
        key: "hil.light.dark".to_owned(),
        expected: "a program that this user may run".to_owned(),
        found: found.map(PathBuf::from),
        next: "name a program that is there".to_owned(),
    }
}

fn ready(device: &'static str, role: &str, what: &str, firmware: &str) -> Line {
    Line {
        device,
        what: what.to_owned(),
        state: DeviceState::Ready,
        role: Some(role.to_owned()),
        detail: format!("firmware {firmware}"),
        firmware: Some(firmware.to_owned()),
        ..Line::default()
    }
}

/// A bench without faults.
fn healthy() -> Bench {
    let rig = RIG.replace("firmware: \"1.0\"", "firmware: \"3.0\"");
    let mut cameras = [1, 2].map(|i| {
        let (role, serial) = (format!("camera{i}"), format!("0000175{}", i + 2));
        Line {
            serial: Some(serial),
            ..ready("camera", &role, "EVK1 Gen3.1", "FPGA 3.0.0, FX3 1.0.0")
        }
    });
    cameras[0].usb = Some((2, 3));
    cameras[1].usb = Some((4, 2));
    let [one, two] = cameras;
    let b = Bench {
        folder: tempfile::tempdir().unwrap(),
        survey: Survey {
            lines: vec![
                ready("robot", "robot", "omega.3", "3.0"),
                one,
                two,
                ready("trigger box", "trigger_box", "/dev/ttyACM0", "1.1.1"),
            ],
            library: Library::Loaded {
                version: "3.17.6".to_owned(),
                advice: None,
            },
            left_alone: false,
        },
        rig: RigFile::parse("rig.yaml", rig.as_bytes(), &|_| None).ok(),
        inputs: vec![lamp(Ok("/usr/local/bin/lamp"))],
        free_b: |_| Ok(500e9),
        write_b_s: |_| Ok(300e6),
    };
    fs::create_dir(b.path("sessions")).unwrap();
    let gid = fs::metadata(b.path("sessions")).unwrap().gid();
    b.usb("2-1", "04b4", (2, 3), 5000);
    b.usb("4-2", "04b4", (4, 2), 5000);
    b.usb("1-3", "1451", (1, 5), 480);
    b.write("sys/bus/usb/devices/2-1:1.0/bInterfaceClass", "ff\n");
    for (bus, controller) in [
        (1, "0000:00:14.0"),
        (2, "0000:00:14.0"),
        (4, "0000:03:00.0"),
    ] {
        b.write(&format!("sys/bus/usb/devices/usb{bus}/serial"), controller);
    }
    // This user owns no files: its permissions come from groups and the bits for others.
    b.write(
        "proc/self/status",
        "Name:\tskinrig\nUid:\t4242\t4242\t4242\t4242\nGid:\t4242\t4242\t4242\t4242\nGroups:\t4243 \nCapEff:\t0000000000000000\n",
    );
    b.write(
        "etc/passwd",
        "root:x:0:0::/:\nann:x:4242:4242::/home/ann:\n",
    );
    b.write("etc/group", &format!("bench:x:{gid}:\n"));
    b.write(
        "proc/self/limits",
        "Limit                     Soft Limit           Hard Limit           Units     \n\
         Max locked memory         unlimited            unlimited            bytes     \n\
         Max realtime priority     99                   99                   \n",
    );
    b.write(
        "proc/self/mountinfo",
        "22 1 8:1 / / rw,relatime - ext4 /dev/sda1 rw\n",
    );
    b.write(
        "proc/meminfo",
        "MemTotal:       32000000 kB\nMemAvailable:   16000000 kB\n",
    );
    b.write(
        "proc/pressure/memory",
        "some avg10=0.00 avg60=0.10 avg300=0.00 total=1\nfull avg10=0.00 avg60=9.00 avg300=0.00 total=1\n",
    );
    b.write("sys/module/usbcore/parameters/usbfs_memory_mb", "16\n");
    b.write("sys/power/state", "freeze mem disk\n");
    b.link("etc/systemd/system/sleep.target", "/dev/null");
    b.write("run/systemd/timesync/synchronized", "");
    fs::create_dir_all(b.path("run/systemd/system")).unwrap();
    for cpu in 0..4 {
        let file = format!("sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor");
        b.write(&file, "performance\n");
    }
    b.write("sys/devices/system/cpu/cpufreq/boost", "1\n");
    let source = "sys/devices/system/clocksource/clocksource0/current_clocksource";
    b.write(source, "tsc\n");
    b
}

#[test]
fn a_healthy_bench_passes_every_check() {
    let other: Vec<_> = healthy()
        .findings()
        .into_iter()
        .filter(|f| f.verdict != Verdict::Ok)
        .collect();
    assert_eq!(other, []);
}

#[test]
fn each_fault_has_exactly_its_own_finding() {
    for (name, fault, (area, check, verdict), next) in FAULTS {
        let mut bench = healthy();
        fault(&mut bench);
        let wrong = bench.problems();
        assert_eq!(wrong, [(*area, (*check).to_owned(), *verdict)], "{name}");
        let findings = bench.findings();
        let found = findings.iter().find(|f| f.verdict == *verdict).unwrap();
        let step = found.next_step.as_deref().unwrap_or_default();
        assert!(step.contains(next), "{name}: {step}");
    }
}

#[test]
fn the_process_that_holds_a_device_is_named() {
    let mut bench = healthy();
    let (_, fault, ..) = FAULTS.last().unwrap();
    fault(&mut bench);
    let findings = bench.findings();
    let held = findings.iter().find(|f| f.verdict == Verdict::Problem);
    assert_eq!(
        held.unwrap().found,
        "in use by process 4711: skinrig run demo.yaml"
    );
}

#[test]
fn devices_of_a_held_bench_are_not_queried_and_its_holder_is_named() {
    let mut bench = healthy();
    let owner = Owner::this_process(
        "bob".to_owned(),
        "lab".to_owned(),
        "hil run nightly".to_owned(),
    );
    let lease = Lease::take(&bench.path(LEASE), owner, LeaseTiming::default()).unwrap();
    assert!(bench::is_held(lease.path()));
    bench.survey.lines.clear();
    bench.survey.left_alone = true;
    let wrong = bench.problems();
    assert_eq!(wrong, [("bench", "lease".to_owned(), Verdict::Problem)]);
    let findings = bench.findings();
    let held = findings.iter().find(|f| f.verdict == Verdict::Problem);
    assert!(held.unwrap().found.contains("bob on lab"), "{held:?}");
    drop(lease);
    assert!(!bench::is_held(&bench.path(LEASE)));
    assert_eq!(bench.problems(), []);
}

#[test]
fn without_the_library_the_device_file_shows_the_robots_permissions() {
    for (mode, wrong) in [(0o666, 1), (0o660, 2)] {
        let mut bench = healthy();
        bench.mode(ROBOT_NODE, mode);
        bench.survey.library = Library::Absent(6);
        bench.survey.lines.remove(0);
        let found = bench.problems();
        assert_eq!(found.len(), wrong, "{mode:o}: {found:?}");
        let last = found.last().unwrap();
        assert_eq!((last.0, last.1.as_str()), ("versions", "robot library"));
        assert!(wrong == 1 || (found[0].0, found[0].1.as_str()) == ("permissions", "robot"));
    }
}

#[test]
fn checks_of_an_empty_machine_state_why_they_are_not_possible() {
    let mut bench = healthy();
    bench.folder = tempfile::tempdir().unwrap();
    bench.rig = None;
    bench.inputs.clear();
    bench.survey.lines.clear();
    bench.survey.library = Library::Absent(6);
    bench.free_b = |_| Err(io::Error::other("no such call"));
    let findings = bench.findings();
    // A missing folder has no run, no device is in use, and the write speed is measured.
    for f in &findings {
        let fine = f.area == "bench" || f.check == "write speed";
        let fine = fine && f.verdict == Verdict::Ok;
        assert!(fine || f.verdict == Verdict::NotChecked, "{f:?}");
        assert!(!f.found.is_empty(), "{f:?}");
    }
    assert!(findings.len() > 15, "{}", findings.len());
}

#[test]
fn table_and_json_are_pinned() {
    let mut bench = healthy();
    for name in [
        "a camera on a USB 2 cable",
        "it may sleep",
        "small USB buffers",
    ] {
        let (_, fault, ..) = FAULTS.iter().find(|f| f.0 == name).unwrap();
        fault(&mut bench);
    }
    bench.remove("proc/pressure/memory");
    let findings = bench.findings();
    let folder = bench.folder.path().display().to_string();
    let table = finding::table(bench.rig.as_ref(), &findings, Paint::new(false));
    insta::assert_snapshot!("table", table.replace(&folder, "/planted"));
    let picture = finding::table(bench.rig.as_ref(), &findings, Paint::new(true));
    let picture = picture.replace(&folder, "/planted");
    let command = "skinrig doctor --rig bench.yaml";
    terminal_picture::assert_picture("doctor", command, &picture);
    let of = |verdict| findings.iter().find(|f| f.verdict == verdict).cloned();
    let some: Vec<Finding> = [Verdict::Ok, Verdict::Problem, Verdict::NotChecked]
        .into_iter()
        .filter_map(of)
        .collect();
    let json = finding::json(bench.rig.as_ref(), &some);
    insta::assert_snapshot!("json", serde_json::to_string_pretty(&json).unwrap());
}
