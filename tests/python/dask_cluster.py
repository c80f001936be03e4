"""A Dask cluster for tests: prints the scheduler's address and the processes of its workers (how many: its argument), then lasts
until its input ends."""

import sys

from distributed import LocalCluster

if __name__ == "__main__":
    workers = int(sys.argv[1])
    with LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        processes = [nanny.process.process.pid for nanny in cluster.workers.values()]
        print(cluster.scheduler_address.removeprefix("tcp://"), *processes, flush=True)
        sys.stdin.read()
