"""DBSCAN's core and noise from pixel counts, in numpy: sums over discs, by row sums or Fourier transform."""

from functools import lru_cache

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

WIDTH = 640


def disc_halves(eps):
    """Half width of the disc at each row distance."""
    reach = int(eps)
    return [int(np.sqrt(eps * eps - dy * dy)) for dy in range(reach + 1)]


def disc_sums(counts, halves):
    """For each pixel, the sum of `counts` (rows x columns) over the disc around it."""
    rows, width = counts.shape
    reach = len(halves) - 1
    # sums[:, reach + 1 + x] is the sum of the columns up to x, with padding on both sides.
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


@lru_cache
def disc_transform(halves, shape):
    """The Fourier transform of the disc, computed once."""
    reach = len(halves) - 1
    disc = np.zeros((2 * reach + 1, 2 * reach + 1))
    for dy, half in enumerate(halves):
        disc[[reach - dy, reach + dy], reach - half : reach + half + 1] = 1
    return rfft2(disc, shape)


def disc_sums_fft(counts, halves):
    """The same by convolution with the disc; sums are integers, so rounding removes the transform's error."""
    reach = len(halves) - 1
    shape = tuple(next_fast_len(n + 2 * reach, real=True) for n in counts.shape)
    sums = irfft2(rfft2(counts, shape) * disc_transform(tuple(halves), shape), shape)
    rows, width = counts.shape
    return np.rint(sums[reach : reach + rows, reach : reach + width]).astype(np.int32)


def core_and_clustered(counts, eps, min_samples, sums=disc_sums):
    """Which pixels are core, and which are core or border."""
    halves = disc_halves(eps)
    occupied = counts > 0
    core = occupied & (sums(counts, halves) >= min_samples)
    return core, occupied & (sums(core, halves) > 0)


def counts_of(u, v, rows):
    """Events per pixel of the rows `rows[0]..=rows[1]`; all events lie in them."""
    height = rows[1] - rows[0] + 1
    index = (v.astype(np.int32) - rows[0]) * WIDTH + u
    return np.bincount(index, minlength=height * WIDTH).reshape(height, WIDTH).astype(np.int32)
