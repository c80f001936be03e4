"""Hands the requests of `skinrig reanalyze` to the workers of a Dask cluster.

Reads one request per line, prints one line of JSON per answer. A worker runs `skinrig analyze-request`, so that an analysis that dies
takes no worker with it. Results are written beside the sessions: only requests and answers go over the network.
"""

import json
import logging
import sys


def analyze(request, program):
    """Carries out one request on a worker; returns its answer, or why there is none."""
    import os
    import shutil
    import socket
    import subprocess

    program = os.environ.get("SKINRIG") or shutil.which("skinrig") or program
    here = socket.gethostname()
    try:
        ended = subprocess.run(
            [program, "analyze-request"],
            input=request,
            capture_output=True,
            text=True,
            env={"RAYON_NUM_THREADS": "1", **os.environ},
        )
    except OSError as error:
        return {
            "lost": f"{here}: cannot start {program}: {error}\n  next: install skinrig on every worker, or name it there in SKINRIG"
        }
    try:
        return {"answer": json.loads(ended.stdout)}
    except ValueError:
        return {"lost": f"{here}: {program} ended with {ended.returncode}: {ended.stderr[-500:]}"}


def say(**line):
    print(json.dumps(line), flush=True)


def main(address, program):
    try:
        from distributed import Client, as_completed
    except ImportError:
        return say(
            failed=f"expected the package `distributed`, found none in {sys.executable}\n"
            "  next: pip install distributed, or name another interpreter in SKINRIG_PYTHON"
        )
    # What it logs is said below, in a line.
    logging.disable(logging.CRITICAL)
    try:
        client = Client(address, timeout="10s")
    except Exception as error:
        return say(failed=f"expected a Dask scheduler at {address}, found none: {error}")
    if not client.scheduler_info(n_workers=-1)["workers"]:
        say(note=f"{address}: no workers yet; waiting for one")
    requests = sys.stdin.read().splitlines()
    # Not pure: a repeated command asks again.
    futures = client.map(analyze, requests, program=program, pure=False)
    places = {future.key: at for at, future in enumerate(futures)}
    for future in as_completed(futures):
        at = places[future.key]
        if future.status == "finished":
            say(at=at, **future.result())
        else:
            why = future.exception() if future.status == "error" else f"the request was {future.status}: is the scheduler gone?"
            say(at=at, lost=f"the cluster lost it: {why}")


main(*sys.argv[1:])
