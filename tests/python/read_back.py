"""Reads an export with other people's programs and holds every column against what the reader in Rust said.

Arguments: the folder of the export, the stem of its files, and the folder of the truth: `TABLE.json`, columns as lists, and
`events_cameraN.bin`, events as packed records.
"""

import json
import sys
from pathlib import Path

import h5py
import hickle
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from expelliarmus import Wizard

export, stem, truth = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
RECORD = [("t_us", "<i8"), ("x_px", "<u2"), ("y_px", "<u2"), ("on", "u1")]
compared = 0


def file(ending):
    return export / (stem + ending)


def same(found, expected, what):
    """Numbers to the last bit, none where there is none, texts as they are."""
    global compared
    assert len(found) == len(expected), f"{what}: {len(expected)} rows expected, {len(found)} found"
    if all(v is None for v in expected):
        assert all(v is None or v != v or v == "" for v in found), f"{what}: {found[:5]}"
    elif any(isinstance(v, str) for v in expected):
        found = [None if v is None or v != v or v == "" else v for v in found]
        assert found == [v or None for v in expected], f"{what}: {found[:5]} {expected[:5]}"
    else:
        found = np.asarray(pd.array(found, dtype="Float64").to_numpy(float, na_value=np.nan))
        expected = np.array([np.nan if v is None else v for v in expected], float)
        assert np.array_equal(found, expected, equal_nan=True), f"{what}: {found[:5]} {expected[:5]}"
    compared += 1


def tables(expected, name):
    """One table in all three formats."""
    parquet = pq.read_table(file(f".{name}.parquet"))
    csv = pd.read_csv(file(f".{name}.csv"), float_precision="round_trip")
    npz = np.load(file(".npz"))[name]
    columns = list(expected)
    assert parquet.column_names == list(csv.columns) == list(npz.dtype.names) == columns, name
    for column in columns:
        for kind, values in [
            ("parquet", parquet[column].to_pylist()),
            ("csv", csv[column].to_list()),
            ("npz", npz[column].tolist()),
        ]:
            same(values, expected[column], f"{name}.{column} in {kind}")


for name in ["presses", "results", "pose"]:
    tables(json.loads((truth / f"{name}.json").read_text()), name)
# A number that is missing is missing in Parquet, not a special value.
assert pq.read_table(file(".presses.parquet"))["touched_mm"].null_count > 0
assert pd.read_parquet(file(".presses.parquet"))["press"].dtype == "int64"

for camera in (1, 2):
    name = f"events_camera{camera}"
    expected = np.fromfile(truth / f"{name}.bin", RECORD)
    assert len(expected) > 10_000
    parquet = pq.read_table(file(f".{name}.parquet"))
    csv = pd.read_csv(file(f".{name}.csv"))
    npz = np.load(file(".npz"))[name]
    raw = Wizard(encoding="evt2").read(str(file(f".camera{camera}.raw")))
    flat = h5py.File(file(f".camera{camera}.hdf5"))
    container = hickle.load(file(f".camera{camera}.hdf5"))
    for column in expected.dtype.names:
        for kind, values in [
            ("parquet", parquet[column].to_numpy()),
            ("csv", csv[column].to_numpy()),
            ("npz", npz[column]),
            ("raw", raw[{"t_us": "t", "x_px": "x", "y_px": "y", "on": "p"}[column]]),
        ]:
            assert np.array_equal(values.astype("i8"), expected[column].astype("i8")), f"{name}.{column} in {kind}"
            compared += 1
    # bimvee counts seconds from the first event.
    keys = {"ts": "t_us", "x": "x_px", "y": "y_px", "pol": "on"}
    for key, column in keys.items():
        wanted = expected[column].astype("i8") - (expected["t_us"][0] if key == "ts" else 0)
        scale = 1e6 if key == "ts" else 1
        for kind, values in [("hickle", container[key]), ("h5py", flat["data"][f'"{key}"'][...])]:
            values = np.rint(np.asarray(values, float) * scale).astype("i8")
            assert np.array_equal(values, wanted), f"{name}.{key} in {kind}"
            compared += 1
    assert container["tsOffset"] == -expected["t_us"][0] / 1e6

print(f"{compared} columns compared")
