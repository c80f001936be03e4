"""Writes the certified problem set, or compares it with the files: `generate.py FOLDER [--check]`.

Needs Python 3.9 or later with mpmath. Nothing is written unless both methods agree on every answer.
"""

import sys
from pathlib import Path

import calibration
import certify
import clocks
import clusters
import fields
import quantiles
import sums
import triangulation

FAMILIES = [triangulation, calibration, clocks, clusters, fields, quantiles, sums]


def files(only=None):
    """Name and text of every file."""
    families = [(f.NAME, f.ABOUT, f.problems()) for f in FAMILIES if only in (None, f.NAME)]
    texts = {f"{name}.json": certify.family_json(name, about, p) for name, about, p in families}
    inputs, answers = certify.tables([(name, p) for name, _, p in families])
    return {**texts, "inputs.csv": inputs, "answers.csv": answers}


def main():
    folder = Path(sys.argv[1])
    texts = files()
    if "--check" in sys.argv[2:]:
        other = [name for name, text in texts.items() if (folder / name).read_text() != text]
        if other:
            sys.exit(f"other than the generator writes: {', '.join(other)}; next: python3 tests/certified/make/generate.py tests/certified/data")
        return
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    main()
