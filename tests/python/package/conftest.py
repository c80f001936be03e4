"""Sessions that the tests of the package share, recorded by the simulated rig. `SKINRIG` names the command line program."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
import skinrig

ROOT = Path(__file__).parents[3]
SMALL = ROOT / "crates/cli/tests/fixtures/small.yaml"


def run(*words, code=0):
    """Runs the command line program; what it printed."""
    program = os.environ.get("SKINRIG", str(ROOT / "target/debug/skinrig"))
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout, done.stderr


@pytest.fixture(scope="session")
def session_path(tmp_path_factory):
    """A session without results beside it."""
    return skinrig.simulate(SMALL, tmp_path_factory.mktemp("sessions"))


@pytest.fixture(scope="session")
def analysed_path(session_path, tmp_path_factory):
    """The same session with the results of the command line beside it."""
    copy = tmp_path_factory.mktemp("analysed") / session_path.name
    shutil.copy(session_path, copy)
    run("analyze", copy)
    return copy


@pytest.fixture(scope="session")
def exported(analysed_path, tmp_path_factory):
    """Folder of its export."""
    folder = tmp_path_factory.mktemp("export")
    run("export", analysed_path, "--to", "parquet", "--to", "npz", "--out", folder)
    return folder


@pytest.fixture
def session(analysed_path):
    return skinrig.Session(analysed_path)
