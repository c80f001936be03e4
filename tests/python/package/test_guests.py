"""The learned guests of benches/guests: what they see of a press, and that they answer skinrig in full."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

GUESTS = Path(__file__).resolve().parents[3] / "benches" / "guests"
sys.path.insert(0, str(GUESTS))

import adapted  # noqa: E402
import networks  # noqa: E402
import press  # noqa: E402


def weights(name):
    """Small random weights."""
    rng = np.random.default_rng(1)
    shapes = {
        "cnn": {"kernel1": (2, 4, 3, 5), "bias1": (2,), "kernel2": (2, 2, 3, 5), "bias2": (2,), "hidden": (64, 6), "hidden_bias": (6,),
                "out": (6, 2), "out_bias": (2,)},
        "snn": {"in": (128, 5), "in_bias": (5,), "out": (10, 2), "out_bias": (2,)},
    }[name]
    return {key: rng.normal(size=shape).astype(np.float32) for key, shape in shapes.items()}


def touch(column, events=200):
    """A press that both cameras see about this column."""
    t_us = list(range(0, 1_000 * events, 1_000))
    x_px = [int(np.clip(column + (i * 7) % 31 - 15, 0, 639)) for i in range(events)]
    camera = {"column_px": float(column), "events": {"t_us": t_us, "x_px": x_px, "y_px": [250] * events, "on": [i % 2 == 0 for i in range(events)]}}
    return [camera, camera]


def test_a_picture_holds_the_events_of_the_rows_in_view():
    t_us, x_px, y_px, on = [-1, 0, 149_999, 150_000, 500_000, 10], [5, 5, 639, 7, 7, 7], [200, 176, 367, 176, 176, 175], [1, 1, 0, 1, 1, 1]
    seen = press.picture(t_us, x_px, y_px, on)
    assert seen.shape == (4, 12, 64) and seen.sum() == 3
    assert seen[1, 0, 0] == 1 and seen[0, 11, 63] == 1 and seen[3, 0, 0] == 1
    course = press.course(t_us, x_px, y_px, on)
    assert course.shape == (40, 128) and course.sum() == 3
    assert course[0, 64] == 1 and course[11, 63] == 1 and course[12, 64] == 1
    assert not press.picture([], [], [], []).any()


def test_the_correction_learns_a_linear_skin():
    rng = np.random.default_rng(2)
    features = rng.normal(size=(60, 3))
    truth = features @ rng.normal(size=(3, 2)) * 10 + [4, -3]
    places = np.repeat(np.arange(30), 2)
    skin = adapted.Skin(lambda seen: (seen, np.zeros((len(seen), 2))), features, np.zeros_like(truth), truth, places)
    assert np.abs(skin.locate(features[0]) - truth[0]).max() < 0.2
    assert 0 < skin.radius_mm < 0.5


@pytest.mark.parametrize("name", ["cnn", "snn"])
def test_a_guest_answers_every_press(tmp_path, name):
    file = tmp_path / "weights.npz"
    np.savez(file, **weights(name))
    lines = [{"kind": "begin", "protocol": 1, "outline": {}, "calibrating": 24, "scored": 3}]
    for number in range(24):
        place = number % 12
        lines.append({"kind": "learn", "press": number + 1, "location": place, "x_mm": 2.0 * place, "y_mm": -place, "cameras": touch(60 + 45 * place)})
    lines.append({"kind": "fit"})
    nothing = {"column_px": None, "events": {"t_us": [], "x_px": [], "y_px": [], "on": []}}
    for number, cameras in ((30, touch(100)), (31, [nothing, nothing]), (32, touch(500))):
        lines.append({"kind": "locate", "press": number, "cameras": cameras})

    def run(lines):
        text = "".join(json.dumps(line) + "\n" for line in lines)
        return subprocess.run([sys.executable, GUESTS / f"{name}.py", file], input=text, capture_output=True, text=True, timeout=60)

    ran = run(lines)
    assert ran.returncode == 0, ran.stderr
    fit, *answers = (json.loads(line) for line in ran.stdout.splitlines())
    assert fit == {"name": name, "version": "1"}
    assert [a["press"] for a in answers] == [30, 31, 32]
    assert "x_mm" not in answers[1]
    for located in (answers[0], answers[2]):
        assert np.isfinite([located["x_mm"], located["y_mm"], located["region"]["major_mm"]]).all()
    refused = run([{**lines[0], "protocol": 2}])
    assert refused.returncode != 0 and "expected protocol 1" in refused.stderr
