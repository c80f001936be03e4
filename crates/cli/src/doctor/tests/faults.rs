//! Faults of a planted machine: how to make each one, its only finding, and words of the next step.

use std::fs;

use super::super::finding::Verdict;
use super::super::machine::SpeedFault;
use super::super::survey::Library;
use super::{Bench, CAMERA_1, CAMERA_2, ROBOT_NODE, lamp};
use crate::devices::DeviceState;
use crate::rig::inputs::UnusableInput;

pub(super) type Fault = (
    &'static str,
    fn(&mut Bench),
    (&'static str, &'static str, Verdict),
    &'static str,
);

/// Name, change, only finding, and words of the next step.
pub(super) const FAULTS: &[Fault] = &[
    (
        "the lamps' program is not there",
        |b| {
            let name = "lamp".to_owned();
            b.inputs = vec![lamp(Err(UnusableInput::NotInPath { name }))];
        },
        ("rig file", "hil.light.dark", Verdict::Problem),
        "name a program",
    ),
    (
        "run by root",
        |b| {
            b.write(
                "proc/self/status",
                "Uid:\t0\t0\t0\t0\nGid:\t0\t0\t0\t0\nGroups:\t\nCapEff:\t0\n",
            )
        },
        ("permissions", "user", Verdict::Warning),
        "the user of the bench",
    ),
    (
        "a camera's node belongs to a group",
        |b| {
            b.mode("dev/bus/usb/002/003", 0o660);
            let line = b.line("camera1");
            (line.state, line.role, line.serial) = (DeviceState::NotPermitted, None, None);
        },
        ("permissions", "camera at bus 2 device 3", Verdict::Problem),
        "sudo usermod -aG bench ann",
    ),
    (
        "a camera's node is shut",
        |b| {
            b.mode("dev/bus/usb/002/003", 0o600);
            let line = b.line("camera1");
            (line.state, line.role, line.serial) = (DeviceState::NotPermitted, None, None);
        },
        ("permissions", "camera at bus 2 device 3", Verdict::Problem),
        "70-skinrig.rules",
    ),
    (
        "the library may not open the robot",
        |b| {
            b.mode(ROBOT_NODE, 0o664);
            let line = b.line("robot");
            (line.state, line.role) = (DeviceState::NotPermitted, None);
        },
        ("permissions", "robot", Verdict::Problem),
        "sudo usermod -aG bench ann",
    ),
    (
        "the port is shut",
        |b| b.line("trigger_box").state = DeviceState::NotPermitted,
        ("permissions", "trigger_box", Verdict::Problem),
        "70-skinrig.rules",
    ),
    (
        "a camera is not plugged in",
        |b| {
            fs::remove_dir_all(b.path(CAMERA_1)).unwrap();
            let line = b.line("camera1");
            (line.state, line.usb, line.firmware) = (DeviceState::Absent, None, None);
            line.next_step = Some("plug it in".to_owned());
        },
        ("cables", "camera1", Verdict::Problem),
        "plug it in",
    ),
    (
        "a camera does not answer",
        |b| {
            let line = b.line("camera2");
            (line.state, line.role, line.serial) = (DeviceState::Faulty, None, None);
            line.next_step = Some("wait 5 s".to_owned());
        },
        ("cables", "camera at bus 4 device 2", Verdict::Problem),
        "wait 5 s",
    ),
    (
        "a camera behind a hub",
        |b| {
            fs::rename(b.path(CAMERA_2), b.path("sys/bus/usb/devices/4-2.1")).unwrap();
        },
        ("cables", "camera2: hub", Verdict::Warning),
        "into the computer itself",
    ),
    (
        "both cameras on one controller",
        |b| b.write("sys/bus/usb/devices/usb4/serial", "0000:00:14.0\n"),
        ("cables", "cameras: controllers", Verdict::Warning),
        "lsusb -t",
    ),
    (
        "a camera on a USB 2 cable",
        |b| b.write(&format!("{CAMERA_1}/speed"), "480\n"),
        ("USB speed", "camera1", Verdict::Problem),
        "USB 3 cable",
    ),
    (
        "a slow robot",
        |b| b.write("sys/bus/usb/devices/1-3/speed", "12\n"),
        ("USB speed", "robot", Verdict::Warning),
        "another port",
    ),
    (
        "another library",
        |b| {
            b.survey.library = Library::Loaded {
                version: "3.17.5".to_owned(),
                advice: None,
            };
        },
        ("versions", "robot library", Verdict::Problem),
        "after testing it",
    ),
    (
        "an old library",
        |b| {
            b.rig.as_mut().unwrap().robot.library_version = None;
            b.survey.library = Library::Loaded {
                version: "3.7.3".to_owned(),
                advice: Some("3.10 reports more".to_owned()),
            };
        },
        ("versions", "robot library", Verdict::Warning),
        "3.10 reports more",
    ),
    (
        "an unusable library",
        |b| b.survey.library = Library::Unusable("expected SDK 3.7.1".to_owned()),
        ("versions", "robot library", Verdict::Problem),
        "SKINRIG_LIBDRD",
    ),
    (
        "another firmware of the robot",
        |b| b.line("robot").firmware = Some("3.1".to_owned()),
        ("versions", "robot", Verdict::Problem),
        "after testing it",
    ),
    (
        "a robot without a watchdog",
        |b| {
            b.rig.as_mut().unwrap().robot.firmware = None;
            b.line("robot").firmware = Some("2.4".to_owned());
        },
        ("versions", "robot", Verdict::Warning),
        "Force Dimension",
    ),
    (
        "another FPGA",
        |b| b.line("camera1").firmware = Some("FPGA 3.0.1, FX3 1.0.0".to_owned()),
        ("versions", "camera1", Verdict::Problem),
        "after testing it",
    ),
    (
        "a box with another protocol",
        |b| {
            let line = b.line("trigger_box");
            (line.state, line.firmware) = (DeviceState::OtherFirmware, None);
            line.detail = "firmware 1.0.0 with protocol 1".to_owned();
            line.next_step = Some("make -C hil/trigger_box flash PORT=/dev/ttyACM0".to_owned());
        },
        ("versions", "trigger_box", Verdict::Problem),
        "make -C hil/trigger_box flash",
    ),
    (
        "a full disk",
        |b| b.free_b = |_| Ok(1.9e9),
        ("disk", "free", Verdict::Problem),
        "--sessions",
    ),
    (
        "no room for an hour",
        |b| b.free_b = |_| Ok(73.9e9),
        ("disk", "free", Verdict::Warning),
        "--sessions",
    ),
    (
        "a disk too slow for a run and its log",
        |b| b.write_b_s = |_| Ok(39e6),
        ("disk", "write speed", Verdict::Warning),
        "a faster one",
    ),
    (
        "a folder that takes no file",
        |b| {
            b.write_b_s = |_| {
                Err(SpeedFault {
                    what: "permission denied".to_owned(),
                    next: "give this user write access".to_owned(),
                })
            };
        },
        ("disk", "write speed", Verdict::Problem),
        "write access",
    ),
    (
        "sessions in memory",
        |b| mount(b, "rw - tmpfs tmpfs rw"),
        ("disk", "file system", Verdict::Warning),
        "--sessions",
    ),
    (
        "sessions on a server",
        |b| mount(b, "rw - nfs4 server:/x rw"),
        ("disk", "file system", Verdict::Warning),
        "--sessions",
    ),
    (
        "a disk that went read-only",
        |b| mount(b, "rw - ext4 /dev/sdb1 ro,errors=remount-ro"),
        ("disk", "file system", Verdict::Problem),
        "--sessions",
    ),
    (
        "no real-time priority",
        |b| {
            limit(
                b,
                "Max realtime priority     99",
                "Max realtime priority     0 ",
            )
        },
        ("real time", "priority", Verdict::Warning),
        "ann - rtprio 99",
    ),
    (
        "no locked memory",
        |b| {
            limit(
                b,
                "Max locked memory         unlimited",
                "Max locked memory         8388608  ",
            )
        },
        ("real time", "locked memory", Verdict::Warning),
        "ann - memlock unlimited",
    ),
    (
        "small USB buffers",
        |b| b.write("sys/module/usbcore/parameters/usbfs_memory_mb", "4\n"),
        ("real time", "USB buffers", Verdict::Problem),
        "usbfs_memory_mb=64",
    ),
    (
        "little memory",
        |b| b.write("proc/meminfo", "MemAvailable:   900000 kB\n"),
        ("real time", "memory", Verdict::Warning),
        "end other programs",
    ),
    (
        "swapping",
        |b| {
            b.write(
                "proc/pressure/memory",
                "some avg10=0 avg60=4.20 avg300=0 total=1\n",
            )
        },
        ("real time", "memory pressure", Verdict::Warning),
        "ps --sort",
    ),
    (
        "it may sleep",
        |b| b.remove("etc/systemd/system/sleep.target"),
        ("power", "sleep", Verdict::Warning),
        "systemctl mask sleep.target",
    ),
    (
        "one processor saves power",
        |b| {
            b.write(
                "sys/devices/system/cpu/cpu3/cpufreq/scaling_governor",
                "powersave\n",
            )
        },
        ("power", "processors", Verdict::Warning),
        "cpupower",
    ),
    (
        "the time of day runs free",
        |b| b.remove("run/systemd/timesync/synchronized"),
        ("clock", "time of day", Verdict::Warning),
        "timedatectl",
    ),
    (
        "a slow counter",
        |b| {
            let file = "sys/devices/system/clocksource/clocksource0/current_clocksource";
            b.write(file, "hpet\n");
        },
        ("clock", "counter", Verdict::Warning),
        "clocksource",
    ),
    (
        "another program has a camera",
        |b| {
            let line = b.line("camera2");
            (line.state, line.role, line.serial) = (DeviceState::Busy, None, None);
            b.write("proc/4711/cmdline", "skinrig\0run\0demo.yaml\0");
            b.link("proc/4711/fd/7", "/dev/bus/usb/004/002");
        },
        ("bench", "camera at bus 4 device 2", Verdict::Problem),
        "skinrig status",
    ),
];

fn mount(b: &mut Bench, rest: &str) {
    let root = fs::read_to_string(b.path("proc/self/mountinfo")).unwrap();
    let point = b.path("sessions").canonicalize().unwrap();
    let more = format!("30 22 8:2 / {} {rest}\n", point.display());
    b.write("proc/self/mountinfo", &(root + &more));
}

fn limit(b: &mut Bench, from: &str, to: &str) {
    let text = fs::read_to_string(b.path("proc/self/limits")).unwrap();
    assert!(text.contains(from), "{from}");
    b.write("proc/self/limits", &text.replace(from, to));
}
