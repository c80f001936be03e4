"""Tables and events of a session are those of its export."""

import warnings

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
import skinrig
from conftest import SMALL, run


def table(folder, name):
    return pd.read_parquet(next(folder.glob(f"*.{name}.parquet")))


@pytest.mark.parametrize("of, name", [("presses", "presses"), ("results", "results"), ("poses", "pose")])
def test_tables_are_those_of_the_export(session, exported, of, name):
    found = getattr(session, of)
    assert len(found) > 9
    pd.testing.assert_frame_equal(found, table(exported, name), check_exact=True)


def test_a_session_without_results_is_analysed(session_path, exported):
    found = skinrig.Session(session_path).presses
    pd.testing.assert_frame_equal(found, table(exported, "presses"), check_exact=True)


def test_results_of_another_session_are_not_used(analysed_path, exported, tmp_path):
    other = skinrig.simulate(SMALL, tmp_path, seed=6)
    results = analysed_path.with_name(analysed_path.name.replace(".session.sqlite", ".results.json"))
    other.with_name(other.name.replace(".session.sqlite", ".results.json")).write_bytes(results.read_bytes())
    session = skinrig.Session(other)
    assert not session.presses.error_mm.equals(table(exported, "presses").error_mm)
    with pytest.raises(skinrig.InputError, match="results beside it belong to another session"):
        session.analysis()


@pytest.mark.parametrize("camera", [1, 2])
@pytest.mark.parametrize("margin_ms", [0, 50, 1e9])
def test_events_of_a_press_are_those_of_the_stream(session, exported, camera, margin_ms):
    everything = np.load(next(exported.glob("*.npz")))[f"events_camera{camera}"]
    for row in session.presses.itertuples():
        found = session.events(row.press, camera, margin_ms)
        from_us = getattr(row, f"camera{camera}_contact_us") - margin_ms * 1e3
        to_us = getattr(row, f"camera{camera}_release_us") + margin_ms * 1e3
        expected = everything[(everything["t_us"] >= from_us) & (everything["t_us"] <= to_us)]
        assert found.dtype == everything.dtype
        assert np.array_equal(found, expected)
        assert row.role == "sync" or len(found) > 100
    assert margin_ms != 1e9 or len(found) == len(everything)


def test_marks(session):
    marks = session.marks
    assert list(marks.columns) == ["kind", "press", "t_ns", "uncertainty_ns"]
    # Two marks for each press; the first of the session has none before it.
    assert marks.groupby("press").size().eq(2).all()
    contacts = marks[marks.kind == "contact"].set_index("press").t_ns
    expected = session.presses.set_index("press").contact_s * 1e9
    assert (contacts - expected).abs().max() < 20e6


def test_columns_need_no_pandas(session):
    columns = session.columns("presses")
    assert columns["press"].dtype == np.int64 and columns["press"].flags.writeable
    assert columns["role"][0] == "sync" and columns["reason"][-1] is None
    assert pa.table(columns).column_names == list(session.presses.columns)


def test_facts(session, analysed_path):
    assert session.path == analysed_path
    assert session.protocol == SMALL.read_text()
    facts = session.header
    assert facts["prototype"] == "test skin" and facts["seed"] == 5 and facts["sealed"] and facts["origin"] == "simulated"
    assert facts["presses"] == len(session.presses)


def test_what_is_not_there_is_an_error(session):
    with pytest.raises(skinrig.InputError, match="camera 1 or 2, found 3"):
        session.events(1, 3)
    with pytest.raises(skinrig.InputError, match="press 99 on the clock of camera 1"):
        session.events(99, 1)
    with pytest.raises(skinrig.InputError, match="0 ms or more, found NaN"):
        session.events(1, 1, float("nan"))
    with pytest.raises(skinrig.InputError, match="found `walk`"):
        session.columns("walk")


def test_a_resumed_session(tmp_path):
    # Killed after three presses, then resumed: two legs with clocks of their own.
    run("run", SMALL, "--sessions", tmp_path, "--no-analysis", "--fault", "camera1-unplugged@hold:5", code=3)
    (path,) = tmp_path.glob("*.session.sqlite")
    run("resume", path)
    run("export", path, "--to", "parquet", "--to", "npz", "--out", tmp_path / "export")
    session = skinrig.Session(path)
    pd.testing.assert_frame_equal(session.presses, table(tmp_path / "export", "presses"), check_exact=True)
    everything = np.load(next((tmp_path / "export").glob("*.npz")))["events_camera2"]
    for row in session.presses.itertuples():
        found = session.events(row.press, 2, 20)
        window = row.camera2_contact_us - 20e3, row.camera2_release_us + 20e3
        expected = everything[(everything["t_us"] >= window[0]) & (everything["t_us"] <= window[1])]
        assert len(found) > 100 and np.array_equal(found, expected)


def stored_results(session):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        skinrig.analyze(session.path, save=True)
    return session.analysis()


@pytest.mark.parametrize(
    "read",
    [
        lambda s: s.presses,
        lambda s: s.results,
        lambda s: s.columns("presses"),
        stored_results,
        lambda s: skinrig.analyze(s.path),
    ],
)
def test_numbers_of_an_invalid_session_raise_a_warning(tmp_path, read):
    path = skinrig.simulate(SMALL, tmp_path, {"analysis.alignment.max_residual": "0.001 us"})
    with pytest.warns(skinrig.InvalidSessionWarning, match="INVALID, do not use"):
        read(skinrig.Session(path))
