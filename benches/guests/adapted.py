"""Owns how a trained network becomes an estimator of one skin: a guest for `skinrig challenge run --events`."""

import json
import math
import sys

import numpy as np

#: Strengths of the ridge; with the last one the network is left as it was trained.
STRENGTHS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, math.inf)


def ridge(features, wanted, strength):
    """Weights and offset of a linear map, in closed form."""
    if math.isinf(strength):
        return np.zeros((features.shape[1], wanted.shape[1])), np.zeros(wanted.shape[1])
    middle, offset = features.mean(axis=0), wanted.mean(axis=0)
    x = features - middle
    weights = np.linalg.solve(x.T @ x + strength * np.eye(x.shape[1]), x.T @ (wanted - offset))
    return weights, offset - middle @ weights


def left_out_errors(features, off, places, strength):
    """Errors where each press's location was left out, mm."""
    errors = np.empty(len(off))
    for place in set(places):
        test = places == place
        weights, offset = ridge(features[~test], off[~test], strength)
        errors[test] = np.hypot(*(off[test] - features[test] @ weights - offset).T)
    return errors


class Skin:
    """A network with a linear correction that calibration presses teach."""

    def __init__(self, network, features, predicted_mm, truth_mm, places):
        self.network = network
        self.radius_mm = None
        off = truth_mm - predicted_mm
        if len(set(places)) < 4:
            self.weights, self.offset = ridge(features, off, math.inf)
            return
        tried = [left_out_errors(features, off, places, s) for s in STRENGTHS]
        best = min(range(len(tried)), key=lambda i: np.mean(tried[i] ** 2))
        self.weights, self.offset = ridge(features, off, STRENGTHS[best])
        # The error that a further press exceeds with a probability of 5 % (conformal).
        rank = math.ceil(0.95 * (len(off) + 1)) - 1
        if rank < len(off):
            self.radius_mm = float(np.sort(tried[best])[rank])

    def locate(self, seen):
        features, predicted_mm = self.network(seen[None])
        return (predicted_mm + features @ self.weights + self.offset)[0]


def run(name, network, see):
    """Answers skinrig. `see`: what the network sees of a camera's events; `network`: from that to features and positions."""

    def answer(**values):
        print(json.dumps(values), flush=True)

    def seen(line):
        events = [camera.get("events") for camera in line["cameras"]]
        if None in events:
            sys.exit("expected events, found none: start `skinrig challenge run` with --events")
        views = [see(**e) for e in events]
        return None if any(not v.any() for v in views) else np.stack(views)

    known, skin = [], None
    for text in sys.stdin:
        line = json.loads(text)
        if line["kind"] == "begin" and line["protocol"] != 1:
            sys.exit("expected protocol 1, found %s" % line["protocol"])
        elif line["kind"] == "learn":
            view = seen(line)
            if view is not None:
                known.append((view, (line["x_mm"], line["y_mm"]), line["location"]))
        elif line["kind"] == "fit":
            if known:
                views, truth_mm, places = (np.array(column) for column in zip(*known))
                skin = Skin(network, *network(views), truth_mm, places)
            answer(name=name, version="1")
        elif line["kind"] == "locate":
            view = seen(line)
            if view is None or skin is None:
                answer(press=line["press"])
                continue
            x, y = (float(v) for v in skin.locate(view))
            radius = skin.radius_mm
            region = {"region": {"major_mm": radius, "minor_mm": radius, "angle_deg": 0}} if radius else {}
            answer(press=line["press"], x_mm=x, y_mm=y, **region)
