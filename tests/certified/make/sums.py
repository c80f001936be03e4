"""Sums of up to 10^9 terms.

Method A: exact fractions, term by term of one period, times the number of periods; for ramps by doubling.
Method B: mpmath; moments by closed formulas.
"""

from fractions import Fraction

from mpmath import mp, mpf

import rational
from certify import Problem, exact

NAME = "sums"
ABOUT = (
    "Sum, mean, root mean square and variance (divided by n) of n terms: term i (from 0) is cycle[i mod length], or "
    "(i + 1) ramp, which is exact for the powers of two given."
)
BILLION = 1_000_000_000


def cycle_fractions(cycle, n):
    """Sum, sum of squares, mean square distance from the mean, sum of sizes, sum of |distance| |x|."""
    length = len(cycle)
    times = [n // length + (1 if i < n % length else 0) for i in range(length)]
    terms = [(exact(v), k) for v, k in zip(cycle, times)]
    total = sum(v * k for v, k in terms)
    mean = total / n
    return (
        total,
        sum(v * v * k for v, k in terms),
        sum((v - mean) ** 2 * k for v, k in terms) / n,
        sum(abs(v) * k for v, k in terms),
        sum(abs(v - mean) * abs(v) * k for v, k in terms),
    )


def cycle_moments(cycle, n):
    length = len(cycle)
    whole, rest = divmod(n, length)
    with mp.workdps(120):
        sums = []
        for power in (1, 2):
            all_, some = mp.fsum(mpf(v) ** power for v in cycle), mp.fsum(mpf(v) ** power for v in cycle[:rest])
            sums.append(all_ * whole + some)
        mean = sums[0] / n
        return sums[0], sums[1], sums[1] / n - mean * mean


def ramp_doubling(n):
    """Sums of the first n integers and of their squares, from those of n / 2."""
    if n == 0:
        return 0, 0
    half = n // 2
    one, two = ramp_doubling(half)
    one, two = 2 * one + half * half, 2 * two + 2 * half * one + half**3
    return (one + n, two + n * n) if n % 2 else (one, two)


def sums(name, level, about, n, cycle=None, ramp=None, quantities=("sum", "mean", "rms", "variance")):
    inputs = {"n": n, **({"cycle": cycle} if cycle else {"ramp": ramp})}
    problem = Problem(name, level, about, inputs)
    if cycle:
        total, squares, variance, sizes, distances = cycle_fractions(cycle, n)
        other = cycle_moments(cycle, n)
    else:
        unit = exact(ramp)
        one, two = ramp_doubling(n)
        total, squares = one * unit, two * unit * unit
        mean = total / n
        variance = squares / n - mean * mean
        sizes, distances = total, n * variance * 2
        m, u = mpf(n), mpf(ramp)
        other = m * (m + 1) / 2 * u, m * (m + 1) * (2 * m + 1) / 6 * u * u, (m * m - 1) / 12 * u * u
    of_sum = sizes / abs(total) if total else sizes
    of_variance = 2 * distances / n / variance if variance else 0
    rows = {
        "sum": (total, other[0], of_sum),
        "mean": (total / n, other[0] / n, of_sum if total else sizes / n),
        "rms": (rational.sqrt(squares / n), mp.sqrt(other[1] / n), 1),
        "variance": (variance, other[2], of_variance),
    }
    for quantity in quantities:
        problem.answer(quantity, "1", *rows[quantity])
    return problem


def problems():
    eleven = [0.5 + 0.125 * ((i * 7) % 11 - 5) for i in range(11)]
    offset = [1000000.3 + 0.001 * ((i * 7) % 11 - 5) for i in range(11)]
    wide = [3.7e-9, 4.1e3, -2.2e-4, 9.3e7, 5.5e-13, -8.6e1, 1.9]
    cancelling = [1.0, 1e16, 1.0, -1e16]
    cancel_more = [1e16, 0.1, -1e16, 3e15, -3e15]
    million, odd = 1_000_003, 999_999_937
    return [
        sums("two", "easy", "Two values", 2, [0.1, 0.3]),
        sums("ties", "easy", "A million equal values", million, [0.1], quantities=("sum", "mean", "rms")),
        sums("eleven", "easy", "A million values of eleven kinds", million, eleven),
        sums("offset", "hard", "Mean 1e6, spread 3e-3", million, offset),
        sums("wide", "average", "Twenty orders of magnitude", million, wide),
        sums("cancelling", "hard", "Large terms that cancel", 1_000_000, cancelling),
        sums("cancel-more", "hard", "Pairs that cancel, one small term", 1_000_000, cancel_more),
        sums("zero", "average", "A sum of exactly 0", 1_000_000, [0.1, -0.1, 0.7, -0.7]),
        sums("ramp", "average", "1 to a million, times 2^-20", 1_000_000, ramp=2.0**-20),
        sums("billion-ties", "hard", "10^9 equal values", BILLION, [0.1], quantities=("sum", "mean", "rms")),
        sums("billion-eleven", "hard", "About 10^9 values of eleven kinds", odd, eleven),
        sums("billion-offset", "hard", "About 10^9 values, mean 1e6, spread 3e-3", odd, offset),
        sums("billion-cancelling", "hard", "10^9 large terms that cancel", BILLION, cancelling),
        sums("billion-ramp", "hard", "1 to 10^9, times 2^-20", BILLION, ramp=2.0**-20),
    ]
