"""Lines through simultaneous times of two clocks, and times mapped by such a line.

Method A: exact fractions; normal equations with plain sums.
Method B: mpmath; an orthogonal factorisation (QR) of the equations.
"""

from fractions import Fraction

from mpmath import matrix, mp, mpf

import rational
from certify import Problem, exact, number

NAME = "clocks"
ABOUT = (
    "Ordinary least squares line camera = offset + (1 + drift) host through pairs of times, us; standard error of the drift with "
    "n - 2 degrees of freedom, root mean square (divided by n) and largest residual. Or a map: camera = offset + host + drift host "
    "and its inverse. Condition numbers are those for relative changes of the deviations camera - host and of the host times, both "
    "less those of the first pair: such differences of whole us are exact."
)
WEEK_US = 604_800_000_000


def line_fractions(pairs):
    """offset, drift, standard error, rms, largest residual."""
    pairs = [(exact(h), exact(c)) for h, c in pairs]
    n = len(pairs)
    sx, sy = sum(h for h, _ in pairs), sum(c - h for h, c in pairs)
    sxx, sxy = sum(h * h for h, _ in pairs), sum(h * (c - h) for h, c in pairs)
    drift = (n * sxy - sx * sy) / (n * sxx - sx * sx)
    offset = (sy - drift * sx) / n
    residuals = [c - h - offset - drift * h for h, c in pairs]
    squares = sum(r * r for r in residuals)
    spread = sxx - sx * sx / n
    error = rational.sqrt(squares / (n - 2) / spread)
    return offset, drift, error, rational.sqrt(squares / n), max(abs(r) for r in residuals), residuals


def line_qr(pairs):
    n = len(pairs)
    a, b = matrix(n, 2), matrix(n, 1)
    for i, (h, c) in enumerate(pairs):
        a[i, 0], a[i, 1], b[i] = 1, mpf(h) / 10**9, mpf(c)
    # Camera times themselves: the slope is 1 + drift.
    x, residual = mp.qr_solve(a, b)
    slope = x[1] / 10**9
    rest = [mpf(c) - x[0] - slope * h for h, c in pairs]
    mean = mp.fsum(mpf(h) for h, _ in pairs) / n
    spread = mp.fsum((h - mean) ** 2 for h, _ in pairs)
    norm = residual if n > 2 else mpf(0)
    error = norm / mp.sqrt(n - 2) / mp.sqrt(spread)
    return x[0], slope - 1, error, norm / mp.sqrt(n), max(abs(r) for r in rest)


def conditions(pairs):
    offset, drift, error, rms, largest, residuals = line_fractions(pairs)
    h0, c0 = (exact(v) for v in pairs[0])
    x = [exact(h) - h0 for h, _ in pairs]
    y = [exact(c) - c0 - exact(h) + h0 for h, c in pairs]
    n = len(pairs)
    mean = sum(x) / n
    spread = sum((v - mean) ** 2 for v in x)
    # Size of the change of each deviation.
    size = [abs(b) + abs(drift * a) for a, b in zip(x, y)]
    of_drift = sum(abs(a - mean) / spread * s for a, s in zip(x, size))
    of_offset = sum(abs(Fraction(1, n) - (a - mean) / spread * (mean + h0)) * s for a, s in zip(x, size))
    of_rms = sum(abs(r) * s for r, s in zip(residuals, size)) / n / (rms or 1)
    ratio = lambda change, value: change / abs(value) if value else change
    relative = ratio(of_rms, rms)
    return [ratio(of_offset + abs(offset), offset), ratio(of_drift, drift), relative, relative, relative]


def line(name, level, about, pairs, marks=False):
    kind = "marks" if marks else "pairs"
    inputs = {"floor_us": 1.0, f"{kind}_us": [list(p) for p in pairs]}
    problem = Problem(name, level, about, inputs)
    one, two, condition = line_fractions(pairs)[:5], line_qr(pairs), conditions(pairs)
    quantities = [("offset", "us"), ("drift", "1"), ("drift_se", "1"), ("rms", "us"), ("largest", "us")]
    for i, (quantity, unit) in enumerate(quantities):
        if not (marks and quantity == "drift_se"):
            problem.answer(quantity, unit, one[i], two[i], condition[i])
    return problem


def refused(name, about, pairs, outcome, marks=False):
    kind = "marks" if marks else "pairs"
    return Problem(name, "easy", about, {"floor_us": 1.0, f"{kind}_us": [list(p) for p in pairs]}, outcome)


def mapped(name, level, about, offset, drift_ppm, host):
    """Both directions of a map."""
    inputs = {"offset_us": offset, "drift_ppm": drift_ppm, "host_us": host}
    o, d, h = exact(offset), exact(drift_ppm) / 10**6, exact(host)
    camera = o + h + d * h
    problem = Problem(name, level, about, inputs)
    size = (abs(o) + abs(h) + 2 * abs(d * h)) / abs(camera)
    problem.answer("camera", "us", camera, mpf(offset) + mpf(host) * (1 + mpf(drift_ppm) / mpf(10) ** 6), size)
    # The way back, from the same number as camera time.
    back = (h - o) / (1 + d)
    other = (mpf(host) - mpf(offset)) / (1 + mpf(drift_ppm) / mpf(10) ** 6)
    condition = (abs(h) + abs(o)) / abs(h - o) + abs(d)
    return problem.answer("host", "us", back, other, condition)


def ticks(n, period, offset, ppm, jitter):
    """Whole microseconds of a drifting counter; jitter cycles."""
    pairs = []
    for i in range(n):
        host = 5_000_000 + i * period
        drifted = host * (1_000_000 + ppm) // 1_000_000
        pairs.append((host, offset + drifted + jitter[i % len(jitter)]))
    return pairs


def problems():
    hour = 3_600_000_000
    jitter = [0, 1, -1, 0, 0, 1, -1, -1, 1, 0, 1]
    sparse = [0, 0, 1, 0, -1, 0, 0]
    exactly = [(i * 1_024_000_000, i * 1_025_000_000 + 77) for i in range(20)]
    late = [(i * WEEK_US // 8, 31 + i * WEEK_US // 8 + (1 if i == 8 else 0)) for i in range(9)]
    return [
        line("hour", "easy", "An hour of marks, 37 ppm", ticks(60, 60_000_000, 12_345_678, 37, jitter)),
        line("week-fast", "average", "1000 ppm over a week, whole ticks", ticks(169, hour, 12_345_678, 1000, jitter)),
        line("week-slow", "average", "-1000 ppm over a week, whole ticks", ticks(169, hour, 3_000_000, -1000, sparse)),
        line("wrap-32", "average", "Unwrapped counter that passes 2^32", ticks(50, 20_000_000, 2**32 - 500_000_000, 250, jitter)),
        line("wrap-34", "average", "Unwrapped counter that passes 2^34", ticks(50, 20_000_000, 2**34 - 500_000_000, -250, jitter)),
        line("before-2-53", "hard", "Counter just below 2^53", ticks(50, 20_000_000, 2**53 - 2_000_000_000, 1000, jitter)),
        line("one-tick", "hard", "Three pairs, the middle one a tick late", [(0, 1000), (10_000_000, 10_001_001), (20_000_000, 20_001_000)]),
        line("one-tick-week", "hard", "A week without drift, the last of nine pairs a tick late", late),
        line("on-the-line", "easy", "Pairs exactly on a line of 976.5625 ppm", exactly),
        line("marks-wrap-34", "average", "Marks that a camera sees around 2^34", ticks(40, 1_750_111, 2**34 - 40_000_000, 1000, sparse), marks=True),
        line("marks-2-60", "hard", "Marks that a camera sees at 2^60", ticks(40, 1_750_111, 2**60 + 7, -1000, jitter), marks=True),
        refused("two-pairs", "Two pairs leave no residual", [(0, 5), (1_000_000, 1_000_005)], "too few"),
        refused("one-instant", "No spread in time", [(7, 5), (7, 6), (7, 5), (7, 6)], "no spread"),
        refused("marks-broken", "Camera times from 2^62 on: a broken time base", ticks(40, 1_750_111, 2**62 + 7, 0, sparse), "broken", marks=True),
        refused("marks-no-clock", "A drift of 2 % is no clock", ticks(40, 1_750_111, 5_000_000, 20_000, sparse), "no clock", marks=True),
        mapped("map-week", "easy", "1000 ppm after a week", 12_345_678.25, 1000.0, float(WEEK_US) + 0.5),
        mapped("map-2-60", "hard", "Offset 2^60", 2.0**60, -1000.0, float(WEEK_US)),
        mapped("map-one-tick", "average", "Host time of one tick", -3e6, 1000.0, 1.0),
    ]
