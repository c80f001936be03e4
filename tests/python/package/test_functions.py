"""Analyses, comparisons and simulations are those of the command line, and so are the texts of errors."""

import json
import signal
import threading

import pytest
import skinrig
from conftest import SMALL, run


def beside(path, ending):
    return path.with_name(path.name.replace(".session.sqlite", ending))


def test_analyze_gives_the_numbers_of_the_command_line(session_path, analysed_path):
    stored = json.loads(beside(analysed_path, ".results.json").read_text())
    assert skinrig.Session(analysed_path).analysis() == stored
    found = skinrig.analyze(session_path)
    assert found["analysis"] == stored["analysis"] and found["summary"] == stored["summary"]
    assert not beside(session_path, ".results.json").exists()


def test_settings_make_a_variant(tmp_path, session_path):
    path = tmp_path / session_path.name
    path.write_bytes(session_path.read_bytes())
    settings = {"analysis.min_samples": 5, "analysis.exclude_press_numbers": [4]}
    found = skinrig.analyze(path, settings, name="five", save=True)
    assert found["analysis"]["settings"]["min_samples"] == 5
    session = skinrig.Session(path)
    assert session.variants == ["five"]
    assert session.analysis("five") == json.loads(beside(path, ".analysis-five.results.json").read_text())
    assert session.analysis("five")["analysis"] == found["analysis"]
    assert beside(path, ".analysis-five.report.html").exists()
    run("analyze", path, "--set", "analysis.min_samples=5", "--set", "analysis.exclude_press_numbers=[4]", "--name", "same")
    assert session.analysis("same")["analysis"] == found["analysis"]
    # The press that the variant excludes is still there in the official table.
    assert session.presses.set_index("press").verdict[4] == "valid"


def test_compare_gives_the_results_of_the_command_line(tmp_path, analysed_path):
    other = skinrig.simulate(SMALL, tmp_path, {"prototype.id": "other skin"}, seed=7)
    page = tmp_path / "page.html"
    out, _ = run("--json", "compare", analysed_path, other, "--out", page, "--margin", "rmse=0.5mm")
    expected = json.loads(out)
    expected.pop("files")
    found = skinrig.compare(analysed_path, other, margins=["rmse=0.5mm"], out=tmp_path / "own.html")
    assert found == expected
    assert (tmp_path / "own.html").read_text() == page.read_text()


def test_simulate_is_the_run_of_the_command_line(tmp_path, session_path):
    run("run", SMALL, "--sessions", tmp_path / "a", "--no-analysis")
    (by_command,) = (tmp_path / "a").glob("*.session.sqlite")
    by_text = skinrig.simulate(SMALL.read_text(), str(tmp_path / "b"))
    a, b, c = (skinrig.Session(path) for path in [by_command, by_text, session_path])
    assert a.presses.drop(columns="session_id").equals(b.presses.drop(columns="session_id"))
    assert a.presses.drop(columns="session_id").equals(c.presses.drop(columns="session_id"))
    assert a.poses.equals(b.poses)
    assert a.header["plan_sha256"] == b.header["plan_sha256"]
    run("verify", by_text)


def told(error):
    """The text that the command line prints."""
    return str(error.value) + "\n"


def test_errors_have_the_text_of_the_command_line(tmp_path, session_path):
    missing = tmp_path / "missing.session.sqlite"
    with pytest.raises(skinrig.InputError) as error:
        skinrig.Session(missing)
    assert told(error) == run("show", missing, code=2)[1]
    with pytest.raises(skinrig.InputError) as error:
        skinrig.analyze(session_path, {"analysis.min_sampels": 5})
    assert told(error) == run("analyze", session_path, "--set", "analysis.min_sampels=5", code=2)[1]
    with pytest.raises(skinrig.InputError) as error:
        skinrig.simulate(SMALL, tmp_path, {"depth": "9 mm"})
    assert told(error) == run("run", SMALL, "--sessions", tmp_path, "--set", "depth=9 mm", code=2)[1]
    with pytest.raises(skinrig.InputError, match="`skinrig analyze .* writes them"):
        skinrig.Session(session_path).analysis()
    with pytest.raises(skinrig.InputError) as error:
        skinrig.Session(session_path).analysis("five")
    assert told(error) == run("report", session_path, "--analysis", "five", code=2)[1]
    with pytest.raises(TypeError, match="two or more skins, found 1"):
        skinrig.compare(session_path)


def test_damage_has_an_exception_of_its_own(tmp_path, session_path):
    no_session = tmp_path / "x.session.sqlite"
    no_session.write_text("no database" * 100)
    with pytest.raises(skinrig.DamagedSessionError):
        skinrig.Session(no_session)
    # Bytes of a camera, in the middle of the file.
    damaged = tmp_path / session_path.name
    content = bytearray(session_path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 64] = bytes(b ^ 0x55 for b in content[middle : middle + 64])
    damaged.write_bytes(content)
    with pytest.raises(skinrig.DamagedSessionError) as error:
        skinrig.analyze(damaged)
    assert told(error) == run("analyze", damaged, code=2)[1]
    assert issubclass(skinrig.DamagedSessionError, skinrig.InputError)
    assert issubclass(skinrig.InputError, skinrig.SkinrigError)


def test_a_fault_of_the_rig_keeps_the_session(tmp_path):
    protocol = SMALL.read_text() + "\nfaults: [camera1-unplugged@hold:5]\n"
    with pytest.raises(skinrig.RigError, match="everything recorded so far is kept"):
        skinrig.simulate(protocol, tmp_path)
    (path,) = tmp_path.glob("*.session.sqlite")
    assert skinrig.Session(path).header["end"] == "faulted"


def test_ctrl_c_stops_a_simulation(tmp_path):
    # A shell starts what runs in the background with ctrl-C ignored, and Python leaves it so.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        interrupted_simulation(tmp_path)
    finally:
        signal.signal(signal.SIGINT, before)


def interrupted_simulation(tmp_path):
    long = {"repetitions.count": 300, "evaluation.score": list(range(1, 301))}
    ended = threading.Event()

    def interrupt():
        while not (list(tmp_path.glob("*.session.sqlite")) or ended.is_set()):
            ended.wait(0.01)
        signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        skinrig.simulate(SMALL, tmp_path, long)
    ended.set()
    thread.join()
    (path,) = tmp_path.glob("*.session.sqlite")
    assert skinrig.Session(path).header["end"] == "stopped"


def test_long_calls_release_the_interpreter(session_path):
    # This thread goes on while the other one is within the call.
    inside = threading.Event()
    ended = threading.Event()

    def analyze():
        inside.set()
        skinrig.analyze(session_path)
        ended.set()

    thread = threading.Thread(target=analyze)
    thread.start()
    inside.wait()
    turns = 0
    while not ended.is_set():
        ended.wait(0.001)
        turns += 1
    thread.join()
    assert turns > 5


@pytest.mark.parametrize("within_mm", [0, -1, float("nan"), float("inf")])
def test_an_impossible_error_threshold_is_refused(analysed_path, within_mm):
    with pytest.raises(skinrig.InputError, match="within: expected an error threshold above 0 mm"):
        skinrig.compare(analysed_path, analysed_path, within_mm=within_mm)
