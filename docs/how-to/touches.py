"""Sends what a run feels to other programs: a Lab Streaming Layer outlet, and ROS 2 topics.

    skinrig watch sessions/ --touches | python3 touches.py --lsl --ros2

LSL (pip install pylsl): the stream `skinrig_touch` of CHANNELS, NaN where a touch has no value, at the time of its events.

ROS 2 (pip install cyclonedds; no ROS on this machine): `/skinrig/touch`, geometry_msgs/PoseWithCovarianceStamped, the position
and the covariance of its region; `/skinrig/touch_line`, std_msgs/String, each line as it came. DDS names and types follow the
mapping of ROS 2; ROS_DOMAIN_ID chooses the domain.
"""

import argparse
import json
import math
import os
import sys
import time

KINDS = ["started", "onset", "position", "withdrawn", "release", "skipped", "stopped", "lifted"]
CHANNELS = [
    ("kind", "index in " + " ".join(KINDS)),
    ("press", "number from 1"),
    ("x", "mm"),
    ("y", "mm"),
    ("region_major", "mm"),
    ("region_minor", "mm"),
    ("region_angle", "deg"),
    ("log_likelihood_ratio", "nats"),
    ("depth", "mm"),
    ("depth_within", "mm"),
]
# Squared radius of the ellipse that holds 95 % of a normal distribution in two dimensions: -2 ln(0.05).
ELLIPSE_95 = -2.0 * math.log(0.05)
# Variance of what a touch does not say, m^2 and rad^2.
UNKNOWN = 1e6


def known(value):
    """The value, NaN without one."""
    return math.nan if value is None else float(value)


def sample(touch):
    """A touch as the channels of the LSL stream."""
    x, y = touch["at_mm"] or (None, None)
    region = touch["region"] or {}
    major, minor = region.get("semi_axes_mm", (None, None))
    depth = touch["depth"] or {}
    values = [touch["press"], x, y, major, minor, region.get("angle_deg"), touch["llr"], depth.get("mm"), depth.get("within_mm")]
    return [float(KINDS.index(touch["kind"]))] + [known(value) for value in values]


def covariance(region):
    """Covariance of position and rotation, row by row, m^2 and rad^2, of a 95 % region."""
    rows = [UNKNOWN if k % 7 == 0 else 0.0 for k in range(36)]
    if region:
        major, minor = [(axis * 1e-3) ** 2 / ELLIPSE_95 for axis in region["semi_axes_mm"]]
        angle = math.radians(region["angle_deg"])
        c, s = math.cos(angle), math.sin(angle)
        rows[0], rows[7] = major * c * c + minor * s * s, major * s * s + minor * c * c
        rows[1] = rows[6] = (major - minor) * c * s
    return rows


def lsl():
    """A function that sends a touch to the LSL outlet."""
    import pylsl

    info = pylsl.StreamInfo("skinrig_touch", "Touch", len(CHANNELS), pylsl.IRREGULAR_RATE, "double64", "skinrig_touch")
    channels = info.desc().append_child("channels")
    for label, unit in CHANNELS:
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    outlet = pylsl.StreamOutlet(info)
    return lambda touch, _: outlet.push_sample(sample(touch), pylsl.local_clock() - touch["lag_ms"] * 1e-3)


def ros2():
    """A function that publishes a touch on the ROS 2 topics."""
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from ros2_types import QOS, Header, Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, String, Time

    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    writers = [
        DataWriter(participant, Topic(participant, "rt/skinrig/" + name, kind, qos=QOS), qos=QOS)
        for name, kind in [("touch", PoseWithCovarianceStamped), ("touch_line", String)]
    ]

    def publish(touch, line):
        writers[1].write(String(data=line))
        if touch["at_mm"] is None:
            return
        x, y = [value * 1e-3 for value in touch["at_mm"]]
        seconds, nanoseconds = divmod(time.time_ns() - int(touch["lag_ms"] * 1e6), 1_000_000_000)
        writers[0].write(
            PoseWithCovarianceStamped(
                header=Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id="skin"),
                pose=PoseWithCovariance(
                    pose=Pose(position=Point(x=x, y=y, z=0.0), orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)),
                    covariance=covariance(touch["region"]),
                ),
            )
        )

    return publish


def main():
    """Sends each line of standard input."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--lsl", action="store_true", help="Lab Streaming Layer outlet")
    arguments.add_argument("--ros2", action="store_true", help="ROS 2 topics")
    chosen = arguments.parse_args()
    if not (chosen.lsl or chosen.ros2):
        arguments.error("expected --lsl, --ros2 or both")
    outputs = ([lsl()] if chosen.lsl else []) + ([ros2()] if chosen.ros2 else [])
    for line in sys.stdin:
        line = line.rstrip("\n")
        touch = json.loads(line)
        if touch["missed"]:
            print("%d touches before this one were lost: this program reads too slowly" % touch["missed"], file=sys.stderr)
        for send in outputs:
            send(touch, line)


if __name__ == "__main__":
    main()
