"""Locates presses by their nearest neighbours among the calibration presses: a guest for `skinrig challenge run`.

Reads one JSON object per line, answers on standard output. Needs nothing beyond Python's standard library.
"""

import json
import math
import sys

NEIGHBOURS = 4


def answer(**values):
    print(json.dumps(values), flush=True)


def columns(line):
    """The columns of both cameras, or None if one of them saw nothing."""
    found = [camera["column_px"] for camera in line["cameras"]]
    return None if None in found else found


def locate(known, at):
    """Mean position of the nearest known presses in column space, the nearer the heavier."""
    near = sorted((math.dist(at, other), x, y) for other, x, y, _ in known)[:NEIGHBOURS]
    weights = [1.0 / (distance + 1.0) ** 2 for distance, _, _ in near]
    total = sum(weights)
    return [sum(w * n[axis] for w, n in zip(weights, near)) / total for axis in (1, 2)]


def radius(known):
    """Radius that holds 95 % of the calibration presses when their own location is left out, mm."""
    errors = []
    for at, x, y, place in known:
        others = [k for k in known if k[3] != place]
        if len(others) >= NEIGHBOURS:
            errors.append(math.dist(locate(others, at), (x, y)))
    errors.sort()
    rank = math.ceil(0.95 * (len(errors) + 1)) - 1
    return errors[rank] if rank < len(errors) else None


known = []
circle = None
for text in sys.stdin:
    line = json.loads(text)
    if line["kind"] == "begin":
        if line["protocol"] != 1:
            sys.exit("expected protocol 1, found %s" % line["protocol"])
    elif line["kind"] == "learn":
        at = columns(line)
        if at:
            known.append((at, line["x_mm"], line["y_mm"], line["location"]))
    elif line["kind"] == "fit":
        circle = radius(known)
        answer(name="nearest neighbours", version="1")
    elif line["kind"] == "locate":
        at = columns(line)
        if not at or not known:
            answer(press=line["press"])
            continue
        x, y = locate(known, at)
        if circle:
            region = {"major_mm": circle, "minor_mm": circle, "angle_deg": 0}
            answer(press=line["press"], x_mm=x, y_mm=y, region=region)
        else:
            answer(press=line["press"], x_mm=x, y_mm=y)
