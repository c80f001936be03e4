//! Kinds of untrusted input.

mod containers;
mod firmware;
mod robot;
mod sessions;
mod streams;
mod texts;

use crate::{Bound, Target};

const KIB: usize = 1 << 10;
const MIB: usize = 1 << 20;

/// Every target.
#[must_use]
pub const fn all() -> [Target; 12] {
    const PLAIN: Target = Target {
        name: "",
        function: |_| (),
        bound: Bound {
            fixed: MIB,
            per_byte: 64,
        },
        cases: 4_000,
        longest: 64 * KIB,
        dictionary: &[],
        elsewhere: &[],
    };
    // The longest plan that a protocol may request has 131,071 presses.
    const YAML: Target = Target {
        bound: Bound {
            fixed: 128 * MIB,
            per_byte: 4 * KIB,
        },
        cases: 3_000,
        dictionary: &[
            b": ",
            b"- ",
            b"\n",
            b"  ",
            b"[",
            b"{",
            b"}",
            b"]",
            b"&a ",
            b"*a",
            b"!!binary ",
            b"<<: ",
            b"|\n",
            b"? ",
            b"#",
            b"1e308",
            b"-1e308 mm",
            b"nan",
            b".inf mm",
            b"1e-300 mm",
            b"99999999999",
            b"0 mm",
            b"-0 s",
            b"${HOME}",
            b"../../x",
            b"'\0'",
            b"\xff\xfe",
            b"\xef\xbb\xbf",
        ],
        ..PLAIN
    };
    [
        Target {
            name: "stream",
            function: streams::any_format,
            ..PLAIN
        },
        // A chunk of the largest size.
        Target {
            name: "folded",
            function: streams::folded,
            bound: Bound {
                fixed: 257 * MIB,
                per_byte: 64,
            },
            ..PLAIN
        },
        Target {
            name: "raw",
            function: containers::raw,
            cases: 1_500,
            dictionary: &[
                b"% ",
                b"\n",
                b"% end\n",
                b"% format EVT3;height=65535;width=65535\n",
                b"% evt 2.1\n",
                b"% geometry 0x0\n",
                b"% endianness legacy\n",
                b"% system_ID 49\n",
                b";height=",
                b"\xff",
            ],
            ..PLAIN
        },
        Target {
            name: "hdf5",
            function: containers::hdf5,
            bound: Bound {
                fixed: 64 * MIB,
                per_byte: KIB,
            },
            cases: 3_000,
            dictionary: &[
                b"TREE", b"SNOD", b"HEAP", b"FRHP", b"BTHD", b"OHDR", b"OCHK", b"FADB", b"EAHD",
                b"GCOL",
            ],
            elsewhere: &[("crates/formats/tests/fixtures", ".hdf5")],
            ..PLAIN
        },
        Target {
            name: "csv",
            function: texts::positions,
            bound: Bound {
                fixed: MIB,
                per_byte: KIB,
            },
            dictionary: &[
                b",", b"\n", b"\"", b"\r", b"nan", b"inf", b"1e309", b"-0", b"x,y,z\n", b"\xff",
                b",,\n",
            ],
            ..PLAIN
        },
        Target {
            name: "biases",
            function: texts::biases,
            dictionary: &[
                b" % ",
                b"bias_fo",
                b"bias_diff",
                b"-",
                b"99999999999999999999",
                b"\n",
            ],
            ..PLAIN
        },
        Target {
            name: "protocol",
            function: texts::protocol,
            elsewhere: &[("protocols", ".yaml")],
            ..YAML
        },
        Target {
            name: "schedule",
            function: texts::schedule,
            elsewhere: &[("protocols", ".schedule.yaml")],
            ..YAML
        },
        Target {
            name: "rig",
            function: texts::rig,
            elsewhere: &[("hil/rigs", ".yaml")],
            ..YAML
        },
        Target {
            name: "box",
            function: firmware::trigger_box,
            cases: 1_000,
            longest: 4 * KIB,
            ..PLAIN
        },
        Target {
            name: "robot",
            function: robot::answers,
            longest: 4 * KIB,
            ..PLAIN
        },
        Target {
            name: "session",
            function: sessions::session,
            // A page, a megabyte of reading buffer, and one chunk.
            bound: Bound {
                fixed: 32 * MIB,
                per_byte: 256,
            },
            cases: 150,
            longest: MIB,
            dictionary: &[
                b"CREATE VIEW note AS SELECT ",
                b"CREATE TRIGGER ",
                b"th-rle",
                b"none",
                b"evt2",
                b"completed",
                b"\x00\x00\x00\x01",
                b"\x0d",
                b"\x05",
                b"\x0a",
                b"\x02",
                b"\x81\x80\x80\x80\x00",
                b"\xff\xff\xff\xff\xff\xff\xff\xff\xff",
            ],
            ..PLAIN
        },
    ]
}

/// Finds a target by name.
///
/// # Panics
/// For a name that no target has.
#[must_use]
pub fn target(name: &str) -> Target {
    match all().into_iter().find(|t| t.name == name) {
        Some(target) => target,
        None => panic!("expected the name of a target, found {name:?}"),
    }
}
