"""Runs the tasks of a comparison: by hand, each a few times, or one at a time on request of the benchmark."""

import importlib.metadata
import json
import sys
import time
from pathlib import Path


def measured(task, folder):
    """Runs a task once: its result with wall and CPU seconds. Later checks of the task are not timed.

    A task is a function of the folder that returns (work, check): `work` is timed, `check(result)` gives what
    is reported of the result.
    """
    work, check = task(folder)
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    # A task that uses other processes, or does only a fraction of the work, reports this itself.
    return {"seconds": wall, "cpu_seconds": cpu, **check(result)}


def main(tasks, packages):
    """`SCRIPT FOLDER` runs every task three times and prints the best; `SCRIPT FOLDER --serve` answers each
    line on its input, a task's name, with one run."""
    folder = Path(sys.argv[1])
    versions = ", ".join(f"{p} {importlib.metadata.version(p)}" for p in packages)
    print(versions, flush=True)
    if sys.argv[2:] == ["--serve"]:
        for line in sys.stdin:
            print(json.dumps(measured(tasks[line.strip()], folder)), flush=True)
        return
    for name, task in tasks.items():
        runs = [measured(task, folder) for _ in range(3)]
        best = min(runs, key=lambda run: run["seconds"])
        print(json.dumps({"task": name, **best}), flush=True)
