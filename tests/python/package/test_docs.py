"""Runs the code of the documentation, in this interpreter: the notebook, and the part of docs/how-to/python.md that uses the package."""

import json
import shutil
import textwrap

import matplotlib
import skinrig
from conftest import ROOT, SMALL

matplotlib.use("Agg")


def is_picture(path):
    content = path.read_bytes()
    return content.startswith(b"\x89PNG") and len(content) > 5_000


def test_the_notebook_runs_and_has_no_outputs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SESSION", raising=False)
    notebook = json.loads((ROOT / "docs/how-to/paper-figures.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) > 3
    names = {}
    for cell in cells:
        assert not cell["outputs"] and cell["execution_count"] is None
        exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
    assert all(is_picture(tmp_path / name) for name in ["error-map.png", "errors.png", "rates.png"])
    assert len(names["scored"]) > 40


def test_the_page_runs(tmp_path, monkeypatch, session_path):
    (tmp_path / "sessions").mkdir()
    shutil.copy(session_path, tmp_path / "sessions")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/how-to/python.md").read_text().split("## Without the package")[0]
    code = "".join(block.split("```")[0] for block in page.split("```python\n")[1:])
    names = {}
    exec(compile(code, "python.md", "exec"), names)
    assert is_picture(tmp_path / "errors.png") and is_picture(tmp_path / "press.png")
    assert len(names["comparison"]["skins"]) == 2


def test_the_figure_of_two_skins_is_drawn(tmp_path, monkeypatch):
    for skin in ["simulated skin", "cloudy skin"]:
        skinrig.simulate(SMALL, tmp_path / "sessions", {"prototype.id": skin})
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/tutorial/two-skins.md").read_text()
    (code,) = [block.split("```")[0] for block in page.split("```python\n")[1:]]
    names = {}
    exec(compile(textwrap.dedent(code), "two-skins.md", "exec"), names)
    assert is_picture(tmp_path / "skins.png")
    assert set(names["scored"].prototype) == {"simulated skin", "cloudy skin"}
