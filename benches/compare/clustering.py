"""Clusters the events of one press in five ways; core and noise must equal the benchmark's."""

import json

import numpy as np
from common import main
from dbscan import DBSCAN as fast_dbscan
from grid import core_and_clustered, counts_of, disc_sums, disc_sums_fft
from sklearn.cluster import DBSCAN

NOISE, BORDER, CORE = range(3)


def load(folder):
    settings = json.loads((folder / "press.json").read_text())
    pixels = np.fromfile(folder / "press.u16", "<u2").reshape(-1, 2)
    classes = np.fromfile(folder / "press.classes.u8", np.uint8)
    return settings, pixels, classes


def agreement(classes, core, noise):
    found = np.where(core, CORE, np.where(noise, NOISE, BORDER))
    return {"agrees": bool((found == classes).all()), "events": len(classes)}


def sklearn_events(folder):
    s, pixels, classes = load(folder)
    points = pixels.astype(float)

    def check(fit):
        core = np.zeros(len(points), bool)
        core[fit.core_sample_indices_] = True
        return agreement(classes, core, fit.labels_ < 0)

    return lambda: DBSCAN(eps=s["eps_px"], min_samples=s["min_samples"]).fit(points), check


def sklearn_pixels(folder):
    s, pixels, classes = load(folder)

    def work():
        points, inverse, counts = np.unique(pixels, axis=0, return_inverse=True, return_counts=True)
        fit = DBSCAN(eps=s["eps_px"], min_samples=s["min_samples"])
        return fit.fit(points.astype(float), sample_weight=counts), inverse

    def check(result):
        fit, inverse = result
        core = np.zeros(len(fit.labels_), bool)
        core[fit.core_sample_indices_] = True
        return agreement(classes, core[inverse], fit.labels_[inverse] < 0)

    return work, check


def cpp_events(folder):
    s, pixels, classes = load(folder)
    points = pixels.astype(float)

    def check(result):
        labels, core = result
        return agreement(classes, core, labels < 0)

    return lambda: fast_dbscan(points, eps=s["eps_px"], min_samples=s["min_samples"]), check


def pixel_grid(folder, sums=disc_sums):
    s, pixels, classes = load(folder)
    u, v = pixels.T

    def work():
        counts = counts_of(u, v, s["rows"])
        return core_and_clustered(counts, s["eps_px"], s["min_samples"], sums)

    def check(result):
        core, clustered = (of[v - s["rows"][0], u] for of in result)
        return agreement(classes, core, ~clustered)

    return work, check


if __name__ == "__main__":
    tasks = {
        "sklearn_events": sklearn_events,
        "sklearn_pixels": sklearn_pixels,
        "cpp_events": cpp_events,
        "pixel_grid": pixel_grid,
        "pixel_grid_fft": lambda folder: pixel_grid(folder, disc_sums_fft),
    }
    main(tasks, ["numpy", "scipy", "scikit-learn", "dbscan"])
