"""The choices of the public analysis code, reimplemented: per press, DBSCAN of all events in the
three seconds around it, a CUSUM detector step by step in Python, one factor of data reduction.

All of it takes an hour, so each task does a fraction, spread evenly over the presses, and reports the fraction.
"""

import json

import h5py
import numpy as np
from common import main
from sklearn.cluster import DBSCAN

SETS = 12
LATENCY_PRESSES = 24
BIN_S, SIGMA_S, ALPHA, CONSECUTIVE = 0.2e-3, 0.5e-3, 4.0, 3


def presses(folder, count):
    """Settings, and (camera, press, times in µs, u, v) of evenly spread windows."""
    s = json.loads((folder / "repetition.json").read_text())
    n = len(s["truth"])
    out = []
    for k in (0, 1):
        with h5py.File(folder / f"camera{k + 1}.hdf5") as file:
            ts, x, y = (file["data"][f'"{key}"'][:] for key in ("ts", "x", "y"))
        low, high = s["rows"][k]
        inside = (y >= low) & (y <= high)
        t, x, y = np.rint(ts[inside] * 1e6), x[inside], y[inside]
        for i in np.linspace(0, n - 1, count // 2).astype(int):
            a, b = np.searchsorted(t, s["windows"][k][i])
            out.append((k, i, t[a:b], x[a:b], y[a:b]))
    return s, n, out


def centroids(sets, eps, min_samples):
    out = []
    for _, _, _, u, v in sets:
        points = np.column_stack([u, v]).astype(float)
        labels = DBSCAN(eps=eps, min_samples=min_samples).fit_predict(points)
        kept = points[labels >= 0]
        out.append(kept[:, 0].mean() if len(kept) else np.nan)
    return np.array(out)


def clustering(folder):
    """The centroids of all presses; no other part of a repetition."""
    s, n, sets = presses(folder, SETS)

    def check(found):
        ours = np.array([s["columns"][k][i] for k, i, *_ in sets], float)
        return {"agrees": bool((np.abs(found - ours) <= 1e-9).all()), "share": len(sets) / (2 * n)}

    return lambda: centroids(sets, s["eps_px"], s["min_samples"]), check


def reduction(folder):
    """One factor and one seed: exactly max(1, n // k) events of each press; each event is a cluster."""
    factor = 4
    s, n, sets = presses(folder, SETS)
    random = np.random.default_rng(0)

    def work():
        thinned = []
        for k, i, t, u, v in sets:
            kept = random.choice(len(u), max(1, len(u) // factor), replace=False)
            thinned.append((k, i, t, u[kept], v[kept]))
        return centroids(thinned, s["eps_px"], 1)

    # Every event is core: the centroid is the mean.
    def check(found):
        return {"agrees": bool(np.isfinite(found).all()), "share": len(sets) / (2 * n)}

    return work, check


def kernel():
    taps = np.arange(-10, 11) * BIN_S
    weights = np.exp(-0.5 * (taps / SIGMA_S) ** 2)
    return weights / weights.sum()


def detect(times_s, length_s, rate_per_s, threshold, weights):
    """The first of three bins in a row above the threshold, s; None without one."""
    edges = np.arange(0, length_s + BIN_S, BIN_S)
    counts = np.convolve(np.histogram(times_s, edges)[0], weights, mode="same")
    gain, loss = np.log(ALPHA), (ALPHA - 1) * rate_per_s * BIN_S
    sum_, above = 0.0, 0
    for i, count in enumerate(counts):
        sum_ = max(0.0, sum_ + count * gain - loss)
        above = above + 1 if sum_ >= threshold else 0
        if above == CONSECUTIVE:
            return edges[i - CONSECUTIVE + 1] + BIN_S / 2
    return None


def latency(folder):
    """One threshold, one camera: trials and backgrounds."""
    s, n, sets = presses(folder, 2 * LATENCY_PRESSES)
    sets = sets[:LATENCY_PRESSES]
    trials = []
    for k, i, t, *_ in sets:
        middle = sum(s["windows"][k][i]) / 2
        trial = (t[np.abs(t - middle) <= 0.85e6] - middle + 0.85e6) * 1e-6
        after = (t[(t >= middle + 0.6e6) & (t < middle + 1.5e6)] - middle - 0.6e6) * 1e-6
        trials.append((trial, after))
    weights = kernel()

    def work():
        found = 0
        for trial, background in trials:
            span = background.max() - background.min() if len(background) > 1 else 0.0
            rate = len(background) / span if span > 0 else 1e-3
            found += detect(trial, 1.7, rate, 18.0, weights) is not None
            detect(background, 0.9, rate, 18.0, weights)
        return found

    return work, lambda found: {"agrees": found > 0, "share": len(trials) / n, "detected": found}


if __name__ == "__main__":
    main({"clustering": clustering, "reduction": reduction, "latency": latency},
         ["numpy", "scikit-learn", "h5py"])
