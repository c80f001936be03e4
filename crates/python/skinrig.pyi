"""Sessions of tactile-skin campaigns: tables, events, analyses, comparisons and simulated campaigns.

Names of columns and fields end in their unit. Positions are in the skin's frame. Times in `_s` and `_ns` count from the session's
start on the host clock, times in `_us` are on one camera's clock.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Optional, Union, final

import numpy as np
import pandas as pd

_Path = Union[str, "os.PathLike[str]"]
_Setting = Union[str, int, float, bool, list[Any]]

@final
class Session:
    """A session file, opened for reading, sealed or still growing.

    Tables have the columns of `skinrig export`. `presses`, `results` and `events` need the session's analysis: the results beside
    the session if they are of this version, else it is analysed once, in memory. The tables of an INVALID session raise
    `InvalidSessionWarning`.
    """

    def __new__(cls, path: _Path) -> Session: ...
    @property
    def path(self) -> Path: ...
    @property
    def protocol(self) -> str:
        """The protocol or schedule, as the user wrote it."""
    @property
    def header(self) -> dict[str, Any]:
        """Facts: `session_id`, `prototype`, `operator`, `started` (RFC 3339), `seed`, `rig`, `sealed`, `end` and others."""
    @property
    def presses(self) -> pd.DataFrame:
        """One row per planned press, with its analysis: lengths in mm, host times in s, camera times in µs."""
    @property
    def results(self) -> pd.DataFrame:
        """One row per metric, with its 95 % interval."""
    @property
    def poses(self) -> pd.DataFrame:
        """One row per pose sample of the robot: `t_ns` on the host clock, positions in mm, force in N."""
    @property
    def marks(self) -> pd.DataFrame:
        """One row per mark that the trigger box sent: `kind`, `press`, `t_ns`, `uncertainty_ns`."""
    def columns(
        self, table: Literal["presses", "results", "poses", "marks"]
    ) -> dict[str, Union[np.ndarray[Any, Any], list[Optional[str]]]]:
        """A table without pandas, as `polars.DataFrame` and `pyarrow.table` take it."""
    def events(self, press: int, camera: Literal[1, 2], margin_ms: float = 50.0) -> np.ndarray[Any, Any]:
        """Events from `margin_ms` before contact to `margin_ms` after release: `t_us` (this camera's clock), `x_px`, `y_px`, `on`."""
    @property
    def variants(self) -> list[str]:
        """Names of the variants of the analysis beside the session."""
    def analysis(self, name: Optional[str] = None) -> dict[str, Any]:
        """The results that `skinrig analyze` stored beside the session; with a `name` those of a variant.

        INVALID ones raise `InvalidSessionWarning`.
        """

def analyze(
    path: _Path,
    settings: Optional[Mapping[str, _Setting]] = None,
    *,
    name: Optional[str] = None,
    reference_code: bool = False,
    calibration_from: Optional[_Path] = None,
    save: bool = False,
) -> dict[str, Any]:
    """Analyse a session as `skinrig analyze` does; `settings` are the keys and values of `--set`. `save` writes the files too."""

def compare(
    *skins: _Path,
    sessions: Optional[_Path] = None,
    limits: Optional[_Path] = None,
    margins: Sequence[str] = (),
    within_mm: Optional[float] = None,
    despite: Sequence[str] = (),
    analysis: Optional[str] = None,
    out: Optional[_Path] = None,
) -> dict[str, Any]:
    """Compare skins (sessions, folders, names of prototypes) as `skinrig compare` does. `out` writes the page too."""

def simulate(
    protocol: _Path,
    out: _Path,
    set: Optional[Mapping[str, _Setting]] = None,
    *,
    level: Optional[Literal["kinematic", "geometric", "optical"]] = None,
    seed: Optional[int] = None,
) -> Path:
    """Run a campaign on the simulated rig; `protocol` is a path, or a text of several lines. Returns the session in folder `out`."""

class SkinrigError(Exception):
    """A failure, with the text that the command line prints."""

class InputError(SkinrigError):
    """Bad input: an argument, a protocol, or a session file (exit code 2)."""

class DamagedSessionError(InputError):
    """A file is damaged, or no session."""

class RigError(SkinrigError):
    """A fault of the rig (exit code 3). The session is kept."""

class LimitError(SkinrigError):
    """A limit was not met (exit code 4)."""

class StoppedError(SkinrigError):
    """The run was stopped (exit code 5). The session is kept."""

class MachineError(SkinrigError):
    """A fault of skinrig or of this machine, for example a full disk (exit code 1)."""

class InvalidSessionWarning(UserWarning):
    """The session is INVALID: use none of its numbers."""
