"""DBSCAN's core and noise from pixel counts, in numpy: sums over discs from sums along rows."""

import numpy as np

WIDTH = 640


def disc_halves(eps):
    """Half width of the disc at each row distance."""
    reach = int(eps)
    return [int(np.sqrt(eps * eps - dy * dy)) for dy in range(reach + 1)]


def disc_sums(counts, halves):
    """For each pixel, the sum of `counts` (rows x columns) over the disc about it."""
    rows, width = counts.shape
    reach = len(halves) - 1
    # sums[:, reach + 1 + x] is the sum of the columns up to x, with room on both sides.
    sums = np.zeros((rows, width + 2 * reach + 1), np.int32)
    np.cumsum(counts, axis=1, out=sums[:, reach + 1 : reach + 1 + width])
    sums[:, reach + 1 + width :] = sums[:, reach + width : reach + width + 1]
    out = np.zeros((rows, width), np.int32)
    for dy, half in enumerate(halves):
        right = reach + 1 + half
        left = reach - half
        row = sums[:, right : right + width] - sums[:, left : left + width]
        out[dy:] += row[: rows - dy]
        if dy:
            out[: rows - dy] += row[dy:]
    return out


def core_and_clustered(counts, eps, min_samples):
    """Which pixels are core, and which are core or border."""
    halves = disc_halves(eps)
    occupied = counts > 0
    core = occupied & (disc_sums(counts, halves) >= min_samples)
    return core, occupied & (disc_sums(core, halves) > 0)


def counts_of(u, v, rows):
    """Events per pixel of the rows `rows[0]..=rows[1]`; all events lie in them."""
    height = rows[1] - rows[0] + 1
    index = (v.astype(np.int32) - rows[0]) * WIDTH + u
    return np.bincount(index, minlength=height * WIDTH).reshape(height, WIDTH).astype(np.int32)
