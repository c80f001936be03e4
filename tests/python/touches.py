"""Reads back what `docs/how-to/touches.py` sends over LSL and DDS: python touches.py LINES_FILE SCRATCH.

The DDS reader is no ROS 2 node: it checks the names, types and bytes of the mapping, not ROS itself.
"""

import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

lines_file, scratch = sys.argv[1:]
how_to = Path(__file__).resolve().parents[2] / "docs" / "how-to"
sys.path.insert(0, str(how_to))
# Nothing leaves this machine, and other tests on it are not heard.
domain = str(1 + os.getpid() % 200)
os.environ["ROS_DOMAIN_ID"] = domain
os.environ["CYCLONEDDS_URI"] = (
    "<General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><Peers><Peer address='localhost'/></Peers><ParticipantIndex>auto</ParticipantIndex></Discovery>"
)
config = Path(scratch) / "lsl_api.cfg"
config.write_text(
    "[multicast]\nResolveScope = machine\nAddressesOverride = {127.0.0.1}\n"
    f"[lab]\nKnownPeers = {{127.0.0.1}}\nSessionID = skinrig-{os.getpid()}\n"
)
os.environ["LSLAPICFG"] = str(config)

import pylsl  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from ros2_types import QOS, PoseWithCovarianceStamped, String  # noqa: E402
from touches import CHANNELS, KINDS  # noqa: E402

lines = Path(lines_file).read_text().splitlines()
touches = [json.loads(line) for line in lines]
located = [touch for touch in touches if touch["at_mm"] is not None]
assert located, "expected touches with a position"

participant = DomainParticipant(int(domain))
readers = [
    DataReader(participant, Topic(participant, "rt/skinrig/" + name, kind, qos=QOS), qos=QOS)
    for name, kind in [("touch", PoseWithCovarianceStamped), ("touch_line", String)]
]
sender = subprocess.Popen([sys.executable, str(how_to / "touches.py"), "--lsl", "--ros2"], stdin=subprocess.PIPE, text=True)
found = pylsl.resolve_byprop("name", "skinrig_touch", timeout=60)
assert len(found) == 1, found
inlet = pylsl.StreamInlet(found[0])
inlet.open_stream(timeout=60)
labels = [channel[0] for channel in CHANNELS]
info = inlet.info(timeout=60)
channel = info.desc().child("channels").child("channel")
assert [channel.child_value("label"), channel.child_value("unit")] == list(CHANNELS[0])

deadline = time.monotonic() + 60
while not all(reader.get_matched_publications() for reader in readers):
    assert time.monotonic() < deadline, "no DDS publisher"
    time.sleep(0.01)


def next_of(reader):
    """The next message of a topic."""
    while time.monotonic() < deadline:
        taken = reader.take(1)
        if taken:
            return taken[0]
        time.sleep(0.001)
    raise AssertionError("no message")


def same(value, wanted):
    return math.isnan(value) if wanted is None else value == wanted


for line, touch in zip(lines, touches):
    sender.stdin.write(line + "\n")
    sender.stdin.flush()
    values, at = inlet.pull_sample(timeout=60)
    row = dict(zip(labels, values))
    assert KINDS[int(row["kind"])] == touch["kind"], (row, touch)
    x, y = touch["at_mm"] or (None, None)
    assert same(row["x"], x) and same(row["y"], y), (row, touch)
    assert same(row["press"], touch["press"]) and same(row["log_likelihood_ratio"], touch["llr"])
    assert same(row["depth"], (touch["depth"] or {}).get("mm")), (row, touch)
    # The time is that of the newest events in the touch, not of its arrival.
    lag = pylsl.local_clock() - at
    assert touch["lag_ms"] * 1e-3 <= lag < touch["lag_ms"] * 1e-3 + 60, (lag, touch)
    assert next_of(readers[1]).data == line
    if touch["at_mm"] is None:
        continue
    message = next_of(readers[0])
    assert message.header.frame_id == "skin"
    position = message.pose.pose.position
    assert [position.x, position.y] == [x * 1e-3, y * 1e-3]
    cov = message.pose.covariance
    if touch["region"]:
        major, minor = touch["region"]["semi_axes_mm"]
        # Trace and determinant do not depend on the direction.
        scale = -2.0 * math.log(0.05) * 1e6
        assert math.isclose((cov[0] + cov[7]) * scale, major**2 + minor**2, rel_tol=1e-9)
        assert math.isclose((cov[0] * cov[7] - cov[1] * cov[6]) * scale**2, (major * minor) ** 2, rel_tol=1e-6)
        angle = math.degrees(0.5 * math.atan2(2.0 * cov[1], cov[0] - cov[7]))
        turned = abs(angle - touch["region"]["angle_deg"]) % 180.0
        assert min(turned, 180.0 - turned) < 1e-6 or math.isclose(major, minor, rel_tol=1e-6), (angle, touch)
    else:
        assert cov[0] == cov[7] == 1e6
sender.stdin.close()
assert sender.wait(timeout=60) == 0
print(f"{len(touches)} touches, {len(located)} with a position, {sum(t['region'] is not None for t in located)} with a region")
